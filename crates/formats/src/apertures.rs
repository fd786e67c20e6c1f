//! The openings of pbrt's lens stacks that have names.

use math::{Vec2, trig};
use scene_desc::ApertureDesc;

/// Names with shapes that are no disk.
pub(crate) const NAMES: [&str; 4] = ["gaussian", "square", "pentagon", "star"];

/// The shape of a name. As in pbrt-v4 the square is half as wide as the disk, the pentagon is shrunk by a fifth and stands
/// on its tip (pbrt turns its tables upside down).
pub(crate) fn named(name: &str) -> Option<ApertureDesc> {
    let turn = |i: u8, of: f32| trig::sin_cos(std::f32::consts::TAU * f32::from(i) / of);
    Some(match name {
        "gaussian" => ApertureDesc::Gaussian,
        "square" => ApertureDesc::Polygon(
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(Vec2::from).to_vec(),
        ),
        "pentagon" => {
            let corner = |i| {
                let (sin, cos) = turn(i, 5.0);
                Vec2::new(sin, -cos) * 0.8
            };
            ApertureDesc::Polygon((0..5).map(corner).collect())
        }
        "star" => {
            // The inner corners of a pentagram: cos 72° / cos 36° = (3 − √5) / 2.
            let inner = 0.5 * (3.0 - 5.0_f32.sqrt());
            let corner = |i| {
                let (sin, cos) = turn(i, 10.0);
                Vec2::new(cos, -sin) * if i % 2 == 1 { 1.0 } else { inner }
            };
            ApertureDesc::Polygon((0..10).map(corner).collect())
        }
        _ => return None,
    })
}
