//! Archives of arrays: what comes back, and what damaged or hostile ones are told.

#![allow(clippy::expect_used, clippy::unwrap_used)]

use std::io::{Cursor, Write as _};

use ndarray::{Array1, Array2, Array3, Ix1, Ix2, Ix3};
use symbolt::files::npz::{MAX_BYTES, NpzError, NpzReader, NpzWriter};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Length of what stands before the header of an array.
const PREAMBLE: usize = 10;

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
    let said = |error: Result<_, NpzError>| error.map(|_: Array2<f64>| ()).unwrap_err().to_string();
    assert_eq!(said(npz.read("other")), "the archive has no array `other`");
    assert_eq!(said(npz.read("line")), "the array has numbers of type <u4; expected <f8");
    let line = npz.read::<u32, Ix2>("line").unwrap_err().to_string();
    assert_eq!(line, "the number of dimensions is 1; expected 2");
    assert!(NpzReader::new(b"no archive").is_err());
}

/// Packs the bytes of an array into an archive, with a correct checksum.
fn packed(name: &str, dict: &str, numbers: &[u8]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file(format!("{name}.npy"), SimpleFileOptions::default()).expect("started");
    zip.write_all(b"\x93NUMPY\x01\x00").expect("written");
    zip.write_all(&(dict.len() as u16).to_le_bytes()).expect("written");
    zip.write_all(dict.as_bytes()).expect("written");
    zip.write_all(numbers).expect("written");
    zip.finish().expect("finished").into_inner()
}

/// Returns the first place of `pattern`.
fn find(bytes: &[u8], pattern: &[u8]) -> usize {
    bytes.windows(pattern.len()).position(|window| window == pattern).expect("it is there")
}

#[test]
fn a_shape_beyond_the_bytes_takes_no_memory() {
    let dict = "{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000, 4), }";
    let bytes = packed("huge", dict, &[]);
    let mut npz = NpzReader::new(&bytes).expect("an archive");
    let said = npz.read::<f64, Ix2>("huge").unwrap_err().to_string();
    assert_eq!(said, "0 bytes of numbers do not fit the shape [10000000000, 4]");
}

#[test]
fn a_stated_length_beyond_the_compressed_bytes_takes_no_memory() {
    let dict = "{'descr': '|u1', 'fortran_order': False, 'shape': (60000000,), }";
    let mut bytes = packed("false", dict, &[0; 100]);
    let entry = find(&bytes, b"PK\x01\x02");
    let length = (PREAMBLE + dict.len() + 60_000_000) as u32;
    bytes[entry + 24..entry + 28].copy_from_slice(&length.to_le_bytes());
    let mut npz = NpzReader::new(&bytes).expect("an archive");
    let said = npz.read::<u8, Ix1>("false").unwrap_err().to_string();
    assert_eq!(said, "the array has fewer bytes than it states");
}

#[test]
fn an_archive_that_expands_beyond_the_limits_is_refused() {
    let zeros = vec![0; MAX_BYTES + 1];
    let length = zeros.len();
    let dict = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({length},), }}");
    let bytes = packed("bomb", &dict, &zeros);
    assert!(bytes.len() < 100_000, "{}", bytes.len());
    let mut npz = NpzReader::new(&bytes).expect("an archive");
    let said = npz.read::<u8, Ix1>("bomb").unwrap_err().to_string();
    assert!(said.ends_with("expected at most 67108864"), "{said}");
    // The same array, read again and again, counts every time.
    let dict = "{'descr': '|u1', 'fortran_order': False, 'shape': (60000000,), }";
    let bytes = packed("large", dict, &zeros[..60_000_000]);
    let mut npz = NpzReader::new(&bytes).expect("an archive");
    assert_eq!(npz.read::<u8, Ix1>("large").expect("the first time").len(), 60_000_000);
    assert!(matches!(npz.read::<u8, Ix1>("large"), Err(NpzError::Array { .. })));
}

#[test]
fn a_directory_of_too_many_double_or_missing_members_is_refused() {
    let said = |bytes: &[u8]| NpzReader::new(bytes).err().expect("damaged").to_string();
    let sound = archive();
    let end = sound.len() - 22;
    let mut many = sound.clone();
    many[end + 10..end + 12].copy_from_slice(&60_000u16.to_le_bytes());
    assert!(said(&many).ends_with("it has 60000 members; expected at most 4096"));
    let mut more = sound.clone();
    more[end + 10] = 4;
    assert!(said(&more).ends_with("its directory ends too early"));
    let mut double = sound.clone();
    let other = sound.len() - sound[..].windows(5).rev().position(|w| w == b"plane").expect("") - 5;
    double[other..other + 5].copy_from_slice(b"empty");
    assert!(said(&double).ends_with("it has two members called `empty.npy`"));
    // Every place could be the end of a directory of one entry that is not there.
    let mut hostile = b"PK\x05\x06\0\0\0\0\x01\0\x01\0\0\0\0\0\0\0\0\0\0\0".repeat(200_000);
    let length = hostile.len();
    hostile[length - 2..].fill(0);
    assert!(said(&hostile).ends_with("its directory ends too early"));
}

#[test]
fn damaged_bytes_of_an_array_are_noticed() {
    let numbers: Vec<u8> = (0..200u8).collect();
    let dict = "{'descr': '|u1', 'fortran_order': False, 'shape': (200,), }";
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    zip.start_file("stored.npy", stored).expect("started");
    let mut array = b"\x93NUMPY\x01\x00".to_vec();
    array.extend((dict.len() as u16).to_le_bytes());
    array.extend(dict.bytes());
    array.extend(numbers);
    zip.write_all(&array).expect("written");
    let mut bytes = zip.finish().expect("finished").into_inner();
    let read = |bytes: &[u8]| NpzReader::new(bytes).expect("an archive").read::<u8, Ix1>("stored");
    assert_eq!(read(&bytes).expect("sound").len(), 200);
    let at = find(&bytes, &[100, 101, 102]);
    bytes[at] = 0;
    assert_eq!(read(&bytes).unwrap_err().to_string(), "the bytes of the array are damaged");
}
