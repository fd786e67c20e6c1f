//! Portable float maps: `PF` (colour) or `Pf` (grey), width, height, a scale whose sign is the byte order (negative:
//! little-endian), then 32-bit floats, the **bottom** row first.

use super::{Expansion, Format};
use crate::{ChannelLayout, Image, ImageError, PixelBuffer, PixelData};

const PFM: Format = Format::Pfm;

pub(super) fn is_pfm(bytes: &[u8]) -> bool {
    matches!(bytes, [b'P', b'F' | b'f', c, ..] if c.is_ascii_whitespace())
}

pub(super) fn decode(bytes: &[u8]) -> Result<PixelBuffer, ImageError> {
    // Four words, each ended by one white space.
    let mut rest = bytes;
    let mut word = |what: &str| next_word(&mut rest).ok_or_else(|| PFM.malformed(format!("no {what}")));
    let layout = match word("mark")? {
        "PF" => ChannelLayout::Rgb,
        "Pf" => ChannelLayout::L,
        other => return Err(PFM.malformed(format!("begins with {other:?}, not with PF or Pf"))),
    };
    let width: u32 = number(word("width")?, "width")?;
    let height: u32 = number(word("height")?, "height")?;
    let scale: f32 = number(word("scale")?, "scale")?;
    if !scale.is_finite() || scale == 0.0 {
        return Err(PFM.malformed(format!("scale {scale} says nothing of the byte order")));
    }

    // The file must be long enough before anything is allocated.
    let [w, h] = [width as usize, height as usize];
    let most = Expansion { file_len: bytes.len() as u64, factor: 1 };
    PFM.check_size([width.into(), height.into()], 4 * layout.count() as u64, most)?;
    let row_len = w * layout.count() * 4;
    let needed = row_len * h;
    let pixels = rest
        .get(..needed)
        .ok_or_else(|| PFM.malformed(format!("{needed} bytes of pixels expected, {} there", rest.len())))?;

    // Rows from the bottom.
    let factor = scale.abs();
    let value = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        factor * if scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }
    };
    let data = pixels.chunks_exact(row_len).rev().flat_map(|row| row.chunks_exact(4).map(value)).collect();
    PixelBuffer::new(w, h, layout, PixelData::F32(data))
}

pub(super) fn encode(rgb: &Image) -> Result<Vec<u8>, ImageError> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", rgb.width(), rgb.height()).into_bytes();
    bytes.reserve(rgb.data().len() * 4);
    for row in rgb.data().chunks_exact((rgb.width() * 3).max(1)).rev() {
        bytes.extend(row.iter().flat_map(|v| v.to_le_bytes()));
    }
    Ok(bytes)
}

/// The bytes up to white space, which is taken too; words are short.
fn next_word<'a>(rest: &mut &'a [u8]) -> Option<&'a str> {
    let bytes: &'a [u8] = rest;
    let start = bytes.iter().take(64).position(|b| !b.is_ascii_whitespace())?;
    let len = bytes[start..].iter().take(64).position(u8::is_ascii_whitespace)?;
    *rest = &bytes[start + len + 1..];
    std::str::from_utf8(&bytes[start..start + len]).ok()
}

fn number<T: std::str::FromStr>(word: &str, what: &str) -> Result<T, ImageError> {
    word.parse().map_err(|_| PFM.malformed(format!("{what} {word:?} is not a number")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_byte_orders_and_bottom_rows_first() {
        for (scale, swap) in [("-1.0", false), ("1", true)] {
            let mut bytes = format!("Pf\n2 2\n{scale}\n").into_bytes();
            for v in [3.0_f32, 4.0, 1.0, 2.0] {
                bytes.extend(if swap { v.to_be_bytes() } else { v.to_le_bytes() });
            }
            let b = decode(&bytes).unwrap();
            assert_eq!(b.data(), &PixelData::F32(vec![1.0, 2.0, 3.0, 4.0]));
        }
    }

    #[test]
    fn the_scale_multiplies() {
        let mut bytes = b"PF 1 1 -2.5\n".to_vec();
        for v in [1.0_f32, 2.0, 4.0] {
            bytes.extend(v.to_le_bytes());
        }
        assert_eq!(decode(&bytes).unwrap().rgb(0, 0), [2.5, 5.0, 10.0]);
    }

    #[test]
    fn junk_is_refused_with_a_reason() {
        for (bytes, reason) in [
            (&b"PF\n"[..], "no width"),
            (b"PF\n2 x\n-1\n", "height \"x\" is not a number"),
            (b"PF\n2 2\n0\n", "scale 0"),
            (b"PF\n2 2\n-1\nabc", "48 bytes of pixels expected, 3 there"),
            (b"PF\n4000000000 4000000000\n-1\nabc", "2^28"),
            (b"PF\n10000 10000\n-1\nabc", "too short"),
            (b"PF\n0 3\n-1\nabc", "empty"),
        ] {
            let e = decode(bytes).unwrap_err().to_string();
            assert!(e.contains(reason), "{e}");
        }
    }

    #[test]
    fn what_is_written_comes_back() {
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let data: Vec<f32> = (0..18).map(|i| i as f32 * 0.37 - 1.0).collect();
        let image = Image::from_data(3, 2, names, data).unwrap();
        assert_eq!(decode(&encode(&image).unwrap()).unwrap().to_image().data(), image.data());
    }
}
