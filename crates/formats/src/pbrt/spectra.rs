//! Parameters that hold spectra, or textures of them.

use scene_desc::{
    FloatInput, Illuminant, IndexOfRefraction, Span, SpectrumDesc, SpectrumInput, TextureId, TextureInput,
    TextureKind,
};

use spectrum::SpectralCurve;

use super::build::{Build, Pairs};
use super::params::{Param, Params, Type, Values};
use crate::source;

/// What an RGB value is to become, and hence which values make sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// A share of light: at most one.
    Albedo,
    /// Any size.
    Unbounded,
    /// Light.
    Illuminant,
}

/// The types that a spectrum is given in.
const SPECTRUM: [Type; 3] = [Type::Rgb, Type::Spectrum, Type::Blackbody];

impl Build<'_, '_> {
    /// A spectrum parameter.
    pub(super) fn spectrum(&mut self, p: &Params, name: &'static str, role: Role) -> Option<SpectrumDesc> {
        let param = p.find(name, &SPECTRUM)?;
        self.spectrum_of(param, p, role)
    }

    /// A spectrum with its size, or else the illuminant of the colour space.
    pub(super) fn illuminant(&mut self, p: &Params, name: &'static str) -> Illuminant {
        let spectrum = self.spectrum(p, name, Role::Illuminant);
        let spectrum = spectrum.unwrap_or(SpectrumDesc::Rgb { rgb: [1.0; 3], space: p.space });
        // Curves of pbrt-v3 are as bright as they say.
        let normalize = !(self.is_old && matches!(spectrum, SpectrumDesc::Curve(_)));
        Illuminant { spectrum, scale: p.float("scale", 1.0, self.report), normalize }
    }

    /// A number or a float texture.
    pub(super) fn float_input(&mut self, p: &Params, name: &'static str) -> Option<FloatInput> {
        let param = p.find(name, &[Type::Float, Type::Texture])?;
        if param.ty == Type::Texture {
            return self.texture_of(param, TextureKind::Float).map(FloatInput::Texture);
        }
        p.float_opt(name, self.report).map(FloatInput::Constant)
    }

    /// A spectrum or a spectrum texture.
    pub(super) fn spectrum_input(
        &mut self,
        p: &Params,
        name: &'static str,
        role: Role,
    ) -> Option<SpectrumInput> {
        let param = p.find(name, &[Type::Rgb, Type::Spectrum, Type::Blackbody, Type::Texture])?;
        if param.ty == Type::Texture {
            return self.texture_of(param, TextureKind::Spectrum).map(SpectrumInput::Texture);
        }
        self.spectrum_of(param, p, role).map(SpectrumInput::Constant)
    }

    /// An operand of a texture.
    pub(super) fn texture_input(
        &mut self,
        p: &Params,
        name: &'static str,
        kind: TextureKind,
        default: f32,
    ) -> TextureInput {
        let input = match kind {
            TextureKind::Float => self.float_input(p, name).map(|x| match x {
                FloatInput::Constant(x) => TextureInput::Float(x),
                FloatInput::Texture(id) => TextureInput::Texture(id),
            }),
            TextureKind::Spectrum => self.spectrum_input(p, name, Role::Unbounded).map(|x| match x {
                SpectrumInput::Constant(x) => TextureInput::Spectrum(x),
                SpectrumInput::Texture(id) => TextureInput::Texture(id),
            }),
        };
        input.unwrap_or(TextureInput::Float(default))
    }

    /// An index of refraction: a number, or a spectrum such as `"glass-BK7"`.
    pub(super) fn ior(&mut self, p: &Params, name: &'static str, default: f32) -> IndexOfRefraction {
        let Some(param) = p.find(name, &[Type::Float, Type::Spectrum, Type::Rgb]) else {
            return IndexOfRefraction::Constant(default);
        };
        if param.ty != Type::Float {
            return match self.spectrum_of(param, p, Role::Unbounded) {
                Some(SpectrumDesc::Constant(eta)) => IndexOfRefraction::Constant(eta),
                Some(spectrum) => IndexOfRefraction::Spectrum(spectrum),
                None => IndexOfRefraction::Constant(default),
            };
        }
        let eta = p.float(name, default, self.report);
        if eta <= 0.0 {
            self.report.error(param.span, format!("\"{name}\" is {eta}")).hint("it must be above 0");
            return IndexOfRefraction::Constant(default);
        }
        IndexOfRefraction::Constant(eta)
    }

    /// The texture that a parameter names.
    pub(super) fn texture_of(&mut self, param: &Param, kind: TextureKind) -> Option<TextureId> {
        let [name] = param.strings() else {
            self.report
                .error(param.span, format!("\"{}\" has {} values", param.name, param.strings().len()))
                .hint("it takes one texture's name");
            return None;
        };
        let (textures, others, what, other) = match kind {
            TextureKind::Float => {
                (&self.float_textures, &self.spectrum_textures, "float texture", "spectrum")
            }
            TextureKind::Spectrum => {
                (&self.spectrum_textures, &self.float_textures, "spectrum texture", "float")
            }
        };
        if let Some(id) = textures.get(name) {
            return Some(*id);
        }
        if others.contains_key(name) {
            let message = format!("\"{name}\" is a {other} texture, and \"{}\" takes a {what}", param.name);
            self.report.error(param.span, message).hint("declare a second texture of that kind");
            return None;
        }
        let known: Vec<_> = textures.keys().cloned().collect();
        self.unknown(what, name, param.span, known.iter());
        None
    }

