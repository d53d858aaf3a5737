//! Mutations of valid files, drawn from a seed.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub struct Mutator {
    pub rng: ChaCha8Rng,
}

/// Numbers that readers tend to handle badly.
const NUMBERS: [&str; 22] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "127",
    "255",
    "65536",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "1e308",
    "-1e308",
    "1e309",
    "1e999",
    "1e-320",
    "0.1",
    "1e18",
    "99999999",
    "NaN",
];

/// Pieces of the formats.
const WORDS: [&str; 34] = [
    "{",
    "}",
    "[",
    "]",
    "(",
    ")",
    ":",
    ",",
    "\"",
    "null",
    "true",
    "{}",
    "[]",
    "\n",
    "\\u0000",
    "\\ud800",
    "\u{feff}",
    "é",
    " ",
    "\t",
    ";",
    "(and ",
    "(not ",
    "(either ",
    " - ",
    "?",
    "=",
    "PK\x01\x02",
    "PK\x05\x06",
    "PK\x03\x04",
    "'shape': (",
    "(1,",
    "'descr': '<f8'",
    "\x00",
];

impl Mutator {
    pub fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    pub fn below(&mut self, bound: usize) -> usize {
        if bound == 0 { 0 } else { self.rng.random_range(0..bound) }
    }

    fn range(&mut self, length: usize, longest: usize) -> std::ops::Range<usize> {
        let from = self.below(length + 1);
        let to = (from + 1 + self.below(longest)).min(length);
        from..to.max(from)
    }

    /// Returns a mutation of `seed`. Pieces of `other` may be inserted.
    pub fn mutate(&mut self, seed: &[u8], other: &[u8]) -> Vec<u8> {
        let mut bytes = seed.to_vec();
        // A single changed number is accepted more often than other mutations, and so reaches what comes after reading.
        if self.below(3) == 0 {
            let number = NUMBERS[self.below(NUMBERS.len())];
            self.replace_number(&mut bytes, number);
            return bytes;
        }
        for _ in 0..1 + self.below(4) {
            self.mutate_once(&mut bytes, other);
        }
        bytes
    }

    fn mutate_once(&mut self, bytes: &mut Vec<u8>, other: &[u8]) {
        let at = self.below(bytes.len());
        match self.below(16) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
            1 if !bytes.is_empty() => bytes[at] = self.rng.random(),
            2 => drop(bytes.drain(self.range(bytes.len(), 40))),
            3 => {
                let piece = bytes[self.range(bytes.len(), 200)].to_vec();
                bytes.splice(at..at, piece);
            }
            4 => {
                let piece = other[self.range(other.len(), 200)].to_vec();
                bytes.splice(at..at, piece);
            }
            5 => bytes.truncate(at),
            6 => {
                let word = WORDS[self.below(WORDS.len())];
                bytes.splice(at..at, word.bytes());
            }
            7 => {
                // Deep nesting and long lists.
                let word = WORDS[self.below(WORDS.len())];
                let times = 1 << self.below(12);
                bytes.splice(at..at, word.repeat(times).bytes());
            }
            8 => {
                let piece = bytes[self.range(bytes.len(), 300)].to_vec();
                let times = 1 + self.below(60);
                bytes.splice(at..at, piece.repeat(times));
            }
            9 => {
                let long = "x".repeat(1 << self.below(14));
                self.replace_string(bytes, &long);
            }
            10 => {
                let word = WORDS[self.below(WORDS.len())];
                self.replace_string(bytes, word);
            }
            11 => {
                let (a, b) = (self.range(bytes.len(), 8), self.below(bytes.len()));
                let piece: Vec<u8> = bytes.drain(a).collect();
                let b = b.min(bytes.len());
                bytes.splice(b..b, piece);
            }
            _ => {
                let number = NUMBERS[self.below(NUMBERS.len())];
                self.replace_number(bytes, number);
            }
        }
    }

    /// Replaces the first number behind a drawn place.
    fn replace_number(&mut self, bytes: &mut Vec<u8>, number: &str) {
        let at = self.below(bytes.len());
        let is_digit = |b: &u8| b.is_ascii_digit() || b".-+eE".contains(b);
        let Some(from) = bytes[at..].iter().position(u8::is_ascii_digit) else { return };
        let from = at + from;
        let length = bytes[from..].iter().take_while(|b| is_digit(b)).count();
        bytes.splice(from..from + length, number.bytes());
    }

    /// Replaces the first string in quotes behind a drawn place.
    fn replace_string(&mut self, bytes: &mut Vec<u8>, text: &str) {
        let at = self.below(bytes.len());
        let Some(from) = bytes[at..].iter().position(|b| *b == b'"') else { return };
        let from = at + from + 1;
        let Some(length) = bytes[from..].iter().position(|b| *b == b'"') else { return };
        bytes.splice(from..from + length, text.bytes());
    }
}
