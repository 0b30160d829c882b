//! Arrays of an untrusted `.npz`: nothing is unpickled, sizes are checked before they are used, and a damaged file is an
//! error.

use std::{
    fmt,
    io::{BufReader, Read, Seek, SeekFrom},
};

use npyz::{
    DType, Deserialize, NpyFile, Order, TypeChar,
    npz::{array_name_from_file_name, file_name_from_array_name},
};
use zip::{CompressionMethod, ZipArchive, result::ZipError};

use crate::message::{one_line, short};

/// Characters of a list of names in a message.
const LONGEST_LIST: usize = 1000;

/// Reason for refusing an archive or one of its arrays.
#[derive(Debug)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum NpzError {
    /// No archive, or a damaged one.
    Damaged {
        array: Option<String>,
        reason: String,
    },
    /// An array is missing.
    Missing { array: String, found: String },
    /// An array of Python objects, which may run code when they are read, and are not.
    Pickled { array: String },
    /// An array of another element type.
    ElementType {
        array: String,
        found: String,
        expected: &'static str,
    },
}

impl fmt::Display for NpzError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged {
                array: None,
                reason,
            } => f.write_str(reason),
            Self::Damaged {
                array: Some(array),
                reason,
            } => write!(f, "array `{array}`: {reason}"),
            Self::Missing { array, found } => write!(f, "no array `{array}`; arrays: {found}"),
            Self::Pickled { array } => write!(
                f,
                "array `{array}` holds pickled Python objects, which may run code when they are read, and are not"
            ),
            Self::ElementType {
                array,
                found,
                expected,
            } => write!(
                f,
                "array `{array}` has elements {found}; expected {expected}"
            ),
        }
    }
}

impl std::error::Error for NpzError {}

/// Largest array that is read [bytes], in the file and as numbers of eight bytes; that of an hour at 1 kHz of 30 columns is
/// 0.9 GB.
const LARGEST_ARRAY: u64 = 1 << 30;
/// Most bytes that a byte of a deflated stream becomes: two bits can stand for 258 bytes.
const MOST_INFLATED: u64 = 1032;
/// Longest header of an array [bytes]. NumPy writes 118 for a plain array.
const LONGEST_HEADER: usize = 4096;

/// An opened `.npz`.
pub struct Archive<R: Read + Seek> {
    zip: ZipArchive<R>,
    /// Size of the whole archive [bytes].
    size: u64,
}

impl<R: Read + Seek> fmt::Debug for Archive<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.names()).finish()
    }
}

/// An array of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Its shape.
    pub shape: Vec<u64>,
    /// Its elements in C order.
    pub values: Vec<f64>,
}

impl<R: Read + Seek> Archive<R> {
    /// Opens an archive.
    ///
    /// # Errors
    /// No archive, or one that is cut short.
    pub fn open(mut file: R) -> Result<Self, NpzError> {
        let damaged = |error: &dyn fmt::Display| NpzError::Damaged {
            array: None,
            reason: format!("cut short, or no .npz archive at all ({})", short(error)),
        };
        let size = (file.seek(SeekFrom::End(0))).map_err(|error| damaged(&error))?;
        let zip = ZipArchive::new(file).map_err(|error| damaged(&error))?;
        Ok(Self { zip, size })
    }

    /// Names of the arrays, sorted.
    pub fn names(&self) -> Vec<String> {
        // A name that cannot be decoded is no array's.
        let files = self.zip.file_names().filter_map(Result::ok);
        let arrays = files.filter_map(|file| array_name_from_file_name(&file).map(str::to_owned));
        let mut names: Vec<String> = arrays.collect();
        names.sort();
        names
    }

    /// Names of the arrays for a message.
    pub fn listed(&self) -> String {
        let names = self.names();
        let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        match quoted.as_slice() {
            [] => "none".to_owned(),
            names => one_line(names.join(", "), LONGEST_LIST),
        }
    }

