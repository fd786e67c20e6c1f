//! Volumes: constants and grids of `.vol` files.
//!
//! A `.vol` file begins with `VOL` and the version 3; then come the kind of its numbers (1: 32-bit floats; 2: 16-bit floats;
//! 3: bytes), numbers of points along x, y and z, channels (all `i32`) and a box of six floats; then the numbers, channels
//! innermost, then x, y and z [Mitsuba2010]. Little endian.

use std::path::Path;

use math::{Transform, Vec3};
use scene_desc::WrapMode;

use super::build::Build;
use super::tree::{Class, Node, NodeId, Value};
use crate::source;

/// Most points of a grid.
const MOST_POINTS: usize = 1 << 28;

/// A grid, in its own unit cube.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) resolution: [u32; 3],
    /// All channels of a point; a single channel is repeated.
    pub(super) values: Vec<[f32; 3]>,
    /// Had it one channel?
    pub(super) is_grey: bool,
    /// The box that the file states.
    pub(super) bounds: [Vec3; 2],
}

/// A volume in its place.
#[allow(clippy::large_enum_variant, reason = "a medium has two, for a moment")]
#[derive(Clone, Debug)]
pub(super) enum Volume {
    Constant([f32; 3]),
    Grid {
        grid: Grid,
        /// From the grid's unit cube.
        world_from_grid: Transform,
        /// How it goes on beyond its cube.
        wrap: WrapMode,
    },
}

impl Grid {
    /// The trilinear value at a place of the unit cube, the border repeated.
    pub(super) fn at(&self, p: Vec3) -> [f32; 3] {
        let n = self.resolution;
        let axis = |x: f32, n: u32| {
            let x = (x * n as f32 - 0.5).clamp(0.0, n as f32 - 1.0);
            let i = x as u32;
            (i as usize, (i + 1).min(n - 1) as usize, x - i as f32)
        };
        let [x, y, z] = [axis(p.x, n[0]), axis(p.y, n[1]), axis(p.z, n[2])];
        let mut sum = [0.0; 3];
        for (k, wz) in [(z.0, 1.0 - z.2), (z.1, z.2)] {
            for (j, wy) in [(y.0, 1.0 - y.2), (y.1, y.2)] {
                for (i, wx) in [(x.0, 1.0 - x.2), (x.1, x.2)] {
                    let value = self.values[(k * n[1] as usize + j) * n[0] as usize + i];
                    (0..3).for_each(|c| sum[c] += value[c] * wx * wy * wz);
                }
            }
        }
        sum
    }
}

/// Reads a `.vol` file; gives its hash as well.
pub(super) fn load(path: &Path) -> Result<(Grid, u64), String> {
    let source = source::read(path).map_err(|e| format!("{} cannot be read: {e}", path.display()))?;
    match parse(&source.bytes) {
        Ok(grid) => Ok((grid, source.hash)),
        Err(wrong) => Err(format!("{}: {wrong}", path.display())),
    }
}

fn parse(bytes: &[u8]) -> Result<Grid, String> {
    if !bytes.starts_with(b"VOL\x03") {
        return Err("no volume: it does not begin with VOL and 3".into());
    }
    let word = |i: usize| bytes.get(4 + 4 * i..8 + 4 * i).and_then(|b| <[u8; 4]>::try_from(b).ok());
    let int = |i: usize| word(i).map(i32::from_le_bytes).ok_or("ends within its head");
    let float = |i: usize| word(i).map(f32::from_le_bytes).ok_or("ends within its head");
    let size = match int(0)? {
        1 => 4_usize,
        2 => 2,
        3 => 1,
        other => return Err(format!("numbers of kind {other}: expected 1, 2 or 3")),
    };
    let mut resolution = [0_u32; 3];
    for (axis, n) in resolution.iter_mut().enumerate() {
        *n = u32::try_from(int(1 + axis)?).ok().filter(|n| *n > 0).ok_or("a grid without points")?;
    }
    let channels = match int(4)? {
        1 => 1_usize,
        3 => 3,
        other => return Err(format!("{other} channels: expected 1 or 3")),
    };
    let bounds = [Vec3::new(float(5)?, float(6)?, float(7)?), Vec3::new(float(8)?, float(9)?, float(10)?)];
    let n =
        resolution.iter().try_fold(1_usize, |n, r| n.checked_mul(*r as usize)).filter(|n| *n <= MOST_POINTS);
    let data = &bytes[48.min(bytes.len())..];
    let Some(n) = n.filter(|n| n * channels * size <= data.len()) else {
        return Err(format!("claims {resolution:?} points, but has {} bytes of them", data.len()));
    };
    let number = |i: usize| match size {
        4 => f32::from_le_bytes(std::array::from_fn(|k| data[4 * i + k])),
        2 => half(u16::from_le_bytes([data[2 * i], data[2 * i + 1]])),
        _ => f32::from(data[i]) / 255.0,
    };
    let clean = |x: f32| if x.is_finite() { x.max(0.0) } else { 0.0 };
    let point = |i: usize| match channels {
        1 => [clean(number(i)); 3],
        _ => [0, 1, 2].map(|c| clean(number(3 * i + c))),
    };
    Ok(Grid { resolution, values: (0..n).map(point).collect(), is_grey: channels == 1, bounds })
}

