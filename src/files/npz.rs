//! Reads and writes numpy's `.npz` archives of arrays.
//!
//! The format is that of `numpy.savez`: a zip archive with one file `NAME.npy` for each array
//! (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>).
//!
//! The reader takes at most [`MAX_BYTES`] per array and [`MAX_TOTAL_BYTES`] per archive, and an archive has at most
//! 4,096 arrays. It checks the type, the shape and the length that the headers state against each other before it
//! decompresses the numbers, and reads these straight into the array. A damaged or hostile file therefore costs no more
//! than a large valid one.
//!
//! ```
//! use ndarray::{Array2, Ix2, array};
//! use symbolt::files::npz::{NpzReader, NpzWriter};
//!
//! let mut npz = NpzWriter::new();
//! npz.add("weights", &array![[1.0f32, 2.0], [3.0, 4.0]])?;
//! let bytes = npz.finish()?;
//!
//! let mut npz = NpzReader::new(&bytes)?;
//! let weights: Array2<f32> = npz.read::<f32, Ix2>("weights")?;
//! assert_eq!(weights[(1, 0)], 3.0);
//! # Ok::<(), symbolt::files::npz::NpzError>(())
//! ```

mod archive;

use std::io::{Cursor, Write};

use ndarray::{Array, ArrayBase, ArrayD, Data, Dimension, IxDyn, ShapeBuilder};
use thiserror::Error;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use archive::{Archive, Content};

/// Greatest uncompressed size of an array, with its header, in bytes: 64 MiB. [`NpzReader::read`] refuses larger
/// arrays.
pub const MAX_BYTES: usize = 64 << 20;

/// Greatest number of uncompressed bytes that an [`NpzReader`] takes from an archive: 96 MiB. Every call of
/// [`NpzReader::read`] counts, even if it fails. Without this limit a small archive of many large arrays could fill
/// the memory.
pub const MAX_TOTAL_BYTES: usize = 96 << 20;

