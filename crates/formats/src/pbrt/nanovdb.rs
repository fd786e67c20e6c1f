//! `NanoVDB` files: grids of floats, as pbrt's `nanovdb` medium has them, made dense.
//!
//! | step                        | source                                                                       |
//! |-----------------------------|------------------------------------------------------------------------------|
//! | layout of the file          | [Museth2021]: version 32 of the format, a header, the heads of all grids, the grids |
//! | what a tree's nodes hold    | the same: a root of tiles, nodes of 32³ and 16³ children or values, leaves of 8³ values |
//!
//! A voxel's value stands at its own index; pbrt interpolates between them, and so does a grid of points. The box is that of
//! the active voxels, with one voxel of the background around it.
//! Left out: every type of value but floats, files packed with Blosc, and grids whose box is too large to be held whole.

use std::io::Read;
use std::ops::Range;
use std::sync::Arc;

use math::{DMat4, DVec3, Transform, Vec3};

/// Most voxels of a grid, once it is dense.
const MOST_VOXELS: u64 = 1 << 27;
/// Bytes that an unpacked grid may take.
const MOST_BYTES: u64 = 1 << 32;

const MAGIC: [&[u8; 8]; 2] = [b"NanoVDB0", b"NanoVDB2"];
const GRID_MAGIC: [&[u8; 8]; 2] = [b"NanoVDB0", b"NanoVDB1"];
/// Bytes of a file's header, of a grid's head in it, of a grid's own head, of a tree's.
const HEADER: usize = 16;
const META: usize = 176;
const GRID_HEAD: usize = 672;
const TREE_HEAD: usize = 64;
const FLOAT: u32 = 1;

/// A grid of floats on every voxel of a box.
#[derive(Clone, Debug)]
pub(super) struct DenseGrid {
    /// Voxels along x, y and z.
    pub(super) resolution: [u32; 3],
    /// x fastest.
    pub(super) values: Vec<f32>,
    /// Index of the first voxel.
    pub(super) first: [i32; 3],
    /// From indices; affine.
    pub(super) place: Transform,
}

impl DenseGrid {
    /// Its box in the space of indices: half a voxel beyond the outer ones.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        let low = Vec3::from(self.first.map(|x| x as f32 - 0.5));
        [low, low + Vec3::from(self.resolution.map(|n| n as f32))]
    }

    /// Another grid's values at its own voxels.
    pub(super) fn sampled(&self, other: &Self) -> Arc<[f32]> {
        let other_from_self = other.place.inverse() * self.place;
        let [nx, ny, nz] = self.resolution.map(|n| n as i32);
        let [x0, y0, z0] = self.first;
        let index = |i: i32| [i % nx + x0, i / nx % ny + y0, i / (nx * ny) + z0].map(f64::from);
        let value = |i: i32| {
            let p = other_from_self.matrix().transform_point3(DVec3::from(index(i)));
            other.at(p.to_array())
        };
        (0..nx * ny * nz).map(value).collect()
    }

    /// The value at an index; the background beyond the box.
    pub(super) fn at(&self, index: [f64; 3]) -> f32 {
        let mut sum = 0.0;
        let low = index.map(f64::floor);
        for corner in 0..8_u8 {
            let step = [0, 1, 2].map(|a| f64::from(corner >> a & 1));
            let weight: f64 = (0..3)
                .map(|a| {
                    let f = index[a] - low[a];
                    if step[a] > 0.0 { f } else { 1.0 - f }
                })
                .product();
            let at = [0, 1, 2].map(|a| (low[a] + step[a]) as i64 - i64::from(self.first[a]));
            let inside = (0..3).all(|a| (0..i64::from(self.resolution[a])).contains(&at[a]));
            if weight > 0.0 && inside {
                let [x, y, _] = self.resolution.map(i64::from);
                sum += weight as f32 * self.values[((at[2] * y + at[1]) * x + at[0]) as usize];
            }
        }
        sum
    }
}

