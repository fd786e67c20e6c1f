//! Measured reflection in the adaptive parameterisation of the RGL data base.
//!
//! | step                              | source                                                            |
//! |-----------------------------------|-------------------------------------------------------------------|
//! | parameterisation, `f`, sampling   | [Dupuy2018]: half vectors warped by their visible normals         |
//! | `u = (√(2θ/π), φ/2π + ½)`         | [Dupuy2018], as in the data base's files                          |
//!
//! With `m` the half vector and `s` what the warp of visible normals (for this `wo`) makes `u_m` of:
//! `f cos θi = spectrum(wo, s) · D(u_m) / (4 σ(u_o))`, where the factor after the dot is left out for files without the
//! Jacobian. `s` is drawn from the luminance, `u_m` from `s`, and `dω_i = 4 (wo·m) dω_m`, `dω_m = 2π² u_x sin θ du_m`.
//!
//! A fit to measurements: `f` is not quite reciprocal, so that importance flows by `f` with its directions exchanged.
//! Departs from Mitsuba: both sides reflect alike, as in pbrt-v4 (readers make a surface one-sided where they must).

mod table;
mod warp;

use std::f32::consts::{FRAC_2_PI, PI};
use std::sync::Arc;

use math::{LocalDir, Vec3, trig};
use sampling::{Pdf, SolidAngle};
use spectrum::Spectrum;

pub use self::table::{MeasuredError, MeasuredParts, MeasuredTable, Raster};
use super::mixture::sample_of;
use super::{BsdfKind, BsdfSample, Gloss, Lobe, LobeFlags, TransportMode};
use crate::microfacet::MIN_COS;

/// A measured surface.
#[derive(Clone, Debug)]
pub struct Measured {
    table: Arc<MeasuredTable>,
    /// Which channel of the table each lane sees; fractions lie between channels.
    channels: [f32; 4],
}

/// A pair of directions as the tables see them.
struct Query {
    blend: warp::Blend,
    u_o: [f32; 2],
    u_m: [f32; 2],
    /// `dω_i / du_m`.
    jacobian: f32,
}

impl Measured {
    /// The surface of a table, whose channel `channels[i]` lane i sees (linear in between).
    #[must_use]
    pub fn new(table: Arc<MeasuredTable>, channels: [f32; 4]) -> Self {
        Self { table, channels }
    }

    /// `None` where nothing is reflected.
    fn query(&self, wo: LocalDir, wi: LocalDir) -> Option<Query> {
        if !wo.same_hemisphere(wi) || wo.abs_cos_theta() <= MIN_COS || wi.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (wo, wi) = upward(wo, wi);
        let (wo, wi) = self.table.unfolded(wo, wi);
        // Opposite directions in the surface have no half vector to speak of.
        let m = (wo + wi).try_normalize().filter(|m| m.dot(wo) > 0.0)?;
        let (o, m_angles) = (angles(wo), angles(m));
        let phi = if self.table.is_isotropic() { m_angles[1] - o[1] } else { m_angles[1] };
        let u_x = u_of_theta(m_angles[0]);
        let y = phi * (0.5 / PI) + 0.5;
        let sin = trig::sin(m_angles[0]);
        let jacobian = 4.0 * wo.dot(m) * (2.0 * PI * PI * u_x * sin).max(1e-12);
        Some(Query {
            blend: self.table.blend(o[1], o[0]),
            u_o: [u_of_theta(o[0]), o[1] * (0.5 / PI) + 0.5],
            u_m: [u_x, y - y.floor()],
            jacobian,
        })
    }

    fn f(&self, query: &Query, s: [f32; 2], cos: f32) -> Spectrum {
        let value = Spectrum::from_lanes(self.channels.map(|c| self.table.spectrum(&query.blend, c, s)));
        value * (self.table.facets(query.u_o, query.u_m) / cos)
    }
}

/// The pair, turned to the side that the normal points to.
fn upward(wo: LocalDir, wi: LocalDir) -> (Vec3, Vec3) {
    if wo.cos_theta() < 0.0 { (-wo.0, -wi.0) } else { (wo.0, wi.0) }
}

