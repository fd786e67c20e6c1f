//! The numbers of a measured surface, checked and made ready for sampling.

use std::f32::consts::TAU;

use math::Vec3;

use super::angles_of_u;
use super::warp::{Blend, Nodes, Warp};

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeasuredError {
    /// Which of its parts, as files name them.
    pub field: &'static str,
    /// What is wrong with it.
    pub what: String,
}

/// Numbers on nodes of the unit square, x fastest, in as many slices as there are.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Nodes along x (of θ) and y (of φ).
    pub size: [usize; 2],
    /// Slice after slice.
    pub values: Vec<f32>,
}

/// What a table is made of, in the names of the RGL data base's files.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredParts {
    /// Azimuths of the outgoing direction, in radians, ascending: up to two for an isotropic surface.
    pub phi_i: Vec<f32>,
    /// Polar angles of the outgoing direction, in radians, ascending.
    pub theta_i: Vec<f32>,
    /// The distribution of facets.
    pub ndf: Raster,
    /// Their projected area.
    pub sigma: Raster,
    /// The distribution of visible facets: a slice for each φ and θ, θ fastest.
    pub vndf: Raster,
    /// What to draw samples by: slices as of `vndf`.
    pub luminance: Raster,
    /// The measurement: slices of φ, θ and channel, the channel fastest.
    pub spectra: Raster,
    /// Number of channels.
    pub n_channels: usize,
    /// Is `spectra` to be multiplied by `D / 4σ`?
    pub jacobian: bool,
}

/// A measured surface's numbers.
#[derive(Clone, Debug)]
pub struct MeasuredTable {
    phi: Vec<f32>,
    theta: Vec<f32>,
    ndf: Nodes,
    sigma: Nodes,
    vndf: Warp,
    luminance: Warp,
    spectra: Nodes,
    n_channels: usize,
    jacobian: bool,
    fold: Fold,
}

/// Which part of all azimuths was measured; the rest follows by symmetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fold {
    All,
    Half,
    Quarter,
}

impl MeasuredTable {
    /// Of parts that fit together.
    ///
    /// # Errors
    ///
    /// A part has the wrong number of values, or values that are not finite; an axis does not ascend; an area is negative.
    pub fn new(parts: MeasuredParts) -> Result<Self, MeasuredError> {
        let slices = parts.phi_i.len() * parts.theta_i.len();
        ascending("phi_i", &parts.phi_i)?;
        ascending("theta_i", &parts.theta_i)?;
        if parts.n_channels == 0 {
            return Err(wrong("spectra", "has no channel"));
        }
        let fold = match parts.phi_i.as_slice() {
            [first, .., last] if parts.phi_i.len() > 2 => match (TAU / (last - first)).round() as u32 {
                0 | 1 => Fold::All,
                2 => Fold::Half,
                4 => Fold::Quarter,
                n => {
                    return Err(wrong(
                        "phi_i",
                        format!("covers one part in {n} of a turn; 1, 2 or 4 are known"),
                    ));
                }
            },
            _ => Fold::All,
        };
        Ok(Self {
            fold,
            ndf: nodes("ndf", parts.ndf, 1, Sign::NotNegative)?,
            sigma: nodes("sigma", parts.sigma, 1, Sign::NotNegative)?,
            vndf: Warp::new(nodes("vndf", parts.vndf, slices, Sign::NotNegative)?),
            luminance: Warp::new(nodes("luminance", parts.luminance, slices, Sign::NotNegative)?),
            spectra: nodes("spectra", parts.spectra, slices.saturating_mul(parts.n_channels), Sign::Any)?,
            n_channels: parts.n_channels,
            jacobian: parts.jacobian,
            phi: parts.phi_i,
            theta: parts.theta_i,
        })
    }

    /// The half vector (polar angle, azimuth) that the warp for an outgoing direction makes of a point of the square: what
    /// `spectra` and `luminance` are tabulated at. Azimuths are relative to the outgoing direction if the surface is
    /// isotropic.
    #[must_use]
    pub fn half_vector(&self, phi: f32, theta: f32, s: [f32; 2]) -> [f32; 2] {
        angles_of_u(self.sample_facet(&self.blend(phi, theta), s))
    }

    /// The same from every azimuth?
    pub(super) fn is_isotropic(&self) -> bool {
        self.phi.len() <= 2
    }

    /// The slices for an outgoing direction.
    pub(super) fn blend(&self, phi: f32, theta: f32) -> Blend {
        Blend::new([&self.phi, &self.theta], [phi, theta])
    }

