//! The numbers of a PLY file. Vertices of a fixed size are read a column at a time and faces of the usual layout in
//! one tight loop: a million triangles take some milliseconds. ASCII goes through one token at a time.

use math::{Vec2, Vec3};

use super::ply::{PlyError, Raw};
use super::ply_extras::{Column, attribute, take_groups, unit};
use super::ply_header::{Element, Encoding, Header, Property, Scalar};

/// Pairs of names for texture coordinates, in the order of preference.
const UV_NAMES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

pub(super) fn read(header: &Header, body: &[u8]) -> Result<Raw, PlyError> {
    let has = |name: &str| header.elements.iter().any(|e| e.name == name && e.n > 0);
    for name in ["vertex", "face"] {
        if !has(name) {
            let message = format!("has no element \"{name}\"");
            return Err(PlyError::new(message, "pbrt refuses such a file too"));
        }
    }
    let mut raw = Raw::default();
    match header.encoding {
        Encoding::Ascii => {
            let mut text = Text { bytes: body, at: 0, line: header.n_lines + 1 };
            for element in &header.elements {
                check_claim(element, text.left(), ascii_size(element))?;
                read_element(element, &mut text, &mut raw)?;
            }
        }
        Encoding::Little => read_binary(header, Binary::<false> { bytes: body, at: 0 }, &mut raw)?,
        Encoding::Big => read_binary(header, Binary::<true> { bytes: body, at: 0 }, &mut raw)?,
    }
    Ok(raw)
}

fn read_binary<const BIG: bool>(
    header: &Header,
    mut data: Binary<'_, BIG>,
    raw: &mut Raw,
) -> Result<(), PlyError> {
    for element in &header.elements {
        check_claim(element, data.left(), element.min_size())?;
        match (element.name.as_str(), element.stride()) {
            ("vertex", Some(stride)) => vertex_columns(element, stride, &mut data, raw)?,
            (_, Some(stride)) if element.name != "face" => data.at += stride * element.n,
            ("face", _) if usual_faces(element) => fast_faces(element, &mut data, raw)?,
            (_, _) => read_element(element, &mut data, raw)?,
        }
    }
    Ok(())
}

/// A file is at least as long as what it claims to hold.
fn check_claim(element: &Element, left: usize, min_size: usize) -> Result<(), PlyError> {
    if element.n.checked_mul(min_size).is_some_and(|bytes| bytes <= left) {
        return Ok(());
    }
    let message = format!(
        "claims {} of \"{}\", at least {min_size} bytes each, but has {left} bytes left",
        element.n, element.name
    );
    Err(PlyError::new(message, "the file is truncated or damaged"))
}

/// Characters that an item of an element takes at least: one digit and one space for each number (the last item of
/// the file may have no space after it, so one is left out).
fn ascii_size(element: &Element) -> usize {
    (2 * element.properties.len()).saturating_sub(1)
}

/// Where a vertex's parts are among its properties.
struct VertexLayout {
    position: [usize; 3],
    normal: Option<[usize; 3]>,
    uv: Option<[usize; 2]>,
}

impl VertexLayout {
    fn of(element: &Element) -> Result<Self, PlyError> {
        let find = |name: &str| element.properties.iter().position(|p| p.name == name && p.count.is_none());
        let three = |names: [&str; 3]| Some([find(names[0])?, find(names[1])?, find(names[2])?]);
        let two = |names: [&str; 2]| Some([find(names[0])?, find(names[1])?]);
        let position = three(["x", "y", "z"])
            .ok_or_else(|| PlyError::new("vertices have no x, y, z", "is it a mesh?"))?;
        let normal = three(["nx", "ny", "nz"]);
        Ok(Self { position, normal, uv: UV_NAMES.into_iter().find_map(two) })
    }
}

