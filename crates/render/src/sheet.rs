//! The contact sheet of `bdpt show=strategies`: Veach's pyramid [Veach1997, sec. 10.2].
//!
//! A row has the paths of one length, from (0, t) at the left to (s, 0) or (s, 1) at the right: once weighted, when it adds
//! up to what paths of that length give to the image, and beside that unweighted. All pictures of a row are exposed
//! alike, by a power of two that is written beside it, since longer paths carry less light.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use image::{Image, LETTER};
use integrators::StrategyLayer;
use math::trig;

use crate::{Error, save_picture};

/// Longest side of a picture on the sheet, in pixels.
const MOST: usize = 200;
const GAP: usize = 6;
const SCALE: usize = 2;
/// What labels are written in, and what is behind the pictures; linear.
const INK: f32 = 0.7;
const PAPER: f32 = 0.02;

/// Where the sheet of a picture is saved: `a.exr` has `a.strategies.png` beside it.
#[must_use]
pub fn sheet_path(picture: &Path) -> PathBuf {
    picture.with_extension("strategies.png")
}

/// Saves the sheet of a picture beside it, if it has layers of strategies; says where.
///
/// # Errors
/// The file cannot be written.
pub fn save_sheet(path: &Path, picture: &Image, exposure: f32) -> Result<Option<PathBuf>, Error> {
    let Some(sheet) = strategy_sheet(picture) else { return Ok(None) };
    let path = sheet_path(path);
    save_picture(&path, &sheet, exposure)?;
    Ok(Some(path))
}

/// The sheet; `None` if the picture has no layers of strategies.
#[must_use]
pub fn strategy_sheet(picture: &Image) -> Option<Image> {
    let layers: BTreeMap<StrategyLayer, usize> =
        picture.channels().iter().enumerate().filter_map(layer).collect();
    let depth = layers.keys().map(StrategyLayer::depth).max()?;
    let rows: Vec<Row> = (0..=depth).map(|d| Row::new(picture, &layers, d)).collect();
    let columns = rows.iter().map(|r| r.weighted.len()).max()?;

    let letter = LETTER.map(|n| n * SCALE);
    let thumb = thumbnail_size(picture);
    let cell = [thumb[0].max(letter[0] * 9) + GAP, letter[1] + thumb[1] + GAP];
    let (margin, top) = (letter[0] * 9, 2 * letter[1]);
    let pyramids = [margin, margin + columns * cell[0] + 4 * GAP];
    let size = [pyramids[1] + columns * cell[0] + GAP, top + rows.len() * cell[1]];
    let mut sheet = Image::new(size[0], size[1], &["R", "G", "B"]);
    sheet.data_mut().fill(PAPER);
    for (x, title) in pyramids.into_iter().zip(["weighted: they add up to the image", "unweighted"]) {
        sheet.label([x, GAP], SCALE, title, INK);
    }
    for (i, row) in rows.iter().enumerate() {
        let y = top + i * cell[1];
        let middle = y + cell[1] / 2;
        sheet.label([GAP, middle - letter[1]], SCALE, &format!("depth {}", row.depth), INK);
        sheet.label([GAP, middle], SCALE, &format!("{:+} ev", row.stops), INK);
        for (left, layers) in pyramids.into_iter().zip([&row.weighted, &row.unweighted]) {
            let left = left + (columns - layers.len()) * cell[0] / 2;
            for (k, (layer, channel)) in layers.iter().enumerate() {
                let x = left + k * cell[0];
                sheet.label([x, y], SCALE, &format!("s={} t={}", layer.s, layer.t), INK);
                draw(&mut sheet, [x, y + letter[1]], picture, *channel, row.stops);
            }
        }
    }
    Some(sheet)
}

/// The layer whose R is this channel.
fn layer((channel, name): (usize, &String)) -> Option<(StrategyLayer, usize)> {
    Some((StrategyLayer::parse(name.strip_suffix(".R")?)?, channel))
}

