//! Whether the numbers of a shape make sense: for descriptions that no reader has looked at.

use crate::{BilinearMesh, CurveDesc, Geometry, LoopSubdiv, MeshDesc};

impl Geometry {
    /// Refuses what cannot be compiled.
    ///
    /// # Errors
    /// What is wrong, in a sentence.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Mesh(m) => check_mesh(m),
            Self::BilinearMesh(m) => check_patches(m),
            Self::LoopSubdiv(l) => check_subdiv(l),
            Self::Curve(c) => check_curve(c),
            Self::Sphere { radius, z_min, z_max, phi_max } => {
                positive("radius", *radius)?;
                numbers(&[("z_min", *z_min), ("z_max", *z_max), ("phi_max", *phi_max)])
            }
            Self::Disk { height, radius, inner_radius, phi_max } => {
                positive("radius", *radius)?;
                if !(0.0..*radius).contains(inner_radius) {
                    return Err(format!("inner_radius {inner_radius} is outside [0, {radius})"));
                }
                numbers(&[("height", *height), ("phi_max", *phi_max)])
            }
            Self::Cylinder { radius, z_min, z_max, phi_max } => {
                positive("radius", *radius)?;
                numbers(&[("z_min", *z_min), ("z_max", *z_max), ("phi_max", *phi_max)])
            }
        }
    }
}

fn positive(name: &str, x: f32) -> Result<(), String> {
    if x > 0.0 && x.is_finite() { Ok(()) } else { Err(format!("{name} is {x}: expected a number above 0")) }
}

fn numbers(all: &[(&str, f32)]) -> Result<(), String> {
    match all.iter().find(|(_, x)| !x.is_finite()) {
        None => Ok(()),
        Some((name, x)) => Err(format!("{name} is {x}: expected a number")),
    }
}

fn check_mesh(m: &MeshDesc) -> Result<(), String> {
    let n = m.positions.len();
    finite("positions", m.positions.iter().map(|p| p.is_finite()))?;
    finite("normals", m.normals.iter().map(|p| p.is_finite()))?;
    finite("tangents", m.tangents.iter().map(|p| p.is_finite()))?;
    finite("uvs", m.uvs.iter().map(|p| p.is_finite()))?;
    finite("end_positions", m.end_positions.iter().map(|p| p.is_finite()))?;
    finite("end_normals", m.end_normals.iter().map(|p| p.is_finite()))?;
    finite("key_times", m.key_times.iter().map(|t| t.is_finite()))?;
    per_vertex(n, &[("normals", m.normals.len()), ("tangents", m.tangents.len()), ("uvs", m.uvs.len())])?;
    per_vertex(n, &[("end_positions", m.end_positions.len()), ("end_normals", m.end_normals.len())])?;
    if !m.end_normals.is_empty() && (m.normals.is_empty() || m.end_positions.is_empty()) {
        return Err("end_normals without normals and end_positions".to_owned());
    }
    for a in &m.attributes {
        finite(&a.name, a.values.iter().map(|x| x.is_finite()))?;
        let places = if a.per_face { m.indices.len() } else { n };
        if !matches!(a.channels, 1..=3) || places.checked_mul(a.channels as usize) != Some(a.values.len()) {
            return Err(format!("{} has {} values for {places} places", a.name, a.values.len()));
        }
    }
    in_range(n, m.indices.as_flattened())
}

fn check_patches(m: &BilinearMesh) -> Result<(), String> {
    let n = m.positions.len();
    finite("positions", m.positions.iter().map(|p| p.is_finite()))?;
    finite("normals", m.normals.iter().map(|p| p.is_finite()))?;
    finite("uvs", m.uvs.iter().map(|p| p.is_finite()))?;
    per_vertex(n, &[("normals", m.normals.len()), ("uvs", m.uvs.len())])?;
    in_range(n, m.indices.as_flattened())
}