/// The property of a face that holds its corners.
fn corners_of(element: &Element) -> Result<usize, PlyError> {
    element
        .properties
        .iter()
        .position(|p| p.count.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index"))
        .ok_or_else(|| PlyError::new("faces have no \"vertex_indices\"", "is it a mesh?"))
}

// ── The fast ways, for binary files ─────────────────────────────────────────────────────────────────────────────

/// Vertices of a fixed size.
fn vertex_columns<const BIG: bool>(
    element: &Element,
    stride: usize,
    data: &mut Binary<'_, BIG>,
    raw: &mut Raw,
) -> Result<(), PlyError> {
    let layout = VertexLayout::of(element)?;
    let block = &data.bytes[data.at..data.at + stride * element.n];
    let offset = |i: usize| element.properties[..i].iter().map(|p| p.ty.size()).sum();
    let column = |i: usize, put: &mut dyn FnMut(usize, f32)| {
        Column { block, stride, offset: offset(i), ty: element.properties[i].ty }.read::<BIG>(put);
    };
    raw.positions = vec![Vec3::ZERO; element.n];
    for (axis, i) in layout.position.into_iter().enumerate() {
        column(i, &mut |v, x| raw.positions[v][axis] = x);
    }
    if let Some(normal) = layout.normal {
        raw.normals = vec![Vec3::ZERO; element.n];
        for (axis, i) in normal.into_iter().enumerate() {
            column(i, &mut |v, x| raw.normals[v][axis] = x);
        }
    }
    if let Some(uv) = layout.uv {
        raw.uvs = vec![Vec2::ZERO; element.n];
        for (axis, i) in uv.into_iter().enumerate() {
            column(i, &mut |v, x| raw.uvs[v][axis] = x);
        }
    }
    for group in &element.groups {
        let mut attribute = attribute(element, group);
        attribute.values = vec![0.0; group.n * element.n];
        for k in 0..group.n {
            let scale = unit(element.properties[group.first + k].ty);
            column(group.first + k, &mut |v, x| attribute.values[group.n * v + k] = x * scale);
        }
        raw.attributes.push(attribute);
    }
    data.at += stride * element.n;
    Ok(())
}

/// A byte for the count, four for each corner, nothing else.
fn usual_faces(element: &Element) -> bool {
    let [p] = element.properties.as_slice() else { return false };
    corners_of(element).is_ok()
        && matches!(p.count, Some(Scalar::U8 | Scalar::I8))
        && matches!(p.ty, Scalar::I32 | Scalar::U32)
}

fn fast_faces<const BIG: bool>(
    element: &Element,
    data: &mut Binary<'_, BIG>,
    raw: &mut Raw,
) -> Result<(), PlyError> {
    raw.triangles.reserve(element.n.min(data.left() / 13));
    let mut corners = Vec::new();
    for face in 0..element.n {
        let rest = &data.bytes[data.at..];
        // The most usual face of all: a triangle.
        if let Some([3, indices @ ..]) = rest.first_chunk::<13>() {
            raw.triangles.push(std::array::from_fn(|i| word::<BIG>(&indices[4 * i..])));
            data.at += 13;
            continue;
        }
        let n = rest.first().map(|n| usize::from(*n));
        let Some((n, indices)) = n.and_then(|n| Some((n, rest.get(1..1 + 4 * n)?))) else {
            return Err(truncated("face", face));
        };
        corners.clear();
        corners.extend(indices.chunks_exact(4).map(word::<BIG>));
        data.at += 1 + 4 * n;
        add_face(&corners, raw);
    }
    Ok(())
}

fn word<const BIG: bool>(bytes: &[u8]) -> u32 {
    let four = [bytes[0], bytes[1], bytes[2], bytes[3]];
    if BIG { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
}

// ── Any layout, number by number ────────────────────────────────────────────────────────────────────────────────

/// Numbers one after the other.
trait Numbers {
    /// The next one; `None` if there is none.
    fn number(&mut self, ty: Scalar) -> Option<f64>;
    /// Bytes that are left.
    fn left(&self) -> usize;
    /// Why there was no number.
    fn failed(&self, what: &str, item: usize) -> PlyError;
}

fn read_element(element: &Element, data: &mut impl Numbers, raw: &mut Raw) -> Result<(), PlyError> {
    match element.name.as_str() {
        "vertex" => read_vertices(element, data, raw),
        "face" => read_faces(element, data, raw),
        _ => {
            if element.properties.is_empty() {
                return Ok(());
            }
            for item in 0..element.n {
                for p in &element.properties {
                    skip(p, data).ok_or_else(|| data.failed(&element.name, item))?;
                }
            }
            Ok(())
        }
    }
}

fn read_vertices(element: &Element, data: &mut impl Numbers, raw: &mut Raw) -> Result<(), PlyError> {
    let layout = VertexLayout::of(element)?;
    let mut values = vec![0.0_f32; element.properties.len()];
    let mut attributes: Vec<_> = element.groups.iter().map(|g| attribute(element, g)).collect();
    raw.positions.reserve(element.n);
    for item in 0..element.n {
        for (value, p) in values.iter_mut().zip(&element.properties) {
            *value = if p.count.is_some() {
                skip(p, data).map(|()| 0.0)
            } else {
                data.number(p.ty).map(|x| x as f32)
            }
            .ok_or_else(|| data.failed("vertex", item))?;
        }
        let three = |i: [usize; 3]| Vec3::from_array(i.map(|i| values[i]));
        raw.positions.push(three(layout.position));
        raw.normals.extend(layout.normal.map(three));
        raw.uvs.extend(layout.uv.map(|i| Vec2::from_array(i.map(|i| values[i]))));
        take_groups(element, &values, &mut attributes);
    }
    raw.attributes.append(&mut attributes);
    Ok(())
}

fn read_faces(element: &Element, data: &mut impl Numbers, raw: &mut Raw) -> Result<(), PlyError> {
    let at = corners_of(element)?;
    let mut corners = Vec::new();
    let mut attributes: Vec<_> = element.groups.iter().map(|g| attribute(element, g)).collect();
    let mut values = vec![0.0_f32; element.properties.len()];
    for item in 0..element.n {
        corners.clear();
        for (i, p) in element.properties.iter().enumerate() {
            let done = match p.count {
                Some(_) if i == at => list(p, data, &mut corners),
                Some(_) => skip(p, data),
                None => data.number(p.ty).map(|x| values[i] = x as f32),
            };
            done.ok_or_else(|| data.failed("face", item))?;
        }
        let before = raw.triangles.len();
        add_face(&corners, raw);
        if !attributes.is_empty() {
            take_groups(element, &values, &mut attributes);
            raw.triangles_of.push((raw.triangles.len() - before) as u32);
        }
    }
    raw.attributes.append(&mut attributes);
    Ok(())
}

/// The corners of a face. An index that is none (negative, not whole) becomes the largest number, which is out of
/// range and reported as such.
fn list(p: &Property, data: &mut impl Numbers, corners: &mut Vec<u32>) -> Option<()> {
    for _ in 0..count(p, data)? {
        let x = data.number(p.ty)?;
        let is_index = x >= 0.0 && x < f64::from(u32::MAX) && x.fract() == 0.0;
        corners.push(if is_index { x as u32 } else { u32::MAX });
    }
    Some(())
}

fn skip(p: &Property, data: &mut impl Numbers) -> Option<()> {
    let n = if p.count.is_some() { count(p, data)? } else { 1 };
    for _ in 0..n {
        data.number(p.ty)?;
    }
    Some(())
}

/// How long a list is; `None` if that is nonsense.
fn count(p: &Property, data: &mut impl Numbers) -> Option<usize> {
    let n = data.number(p.count?)?;
    (n >= 0.0 && n.fract() == 0.0 && n <= data.left() as f64).then_some(n as usize)
}

fn add_face(corners: &[u32], raw: &mut Raw) {
    match *corners {
        [a, b, c] => raw.triangles.push([a, b, c]),
        [a, b, c, d] => raw.quads.push([a, b, c, d]),
        [first, ref rest @ ..] if rest.len() >= 2 => {
            raw.triangles.extend(rest.windows(2).map(|w| [first, w[0], w[1]]));
        }
        _ => raw.n_degenerate += 1,
    }
}

fn truncated(what: &str, item: usize) -> PlyError {
    PlyError::new(format!("ends within {what} {item}"), "the file is truncated or damaged")
}

/// Binary numbers.
struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    at: usize,
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    fn number(&mut self, ty: Scalar) -> Option<f64> {
        let bytes = self.bytes.get(self.at..self.at + ty.size())?;
        self.at += ty.size();
        Some(number::<BIG>(bytes, ty))
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn failed(&self, what: &str, item: usize) -> PlyError {
        truncated(what, item)
    }
}

/// The number at the start of `bytes`, which are enough.
pub(super) fn number<const BIG: bool>(bytes: &[u8], ty: Scalar) -> f64 {
    fn first<const N: usize, const BIG: bool>(bytes: &[u8]) -> [u8; N] {
        let mut out: [u8; N] = std::array::from_fn(|i| bytes[i]);
        if BIG {
            out.reverse();
        }
        out
    }
    match ty {
        Scalar::I8 => f64::from(i8::from_le_bytes(first::<1, BIG>(bytes))),
        Scalar::U8 => f64::from(bytes[0]),
        Scalar::I16 => f64::from(i16::from_le_bytes(first::<2, BIG>(bytes))),
        Scalar::U16 => f64::from(u16::from_le_bytes(first::<2, BIG>(bytes))),
        Scalar::I32 => f64::from(i32::from_le_bytes(first::<4, BIG>(bytes))),
        Scalar::U32 => f64::from(u32::from_le_bytes(first::<4, BIG>(bytes))),
        Scalar::F32 => f64::from(f32::from_le_bytes(first::<4, BIG>(bytes))),
        Scalar::F64 => f64::from_le_bytes(first::<8, BIG>(bytes)),
    }
}

/// Numbers as text.
struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl Numbers for Text<'_> {
    fn number(&mut self, _: Scalar) -> Option<f64> {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += usize::from(*b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let x = std::str::from_utf8(&rest[..length]).ok()?.parse().ok()?;
        self.at += length;
        Some(x)
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn failed(&self, what: &str, item: usize) -> PlyError {
        if self.at >= self.bytes.len() {
            return truncated(what, item);
        }
        let rest = &self.bytes[self.at..];
        let word: Vec<u8> = rest.iter().take(20).copied().take_while(|b| !b.is_ascii_whitespace()).collect();
        if word.is_empty() {
            let message = format!("line {}: {what} {item} has an impossible count", self.line);
            return PlyError::new(message, "the file is damaged");
        }
        let message = format!(
            "line {}: {} where {what} {item} has a number",
            self.line,
            String::from_utf8_lossy(&word)
        );
        PlyError::new(message, "the file is damaged")
    }
}
