//! Elements that hold one value, and the renaming of what older versions called otherwise.

use std::path::PathBuf;
use std::sync::Arc;

use math::{AnimatedTransform, DMat4, DVec3, Transform};

use super::spectra::{self, Spectral};
use super::text;
use super::transform::Wrong;
use super::tree::{Class, Node, Prop, Value, resolve};

type Read = Result<(Value, Option<u64>), Wrong>;

fn wrong(message: impl Into<String>, hint: &'static str) -> Read {
    Err(Wrong { message: message.into(), hint })
}

/// The value of an element (and the hash of the file that it was read from); `None` if the element holds none.
pub(super) fn read<'a>(
    element: &str,
    get: &impl Fn(&str) -> Option<&'a str>,
    dirs: &[PathBuf],
) -> Option<Read> {
    let value = get("value").unwrap_or_default();
    let shown = text::show(value);
    let good = |v| Ok((v, None));
    Some(match element {
        "float" => match text::number(value) {
            Some(x) => good(Value::Float(x)),
            None => wrong(format!("\"{shown}\" is no number"), "expected a number such as 0.5"),
        },
        "integer" => match text::integer(value) {
            Some(n) => good(Value::Integer(n)),
            None => wrong(format!("\"{shown}\" is no whole number"), "expected a number such as 16"),
        },
        "boolean" => match value.trim().to_ascii_lowercase().as_str() {
            "true" => good(Value::Bool(true)),
            "false" => good(Value::Bool(false)),
            _ => wrong(format!("\"{shown}\" is neither true nor false"), "expected true or false"),
        },
        "string" => good(Value::Text(value.to_owned())),
        "vector" | "point" => vector(get),
        "rgb" | "srgb" => rgb(value, element == "srgb"),
        "blackbody" => blackbody(get),
        "spectrum" => spectrum(get, dirs),
        _ => return None,
    })
}

fn vector<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> Read {
    let hint = "expected x=\"…\" y=\"…\" z=\"…\"";
    if let Some(all) = get("value") {
        return match text::numbers(all).as_deref() {
            Ok([x, y, z]) => Ok((Value::Vector([*x, *y, *z]), None)),
            Ok(other) => wrong(format!("{} numbers", other.len()), "expected three"),
            Err(item) => wrong(format!("\"{}\" is no number", text::show(item)), hint),
        };
    }
    let mut v = [0.0; 3];
    for (v, name) in v.iter_mut().zip(["x", "y", "z"]) {
        match get(name).map(text::number) {
            Some(Some(x)) => *v = x,
            Some(None) => return wrong(format!("{name} is no number"), hint),
            None => return wrong(format!("{name} is missing"), hint),
        }
    }
    Ok((Value::Vector(v), None))
}

fn rgb(value: &str, is_encoded: bool) -> Read {
    let numbers = match hex(value) {
        Some(numbers) => numbers.to_vec(),
        None => match text::numbers(value) {
            Ok(v) => v,
            Err(item) => {
                return wrong(format!("\"{}\" is no number", text::show(item)), "expected red, green, blue");
            }
        },
    };
    let rgb = match numbers.as_slice() {
        [v] => [*v; 3],
        [r, g, b] => [*r, *g, *b],
        other => return wrong(format!("{} numbers", other.len()), "expected one or three"),
    };
    let linear = |x: f64| if is_encoded { spectrum::srgb_decode(x as f32) } else { x as f32 };
    Ok((Value::Rgb(rgb.map(linear)), None))
}

/// `#rrggbb` of version 0.x.
fn hex(value: &str) -> Option<[f64; 3]> {
    let digits = value.trim().strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let all = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| f64::from((all >> shift) & 255) / 255.0))
}

fn blackbody<'a>(get: &impl Fn(&str) -> Option<&'a str>) -> Read {
    let kelvin = get("temperature").map(|t| t.trim().trim_end_matches(['K', 'k'])).and_then(text::number);
    let scale = get("scale").map_or(Some(1.0), text::number);
    match (kelvin.filter(|k| *k > 0.0), scale) {
        (Some(kelvin), Some(scale)) => {
            let (kelvin, scale) = (kelvin as f32, scale as f32);
            Ok((Value::Spectrum(Spectral::Blackbody { kelvin, scale }), None))
        }
        _ => wrong("no temperature", "expected temperature=\"5000\", and scale=\"1\" if need be"),
    }
}

fn spectrum<'a>(get: &impl Fn(&str) -> Option<&'a str>, dirs: &[PathBuf]) -> Read {
    let value = match (get("value"), get("filename")) {
        (Some(value), None) => value,
        (None, Some(name)) => {
            let path = resolve(dirs, name);
            return match spectra::from_file(&path) {
                Ok((pairs, hash)) => Ok((Value::Spectrum(Spectral::Curve(pairs)), Some(hash))),
                Err(message) => wrong(message, "expected lines of a wavelength in nm and a value"),
            };
        }
        (_, _) => return wrong("either value or filename is needed", "one of them, not both"),
    };
    if !value.contains(':') {
        return match text::numbers(value).as_deref() {
            Ok([x]) => Ok((Value::Spectrum(Spectral::Constant(*x as f32)), None)),
            // Version 0.x, built for RGB.
            Ok([r, g, b]) => Ok((Value::Rgb([*r, *g, *b].map(|x| x as f32)), None)),
            Ok(other) => wrong(format!("{} numbers", other.len()), "expected one, or wavelength:value, …"),
            Err(item) => {
                wrong(format!("\"{}\" is no number", text::show(item)), "expected wavelength:value, …")
            }
        };
    }
    let mut pairs = Vec::new();
    for item in text::items(value) {
        let pair = item.split_once(':').and_then(|(l, v)| Some((text::number(l)?, text::number(v)?)));
        match pair {
            Some((l, v)) => pairs.push((l as f32, v as f32)),
            None => {
                return wrong(format!("\"{}\" is no pair", text::show(item)), "expected wavelength:value, …");
            }
        }
    }
    match spectra::check_pairs(&pairs) {
        None => Ok((Value::Spectrum(Spectral::Curve(Arc::from(pairs))), None)),
        Some(message) => wrong(message, "wavelengths rise from pair to pair"),
    }
}

/// What versions before 2.0 called otherwise, besides the names themselves.
pub(super) fn upgrade(node: &mut Node) {
    if node.class == Class::Bsdf && node.kind == "diffuse" {
        for p in node.props.iter_mut().filter(|p| p.name == "diffuse_reflectance") {
            p.name = "reflectance".into();
        }
    }
    let number = |name: &str| {
        let found = node.props.iter().find(|p| p.name == name)?;
        match found.value {
            Value::Float(x) => Some(x),
            Value::Integer(n) => Some(n as f64),
            _ => None,
        }
    };
    let names = ["uscale", "vscale", "uoffset", "voffset"];
    let found = names.map(number);
    if found.iter().all(Option::is_none) || node.class != Class::Texture {
        return;
    }
    let at = |i: usize, default: f64| found[i].unwrap_or(default);
    let scale = DMat4::from_scale(DVec3::new(at(0, 1.0), at(1, 1.0), 1.0));
    let matrix = scale * DMat4::from_translation(DVec3::new(at(2, 0.0), at(3, 0.0), 0.0));
    let span = node.span;
    node.props.retain(|p| !names.contains(&p.name.as_str()));
    if let Some(t) = Transform::from_matrix(matrix) {
        let value = Value::Transform(Box::new(AnimatedTransform::fixed(t)));
        node.props.push(Prop { name: "to_uv".into(), value, span, used: std::cell::Cell::new(false) });
    }
}
