//! OpenEXR, written by ourselves [Openexr]: one part of scanlines, 32-bit floats, ZIP blocks of 16 lines.
//!
//! Channels and notes go in the order of their names and nothing depends on time, threads or hashes: the same image
//! gives the same bytes.

use std::io::Write;

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;

use crate::{Image, ImageError, MetaValue};

/// Scanlines of a ZIP block.
const BLOCK_LINES: usize = 16;
const ZIP_COMPRESSION: u8 = 3;
const INCREASING_Y: u8 = 0;
const FLOAT: i32 = 2;
/// The flag of names longer than 31 bytes, and the longest then.
const LONG_NAMES: u32 = 0x400;
const LONGEST_NAME: usize = 255;

pub(super) fn encode(image: &Image) -> Result<Vec<u8>, ImageError> {
    let mut order: Vec<usize> = (0..image.channels().len()).collect();
    order.sort_by_key(|c| &image.channels()[*c]);
    check(image, &order)?;

    // Magic number, version 2, header.
    let names = image.channels().iter().chain(image.metadata.keys());
    let flags = if names.map(String::len).max() > Some(31) { LONG_NAMES } else { 0 };
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01];
    bytes.extend((2 | flags).to_le_bytes());
    bytes.extend(header(image, &order));

    // Blocks, then the table of where each begins, which precedes them.
    let lines: Vec<usize> = (0..image.height()).step_by(BLOCK_LINES).collect();
    let blocks: Vec<Vec<u8>> = lines.par_iter().map(|y| block(image, &order, *y)).collect();
    let mut at = (bytes.len() + 8 * blocks.len()) as u64;
    for block in &blocks {
        bytes.extend(at.to_le_bytes());
        at += block.len() as u64;
    }
    bytes.reserve(blocks.iter().map(Vec::len).sum());
    blocks.iter().for_each(|block| bytes.extend_from_slice(block));
    Ok(bytes)
}

fn check(image: &Image, order: &[usize]) -> Result<(), ImageError> {
    let refuse = |reason: String| Err(ImageError::Encode { format: "EXR", reason });
    if image.width() == 0 || image.height() == 0 || order.is_empty() {
        return refuse("an image without pixels or channels".into());
    }
    if let Some(w) = order.windows(2).find(|w| image.channels()[w[0]] == image.channels()[w[1]]) {
        return refuse(format!("two channels named {:?}", image.channels()[w[0]]));
    }
    let names = image.channels().iter().chain(image.metadata.keys());
    if let Some(name) = names.into_iter().find(|n| n.is_empty() || n.len() > LONGEST_NAME || n.contains('\0'))
    {
        return refuse(format!("a name of 1 to 255 bytes without zeros is needed, not {name:?}"));
    }
    if let Some(name) = image.metadata.keys().find(|n| REQUIRED.contains(&n.as_str())) {
        return refuse(format!("the note {name:?} has a fixed meaning in the format"));
    }
    let far = |o: i32, n: usize| i64::from(o) + n as i64 > 1 << 30 || o < -(1 << 30);
    if far(image.origin[0], image.width()) || far(image.origin[1], image.height()) {
        return refuse(format!("an image at {:?} is too far out", image.origin));
    }
    Ok(())
}

/// Names that a note cannot have.
const REQUIRED: [&str; 8] = [
    "channels",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
];

