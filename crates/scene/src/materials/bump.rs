//! Shading frames bent by a height or by a map of normals.
//!
//! The tangents are pbrt-v4's: those of the surface itself where its shading normal is the geometric one; where
//! normals are interpolated, the shading tangent and its perpendicular, both as long as ∂p/∂u.

use math::{Dir, Frame, LocalDir, Vec2, Vec3};
use scene_desc::{ImageId, WrapMode};

use crate::textures::{Mapping, TextureImage};
use crate::{SurfaceInteraction, TextureContext};

/// Step of the difference quotient where the pixel has no footprint, in (u, v).
const STEP: f32 = 0.0005;

/// The frame of the surface moved outwards by `height` [Blinn1978]: `p' = p + h n`, so that
/// `∂p'/∂u ≈ ∂p/∂u + ∂h/∂u n + h ∂n/∂u`.
pub(super) fn bump(
    si: &SurfaceInteraction,
    ctx: &TextureContext,
    height: impl Fn(&TextureContext) -> f32,
) -> Frame {
    let [dpdu, dpdv] = tangents(si);
    let f = &ctx.footprint;
    let step = |dx: f32, dy: f32| {
        let half = 0.5 * (dx.abs() + dy.abs());
        if half > 0.0 && half.is_finite() { half } else { STEP }
    };
    let (du, dv) = (step(f.duvdx.x, f.duvdy.x), step(f.duvdx.y, f.duvdy.y));
    let shifted = |d: Vec3, duv: Vec2| height(&TextureContext { p: ctx.p + d, uv: ctx.uv + duv, ..*ctx });

    let h = height(ctx);
    let slope_u = (shifted(dpdu * du, Vec2::X * du) - h) / du;
    let slope_v = (shifted(dpdv * dv, Vec2::Y * dv) - h) / dv;
    let n = si.frame.n.0;
    let moved_u = dpdu + slope_u * n + h * si.dndu;
    let moved_v = dpdv + slope_v * n + h * si.dndv;
    match moved_u.cross(moved_v).try_normalize() {
        Some(n) => Frame::from_normal_tangent(Dir(n).face_forward(si.ng), moved_u),
        None => si.frame,
    }
}

/// A map of normals; see [`scene_desc::NormalLayout`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NormalMap {
    pub(super) image: ImageId,
    pub(super) mapping: Mapping,
    pub(super) wrap: [WrapMode; 2],
    pub(super) strength: f32,
    pub(super) follows_v: bool,
}

impl NormalMap {
    /// The frame about the normal that the map gives at (s, t), t upwards.
    pub(super) fn frame(&self, si: &SurfaceInteraction, st: Vec2, map: &TextureImage) -> Frame {
        let rgb = map.bilinear_rgb(Vec2::new(st.x, 1.0 - st.y), self.wrap);
        let mut lean = 2.0 * Vec3::from(rgb) - 1.0;
        lean.x *= self.strength;
        lean.y *= self.strength;
        if self.follows_v && si.dpdu.cross(si.dpdv).dot(si.frame.n.0) < 0.0 {
            lean.y = -lean.y;
        }
        match lean.try_normalize() {
            Some(n) => {
                let n = si.frame.to_world(LocalDir(n)).face_forward(si.ng);
                Frame::from_normal_tangent(n, si.frame.s)
            }
            None => si.frame,
        }
    }
}

