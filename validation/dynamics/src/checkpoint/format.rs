//! The conversion of a checkpoint to bytes and back.

use super::{Checkpoint, CheckpointError, Written};
use psidpd_formats::memory;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// The version grows whenever [`Checkpoint`] or anything that it holds changes.
pub const VERSION: u32 = 13;

const MAGIC: [u8; 8] = *b"psidpdCK";
const HEADER: usize = 24;

pub fn write<W: Write + Seek>(checkpoint: &Checkpoint, mut to: W) -> io::Result<()> {
    // The header holds the checksum and the length of the payload, so it is written last.
    to.write_all(&[0; HEADER])?;
    let payload = Payload { to: &mut to, written: Written::default(), error: None };
    let mut buffer = BufWriter::with_capacity(1 << 16, payload);
    if let Err(error) = postcard::to_io(checkpoint, &mut buffer) {
        let (payload, _) = buffer.into_parts();
        return Err(payload.error.unwrap_or_else(|| io::Error::other(error)));
    }
    let Written { length, checksum } = buffer.into_inner().map_err(io::IntoInnerError::into_error)?.written;
    to.seek(SeekFrom::Start(0))?;
    to.write_all(&MAGIC)?;
    to.write_all(&VERSION.to_le_bytes())?;
    to.write_all(&checksum.to_le_bytes())?;
    to.write_all(&length.to_le_bytes())
}

/// Counts the bytes of the payload, updates their checksum, and keeps the error that postcard would drop.
struct Payload<W> {
    to: W,
    written: Written,
    error: Option<io::Error>,
}

impl<W: Write> Write for Payload<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.to.write(bytes) {
            Ok(count) => {
                self.written.add(&bytes[..count]);
                Ok(count)
            }
            Err(error) => {
                let kind = error.kind();
                self.error = Some(error);
                Err(kind.into())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

pub fn read(mut file: File, path: &Path) -> Result<Checkpoint, CheckpointError> {
    let mut read = || {
        let length = file.metadata()?.len();
        // The content is about as large as the particles that it becomes.
        memory::fits(2.0 * length as f64, || "reading it needs".to_owned()).map_err(io::Error::other)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map(|_| bytes)
    };
    parse(&read().map_err(CheckpointError::unreadable(path))?, path)
}

/// Reads a checkpoint from memory; messages name `path` as its file.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Checkpoint, CheckpointError> {
    let path = path.to_owned();
    let found = bytes.len() as u64;
    // A run can be killed before the header is written, but such a file never gets its final name. So a file
    // too short for a header was truncated later.
    let Some((header, payload)) = bytes.split_at_checked(HEADER) else {
        return Err(match MAGIC.starts_with(&bytes[..bytes.len().min(MAGIC.len())]) {
            true => CheckpointError::Truncated { path, found, expected: HEADER as u64 },
            false => CheckpointError::Other { path },
        });
    };
    if header[..8] != MAGIC {
        return Err(CheckpointError::Other { path });
    }
    let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
    let (version, checksum) = (word(8), word(12));
    if version != VERSION {
        return Err(CheckpointError::Version { path, found: version });
    }
    let length = u64::from_le_bytes(std::array::from_fn(|k| header[16 + k]));
    if (payload.len() as u64) < length {
        return Err(CheckpointError::Truncated {
            path,
            found,
            expected: length.saturating_add(HEADER as u64),
        });
    }
    let damaged = |what: String| CheckpointError::Damaged { path, what };
    if payload.len() as u64 > length || crc32fast::hash(payload) != checksum {
        return Err(damaged("its checksum does not match".into()));
    }
    postcard::from_bytes(payload).map_err(|e| damaged(e.to_string()))
}
