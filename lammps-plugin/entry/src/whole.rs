//! Checks whether a library is complete: the loader maps a file that was cut short, and crashes when it reads past its end.

use std::io::Read;
use std::path::Path;

/// The least size in bytes that the section table at the end of a library asks for, and the size of the
/// file; None if it is no library for this kind of machine.
pub fn sizes(path: &Path) -> Option<(u64, u64)> {
    let mut head = [0; 64];
    let mut file = std::fs::File::open(path).ok()?;
    let has = file.metadata().ok()?.len();
    if file.read_exact(&mut head).is_err() {
        return Some((64, has));
    }
    if head[..5] != *b"\x7fELF\x02" {
        return None;
    }
    let short = |at: usize| u64::from(u16::from_ne_bytes([head[at], head[at + 1]]));
    let table = u64::from_ne_bytes(*head[40..].first_chunk()?);
    Some((table.saturating_add(short(58) * short(60)), has))
}
