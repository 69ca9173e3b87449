//! Tensor files, the container of RGL measurements: named arrays of numbers.
//!
//! ```text
//! "tensor_file\0"   u8 × 2: version 1, 0   u32: fields
//! per field: u16 length, name; u16 dimensions, u8 type, u64 offset of the data; u64 per dimension
//! ```
//!
//! All little-endian; the data of a field lie at its offset from the start of the file.

use std::io::{self, Read, Seek, SeekFrom, Write};

use crate::measurement::error::{Problem, TensorProblem};

/// Magic bytes of a tensor file.
pub const MAGIC: [u8; 12] = *b"tensor_file\0";

const VERSION: [u8; 2] = [1, 0];
// Limits far above any measurement, so that a damaged file cannot ask for much memory.
const MAX_FIELDS: u64 = 64;
const MAX_NAME: u64 = 256;
const MAX_DIMENSIONS: u64 = 8;
/// The alignment of a field's data, for readers that map the file.
const ALIGNMENT: usize = 8;

/// The number types of fields that the measurements are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    U8,
    F32,
    /// Of any other type; never read.
    Other(u8),
}

impl Kind {
    fn of(code: u8) -> Self {
        match code {
            1 => Self::U8,
            10 => Self::F32,
            other => Self::Other(other),
        }
    }

    fn code(self) -> u8 {
        match self {
            Self::U8 => 1,
            Self::F32 => 10,
            Self::Other(code) => code,
        }
    }

    fn name(self) -> String {
        match self {
            Self::U8 => "u8".into(),
            Self::F32 => "f32".into(),
            Self::Other(code) => format!("type {code}"),
        }
    }

    fn bytes(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::F32 => 4,
            // Their size is unknown, and nothing reads them.
            Self::Other(_) => 0,
        }
    }
}

/// Where a field is and what it holds.
#[derive(Clone, Debug)]
struct Field {
    name: String,
    kind: Kind,
    shape: Vec<u64>,
    offset: u64,
}

impl Field {
    /// Its type and shape, as errors name them.
    fn describe(&self) -> String {
        format!("{} {:?}", self.kind.name(), self.shape)
    }
}

/// A tensor file whose list of fields has been read and checked.
pub struct TensorFile<'r, R> {
    reader: &'r mut R,
    fields: Vec<Field>,
    /// Bytes that the fields still to be read may take together, so that overlapping fields do
    /// not fill the memory.
    budget: u64,
}

impl<'r, R: Read + Seek> TensorFile<'r, R> {
    /// Reads the list of fields of a file of `length` bytes, the reader at its start.
    pub fn open(reader: &'r mut R, length: u64) -> Result<Self, Problem> {
        let mut directory = Directory(reader);
        let _: [u8; 12] = directory.bytes()?;
        let version = directory.bytes()?;
        if version != VERSION {
            return Err(TensorProblem::Version(version).into());
        }
        let count = limited("the number of fields", directory.u32()?, MAX_FIELDS)?;
        let fields = (0..count).map(|_| directory.field(length)).collect::<Result<_, _>>()?;
        Ok(Self { reader, fields, budget: length })
    }

    /// Returns whether there is a field of this name.
    pub fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|field| field.name == name)
    }

    /// The shape of a field of f32 with `N` dimensions.
    pub fn shape<const N: usize>(&self, name: &'static str) -> Result<[u64; N], TensorProblem> {
        let field = self.field(name)?;
        let shape = <[u64; N]>::try_from(field.shape.as_slice()).ok();
        shape.filter(|_| field.kind == Kind::F32).ok_or_else(|| TensorProblem::Shape {
            name,
            found: field.describe(),
            needed: format!("f32 of {N} dimensions"),
        })
    }

    /// The bytes of a field.
    pub fn bytes(&mut self, name: &'static str) -> Result<Vec<u8>, Problem> {
        let field = self.field(name)?;
        if field.kind != Kind::U8 {
            let (found, needed) = (field.describe(), "u8".into());
            return Err(TensorProblem::Shape { name, found, needed }.into());
        }
        self.read(name)
    }

    /// The numbers of a field of this shape, finite and at least `least`.
    pub fn floats(
        &mut self,
        name: &'static str,
        shape: &[u64],
        least: f32,
    ) -> Result<Vec<f32>, Problem> {
        let field = self.field(name)?;
        if field.kind != Kind::F32 || field.shape != shape {
            let needed = format!("f32 {shape:?}");
            return Err(TensorProblem::Shape { name, found: field.describe(), needed }.into());
        }
        // Read in pieces: the bytes and the numbers of a field are never there at the same time.
        let count = self.take(name)? / 4;
        let mut numbers = Vec::with_capacity(count as usize);
        let mut piece = [0; 4096];
        while (numbers.len() as u64) < count {
            let left = 4 * (count - numbers.len() as u64);
            let piece = &mut piece[..left.min(4096) as usize];
            self.reader.read_exact(piece)?;
            numbers.extend(
                piece.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            );
        }
        let wrong = numbers.iter().position(|number| !(number.is_finite() && *number >= least));
        wrong.map_or(Ok(()), |index| {
            let needed =
                if least == f32::MIN { "a finite number" } else { "a finite number ≥ 0" };
            Err(TensorProblem::Value { name, found: numbers[index].to_string(), index, needed })
        })?;
        Ok(numbers)
    }

    fn field(&self, name: &'static str) -> Result<&Field, TensorProblem> {
        let found = self.fields.iter().find(|field| field.name == name);
        found.ok_or(TensorProblem::Missing(name))
    }

    fn read(&mut self, name: &'static str) -> Result<Vec<u8>, Problem> {
        let size = self.take(name)?;
        let mut bytes = vec![0; size as usize];
        self.reader.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// Goes to a field's data; its size in bytes, which the directory has checked.
    fn take(&mut self, name: &'static str) -> Result<u64, Problem> {
        let field = self.field(name)?;
        // `Directory::field` has made sure that the product neither overflows nor leaves the file.
        let size = field.shape.iter().product::<u64>() * field.kind.bytes();
        let offset = field.offset;
        self.budget =
            self.budget.checked_sub(size).ok_or_else(|| TensorProblem::Beyond(name.to_owned()))?;
        self.reader.seek(SeekFrom::Start(offset))?;
        Ok(size)
    }
}

