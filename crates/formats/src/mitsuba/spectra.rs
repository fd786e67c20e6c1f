//! Spectra: as Mitsuba means them where they are emitted, where they reflect, and anywhere else.
//!
//! | written as                | emitted                            | reflected                 | index, coefficient  |
//! |---------------------------|------------------------------------|---------------------------|---------------------|
//! | `rgb`                     | that colour of D65                 | upsampled to a reflectance| a smooth spectrum   |
//! | `spectrum value="1"`      | white: D65 of that luminance       | constant                  | constant            |
//! | `spectrum` with pairs     | those values; one has luminance 1  | those values              | those values        |
//!
//! Mitsuba's RGB variants turn a reflectance of pairs to RGB under the equal-energy spectrum, which makes white
//! surfaces pink; we see it under D65, as their spectral variants do.

use std::path::Path;
use std::sync::Arc;

use scene_desc::{Illuminant, Span, SpectrumDesc};

use super::build::Build;
use super::text;
use super::tree::{Node, Value};
use crate::{source, suggest};

/// Wavelengths and values.
pub(super) type Pairs = Arc<[(f32, f32)]>;

/// A spectrum as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Spectral {
    /// The same everywhere; white where it is emitted.
    Constant(f32),
    /// Straight lines between pairs.
    Curve(Pairs),
    /// In W m⁻² sr⁻¹ nm⁻¹, times a factor.
    Blackbody { kelvin: f32, scale: f32 },
    /// D65, of this luminance where it is emitted.
    D65(f32),
    /// A colour.
    Rgb([f32; 3]),
}

impl Spectral {
    /// As a reflectance, an index or a coefficient.
    pub(super) fn plain(&self) -> SpectrumDesc {
        match self {
            Self::Constant(c) => SpectrumDesc::Constant(*c),
            Self::Curve(pairs) => SpectrumDesc::Curve(Arc::clone(pairs)),
            Self::Blackbody { kelvin, scale } => SpectrumDesc::Curve(planck(*kelvin, *scale)),
            Self::D65(_) => SpectrumDesc::Named("stdillum-D65".into()),
            Self::Rgb(rgb) => SpectrumDesc::srgb(*rgb),
        }
    }

    /// As emitted light.
    pub(super) fn light(&self) -> Illuminant {
        let spectrum = match self {
            // White is D65 in spectral variants, and one in all channels in RGB.
            Self::Constant(c) | Self::D65(c) => SpectrumDesc::srgb([*c; 3]),
            Self::Rgb(rgb) => SpectrumDesc::srgb(*rgb),
            Self::Curve(_) => self.plain(),
            // Mitsuba's radiance of a black body has a unit, its film none: nothing is divided by ∫ȳ.
            Self::Blackbody { kelvin, scale } => {
                SpectrumDesc::Curve(planck(*kelvin, *scale * spectrum::y_integral() as f32))
            }
        };
        Illuminant { spectrum, scale: 1.0, normalize: false }
    }
}

/// A black body's radiance in steps of 5 nm.
fn planck(kelvin: f32, scale: f32) -> Pairs {
    let wavelengths = (0..=94).map(|i| 360.0 + 5.0 * i as f32);
    wavelengths.map(|l| (l, spectrum::planck(f64::from(l), f64::from(kelvin)) as f32 * scale)).collect()
}

/// What is wrong with pairs.
pub(super) fn check_pairs(pairs: &[(f32, f32)]) -> Option<String> {
    if pairs.is_empty() {
        return Some("no values".into());
    }
    let bad = pairs.windows(2).find(|w| w[1].0 <= w[0].0)?;
    Some(format!("wavelength {} does not come after {}", bad[1].0, bad[0].0))
}

/// Reads lines of a wavelength and a value; gives the file's hash as well.
pub(super) fn from_file(path: &Path) -> Result<(Pairs, u64), String> {
    let source = source::read(path).map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
    let content = String::from_utf8_lossy(&source.bytes);
    let mut pairs = Vec::new();
    for (i, line) in content.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        match text::numbers(line).as_deref() {
            Ok([l, v]) => pairs.push((*l as f32, *v as f32)),
            _ => return Err(format!("{}:{}: no pair: {}", path.display(), i + 1, text::show(line))),
        }
    }
    match check_pairs(&pairs) {
        None => Ok((pairs.into(), source.hash)),
        Some(wrong) => Err(format!("{}: {wrong}", path.display())),
    }
}