/// An archive that cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The zip format does not allow the operation.
    #[error("cannot write the zip archive ({0})")]
    Archive(#[from] ZipError),
    /// The bytes are not a zip archive, or a damaged one.
    #[error("cannot read the zip archive: {reason}")]
    Damaged {
        /// What is wrong with the archive.
        reason: String,
    },
    /// An array that is not in the archive.
    #[error("the archive has no array `{name}`")]
    Missing {
        /// The array's name.
        name: String,
    },
    /// An array that is damaged, too large, or of another type or number of dimensions.
    #[error("{reason}")]
    Array {
        /// What is wrong with the array.
        reason: String,
    },
    /// The bytes of an array could not be read or written.
    #[error("cannot read or write the bytes of the array ({0})")]
    Io(#[from] std::io::Error),
}

fn bad<T>(reason: impl Into<String>) -> Result<T, NpzError> {
    Err(NpzError::Array { reason: reason.into() })
}

/// A type of number that an array can hold: `f32`, `f64`, `u32` or `u8`.
pub trait Element: Copy + private::Bytes {
    /// numpy's name for the type in little-endian order, such as `<f4` for `f32`.
    const DESCR: &'static str;
}

mod private {
    /// Little-endian bytes of a number.
    pub trait Bytes: Sized {
        const SIZE: usize;
        fn from_bytes(bytes: &[u8]) -> Option<Self>;
        fn append_to(self, bytes: &mut Vec<u8>);
    }
}

macro_rules! elements {
    ($($number:ty => $descr:literal),*) => {$(
        impl private::Bytes for $number {
            const SIZE: usize = size_of::<$number>();
            fn from_bytes(bytes: &[u8]) -> Option<Self> {
                Some(Self::from_le_bytes(bytes.try_into().ok()?))
            }
            fn append_to(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
        impl Element for $number {
            const DESCR: &'static str = $descr;
        }
    )*};
}

elements!(f32 => "<f4", f64 => "<f8", u32 => "<u4", u8 => "|u1");

/// Builds a compressed archive in memory.
pub struct NpzWriter {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl NpzWriter {
    /// Starts an archive without arrays.
    #[expect(clippy::new_without_default, reason = "an archive is finished, not kept")]
    pub fn new() -> Self {
        Self { zip: ZipWriter::new(Cursor::new(Vec::new())) }
    }

    /// Adds an array under `name`, in row-major order. Costs one copy of the array.
    ///
    /// # Errors
    /// [`NpzError::Archive`] if the archive already has an array called `name`; [`NpzError::Io`] if the bytes cannot
    /// be compressed.
    pub fn add<T, S, D>(&mut self, name: &str, array: &ArrayBase<S, D>) -> Result<(), NpzError>
    where
        T: Element,
        S: Data<Elem = T>,
        D: Dimension,
    {
        let shape: String = array.shape().iter().map(|n| format!("{n}, ")).collect();
        let shape = if array.ndim() == 1 { shape.trim_end() } else { shape.trim_end_matches(", ") };
        let mut bytes = head(T::DESCR, shape);
        bytes.reserve(array.len() * T::SIZE);
        array.iter().for_each(|number| number.append_to(&mut bytes));
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        self.zip.start_file(format!("{name}.npy"), options)?;
        self.zip.write_all(&bytes)?;
        Ok(())
    }

    /// Returns the archive's bytes.
    ///
    /// # Errors
    /// [`NpzError::Archive`] if the archive is too large for the zip format.
    pub fn finish(self) -> Result<Vec<u8>, NpzError> {
        Ok(self.zip.finish()?.into_inner())
    }
}

const MAGIC: &[u8; 6] = b"\x93NUMPY";
const PREAMBLE: usize = 10;

/// Returns the head of an array of numbers of the type `descr`, such as `<f4`, and of a shape as numpy writes it, such as `3, 4`.
pub(crate) fn head(descr: &str, shape: &str) -> Vec<u8> {
    let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    // Magic, version and header length take 10 bytes. numpy starts the numbers at a multiple of 64 bytes.
    let length = (PREAMBLE + dict.len() + 1).next_multiple_of(64) - PREAMBLE;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{dict:<width$}\n", width = length - 1).bytes());
    bytes
}

/// Greatest number of dimensions of an array, as in numpy.
const MAX_DIMENSIONS: usize = 64;

/// Returns the beginning of a text from a file, for a message.
fn shortened(text: &str) -> String {
    text.chars().take(20).collect()
}

/// Number of bytes that are decompressed at a time.
const CHUNK: usize = 64 << 10;

/// Reads arrays from the bytes of an archive.
pub struct NpzReader<'b> {
    archive: Archive<'b>,
    /// Number of bytes that may still be read.
    left: usize,
}

impl<'b> NpzReader<'b> {
    /// Opens an archive.
    ///
    /// # Errors
    /// [`NpzError::Damaged`] if the bytes are not a zip archive, or if it has more than 4,096 members.
    pub fn new(bytes: &'b [u8]) -> Result<Self, NpzError> {
        let archive = Archive::new(bytes).map_err(|reason| NpzError::Damaged { reason })?;
        Ok(Self { archive, left: MAX_TOTAL_BYTES })
    }

    /// Returns the names of the arrays, in the order of the archive.
    pub fn names(&self) -> Vec<String> {
        let names = self.archive.names().iter();
        names.filter_map(|n| n.strip_suffix(".npy")).map(Into::into).collect()
    }

    /// Reads the array `name`. `T` and `D` must be its type of number and number of dimensions. Needs memory for one
    /// copy of the array.
    ///
    /// # Errors
    /// - [`NpzError::Missing`] if the archive has no array called `name`;
    /// - [`NpzError::Array`] if the array is damaged, larger than [`MAX_BYTES`] or than the rest of
    ///   [`MAX_TOTAL_BYTES`], or of another type or number of dimensions;
    /// - [`NpzError::Io`] if the array cannot be decompressed.
    pub fn read<T: Element, D: Dimension>(&mut self, name: &str) -> Result<Array<T, D>, NpzError> {
        let mut content = match self.archive.open(&format!("{name}.npy")) {
            None => return Err(NpzError::Missing { name: name.into() }),
            Some(content) => content.or_else(bad)?,
        };
        let allowed = MAX_BYTES.min(self.left);
        if content.length() > allowed {
            let length = content.length();
            return bad(format!("the array has {length} bytes; expected at most {allowed}"));
        }
        let read = Header::read(&mut content).and_then(|header| {
            let numbers = header.numbers::<T, D>(&mut content)?;
            Ok((header, numbers))
        });
        self.left -= content.taken().min(self.left);
        let (header, numbers) = read?;
        if !content.ends_soundly() {
            return bad("the bytes of the array are damaged");
        }
        let shape = IxDyn(&header.shape).set_f(header.column_major);
        let Ok(array) = ArrayD::from_shape_vec(shape, numbers) else {
            return bad(format!("the array has the impossible shape {:?}", header.shape));
        };
        array.into_dimensionality().or_else(|_| header.wrong_dimensions::<D, _>())
    }
}

/// The content of an array's header.
#[derive(Debug, PartialEq)]
struct Header {
    descr: String,
    column_major: bool,
    shape: Vec<usize>,
}

impl Header {
    /// Reads the header from the beginning of an array.
    fn read(content: &mut Content<'_>) -> Result<Self, NpzError> {
        if content.length() < PREAMBLE {
            return bad("the array ends within its header");
        }
        let mut preamble = [0; PREAMBLE];
        content.fill(&mut preamble)?;
        // Versions 2 and 3 are for arrays with named fields, which the reader does not support.
        if !preamble.starts_with(MAGIC) || preamble[6] != 1 {
            return bad("the array is not in version 1 of numpy's format");
        }
        let length = usize::from(u16::from_le_bytes([preamble[8], preamble[9]]));
        if content.length() < PREAMBLE + length {
            return bad("the array ends within its header");
        }
        let mut text = vec![0; length];
        content.fill(&mut text)?;
        let header = std::str::from_utf8(&text).ok().and_then(Self::of);
        header.map_or_else(|| bad("the header of the array is damaged"), Ok)
    }

    /// Reads the numbers that follow the header, if they are of type `T` and in `D` dimensions.
    fn numbers<T: Element, D: Dimension>(
        &self,
        content: &mut Content<'_>,
    ) -> Result<Vec<T>, NpzError> {
        if self.descr != T::DESCR {
            let (found, expected) = (shortened(&self.descr), T::DESCR);
            return bad(format!("the array has numbers of type {found}; expected {expected}"));
        }
        if D::NDIM.is_some_and(|expected| expected != self.shape.len()) {
            return self.wrong_dimensions::<D, _>();
        }
        let bytes = content.length() - content.taken();
        let expected = self.shape.iter().try_fold(T::SIZE, |all, n| all.checked_mul(*n));
        if expected != Some(bytes) {
            let shape = &self.shape;
            return bad(format!("{bytes} bytes of numbers do not fit the shape {shape:?}"));
        }
        if bytes > content.reachable() {
            return bad("the array has fewer bytes than it states");
        }
        let mut numbers = Vec::with_capacity(bytes / T::SIZE);
        let mut chunk = vec![0; CHUNK.min(bytes)];
        let mut left = bytes;
        while left > 0 {
            let part = chunk.len().min(left);
            content.fill(&mut chunk[..part])?;
            numbers.extend(chunk[..part].chunks_exact(T::SIZE).filter_map(T::from_bytes));
            left -= part;
        }
        Ok(numbers)
    }

    fn wrong_dimensions<D: Dimension, T>(&self) -> Result<T, NpzError> {
        let (found, expected) = (self.shape.len(), D::NDIM.unwrap_or(0));
        bad(format!("the number of dimensions is {found}; expected {expected}"))
    }

    /// Parses the header's dictionary, which has three keys in any order. Returns `None` if it is invalid.
    fn of(text: &str) -> Option<Self> {
        let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
        let (mut descr, mut column_major, mut shape) = (None, None, None);
        while !rest.is_empty() {
            let (key, value) = rest.split_once(':')?;
            let value = value.trim_start();
            let end = match key.trim().trim_matches(['\'', '"']) {
                "descr" => {
                    let end = 2 + value.get(1..)?.find(['\'', '"'])?;
                    descr = Some(value.get(1..end - 1)?.to_owned());
                    end
                }
                "fortran_order" => {
                    let end = value.find([',', ' ']).unwrap_or(value.len());
                    column_major = Some(match value.get(..end)? {
                        "True" => true,
                        "False" => false,
                        _ => return None,
                    });
                    end
                }
                "shape" => {
                    let inside = value.strip_prefix('(')?;
                    let end = inside.find(')')?;
                    let lengths = inside[..end].split(',').map(str::trim);
                    let lengths = lengths.filter(|n| !n.is_empty()).map(|n| n.parse().ok());
                    let lengths = lengths.collect::<Option<Vec<usize>>>()?;
                    shape = (lengths.len() <= MAX_DIMENSIONS).then_some(lengths);
                    end + 2
                }
                _ => return None,
            };
            rest = value.get(end..)?.trim_start();
            rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
        }
        Some(Self { descr: descr?, column_major: column_major?, shape: shape? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_numpy_in_any_order_are_read_and_others_refused_at_once() {
        let numpy = "{'shape': (3, 4), 'descr': '<f4', 'fortran_order': True}    \n";
        let header = Header { descr: "<f4".into(), column_major: true, shape: vec![3, 4] };
        assert_eq!(Header::of(numpy), Some(header));
        assert_eq!(
            Header::of("{'descr': '|u1', 'fortran_order': False, 'shape': (), }").map(|h| h.shape),
            Some(vec![])
        );
        for text in [
            "",
            "{",
            "{}",
            "{'descr'}",
            "{'descr': }",
            "{'descr': '",
            "{'descr': '<f4'}",
            "{'descr': '<f4', 'fortran_order': Maybe, 'shape': (1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1}",
            "{'descr': 'é', 'fortran_order': False, 'shape': 7}",
        ] {
            assert_eq!(Header::of(text), None, "{text}");
        }
        // A parser that backtracks would never finish this header.
        assert_eq!(Header::of(&format!("{{'shape': {}", "(".repeat(60_000))), None);
    }
}
