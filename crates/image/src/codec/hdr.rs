//! Radiance pictures: one exponent for three mantissas of 8 bits [Ward1991].
//!
//! Read by our own decoder: flat, old and new run-length rows; all eight orientations; EXPOSURE lines are taken back.
//! Left out: XYZE pictures are refused. Written as new run-length rows of literal runs.

use super::{Expansion, Format};
use crate::{ChannelLayout, Image, ImageError, PixelBuffer, PixelData};

const HDR: Format = Format::Hdr;

/// How the scanlines lie: the file's order of axes and their directions.
struct Resolution {
    rows: usize,
    columns: usize,
    y_first: bool,
    y_down: bool,
    x_right: bool,
}

pub(super) fn decode(bytes: &[u8]) -> Result<PixelBuffer, ImageError> {
    let mut rest = bytes;
    let exposure = header(&mut rest)?;
    let resolution = resolution(&mut rest)?;
    let (columns, rows) = (resolution.columns, resolution.rows);
    // A run of 255 (old style: the last pixel 255 times) takes 4 bytes at least.
    let most = Expansion { file_len: bytes.len() as u64, factor: 256 };
    HDR.check_size([columns as u64, rows as u64], 4, most)?;

    let (width, height) = if resolution.y_first { (columns, rows) } else { (rows, columns) };
    let mut data = vec![0.0; width * height * 3];
    let mut line = vec![[0_u8; 4]; columns];
    for row in 0..rows {
        scanline(&mut rest, &mut line)
            .ok_or_else(|| HDR.malformed(format!("scanline {row} is cut short or broken")))?;
        for (column, rgbe) in line.iter().enumerate() {
            let (x, y) = if resolution.y_first { (column, row) } else { (row, column) };
            let x = if resolution.x_right { x } else { width - 1 - x };
            let y = if resolution.y_down { y } else { height - 1 - y };
            let at = (y * width + x) * 3;
            data[at..at + 3].copy_from_slice(&light(*rgbe).map(|c| c / exposure));
        }
    }
    PixelBuffer::new(width, height, ChannelLayout::Rgb, PixelData::F32(data))
}

pub(super) fn encode(rgb: &Image) -> Result<Vec<u8>, ImageError> {
    let (width, height) = (rgb.width(), rgb.height());
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for y in 0..height {
        let line: Vec<[u8; 4]> = (0..width).map(|x| rgbe([0, 1, 2].map(|c| rgb.pixel(x, y)[c]))).collect();
        if !(8..32_768).contains(&width) {
            bytes.extend(line.iter().flatten());
            continue;
        }
        bytes.extend([2, 2, (width >> 8) as u8, width as u8]);
        for c in 0..4 {
            let plane: Vec<u8> = line.iter().map(|p| p[c]).collect();
            write_runs(&plane, &mut bytes);
        }
    }
    Ok(bytes)
}

/// Reads up to the empty line; the product of the exposures.
fn header(rest: &mut &[u8]) -> Result<f32, ImageError> {
    let mut exposure = 1.0;
    for _ in 0..1000 {
        let line = text_line(rest).ok_or_else(|| HDR.malformed("the header has no end"))?;
        if line.is_empty() {
            return Ok(exposure);
        }
        if let Some(value) = line.strip_prefix("EXPOSURE=").and_then(|v| v.trim().parse::<f32>().ok()) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(HDR.malformed(format!("exposure {value}")));
            }
            exposure *= value;
        }
        if let Some(format) = line.strip_prefix("FORMAT=")
            && format.trim() != "32-bit_rle_rgbe"
        {
            return Err(HDR.malformed(format!("format {:?} is not 32-bit_rle_rgbe", format.trim())));
        }
    }
    Err(HDR.malformed("the header has no end"))
}

