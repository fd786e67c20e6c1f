//! Triangles: from the attributes of a primitive, with morph targets and skin as they stand at rest.

use math::{DMat4, DVec3, DVec4, Vec2, Vec3};
use scene_desc::{MeshAttribute, MeshDesc};

use super::container::Container;
use super::json::{Attributes, Primitive};

/// Joints at rest: what each moves a vertex of the skin by.
pub(super) type Joints = Vec<DMat4>;

/// Names of what meshes carry.
pub(super) const COLOR: &str = "COLOR_0";
pub(super) const ALPHA: &str = "COLOR_0.a";

/// The name of a second set of texture coordinates.
pub(super) fn uv_name(set: usize) -> &'static str {
    if set == 0 { "TEXCOORD_0" } else { "TEXCOORD_1" }
}

/// glTF's second coordinate runs down.
fn upwards(v: f32) -> f32 {
    1.0 - v
}

/// What a primitive's form depends on beside itself.
pub(super) struct Pose<'a> {
    /// Of morph targets.
    pub(super) weights: &'a [f32],
    pub(super) joints: Option<&'a Joints>,
    /// Which texture coordinates the material uses.
    pub(super) uv_set: usize,
}

impl Container {
    /// The triangles of a primitive; `None` for points and lines.
    pub(super) fn mesh(&self, primitive: &Primitive, pose: &Pose<'_>) -> Result<Option<MeshDesc>, String> {
        let a = &primitive.attributes;
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            return Ok(None);
        }
        let mut positions = self.vectors(a.position.ok_or("a primitive without positions")?)?;
        let n = positions.len();
        let as_many = |name: &str, found: usize| match found == n || found == 0 {
            true => Ok(()),
            false => Err(format!("{found} values of {name} for {n} positions")),
        };
        let mut normals = a.normal.map(|i| self.vectors(i)).transpose()?.unwrap_or_default();
        as_many("NORMAL", normals.len())?;
        let tangents = a.tangent.map(|i| self.floats(i, 4)).transpose()?.unwrap_or_default();
        let mut tangents: Vec<Vec3> = tangents.chunks_exact(4).map(Vec3::from_slice).collect();
        as_many("TANGENT", tangents.len())?;
        let sets = [a.texcoord_0, a.texcoord_1];
        let uvs = sets[pose.uv_set.min(1)];
        let uvs = uvs.map(|i| self.floats(i, 2)).transpose()?.unwrap_or_default();
        let uvs: Vec<Vec2> = uvs.chunks_exact(2).map(|c| Vec2::new(c[0], upwards(c[1]))).collect();
        as_many("TEXCOORD", uvs.len())?;