    /// Numbers of any width and byte order; `None` where there is no such array.
    ///
    /// # Errors
    /// A damaged array, one of another type, or one that is not as large as its header says.
    pub fn numbers(&mut self, array: &str) -> Result<Option<Array>, NpzError> {
        self.read(array, "f4, f8 or an integer", |npy, element| {
            Ok(Some(match element {
                (TypeChar::Float, 8) => numbers::<f64>(npy, |value| value)?,
                (TypeChar::Float, 4) => numbers::<f32>(npy, f64::from)?,
                (TypeChar::Int, 1) => numbers::<i8>(npy, f64::from)?,
                (TypeChar::Int, 2) => numbers::<i16>(npy, f64::from)?,
                (TypeChar::Int, 4) => numbers::<i32>(npy, f64::from)?,
                (TypeChar::Int, 8) => numbers::<i64>(npy, |value| value as f64)?,
                (TypeChar::Uint, 1) => numbers::<u8>(npy, f64::from)?,
                (TypeChar::Uint, 2) => numbers::<u16>(npy, f64::from)?,
                (TypeChar::Uint, 4) => numbers::<u32>(npy, f64::from)?,
                (TypeChar::Uint, 8) => numbers::<u64>(npy, |value| value as f64)?,
                _ => return Ok(None),
            }))
        })
    }

    /// Numbers of a required array.
    ///
    /// # Errors
    /// As [`Archive::numbers`]; a missing array.
    pub fn required(&mut self, array: &str) -> Result<Array, NpzError> {
        let found = self.numbers(array)?;
        found.ok_or_else(|| NpzError::Missing {
            array: array.to_owned(),
            found: self.listed(),
        })
    }

    /// A single string; `None` where there is no such array.
    ///
    /// # Errors
    /// As [`Archive::numbers`].
    pub fn text(&mut self, array: &str) -> Result<Option<String>, NpzError> {
        self.read(array, "a string", |npy, (kind, _)| {
            if kind != TypeChar::UnicodeStr {
                return Ok(None);
            }
            npy.data::<String>()
                .map_err(std::io::Error::other)?
                .next()
                .transpose()
        })
    }

    /// Opens an array, lets `decode` read its elements, and checks that the file ends there. `decode` gives `None` for
    /// elements of another type.
    fn read<T>(
        &mut self,
        array: &str,
        expected: &'static str,
        decode: impl FnOnce(NpyFile<&mut dyn Read>, (TypeChar, u64)) -> std::io::Result<Option<T>>,
    ) -> Result<Option<T>, NpzError> {
        let damaged = |reason: String| NpzError::Damaged {
            array: Some(array.to_owned()),
            reason,
        };
        let io =
            |error: std::io::Error| damaged(format!("cut short or damaged ({})", short(error)));
        let file_name = file_name_from_array_name(array);
        let mut member = match self.zip.by_name(&file_name) {
            Ok(member) => member,
            Err(ZipError::FileNotFound) => return Ok(None),
            Err(error) => return Err(damaged(short(error))),
        };
        let size = member.size();
        let packed = member.compressed_size().min(self.size);
        let most = match member.compression() {
            CompressionMethod::Stored => packed,
            _ => packed.saturating_mul(MOST_INFLATED),
        };
        if size > most {
            return Err(damaged(format!(
                "cut short or damaged ({size} bytes are stated, but {packed} compressed ones hold {most} at most)"
            )));
        }
        let header = read_header(&mut member).map_err(damaged)?;
        let header_len = header.len() as u64;
        let mut reader = BufReader::new(header.as_slice().chain(member));
        let npy = NpyFile::new(&mut reader as &mut dyn Read).map_err(io)?;
        if npy.uses_pickled_array() {
            return Err(NpzError::Pickled {
                array: array.to_owned(),
            });
        }
        let dtype = npy.dtype();
        let wrong_type = || NpzError::ElementType {
            array: array.to_owned(),
            found: dtype.descr(),
            expected,
        };
        let DType::Plain(element) = &dtype else {
            return Err(wrong_type());
        };
        let announced = format!("shape {:?} of {}", npy.shape(), dtype.descr());
        let bytes = element
            .num_bytes()
            .and_then(|bytes| npy.len().checked_mul(bytes as u64));
        if bytes.and_then(|bytes| header_len.checked_add(bytes)) != Some(size) {
            return Err(damaged(format!(
                "its header announces {announced}, which is not what {size} bytes hold"
            )));
        }
        let numbers = npy.len().saturating_mul(size_of::<f64>() as u64);
        if bytes.is_none_or(|bytes| bytes.max(numbers) > LARGEST_ARRAY) {
            return Err(damaged(format!(
                "{announced} is larger than an array may be; expected {LARGEST_ARRAY} bytes at most, eight a number"
            )));
        }
        let element = (element.type_char(), element.size_field());
        let value = decode(npy, element).map_err(io)?.ok_or_else(wrong_type)?;
        // Reading to the end is what compares the checksum.
        std::io::copy(&mut reader, &mut std::io::sink()).map_err(io)?;
        Ok(Some(value))
    }
}