/// Polar angle, without cancellation near the pole, and azimuth.
fn angles(w: Vec3) -> [f32; 2] {
    let chord = (w - Vec3::Z).length();
    [2.0 * trig::safe_asin(0.5 * chord), trig::atan2(w.y, w.x)]
}

fn u_of_theta(theta: f32) -> f32 {
    trig::safe_sqrt(theta * FRAC_2_PI)
}

/// The polar angle and azimuth of a point of the square.
fn angles_of_u(u: [f32; 2]) -> [f32; 2] {
    [u[0] * u[0] * (0.5 * PI), (2.0 * u[1] - 1.0) * PI]
}

impl BsdfKind for Measured {
    fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let (to, from) = match mode {
            TransportMode::Radiance => (wo, wi),
            TransportMode::Importance => (wi, wo),
        };
        let Some(query) = self.query(to, from) else { return Spectrum::ZERO };
        let (s, _) = self.table.facet_inverse(&query.blend, query.u_m);
        self.f(&query, s, from.abs_cos_theta())
    }

    fn pdf(&self, wo: LocalDir, wi: LocalDir, _: TransportMode) -> Pdf<SolidAngle> {
        let Some(query) = self.query(wo, wi) else { return Pdf::ZERO };
        let (s, facet_pdf) = self.table.facet_inverse(&query.blend, query.u_m);
        Pdf::new(facet_pdf * self.table.luminance_pdf(&query.blend, s) / query.jacobian)
    }

    fn eval_pdf(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> (Spectrum, Pdf<SolidAngle>) {
        if mode == TransportMode::Importance {
            return (self.eval(wo, wi, mode), self.pdf(wo, wi, mode));
        }
        let Some(query) = self.query(wo, wi) else { return (Spectrum::ZERO, Pdf::ZERO) };
        let (s, facet_pdf) = self.table.facet_inverse(&query.blend, query.u_m);
        let pdf = facet_pdf * self.table.luminance_pdf(&query.blend, s) / query.jacobian;
        (self.f(&query, s, wi.abs_cos_theta()), Pdf::new(pdf))
    }

    fn sample(&self, wo: LocalDir, _: f32, u: [f32; 2], mode: TransportMode) -> Option<BsdfSample> {
        if wo.abs_cos_theta() <= MIN_COS {
            return None;
        }
        let (up, _) = upward(wo, wo);
        let (folded, _) = self.table.unfolded(up, up);
        let [theta_o, phi_o] = angles(folded);
        let blend = self.table.blend(phi_o, theta_o);
        let u_m = self.table.sample_facet(&blend, self.table.sample_luminance(&blend, [u[1], u[0]]));

        // The half vector, and the direction that it mirrors `wo` to.
        let [theta, phi] = angles_of_u(u_m);
        let phi = phi + if self.table.is_isotropic() { phi_o } else { 0.0 };
        let ((sin, cos), (sin_phi, cos_phi)) = (trig::sin_cos(theta), trig::sin_cos(phi));
        let m = Vec3::new(sin * cos_phi, sin * sin_phi, cos);
        let wi = self.table.refolded(up, m * (2.0 * m.dot(folded)) - folded).try_normalize()?;
        let wi = LocalDir(if wo.cos_theta() < 0.0 { -wi } else { wi });
        sample_of(self, wo, wi, (Lobe::reflection(Gloss::Glossy), 1.0), mode)
    }

    fn flags(&self) -> LobeFlags {
        LobeFlags::GLOSSY_REFLECTION
    }

    fn albedo_estimate(&self, wo: LocalDir) -> Spectrum {
        const N: u16 = 4;
        let at = |i: u16| (f32::from(i) + 0.5) / f32::from(N);
        let pairs = (0..N).flat_map(|y| (0..N).map(move |x| [at(x), at(y)]));
        let sum: Spectrum =
            pairs.filter_map(|u| self.sample(wo, 0.5, u, TransportMode::Radiance)).map(|s| s.weight).sum();
        sum / f32::from(N * N)
    }

    fn is_reciprocal(&self) -> bool {
        false
    }
}
