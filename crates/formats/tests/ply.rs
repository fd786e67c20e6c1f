//! PLY files of every kind, made here; what is broken is refused with a message.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::wildcard_enum_match_arm,
    clippy::too_many_lines,
    reason = "tests"
)]

mod common;

use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

use common::Folder;
use insta::assert_snapshot;
use math::{Vec2, Vec3};
use scene_desc::{BilinearMesh, Geometry, MeshDesc};

const SCENE: &str = "WorldBegin\nShape \"plymesh\" \"string filename\" \"m.ply\"";

/// Loads one file; gives its two forms and the messages.
fn load(ply: impl AsRef<[u8]>) -> (Option<Arc<MeshDesc>>, Option<Arc<BilinearMesh>>, String) {
    let (scene, messages) = Folder::new().with("a.pbrt", SCENE).with("m.ply", ply).load("a.pbrt");
    let (mut mesh, mut patches) = (None, None);
    for shape in scene.map(|s| s.shapes).unwrap_or_default() {
        match shape.geometry {
            Geometry::Mesh(m) => mesh = Some(m),
            Geometry::BilinearMesh(m) => patches = Some(m),
            other => panic!("unexpected {other:?}"),
        }
    }
    (mesh, patches, messages)
}

fn good(ply: impl AsRef<[u8]>) -> (Option<Arc<MeshDesc>>, Option<Arc<BilinearMesh>>) {
    let (mesh, patches, messages) = load(ply);
    assert_eq!(messages, "");
    (mesh, patches)
}