fn check_subdiv(l: &LoopSubdiv) -> Result<(), String> {
    const MOST_LEVELS: u32 = 10;
    if l.levels > MOST_LEVELS {
        return Err(format!("levels is {}: expected at most {MOST_LEVELS}", l.levels));
    }
    finite("positions", l.positions.iter().map(|p| p.is_finite()))?;
    in_range(l.positions.len(), l.indices.as_flattened())
}

fn check_curve(c: &CurveDesc) -> Result<(), String> {
    finite("segments", c.segments.iter().flatten().map(|p| p.is_finite()))?;
    finite("normals", c.normals.iter().map(|p| p.is_finite()))?;
    if c.width.iter().any(|w| !(*w >= 0.0 && w.is_finite())) {
        return Err(format!("width {:?} is below 0, or no number", c.width));
    }
    let n = c.segments.len() + 1;
    if !c.normals.is_empty() && c.normals.len() != n {
        return Err(format!("{} normals: expected none, or {n}, one more than segments", c.normals.len()));
    }
    Ok(())
}

fn finite(name: &str, mut all: impl Iterator<Item = bool>) -> Result<(), String> {
    match all.position(|is_finite| !is_finite) {
        None => Ok(()),
        Some(i) => Err(format!("{name}[{i}] is not finite")),
    }
}

fn per_vertex(n: usize, arrays: &[(&str, usize)]) -> Result<(), String> {
    match arrays.iter().find(|(_, len)| *len != 0 && *len != n) {
        None => Ok(()),
        Some((name, len)) => Err(format!("{len} {name} for {n} positions")),
    }
}

fn in_range(n: usize, indices: &[u32]) -> Result<(), String> {
    match indices.iter().find(|&&i| i as usize >= n) {
        None => Ok(()),
        Some(i) => Err(format!("index {i} of {n} positions")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use math::Vec3;
    use std::sync::Arc;

    #[test]
    fn what_cannot_be_a_shape_is_told() {
        let sphere = |radius| Geometry::Sphere { radius, z_min: f32::MIN, z_max: f32::MAX, phi_max: 360.0 };
        assert_eq!(sphere(1.0).check(), Ok(()));
        assert!(sphere(-1.0).check().unwrap_err().contains("radius is -1"));
        let mesh = |positions: Vec<Vec3>, normals: Vec<Vec3>| {
            let indices = vec![[0, 1, 2]];
            Geometry::Mesh(Arc::new(MeshDesc { positions, normals, indices, ..MeshDesc::default() })).check()
        };
        assert_eq!(mesh(vec![Vec3::ZERO; 3], vec![]), Ok(()));
        assert_eq!(mesh(vec![Vec3::ZERO; 2], vec![]).unwrap_err(), "index 2 of 2 positions");
        assert_eq!(mesh(vec![Vec3::ZERO; 3], vec![Vec3::Z]).unwrap_err(), "1 normals for 3 positions");
        assert_eq!(mesh(vec![Vec3::NAN; 3], vec![]).unwrap_err(), "positions[0] is not finite");

        let moving = |end_positions: Vec<Vec3>, end_normals: Vec<Vec3>| {
            let (positions, indices) = (vec![Vec3::ZERO; 3], vec![[0, 1, 2]]);
            let mesh = MeshDesc { positions, indices, end_positions, end_normals, ..MeshDesc::default() };
            Geometry::Mesh(Arc::new(mesh)).check()
        };
        assert_eq!(moving(vec![Vec3::X; 3], vec![]), Ok(()));
        assert_eq!(moving(vec![Vec3::X; 2], vec![]).unwrap_err(), "2 end_positions for 3 positions");
        assert_eq!(moving(vec![Vec3::INFINITY; 3], vec![]).unwrap_err(), "end_positions[0] is not finite");
        let lonely = moving(vec![Vec3::X; 3], vec![Vec3::Z; 3]).unwrap_err();
        assert_eq!(lonely, "end_normals without normals and end_positions");
    }
}
