//! Where a light is and into which directions it emits: what a tree of lights is built of [Conty2018].

use math::{Bounds, Dir, Vec3, trig};

use super::{Light, Lights};
use crate::LightId;

/// Bounds of one light or of many.
///
/// All normals lie within θ_o of `axis`, and all light within θ_e of a normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightBounds {
    pub(crate) bounds: Bounds,
    pub(crate) axis: Dir,
    pub(crate) cos_theta_o: f32,
    pub(crate) cos_theta_e: f32,
    /// A measure of power: what the importance is in proportion to.
    pub(crate) power: f32,
    pub(crate) two_sided: bool,
}

impl Lights {
    /// Bounds of a light at a finite place that emits; `None` for all others.
    pub(crate) fn light_bounds(&self, light: LightId) -> Option<LightBounds> {
        let at = |p: Vec3, intensity: f32| LightBounds {
            bounds: Bounds::point(p),
            axis: Dir::Z,
            cos_theta_o: -1.0,
            cos_theta_e: 0.0,
            power: intensity,
            two_sided: false,
        };
        let power = self.power(light);
        if power <= 0.0 {
            return None;
        }
        let sphere = 4.0 * std::f32::consts::PI;
        Some(match &self.list[light.index()] {
            Light::Dark | Light::Distant(_) | Light::InfiniteConstant(_) | Light::InfiniteImage(_) => {
                return None;
            }
            // Lights at points count with their largest intensity times 4π, as far as it is known.
            Light::Point(l) => at(l.p.0, power),
            Light::Goniometric(l) => at(l.p().0, power),
            Light::Projection(l) => at(l.p().0, power * sphere / l.slide_area().min(sphere)),
            Light::Spot(l) => LightBounds {
                axis: l.frame.n,
                cos_theta_o: l.cos_start,
                cos_theta_e: trig::cos(trig::safe_acos(l.cos_end) - trig::safe_acos(l.cos_start)),
                ..at(l.p.0, power * sphere / l.solid_angle())
            },
            Light::Area(l) => {
                let normals = l.emitter.normals();
                LightBounds {
                    bounds: l.emitter.bounds(),
                    axis: normals.axis,
                    cos_theta_o: normals.cos_theta,
                    cos_theta_e: 0.0,
                    power,
                    two_sided: l.two_sided,
                }
            }
        })
    }
}