/// Reads the list of fields.
struct Directory<'r, R>(&'r mut R);

impl<R: Read> Directory<'_, R> {
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), Problem> {
        self.0.read_exact(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => TensorProblem::Directory.into(),
            _ => error.into(),
        })
    }

    fn u16(&mut self) -> Result<u64, Problem> {
        Ok(u16::from_le_bytes(self.bytes()?).into())
    }

    fn u32(&mut self) -> Result<u64, Problem> {
        Ok(u32::from_le_bytes(self.bytes()?).into())
    }

    fn u64(&mut self) -> Result<u64, Problem> {
        Ok(u64::from_le_bytes(self.bytes()?))
    }

    /// A field whose data lie within the file.
    fn field(&mut self, length: u64) -> Result<Field, Problem> {
        let letters = limited("the length of a field's name", self.u16()?, MAX_NAME)?;
        let mut name = vec![0; letters as usize];
        self.fill(&mut name)?;
        let name = String::from_utf8_lossy(&name).into_owned();
        let dimensions = limited("the number of dimensions", self.u16()?, MAX_DIMENSIONS)?;
        let [code] = self.bytes()?;
        let kind = Kind::of(code);
        let offset = self.u64()?;
        let shape: Vec<u64> = (0..dimensions).map(|_| self.u64()).collect::<Result<_, _>>()?;
        // Checked throughout: sizes and offset are any numbers of 64 bits.
        let count = shape.iter().try_fold(1_u64, |count, size| count.checked_mul(*size));
        let end = count.and_then(|n| n.checked_mul(kind.bytes())?.checked_add(offset));
        if end.is_none_or(|end| end > length) {
            return Err(TensorProblem::Beyond(name).into());
        }
        Ok(Field { name, kind, shape, offset })
    }
}

fn limited(what: &'static str, found: u64, most: u64) -> Result<u64, TensorProblem> {
    if found > most { Err(TensorProblem::Excess { what, found, most }) } else { Ok(found) }
}

/// A field to write.
pub struct Tensor<'a> {
    /// Its name.
    pub name: &'static str,
    /// Its dimensions.
    pub shape: Vec<usize>,
    /// Its numbers.
    pub data: Data<'a>,
}

/// The numbers of a field to write.
pub enum Data<'a> {
    /// Bytes.
    U8(&'a [u8]),
    /// Single precision.
    F32(&'a [f32]),
}

impl Data<'_> {
    fn kind(&self) -> Kind {
        match self {
            Self::U8(_) => Kind::U8,
            Self::F32(_) => Kind::F32,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::U8(bytes) => bytes.len(),
            Self::F32(numbers) => 4 * numbers.len(),
        }
    }
}

/// Writes a tensor file.
pub fn write(writer: &mut impl Write, tensors: &[Tensor<'_>]) -> io::Result<()> {
    let mut writer = io::BufWriter::new(writer);
    let entries = tensors.iter().map(|t| 2 + t.name.len() + 2 + 1 + 8 + 8 * t.shape.len());
    let directory = MAGIC.len() + VERSION.len() + 4 + entries.sum::<usize>();
    writer.write_all(&MAGIC)?;
    writer.write_all(&VERSION)?;
    writer.write_all(&(tensors.len() as u32).to_le_bytes())?;
    // First the list of fields with the offsets that their data will have, then the data at them.
    let mut end = directory;
    for tensor in tensors {
        let offset = end.next_multiple_of(ALIGNMENT);
        end = offset + tensor.data.bytes();
        writer.write_all(&(tensor.name.len() as u16).to_le_bytes())?;
        writer.write_all(tensor.name.as_bytes())?;
        writer.write_all(&(tensor.shape.len() as u16).to_le_bytes())?;
        writer.write_all(&[tensor.data.kind().code()])?;
        writer.write_all(&(offset as u64).to_le_bytes())?;
        for size in &tensor.shape {
            writer.write_all(&(*size as u64).to_le_bytes())?;
        }
    }
    let mut written = directory;
    for tensor in tensors {
        // The same alignment as for the offsets above, so that both agree.
        let padding = written.next_multiple_of(ALIGNMENT) - written;
        writer.write_all(&[0; ALIGNMENT][..padding])?;
        match tensor.data {
            Data::U8(bytes) => writer.write_all(bytes)?,
            Data::F32(numbers) => {
                for number in numbers {
                    writer.write_all(&number.to_le_bytes())?;
                }
            }
        }
        written += padding + tensor.data.bytes();
    }
    writer.flush()
}
