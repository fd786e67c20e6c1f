//! A comparison as one page that opens without a network: pictures with a slider, plots, tables, and every setting.
//!
//! The page is a template with a style and a script; figures go in as JSON, pictures as half floats in base64, plots as SVG.
//! The script only shows: it decodes, tone-maps and compares pixels, and computes no figure that is not in the JSON.

mod files;
mod plots;

pub use files::save;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use half::f16;

use crate::comparison::{Comparison, Pictures};

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Colours of methods in plots, tables and legends: Okabe and Ito's, which people with any colour vision tell apart.
pub(crate) const COLORS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [148, 118, 86],
];

/// The page of a comparison. `title` is what it is called, `command` what was typed to make it.
///
/// # Errors
/// The figures cannot be written as JSON, or a plot cannot be drawn.
pub fn page(comparison: &Comparison, title: &str, command: &str) -> Result<String, String> {
    let json = serde_json::to_string(comparison).map_err(|e| e.to_string())?;
    let pictures = std::iter::once(&comparison.truth).chain(&comparison.pictures);
    let data: String = pictures.enumerate().map(|(i, p)| picture(i, p)).collect();
    let colors: Vec<String> = COLORS.iter().map(|c| format!("\"rgb({},{},{})\"", c[0], c[1], c[2])).collect();
    let fields = [
        ("{{title}}", escape(title)),
        ("{{command}}", escape(command)),
        ("{{style}}", STYLE.to_owned()),
        ("{{plot-time}}", plots::convergence(comparison, plots::Axis::Seconds)?),
        ("{{plot-samples}}", plots::convergence(comparison, plots::Axis::Samples)?),
        ("{{pictures}}", data),
        ("{{colors}}", colors.join(",")),
        // What could end a script early is written otherwise; JSON means the same.
        ("{{data}}", json.replace('<', "\\u003c")),
        ("{{script}}", SCRIPT.to_owned()),
    ];
    // One pass over the template, so that what is put in is not looked at again.
    let mut page = String::new();
    let mut rest = TEMPLATE;
    while let Some(at) = rest.find("{{") {
        page.push_str(&rest[..at]);
        rest = &rest[at..];
        match fields.iter().find(|(name, _)| rest.starts_with(name)) {
            Some((name, value)) => {
                page.push_str(value);
                rest = &rest[name.len()..];
            }
            None => {
                page.push_str("{{");
                rest = &rest[2..];
            }
        }
    }
    page.push_str(rest);
    Ok(page)
}

/// Values and standard errors of a picture, three half floats a pixel.
fn picture(index: usize, picture: &Pictures) -> String {
    let encode = |values: &mut dyn Iterator<Item = f32>| {
        let bytes: Vec<u8> = values.flat_map(|x| f16::from_f32(x.min(65_504.0)).to_le_bytes()).collect();
        STANDARD.encode(bytes)
    };
    let rgb = encode(&mut picture.rgb.iter().flatten().copied());
    let errors = encode(&mut picture.variance.iter().flatten().map(|v| v.max(0.0).sqrt()));
    format!(
        "<script type=\"application/x-half\" id=\"rgb-{index}\">{rgb}</script>\n\
         <script type=\"application/x-half\" id=\"err-{index}\">{errors}</script>\n"
    )
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_end_its_element() {
        assert_eq!(escape("a<b & \"c\">"), "a&lt;b &amp; &quot;c&quot;&gt;");
    }

    #[test]
    fn pictures_are_half_floats() {
        let p =
            Pictures { label: String::new(), rgb: vec![[1.0, 0.5, 1e9]], variance: vec![[4.0, 0.0, 0.25]] };
        let text = picture(2, &p);
        let decode = |id: &str| {
            let start = text.find(id).unwrap() + id.len() + 2;
            let end = start + text[start..].find('<').unwrap();
            let bytes = STANDARD.decode(&text[start..end]).unwrap();
            bytes.chunks(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect::<Vec<_>>()
        };
        assert_eq!(decode("rgb-2"), [1.0, 0.5, 65_504.0]);
        assert_eq!(decode("err-2"), [2.0, 0.0, 0.5]);
    }
}
