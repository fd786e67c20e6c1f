//! Mitsuba's `.serialized` meshes, versions 3 and 4: many shapes in one file, each compressed by itself.
//!
//! Little endian. A shape begins with the number 0x041C and its version (both `u16`); what follows is one zlib stream:
//! flags (`u32`), from version 4 on a name that ends with a zero byte, numbers of vertices and triangles (`u64`), then
//! positions, normals, coordinates and colours as far as the flags say, each list by itself, in single or double
//! precision, and three indices a triangle (`u32`; `u64` if there are more than 2³² − 1 vertices, which are not read).
//! At the file's end stand where each shape begins (`u64` in version 4, `u32` in version 3) and how many there are (`u32`)
//! [Mitsuba2010].

use std::io::Read;
use std::path::Path;

use math::{Vec2, Vec3};

use super::ply::PlyError;
use super::shape_file::ShapeFile;
use crate::source;

const MAGIC: u16 = 0x041C;
const HAS_NORMALS: u32 = 0x0001;
const HAS_TEXCOORDS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const FACE_NORMALS: u32 = 0x0010;
const DOUBLE_PRECISION: u32 = 0x2000;

/// How many times its packed size a shape may become, besides what is always allowed.
const INFLATION: u64 = 1024;
const INFLATED_FREELY: u64 = 64 << 20;

fn damaged<T>(message: impl Into<String>) -> Result<T, PlyError> {
    Err(PlyError::new(message, "the file is truncated or damaged"))
}

/// Reads the shape of an index.
pub(crate) fn load(path: &Path, index: u32) -> Result<ShapeFile, PlyError> {
    let source = source::read(path).map_err(|e| PlyError::new(format!("cannot be read: {e}"), e.hint()))?;
    parse(&source.bytes, index, source.hash)
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// Reads the shape of an index from a file's bytes.
pub(crate) fn parse(bytes: &[u8], index: u32, hash: u64) -> Result<ShapeFile, PlyError> {
    let Some(version) = version_at(bytes, 0) else {
        return Err(PlyError::new(
            "no serialized mesh: it does not begin with 0x041C",
            "is it the right file?",
        ));
    };
    let Some(n) = bytes.len().checked_sub(4).and_then(|at| array(bytes, at)).map(u32::from_le_bytes) else {
        return damaged("has no list of shapes");
    };
    if index >= n {
        let message = format!("has {n} shapes, none of index {index}");
        return Err(PlyError::new(message, format!("expected 0 to {}", n.saturating_sub(1))));
    }
    let size = if version == 4 { 8_usize } else { 4 };
    let list = (n as usize).checked_mul(size).and_then(|length| (bytes.len() - 4).checked_sub(length));
    let Some(list) = list else { return damaged(format!("claims {n} shapes")) };
    let offset = |i: u32| {
        let at = list + i as usize * size;
        match version {
            4 => array(bytes, at).map(u64::from_le_bytes),
            _ => array(bytes, at).map(u32::from_le_bytes).map(u64::from),
        }
    };
    let begin = offset(index).and_then(|b| usize::try_from(b).ok()).filter(|b| *b < list);
    let end =
        if index + 1 < n { offset(index + 1).and_then(|e| usize::try_from(e).ok()) } else { Some(list) };
    let (Some(begin), Some(end)) = (begin, end) else { return damaged("a shape begins outside of the file") };
    let end = if (begin..=list).contains(&end) { end } else { list };
    let Some(version) = version_at(bytes, begin) else { return damaged("a shape without its beginning") };
    shape(&bytes[begin + 4..end], version, hash)
}

fn version_at(bytes: &[u8], at: usize) -> Option<u16> {
    let magic = array(bytes, at).map(u16::from_le_bytes)?;
    let version = array(bytes, at + 2).map(u16::from_le_bytes)?;
    (magic == MAGIC && matches!(version, 3 | 4)).then_some(version)
}

fn shape(packed: &[u8], version: u16, hash: u64) -> Result<ShapeFile, PlyError> {
    let limit = INFLATED_FREELY.max(packed.len() as u64 * INFLATION);
    let mut data = Vec::new();
    // What was unpacked before the damage may be all that is needed.
    let unpacked = flate2::read::ZlibDecoder::new(packed).take(limit).read_to_end(&mut data);
    let mut body = Body { bytes: &data, at: 0 };
    let read = read_body(&mut body, version);
    match (read, unpacked) {
        (Some(Ok(mesh)), _) => Ok(ShapeFile { hash, ..mesh }),
        (Some(Err(e)), _) => Err(e),
        (None, Err(e)) => damaged(format!("damaged zlib data: {e}")),
        (None, Ok(_)) => damaged("ends within a shape"),
    }
}

struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Body<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let found = array(self.bytes, self.at)?;
        self.at += N;
        Some(found)
    }

    /// `n` numbers in single or double precision; `None` if there are fewer.
    fn floats(&mut self, n: usize, is_double: bool) -> Option<Vec<f32>> {
        let size = if is_double { 8 } else { 4 };
        let block = self.bytes.get(self.at..self.at.checked_add(n.checked_mul(size)?)?)?;
        self.at += block.len();
        Some(match is_double {
            true => block.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
            false => block.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        })
    }

    fn vec3s(&mut self, n: usize, is_double: bool) -> Option<Vec<Vec3>> {
        let all = self.floats(n.checked_mul(3)?, is_double)?;
        Some(all.as_chunks::<3>().0.iter().map(|v| Vec3::from_array(*v)).collect())
    }
}