/// Pictures of one length of paths, each with the first of its three channels.
struct Row {
    depth: usize,
    weighted: Vec<(StrategyLayer, usize)>,
    unweighted: Vec<(StrategyLayer, usize)>,
    /// Exposure.
    stops: i32,
}

impl Row {
    fn new(picture: &Image, all: &BTreeMap<StrategyLayer, usize>, depth: usize) -> Self {
        let of = |is_weighted: bool| {
            let of_depth = all.iter().filter(|(l, _)| l.depth() == depth && l.is_weighted == is_weighted);
            of_depth.map(|(l, c)| (*l, *c)).collect::<Vec<_>>()
        };
        let weighted = of(true);
        let channels: Vec<usize> = weighted.iter().map(|(_, c)| *c).collect();
        Self { depth, weighted, unweighted: of(false), stops: stops(picture, &channels) }
    }
}

/// The exposure that makes the brightest part of what these layers add up to nearly white: nine tenths of the pixels stay
/// below one half, or more.
fn stops(picture: &Image, channels: &[usize]) -> i32 {
    let n = picture.channels().len();
    let brightness =
        |pixel: &[f32]| -> f32 { channels.iter().map(|c| pixel[*c..c + 3].iter().sum::<f32>() / 3.0).sum() };
    let mut values: Vec<f32> = picture.data().chunks_exact(n).map(brightness).filter(|v| *v > 0.0).collect();
    values.sort_unstable_by(f32::total_cmp);
    match values.get(values.len() * 9 / 10) {
        Some(v) => (-1.0 - trig::ln(*v) / std::f32::consts::LN_2).clamp(-20.0, 20.0).round() as i32,
        None => 0,
    }
}

/// A picture of the sheet's, whole pixels taken together.
fn thumbnail_size(picture: &Image) -> [usize; 2] {
    let step = step(picture);
    [picture.width().div_ceil(step), picture.height().div_ceil(step)]
}

/// How many pixels become one, each way.
fn step(picture: &Image) -> usize {
    picture.width().max(picture.height()).div_ceil(MOST)
}

fn draw(sheet: &mut Image, [x0, y0]: [usize; 2], picture: &Image, channel: usize, stops: i32) {
    let (size, step, factor) = (thumbnail_size(picture), step(picture), trig::exp2(stops as f32));
    for y in 0..size[1] {
        for x in 0..size[0] {
            let columns = x * step..((x + 1) * step).min(picture.width());
            let rows = y * step..((y + 1) * step).min(picture.height());
            let n = (columns.len() * rows.len()).max(1) as f32;
            let mut sum = [0.0; 3];
            for (px, py) in rows.flat_map(|py| columns.clone().map(move |px| (px, py))) {
                let pixel = picture.pixel(px, py);
                (0..3).for_each(|c| sum[c] += pixel[channel + c]);
            }
            sheet.pixel_mut(x0 + x, y0 + y).copy_from_slice(&sum.map(|v| v * factor / n));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_without_strategies_has_no_sheet() {
        assert!(strategy_sheet(&Image::new(4, 4, &["R", "G", "B", "variance.R"])).is_none());
    }

    #[test]
    fn a_row_is_exposed_by_what_it_adds_up_to() {
        let names: Vec<String> = ["s0t3.weighted", "s1t2.weighted", "s0t3.unweighted", "s1t2.unweighted"]
            .iter()
            .flat_map(|l| ["R", "G", "B"].map(|c| format!("{l}.{c}")))
            .collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let mut picture = Image::new(8, 8, &names);
        picture.data_mut().fill(1.0 / 16.0);
        // Two weighted layers of 1/16 make 1/8: two stops up is one half.
        assert_eq!(stops(&picture, &[0, 3]), 2);
        let sheet = strategy_sheet(&picture).unwrap();
        let brightest = sheet.data().iter().copied().fold(0.0, f32::max);
        assert_eq!(brightest, INK, "pictures of 1/4 and labels");
        assert!(sheet.data().contains(&0.25));
        assert_eq!(sheet_path(Path::new("a/b.exr")), Path::new("a/b.strategies.png"));
    }
}