/// Such as `-Y 512 +X 1024`.
fn resolution(rest: &mut &[u8]) -> Result<Resolution, ImageError> {
    let line = text_line(rest).ok_or_else(|| HDR.malformed("no size"))?;
    let bad = || HDR.malformed(format!("size {line:?} is not like -Y 512 +X 1024"));
    let words: Vec<&str> = line.split_whitespace().collect();
    let [axis_a, count_a, axis_b, count_b] = words[..] else { return Err(bad()) };
    let count = |w: &str| w.parse::<u32>().map(|n| n as usize).map_err(|_| bad());
    let (rows, columns) = (count(count_a)?, count(count_b)?);
    let y_first = matches!(axis_a, "-Y" | "+Y");
    let (y, x) = if y_first { (axis_a, axis_b) } else { (axis_b, axis_a) };
    if !matches!(y, "-Y" | "+Y") || !matches!(x, "-X" | "+X") {
        return Err(bad());
    }
    Ok(Resolution { rows, columns, y_first, y_down: y == "-Y", x_right: x == "+X" })
}

/// Up to a line feed, at most 1000 bytes.
fn text_line(rest: &mut &[u8]) -> Option<String> {
    let bytes: &[u8] = rest;
    let len = bytes.iter().take(1000).position(|b| *b == b'\n')?;
    *rest = &bytes[len + 1..];
    Some(String::from_utf8_lossy(&bytes[..len]).trim_end_matches('\r').to_owned())
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
}

/// `None` when the bytes end or a run goes over the end of the line.
fn scanline(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let new_style = (8..32_768).contains(&line.len())
        && matches!(**rest, [2, 2, high, low, ..] if usize::from(high) << 8 | usize::from(low) == line.len());
    if !new_style {
        return old_scanline(rest, line);
    }
    take::<4>(rest)?;
    for c in 0..4 {
        let mut x = 0;
        while x < line.len() {
            let [count] = take(rest)?;
            let n = usize::from(if count > 128 { count - 128 } else { count });
            let run = line.get_mut(x..x + n).filter(|r| !r.is_empty())?;
            if count > 128 {
                let [value] = take(rest)?;
                run.iter_mut().for_each(|p| p[c] = value);
            } else {
                let (values, tail) = rest.split_at_checked(n)?;
                run.iter_mut().zip(values).for_each(|(p, v)| p[c] = *v);
                *rest = tail;
            }
            x += n;
        }
    }
    Some(())
}

/// Pixels one by one; (1, 1, 1, n) repeats the one before n times, and directly after another n · 256 times.
fn old_scanline(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let (mut x, mut shift) = (0, 0);
    while x < line.len() {
        let pixel = take::<4>(rest)?;
        if let [1, 1, 1, n] = pixel {
            let n = usize::from(n).checked_shl(shift)?;
            let before = *line.get(x.checked_sub(1)?)?;
            line.get_mut(x..x.checked_add(n)?)?.fill(before);
            x += n;
            shift += 8;
            if shift > 24 {
                return None;
            }
        } else {
            line[x] = pixel;
            x += 1;
            shift = 0;
        }
    }
    Some(())
}

/// Runs of four and more equal bytes, and what is between them.
fn write_runs(plane: &[u8], bytes: &mut Vec<u8>) {
    let run_at = |x: usize| plane[x..].iter().take(127).take_while(|v| **v == plane[x]).count();
    let mut x = 0;
    while x < plane.len() {
        let run = run_at(x);
        if run >= 4 {
            bytes.extend([128 + run as u8, plane[x]]);
            x += run;
            continue;
        }
        let end =
            (x + 1..plane.len().min(x + 128)).find(|e| run_at(*e) >= 4).unwrap_or(plane.len().min(x + 128));
        bytes.push((end - x) as u8);
        bytes.extend(&plane[x..end]);
        x = end;
    }
}

/// Mantissa times 2 to the exponent: e = 128 is [½, 1) in 256ths.
fn light([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    if e == 0 {
        return [0.0; 3];
    }
    let unit = power_of_two(i32::from(e) - 136);
    [r, g, b].map(|m| f32::from(m) * unit)
}

/// Truncated mantissas of the largest channel's exponent; what is not finite or negative becomes zero or the largest.
fn rgbe(rgb: [f32; 3]) -> [u8; 4] {
    let rgb = rgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.6e38) });
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    if largest < 1e-32 {
        return [0; 4];
    }
    // The exponent e of largest = m 2^e with m in [½, 1).
    let e = (largest.to_bits() >> 23) as i32 - 126;
    let unit = power_of_two(8 - e);
    let [r, g, b] = rgb.map(|c| (c * unit) as u8);
    [r, g, b, (e + 128) as u8]
}

