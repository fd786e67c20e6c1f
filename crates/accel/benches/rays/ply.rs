//! Just enough of PLY for the benchmark: little-endian, float positions first, lists of 8-bit length and 32-bit index.

use math::Vec3;

/// Vertices and faces.
pub(crate) struct Mesh {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) indices: Vec<[u32; 3]>,
}

pub(crate) fn read(path: &std::path::Path) -> Mesh {
    let bytes = std::fs::read(path).expect("a readable file");
    let mark = b"end_header\n";
    let body = bytes.windows(mark.len()).position(|w| w == mark).expect("a PLY header") + mark.len();
    let header = String::from_utf8_lossy(&bytes[..body]).into_owned();
    assert!(header.contains("binary_little_endian"), "{}: binary PLY only", path.display());
    let (mut vertices, mut faces, mut stride, mut in_vertex) = (0, 0, 0, false);
    for words in header.lines().map(|l| l.split_whitespace().collect::<Vec<_>>()) {
        match words[..] {
            ["element", "vertex", n] => (vertices, in_vertex) = (n.parse().expect("a count"), true),
            ["element", "face", n] => (faces, in_vertex) = (n.parse().expect("a count"), false),
            ["property", "float" | "float32", _] if in_vertex => stride += 4,
            ["property", "uchar" | "uint8", _] if in_vertex => stride += 1,
            _ => {}
        }
    }
    let word = |at: usize| -> [u8; 4] { bytes[at..at + 4].try_into().expect("four bytes") };
    let positions = (0..vertices)
        .map(|i: usize| Vec3::from_array([0, 4, 8].map(|k| f32::from_le_bytes(word(body + i * stride + k)))))
        .collect();
    let mut at = body + vertices * stride;
    let mut indices = Vec::with_capacity(faces);
    for _ in 0..faces {
        let n = bytes[at] as usize;
        let v: Vec<u32> = (0..n).map(|k| u32::from_le_bytes(word(at + 1 + 4 * k))).collect();
        indices.extend((2..n).map(|k| [v[0], v[k - 1], v[k]]));
        at += 1 + 4 * n;
    }
    Mesh { positions, indices }
}