/// The plug-ins that are spectra.
pub(super) const PLUGINS: [&str; 7] =
    ["uniform", "d65", "blackbody", "srgb", "regular", "irregular", "rawconstant"];

impl Build<'_, '_, '_> {
    /// A spectrum that is a plug-in; `None` if it is a texture, or wrong.
    pub(super) fn spectrum_plugin(&mut self, node: &Node) -> Option<Spectral> {
        let found = match node.kind.as_str() {
            "uniform" => Spectral::Constant(self.float(node, "value", 1.0)),
            "rawconstant" => match node.find("value").map(|p| &p.value) {
                Some(Value::Vector(v)) => Spectral::Rgb(v.map(|x| x as f32)),
                _ => Spectral::Constant(self.float(node, "value", 1.0)),
            },
            "d65" => {
                let scale = self.float(node, "scale", 1.0);
                match node.find("color").map(|p| &p.value) {
                    Some(Value::Rgb(rgb)) => Spectral::Rgb(rgb.map(|c| c * scale)),
                    _ => Spectral::D65(scale),
                }
            }
            "srgb" => match node.find("color").map(|p| &p.value) {
                Some(Value::Rgb(rgb)) => Spectral::Rgb(*rgb),
                Some(Value::Vector(v)) => Spectral::Rgb(v.map(|x| x as f32)),
                _ => {
                    return self.refuse(
                        node.span,
                        "a colour without \"color\"",
                        "add <rgb name=\"color\" …/>",
                    );
                }
            },
            "blackbody" => {
                let kelvin = self.float(node, "temperature", 5000.0);
                node.accept(&["lambda_min", "lambda_max", "wavelength_min", "wavelength_max"]);
                Spectral::Blackbody { kelvin: kelvin.max(1.0), scale: self.float(node, "scale", 1.0) }
            }
            "regular" | "irregular" => Spectral::Curve(self.tabulated(node)?),
            _ => return None,
        };
        self.unused(node);
        Some(found)
    }

    fn tabulated(&mut self, node: &Node) -> Option<Pairs> {
        let values = self.number_list(node, "values")?;
        let wavelengths = if node.kind == "irregular" {
            self.number_list(node, "wavelengths")?
        } else {
            let min = f64::from(self.float(node, "wavelength_min", 360.0));
            let max = f64::from(self.float(node, "wavelength_max", 830.0));
            let step = (max - min) / (values.len().max(2) - 1) as f64;
            (0..values.len()).map(|i| min + step * i as f64).collect()
        };
        if wavelengths.len() != values.len() {
            let message = format!("{} wavelengths for {} values", wavelengths.len(), values.len());
            return self.refuse(node.span, message, "expected as many");
        }
        let pairs: Vec<_> = wavelengths.iter().zip(&values).map(|(l, v)| (*l as f32, *v as f32)).collect();
        match check_pairs(&pairs) {
            None => Some(pairs.into()),
            Some(wrong) => self.refuse(node.span, wrong, "wavelengths rise from pair to pair"),
        }
    }

    /// A list of numbers in a string.
    pub(super) fn number_list(&mut self, node: &Node, name: &'static str) -> Option<Vec<f64>> {
        let Some(list) = self.string(node, name) else {
            let hint = format!("add <string name=\"{name}\" value=\"…\"/>");
            return self.refuse(node.span, format!("{} has no \"{name}\"", node.title()), hint);
        };
        match text::numbers(&list) {
            Ok(v) => Some(v),
            Err(item) => {
                let message = format!("\"{}\" is no number", text::show(item));
                self.refuse(node.span_of(name), message, "expected numbers")
            }
        }
    }

    /// Indices of refraction by their names.
    pub(super) fn named_ior(&mut self, name: &str, span: Span) -> Option<f32> {
        let found = IORS.iter().find(|i| i.0 == name.to_ascii_lowercase().trim());
        if found.is_none() {
            let names: Vec<_> = IORS.iter().map(|i| i.0).collect();
            self.report
                .error(span, format!("no index of refraction is known of \"{}\"", text::show(name)))
                .hint(suggest::hint(name, &names));
        }
        found.map(|i| i.1)
    }
}

/// Indices of refraction of common materials, by the names that Mitsuba has for them: values of Wikipedia's list of
/// refractive indices at 589 nm, as its documentation states.
const IORS: [(&str, f32); 22] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.3330),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.470),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("diamond", 2.419),
];
