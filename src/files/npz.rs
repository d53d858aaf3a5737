//! Reads and writes numpy's `.npz` archives of arrays.
//!
//! The format is that of `numpy.savez`: a zip archive with one file `NAME.npy` for each array
//! (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>).
//!
//! The reader takes at most [`MAX_BYTES`] per array and [`MAX_TOTAL_BYTES`] per archive. It checks the shape in the
//! header against the number of bytes that follow, and only then allocates the array. A damaged or hostile file
//! therefore costs no more than a large valid one.
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

use std::io::{Cursor, Read, Write};

use ndarray::{Array, ArrayBase, ArrayD, Data, Dimension, IxDyn, ShapeBuilder};
use thiserror::Error;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Greatest uncompressed size of an array, with its header, in bytes: 256 MiB. [`NpzReader::read`] refuses larger
/// arrays.
pub const MAX_BYTES: u64 = 256 << 20;

/// Greatest number of uncompressed bytes that an [`NpzReader`] takes from an archive: 1 GiB. Every call of
/// [`NpzReader::read`] counts, even if it fails. Without this limit a small archive of many large arrays could fill
/// the memory.
pub const MAX_TOTAL_BYTES: u64 = 1 << 30;

/// An archive that cannot be read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The bytes are not a zip archive, or the zip format does not allow the operation.
    #[error("cannot read or write the zip archive ({0})")]
    Archive(#[from] ZipError),
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
        let dict =
            format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({shape}), }}", T::DESCR);
        // Magic, version and header length take 10 bytes. numpy starts the numbers at a multiple of 64 bytes.
        let length = (PREAMBLE + dict.len() + 1).next_multiple_of(64) - PREAMBLE;
        let mut bytes = Vec::with_capacity(PREAMBLE + length + array.len() * T::SIZE);
        bytes.extend(MAGIC);
        bytes.extend([1, 0]);
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(format!("{dict:<width$}\n", width = length - 1).bytes());
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

/// Reads arrays from the bytes of an archive.
pub struct NpzReader<'b> {
    zip: ZipArchive<Cursor<&'b [u8]>>,
    /// Number of bytes that may still be read.
    left: u64,
}

impl<'b> NpzReader<'b> {
    /// Opens an archive.
    ///
    /// # Errors
    /// [`NpzError::Archive`] if the bytes are not a zip archive.
    pub fn new(bytes: &'b [u8]) -> Result<Self, NpzError> {
        Ok(Self { zip: ZipArchive::new(Cursor::new(bytes))?, left: MAX_TOTAL_BYTES })
    }

    /// Returns the names of the arrays, in the order of the archive.
    pub fn names(&self) -> Vec<String> {
        self.zip.file_names().filter_map(|n| n.strip_suffix(".npy")).map(Into::into).collect()
    }

