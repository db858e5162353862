//! The record of what a run has written to a file.

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Read};

/// The length and the CRC-32 of the bytes that a run has written to a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Written {
    pub length: u64,
    /// CRC-32 of the bytes. It reveals edits and damage, not forgery.
    pub checksum: u32,
}

impl Written {
    /// The record of the first `length` bytes of a file, or of all its bytes if there are fewer.
    pub fn of(file: File, length: u64) -> io::Result<Written> {
        let mut file = file.take(length);
        let mut written = Written::default();
        let mut buffer = vec![0; 1 << 20];
        loop {
            match file.read(&mut buffer) {
                Ok(0) => return Ok(written),
                Ok(count) => written.add(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    pub fn add(&mut self, bytes: &[u8]) {
        let mut hasher = Hasher::new_with_initial_len(self.checksum, self.length);
        hasher.update(bytes);
        self.length += bytes.len() as u64;
        self.checksum = hasher.finalize();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_add_up_to_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("f");
        let bytes: Vec<u8> = (0..2_500_000u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        let mut written = Written::default();
        bytes[..2_000_001].chunks(777).for_each(|piece| written.add(piece));
        assert_eq!(written, Written { length: 2_000_001, checksum: crc32fast::hash(&bytes[..2_000_001]) });
        let of = |length| Written::of(File::open(&path).unwrap(), length).unwrap();
        assert_eq!(of(2_000_001), written);
        assert_eq!(of(u64::MAX).length, 2_500_000);
    }
}
