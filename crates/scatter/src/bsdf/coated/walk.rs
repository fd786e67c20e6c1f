//! The random walk between a coat's boundary and its base [Guo2018].
//!
//! `eval` joins a walk from `wo` to a direction that was refracted from `wi` beforehand, at the base and at every
//! event in the medium; where the boundary is rough it also lets the walk's own directions out to `wi`, and weighs
//! both by the power heuristic. `sample` walks until it gets out. Random numbers come from a generator seeded by the
//! directions (`eval`) or by the caller's numbers (`sample`), so that both are functions of their arguments.
//!
//! Light comes from above the coat; directions inside point down (z < 0) towards the base, up towards the boundary.
//! Left out: bases that transmit. The noise of `eval` repeats where both directions repeat bit for bit (a plane under
//! an orthographic camera and a directional light).

use math::hash::{combine, mix64, unit_f32};
use math::{LocalDir, trig};
use sampling::{Pdf, SolidAngle, mis};
use spectrum::Spectrum;

use super::super::{BsdfKind, BsdfSample, Dielectric, Gloss, Lobe, LobeFlags, SampleLobes, TransportMode};
use super::Layer;
use crate::phase::{HenyeyGreenstein, PhaseKind};

/// A boundary, a layer and a base.
pub(in super::super) struct Walk<'a, B> {
    pub(in super::super) top: &'a Dielectric,
    pub(in super::super) layer: &'a Layer,
    pub(in super::super) base: &'a B,
}

/// Where a walk is. It came to height `z` above the base, and goes on along `w`.
struct State {
    beta: Spectrum,
    w: LocalDir,
    z: f32,
}

/// What `eval` joins its walks to.
struct Exit {
    /// Outside.
    wi: LocalDir,
    /// `wi` refracted into the layer: down.
    inside: LocalDir,
    /// Of the refraction, as `BsdfSample::weight`.
    weight: Spectrum,
    /// `None` where the boundary is smooth.
    pdf: Option<Pdf<SolidAngle>>,
    mode: TransportMode,
}