/// `None` if the data ends too early.
fn read_body(body: &mut Body<'_>, version: u16) -> Option<Result<ShapeFile, PlyError>> {
    let flags = u32::from_le_bytes(body.take()?);
    if version == 4 {
        while body.take::<1>()? != [0] {}
    }
    let [n_vertices, n_triangles] = [u64::from_le_bytes(body.take()?), u64::from_le_bytes(body.take()?)];
    let (Ok(n), Ok(n_triangles)) = (u32::try_from(n_vertices), usize::try_from(n_triangles)) else {
        return Some(damaged(format!("claims {n_vertices} vertices")));
    };
    let (n, is_double) = (n as usize, flags & DOUBLE_PRECISION != 0);
    let positions = body.vec3s(n, is_double)?;
    let normals = if flags & HAS_NORMALS != 0 { body.vec3s(n, is_double)? } else { Vec::new() };
    let uvs = if flags & HAS_TEXCOORDS != 0 {
        let all = body.floats(n.checked_mul(2)?, is_double)?;
        all.as_chunks::<2>().0.iter().map(|v| Vec2::from_array(*v)).collect()
    } else {
        Vec::new()
    };
    if flags & HAS_COLORS != 0 {
        body.vec3s(n, is_double)?;
    }
    let block = body.bytes.get(body.at..body.at.checked_add(n_triangles.checked_mul(12)?)?)?;
    let index = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let triangles: Vec<[u32; 3]> =
        block.chunks_exact(12).map(|b| [index(b), index(&b[4..]), index(&b[8..])]).collect();
    if let Some(bad) = triangles.iter().flatten().find(|i| **i as usize >= n) {
        return Some(damaged(format!("vertex index {bad} is out of range: there are {n} vertices")));
    }
    if positions.iter().any(|p| !p.is_finite()) {
        return Some(damaged("a vertex is not finite"));
    }
    if triangles.is_empty() {
        return Some(damaged("has no faces"));
    }
    let finite3 = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
    let finite2 = |v: Vec2| if v.is_finite() { v } else { Vec2::ZERO };
    Some(Ok(ShapeFile {
        attributes: Vec::new(),
        positions,
        normals: normals.into_iter().map(finite3).collect(),
        uvs: uvs.into_iter().map(finite2).collect(),
        triangles,
        hash: 0,
        remarks: Vec::new(),
        face_normals: flags & FACE_NORMALS != 0,
    }))
}