/// Bytes by their place.
#[derive(Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn get<const N: usize>(self, at: usize) -> Result<[u8; N], String> {
        let bytes = at.checked_add(N).and_then(|end| self.0.get(at..end));
        bytes
            .and_then(|b| b.try_into().ok())
            .ok_or_else(|| "the file is damaged: it ends too early".to_owned())
    }

    fn u16(self, at: usize) -> Result<u16, String> {
        self.get(at).map(u16::from_le_bytes)
    }

    fn u32(self, at: usize) -> Result<u32, String> {
        self.get(at).map(u32::from_le_bytes)
    }

    fn u64(self, at: usize) -> Result<u64, String> {
        self.get(at).map(u64::from_le_bytes)
    }

    fn i32s(self, at: usize) -> Result<[i32; 3], String> {
        Ok([self.u32(at)? as i32, self.u32(at + 4)? as i32, self.u32(at + 8)? as i32])
    }

    fn f32(self, at: usize) -> Result<f32, String> {
        self.get(at).map(f32::from_le_bytes)
    }

    fn f64(self, at: usize) -> Result<f64, String> {
        self.get(at).map(f64::from_le_bytes)
    }

    /// The place of a child: a signed distance from its parent.
    fn child(self, parent: usize, at: usize) -> Result<usize, String> {
        let distance = self.u64(at)? as i64;
        let place = i64::try_from(parent).ok().and_then(|p| p.checked_add(distance));
        place
            .and_then(|p| usize::try_from(p).ok())
            .filter(|p| *p < self.0.len())
            .ok_or_else(|| "the file is damaged: a node lies outside of it".to_owned())
    }

    fn bit(self, mask: usize, i: usize) -> Result<bool, String> {
        let [byte] = self.get(mask + i / 8)?;
        Ok(byte >> (i % 8) & 1 == 1)
    }
}

/// The grid of a name; `None` if there is none.
pub(super) fn grid(file: &[u8], name: &str) -> Result<Option<DenseGrid>, String> {
    let bytes = Bytes(file);
    if !MAGIC.iter().any(|m| file.starts_with(*m)) {
        return Err("no NanoVDB file: it does not begin with NanoVDB0 or NanoVDB2".into());
    }
    let major = bytes.u32(8)? >> 21;
    if major != 32 {
        return Err(format!("of version {major} of NanoVDB; version 32 is known"));
    }
    let (n_grids, codec) = (bytes.u16(12)?, bytes.u16(14)?);

    // The heads of all grids, then the grids in the same order.
    let (mut at, mut heads) = (HEADER, Vec::new());
    for _ in 0..n_grids {
        let (size, packed) = (bytes.u64(at)?, bytes.u64(at + 8)?);
        let (kind, name_size) = (bytes.u32(at + 32)?, bytes.u32(at + 136)? as usize);
        let start = at + META;
        let text = start.checked_add(name_size).and_then(|end| file.get(start..end));
        let text = text.ok_or("the file is damaged: it ends too early")?;
        let text = text.split(|b| *b == 0).next().unwrap_or_default();
        heads.push((text == name.as_bytes(), kind, size, packed));
        at = start + name_size;
    }
    for (is_it, kind, size, packed) in heads {
        let end = usize::try_from(packed).ok().and_then(|n| at.checked_add(n));
        let Some((body, end)) = end.and_then(|end| Some((file.get(at..end)?, end))) else {
            return Err("the file is damaged: it ends too early".into());
        };
        at = end;
        if !is_it {
            continue;
        }
        if kind != FLOAT {
            return Err(format!("grid \"{name}\" holds values of type {kind}; only floats (1) are known"));
        }
        return match codec {
            0 => dense(Bytes(body)).map(Some),
            1 => dense(Bytes(&unpacked(body, size)?)).map(Some),
            _ => Err(format!("packed by codec {codec}; only none (0) and zip (1) are known")),
        };
    }
    Ok(None)
}