impl<B: BsdfKind> Walk<'_, B> {
    /// An unbiased estimate of `f(wo, wi)`, both on the upper side.
    pub(in super::super) fn eval(&self, wo: LocalDir, wi: LocalDir, mode: TransportMode) -> Spectrum {
        let mut rng = WalkRng::new([wo.0.x, wo.0.y, wo.0.z, wi.0.x, wi.0.y, wi.0.z]);
        let mut sum = Spectrum::ZERO;
        for _ in 0..self.layer.n_samples.max(1) {
            let (u_wo, u_wi) = (rng.pair(), rng.pair());
            let lobes = SampleLobes::Transmission;
            let Some(enter) = self.top.sample_lobes(wo, 0.5, u_wo, mode, lobes) else { continue };
            let Some(leave) = self.top.sample_lobes(wi, 0.5, u_wi, !mode, lobes) else { continue };
            let exit = Exit { wi, inside: leave.wi, weight: leave.weight, pdf: leave.pdf(), mode };
            let start = State { beta: enter.weight, w: enter.wi, z: self.layer.thickness };
            sum += self.walk(start, &exit, &mut rng);
        }
        let reflected = Spectrum::splat(self.top.eval_scalar(wo, wi, mode));
        reflected + sum / f32::from(self.layer.n_samples.max(1))
    }

    /// One walk from the boundary down, joined to the exit wherever it can be.
    fn walk(&self, mut at: State, exit: &Exit, rng: &mut WalkRng) -> Spectrum {
        let mut sum = Spectrum::ZERO;
        for depth in 0..self.layer.max_depth {
            if !survives(&mut at.beta, depth, rng) {
                break;
            }
            match self.advance(&mut at, rng) {
                Place::Medium => sum += self.scatter_in_medium(&mut at, exit, rng),
                Place::Top => {
                    let (u, lobes) = (rng.pair(), SampleLobes::Reflection);
                    let Some(s) = self.top.sample_lobes(-at.w, 0.0, u, exit.mode, lobes) else { break };
                    at.beta *= s.weight;
                    at.w = s.wi;
                }
                Place::Base => {
                    sum += self.join_at_base(&at, exit);
                    if exit.pdf.is_none() && depth + 1 == self.layer.max_depth {
                        break;
                    }
                    let Some(s) = self.base.sample(-at.w, rng.one(), rng.pair(), exit.mode) else { break };
                    at.beta *= s.weight;
                    at.w = s.wi;
                    sum += self.let_out(&at, s.pdf(), exit);
                }
            }
        }
        sum
    }

    /// Goes to the next event, with the medium's absorption where it does not scatter.
    #[inline]
    fn advance(&self, at: &mut State, rng: &mut WalkRng) -> Place {
        let up = at.w.0.z > 0.0;
        let (boundary, place) = if up { (self.layer.thickness, Place::Top) } else { (0.0, Place::Base) };
        if self.layer.albedo.is_black() {
            at.beta *= self.transmittance(self.layer.thickness, at.w);
        } else {
            // Free path along the height; what gets past the boundary stops there.
            let dz = -trig::ln(1.0 - rng.one()) * at.w.0.z;
            let z = at.z + dz;
            if dz != 0.0 && 0.0 < z && z < self.layer.thickness {
                at.z = z;
                return Place::Medium;
            }
        }
        at.z = boundary;
        place
    }

    /// Joins to the exit at a particle, then goes on from it.
    fn scatter_in_medium(&self, at: &mut State, exit: &Exit, rng: &mut WalkRng) -> Spectrum {
        let phase = HenyeyGreenstein::new(self.layer.g);
        let to_top = self.layer.thickness - at.z;

        // Towards the refracted wi. Its weight holds a cosine that a particle does not have.
        let value = phase.at_cos((-at.w).dot(-exit.inside));
        let competes = exit.pdf.map_or(1.0, |p| mis::power(p, Pdf::new(value)));
        let through = self.transmittance(to_top, exit.inside) / exit.inside.abs_cos_theta();
        let mut sum = at.beta * self.layer.albedo * exit.weight * (value * competes * through);

        // Along a direction of the phase function, out to wi where the boundary is rough.
        let (w, pdf) = phase.sample_local(-at.w, rng.pair());
        at.beta *= self.layer.albedo;
        at.w = w;
        if exit.pdf.is_some() && w.0.z > 0.0 {
            let f = self.top.eval_scalar(-w, exit.wi, exit.mode);
            if f > 0.0 {
                let other = self.top.pdf_lobes(exit.wi, -w, SampleLobes::Transmission);
                sum += at.beta * (f * self.transmittance(to_top, w) * mis::power(pdf, other));
            }
        }
        sum
    }

    /// Light along the refracted `wi`, scattered at the base.
    #[inline]
    fn join_at_base(&self, at: &State, exit: &Exit) -> Spectrum {
        let (f, pdf) = self.base.eval_pdf(-at.w, -exit.inside, exit.mode);
        if f.is_black() {
            return f;
        }
        let competes = exit.pdf.map_or(1.0, |p| mis::power(p, pdf));
        at.beta * f * exit.weight * (competes * self.transmittance(self.layer.thickness, exit.inside))
    }

    /// The direction that the base scattered to (`pdf`: `None` for a mirror), through a rough boundary to `wi`.
    #[inline]
    fn let_out(&self, at: &State, pdf: Option<Pdf<SolidAngle>>, exit: &Exit) -> Spectrum {
        if exit.pdf.is_none() || at.w.0.z <= 0.0 {
            return Spectrum::ZERO;
        }
        let f = self.top.eval_scalar(-at.w, exit.wi, exit.mode);
        if f <= 0.0 {
            return Spectrum::ZERO;
        }
        let competes =
            pdf.map_or(1.0, |p| mis::power(p, self.top.pdf_lobes(exit.wi, -at.w, SampleLobes::Transmission)));
        at.beta * (f * competes * self.transmittance(self.layer.thickness, at.w))
    }

    /// A direction by a walk until it gets out. `pdf` gives the density that goes with it.
    pub(in super::super) fn sample(
        &self,
        wo: LocalDir,
        u_lobe: f32,
        u: [f32; 2],
        mode: TransportMode,
        pdf: impl Fn(LocalDir) -> Pdf<SolidAngle>,
    ) -> Option<BsdfSample> {
        let enter = self.top.sample(wo, u_lobe, u, mode)?;
        if !enter.lobe.is_transmission() {
            return Some(Self::out(&enter, enter.weight, enter.is_specular(), &pdf));
        }
        let mut rng = WalkRng::new([wo.0.x, wo.0.y, wo.0.z, u_lobe, u[0], u[1]]);
        let mut at = State { beta: enter.weight, w: enter.wi, z: self.layer.thickness };
        let mut specular = enter.is_specular();
        // After the last event the walk may still get out, as it may in `eval`.
        for depth in 0..=self.layer.max_depth {
            if !survives(&mut at.beta, depth, &mut rng) {
                return None;
            }
            let event = match self.advance(&mut at, &mut rng) {
                Place::Medium => {
                    let phase = HenyeyGreenstein::new(self.layer.g);
                    at.w = phase.sample_local(-at.w, rng.pair()).0;
                    at.beta *= self.layer.albedo;
                    specular = false;
                    continue;
                }
                Place::Top => self.top.sample(-at.w, rng.one(), rng.pair(), mode)?,
                Place::Base => self.base.sample(-at.w, rng.one(), rng.pair(), mode)?,
            };
            at.beta *= event.weight;
            at.w = event.wi;
            specular &= event.is_specular();
            if event.lobe.is_transmission() {
                return Some(Self::out(&event, at.beta, specular, &pdf));
            }
        }
        None
    }

    /// A sample that got out. A chain of deltas is one; its exact probability is never needed, since the weight is.
    fn out(
        last: &BsdfSample,
        weight: Spectrum,
        specular: bool,
        pdf: impl Fn(LocalDir) -> Pdf<SolidAngle>,
    ) -> BsdfSample {
        if specular {
            return BsdfSample::delta(last.wi, weight, 1.0, Lobe::reflection(Gloss::Specular));
        }
        let sample = BsdfSample::smooth(last.wi, weight, pdf(last.wi), Lobe::reflection(Gloss::Glossy));
        BsdfSample { pdf_is_proportional: true, ..sample }
    }

    /// Lobes of the whole.
    pub(in super::super) fn flags(&self) -> LobeFlags {
        let scatters = !self.layer.albedo.is_black();
        let base = self.base.flags();
        let mut flags =
            if self.top.is_smooth() { LobeFlags::SPECULAR_REFLECTION } else { LobeFlags::GLOSSY_REFLECTION };
        if scatters || base.intersects(LobeFlags::DIFFUSE_REFLECTION) {
            flags = flags | LobeFlags::DIFFUSE_REFLECTION;
        }
        if base.intersects(LobeFlags::GLOSSY_REFLECTION) {
            flags = flags | LobeFlags::GLOSSY_REFLECTION;
        }
        flags
    }

    /// `e^{−d/|cos|}` over a height `d`.
    #[inline]
    fn transmittance(&self, d: f32, w: LocalDir) -> f32 {
        if d <= 0.0 { 1.0 } else { trig::exp(-d / w.abs_cos_theta().max(f32::MIN_POSITIVE)) }
    }
}