    /// Reads the array `name`. `T` and `D` must be its type of number and number of dimensions. Needs memory for two
    /// copies of the array.
    ///
    /// # Errors
    /// - [`NpzError::Missing`] if the archive has no array called `name`;
    /// - [`NpzError::Array`] if the array is damaged, larger than [`MAX_BYTES`] or than the rest of
    ///   [`MAX_TOTAL_BYTES`], or of another type or number of dimensions;
    /// - [`NpzError::Archive`] or [`NpzError::Io`] if the array cannot be decompressed.
    pub fn read<T: Element, D: Dimension>(&mut self, name: &str) -> Result<Array<T, D>, NpzError> {
        let mut file = match self.zip.by_name(&format!("{name}.npy")) {
            Err(ZipError::FileNotFound) => return Err(NpzError::Missing { name: name.into() }),
            file => file?,
        };
        let allowed = MAX_BYTES.min(self.left);
        if file.size() > allowed {
            return bad(format!("the array has {} bytes; expected at most {allowed}", file.size()));
        }
        let mut bytes = Vec::new();
        let done = (&mut file).take(allowed).read_to_end(&mut bytes);
        self.left -= bytes.len() as u64;
        done?;
        let (header, numbers) = Header::parse(&bytes)?;
        if header.descr != T::DESCR {
            return bad(format!(
                "the array has numbers of type {}; expected {}",
                header.descr,
                T::DESCR
            ));
        }
        let expected = header.shape.iter().try_fold(T::SIZE, |all, n| all.checked_mul(*n));
        if expected != Some(numbers.len()) {
            return bad(format!(
                "{} bytes of numbers do not fit the shape {:?}",
                numbers.len(),
                header.shape
            ));
        }
        let numbers: Option<Vec<T>> = numbers.chunks_exact(T::SIZE).map(T::from_bytes).collect();
        let shape = IxDyn(&header.shape).set_f(header.column_major);
        let Some(array) = numbers.and_then(|n| ArrayD::from_shape_vec(shape, n).ok()) else {
            return bad(format!("the array has the impossible shape {:?}", header.shape));
        };
        array.into_dimensionality().or_else(|_| {
            let expected = D::NDIM.unwrap_or(0);
            bad(format!("the number of dimensions is {}; expected {expected}", header.shape.len()))
        })
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
    /// Splits an array's bytes into the header and the numbers.
    fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), NpzError> {
        let Some((preamble, rest)) = bytes.split_at_checked(PREAMBLE) else {
            return bad("the array ends within its header");
        };
        // Versions 2 and 3 are for arrays with named fields, which the reader does not support.
        if !preamble.starts_with(MAGIC) || preamble[6] != 1 {
            return bad("the array is not in version 1 of numpy's format");
        }
        let length = usize::from(u16::from_le_bytes([preamble[8], preamble[9]]));
        let Some((text, numbers)) = rest.split_at_checked(length) else {
            return bad("the array ends within its header");
        };
        let header = std::str::from_utf8(text).ok().and_then(Self::of);
        header.map_or_else(
            || bad("the header of the array is damaged"),
            |header| Ok((header, numbers)),
        )
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
                    shape = Some(lengths.collect::<Option<Vec<usize>>>()?);
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
    use ndarray::{Array1, Array2, Array3, Ix1, Ix2, Ix3};

    use super::*;

    fn archive() -> Vec<u8> {
        let mut npz = NpzWriter::new();
        npz.add("line", &Array1::from_iter(0..5u32)).expect("added");
        npz.add("plane", &Array2::from_shape_fn((2, 3), |(i, j)| (10 * i + j) as f64)).expect("");
        npz.add("empty", &Array3::<f32>::zeros((0, 4, 2))).expect("added");
        npz.finish().expect("finished")
    }

    #[test]
    fn arrays_come_back_as_they_were() {
        let bytes = archive();
        let mut npz = NpzReader::new(&bytes).expect("an archive");
        assert_eq!(npz.names(), ["line", "plane", "empty"]);
        assert_eq!(npz.read::<u32, Ix1>("line").expect("read").to_vec(), [0, 1, 2, 3, 4]);
        let plane = npz.read::<f64, Ix2>("plane").expect("read");
        assert_eq!((plane.dim(), plane[(1, 2)]), ((2, 3), 12.0));
        assert_eq!(npz.read::<f32, Ix3>("empty").expect("read").dim(), (0, 4, 2));
    }

    #[test]
    fn another_type_name_or_number_of_dimensions_is_an_error() {
        let bytes = archive();
        let mut npz = NpzReader::new(&bytes).expect("an archive");
        let said =
            |error: Result<_, NpzError>| error.map(|_: Array2<f64>| ()).unwrap_err().to_string();
        assert_eq!(said(npz.read("other")), "the archive has no array `other`");
        assert_eq!(said(npz.read("line")), "the array has numbers of type <u4; expected <f8");
        let line = npz.read::<u32, Ix2>("line").unwrap_err().to_string();
        assert_eq!(line, "the number of dimensions is 1; expected 2");
        assert!(NpzReader::new(b"no archive").is_err());
    }

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

    #[test]
    fn a_shape_beyond_the_bytes_takes_no_memory() {
        let dict = "{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000, 4), }";
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((dict.len() as u16).to_le_bytes());
        bytes.extend(dict.bytes());
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        zip.start_file("huge.npy", SimpleFileOptions::default()).expect("started");
        zip.write_all(&bytes).expect("written");
        let bytes = zip.finish().expect("finished").into_inner();
        let mut npz = NpzReader::new(&bytes).expect("an archive");
        let said = npz.read::<f64, Ix2>("huge").unwrap_err().to_string();
        assert_eq!(said, "0 bytes of numbers do not fit the shape [10000000000, 4]");
    }
}
