//! The header of a PLY file: its encoding, its elements and their properties.

use super::ply::PlyError;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// One property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    /// The type of a list's count; `None` for a single number.
    pub(super) count: Option<Scalar>,
    pub(super) ty: Scalar,
}

impl Property {
    /// Bytes that it takes at least.
    pub(super) fn min_size(&self) -> usize {
        self.count.unwrap_or(self.ty).size()
    }
}

/// An element with its properties in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) n: usize,
    pub(super) properties: Vec<Property>,
    /// Those that are not known here, by their names' common beginning.
    pub(super) groups: Vec<Group>,
}

/// Numbers next to each other with a name in common: `color_0`, `color_1`, `color_2`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    pub(super) name: String,
    /// Index of the first property.
    pub(super) first: usize,
    /// How many.
    pub(super) n: usize,
}

impl Element {
    /// Bytes of one item; `None` if it holds a list.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.count.is_none().then(|| p.ty.size())).sum()
    }

    /// Bytes that one item takes at least.
    pub(super) fn min_size(&self) -> usize {
        self.properties.iter().map(Property::min_size).sum()
    }
}

/// A whole header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Bytes up to and with the end of its last line.
    pub(super) length: usize,
    /// Lines.
    pub(super) n_lines: usize,
}

/// Longest header that is read.
const LONGEST: usize = 1 << 20;

pub(super) fn parse(bytes: &[u8]) -> Result<Header, PlyError> {
    let mut lines = Lines { bytes: &bytes[..bytes.len().min(LONGEST)], at: 0, n: 0 };
    if lines.next() != Some("ply") {
        return Err(PlyError::new("no PLY file: it does not begin with \"ply\"", "is it the right file?"));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    while let Some(line) = lines.next() {
        let words: Vec<_> = line.split_ascii_whitespace().collect();
        let wrong = |what: &str| {
            Err(PlyError::new(
                format!("header line {}: {what}: {}", lines.n, shorten(line)),
                "is it damaged?",
            ))
        };
        match words.as_slice() {
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::Little),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::Big),
            ["element", name, n] => {
                let Ok(n) = n.parse() else { return wrong("no count") };
                elements.push(Element {
                    name: (*name).to_owned(),
                    n,
                    properties: Vec::new(),
                    groups: Vec::new(),
                });
            }
            ["property", rest @ ..] => {
                let Some(property) = property(rest) else { return wrong("unknown property") };
                let Some(element) = elements.last_mut() else { return wrong("no element before it") };
                element.properties.push(property);
            }
            ["end_header"] => {
                let Some(encoding) = encoding else { return wrong("no format before it") };
                elements.iter_mut().for_each(|e| e.groups = groups(e));
                return Ok(Header { encoding, elements, length: lines.at, n_lines: lines.n });
            }
            [] | ["comment" | "obj_info", ..] => {}
            _ => return wrong("not understood"),
        }
    }
    Err(PlyError::new("the header has no end", "is the file complete?"))
}

/// What Mitsuba makes of properties that it does not know: `vertex_` or `face_`, and what stands before the last `_`; `r`,
/// `g`, `b` are a colour. Of one to three numbers.
fn groups(element: &Element) -> Vec<Group> {
    const KNOWN: [&str; 14] = [
        "x",
        "y",
        "z",
        "nx",
        "ny",
        "nz",
        "u",
        "v",
        "s",
        "t",
        "texture_u",
        "texture_v",
        "texture_s",
        "texture_t",
    ];
    if !matches!(element.name.as_str(), "vertex" | "face") {
        return Vec::new();
    }
    let mut groups: Vec<Group> = Vec::new();
    for (i, p) in element.properties.iter().enumerate() {
        if p.count.is_some() || KNOWN.contains(&p.name.as_str()) {
            continue;
        }
        let word = match p.name.as_str() {
            "r" | "g" | "b" | "red" | "green" | "blue" => "color",
            name => name.rsplit_once('_').map_or(name, |(before, _)| before),
        };
        let name = format!("{}_{word}", element.name);
        match groups.last_mut() {
            Some(g) if g.name == name && g.first + g.n == i => g.n += 1,
            Some(_) | None => groups.push(Group { name, first: i, n: 1 }),
        }
    }
    groups.retain(|g| g.n <= 3);
    groups
}

fn property(words: &[&str]) -> Option<Property> {
    let (count, ty, name) = match words {
        ["list", count, ty, name] => (Some(Scalar::parse(count)?), ty, name),
        [ty, name] => (None, ty, name),
        _ => return None,
    };
    Some(Property { name: (*name).to_owned(), count, ty: Scalar::parse(ty)? })
}

/// Lines of text before binary data: ended by `\n`, `\r\n` or `\r`.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    n: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a str> {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|b| matches!(b, b'\n' | b'\r'))?;
        let both = rest[length] == b'\r' && rest.get(length + 1) == Some(&b'\n');
        self.at += length + 1 + usize::from(both);
        self.n += 1;
        // What is no text is no header line.
        Some(std::str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}").trim_end())
    }
}

fn shorten(line: &str) -> String {
    line.chars().filter(|c| !c.is_control()).take(60).collect()
}
