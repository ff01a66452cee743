//! A scanner for words, numbers and binary values in a file, which reports the position of errors.

use std::fmt::Display;
use std::path::Path;

use glam::DVec3;

use crate::{Error, Result};

/// A cursor in the bytes of a file. Words are separated by white space; comments count as white space.
pub struct Scanner<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    /// The index of the next byte.
    cursor: usize,
    /// The index of the latest word or value, for error messages.
    latest: usize,
    /// The byte that begins a comment, which ends with its line.
    comment: Option<u8>,
    /// If true, errors report the byte offset instead of the line.
    pub binary: bool,
}

impl<'a> Scanner<'a> {
    pub fn new(path: &'a Path, bytes: &'a [u8]) -> Self {
        Scanner {
            path,
            bytes,
            cursor: 0,
            latest: 0,
            comment: None,
            binary: false,
        }
    }

    /// Sets the byte that begins a comment.
    pub fn comments_begin_with(mut self, byte: u8) -> Self {
        self.comment = Some(byte);
        self
    }

    /// An error at the latest word or value.
    pub fn fail(&self, message: impl Display) -> Error {
        self.fail_at(self.latest, message)
    }

    /// An error at an earlier [`Scanner::position`].
    pub fn fail_at(&self, position: usize, message: impl Display) -> Error {
        let path = self.path.display();
        if self.binary {
            return Error::Io(format!("{path}: byte {position}: {message}"));
        }
        let before = self.bytes.get(..position).unwrap_or(self.bytes);
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::Io(format!("{path}: line {line}: {message}"))
    }

    /// The index of the latest word or value.
    pub fn position(&self) -> usize {
        self.latest
    }

    /// The whole file.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The number of bytes left.
    pub fn remaining(&self) -> usize {
        self.bytes.len() - self.cursor
    }

    /// Reads the next word; `None` at the end of the file.
    pub fn next_word(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        self.latest = self.cursor;
        let rest = self.bytes.get(self.cursor..)?;
        let in_word = |byte: &&u8| !byte.is_ascii_whitespace() && self.comment != Some(**byte);
        let length = rest.iter().take_while(in_word).count();
        self.cursor += length;
        rest.get(..length).filter(|word| !word.is_empty())
    }

    /// Skips white space and comments.
    fn skip_space(&mut self) {
        while let Some(&byte) = self.bytes.get(self.cursor) {
            if byte.is_ascii_whitespace() {
                self.cursor += 1;
            } else if self.comment == Some(byte) {
                self.line();
            } else {
                break;
            }
        }
    }

    /// Returns the next word without reading it.
    pub fn peek_word(&mut self) -> Option<&'a [u8]> {
        let (cursor, latest) = (self.cursor, self.latest);
        let word = self.next_word();
        (self.cursor, self.latest) = (cursor, latest);
        word
    }

    /// Reads the next word. `what` describes it in the error at the end of the file.
    pub fn word(&mut self, what: &str) -> Result<&'a [u8]> {
        self.next_word()
            .ok_or_else(|| self.fail(format!("the file ends where {what} should be")))
    }

    /// Reads a word, which must be `expected`.
    pub fn expect(&mut self, expected: &str) -> Result<()> {
        let word = self.word(&format!("\"{expected}\""))?;
        if !is(word, expected) {
            return Err(self.fail(format!("{} where \"{expected}\" should be", quoted(word))));
        }
        Ok(())
    }

    /// Reads the rest of the line, without the line break.
    pub fn line(&mut self) -> &'a [u8] {
        let rest = self.bytes.get(self.cursor..).unwrap_or_default();
        self.latest = self.cursor;
        let line = rest.split(|&b| b == b'\n').next().unwrap_or(rest);
        self.cursor = (self.cursor + line.len() + 1).min(self.bytes.len());
        line
    }

    /// Skips the end of the line; binary data follow.
    pub fn end_line(&mut self) -> Result<()> {
        let rest = self.line();
        if rest.iter().all(u8::is_ascii_whitespace) {
            return Ok(());
        }
        Err(self.fail(format!("{} where the line should end", quoted(rest))))
    }

    /// Reads a nonnegative integer.
    pub fn integer(&mut self, what: &str) -> Result<u64> {
        let word = self.word(what)?;
        parse(word).ok_or_else(|| self.fail(format!("{} is no {what}", quoted(word))))
    }

    /// Reads a finite number.
    pub fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.word(what)?;
        let number = parse(word).ok_or_else(|| self.fail(format!("{} is no {what}", quoted(word))))?;
        self.finite(number, what)
    }

    /// Reads three finite numbers.
    pub fn point(&mut self) -> Result<DVec3> {
        let what = "coordinate";
        Ok(DVec3::new(self.number(what)?, self.number(what)?, self.number(what)?))
    }

    /// Returns the number, or an error if it is not finite.
    pub fn finite(&self, number: f64, what: &str) -> Result<f64> {
        if number.is_finite() {
            return Ok(number);
        }
        Err(self.fail(format!("{what} {number} is not finite")))
    }

    /// Reads a number of items. Returns an error if the rest of the file is too short for them, with `bytes_each`
    /// bytes at least for an item.
    pub fn count(&mut self, what: &str, bytes_each: usize) -> Result<usize> {
        let count = self.integer(&format!("number of {what}"))?;
        let room = self.remaining() / bytes_each.max(1);
        match usize::try_from(count) {
            Ok(count) if count <= room => Ok(count),
            _ => Err(self.fail(format!("{count} {what}, but the file ends after {room} at most"))),
        }
    }

    /// Reads bytes of a binary file.
    pub fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        self.latest = self.cursor;
        let rest = self.bytes.get(self.cursor..).unwrap_or_default();
        let bytes = rest
            .first_chunk()
            .ok_or_else(|| self.fail(format!("the file ends inside {what}")))?;
        self.cursor += N;
        Ok(*bytes)
    }

    /// Skips bytes of a binary file.
    pub fn skip(&mut self, count: usize, what: &str) -> Result<()> {
        self.latest = self.cursor;
        if count > self.remaining() {
            return Err(self.fail(format!("the file ends inside {what}")));
        }
        self.cursor += count;
        Ok(())
    }

    /// The vertex index for a number in the file, for numbers that begin with `base`.
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

/// True if a word is this keyword, in any case.
pub fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

/// Parses a word.
pub fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word for an error message, shortened if it is long.
pub fn quoted(word: &[u8]) -> String {
    let start = String::from_utf8_lossy(&word[..word.len().min(40)]);
    format!("\"{}\"", start.trim().escape_debug())
}