/// The bytes of a grid that is packed: their number, then zlib's.
fn unpacked(body: &[u8], size: u64) -> Result<Vec<u8>, String> {
    if size > MOST_BYTES {
        return Err(format!("claims to unpack to {size} bytes"));
    }
    let mut out = Vec::new();
    flate2::read::ZlibDecoder::new(body.get(8..).unwrap_or_default())
        .take(size)
        .read_to_end(&mut out)
        .map_err(|e| format!("damaged zip data: {e}"))?;
    Ok(out)
}

fn dense(grid: Bytes<'_>) -> Result<DenseGrid, String> {
    let magic: [u8; 8] = grid.get(0)?;
    if !GRID_MAGIC.contains(&&magic) {
        return Err("the file is damaged: no grid where one should be".into());
    }
    let tree = GRID_HEAD;
    let root = grid.child(tree, tree + 24)?;
    if root < tree + TREE_HEAD {
        return Err("the file is damaged: a node lies outside of it".into());
    }

    // The box of active voxels, one wider.
    let (low, high) = (grid.i32s(root)?, grid.i32s(root + 12)?);
    let first = low.map(|x| x.saturating_sub(1));
    let sides = [0, 1, 2].map(|a| i64::from(high[a]) - i64::from(low[a]) + 3);
    let n = sides.iter().try_fold(1_u64, |n, s| n.checked_mul(u64::try_from(*s).ok().filter(|s| *s >= 3)?));
    // A sparse file may be large once it is dense, but not out of all proportion.
    let most = MOST_VOXELS.min(64 * grid.0.len() as u64);
    let Some(n) = n.filter(|n| *n <= most) else {
        let [x, y, z] = sides;
        return Err(format!("a box of {x} x {y} x {z} voxels is empty, or too large to be held whole"));
    };
    let background = grid.f32(root + 28)?;
    let resolution = sides.map(|s| s as u32);
    let values = vec![clean(background); usize::try_from(n).unwrap_or(0)];
    let mut fill = Fill { grid, first, resolution, values, left: n };
    fill.root(root)?;
    Ok(DenseGrid { resolution, values: fill.values, first, place: place(grid)? })
}

/// From indices to the world.
fn place(grid: Bytes<'_>) -> Result<Transform, String> {
    // Of the map: 9 + 9 + 3 + 1 floats, then the matrix row by row as doubles, its inverse, and the shift.
    let map = 296 + 88;
    let mut m = [0.0; 9];
    for (i, x) in m.iter_mut().enumerate() {
        *x = grid.f64(map + 8 * i)?;
    }
    let shift = DVec3::new(grid.f64(map + 144)?, grid.f64(map + 152)?, grid.f64(map + 160)?);
    let column = |c: usize| DVec3::new(m[c], m[3 + c], m[6 + c]).extend(0.0);
    let matrix = DMat4::from_cols(column(0), column(1), column(2), shift.extend(1.0));
    Transform::from_matrix(matrix).ok_or_else(|| "its map from indices has no inverse".to_owned())
}

/// Only finite numbers that are not negative fill space.
fn clean(x: f32) -> f32 {
    if x.is_finite() { x.max(0.0) } else { 0.0 }
}

/// What nodes of a level hold: children a side, as a power of two, and voxels a side of each, as another.
struct Level {
    side: u32,
    child: u32,
}

const UPPER: Level = Level { side: 5, child: 7 };
const LOWER: Level = Level { side: 4, child: 3 };

impl Level {
    const fn children(&self) -> usize {
        1 << (3 * self.side)
    }

    /// Where a node's mask of children is, and its table.
    const fn places(&self) -> (usize, usize) {
        let mask = self.children() / 8;
        let table = (32 + 2 * mask + 16).next_multiple_of(32);
        (32 + mask, table)
    }
}

struct Fill<'a> {
    grid: Bytes<'a>,
    first: [i32; 3],
    resolution: [u32; 3],
    values: Vec<f32>,
    /// Voxels that no node has filled yet.
    left: u64,
}