/// Where the next event is.
enum Place {
    Top,
    Base,
    Medium,
}

/// Russian roulette for walks that carry little: after the fourth event in proportion to what they carry (pbrt-v4),
/// before it only those that carry next to nothing, which would cost as much as the first event and add a hundredth.
#[inline]
fn survives(beta: &mut Spectrum, depth: u16, rng: &mut WalkRng) -> bool {
    let largest = beta.max_component();
    let (below, survivors_carry) = if depth <= 3 { (0.1, 0.1) } else { (0.25, 1.0) };
    if largest >= below {
        return true;
    }
    if rng.one() * survivors_carry >= largest {
        return false;
    }
    *beta *= survivors_carry / largest;
    true
}

/// The walk's own random numbers: a counter, hashed.
struct WalkRng(u64);

impl WalkRng {
    fn new(seed: [f32; 6]) -> Self {
        let [a, b, c, d, e, f] = seed.map(|x| u64::from(x.to_bits()));
        Self(combine(combine(combine(0, a << 32 | b), c << 32 | d), e << 32 | f))
    }

    #[inline]
    fn pair(&mut self) -> [f32; 2] {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let h = mix64(self.0);
        [unit_f32((h >> 32) as u32), unit_f32(h as u32)]
    }

    #[inline]
    fn one(&mut self) -> f32 {
        self.pair()[0]
    }
}
