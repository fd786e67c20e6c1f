//! Values that meshes carry, by name: what textures ask for is kept a triangle at a time, so that a lookup needs no mesh.

use scene_desc::MeshDesc;

use crate::Place;

/// Index of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AttributeId(u32);

/// All values that some texture asks for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attributes {
    names: Vec<String>,
    /// For each name: shapes that carry it, ascending.
    carried: Vec<Vec<(u32, Values)>>,
}

/// Values of one shape.
#[derive(Clone, Debug)]
struct Values {
    channels: usize,
    /// Three places a triangle, or one.
    places: usize,
    numbers: Vec<f32>,
}

impl Attributes {
    /// The index of a name, from now on kept.
    pub(crate) fn id(&mut self, name: &str) -> AttributeId {
        let found = self.names.iter().position(|n| n == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.carried.push(Vec::new());
            self.names.len() - 1
        });
        AttributeId(found as u32)
    }

    /// Takes what was asked for from a mesh; shapes come in ascending order.
    pub(crate) fn attach(&mut self, shape: u32, mesh: &MeshDesc) {
        for (name, carried) in self.names.iter().zip(&mut self.carried) {
            let Some(a) = mesh.attributes.iter().find(|a| a.name == *name) else { continue };
            let channels = (a.channels as usize).clamp(1, 3);
            let at =
                |i: usize| a.values.get(i * channels..(i + 1) * channels).unwrap_or(&[0.0; 3][..channels]);
            let numbers = match a.per_face {
                true => (0..mesh.indices.len()).flat_map(at).copied().collect(),
                false => mesh.indices.as_flattened().iter().flat_map(|&i| at(i as usize)).copied().collect(),
            };
            carried.push((shape, Values { channels, places: if a.per_face { 1 } else { 3 }, numbers }));
        }
    }

    /// Three numbers at a point; one stands for all three.
    pub(crate) fn at(&self, id: AttributeId, place: &Place) -> [f32; 3] {
        let carried = &self.carried[id.0 as usize];
        match carried.binary_search_by_key(&place.shape, |(shape, _)| *shape) {
            Ok(i) => carried[i].1.at(place),
            Err(_) => [0.0; 3],
        }
    }

    /// The mean of the numbers at a point.
    pub(crate) fn number(&self, id: AttributeId, place: &Place) -> f32 {
        let [a, b, c] = self.at(id, place);
        if a == b && b == c { a } else { (a + b + c) / 3.0 }
    }

    /// Bytes that they take.
    pub(crate) fn memory(&self) -> usize {
        self.carried.iter().flatten().map(|(_, v)| v.numbers.len() * size_of::<f32>()).sum()
    }
}

impl Values {
    fn at(&self, place: &Place) -> [f32; 3] {
        let first = place.primitive as usize * self.places * self.channels;
        let Some(numbers) = self.numbers.get(first..first + self.places * self.channels) else {
            return [0.0; 3];
        };
        let [b1, b2] = place.at;
        let weights = [1.0 - b1 - b2, b1, b2];
        std::array::from_fn(|c| {
            let c = if c < self.channels {
                c
            } else if self.channels == 1 {
                0
            } else {
                return 0.0;
            };
            match self.places {
                1 => numbers[c],
                _ => weights.iter().zip(numbers.chunks_exact(self.channels)).map(|(w, n)| w * n[c]).sum(),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_desc::MeshAttribute;

    #[test]
    fn values_of_corners_are_interpolated_and_those_of_faces_are_not() {
        let attribute = |name: &str, channels, per_face, values: &[f32]| MeshAttribute {
            name: name.to_owned(),
            channels,
            per_face,
            values: values.to_vec(),
        };
        let mesh = MeshDesc {
            indices: vec![[0, 1, 2], [2, 1, 3]],
            attributes: vec![
                attribute("height", 1, false, &[0.0, 1.0, 2.0, 3.0]),
                attribute("face", 3, true, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
                attribute("uv", 2, false, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
            ],
            ..MeshDesc::default()
        };
        let mut all = Attributes::default();
        let [face, height, uv, none] = ["face", "height", "uv", "none"].map(|n| all.id(n));
        assert_eq!(all.id("height"), height);
        all.attach(4, &mesh);
        let place = Place { shape: 4, primitive: 1, at: [0.5, 0.25] };
        assert_eq!(all.at(height, &place), [0.25 * 2.0 + 0.5 + 0.25 * 3.0; 3]);
        assert_eq!((all.at(face, &place), all.number(face, &place)), ([4.0, 5.0, 6.0], 5.0));
        assert_eq!(all.at(uv, &place), [0.75, 0.5, 0.0]);
        assert_eq!(all.at(none, &place), [0.0; 3]);
        assert_eq!(all.at(height, &Place { shape: 3, ..place }), [0.0; 3]);
    }
}
