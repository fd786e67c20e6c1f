//! Cameras without their places.

use math::trig;
use scene_desc::{ApertureDesc, CameraKind};

use super::json::Camera;

pub(super) fn perspective(fov: f32) -> CameraKind {
    CameraKind::Perspective { fov, lens_radius: 0.0, focal_distance: 1e6, aperture: ApertureDesc::Disk }
}

/// A camera without its place.
pub(super) struct Lens {
    pub(super) kind: CameraKind,
    pub(super) aspect: f32,
    pub(super) window: Option<[f32; 4]>,
}

impl Lens {
    /// `None` if its numbers are out of range.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        if let Some(p) = &camera.perspective {
            let aspect = p.aspect_ratio.unwrap_or(16.0 / 9.0);
            if !(p.yfov > 0.0 && p.yfov < std::f32::consts::PI && aspect > 0.0 && aspect.is_finite()) {
                return None;
            }
            // Ours is that of the shorter side.
            let half = trig::tan(0.5 * p.yfov) * aspect.min(1.0);
            let kind = perspective(2.0 * trig::atan(half).to_degrees());
            return Some(Self { kind, aspect, window: None });
        }
        let o = camera.orthographic.as_ref()?;
        let (x, y) = (o.xmag.abs(), o.ymag.abs());
        let kind = CameraKind::Orthographic { lens_radius: 0.0, focal_distance: 1e6 };
        (x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()).then(|| Self {
            kind,
            aspect: x / y,
            window: Some([-x, x, -y, y]),
        })
    }
}
