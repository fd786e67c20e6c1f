//! OpenEXR, read by the `exr` crate: all channels as floats with their notes, or the main colours as a texture.
//!
//! The data window is the image; where it lies in the display window is kept. Of parts of another size than the first,
//! and of smaller resolution levels, nothing is read. Deep data are refused.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use exr::image::{AnyChannel, AnyChannels, FlatSamples, Layer};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Chromaticities, SampleType};
use exr::prelude::{ReadChannels, ReadLayers, Text, read};

use super::{Expansion, Format};
use crate::{ChannelLayout, Image, ImageError, MetaValue, PixelBuffer, PixelData, f16};

const EXR: Format = Format::Exr;

type ExrImage = exr::image::Image<exr::prelude::SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>>;

pub(super) fn decode_image(bytes: &[u8]) -> Result<Image, ImageError> {
    let file = read_file(bytes)?;
    let (first, rest) = file.layer_data.split_first().ok_or_else(|| EXR.malformed("no parts"))?;
    let alike = |l: &&Layer<_>| {
        l.size == first.size && l.attributes.layer_position == first.attributes.layer_position
    };
    let layers: Vec<_> = std::iter::once(first).chain(rest.iter().filter(alike)).collect();

    // With several parts, a part's name goes before its channels'.
    let mut names = Vec::new();
    let mut planes = Vec::new();
    for layer in &layers {
        let part = layer.attributes.layer_name.as_ref().filter(|_| layers.len() > 1);
        for channel in &layer.channel_data.list {
            names.push(part.map_or_else(|| channel.name.to_string(), |p| format!("{p}.{}", channel.name)));
            planes.push(channel);
        }
    }

    let (width, height) = (first.size.x(), first.size.y());
    let mut data = vec![0.0; width * height * planes.len()];
    for (c, plane) in planes.iter().enumerate() {
        fill(plane, width, |i, v| data[i * names.len() + c] = v, height);
    }
    let mut image = Image::from_data(width, height, names, data)?;
    let display = file.attributes.display_window;
    let position = first.attributes.layer_position;
    image.origin = [
        position.x().saturating_sub(display.position.x()),
        position.y().saturating_sub(display.position.y()),
    ];
    image.full_size = [display.size.x(), display.size.y()];
    image.metadata = notes(&file, first);
    Ok(image)
}

pub(super) fn decode_pixels(bytes: &[u8]) -> Result<PixelBuffer, ImageError> {
    let file = read_file(bytes)?;
    let candidates = file.layer_data.iter().find_map(|layer| Some((layer, main_channels(layer)?)));
    let Some((layer, (layout, channels))) = candidates else {
        let names: Vec<String> =
            file.layer_data.iter().flat_map(|l| &l.channel_data.list).map(|c| c.name.to_string()).collect();
        return Err(EXR.malformed(format!("no channels R, G, B or Y among {names:?}")));
    };
    let (width, height) = (layer.size.x(), layer.size.y());
    let n = layout.count();
    let all_half = channels.iter().all(|c| matches!(c.sample_data, FlatSamples::F16(_)));
    let data = if all_half {
        let mut data = vec![f16::ZERO; width * height * n];
        for (c, plane) in channels.iter().enumerate() {
            fill(plane, width, |i, v| data[i * n + c] = f16::from_f32(v), height);
        }
        PixelData::F16(data)
    } else {
        let mut data = vec![0.0; width * height * n];
        for (c, plane) in channels.iter().enumerate() {
            fill(plane, width, |i, v| data[i * n + c] = v, height);
        }
        PixelData::F32(data)
    };
    PixelBuffer::new(width, height, layout, data)
}

/// Reads all parts after a look at what they claim.
fn read_file(bytes: &[u8]) -> Result<ExrImage, ImageError> {
    check(bytes)?;
    // The reader is meant not to panic; if it does on some file, that file is broken and the render goes on.
    let reading = AssertUnwindSafe(|| {
        read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
    });
    catch_unwind(reading)
        .map_err(|_| EXR.malformed("its structure contradicts itself"))?
        .map_err(|e| EXR.malformed(e))
}