impl Fill<'_> {
    fn root(&mut self, root: usize) -> Result<(), String> {
        for i in 0..self.grid.u32(root + 24)? as usize {
            let tile = root + 64 + 32 * i;
            let key = self.grid.u64(tile)?;
            // 21 bits an axis, x first, of the origin over 2¹²; sign and all.
            let part = |shift: u32| ((key >> shift & 0x1f_ffff) as u32) << 12;
            let origin = [part(42) as i32, part(21) as i32, part(0) as i32];
            if self.grid.u64(tile + 8)? == 0 {
                let value = self.grid.f32(tile + 20)?;
                self.block(origin, 1 << 12, value)?;
            } else {
                let child = self.grid.child(root, tile + 8)?;
                self.node(child, origin, &UPPER)?;
            }
        }
        Ok(())
    }

    fn node(&mut self, node: usize, origin: [i32; 3], level: &Level) -> Result<(), String> {
        let (mask, table) = level.places();
        let side = 1 << (level.side + level.child);
        if (0..3).any(|a| self.range(a, origin, side).is_empty()) {
            return Ok(());
        }
        for i in 0..level.children() {
            let part = |a: u32| (i >> (a * level.side) & ((1 << level.side) - 1)) as i32;
            let at = [2, 1, 0].map(|a: u32| part(a) << level.child);
            let origin = [0, 1, 2].map(|a| origin[a].wrapping_add(at[a]));
            let entry = node + table + 8 * i;
            if !self.grid.bit(mask + node, i)? {
                let value = self.grid.f32(entry)?;
                self.block(origin, 1 << level.child, value)?;
                continue;
            }
            let child = self.grid.child(node, entry)?;
            match level.child {
                3 => self.leaf(child, origin)?,
                _ => self.node(child, origin, &LOWER)?,
            }
        }
        Ok(())
    }

    fn leaf(&mut self, leaf: usize, origin: [i32; 3]) -> Result<(), String> {
        for i in 0..512_usize {
            let value = self.grid.f32(leaf + 96 + 4 * i)?;
            let at = [i >> 6, i >> 3 & 7, i & 7].map(|x| x as i32);
            self.block([0, 1, 2].map(|a| origin[a].wrapping_add(at[a])), 1, value)?;
        }
        Ok(())
    }

    /// What of a cube is in the box, along an axis.
    fn range(&self, axis: usize, origin: [i32; 3], side: i64) -> Range<i64> {
        let start = i64::from(origin[axis]) - i64::from(self.first[axis]);
        start.max(0)..(start + side).min(i64::from(self.resolution[axis]))
    }

    /// The same value in a cube, as far as it is in the box. Nodes of a tree do not overlap: to find that they do is an error,
    /// lest a small file keep us busy for ever.
    fn block(&mut self, origin: [i32; 3], side: i64, value: f32) -> Result<(), String> {
        let value = clean(value);
        let [row, column, plane] = [0, 1, 2].map(|a| self.range(a, origin, side));
        if row.is_empty() || column.is_empty() || plane.is_empty() {
            return Ok(());
        }
        let n = [&row, &column, &plane].map(|r| (r.end - r.start) as u64).iter().product();
        self.left = self.left.checked_sub(n).ok_or("the file is damaged: its nodes overlap")?;
        let [nx, ny, _] = self.resolution.map(i64::from);
        for z in plane {
            for y in column.clone() {
                let start = (z * ny + y) * nx;
                self.values[(start + row.start) as usize..(start + row.end) as usize].fill(value);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use scene_desc::{GridEmission, MediumKind};
    use std::io::Write;

    fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
        bytes[at..at + value.len()].copy_from_slice(value);
    }

    /// A grid of one leaf at (−8, 0, 8), whose voxel (i, j, k) has i + 10 j + 100 k; the neighbour of the leaf along x is a tile
    /// of 7. Voxels are 0.5 wide, and the first index lies at (1, 2, 3).
    fn one_leaf() -> Vec<u8> {
        let (root, upper) = (GRID_HEAD + TREE_HEAD, GRID_HEAD + TREE_HEAD + 64 + 32);
        let (_, upper_table) = UPPER.places();
        let (_, lower_table) = LOWER.places();
        let lower = upper + upper_table + 8 * UPPER.children();
        let leaf = lower + lower_table + 8 * LOWER.children();
        let mut b = vec![0; leaf + 96 + 4 * 512];
        put(&mut b, 0, b"NanoVDB1");
        for (i, x) in [(0, 0.5_f64), (4, 0.5), (8, 0.5)] {
            put(&mut b, 296 + 88 + 8 * i, &x.to_le_bytes());
        }
        for (i, x) in [1.0_f64, 2.0, 3.0].into_iter().enumerate() {
            put(&mut b, 296 + 88 + 144 + 8 * i, &x.to_le_bytes());
        }
        put(&mut b, GRID_HEAD + 24, &(TREE_HEAD as u64).to_le_bytes());
        // Root: the box, one tile, its key and child.
        for (i, x) in [-8, 0, 8, 7, 7, 15].into_iter().enumerate() {
            put(&mut b, root + 4 * i, &i32::to_le_bytes(x));
        }
        put(&mut b, root + 24, &1_u32.to_le_bytes());
        let key = |x: i32| u64::from(x as u32 >> 12);
        put(&mut b, root + 64, &(key(-8) << 42 | key(0) << 21 | key(8)).to_le_bytes());
        put(&mut b, root + 72, &((upper - root) as u64).to_le_bytes());
        // The upper node starts at (−4096, 0, 0), the lower one at (−128, 0, 0).
        let i = 31 << 10;
        let (mask, table) = UPPER.places();
        b[upper + mask + i / 8] |= 1 << (i % 8);
        put(&mut b, upper + table + 8 * i, &((lower - upper) as u64).to_le_bytes());
        let i = 15 << 8 | 1;
        let (mask, table) = LOWER.places();
        b[lower + mask + i / 8] |= 1 << (i % 8);
        put(&mut b, lower + table + 8 * i, &((leaf - lower) as u64).to_le_bytes());
        for i in 0..512_usize {
            let value = (i >> 6) + 10 * (i >> 3 & 7) + 100 * (i & 7);
            put(&mut b, leaf + 96 + 4 * i, &(value as f32).to_le_bytes());
        }
        b
    }

    /// A file of grids by name, of floats unless `kind` says otherwise.
    pub(crate) fn file(grids: &[(&str, &[u8])], kind: u32, codec: u16) -> Vec<u8> {
        let mut out = b"NanoVDB2".to_vec();
        out.extend((32_u32 << 21 | 6 << 10).to_le_bytes());
        out.extend((grids.len() as u16).to_le_bytes());
        out.extend(codec.to_le_bytes());
        let mut bodies = Vec::new();
        for (name, grid) in grids {
            let mut body = grid.to_vec();
            if codec == 1 {
                let mut zip = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                zip.write_all(grid).unwrap();
                let zip = zip.finish().unwrap();
                body = [(zip.len() as u64).to_le_bytes().to_vec(), zip].concat();
            }
            let mut meta = [0; META];
            put(&mut meta, 0, &(grid.len() as u64).to_le_bytes());
            put(&mut meta, 8, &(body.len() as u64).to_le_bytes());
            put(&mut meta, 32, &kind.to_le_bytes());
            put(&mut meta, 136, &(name.len() as u32 + 1).to_le_bytes());
            out.extend(meta);
            out.extend(name.as_bytes());
            out.push(0);
            bodies.push(body);
        }
        out.extend(bodies.concat());
        out
    }

    pub(crate) fn one_leaf_file() -> Vec<u8> {
        file(&[("density", &one_leaf())], FLOAT, 0)
    }

    #[test]
    fn sizes_of_nodes_are_those_of_the_format() {
        let size = |l: &Level| l.places().1 + 8 * l.children();
        assert_eq!((size(&UPPER), size(&LOWER), 96 + 4 * 512), (270_400, 33_856, 2144));
    }

    #[test]
    fn a_leaf_is_where_its_parents_say() {
        for codec in [0, 1] {
            let bytes = file(&[("other", &[1, 2, 3]), ("density", &one_leaf())], FLOAT, codec);
            let grid = grid(&bytes, "density").unwrap().unwrap();
            assert_eq!((grid.first, grid.resolution), ([-9, -1, 7], [18, 10, 10]));
            for (index, expected) in [
                ([-8.0, 0.0, 8.0], 0.0),
                ([-5.0, 2.0, 12.0], 423.0),
                ([-1.0, 7.0, 15.0], 777.0),
                ([-4.5, 0.0, 8.0], 3.5),
                ([-9.0, 0.0, 12.0], 0.0),
                ([3.0, 3.0, 12.0], 0.0),
            ] {
                assert_eq!(grid.at(index), expected, "{index:?}");
            }
            let p = grid.place.point(math::Point::new(-8.0, 0.0, 8.0));
            assert_eq!(p, math::Point::new(-3.0, 2.0, 7.0));
        }
        assert!(grid(&one_leaf_file(), "temperature").unwrap().is_none());
    }

    #[test]
    fn a_medium_has_the_grids_numbers_in_their_place() {
        let folder = tempfile::TempDir::new().unwrap();
        let scene = folder.path().join("a.pbrt");
        let body = one_leaf();
        std::fs::write(
            folder.path().join("a.nvdb"),
            file(&[("density", &body), ("temperature", &body)], FLOAT, 1),
        )
        .unwrap();
        let text = "WorldBegin\nTranslate 10 0 0\nMakeNamedMedium \"m\" \"string type\" \"nanovdb\" \
                    \"string filename\" \"a.nvdb\" \"float Lescale\" 2 \"float g\" 0.5\n";
        std::fs::write(&scene, text).unwrap();
        let mut sink = scene_desc::Sink::default();
        let desc = crate::load(&scene, &mut sink).unwrap_or_else(|| panic!("{}", sink.render()));
        let MediumKind::Grid { layout, density, emission, .. } = &desc.media[0].kind else {
            panic!("{:?}", desc.media[0].kind)
        };
        // The voxel (−8, 0, 8) + (1, 0, 0) has one, and lies half a unit along x from (−3, 2, 7), moved by ten.
        let at = |i: usize, j: usize, k: usize| density[(k * 10 + j) * 18 + i];
        assert_eq!((layout.resolution, at(2, 1, 1), at(8, 8, 8)), ([18, 10, 10], 1.0, 777.0));
        let center = layout.bounds[0] + Vec3::new(2.5, 1.5, 1.5);
        let p = desc.media[0].world_from_medium.point(math::Point(center));
        assert!((p.0 - Vec3::new(7.5, 2.0, 7.0)).length() < 1e-5, "{p:?}");
        let GridEmission::Temperature { kelvin, factor, .. } = emission else { panic!("{emission:?}") };
        assert_eq!((kelvin[2 + 18 + 180], *factor), (1.0, 2.0));
    }

    #[test]
    fn damaged_and_foreign_files_are_refused_by_name() {
        let good = one_leaf_file();
        let error = |bytes: &[u8]| grid(bytes, "density").unwrap_err();
        assert!(error(b"VOL").starts_with("no NanoVDB file"));
        let mut old = good.clone();
        put(&mut old, 8, &(28_u32 << 21).to_le_bytes());
        assert_eq!(error(&old), "of version 28 of NanoVDB; version 32 is known");
        let of_kind = |kind, codec| error(&file(&[("density", &one_leaf())], kind, codec));
        assert_eq!(of_kind(6, 0), "grid \"density\" holds values of type 6; only floats (1) are known");
        assert!(of_kind(1, 2).starts_with("packed by codec 2"));
        for n in (8..1200).chain((1200..good.len()).step_by(4099)) {
            error(&good[..n]);
        }
        // No change of a byte makes it panic or take much memory.
        let start = HEADER + META + 8 + GRID_HEAD;
        for i in (0..start + 400).chain((start + 400..good.len()).step_by(397)) {
            for flip in [0x01, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[i] ^= flip;
                drop(grid(&bad, "density"));
            }
        }
    }
}