        for (target, &weight) in primitive.targets.iter().zip(pose.weights).filter(|(_, w)| **w != 0.0) {
            self.morph(target, weight, &mut positions, &mut normals)?;
        }
        if let Some(joints) = pose.joints {
            self.bend(a, joints, [&mut positions, &mut normals, &mut tangents])?;
        }
        normals.iter_mut().for_each(|v| *v = v.normalize_or_zero());
        if normals.iter().chain(&positions).any(|v| !v.is_finite()) {
            return Err("a position or normal that is not finite".to_owned());
        }
        // A normal of zero is none.
        if normals.contains(&Vec3::ZERO) {
            normals.clear();
        }
        let indices = match primitive.indices {
            Some(i) => self.integers(i, 1)?,
            None => (0..u32::try_from(n).map_err(|_| "too many vertices")?).collect(),
        };
        if let Some(i) = indices.iter().find(|i| **i as usize >= n) {
            return Err(format!("there is no vertex {i} among {n}"));
        }
        let mut attributes = self.colors(a)?;
        let other = 1 - pose.uv_set.min(1);
        if let Some(set) = sets[other] {
            let mut values = self.floats(set, 2)?;
            values.iter_mut().skip(1).step_by(2).for_each(|v| *v = upwards(*v));
            let name = uv_name(other).to_owned();
            attributes.push(MeshAttribute { name, channels: 2, per_face: false, values });
        }
        for attribute in &attributes {
            as_many(&attribute.name, attribute.values.len() / attribute.channels as usize)?;
        }
        let indices = triangles(mode, &indices);
        Ok(Some(MeshDesc { positions, normals, tangents, uvs, indices, attributes, ..MeshDesc::default() }))
    }

    /// Colours of vertices and their alpha, under the names that materials ask for.
    fn colors(&self, a: &Attributes) -> Result<Vec<MeshAttribute>, String> {
        let Some(index) = a.color_0 else { return Ok(Vec::new()) };
        let per_face = false;
        let made = |name: &str, channels, values| MeshAttribute {
            name: name.to_owned(),
            channels,
            per_face,
            values,
        };
        if self.root.accessors.get(index).is_some_and(|c| c.kind == "VEC3") {
            let rgb = self.floats(index, 3)?;
            let opaque = vec![1.0; rgb.len() / 3];
            return Ok(vec![made(COLOR, 3, rgb), made(ALPHA, 1, opaque)]);
        }
        let rgba = self.floats(index, 4)?;
        let rgb = rgba.chunks_exact(4).flat_map(|c| &c[..3]).copied().collect();
        let alpha = rgba.iter().skip(3).step_by(4).copied().collect();
        Ok(vec![made(COLOR, 3, rgb), made(ALPHA, 1, alpha)])
    }

    fn vectors(&self, accessor: usize) -> Result<Vec<Vec3>, String> {
        Ok(self.floats(accessor, 3)?.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    fn morph(
        &self,
        target: &Attributes,
        weight: f32,
        positions: &mut [Vec3],
        normals: &mut [Vec3],
    ) -> Result<(), String> {
        for (accessor, values) in [(target.position, positions), (target.normal, normals)] {
            let moved = accessor.map(|i| self.vectors(i)).transpose()?.unwrap_or_default();
            for (v, d) in values.iter_mut().zip(moved) {
                *v += weight * d;
            }
        }
        Ok(())
    }

    /// Moves vertices with their joints.
    fn bend(
        &self,
        a: &Attributes,
        joints: &Joints,
        [positions, normals, tangents]: [&mut Vec<Vec3>; 3],
    ) -> Result<(), String> {
        let (Some(ids), Some(weights)) = (a.joints_0, a.weights_0) else { return Ok(()) };
        let (ids, weights) = (self.integers(ids, 4)?, self.floats(weights, 4)?);
        for (v, (ids, weights)) in ids.chunks_exact(4).zip(weights.chunks_exact(4)).enumerate() {
            let mut m = DMat4::ZERO;
            for (&id, &weight) in ids.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
                let joint = joints.get(id as usize).ok_or_else(|| format!("the skin has no joint {id}"))?;
                m += *joint * f64::from(weight);
            }
            if let Some(p) = positions.get_mut(v) {
                *p = (m * p.as_dvec3().extend(1.0)).truncate().as_vec3();
            }
            let inverse = m.inverse().transpose();
            if let Some(n) = normals.get_mut(v).filter(|_| inverse.is_finite()) {
                *n = (inverse * n.as_dvec3().extend(0.0)).truncate().as_vec3();
            }
            if let Some(t) = tangents.get_mut(v) {
                *t = (m * t.as_dvec3().extend(0.0)).truncate().as_vec3();
            }
        }
        Ok(())
    }
}

fn triangles(mode: u32, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        5 => {
            let turned =
                |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            indices.windows(3).enumerate().map(turned).collect()
        }
        6 => {
            let pairs = indices.get(1..).unwrap_or_default().windows(2);
            pairs.map(|w| [indices[0], w[0], w[1]]).collect()
        }
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// The matrix of translation, rotation (a quaternion x, y, z, w) and scale, in this order.
pub(super) fn from_parts(t: [f64; 3], q: [f64; 4], s: [f64; 3]) -> DMat4 {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = if length > 0.0 { q.map(|c| c / length) } else { [0.0, 0.0, 0.0, 1.0] };
    let column = |v: [f64; 3], scale: f64| (DVec3::from(v) * scale).extend(0.0);
    DMat4::from_cols(
        column([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)], s[0]),
        column([2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)], s[1]),
        column([2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)], s[2]),
        DVec4::new(t[0], t[1], t[2], 1.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_side() {
        assert_eq!(triangles(5, &[0, 1, 2, 3]), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(triangles(6, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(6, &[]), [[0; 3]; 0]);
    }

    #[test]
    fn a_quarter_turn_about_y_takes_z_to_x() {
        let h = 0.5_f64.sqrt();
        let m = from_parts([1.0, 0.0, 0.0], [0.0, h, 0.0, h], [2.0; 3]);
        assert!((m * DVec4::new(0.0, 0.0, 1.0, 1.0) - DVec4::new(3.0, 0.0, 0.0, 1.0)).length() < 1e-12);
    }
}
