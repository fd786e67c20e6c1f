//! Transforms as data: for people their matrix alone, four rows of four; for machines with the inverse, so that every bit
//! comes back.

use std::borrow::Cow;

use glam::DMat4;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{AnimatedTransform, Transform};

type Rows = [[f64; 4]; 4];

/// A transform that moves, as data.
#[derive(Serialize, Deserialize)]
struct Keys {
    start: Transform,
    end: Transform,
    times: [f32; 2],
}

/// What people may write.
#[derive(Deserialize)]
#[serde(untagged)]
enum FixedOrKeys {
    Fixed(Box<Transform>),
    Keys(Box<Keys>),
}

impl Serialize for Transform {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = |m: DMat4| m.transpose().to_cols_array_2d();
        if serializer.is_human_readable() {
            return rows(self.matrix()).serialize(serializer);
        }
        [rows(self.matrix()), rows(self.inverse_matrix())].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Transform {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let matrix = |rows: Rows| DMat4::from_cols_array_2d(&rows).transpose();
        if deserializer.is_human_readable() {
            return Self::from_matrix(matrix(Rows::deserialize(deserializer)?))
                .ok_or_else(|| D::Error::custom("the matrix has no inverse"));
        }
        let [m, inverse] = <[Rows; 2]>::deserialize(deserializer)?;
        Ok(Self::from_pair(matrix(m), matrix(inverse)))
    }
}

impl Serialize for AnimatedTransform {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() && !self.is_animated() {
            return self.start().serialize(serializer);
        }
        Keys { start: self.start(), end: self.end(), times: self.times() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for AnimatedTransform {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = if deserializer.is_human_readable() {
            FixedOrKeys::deserialize(deserializer)?
        } else {
            FixedOrKeys::Keys(Box::new(Keys::deserialize(deserializer)?))
        };
        Ok(match read {
            FixedOrKeys::Fixed(t) => Self::fixed(*t),
            FixedOrKeys::Keys(keys) => Self::new(keys.start, keys.end, keys.times),
        })
    }
}

impl JsonSchema for Transform {
    fn schema_name() -> Cow<'static, str> {
        "Transform".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "description": "An affine map: a matrix of shape (4, 4)." })
    }
}

impl JsonSchema for AnimatedTransform {
    fn schema_name() -> Cow<'static, str> {
        "AnimatedTransform".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "description": "A map, or one that moves: start, end, times." })
    }
}