    fn spectrum_of(&mut self, param: &Param, p: &Params, role: Role) -> Option<SpectrumDesc> {
        match (param.ty, &param.values) {
            (Type::Rgb, Values::Floats(v)) => self.rgb(param, v, p, role),
            (Type::Blackbody, Values::Floats(v)) => match v.as_slice() {
                [t] if *t > 0.0 => Some(SpectrumDesc::Blackbody(*t)),
                [t] => self.refuse(param.span, format!("a black body of {t} K"), "it must be above 0 K"),
                more => {
                    let message = format!("\"{}\" has {} values", param.name, more.len());
                    self.refuse(param.span, message, "it takes one temperature in kelvin")
                }
            },
            (_, Values::Floats(v)) => {
                let pairs: Vec<_> = v.chunks_exact(2).map(|c| (c[0], c[1])).collect();
                match check_pairs(&pairs, v.len()) {
                    None => Some(SpectrumDesc::Curve(pairs.into())),
                    Some(wrong) => {
                        let message = format!("\"{}\": {wrong}", param.name);
                        self.refuse(param.span, message, "expected pairs of wavelength in nm and value")
                    }
                }
            }
            (_, Values::Strings(v)) => match v.as_slice() {
                [name] => self.named_spectrum(name, param.span),
                more => {
                    let message = format!("\"{}\" has {} spectra", param.name, more.len());
                    self.refuse(param.span, message, "it takes one")
                }
            },
            (_, Values::Integers(_) | Values::Bools(_)) => None,
        }
    }

    fn rgb(&mut self, param: &Param, v: &[f32], p: &Params, role: Role) -> Option<SpectrumDesc> {
        let Ok(rgb) = <[f32; 3]>::try_from(v) else {
            let message = format!("\"{}\" has {} values", param.name, v.len());
            return self.refuse(param.span, message, "it takes three: red, green, blue");
        };
        let shown = format!("{} {} {}", rgb[0], rgb[1], rgb[2]);
        if rgb.iter().any(|c| *c < 0.0) {
            let message = format!("\"rgb {}\" [ {shown} ] is negative", param.name);
            return self.refuse(param.span, message, "expected values of at least 0");
        }
        if role == Role::Albedo && rgb.iter().any(|c| *c > 1.0) {
            let message = format!("\"rgb {}\" [ {shown} ] is above 1", param.name);
            return self.refuse(param.span, message, "a surface gives back no more than it receives: 0 to 1");
        }
        Some(SpectrumDesc::Rgb { rgb, space: param.space.unwrap_or(p.space) })
    }

    /// A spectrum that pbrt knows, or one in a file of pairs.
    fn named_spectrum(&mut self, name: &str, span: Span) -> Option<SpectrumDesc> {
        if SpectralCurve::named(name).is_some() {
            return Some(SpectrumDesc::Named(name.to_owned()));
        }
        let path = self.resolve(name);
        if let Some(known) = self.spectra.get(&path) {
            return known.clone().map(SpectrumDesc::Curve);
        }
        let curve = self.spectrum_file(name, span);
        self.spectra.insert(path, curve.clone());
        curve.map(SpectrumDesc::Curve)
    }

    fn spectrum_file(&mut self, name: &str, span: Span) -> Option<Pairs> {
        let path = self.resolve(name);
        let source = match source::read(&path) {
            Ok(source) => source,
            Err(_) if !path.exists() => {
                let message = format!("\"{name}\" is no spectrum that is known, and no file");
                let names = spectrum::spectrum_names();
                let hint = match crate::suggest::nearest(name, names.iter().map(String::as_str)) {
                    Some(n) => format!("did you mean \"{n}\"?"),
                    None => "names are such as \"metal-Au-eta\", \"glass-BK7\", \"stdillum-D65\"".into(),
                };
                return self.refuse(span, message, hint);
            }
            Err(e) => {
                let message = format!("spectrum {} cannot be read: {e}", path.display());
                return self.refuse(span, message, "expected a file of wavelengths and values");
            }
        };
        self.hashes.push(source.hash);
        let text = String::from_utf8_lossy(&source.bytes);
        let mut numbers = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let data = line.split('#').next().unwrap_or_default();
            for word in data.split_ascii_whitespace() {
                match word.parse::<f32>() {
                    Ok(x) if x.is_finite() => numbers.push(x),
                    Ok(_) | Err(_) => {
                        let word = super::params::show(word.as_bytes());
                        let message = format!("{}:{}: {word} is no number", path.display(), i + 1);
                        return self.refuse(span, message, "expected pairs of wavelength in nm and value");
                    }
                }
            }
        }
        let pairs: Vec<_> = numbers.chunks_exact(2).map(|c| (c[0], c[1])).collect();
        if let Some(wrong) = check_pairs(&pairs, numbers.len()) {
            let message = format!("{}: {wrong}", path.display());
            return self.refuse(span, message, "expected pairs of wavelength in nm and value");
        }
        Some(pairs.into())
    }

    /// Reports an error and gives nothing.
    pub(super) fn refuse<T>(
        &mut self,
        span: Span,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> Option<T> {
        self.report.error(span, message).hint(hint);
        None
    }
}

/// What is wrong with pairs of wavelength and value that came as `n` numbers.
fn check_pairs(pairs: &[(f32, f32)], n: usize) -> Option<String> {
    if n == 0 {
        return Some("a spectrum without values".into());
    }
    if !n.is_multiple_of(2) {
        return Some(format!("{n} numbers make no pairs"));
    }
    let bad = pairs.windows(2).find(|w| w[1].0 <= w[0].0)?;
    Some(format!("wavelength {} does not come after {}", bad[1].0, bad[0].0))
}
