//! Rows of numbers as text, written in blocks: with a call of the file for every number, most of the time of a frame would be calls.

use std::io::{self, Write};

/// Bytes after which a block is written.
const BLOCK: usize = 1 << 16;

/// Writes rows of words and numbers with one blank between them.
pub struct Rows<'a, W> {
    out: &'a mut W,
    block: Vec<u8>,
}

impl<'a, W: Write> Rows<'a, W> {
    pub fn new(out: &'a mut W) -> Self {
        Rows { out, block: Vec::with_capacity(BLOCK + 1024) }
    }

    pub fn word(&mut self, word: &str) {
        self.block.extend_from_slice(word.as_bytes());
        self.block.push(b' ');
    }

    pub fn whole(&mut self, number: impl itoa::Integer) {
        self.word(itoa::Buffer::new().format(number));
    }

    /// The shortest digits from which the same number is read.
    pub fn number(&mut self, number: f64) {
        self.word(zmij::Buffer::new().format(number));
    }

    /// Ends a row.
    pub fn end(&mut self) -> io::Result<()> {
        if let Some(last) = self.block.last_mut() {
            *last = b'\n';
        }
        if self.block.len() > BLOCK { self.write() } else { Ok(()) }
    }

    /// Writes what is left.
    pub fn finish(mut self) -> io::Result<()> {
        self.write()
    }

    fn write(&mut self) -> io::Result<()> {
        self.out.write_all(&self.block)?;
        self.block.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of several blocks are those that the standard library writes, and their numbers are read back to the last bit.
    #[test]
    fn rows_are_whole_and_exact() {
        let value = |k: u32| (f64::from(k) * 0.7).sin() * 10f64.powi(k as i32 % 40 - 20);
        let mut written = Vec::new();
        let mut rows = Rows::new(&mut written);
        for k in 0..9000 {
            rows.whole(k);
            rows.word("F");
            rows.number(value(k));
            rows.number(-0.0);
            rows.end().unwrap();
        }
        rows.finish().unwrap();
        assert!(written.len() > 3 * BLOCK);
        let text = String::from_utf8(written).unwrap();
        for (k, line) in (0..).zip(text.lines()) {
            let words: Vec<&str> = line.split(' ').collect();
            assert_eq!((words.len(), words[0], words[1]), (4, k.to_string().as_str(), "F"));
            let read = [words[2], words[3]].map(|word| word.parse::<f64>().unwrap().to_bits());
            assert_eq!(read, [value(k), -0.0].map(f64::to_bits), "{line}");
        }
        assert_eq!(text.lines().count(), 9000);
    }
}