/// 2^n, also where it is subnormal.
fn power_of_two(n: i32) -> f32 {
    let normal = |n: i32| f32::from_bits(((n + 127) as u32) << 23);
    if n >= -126 { normal(n) } else { normal(n + 24) * normal(-24) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize) -> Image {
        let names = ["R", "G", "B"].map(str::to_owned).to_vec();
        let value = |i: usize| if i % 7 < 4 { 3.5 } else { (i as f32 * 0.731).fract() * 40.0 };
        Image::from_data(width, height, names, (0..width * height * 3).map(value).collect()).unwrap()
    }

    #[test]
    fn what_is_written_comes_back_to_eight_bits() {
        for (w, h) in [(3, 2), (8, 3), (300, 2)] {
            let a = image(w, h);
            let b = decode(&encode(&a).unwrap()).unwrap().to_image();
            for (p, q) in a.data().chunks_exact(3).zip(b.data().chunks_exact(3)) {
                let largest = p.iter().copied().fold(0.0, f32::max);
                for c in 0..3 {
                    assert!(q[c] <= p[c] && p[c] - q[c] <= largest / 128.0, "{p:?} {q:?}");
                }
            }
        }
    }

    #[test]
    fn another_reader_sees_the_same() {
        let a = encode(&image(40, 5)).unwrap();
        let ours = decode(&a).unwrap().to_image();
        let reader = codecs::ImageReader::with_format(std::io::Cursor::new(&a), codecs::ImageFormat::Hdr);
        let theirs = reader.decode().unwrap().into_rgb32f().into_raw();
        assert_eq!(ours.data(), theirs);
    }

    #[test]
    fn extremes_survive() {
        assert_eq!(light(rgbe([1.0, 0.5, 0.25])), [1.0, 0.5, 0.25]);
        assert_eq!(light(rgbe([0.0, -1.0, f32::NAN])), [0.0; 3]);
        assert!(light(rgbe([f32::INFINITY, 0.0, 0.0]))[0] > 1e38);
        assert!(light([255, 1, 0, 1])[0] > 0.0 && light([128, 0, 0, 129]) == [1.0, 0.0, 0.0]);
    }

    #[test]
    fn old_runs_and_orientations_are_understood() {
        let mut bytes = b"#?RGBE\nEXPOSURE=2\n\n+Y 1 -X 5\n".to_vec();
        bytes.extend([128, 0, 0, 129, 1, 1, 1, 3, 0, 128, 0, 129]);
        let b = decode(&bytes).unwrap();
        assert_eq!(b.rgb(0, 0), [0.0, 0.5, 0.0]);
        assert_eq!(b.rgb(4, 0), [0.5, 0.0, 0.0]);
        assert_eq!(b.rgb(1, 0), [0.5, 0.0, 0.0]);
        let mut bytes = b"#?RGBE\n\n+X 1 -Y 2\n".to_vec();
        bytes.extend([128, 0, 0, 129, 0, 128, 0, 129]);
        let b = decode(&bytes).unwrap();
        assert_eq!((b.width(), b.height(), b.rgb(0, 1)), (1, 2, [0.0, 1.0, 0.0]));
    }

    #[test]
    fn junk_is_refused_with_a_reason() {
        for (bytes, reason) in [
            (&b"#?RADIANCE\nno end"[..], "no end"),
            (b"#?RADIANCE\n\n-Y 2\n", "is not like"),
            (b"#?RADIANCE\n\n-Y 2 +X 9\n\x02\x02\x00\x09\xff\x01", "scanline 0"),
            (b"#?RADIANCE\n\n-Y 2 +X 2\n\x01\x01\x01\x05", "scanline 0"),
            (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 2 +X 2\n", "xyze"),
            (b"#?RADIANCE\n\n-Y 9999 +X 9999\n", "too short"),
        ] {
            let e = decode(bytes).unwrap_err().to_string();
            assert!(e.contains(reason), "{e}");
        }
    }
}