fn header(image: &Image, order: &[usize]) -> Vec<u8> {
    let mut channels = Vec::new();
    for c in order {
        channels.extend(image.channels()[*c].as_bytes());
        channels.push(0);
        // Type; not perceptually linear, three reserved bytes; sampled at every x and y.
        channels.extend(FLOAT.to_le_bytes());
        channels.extend([0; 4]);
        channels.extend([1_i32, 1].iter().flat_map(|s| s.to_le_bytes()));
    }
    channels.push(0);
    let window = |[x, y]: [i32; 2], w: usize, h: usize| {
        [x, y, x + w as i32 - 1, y + h as i32 - 1].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()
    };
    let [full_w, full_h] = image.full_size;

    let mut bytes = Vec::new();
    attribute(&mut bytes, ["channels", "chlist"], &channels);
    for (name, value) in &image.metadata {
        note(&mut bytes, name, value);
    }
    attribute(&mut bytes, ["compression", "compression"], &[ZIP_COMPRESSION]);
    attribute(&mut bytes, ["dataWindow", "box2i"], &window(image.origin, image.width(), image.height()));
    attribute(&mut bytes, ["displayWindow", "box2i"], &window([0, 0], full_w, full_h));
    attribute(&mut bytes, ["lineOrder", "lineOrder"], &[INCREASING_Y]);
    attribute(&mut bytes, ["pixelAspectRatio", "float"], &1.0_f32.to_le_bytes());
    attribute(&mut bytes, ["screenWindowCenter", "v2f"], &[0; 8]);
    attribute(&mut bytes, ["screenWindowWidth", "float"], &1.0_f32.to_le_bytes());
    bytes.push(0);
    bytes
}

fn note(bytes: &mut Vec<u8>, name: &str, value: &MetaValue) {
    match value {
        MetaValue::Text(s) => attribute(bytes, [name, "string"], s.as_bytes()),
        MetaValue::Int(i) => attribute(bytes, [name, "int"], &i.to_le_bytes()),
        MetaValue::Double(d) => attribute(bytes, [name, "double"], &d.to_le_bytes()),
        MetaValue::Chromaticities(c) => {
            let floats: Vec<u8> = c.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
            attribute(bytes, [name, "chromaticities"], &floats);
        }
    }
}

fn attribute(bytes: &mut Vec<u8>, name_and_type: [&str; 2], value: &[u8]) {
    for word in name_and_type {
        bytes.extend(word.as_bytes());
        bytes.push(0);
    }
    bytes.extend((value.len() as i32).to_le_bytes());
    bytes.extend(value);
}

/// Up to 16 scanlines from row `y0` on: their row number, the length, the data.
fn block(image: &Image, order: &[usize], y0: usize) -> Vec<u8> {
    // Line by line, channel by channel.
    let rows = y0..(y0 + BLOCK_LINES).min(image.height());
    let n = image.channels().len();
    let mut raw = vec![0; rows.len() * image.width() * order.len() * 4];
    let mut lines = raw.chunks_exact_mut(4 * image.width());
    for y in rows {
        let line = &image.data()[y * image.width() * n..(y + 1) * image.width() * n];
        for (c, to) in order.iter().zip(&mut lines) {
            let values = line.iter().skip(*c).step_by(n);
            to.chunks_exact_mut(4).zip(values).for_each(|(to, v)| to.copy_from_slice(&v.to_le_bytes()));
        }
    }
    let packed = zip(&raw);
    let data = packed.filter(|p| p.len() < raw.len()).unwrap_or(raw);

    let mut bytes = Vec::with_capacity(data.len() + 8);
    bytes.extend((image.origin[1] + y0 as i32).to_le_bytes());
    bytes.extend((data.len() as i32).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// Even bytes before odd ones, differences to the byte before plus 128, deflate.
fn zip(raw: &[u8]) -> Option<Vec<u8>> {
    let mut sorted = vec![0; raw.len()];
    let (even, odd) = sorted.split_at_mut(raw.len().div_ceil(2));
    for (pair, (even, odd)) in raw.chunks_exact(2).zip(even.iter_mut().zip(odd)) {
        (*even, *odd) = (pair[0], pair[1]);
    }
    let mut before = sorted.first().copied().unwrap_or_default();
    for byte in sorted.iter_mut().skip(1) {
        let difference = byte.wrapping_sub(before).wrapping_add(128);
        before = std::mem::replace(byte, difference);
    }
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(4));
    encoder.write_all(&sorted).ok()?;
    encoder.finish().ok()
}
