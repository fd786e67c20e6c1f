//! From spectra as people write them to values that a path evaluates.

use std::sync::Arc;

use scene_desc::{ColorSpaceName, Sink, Span, SpectrumDesc};
use spectrum::{ColorPipeline, ColorSpace, SpectralCurve, SpectrumValue, spectrum_names};

/// What a colour stands for: the same R, G, B is another spectrum as a reflectance than as a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SpectrumRole {
    /// A reflectance, a transmittance or an albedo: within [0, 1].
    Albedo,
    /// A refractive index, a cross-section, a length: not negative.
    Unbounded,
    /// Emitted light.
    Illuminant,
}

/// The primaries that a file names.
#[must_use]
pub fn color_space(name: ColorSpaceName) -> ColorSpace {
    match name {
        ColorSpaceName::Srgb => ColorSpace::Srgb,
        ColorSpaceName::DciP3 => ColorSpace::DciP3,
        ColorSpaceName::Rec2020 => ColorSpace::Rec2020,
        ColorSpaceName::Aces2065_1 => ColorSpace::Aces2065,
    }
}

/// The curve that a spectrum is in a role. An unknown name or unusable points are reported and become zero.
#[must_use]
pub fn spectral_curve(desc: &SpectrumDesc, role: SpectrumRole, span: Span, sink: &mut Sink) -> SpectralCurve {
    match desc {
        SpectrumDesc::Constant(c) => SpectralCurve::Constant(*c),
        SpectrumDesc::Rgb { rgb, space } => {
            let (rgb, space) = (*rgb, color_space(*space));
            match role {
                SpectrumRole::Albedo => SpectralCurve::RgbAlbedo { space, rgb },
                SpectrumRole::Unbounded => SpectralCurve::RgbUnbounded { space, rgb },
                SpectrumRole::Illuminant => SpectralCurve::RgbIlluminant { space, rgb },
            }
        }
        SpectrumDesc::Blackbody(kelvin) => SpectralCurve::Blackbody { kelvin: *kelvin },
        SpectrumDesc::Named(name) => SpectralCurve::named(name).unwrap_or_else(|| {
            unknown_name(name, span, sink);
            SpectralCurve::Constant(0.0)
        }),
        SpectrumDesc::Curve(points) => curve_of_points(points, span, sink),
    }
}

/// The value of a spectrum in a role, for a render's colours.
#[must_use]
pub fn spectrum_value(
    desc: &SpectrumDesc,
    role: SpectrumRole,
    colors: ColorPipeline,
    span: Span,
    sink: &mut Sink,
) -> SpectrumValue {
    if role == SpectrumRole::Albedo {
        warn_of_lost_energy(desc, span, sink);
    }
    let curve = spectral_curve(desc, role, span, sink);
    match role {
        SpectrumRole::Albedo => colors.albedo(&curve),
        SpectrumRole::Unbounded => colors.unbounded(&curve),
        SpectrumRole::Illuminant => colors.illuminant(&curve),
    }
}

fn curve_of_points(points: &Arc<[(f32, f32)]>, span: Span, sink: &mut Sink) -> SpectralCurve {
    let interleaved: Vec<f32> = points.iter().flat_map(|&(lambda, value)| [lambda, value]).collect();
    SpectralCurve::from_interleaved(&interleaved).unwrap_or_else(|e| {
        sink.error(span, e.to_string()).hint("pairs of a wavelength in nm and a value, in rising order");
        SpectralCurve::Constant(0.0)
    })
}

/// Reflectances above one are limited; say so.
fn warn_of_lost_energy(desc: &SpectrumDesc, span: Span, sink: &mut Sink) {
    let outside = |x: &f32| !(0.0..=1.0).contains(x);
    let value = match desc {
        SpectrumDesc::Constant(c) if outside(c) => c.to_string(),
        SpectrumDesc::Rgb { rgb, .. } if rgb.iter().any(outside) => format!("{rgb:?}"),
        SpectrumDesc::Constant(_)
        | SpectrumDesc::Rgb { .. }
        | SpectrumDesc::Blackbody(_)
        | SpectrumDesc::Named(_)
        | SpectrumDesc::Curve(_) => return,
    };
    sink.warning(span, format!("reflectance {value} is outside [0, 1]"))
        .hint("it is limited to [0, 1]: a surface gives back no more than it gets");
}

fn unknown_name(name: &str, span: Span, sink: &mut Sink) {
    let names = spectrum_names();
    let hint = match nearest_names(name, &names).as_slice() {
        [] => format!("known names: {}", names.join(", ")),
        near => format!("did you mean {}?", near.join(" or ")),
    };
    sink.error(span, format!("no spectrum is named \"{name}\"")).hint(hint);
}

/// At most three names that differ from `name` in a third of its letters or fewer, the most similar first.
fn nearest_names(name: &str, names: &[String]) -> Vec<String> {
    let lower = name.to_lowercase();
    let mut near: Vec<(usize, &String)> = names
        .iter()
        .map(|n| (edit_distance(&lower, &n.to_lowercase()), n))
        .filter(|(d, _)| *d <= lower.chars().count().div_ceil(3))
        .collect();
    near.sort();
    near.into_iter().take(3).map(|(_, n)| n.clone()).collect()
}

/// Insertions, deletions and replacements from `a` to `b`.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_desc::Severity;
    use spectrum::{ColorMode, Wavelengths};

    const RGB: ColorPipeline = ColorPipeline::new(ColorMode::Rgb, ColorSpace::Srgb);

    #[test]
    fn a_misspelt_name_is_an_error_with_the_right_name() {
        let mut sink = Sink::default();
        let desc = SpectrumDesc::Named("metal-Au-etta".into());
        let value = spectrum_value(&desc, SpectrumRole::Unbounded, RGB, Span::NONE, &mut sink);
        assert!(value.is_black());
        let d = &sink.diagnostics()[0];
        assert_eq!(d.severity, Severity::Error);
        assert_eq!(d.message, "no spectrum is named \"metal-Au-etta\"");
        assert!(d.hint.as_ref().unwrap().starts_with("did you mean metal-Au-eta"), "{:?}", d.hint);
    }

    #[test]
    fn reflectances_above_one_are_limited_and_said() {
        let mut sink = Sink::default();
        let desc = SpectrumDesc::srgb([1.5, 0.5, 0.25]);
        let value = spectrum_value(&desc, SpectrumRole::Albedo, RGB, Span::NONE, &mut sink);
        assert_eq!(value.eval(&Wavelengths::RGB).rgb(), [1.0, 0.5, 0.25]);
        assert_eq!(sink.diagnostics()[0].message, "reflectance [1.5, 0.5, 0.25] is outside [0, 1]");
        let value = spectrum_value(&desc, SpectrumRole::Unbounded, RGB, Span::NONE, &mut sink);
        assert_eq!(value.eval(&Wavelengths::RGB).rgb(), [1.5, 0.5, 0.25]);
        assert_eq!(sink.diagnostics().len(), 1);
    }

    #[test]
    fn falling_wavelengths_are_an_error() {
        let mut sink = Sink::default();
        let desc = SpectrumDesc::Curve(Arc::from([(500.0, 1.0), (400.0, 1.0)]));
        let _ = spectrum_value(&desc, SpectrumRole::Albedo, RGB, Span::NONE, &mut sink);
        assert!(sink.has_errors());
    }

    #[test]
    fn edit_distances_are_levenshteins() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("glass-BK7", "glass-BK7"), 0);
    }
}
