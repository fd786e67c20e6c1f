//! Decoded pixels, exactly as a decoder gave them, deflated: what travels with a packed scene. Decoders of one version may differ
//! between machines (a lossy one may use another instruction set); these bytes are the same everywhere.
//!
//! `STPIXEL1`, one byte for the type of a sample (0: 8 bits, 1: 16 bits, 2: half, 3: float), one for the number of channels,
//! width and height in four bytes each, then the samples, deflated. All numbers are little-endian.

use std::io::{Read, Write};

use flate2::Compression;

use super::{Expansion, Format};
use crate::{ChannelLayout, ImageError, PixelBuffer, PixelData, f16};

const RAW: Format = Format::Raw;
const MARK: &[u8; 8] = b"STPIXEL1";
const HEAD: usize = MARK.len() + 10;

pub(super) fn is_raw(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK)
}

/// Pixels as bytes from which [`decode`](super::decode) makes the same pixels on every machine.
///
/// # Errors
/// When there are too many of them.
pub fn encode_pixels(pixels: &PixelBuffer) -> Result<Vec<u8>, ImageError> {
    let (kind, samples) = match pixels.data() {
        PixelData::U8(v) => (0, v.clone()),
        PixelData::U16(v) => (1, v.iter().flat_map(|x| x.to_le_bytes()).collect()),
        PixelData::F16(v) => (2, v.iter().flat_map(|x| x.to_le_bytes()).collect()),
        PixelData::F32(v) => (3, v.iter().flat_map(|x| x.to_le_bytes()).collect()),
    };
    let failed = |reason: String| ImageError::Encode { format: RAW.name(), reason };
    let mut bytes = MARK.to_vec();
    bytes.extend([kind, pixels.layout().count() as u8]);
    for side in [pixels.width(), pixels.height()] {
        bytes.extend(u32::try_from(side).map_err(|e| failed(e.to_string()))?.to_le_bytes());
    }
    let mut deflate = flate2::write::DeflateEncoder::new(bytes, Compression::fast());
    deflate.write_all(&samples).and_then(|()| deflate.finish()).map_err(|e| failed(e.to_string()))
}

pub(super) fn decode(bytes: &[u8]) -> Result<PixelBuffer, ImageError> {
    let head = bytes.get(MARK.len()..HEAD).ok_or_else(|| RAW.malformed("it ends in its head"))?;
    let side = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    let (width, height) = (side(2), side(6));
    let layout = match head[1] {
        1 => ChannelLayout::L,
        2 => ChannelLayout::La,
        3 => ChannelLayout::Rgb,
        4 => ChannelLayout::Rgba,
        n => return Err(RAW.malformed(format!("{n} channels"))),
    };
    let sample_bytes: usize = match head[0] {
        0 => 1,
        1 | 2 => 2,
        3 => 4,
        kind => return Err(RAW.malformed(format!("samples of the unknown type {kind}"))),
    };

    // Deflate does 1032.
    let most = Expansion { file_len: bytes.len() as u64, factor: 1032 };
    RAW.check_size([width.into(), height.into()], (sample_bytes * layout.count()) as u64, most)?;
    let expected = width as usize * height as usize * layout.count() * sample_bytes;
    let mut samples = Vec::new();
    let mut inflate = flate2::read::DeflateDecoder::new(&bytes[HEAD..]).take(expected as u64 + 1);
    inflate.read_to_end(&mut samples).map_err(|e| RAW.malformed(e))?;
    if samples.len() != expected {
        return Err(RAW.malformed(format!("{expected} bytes of pixels expected, {} there", samples.len())));
    }
    let pairs = || samples.chunks_exact(2).map(|b| [b[0], b[1]]);
    let data = match head[0] {
        0 => PixelData::U8(samples),
        1 => PixelData::U16(pairs().map(u16::from_le_bytes).collect()),
        2 => PixelData::F16(pairs().map(f16::from_le_bytes).collect()),
        _ => {
            let fours = samples.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            PixelData::F32(fours.collect())
        }
    };
    PixelBuffer::new(width as usize, height as usize, layout, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::decode as decode_any;

    fn buffers() -> Vec<PixelBuffer> {
        let new = |layout, data| PixelBuffer::new(2, 1, layout, data).unwrap();
        vec![
            new(ChannelLayout::Rgb, PixelData::U8(vec![0, 1, 2, 253, 254, 255])),
            new(ChannelLayout::La, PixelData::U16(vec![0, 1, 300, 65_535])),
            new(ChannelLayout::L, PixelData::F16(vec![f16::from_f32(0.1), f16::INFINITY])),
            new(ChannelLayout::Rgba, PixelData::F32(vec![0.1, -0.0, 1e-40, f32::MAX, 1.0, 2.0, 3.0, 4.0])),
        ]
    }

    #[test]
    fn what_goes_in_comes_out_to_the_bit() {
        for buffer in buffers() {
            let bytes = encode_pixels(&buffer).unwrap();
            assert_eq!(Format::of_content(&bytes), Some(Format::Raw));
            assert_eq!(decode_any(&bytes, None).unwrap(), buffer);
        }
    }

    #[test]
    fn what_was_cut_or_claims_too_much_is_refused() {
        for buffer in buffers() {
            let bytes = encode_pixels(&buffer).unwrap();
            assert!((0..bytes.len()).all(|n| decode_any(&bytes[..n], None).is_err()));
            for at in MARK.len()..HEAD {
                let mut other = bytes.clone();
                other[at] = 0xff;
                assert!(decode_any(&other, None).is_err(), "byte {at}");
            }
        }
    }
}
