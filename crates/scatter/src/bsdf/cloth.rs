//! The sheen of cloth: fibres that stand up from the surface.
//!
//! | step   | source                                                              |
//! |--------|---------------------------------------------------------------------|
//! | `D`    | [Conty2017]: `(2 + 1/α) sin^{1/α} θ / 2π`                            |
//! | masking | `1 / (4 (cos + cos' − cos cos'))`, that of `KHR_materials_sheen`    |
//! | albedo | tabulated once, by quadrature                                       |

use std::f32::consts::TAU;
use std::sync::LazyLock;

use math::{LocalDir, trig};

/// `f` of white fibres; both directions are on one side.
pub(super) fn eval(alpha: f32, wo: LocalDir, wi: LocalDir, m: LocalDir) -> f32 {
    let (co, ci) = (wo.abs_cos_theta(), wi.abs_cos_theta());
    let sin = trig::safe_sqrt(1.0 - m.0.z * m.0.z);
    let d = (2.0 + 1.0 / alpha) * trig::pow(sin, 1.0 / alpha) / TAU;
    d / (4.0 * (co + ci - co * ci)).max(f32::MIN_POSITIVE)
}

/// The width of a roughness.
pub(super) fn alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(0.005)
}

/// What white fibres give back from an angle of this cosine.
pub(super) fn albedo(alpha: f32, cos: f32) -> f32 {
    let x = trig::safe_sqrt(cos.min(1.0)) * (N - 1) as f32;
    let y = trig::safe_sqrt(alpha.min(1.0)) * (N - 1) as f32;
    let (i, k) = ((x as usize).min(N - 2), (y as usize).min(N - 2));
    let (fx, fy) = (x - i as f32, y - k as f32);
    let row = |k: usize| TABLE[k][i] + (TABLE[k][i + 1] - TABLE[k][i]) * fx;
    row(k) + (row(k + 1) - row(k)) * fy
}

/// Nodes each way, evenly spaced in the root of the width and of the cosine.
const N: usize = 24;

static TABLE: LazyLock<[[f32; N]; N]> = LazyLock::new(|| {
    let mut table = [[0.0; N]; N];
    let node = |i: usize| (i as f32 / (N - 1) as f32) * (i as f32 / (N - 1) as f32);
    for (k, row) in table.iter_mut().enumerate() {
        for (i, entry) in row.iter_mut().enumerate() {
            *entry = integrate(node(k).max(0.005), node(i).max(1e-3));
        }
    }
    table
});

fn integrate(alpha: f32, cos: f32) -> f32 {
    let wo = LocalDir::new(trig::safe_sqrt(1.0 - cos * cos), 0.0, cos);
    let n = 1024_u32;
    let sum: f64 = (0..n)
        .map(|i| {
            let u = [(i as f32 + 0.5) / n as f32, math::hash::unit_f32(i.wrapping_mul(0x9e37_79b9))];
            let wi = sampling::warp::uniform_hemisphere(u);
            let m = LocalDir::normalize(wo.0 + wi.0);
            f64::from(eval(alpha, wo, wi, m) * wi.0.z)
        })
        .sum();
    (sum / f64::from(n)) as f32 * TAU
}