/// A 16-bit float.
fn half(bits: u16) -> f32 {
    let (sign, exponent, mantissa) = (bits >> 15, i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    let size = match exponent {
        0 => mantissa * (2.0_f32).powi(-24),
        31 => f32::INFINITY,
        _ => (1.0 + mantissa / 1024.0) * (2.0_f32).powi(exponent - 15),
    };
    if sign == 1 { -size } else { size }
}

impl<'t> Build<'t, '_, '_> {
    /// A volume, a colour or a number as a property of a medium.
    pub(super) fn volume(&mut self, node: &'t Node, name: &'static str, default: f32) -> Volume {
        let id = node.find(name).filter(|p| matches!(p.value, Value::Object(_) | Value::Ref(_)));
        let id = id.and_then(|p| self.object_of(p));
        match id {
            Some(id) if self.tree.node(id).class == Class::Volume => self.volume_of(id, default),
            _ => Volume::Constant(self.coefficient(node, name, default)),
        }
    }

    /// A colour that does not vary.
    pub(super) fn coefficient(&mut self, node: &'t Node, name: &'static str, default: f32) -> [f32; 3] {
        let Some(desc) = self.spectrum_desc(node, name) else { return [default; 3] };
        match desc {
            scene_desc::SpectrumDesc::Constant(c) => [c; 3],
            scene_desc::SpectrumDesc::Rgb { rgb, .. } => rgb,
            _ => {
                self.report
                    .warning(node.span_of(name), format!("\"{name}\" of pairs is not supported"))
                    .hint("its values at 600, 550 and 450 nm stand for red, green and blue");
                let at = |l: f32| match &desc {
                    scene_desc::SpectrumDesc::Curve(pairs) => value_at(pairs, l),
                    _ => default,
                };
                [600.0, 550.0, 450.0].map(at)
            }
        }
    }

    fn volume_of(&mut self, id: NodeId, default: f32) -> Volume {
        let node = self.tree.node(id);
        let made = match node.kind.as_str() {
            "constvolume" => Volume::Constant(self.coefficient(node, "value", default)),
            "gridvolume" => self.grid_volume(node).unwrap_or(Volume::Constant([default; 3])),
            _ => {
                self.unsupported(node, &format!("{default} everywhere stands in"));
                Volume::Constant([default; 3])
            }
        };
        self.unused(node);
        made
    }

    fn grid_volume(&mut self, node: &'t Node) -> Option<Volume> {
        let to_world = self.transform(node, "to_world");
        let use_bounds = self.boolean(node, "use_grid_bbox", false);
        let wrap = match self.word(node, "wrap_mode", &["clamp", "repeat", "mirror"]) {
            "repeat" => WrapMode::Repeat,
            "mirror" => WrapMode::Mirror,
            _ => WrapMode::Clamp,
        };
        if self.word(node, "filter_type", &["trilinear", "nearest"]) == "nearest" {
            self.report
                .warning(node.span_of("filter_type"), "grids are trilinear")
                .hint("they look smoother");
        }
        node.accept(&["raw", "accel", "send_data"]);
        let Some(name) = self.string(node, "filename") else {
            let hint = "add <string name=\"filename\" value=\"…\"/>";
            return self.refuse(node.span, format!("{} has no \"filename\"", node.title()), hint);
        };
        let (grid, hash) = match load(&node.resolve(&name)) {
            Ok(found) => found,
            Err(message) => return self.refuse(node.span_of("filename"), message, "is it the right file?"),
        };
        self.hashes.push(hash);
        let [lo, hi] = grid.bounds.map(|p| p.as_dvec3());
        let world_from_grid = match Transform::scale(hi - lo) {
            Some(scale) if use_bounds => to_world * Transform::translate(lo) * scale,
            Some(_) | None => to_world,
        };
        Some(Volume::Grid { grid, world_from_grid, wrap })
    }
}

/// Straight lines between pairs.
fn value_at(pairs: &[(f32, f32)], l: f32) -> f32 {
    let after = pairs.partition_point(|p| p.0 <= l);
    match (after.checked_sub(1).and_then(|i| pairs.get(i)), pairs.get(after)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (l - a.0) / (b.0 - a.0),
        (Some(a), None) => a.1,
        (None, Some(b)) => b.1,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(kind: i32, channels: i32, data: &[u8]) -> Vec<u8> {
        let head = [kind, 2, 1, 1, channels].map(i32::to_le_bytes).concat();
        let bounds = [0.0_f32, 0.0, 0.0, 1.0, 2.0, 3.0].map(f32::to_le_bytes).concat();
        [b"VOL\x03".to_vec(), head, bounds, data.to_vec()].concat()
    }

    #[test]
    fn a_grid_is_read_and_interpolated_between_its_points() {
        let data = [1.0_f32, 3.0].map(f32::to_le_bytes).concat();
        let grid = parse(&file(1, 1, &data)).unwrap();
        assert_eq!((grid.resolution, grid.is_grey), ([2, 1, 1], true));
        assert_eq!(grid.at(Vec3::splat(0.5))[0], 2.0);
        assert_eq!(grid.at(Vec3::ZERO)[0], 1.0);
        assert_eq!(parse(&file(3, 3, &[255, 0, 51, 0, 0, 0])).unwrap().values[0], [1.0, 0.0, 0.2]);
        assert_eq!(parse(&file(2, 1, &[0, 0x3c, 0, 0xc0])).unwrap().values, [[1.0; 3], [0.0; 3]]);
    }

    #[test]
    fn damaged_grids_are_refused() {
        let good = file(1, 1, &[0; 8]);
        assert!(parse(&good).is_ok());
        for n in 0..good.len() {
            assert!(parse(&good[..n]).is_err(), "{n}");
        }
        assert!(parse(&file(9, 1, &[0; 8])).is_err() && parse(&file(1, 2, &[0; 99])).is_err());
    }
}