/// A number as a type's bytes.
fn bytes(ty: &str, x: f64, big: bool) -> Vec<u8> {
    let mut b = match ty {
        "char" | "int8" => (x as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => (x as u8).to_le_bytes().to_vec(),
        "short" | "int16" => (x as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (x as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (x as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (x as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (x as f32).to_le_bytes().to_vec(),
        _ => x.to_le_bytes().to_vec(),
    };
    if big {
        b.reverse();
    }
    b
}

/// Five vertices; a triangle, a quadrilateral, a pentagon; with an element and properties that nobody asks for.
struct Sample {
    encoding: &'static str,
    number: &'static str,
    count: &'static str,
    index: &'static str,
    uv: [&'static str; 2],
    extras: bool,
}

impl Sample {
    fn file(&self) -> Vec<u8> {
        let Self { encoding, number, count, index, uv, extras } = *self;
        let mut head = format!("ply\nformat {encoding} 1.0\ncomment made here\nobj_info none\n");
        let mut body: Vec<Vec<(&str, f64)>> = Vec::new();
        if extras {
            head += "element odd 2\nproperty list uchar float values\nproperty double d\n";
            body.push(vec![("uchar", 2.0), ("float", 1.0), ("float", 2.0), ("double", 3.0)]);
            body.push(vec![("uchar", 0.0), ("double", 3.0)]);
        }
        head += "element vertex 5\n";
        let names = if extras { ["y", "x", "z"] } else { ["x", "y", "z"] };
        for name in names {
            writeln!(head, "property {number} {name}").unwrap();
        }
        if extras {
            head += "property uchar red\nproperty list uchar int neighbours\n";
        }
        writeln!(head, "property {number} {}\nproperty {number} {}", uv[0], uv[1]).unwrap();
        writeln!(head, "property {number} nx\nproperty {number} ny\nproperty {number} nz").unwrap();
        for i in 0..5 {
            let p = [f64::from(i), f64::from(i * i), 2.0];
            let mut item = if extras {
                vec![
                    (number, p[1]),
                    (number, p[0]),
                    (number, p[2]),
                    ("uchar", 200.0),
                    ("uchar", 1.0),
                    ("int", 7.0),
                ]
            } else {
                p.map(|x| (number, x)).to_vec()
            };
            item.extend([f64::from(i), 1.0, 0.0, 0.0, 1.0].map(|x| (number, x)));
            body.push(item);
        }
        let faces: [&[u32]; 3] = [&[0, 1, 2], &[0, 1, 2, 3], &[0, 1, 2, 3, 4]];
        writeln!(head, "element face 3").unwrap();
        if extras {
            head += "property short flag\n";
        }
        writeln!(head, "property list {count} {index} vertex_indices").unwrap();
        for face in faces {
            let mut item = if extras { vec![("short", -1.0)] } else { Vec::new() };
            item.push((count, face.len() as f64));
            item.extend(face.iter().map(|i| (index, f64::from(*i))));
            body.push(item);
        }
        head += "end_header\n";
        let mut out = head.into_bytes();
        for item in body {
            if encoding == "ascii" {
                let words: Vec<_> = item.iter().map(|(_, x)| x.to_string()).collect();
                out.extend((words.join(" ") + "\n").into_bytes());
            } else {
                out.extend(item.iter().flat_map(|(ty, x)| bytes(ty, *x, encoding == "binary_big_endian")));
            }
        }
        out
    }
}

fn check(ply: &[u8], what: &str) {
    let (mesh, patches) = good(ply);
    let (mesh, patches) = (mesh.unwrap(), patches.unwrap());
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 1, 2], [0, 2, 3], [0, 3, 4]], "{what}");
    // Around the face in the file; (0,0), (1,0), (0,1), (1,1) in a patch.
    assert_eq!(patches.indices, [[0, 1, 3, 2]], "{what}");
    for (positions, normals, uvs) in
        [(&mesh.positions, &mesh.normals, &mesh.uvs), (&patches.positions, &patches.normals, &patches.uvs)]
    {
        assert_eq!((positions.len(), positions[3]), (5, Vec3::new(3.0, 9.0, 2.0)), "{what}");
        assert_eq!((normals.len(), normals[4]), (5, Vec3::Z), "{what}");
        assert_eq!((uvs.len(), uvs[4]), (5, Vec2::new(4.0, 1.0)), "{what}");
    }
}

#[test]
fn every_encoding_and_layout_gives_the_same_mesh() {
    let uvs = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
    let indices = ["int", "uint", "int32", "uint16", "uchar", "short", "char"];
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (i, number) in ["float", "double", "float32", "short", "uchar", "int"].into_iter().enumerate() {
            for extras in [false, true] {
                let count = ["uchar", "int", "uint8", "ushort"][i % 4];
                let sample = Sample { encoding, number, count, index: indices[i], uv: uvs[i % 4], extras };
                check(&sample.file(), &format!("{encoding} {number} {count} {extras}"));
            }
        }
    }
}

#[test]
fn a_packed_file_is_unpacked() {
    use std::io::Write;
    let sample = Sample {
        encoding: "binary_little_endian",
        number: "float",
        count: "uchar",
        index: "int",
        uv: ["u", "v"],
        extras: false,
    };
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    gz.write_all(&sample.file()).unwrap();
    check(&gz.finish().unwrap(), "gzip");
}

#[test]
fn line_ends_of_other_systems_are_read() {
    let sample = Sample {
        encoding: "ascii",
        number: "float",
        count: "uchar",
        index: "int",
        uv: ["u", "v"],
        extras: true,
    };
    let text = String::from_utf8(sample.file()).unwrap();
    check(text.replace('\n', "\r\n").as_bytes(), "crlf");
}

#[test]
fn the_same_file_is_loaded_once() {
    let sample = Sample {
        encoding: "binary_big_endian",
        number: "float",
        count: "uchar",
        index: "int",
        uv: ["u", "v"],
        extras: false,
    };
    let scene = format!("{SCENE} Shape \"plymesh\" \"string filename\" \"m.ply\"");
    let scene = Folder::new().with("a.pbrt", scene).with("m.ply", sample.file()).load("a.pbrt").0.unwrap();
    let mesh = |i: usize| match &scene.shapes[i].geometry {
        Geometry::Mesh(m) => Arc::as_ptr(m),
        _ => panic!("no mesh"),
    };
    assert_eq!(mesh(0), mesh(2));
}

const HEAD: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n";

fn ascii(body: &str) -> String {
    format!("ply\nformat ascii 1.0\n{HEAD}{body}")
}

/// A binary file of one triangle.
fn binary(positions: [f32; 9], face: &[u8]) -> Vec<u8> {
    let mut out = format!("ply\nformat binary_little_endian 1.0\n{HEAD}").into_bytes();
    out.extend(positions.iter().flat_map(|x| x.to_le_bytes()));
    out.extend(face);
    out
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
const FACE: [u8; 13] = [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0];

#[test]
fn broken_files_are_refused_with_a_reason() {
    let whole = binary(CORNERS, &FACE);
    let head = format!("ply\nformat binary_little_endian 1.0\n{HEAD}");
    let mut nan = CORNERS;
    nan[4] = f32::NAN;
    let mut far = FACE;
    far[9] = 3;
    let mut negative = FACE;
    negative[9..].copy_from_slice(&(-1_i32).to_le_bytes());
    let text = |s: &str| s.as_bytes().to_vec();
    let billion = |e: &str| text(&ascii("").replace(e, &format!("{e}000000000")));
    let cases: Vec<(&str, Vec<u8>)> = vec![
        ("empty", Vec::new()),
        ("no ply", text("solid cube\n")),
        ("header without end", text("ply\nformat ascii 1.0\nelement vertex 3\n")),
        ("no format", text("ply\nelement vertex 3\nend_header\n")),
        ("unknown type", text("ply\nformat ascii 1.0\nelement vertex 3\nproperty quad x\nend_header\n")),
        ("unknown line", text("ply\nformat ascii 1.0\nelemnt vertex 3\nend_header\n")),
        ("property first", text("ply\nformat ascii 1.0\nproperty float x\nend_header\n")),
        (
            "no x",
            text(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float a\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1 1\n3 0 0 0\n",
            ),
        ),
        (
            "no faces",
            text(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 1 1\n",
            ),
        ),
        ("no indices", text(&ascii("0 0 0 1 0 0 0 1 0 1 0").replace("vertex_indices", "stuff"))),
        ("billion vertices", billion("vertex 3")),
        (
            "billion faces",
            [text(&head.replace("face 1", "face 1000000000")), whole[head.len()..].to_vec()].concat(),
        ),
        ("count too large", text(&ascii("").replace("vertex 3", "vertex 99999999999999999999999"))),
        ("overflow", text(&ascii("").replace("vertex 3", "vertex 18446744073709551615"))),
        ("truncated in vertices", whole[..whole.len() - 20].to_vec()),
        ("truncated in faces", whole[..whole.len() - 3].to_vec()),
        ("truncated ascii", text(&ascii("0 0 0 1 0 0 0 1 0 3 0 1"))),
        ("no number", text(&ascii("0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n"))),
        ("nan", binary(nan, &FACE)),
        ("ascii inf", text(&ascii("0 0 0 1 inf 0 0 1 0 3 0 1 2"))),
        ("index out of range", binary(CORNERS, &far)),
        ("negative index", binary(CORNERS, &negative)),
        ("fractional index", text(&ascii("0 0 0 1 0 0 0 1 0 3 0 1 1.5"))),
        ("list of billions", text(&ascii("0 0 0 1 0 0 0 1 0 1000000000 0 1 1"))),
        ("degenerate alone", text(&ascii("0 0 0 1 0 0 0 1 0 2 0 1"))),
    ];
    let mut all = String::new();
    for (name, file) in cases {
        let (_, _, messages) = load(file);
        assert!(messages.contains("error"), "{name}: {messages}");
        writeln!(all, "{name}: {messages}").unwrap();
    }
    assert_snapshot!(all, @r#"
    empty: a.pbrt:2:17: error: m.ply: no PLY file: it does not begin with "ply"
      hint: is it the right file?

    no ply: a.pbrt:2:17: error: m.ply: no PLY file: it does not begin with "ply"
      hint: is it the right file?

    header without end: a.pbrt:2:17: error: m.ply: the header has no end
      hint: is the file complete?

    no format: a.pbrt:2:17: error: m.ply: header line 3: no format before it: end_header
      hint: is it damaged?

    unknown type: a.pbrt:2:17: error: m.ply: header line 4: unknown property: property quad x
      hint: is it damaged?

    unknown line: a.pbrt:2:17: error: m.ply: header line 3: not understood: elemnt vertex 3
      hint: is it damaged?

    property first: a.pbrt:2:17: error: m.ply: header line 3: no element before it: property float x
      hint: is it damaged?

    no x: a.pbrt:2:17: error: m.ply: vertices have no x, y, z
      hint: is it a mesh?

    no faces: a.pbrt:2:17: error: m.ply: has no element "face"
      hint: pbrt refuses such a file too

    no indices: a.pbrt:2:17: error: m.ply: faces have no "vertex_indices"
      hint: is it a mesh?

    billion vertices: a.pbrt:2:17: error: m.ply: claims 3000000000 of "vertex", at least 5 bytes each, but has 0 bytes left
      hint: the file is truncated or damaged

    billion faces: a.pbrt:2:17: error: m.ply: claims 1000000000 of "face", at least 1 bytes each, but has 13 bytes left
      hint: the file is truncated or damaged

    count too large: a.pbrt:2:17: error: m.ply: header line 3: no count: element vertex 99999999999999999999999
      hint: is it damaged?

    overflow: a.pbrt:2:17: error: m.ply: claims 18446744073709551615 of "vertex", at least 5 bytes each, but has 0 bytes left
      hint: the file is truncated or damaged

    truncated in vertices: a.pbrt:2:17: error: m.ply: claims 3 of "vertex", at least 12 bytes each, but has 29 bytes left
      hint: the file is truncated or damaged

    truncated in faces: a.pbrt:2:17: error: m.ply: ends within face 0
      hint: the file is truncated or damaged

    truncated ascii: a.pbrt:2:17: error: m.ply: ends within face 0
      hint: the file is truncated or damaged

    no number: a.pbrt:2:17: error: m.ply: line 11: x where vertex 1 has a number
      hint: the file is damaged

    nan: a.pbrt:2:17: error: m.ply: vertex 1 is not finite: 1 NaN 0
      hint: repair the mesh with the program that wrote it

    ascii inf: a.pbrt:2:17: error: m.ply: vertex 1 is not finite: 1 inf 0
      hint: repair the mesh with the program that wrote it

    index out of range: a.pbrt:2:17: error: m.ply: vertex index 3 is out of range
      hint: there are 3 vertices: 0 to 2

    negative index: a.pbrt:2:17: error: m.ply: a vertex index is negative or no whole number
      hint: there are 3 vertices: 0 to 2

    fractional index: a.pbrt:2:17: error: m.ply: a vertex index is negative or no whole number
      hint: there are 3 vertices: 0 to 2

    list of billions: a.pbrt:2:17: error: m.ply: line 10: face 0 has an impossible count
      hint: the file is damaged

    degenerate alone: a.pbrt:2:17: error: m.ply: has no faces
      hint: pbrt refuses such a file too
    "#);
}

#[test]
fn what_can_be_mended_is_mended_with_a_warning() {
    let file = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n\
        element face 2\nproperty list uchar int vertex_index\nend_header\n\
        0 0 0 nan nan nan 0 0\n1 0 0 0 0 1 inf 0\n0 1 0 0 0 1 0 1\n3 0 1 2\n2 0 1\n";
    let (mesh, _, messages) = load(file);
    let mesh = mesh.unwrap();
    assert_eq!((mesh.normals[0], mesh.uvs[1], mesh.indices.len()), (Vec3::ZERO, Vec2::ZERO, 1));
    assert_snapshot!(messages, @r#"
    a.pbrt:2:17: warning: m.ply: 1 faces have fewer than three corners
      hint: they are left out
    a.pbrt:2:17: warning: m.ply: 1 normals are not finite
      hint: the geometric normal is used there
    a.pbrt:2:17: warning: m.ply: 1 texture coordinates are not finite
      hint: 0 0 is used there
    "#);
}

#[test]
fn every_truncation_is_an_error_and_no_panic() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for extras in [false, true] {
            let sample =
                Sample { encoding, number: "float", count: "uchar", index: "int", uv: ["u", "v"], extras };
            let whole = sample.file();
            for n in (0..whole.len() - 2).step_by(7) {
                let (_, _, messages) = load(&whole[..n]);
                assert!(messages.contains("error"), "{encoding}, {n} bytes");
            }
        }
    }
}

#[test]
fn a_million_triangles_load_in_no_time() {
    const SIDE: u32 = 708;
    let n_faces = 2 * SIDE * SIDE;
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float u\n\
         property float v\nelement face {n_faces}\nproperty list uint8 int vertex_indices\nend_header\n",
        (SIDE + 1) * (SIDE + 1),
    )
    .into_bytes();
    for i in 0..=SIDE {
        for j in 0..=SIDE {
            let (x, y) = (i as f32 / SIDE as f32, j as f32 / SIDE as f32);
            file.extend([x, y, x * y, 0.0, 0.0, 1.0, x, y].iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    for i in 0..SIDE {
        for j in 0..SIDE {
            let a = i * (SIDE + 1) + j;
            for face in [[a, a + 1, a + SIDE + 1], [a + 1, a + SIDE + 2, a + SIDE + 1]] {
                file.push(3);
                file.extend(face.iter().flat_map(|v| v.to_le_bytes()));
            }
        }
    }
    let folder = Folder::new().with("a.pbrt", SCENE).with("m.ply", file);
    let start = Instant::now();
    let scene = folder.load("a.pbrt").0.unwrap();
    let seconds = start.elapsed().as_secs_f64();
    println!("{n_faces} triangles: {:.1} ms", seconds * 1e3);
    assert!(matches!(&scene.shapes[0].geometry, Geometry::Mesh(m) if m.indices.len() == n_faces as usize));
    assert!(seconds < 1.0, "{seconds} s");
}

#[test]
fn inline_meshes_are_read_fast() {
    const N: usize = 200_000;
    let mut text = String::from("WorldBegin Shape \"trianglemesh\" \"point3 P\" [ ");
    for i in 0..N {
        write!(text, "{} {:.6} {:e} ", i, i as f32 * 0.37, i as f32 * 1.1e-7).unwrap();
    }
    text += "] \"integer indices\" [ ";
    for i in 0..N - 2 {
        write!(text, "{} {} {} ", i, i + 1, i + 2).unwrap();
    }
    text += "]";
    let folder = Folder::new().with("a.pbrt", &text);
    let start = Instant::now();
    let scene = folder.load("a.pbrt").0.unwrap();
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.1} MB of numbers: {:.1} ms", text.len() as f64 * 1e-6, seconds * 1e3);
    let Geometry::Mesh(m) = &scene.shapes[0].geometry else { panic!("no mesh") };
    assert_eq!(m.positions[7], Vec3::new(7.0, 2.59, 7.0 * 1.1e-7));
    assert!(seconds < 1.0, "{seconds} s");
}
