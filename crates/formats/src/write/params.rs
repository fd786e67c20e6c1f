//! Parameters in pbrt's syntax.

use std::fmt::Write as _;

use math::{Vec2, Vec3};
use scene_desc::{ColorSpaceName, FloatInput, Illuminant, Span, SpectrumDesc, SpectrumInput, TextureInput};

use super::Writer;

/// A parameter list on its way.
#[derive(Default)]
pub(super) struct Params(pub(super) String);

impl Params {
    pub(super) fn put(&mut self, ty: &str, name: &str, value: &str) {
        // Writing to a string cannot fail.
        let _ = write!(self.0, " \"{ty} {name}\" {value}");
    }

    pub(super) fn float(&mut self, name: &str, x: f32) {
        self.put("float", name, &x.to_string());
    }

    /// Only where it is not the default.
    pub(super) fn float_unless(&mut self, name: &str, x: f32, default: f32) {
        if x != default {
            self.float(name, x);
        }
    }

    pub(super) fn integer(&mut self, name: &str, n: u32) {
        self.put("integer", name, &n.to_string());
    }

    pub(super) fn boolean(&mut self, name: &str, b: bool) {
        self.put("bool", name, if b { "true" } else { "false" });
    }

    pub(super) fn string(&mut self, name: &str, s: &str) {
        self.put("string", name, &Writer::quoted(s));
    }

    pub(super) fn floats(&mut self, ty: &str, name: &str, values: impl IntoIterator<Item = f32>) {
        let numbers: Vec<_> = values.into_iter().map(|x| x.to_string()).collect();
        self.put(ty, name, &format!("[ {} ]", numbers.join(" ")));
    }

    pub(super) fn vec3s(&mut self, ty: &str, name: &str, values: &[Vec3]) {
        self.floats(ty, name, values.iter().flat_map(|v| v.to_array()));
    }

    pub(super) fn vec2s(&mut self, ty: &str, name: &str, values: &[Vec2]) {
        self.floats(ty, name, values.iter().flat_map(|v| v.to_array()));
    }

    pub(super) fn indices(&mut self, values: impl IntoIterator<Item = u32>) {
        let numbers: Vec<_> = values.into_iter().map(|x| x.to_string()).collect();
        self.put("integer", "indices", &format!("[ {} ]", numbers.join(" ")));
    }
}

impl Writer<'_, '_, '_> {
    /// A spectrum that is no light.
    pub(super) fn spectrum(&mut self, p: &mut Params, name: &str, desc: &SpectrumDesc, span: Span) {
        match desc {
            // A grey colour is the same at every wavelength.
            SpectrumDesc::Constant(c) => p.floats("rgb", name, [*c; 3]),
            SpectrumDesc::Rgb { rgb, space } => {
                self.check_space(*space, span);
                p.floats("rgb", name, *rgb);
            }
            SpectrumDesc::Blackbody(kelvin) => p.put("blackbody", name, &kelvin.to_string()),
            SpectrumDesc::Named(named) => p.put("spectrum", name, &Self::quoted(named)),
            SpectrumDesc::Curve(pairs) => {
                p.floats("spectrum", name, pairs.iter().flat_map(|(l, v)| [*l, *v]))
            }
        }
    }

    pub(super) fn check_space(&mut self, space: ColorSpaceName, span: Span) {
        if space != self.scene.film.color_space {
            let instead = "its numbers are written as they are: colours differ";
            self.otherwise(span, "colours of several spaces in what is written here", instead);
        }
    }

    pub(super) fn spectrum_input(&mut self, p: &mut Params, name: &str, input: &SpectrumInput, span: Span) {
        match input {
            SpectrumInput::Constant(desc) => self.spectrum(p, name, desc, span),
            SpectrumInput::Texture(id) => p.put("texture", name, &Self::quoted(&format!("texture-{}", id.0))),
        }
    }

    pub(super) fn float_input(p: &mut Params, name: &str, input: &FloatInput) {
        match input {
            FloatInput::Constant(x) => p.float(name, *x),
            FloatInput::Texture(id) => p.put("texture", name, &Self::quoted(&format!("texture-{}", id.0))),
        }
    }

    /// An operand of a texture of spectra or of numbers.
    pub(super) fn texture_input(
        &mut self,
        p: &mut Params,
        name: &str,
        input: &TextureInput,
        (is_spectrum, span): (bool, Span),
    ) {
        match input {
            TextureInput::Float(x) if is_spectrum => p.floats("rgb", name, [*x; 3]),
            TextureInput::Float(x) => p.float(name, *x),
            TextureInput::Spectrum(desc) => self.spectrum(p, name, desc, span),
            TextureInput::Texture(id) => p.put("texture", name, &Self::quoted(&format!("texture-{}", id.0))),
        }
    }

    /// Emitted light: pbrt divides all spectra but colours by their luminance.
    pub(super) fn illuminant(&mut self, p: &mut Params, name: &str, light: &Illuminant, span: Span) {
        let mut scale = light.scale;
        match &light.spectrum {
            SpectrumDesc::Constant(c) => {
                // The same at every wavelength, as pairs: a number is no spectrum for pbrt.
                let value = if *c == 0.0 { 0.0 } else { 1.0 };
                p.floats("spectrum", name, [360.0, value, 830.0, value]);
                scale *= if light.normalize { 1.0 } else { *c };
            }
            SpectrumDesc::Rgb { .. } => self.spectrum(p, name, &light.spectrum, span),
            desc @ (SpectrumDesc::Blackbody(_) | SpectrumDesc::Named(_) | SpectrumDesc::Curve(_)) => {
                self.spectrum(p, name, desc, span);
                if !light.normalize {
                    let curve = match desc {
                        SpectrumDesc::Curve(pairs) => {
                            let numbers: Vec<f32> = pairs.iter().flat_map(|(l, v)| [*l, *v]).collect();
                            spectrum::SpectralCurve::from_interleaved(&numbers).ok()
                        }
                        SpectrumDesc::Blackbody(kelvin) => {
                            Some(spectrum::SpectralCurve::Blackbody { kelvin: *kelvin })
                        }
                        SpectrumDesc::Named(name) => spectrum::SpectralCurve::named(name),
                        SpectrumDesc::Constant(_) | SpectrumDesc::Rgb { .. } => None,
                    };
                    let size = curve.map_or(0.0, |c| spectrum::photometric(&c));
                    scale *= size / spectrum::y_integral() as f32;
                }
            }
        }
        p.float_unless("scale", scale, 1.0);
    }
}
