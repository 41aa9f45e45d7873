//! Changes inputs at random, as bytes and as text with numbers, lines and words.

use reef_flow::random::Random;

use crate::random::Choose;

/// Largest input [bytes].
const LARGEST: usize = 1 << 16;

/// Numbers at which programs stumble.
const NUMBERS: &[&str] = &[
    "0",
    "-0.0",
    "1",
    "-1",
    "2",
    "255",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "1e-300",
    "5e-324",
    "1e-9",
    "1e-5",
    "0.1",
    "1e3",
    "1e5",
    "1e15",
    "-1e15",
    "1e300",
    "nan",
    "inf",
    "-inf",
];

/// What is put into texts, apart from numbers.
const PIECES: &[&str] = &[
    "\"",
    "'",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "#",
    "\n",
    "\r\n",
    "\t",
    "\\",
    "\u{feff}",
    "\0",
    "é",
    "\u{202e}",
    "true",
    "null",
    "\"\"\"",
    "1979-05-27",
    "\\u0000",
];

/// Changes an input a few times; `others` are inputs that parts are taken from.
pub fn mutate(input: &[u8], others: &[Vec<u8>], text: bool, random: &mut Random) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=random.below(4) {
        match text && random.below(8) > 0 {
            true => change_text(&mut bytes, others, random),
            false => change_bytes(&mut bytes, others, random),
        }
    }
    bytes.truncate(LARGEST);
    bytes
}

fn change_bytes(bytes: &mut Vec<u8>, others: &[Vec<u8>], random: &mut Random) {
    let at = random.below(bytes.len());
    let end = (at + 1 + random.below(16)).min(bytes.len());
    match random.below(7) {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        1 if !bytes.is_empty() => bytes[at] = random.bits() as u8,
        2 => bytes.truncate(at),
        3 if at < end => drop(bytes.drain(at..end)),
        4 if at < end => {
            let part = bytes[at..end].to_vec();
            bytes.splice(at..at, part);
        }
        5 => {
            // A number of eight, four or two bytes at an end of its range.
            let ends = [0, 1, u64::MAX, i64::MAX as u64, 1 << 32, u64::from(u32::MAX), f64::NAN.to_bits()];
            let value = random.one(&ends).copied().unwrap_or_default().to_le_bytes();
            let width = 1 << (1 + random.below(3));
            for (byte, new) in bytes.iter_mut().skip(at & !(width - 1)).zip(&value[..width]) {
                *byte = *new;
            }
        }
        _ => {
            if let Some(other) = random.one(others) {
                let from = random.below(other.len());
                let to = (from + 1 + random.below(64)).min(other.len());
                bytes.splice(at..at, other.get(from..to).unwrap_or_default().iter().copied());
            }
        }
    }
}

fn change_text(bytes: &mut Vec<u8>, others: &[Vec<u8>], random: &mut Random) {
    match random.below(6) {
        // A number, most of the time: that is where a scene can be wrong and yet be one.
        0..=2 => {
            if let Some((from, to)) = random.one(&numbers(bytes)).copied() {
                let new = match random.below(4) {
                    0 => {
                        let sign = if random.below(8) == 0 { "-" } else { "" };
                        format!("{sign}{:e}", 10_f64.powf(random.unit() * 24.0 - 12.0))
                    }
                    1 => random.below(100).to_string(),
                    _ => random.one(NUMBERS).copied().unwrap_or_default().to_owned(),
                };
                bytes.splice(from..to, new.bytes());
            }
        }
        3 => {
            let piece = random.one(PIECES).copied().unwrap_or_default();
            let at = random.below(bytes.len() + 1);
            bytes.splice(at..at, piece.bytes());
        }
        // A line of another input, or one less.
        4 => {
            let line = random.one(others).and_then(|other| {
                let lines: Vec<&[u8]> = other.split_inclusive(|byte| *byte == b'\n').collect();
                random.one(&lines).map(|line| line.to_vec())
            });
            let at = random.one(&starts(bytes)).copied().unwrap_or(0);
            bytes.splice(at..at, line.unwrap_or_default());
        }
        _ => {
            let starts = starts(bytes);
            let line = random.below(starts.len());
            let (from, to) = (starts[line], starts.get(line + 1).copied().unwrap_or(bytes.len()));
            bytes.drain(from..to);
        }
    }
}

/// Where lines begin.
fn starts(bytes: &[u8]) -> Vec<usize> {
    let ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at + 1);
    std::iter::once(0).chain(ends.filter(|at| *at < bytes.len())).collect()
}

/// Where numbers stand.
fn numbers(bytes: &[u8]) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|b| b.is_ascii_digit() || b".+-eE".contains(b)).count();
        if length > 0 && bytes[at..at + length].iter().any(u8::is_ascii_digit) {
            found.push((at, at + length));
        }
        at += length.max(1);
    }
    found
}
