//! Wavefront OBJ: vertices, normals, texture coordinates and polygons (as fans of triangles).
//!
//! Corners that share position, normal and coordinates become one vertex. Left out, as in Mitsuba: materials, groups,
//! smoothing groups, free-form curves and surfaces; lines and points draw nothing.

use std::collections::HashMap;
use std::path::Path;

use math::{Vec2, Vec3};

use super::ply::{PlyError, Remark};
use super::shape_file::ShapeFile;
use crate::source;

/// A corner of a face: indices from 0; the largest number for what it has not.
type Corner = [u32; 3];
const NONE: u32 = u32::MAX;

/// Reads a file.
pub(crate) fn load(path: &Path) -> Result<ShapeFile, PlyError> {
    let source = source::read(path).map_err(|e| PlyError::new(format!("cannot be read: {e}"), e.hint()))?;
    parse(&source.bytes, source.hash)
}

#[derive(Default)]
struct Lists {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

/// Reads a file's bytes.
pub(crate) fn parse(bytes: &[u8], hash: u64) -> Result<ShapeFile, PlyError> {
    let mut lists = Lists::default();
    let mut vertices: Vec<Corner> = Vec::new();
    let mut known: HashMap<Corner, u32> = HashMap::new();
    let mut triangles = Vec::new();
    let (mut face, mut joined): (Vec<u32>, Vec<u8>) = (Vec::new(), Vec::new());
    let mut n_odd = 0_usize;
    for (i, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let mut line = line.trim_ascii();
        // A line may go on on the next.
        if !joined.is_empty() || line.ends_with(b"\\") {
            let more = line.ends_with(b"\\");
            joined.extend_from_slice(line.strip_suffix(b"\\").unwrap_or(line));
            joined.push(b' ');
            if more {
                continue;
            }
            line = &joined;
        }
        let text = std::str::from_utf8(line).unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        let wrong = |what: &str| PlyError::new(format!("line {}: {what}", i + 1), "the file is damaged");
        match words.next() {
            Some("v") => {
                lists.positions.push(Vec3::from_array(floats(words).ok_or_else(|| wrong("no vertex"))?))
            }
            Some("vn") => {
                lists.normals.push(Vec3::from_array(floats(words).ok_or_else(|| wrong("no normal"))?))
            }
            Some("vt") => {
                lists.uvs.push(Vec2::from_array(floats(words).ok_or_else(|| wrong("no coordinates"))?))
            }
            Some("f") => {
                face.clear();
                for word in words {
                    let corner = corner(word, &lists).ok_or_else(|| wrong("a corner that is none"))?;
                    let next = vertices.len() as u32;
                    let vertex = *known.entry(corner).or_insert(next);
                    if vertex == next {
                        vertices.push(corner);
                    }
                    face.push(vertex);
                }
                if face.len() < 3 {
                    n_odd += 1;
                } else {
                    triangles.extend(face[1..].windows(2).map(|w| [face[0], w[0], w[1]]));
                }
            }
            Some(_) | None => {}
        }
        joined.clear();
    }
    finish(&lists, &vertices, triangles, hash, n_odd)
}

fn finish(
    lists: &Lists,
    vertices: &[Corner],
    triangles: Vec<[u32; 3]>,
    hash: u64,
    n_odd: usize,
) -> Result<ShapeFile, PlyError> {
    if triangles.is_empty() {
        return Err(PlyError::new("has no faces", "is it a mesh?"));
    }
    let mut remarks = Vec::new();
    if n_odd > 0 {
        let what = format!("{n_odd} faces have fewer than three corners");
        remarks.push(Remark { what, instead: "they are left out" });
    }
    let all = |k: usize| vertices.iter().all(|c| c[k] != NONE);
    let some = |k: usize| vertices.iter().any(|c| c[k] != NONE);
    if some(2) && !all(2) {
        let what = "some corners have normals, others have none".to_owned();
        remarks.push(Remark { what, instead: "the geometric normal is used where there is none" });
    }
    let uvs = if some(1) {
        let at = |c: &Corner| lists.uvs.get(c[1] as usize).copied().unwrap_or(Vec2::ZERO);
        vertices.iter().map(at).collect()
    } else {
        Vec::new()
    };
    let normals = if some(2) {
        let at = |c: &Corner| lists.normals.get(c[2] as usize).copied().unwrap_or(Vec3::ZERO);
        vertices.iter().map(at).collect()
    } else {
        Vec::new()
    };
    let positions = vertices.iter().map(|c| lists.positions[c[0] as usize]).collect();
    Ok(ShapeFile { positions, normals, uvs, triangles, hash, remarks, ..ShapeFile::default() })
}

/// The first N numbers; more (a weight, a colour) are left.
fn floats<'a, const N: usize>(mut words: impl Iterator<Item = &'a str>) -> Option<[f32; N]> {
    let mut out = [0.0; N];
    for x in &mut out {
        *x = words.next()?.parse().ok().filter(|x: &f32| x.is_finite())?;
    }
    Some(out)
}

/// `1`, `1/2`, `1//3`, `1/2/3`; negative numbers count from the end.
fn corner(word: &str, lists: &Lists) -> Option<Corner> {
    let lengths = [lists.positions.len(), lists.uvs.len(), lists.normals.len()];
    let mut out = [NONE; 3];
    for (k, part) in word.split('/').enumerate() {
        if part.is_empty() && (1..3).contains(&k) {
            continue;
        }
        let n: i64 = part.parse().ok()?;
        let length = *lengths.get(k)? as i64;
        let index = if n < 0 { length + n } else { n - 1 };
        out[k] = u32::try_from(index).ok().filter(|_| index < length)?;
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_become_fans_and_corners_are_shared() {
        let text = "# a square\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1 0\nvn 0 0 1\n\
                    f 1/1/1 2/2/1 3/2/1 \\\n -1/1/-1\ng x\nusemtl y\n";
        let m = parse(text.as_bytes(), 0).unwrap();
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!((m.positions.len(), m.uvs.len(), m.normals.len()), (4, 4, 4));
        assert_eq!(m.positions[3], Vec3::Y);
        let m = parse(b"v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1//1 2 3\r\n", 0);
        assert_eq!(m.unwrap_err().message, "line 4: a corner that is none", "there is no normal 1");
    }

    #[test]
    fn damaged_files_say_where() {
        for (text, message) in [
            ("v 0 0\n", "line 1: no vertex"),
            ("v 0 0 nan\n", "line 1: no vertex"),
            ("v 0 0 0\nf 1 2 1\n", "line 2: a corner that is none"),
            ("v 0 0 0\nf 1 0 1\n", "line 2: a corner that is none"),
            ("v 0 0 0\nf 1/1/1/1 1 1\n", "line 2: a corner that is none"),
            ("v 0 0 0\n", "has no faces"),
            ("", "has no faces"),
        ] {
            assert_eq!(parse(text.as_bytes(), 0).unwrap_err().message, message, "{text}");
        }
    }
}