/// The bytes of an `.npy` up to its elements, refused unless they are those of a plain array: the parser behind
/// them recurses into brackets and multiplies sizes without looking.
fn read_header(member: &mut impl Read) -> Result<Vec<u8>, String> {
    let cut = |error: std::io::Error| format!("cut short or damaged ({error})");
    // "\x93NUMPY", two bytes of version, then the length of the text in two bytes, or four from version 2 on.
    let mut header = vec![0; 10];
    member.read_exact(&mut header).map_err(cut)?;
    if !header.starts_with(b"\x93NUMPY") {
        return Err("not an .npy array".to_owned());
    }
    let mut length = usize::from(u16::from_le_bytes([header[8], header[9]]));
    if header[6] > 1 {
        header.resize(12, 0);
        member.read_exact(&mut header[10..]).map_err(cut)?;
        length = u32::from_le_bytes([header[8], header[9], header[10], header[11]]) as usize;
    }
    if length > LONGEST_HEADER {
        return Err(format!(
            "a header of {length} bytes; a plain array's has at most {LONGEST_HEADER}"
        ));
    }
    let start = header.len();
    header.resize(start + length, 0);
    member.read_exact(&mut header[start..]).map_err(cut)?;
    let text = &header[start..];
    let count = |wanted: fn(&u8) -> bool| text.iter().filter(|byte| wanted(byte)).count();
    // {'descr': '<f8', 'fortran_order': False, 'shape': (1000, 12), }: eighteen digits cannot overflow 64 bits.
    let is_plain = text.is_ascii()
        && count(u8::is_ascii_digit) <= 18
        && count(|byte| matches!(byte, b'(' | b'[' | b'{')) <= 4;
    if is_plain {
        Ok(header)
    } else {
        Err("its header is not that of a plain array".to_owned())
    }
}

/// Elements as f64, in C order.
fn numbers<T: Deserialize>(
    npy: NpyFile<&mut dyn Read>,
    convert: impl Fn(T) -> f64,
) -> std::io::Result<Array> {
    let shape = npy.shape().to_vec();
    let order = npy.order();
    let elements = npy.data::<T>().map_err(std::io::Error::other)?;
    let mut values: Vec<f64> = elements
        .map(|element| element.map(&convert))
        .collect::<std::io::Result<_>>()?;
    if let (Order::Fortran, [rows, columns]) = (order, shape.as_slice()) {
        let (rows, columns) = (*rows as usize, *columns as usize);
        values = (0..rows * columns)
            .map(|place| values[place % columns * rows + place / columns])
            .collect();
    }
    Ok(Array { shape, values })
}
