//! Transcendental functions with the same bits on every platform (the `libm` crate; never the system's).

pub use libm::{
    acosf as acos, asinf as asin, atan2f as atan2, atanf as atan, cosf as cos, coshf as cosh, exp2f as exp2,
    expf as exp, log2f as log2, logf as ln, powf as pow, sincosf as sin_cos, sinf as sin, sinhf as sinh,
    tanf as tan, tanhf as tanh,
};

/// Double precision, for tables and builds.
pub mod f64 {
    pub use libm::{
        acos, asin, atan, atan2, cos, cosh, erf, exp, exp2, log as ln, log2, pow, sin, sincos as sin_cos,
        sinh, tan, tanh,
    };
}

/// arcsine of a value that rounding may have pushed past ±1.
#[must_use]
pub fn safe_asin(x: f32) -> f32 {
    asin(x.clamp(-1.0, 1.0))
}

/// arccosine of a value that rounding may have pushed past ±1.
#[must_use]
pub fn safe_acos(x: f32) -> f32 {
    acos(x.clamp(-1.0, 1.0))
}

/// Square root of a value that rounding may have pushed below zero.
#[must_use]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}
