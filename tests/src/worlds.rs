//! Worlds with closed forms that several tests use.

/// The unit cube, its ceiling with a hole for a lamp of half the side.
#[must_use]
pub fn radiosity_box(white: &str, left: &str, right: &str) -> String {
    let wall = |rho: &str, p: &str| {
        format!(
            "Material \"diffuse\" \"rgb reflectance\" [{rho}]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2  0 2 3] \"point3 P\" [{p}]\n"
        )
    };
    [
        (white, "0 0 0 1 0 0 1 1 0 0 1 0"),
        (white, "0 0 0 1 0 0 1 0 1 0 0 1"),
        (white, "0 1 0 1 1 0 1 1 1 0 1 1"),
        (left, "0 0 0 0 1 0 0 1 1 0 0 1"),
        (right, "1 0 0 1 1 0 1 1 1 1 0 1"),
        (white, "0 0 1 1 0 1 1 .25 1 0 .25 1"),
        (white, "0 .75 1 1 .75 1 1 1 1 0 1 1"),
        (white, "0 .25 1 .25 .25 1 .25 .75 1 0 .75 1"),
        (white, "0.75 .25 1 1 .25 1 1 .75 1 0.75 .75 1"),
    ]
    .iter()
    .map(|(rho, p)| wall(rho, p))
    .collect::<String>()
        // One-sided: down. (Light paths would be lost above.)
        + "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
        + &wall("0 0 0", "0.25 0.25 1 0.25 0.75 1 0.75 0.75 1 0.75 0.25 1")
}

/// Irradiance below the rectangle [0, a] × [0, b] at height 1, odd in a and b.
#[must_use]
pub fn corner_irradiance(a: f64, b: f64) -> f64 {
    let part = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * libm::atan(b / (1.0 + a * a).sqrt());
    0.5 * (part(a, b) + part(b, a))
}