/// Refuses headers that claim more than the file can hold: each block of scanlines or each tile takes 16 bytes at least
/// (its place in the table, its own header).
fn check(bytes: &[u8]) -> Result<(), ImageError> {
    let reading = AssertUnwindSafe(|| MetaData::read_from_buffered(Cursor::new(bytes), false));
    let meta = catch_unwind(reading)
        .map_err(|_| EXR.malformed("its header contradicts itself"))?
        .map_err(|e| EXR.malformed(e))?;
    for header in &meta.headers {
        if header.deep {
            return Err(EXR.malformed("deep data are not supported"));
        }
        let size = [header.layer_size.x() as u64, header.layer_size.y() as u64];
        let per_pixel: u64 = header
            .channels
            .list
            .iter()
            .map(|c| if matches!(c.sample_type, SampleType::F16) { 2 } else { 4 })
            .sum();
        // PIZ and B44 have no bound on their expansion but the blocks' own overhead, checked below.
        EXR.check_size(size, per_pixel, Expansion { file_len: bytes.len() as u64, factor: 1 << 20 })?;
        if header.chunk_count as u64 > bytes.len() as u64 / 16 {
            let [width, height] = size;
            let reason = "the file is too short for that";
            return Err(ImageError::TooLarge { format: EXR.name(), width, height, reason });
        }
    }
    Ok(())
}

/// R, G, B (and A), or Y (and A): the first group of channels of one prefix that has them.
fn main_channels(
    layer: &Layer<AnyChannels<FlatSamples>>,
) -> Option<(ChannelLayout, Vec<&AnyChannel<FlatSamples>>)> {
    let list = &layer.channel_data.list;
    let find =
        |prefix: &str, name: &str| list.iter().find(|c| c.name.to_string() == format!("{prefix}{name}"));
    let prefixes = list.iter().map(|c| {
        let name = c.name.to_string();
        name.rfind('.').map_or(String::new(), |dot| name[..=dot].to_owned())
    });
    for prefix in std::iter::once(String::new()).chain(prefixes) {
        let all = |names: &[&str]| names.iter().map(|n| find(&prefix, n)).collect::<Option<Vec<_>>>();
        for (layout, names) in [
            (ChannelLayout::Rgba, &["R", "G", "B", "A"][..]),
            (ChannelLayout::Rgb, &["R", "G", "B"]),
            (ChannelLayout::La, &["Y", "A"]),
            (ChannelLayout::L, &["Y"]),
        ] {
            if let Some(channels) = all(names) {
                return Some((layout, channels));
            }
        }
    }
    // A file of one channel is grey whatever its name.
    (list.len() == 1).then(|| (ChannelLayout::L, list.iter().collect()))
}

/// Calls `put` with the index of each pixel and its value; subsampled channels are repeated.
fn fill(channel: &AnyChannel<FlatSamples>, width: usize, mut put: impl FnMut(usize, f32), height: usize) {
    let (sx, sy) = (channel.sampling.x().max(1), channel.sampling.y().max(1));
    let stride = width / sx;
    let value = |i: usize| match &channel.sample_data {
        FlatSamples::F16(v) => v.get(i).map(|h| h.to_f32()),
        FlatSamples::F32(v) => v.get(i).copied(),
        FlatSamples::U32(v) => v.get(i).map(|u| *u as f32),
    };
    for y in 0..height {
        for x in 0..width {
            if let Some(v) = value((y / sy) * stride + x / sx) {
                put(y * width + x, v);
            }
        }
    }
}

fn notes(
    file: &ExrImage,
    layer: &Layer<AnyChannels<FlatSamples>>,
) -> std::collections::BTreeMap<String, MetaValue> {
    let others = file.attributes.other.iter().chain(&layer.attributes.other);
    let mut notes: std::collections::BTreeMap<String, MetaValue> =
        others.filter_map(|(name, value)| Some((name.to_string(), note(value)?))).collect();
    let mut text = |name: &str, value: &Option<Text>| {
        if let Some(value) = value {
            notes.insert(name.to_owned(), MetaValue::Text(value.to_string()));
        }
    };
    text("owner", &layer.attributes.owner);
    text("comments", &layer.attributes.comments);
    if let Some(c) = file.attributes.chromaticities {
        notes.insert("chromaticities".to_owned(), chromaticities(&c));
    }
    notes
}

fn note(value: &AttributeValue) -> Option<MetaValue> {
    if let AttributeValue::Text(t) = value {
        return Some(MetaValue::Text(t.to_string()));
    }
    if let AttributeValue::I32(i) = value {
        return Some(MetaValue::Int(*i));
    }
    if let AttributeValue::Chromaticities(c) = value {
        return Some(chromaticities(c));
    }
    if let AttributeValue::F32(f) = value {
        return Some(MetaValue::Double(f64::from(*f)));
    }
    if let AttributeValue::F64(d) = value { Some(MetaValue::Double(*d)) } else { None }
}

fn chromaticities(c: &Chromaticities) -> MetaValue {
    MetaValue::Chromaticities([c.red, c.green, c.blue, c.white].map(|p| [p.x(), p.y()]))
}
