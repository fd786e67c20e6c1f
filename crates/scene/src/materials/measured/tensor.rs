//! Tensor files: named arrays in one file, as the RGL data base has them.
//!
//! `tensor_file\0`, two bytes of version (1, 0), the number of fields; of each a name, its number of dimensions, a type, the
//! place of its data and its shape. All numbers little-endian. Left out: every type but bytes and 32-bit floats.

/// A file with its fields.
#[derive(Debug)]
pub(super) struct TensorFile<'a> {
    fields: Vec<Field<'a>>,
}

/// An array.
#[derive(Debug)]
pub(super) struct Field<'a> {
    name: String,
    kind: u8,
    shape: Vec<u64>,
    /// From where its data starts to the end of the file.
    data: &'a [u8],
}

const BYTE: u8 = 1;
const FLOAT: u8 = 10;
/// More fields or dimensions than any file of this kind has.
const MANY: u32 = 256;

/// Bytes read from the front.
struct Cursor<'a>(&'a [u8]);

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or("the file ends in its header")?;
        self.0 = rest;
        Ok(*head)
    }

    fn u16(&mut self) -> Result<u16, String> {
        self.take().map(u16::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, String> {
        self.take().map(u64::from_le_bytes)
    }
}

impl<'a> TensorFile<'a> {
    /// The fields of a file; their data is looked at when it is asked for.
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let mut cursor = Cursor(bytes);
        if cursor.take::<12>().ok() != Some(*b"tensor_file\0") {
            return Err("not a tensor file: it does not begin with \"tensor_file\"".into());
        }
        let [major, minor] = cursor.take()?;
        if major != 1 {
            return Err(format!("of version {major}.{minor}; version 1.0 is known"));
        }
        let n = u32::from_le_bytes(cursor.take()?);
        if n > MANY {
            return Err(format!("claims to have {n} fields"));
        }
        let fields = (0..n).map(|_| Self::parse_field(&mut cursor, bytes)).collect::<Result<_, _>>()?;
        Ok(Self { fields })
    }

    fn parse_field(cursor: &mut Cursor<'a>, bytes: &'a [u8]) -> Result<Field<'a>, String> {
        let length = usize::from(cursor.u16()?);
        let (name, rest) = cursor.0.split_at_checked(length).ok_or("the file ends in its header")?;
        cursor.0 = rest;
        let name = String::from_utf8_lossy(name).into_owned();
        let n_dimensions = cursor.u16()?;
        let [kind] = cursor.take()?;
        let offset = cursor.u64()?;
        if u32::from(n_dimensions) > MANY {
            return Err(format!("field \"{name}\" claims to have {n_dimensions} dimensions"));
        }
        let shape = (0..n_dimensions).map(|_| cursor.u64()).collect::<Result<_, _>>()?;
        let data = usize::try_from(offset).ok().and_then(|o| bytes.get(o..));
        let data = data.ok_or_else(|| format!("field \"{name}\" starts beyond the end of the file"))?;
        Ok(Field { name, kind, shape, data })
    }

    /// The field of a name, if there is one.
    pub(super) fn find(&self, name: &str) -> Option<&Field<'a>> {
        self.fields.iter().find(|f| f.name == name)
    }

    /// The field of a name.
    pub(super) fn field(&self, name: &str) -> Result<&Field<'a>, String> {
        self.find(name).ok_or_else(|| format!("has no field \"{name}\""))
    }
}

impl Field<'_> {
    /// Its shape, if it has this number of dimensions.
    pub(super) fn shape<const N: usize>(&self) -> Result<[usize; N], String> {
        let shape: Vec<usize> = self.shape.iter().filter_map(|n| usize::try_from(*n).ok()).collect();
        let found = self.shape.len();
        shape.try_into().map_err(|_| format!("field \"{}\" has {found} dimensions, not {N}", self.name))
    }

    /// Itself, if it has this number of dimensions.
    pub(super) fn shaped<const N: usize>(&self) -> Result<&Self, String> {
        self.shape::<N>().map(|_| self)
    }

    /// Its numbers.
    pub(super) fn floats(&self) -> Result<Vec<f32>, String> {
        self.expect(self.kind == FLOAT, "is not of 32-bit floats")?;
        let data = self.data_of(size_of::<f32>())?;
        Ok(data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
    }

    /// Its bytes.
    pub(super) fn bytes(&self) -> Result<&[u8], String> {
        self.expect(self.kind == BYTE, "is not of bytes")?;
        self.data_of(1)
    }

    /// An error about it unless something holds.
    pub(super) fn expect(&self, holds: bool, what: &str) -> Result<(), String> {
        if holds { Ok(()) } else { Err(format!("field \"{}\" {what}", self.name)) }
    }

    fn data_of(&self, size: usize) -> Result<&[u8], String> {
        let n = self.shape.iter().try_fold(size as u64, |n, d| n.checked_mul(*d));
        let n = n.and_then(|n| usize::try_from(n).ok());
        n.and_then(|n| self.data.get(..n))
            .ok_or_else(|| format!("field \"{}\" ends beyond the end of the file", self.name))
    }
}
