//! Arrays of numbers in buffers: every component type, strides, normalised integers, sparse replacements. Nothing is
//! read past the end of its view, and memory is taken only for what is there.

use super::container::Container;
use super::json::Accessor;

/// Elements of at most this many components.
const MOST: usize = 16;
/// Elements of an accessor without bytes (all zero, or sparse).
const MOST_IMPLIED: usize = 1 << 26;

impl Container {
    /// All numbers of an accessor, whose elements must have `n` components.
    pub(super) fn floats(&self, index: usize, n: usize) -> Result<Vec<f32>, String> {
        let accessor = self.accessor(index, n)?;
        let scale = if accessor.normalized { normalization(accessor.component_type) } else { 1.0 };
        let least = if accessor.normalized { -1.0 } else { f32::NEG_INFINITY };
        self.numbers(index, accessor, n, |x| (x as f32 * scale).max(least))
    }

    /// The same of whole numbers.
    pub(super) fn integers(&self, index: usize, n: usize) -> Result<Vec<u32>, String> {
        let accessor = self.accessor(index, n)?;
        if accessor.component_type == 5126 {
            return Err(format!("accessor {index} has floats, where whole numbers are expected"));
        }
        self.numbers(index, accessor, n, |x| x as u32)
    }

    fn accessor(&self, index: usize, n: usize) -> Result<&Accessor, String> {
        let a = self.root.accessors.get(index).ok_or_else(|| format!("there is no accessor {index}"))?;
        if components(&a.kind) != n {
            return Err(format!("accessor {index} is of type `{}`: {n} components are expected", a.kind));
        }
        Ok(a)
    }

    fn numbers<T: Copy>(
        &self,
        index: usize,
        a: &Accessor,
        n: usize,
        make: impl Fn(f64) -> T,
    ) -> Result<Vec<T>, String> {
        let size = component_size(a.component_type)
            .ok_or_else(|| format!("accessor {index}: component type {} is unknown", a.component_type))?;
        let mut out = match a.buffer_view {
            Some(view) => {
                let bytes = self.view(view).map_err(|e| format!("accessor {index}: {e}"))?;
                let stride = self.root.buffer_views[view].byte_stride.unwrap_or(size * n).max(size * n);
                let elements = elements(bytes, a.byte_offset, stride, a.count, size * n)
                    .ok_or_else(|| format!("accessor {index} reaches past the end of its buffer view"))?;
                let mut out = Vec::with_capacity(a.count * n);
                for element in elements {
                    out.extend(element.chunks_exact(size).map(|c| make(number(c, a.component_type))));
                }
                out
            }
            None if a.count <= MOST_IMPLIED / n => vec![make(0.0); a.count * n],
            None => return Err(format!("accessor {index} claims {} elements without bytes", a.count)),
        };
        if let Some(sparse) = &a.sparse {
            let wrong = |e: String| format!("accessor {index}, sparse: {e}");
            let (at, values) = (&sparse.indices, &sparse.values);
            let at_size = component_size(at.component_type).ok_or_else(|| wrong("unknown indices".into()))?;
            let short = || wrong("reaches past the end of its buffer view".into());
            let indices = self.view(at.buffer_view).map_err(wrong)?;
            let indices =
                elements(indices, at.byte_offset, at_size, sparse.count, at_size).ok_or_else(short)?;
            let bytes = self.view(values.buffer_view).map_err(wrong)?;
            let values =
                elements(bytes, values.byte_offset, size * n, sparse.count, size * n).ok_or_else(short)?;
            for (i, element) in indices.zip(values) {
                let i = number(i, at.component_type) as usize;
                let place = i.checked_mul(n).and_then(|i| out.get_mut(i..i + n));
                let place = place.ok_or_else(|| wrong(format!("there is no element {i}")))?;
                for (x, c) in place.iter_mut().zip(element.chunks_exact(size)) {
                    *x = make(number(c, a.component_type));
                }
            }
        }
        Ok(out)
    }
}

/// `count` pieces of `size` bytes, `stride` apart; `None` if the bytes end before.
fn elements(
    bytes: &[u8],
    offset: usize,
    stride: usize,
    count: usize,
    size: usize,
) -> Option<impl Iterator<Item = &[u8]>> {
    let end = match count.checked_sub(1) {
        None => offset,
        Some(last) => last.checked_mul(stride)?.checked_add(size)?.checked_add(offset)?,
    };
    (end <= bytes.len()).then(|| (0..count).map(move |i| &bytes[offset + i * stride..][..size]))
}

fn components(kind: &str) -> usize {
    let n = match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => MOST,
        _ => 0,
    };
    debug_assert!(n <= MOST);
    n
}

fn component_size(component_type: u32) -> Option<usize> {
    match component_type {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

/// One over the largest integer.
fn normalization(component_type: u32) -> f32 {
    match component_type {
        5120 => 1.0 / 127.0,
        5121 => 1.0 / 255.0,
        5122 => 1.0 / 32767.0,
        5123 => 1.0 / 65535.0,
        _ => 1.0,
    }
}

/// A little-endian number; zero if there are not enough bytes.
fn number(c: &[u8], component_type: u32) -> f64 {
    match (component_type, c) {
        (5120, &[a]) => f64::from(a as i8),
        (5121, &[a]) => f64::from(a),
        (5122, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (5123, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (5125, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (5126, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => 0.0,
    }
}