    /// Both directions as seen from the azimuths that were measured.
    pub(super) fn unfolded(&self, wo: Vec3, wi: Vec3) -> (Vec3, Vec3) {
        let flip = self.flip(wo);
        (wo * flip, wi * flip)
    }

    /// A direction back from there, for the outgoing direction `wo`.
    pub(super) fn refolded(&self, wo: Vec3, w: Vec3) -> Vec3 {
        w * self.flip(wo)
    }

    /// Signs that bring `wo` to measured azimuths: the negative half (−π to 0) or quarter (−π to −π/2).
    fn flip(&self, wo: Vec3) -> Vec3 {
        let sign = |x: f32| if x > 0.0 { -1.0 } else { 1.0 };
        match self.fold {
            Fold::All => Vec3::ONE,
            Fold::Half => Vec3::new(sign(wo.y), sign(wo.y), 1.0),
            Fold::Quarter => Vec3::new(sign(wo.x), sign(wo.y), 1.0),
        }
    }

    /// `D / 4σ`, or one.
    pub(super) fn facets(&self, u_o: [f32; 2], u_m: [f32; 2]) -> f32 {
        if !self.jacobian {
            return 1.0;
        }
        let sigma = self.sigma.at(0, u_o);
        if sigma > 0.0 { self.ndf.at(0, u_m) / (4.0 * sigma) } else { 0.0 }
    }

    /// Channel `channel` (between channels, linear) at a point of the warped square.
    pub(super) fn spectrum(&self, blend: &Blend, channel: f32, s: [f32; 2]) -> f32 {
        let last = self.n_channels - 1;
        let c = channel.clamp(0.0, last as f32);
        let (i, f) = (c as usize, c - c.floor());
        let mut sum = 0.0;
        for (slice, weight) in blend.slices.iter().zip(blend.weights) {
            for (i, share) in [(i, 1.0 - f), (i + 1, f)] {
                if weight * share > 0.0 {
                    sum += weight * share * self.spectra.at(slice * self.n_channels + i.min(last), s);
                }
            }
        }
        sum.max(0.0)
    }

    /// A point of the square of half vectors from one of the warped square.
    pub(super) fn sample_facet(&self, blend: &Blend, s: [f32; 2]) -> [f32; 2] {
        self.vndf.sample(blend, s)
    }

    /// The way back, and the density of half vectors.
    pub(super) fn facet_inverse(&self, blend: &Blend, u_m: [f32; 2]) -> ([f32; 2], f32) {
        self.vndf.inverse(blend, u_m)
    }

    /// A point of the warped square.
    pub(super) fn sample_luminance(&self, blend: &Blend, u: [f32; 2]) -> [f32; 2] {
        self.luminance.sample(blend, u)
    }

    /// Its density.
    pub(super) fn luminance_pdf(&self, blend: &Blend, s: [f32; 2]) -> f32 {
        self.luminance.pdf(blend, s)
    }
}

/// May values be negative? Colours beyond a gamut are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sign {
    Any,
    NotNegative,
}

fn wrong(field: &'static str, what: impl Into<String>) -> MeasuredError {
    MeasuredError { field, what: what.into() }
}

fn ascending(field: &'static str, axis: &[f32]) -> Result<(), MeasuredError> {
    if axis.is_empty() || axis.iter().any(|a| !a.is_finite()) || axis.windows(2).any(|a| a[0] >= a[1]) {
        return Err(wrong(field, "must be finite and ascending"));
    }
    Ok(())
}

fn nodes(field: &'static str, raster: Raster, slices: usize, sign: Sign) -> Result<Nodes, MeasuredError> {
    let Raster { size: [w, h], values } = raster;
    if w < 2 || h < 2 {
        return Err(wrong(field, format!("has {w} × {h} nodes; there must be two at least both ways")));
    }
    if w.checked_mul(h).and_then(|n| n.checked_mul(slices)) != Some(values.len()) {
        return Err(wrong(field, format!("has {} values for {slices} times {w} × {h} nodes", values.len())));
    }
    let is_wrong = |v: &f32| !v.is_finite() || (sign == Sign::NotNegative && *v < 0.0);
    match values.iter().find(|v| is_wrong(v)) {
        Some(v) => Err(wrong(field, format!("holds {v}"))),
        None => Ok(Nodes { size: [w, h], values }),
    }
}
