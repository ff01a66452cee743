//! Words, numbers and binary values from the bytes of a file, with the place where something is wrong.

use std::fmt::Display;
use std::path::Path;

use glam::DVec3;

use crate::{Error, Result};

/// A place in the bytes of a file. Words are separated by white space; a comment, where the format has any, is white
/// space too.
pub struct Scanner<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// What is read next.
    at: usize,
    /// Where the latest word or value began: what an error speaks of.
    latest: usize,
    /// The byte that begins a comment up to the end of its line.
    comment: Option<u8>,
    /// Whether errors give the byte instead of the line.
    pub binary: bool,
}

impl<'a> Scanner<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Scanner {
            path,
            bytes,
            at: 0,
            latest: 0,
            comment: None,
            binary: false,
        }
    }

    /// From now on this byte begins a comment.
    pub fn comments_begin_with(mut self, byte: u8) -> Self {
        self.comment = Some(byte);
        self
    }

    /// An error about the latest word or value.
    pub fn fail(&self, message: impl Display) -> Error {
        self.fail_at(self.latest, message)
    }

    /// An error about an earlier [`Scanner::place`].
    pub fn fail_at(&self, place: usize, message: impl Display) -> Error {
        let path = self.path.display();
        if self.binary {
            return Error::Io(format!("{path}: byte {place}: {message}"));
        }
        let before = self.bytes.get(..place).unwrap_or(self.bytes);
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::Io(format!("{path}: line {line}: {message}"))
    }

    /// Where the latest word or value began.
    pub fn place(&self) -> usize {
        self.latest
    }

    /// The whole file.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// How many bytes are left.
    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word, if there is one.
    pub fn next_word(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        self.latest = self.at;
        let rest = self.bytes.get(self.at..)?;
        let in_word = |byte: &&u8| !byte.is_ascii_whitespace() && self.comment != Some(**byte);
        let length = rest.iter().take_while(in_word).count();
        self.at += length;
        rest.get(..length).filter(|word| !word.is_empty())
    }

    /// Moves on to the next word, over white space and comments.
    fn skip_space(&mut self) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if byte.is_ascii_whitespace() {
                self.at += 1;
            } else if self.comment == Some(byte) {
                self.line();
            } else {
                break;
            }
        }
    }

    /// The next word without moving on.
    pub fn peek_word(&mut self) -> Option<&'a [u8]> {
        let (at, latest) = (self.at, self.latest);
        let word = self.next_word();
        (self.at, self.latest) = (at, latest);
        word
    }

    /// The next word; `what` it should be is said where the file ends before.
    pub fn word(&mut self, what: &str) -> Result<&'a [u8]> {
        self.next_word()
            .ok_or_else(|| self.fail(format!("the file ends where {what} should be")))
    }

    /// Exactly this word.
    pub fn expect(&mut self, expected: &str) -> Result<()> {
        let word = self.word(&format!("\"{expected}\""))?;
        if !is(word, expected) {
            return Err(self.fail(format!("{} where \"{expected}\" should be", shown(word))));
        }
        Ok(())
    }

    /// The rest of the line, without its end; moves on to the next line.
    pub fn line(&mut self) -> &'a [u8] {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        self.latest = self.at;
        let line = rest.split(|&b| b == b'\n').next().unwrap_or(rest);
        self.at = (self.at + line.len() + 1).min(self.bytes.len());
        line
    }

    /// The end of the line that the latest word is on: what follows is binary.
    pub fn end_line(&mut self) -> Result<()> {
        let rest = self.line();
        if rest.iter().all(u8::is_ascii_whitespace) {
            return Ok(());
        }
        Err(self.fail(format!("{} where the line should end", shown(rest))))
    }

    /// A whole number.
    pub fn integer(&mut self, what: &str) -> Result<u64> {
        let word = self.word(what)?;
        parse(word).ok_or_else(|| self.fail(format!("{} is no {what}", shown(word))))
    }

    /// A finite number.
    pub fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.word(what)?;
        let number = parse(word).ok_or_else(|| self.fail(format!("{} is no {what}", shown(word))))?;
        self.finite(number, what)
    }

    /// Three finite numbers.
    pub fn point(&mut self) -> Result<DVec3> {
        let what = "coordinate";
        Ok(DVec3::new(self.number(what)?, self.number(what)?, self.number(what)?))
    }

    /// A number, unless it is not finite.
    pub fn finite(&self, number: f64, what: &str) -> Result<f64> {
        if number.is_finite() {
            return Ok(number);
        }
        Err(self.fail(format!("{what} {number} is not finite")))
    }

    /// How many things follow; refused if so many, of that many bytes at least, cannot be left in the file.
    pub fn count(&mut self, what: &str, bytes_each: usize) -> Result<usize> {
        let count = self.integer(&format!("number of {what}"))?;
        let room = self.remaining() / bytes_each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= room => Ok(count),
            _ => Err(self.fail(format!("{count} {what}, but the file ends after {room} at most"))),
        }
    }

    /// The next bytes of a binary file.
    pub fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        self.latest = self.at;
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let taken = rest
            .first_chunk()
            .ok_or_else(|| self.fail(format!("the file ends inside {what}")))?;
        self.at += N;
        Ok(*taken)
    }

    /// Moves over bytes of a binary file.
    pub fn skip(&mut self, count: usize, what: &str) -> Result<()> {
        self.latest = self.at;
        if count > self.remaining() {
            return Err(self.fail(format!("the file ends inside {what}")));
        }
        self.at += count;
        Ok(())
    }

    /// The vertex that a number in the file names, numbers beginning with `base`.
    pub fn vertex(&self, number: u64, base: u64, vertex_count: usize) -> Result<u32> {
        number
            .checked_sub(base)
            .filter(|&vertex| vertex < vertex_count as u64)
            .and_then(|vertex| u32::try_from(vertex).ok())
            .ok_or_else(|| {
                self.fail(format!(
                    "point {number} is not there: there are {vertex_count}, from {base} on"
                ))
            })
    }
}

/// Whether a word is this keyword, in any case.
pub fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

/// The value that a word spells.
pub fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word for a message, shortened if it is long.
pub fn shown(word: &[u8]) -> String {
    let start = String::from_utf8_lossy(&word[..word.len().min(40)]);
    format!("\"{}\"", start.trim().escape_debug())
}