/// Derivatives of the point by u and v, in the plane of the shading normal.
fn tangents(si: &SurfaceInteraction) -> [Vec3; 2] {
    let n = si.frame.n.0;
    if n == si.ng.0 {
        return [si.dpdu, si.dpdv];
    }
    let length = (si.dpdu - n * n.dot(si.dpdu)).length();
    [si.frame.s * length, si.frame.t * length]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Footprint;
    use crate::materials::tests::point;

    fn bumped(si: &SurfaceInteraction, height: impl Fn(&TextureContext) -> f32) -> Frame {
        bump(si, &TextureContext::at(si, Footprint::default()), height)
    }

    #[test]
    fn a_slope_up_along_u_tilts_the_normal_back() {
        let si = point();
        let frame = bumped(&si, |ctx| 0.5 * ctx.uv.x);
        // h = u/2 and |∂p/∂u| = 1: the normal of z = x/2.
        let expected = Vec3::new(-0.5, 0.0, 1.0).normalize();
        assert!(frame.n.0.distance(expected) < 1e-3, "{}", frame.n.0);
        assert!((frame.s.cross(frame.t) - frame.n.0).length() < 1e-5);
        let frame = bumped(&si, |ctx| -0.25 * ctx.p.0.y);
        assert!(frame.n.0.distance(Vec3::new(0.0, 0.25, 1.0).normalize()) < 1e-3, "{}", frame.n.0);
    }

    #[test]
    fn a_constant_height_bends_nothing_and_normals_stay_on_their_side() {
        let mut si = point();
        assert!(bumped(&si, |_| 3.0).n.0.distance(Vec3::Z) < 1e-6);
        // Seen as a surface that faces down, the same heights go down.
        si.ng = -si.ng;
        si.frame = Frame::from_normal_tangent(si.ng, si.dpdu);
        let frame = bumped(&si, |ctx| 0.5 * ctx.uv.x);
        assert!(frame.n.0.distance(Vec3::new(-0.5, 0.0, -1.0).normalize()) < 1e-3, "{}", frame.n.0);
    }

    #[test]
    fn a_growing_sphere_keeps_its_normals() {
        // With ∂n/∂u = ∂p/∂u (the unit sphere), moving out by a constant changes sizes alone.
        let mut si = point();
        (si.dndu, si.dndv) = (si.dpdu, si.dpdv);
        assert!(bumped(&si, |_| 2.0).n.0.distance(Vec3::Z) < 1e-6);
    }

    fn normal_map(si: &SurfaceInteraction, image: &TextureImage) -> Frame {
        layout().frame(si, si.uv, image)
    }

    fn layout() -> NormalMap {
        NormalMap {
            image: ImageId(0),
            mapping: Mapping::Uv { scale: Vec2::ONE, shift: Vec2::ZERO },
            wrap: [WrapMode::Repeat; 2],
            strength: 1.0,
            follows_v: false,
        }
    }

    #[test]
    fn maps_of_normals_have_a_strength_and_may_follow_v() {
        let mut si = point();
        let n = Vec3::new(0.0, 0.6, 0.8);
        let image = TextureImage::of_floats([1, 1], 3, &(n * 0.5 + 0.5).to_array());
        let half = NormalMap { strength: 0.5, follows_v: true, ..layout() };
        let frame = half.frame(&si, si.uv, &image);
        assert!(frame.n.0.distance(Vec3::new(0.0, 0.3, 0.8).normalize()) < 1e-6);
        // The same with u the other way round: the second axis is still up.
        si.dpdu = -si.dpdu;
        si.frame = Frame { s: -Vec3::X, t: -Vec3::Y, n: Dir::Z };
        assert!(half.frame(&si, si.uv, &image).n.0.distance(frame.n.0) < 1e-6);
        assert!(layout().frame(&si, si.uv, &image).n.0.distance(Vec3::new(0.0, -0.6, 0.8)) < 1e-6);
    }

    #[test]
    fn maps_of_normals_are_in_tangent_space() {
        let si = point();
        let map = |rgb: [f32; 3]| TextureImage::of_floats([1, 1], 3, &rgb);
        assert!(normal_map(&si, &map([0.5, 0.5, 1.0])).n.0.distance(Vec3::Z) < 1e-6);
        let n = Vec3::new(0.6, 0.0, 0.8);
        let frame = normal_map(&si, &map((n * 0.5 + 0.5).to_array()));
        assert!(frame.n.0.distance(n) < 1e-6 && (frame.s.cross(frame.t) - frame.n.0).length() < 1e-5);
        // On a turned frame x is along the tangent.
        let mut turned = point();
        turned.frame = Frame { s: Vec3::Y, t: -Vec3::X, n: Dir::Z };
        let frame = normal_map(&turned, &map((n * 0.5 + 0.5).to_array()));
        assert!(frame.n.0.distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6);
        assert_eq!(normal_map(&si, &map([0.5; 3])), si.frame);
    }
}
