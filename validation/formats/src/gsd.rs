//! GSD, the binary trajectories of HOOMD-blue: a header, a list of names, an index and the data, as its specification (version 2.0)
//! and its schema `hoomd` (1.4) have them.
//!
//! The index has room for all frames from the start, so that a file grows by a frame at its end, and a file that was cut in
//! the middle of a frame is continued. Numbers are those of the schema: single precision. The box is centred at the
//! origin, so positions are shifted by the middle of the box.

use super::configuration::{Configuration, domain};
use super::files::{create_inside, draft_inside, open_inside_to_write};
use super::{FormatError, Frame, PathError};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;

/// The names of the chunks. A chunk has the number of its name, and each frame lists them in this order, as readers expect.
const NAMES: [&str; 10] = [
    "configuration/step",
    "configuration/box",
    "particles/position",
    "particles/velocity",
    "log/time",
    // The others are in the first frame only; readers take them from there.
    "configuration/dimensions",
    "particles/N",
    "particles/types",
    "particles/typeid",
    "particles/mass",
];
/// The number of chunks of a frame after the first.
const LATER: u64 = 5;

const MAGIC: u64 = 0x65DF_65DF_65DF_65DF;
const HEADER: u64 = 256;
/// Bytes of a name in the list.
const NAME: u64 = 64;
const INDEX: u64 = HEADER + NAMES.len() as u64 * NAME;
/// Bytes of an entry of the index.
const ENTRY: u64 = 32;

/// A chunk of data: the number of its rows and columns, the type of its numbers with their size, and their bytes.
struct Chunk {
    rows: u64,
    columns: u32,
    kind: u8,
    bytes: Vec<u8>,
}

impl Chunk {
    fn new<const B: usize>(kind: u8, columns: usize, numbers: impl Iterator<Item = [u8; B]>) -> Chunk {
        let bytes: Vec<u8> = numbers.flatten().collect();
        Chunk { rows: (bytes.len() / (B * columns)) as u64, columns: columns as u32, kind, bytes }
    }

    fn bytes(numbers: impl Iterator<Item = u8>) -> Chunk {
        Chunk::new(1, 1, numbers.map(|x| [x]))
    }

    fn integers(numbers: impl Iterator<Item = u32>) -> Chunk {
        Chunk::new(3, 1, numbers.map(u32::to_le_bytes))
    }

    fn singles(columns: usize, numbers: impl Iterator<Item = f64>) -> Chunk {
        Chunk::new(9, columns, numbers.map(|x| (x as f32).to_le_bytes()))
    }
}

/// The number of entries of the index after some frames.
fn entries(frames: u64) -> u64 {
    match frames {
        0 => 0,
        _ => NAMES.len() as u64 + LATER * (frames - 1),
    }
}

/// A GSD file that grows by frames. Every frame must have the same particles.
#[derive(Debug)]
pub struct GsdFile {
    file: File,
    frames: u64,
    /// The most frames that the index has room for.
    most: u64,
    /// The end of the data of these frames.
    end: u64,
}

impl GsdFile {
    /// Creates a file in the folder of a run, which must not exist, without frames and with room for `most` of them.
    pub fn create(path: &Path, most: u64) -> io::Result<GsdFile> {
        let file = create_inside(path)?;
        let end = INDEX + ENTRY * entries(most);
        let mut head = Vec::new();
        for number in [MAGIC, INDEX, entries(most), HEADER, NAMES.len() as u64] {
            head.extend(number.to_le_bytes());
        }
        // The versions of the schema and of the format.
        head.extend([(1u32 << 16) | 4, 2u32 << 16].map(u32::to_le_bytes).concat());
        for text in [concat!("psidpd ", env!("CARGO_PKG_VERSION")), "hoomd"] {
            head.extend(text.bytes().chain(std::iter::repeat(0)).take(64));
        }
        head.resize(HEADER as usize, 0);
        for name in NAMES {
            // In this version of the format names follow each other.
            head.extend(name.bytes().chain([0]));
        }
        file.write_all_at(&head, 0)?;
        file.set_len(end)?;
        Ok(GsdFile { file, frames: 0, most, end })
    }

    /// Opens a file to continue it after its first `frames` frames to `most` of them, and removes the others.
    pub fn reopen(path: &Path, frames: u64, most: u64) -> io::Result<GsdFile> {
        let wrong = |what: &str| io::Error::new(ErrorKind::InvalidData, what.to_owned());
        let file = open_inside_to_write(path)?;
        let number = |at: u64| -> io::Result<u64> {
            let mut bytes = [0; 8];
            file.read_exact_at(&mut bytes, at)?;
            Ok(u64::from_le_bytes(bytes))
        };
        let length = file.metadata()?.len();
        let room = number(16)?;
        let index_end = room.checked_mul(ENTRY).and_then(|size| size.checked_add(INDEX));
        if number(0)? != MAGIC || number(8)? != INDEX || index_end.is_none_or(|end| end > length) {
            return Err(wrong("it is not the GSD file of this run"));
        }
        let kept = entries(frames);
        let mut end = INDEX + ENTRY * room;
        if let Some(last) = kept.checked_sub(1) {
            // `log/time`, one double, or the masses, in single precision.
            let at = INDEX + ENTRY * last;
            let size = if frames == 1 { 4 } else { 8 };
            let found = kept <= room && number(at)? == frames - 1;
            let last =
                number(at + 8)?.checked_mul(size).and_then(|size| size.checked_add(number(at + 16).ok()?));
            match last.filter(|last| found && (end..=length).contains(last)) {
                Some(last) => end = last,
                None => return Err(wrong(&format!("it has fewer than {frames} frames"))),
            }
        }
        // Entries follow each other, and no entry is zero: behind a block of zeros there are no more.
        let (mut at, index_end) = (INDEX + ENTRY * kept, INDEX + ENTRY * room);
        while at < index_end {
            let mut block = vec![0; (index_end - at).min(1 << 16) as usize];
            file.read_exact_at(&mut block, at)?;
            if block.iter().all(|byte| *byte == 0) {
                break;
            }
            block.fill(0);
            file.write_all_at(&block, at)?;
            at += block.len() as u64;
        }
        file.set_len(end)?;
        let found =
            GsdFile { file, frames, most: (room + LATER).saturating_sub(NAMES.len() as u64) / LATER, end };
        if found.most < most { found.widened(path, most) } else { Ok(found) }
    }

    /// Replaces the file by one whose index has room for more frames.
    fn widened(self, path: &Path, most: u64) -> io::Result<GsdFile> {
        let data = INDEX + ENTRY * entries(self.most);
        let shift = ENTRY * (entries(most) - entries(self.most));
        let mut head = vec![0; (INDEX + ENTRY * entries(self.frames)) as usize];
        self.file.read_exact_at(&mut head, 0)?;
        head[16..24].copy_from_slice(&entries(most).to_le_bytes());
        for entry in head[INDEX as usize..].chunks_exact_mut(ENTRY as usize) {
            let mut place = [0; 8];
            place.copy_from_slice(&entry[16..24]);
            entry[16..24].copy_from_slice(&(u64::from_le_bytes(place) + shift).to_le_bytes());
        }
        let mut draft = draft_inside(path)?;
        draft.write_all(&head)?;
        draft.seek(SeekFrom::Start(data + shift))?;
        (&self.file).seek(SeekFrom::Start(data))?;
        io::copy(&mut (&self.file).take(self.end - data), &mut draft)?;
        draft.finish(true)?;
        let (file, end) = (open_inside_to_write(path)?, self.end + shift);
        file.set_len(end)?;
        Ok(GsdFile { file, most, end, ..self })
    }

    /// Writes a frame, with the masses of its species. Particles keep their order. Unknown velocities are written as 0.
    pub fn write(&mut self, frame: &Frame, masses: &[f64]) -> io::Result<()> {
        let wrong = |what: &str| io::Error::new(ErrorKind::InvalidInput, what.to_owned());
        if self.frames == self.most {
            return Err(wrong("the index is full"));
        }
        let chunks = chunks(frame, masses, self.frames == 0).ok_or_else(|| {
            wrong("GSD needs a box with its first edge along x and its second in the plane of x and y")
        })?;
        let mut data = Vec::new();
        let mut index = Vec::new();
        for (name, chunk) in chunks.iter().enumerate() {
            index.extend(self.frames.to_le_bytes());
            index.extend(chunk.rows.to_le_bytes());
            index.extend((self.end + data.len() as u64).to_le_bytes());
            index.extend(chunk.columns.to_le_bytes());
            index.extend((name as u16).to_le_bytes());
            index.extend([chunk.kind, 0]);
            data.extend(&chunk.bytes);
        }
        // The index comes last: without it the data do not count.
        self.file.write_all_at(&data, self.end)?;
        self.file.write_all_at(&index, INDEX + ENTRY * entries(self.frames))?;
        self.end += data.len() as u64;
        self.frames += 1;
        Ok(())
    }

    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }
}

/// Whether the first bytes of a file are those of GSD.
pub(super) fn is_gsd(start: &[u8]) -> bool {
    start.starts_with(&MAGIC.to_le_bytes())
}

/// An entry of the index.
struct Entry {
    rows: u64,
    place: u64,
    columns: u32,
}

/// Reads a frame of a file that [`GsdFile`] wrote: the one with a number, counted from 0, or the last complete one; `None` if
/// the file does not have it. The box is centred at the origin, and periodic, except along z in two dimensions: the format has
/// no more.
pub(super) fn read_gsd(
    path: &Path,
    file: &File,
    which: Option<usize>,
) -> Result<Option<Configuration>, FormatError> {
    let wrong = |what: &str| FormatError::content(path)(what);
    let length = file.metadata().map_err(PathError::at("read", path))?.len();
    // Sizes in a file are not trusted: nothing is larger than the file.
    let read = |at: u64, size: u64| -> Result<Vec<u8>, FormatError> {
        if at.checked_add(size).is_none_or(|end| end > length) {
            return Err(wrong("the file ends within a frame"));
        }
        let mut bytes = vec![0; size as usize];
        file.read_exact_at(&mut bytes, at).map_err(PathError::at("read", path))?;
        Ok(bytes)
    };
    let head = read(0, INDEX.min(length))?;
    let names: Vec<u8> = NAMES.iter().flat_map(|name| name.bytes().chain([0])).collect();
    if !head.get(HEADER as usize..).is_some_and(|list| list.starts_with(&names)) || long(&head, 8) != INDEX {
        return Err(wrong("this is a GSD file of another program; psidpd reads only its own"));
    }
    let room = long(&head, 16);
    if room.checked_mul(ENTRY).and_then(|size| size.checked_add(INDEX)).is_none_or(|end| end > length) {
        return Err(wrong("the file ends within its index"));
    }
    let entry = |frame: u64, name: u64| -> Result<Option<Entry>, FormatError> {
        // A number of a frame that no file has room for.
        let Some(at) =
            frame.checked_mul(ENTRY * LATER).map(|_| entries(frame) + name).filter(|at| *at < room)
        else {
            return Ok(None);
        };
        let bytes = read(INDEX + ENTRY * at, ENTRY)?;
        let columns = u32::from_le_bytes([bytes[24], bytes[25], bytes[26], bytes[27]]);
        let found = Entry { rows: long(&bytes, 8), place: long(&bytes, 16), columns };
        Ok((found.place != 0).then_some(found))
    };
    let is_complete = |frame: u64| -> Result<bool, FormatError> {
        let last = if frame == 0 { NAMES.len() as u64 } else { LATER } - 1;
        Ok(entry(frame, last)?.is_some())
    };
    let frame = match which {
        Some(number) => number as u64,
        None => {
            let mut count = 0;
            while is_complete(count)? {
                count += 1;
            }
            count.saturating_sub(1)
        }
    };
    if !is_complete(frame)? {
        return Ok(None);
    }
    let chunk = |frame: u64, name: &str, size: u64| -> Result<(Vec<u8>, u32), FormatError> {
        let number = NAMES.iter().position(|known| *known == name).unwrap_or(0) as u64;
        let Entry { rows, place, columns } =
            entry(frame, number)?.ok_or_else(|| wrong("the file ends within a frame"))?;
        let bytes = rows.checked_mul(u64::from(columns)).and_then(|n| n.checked_mul(size));
        Ok((read(place, bytes.unwrap_or(u64::MAX))?, columns))
    };
    let singles = |frame: u64, name: &str| -> Result<Vec<f64>, FormatError> {
        let (bytes, _) = chunk(frame, name, 4)?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect())
    };
    let vectors = |frame: u64, name: &str| -> Result<Vec<[f64; 3]>, FormatError> {
        Ok(singles(frame, name)?.as_chunks::<3>().0.to_vec())
    };
    let (x, v) = (vectors(frame, "particles/position")?, vectors(frame, "particles/velocity")?);
    let flat = chunk(0, "configuration/dimensions", 1)?.0 == [2];
    let shape = singles(frame, "configuration/box")?;
    let [lx, ly, lz, xy, xz, yz] = shape[..] else { return Err(wrong("the box is not six numbers")) };
    let lz = if flat { 1.0 } else { lz };
    let (xy, xz, yz) = (xy * ly, xz * lz, yz * lz);
    let low = [-0.5 * (lx + xy + xz), -0.5 * (ly + yz), -0.5 * lz];
    let high = [low[0] + lx, low[1] + ly, low[2] + lz];
    let domain =
        domain(low, high, Some([xy, xz, yz]), [true, true, !flat]).map_err(FormatError::content(path))?;
    let (types, width) = chunk(0, "particles/types", 1)?;
    let name_of =
        |row: &[u8]| String::from_utf8_lossy(row.split(|b| *b == 0).next().unwrap_or(row)).into_owned();
    let names: Vec<String> = types.chunks(width.max(1) as usize).map(name_of).collect();
    let species = chunk(0, "particles/typeid", 4)?.0;
    let species: Vec<i32> = species.as_chunks::<4>().0.iter().map(|b| i32::from_le_bytes(*b)).collect();
    let known = |s: &i32| usize::try_from(*s).is_ok_and(|s| s < names.len());
    if species.len() != x.len() || v.len() != x.len() || !species.iter().all(known) {
        return Err(wrong("a frame does not have a species and a velocity for each particle"));
    }
    if x.iter().flatten().any(|c| !c.is_finite()) {
        return Err(wrong("a position is not finite"));
    }
    let (step, time) = (chunk(frame, "configuration/step", 8)?.0, chunk(frame, "log/time", 8)?.0);
    Ok(Some(Configuration {
        step: (step.len() == 8).then(|| long(&step, 0)),
        time: (time.len() == 8).then(|| f64::from_bits(long(&time, 0))),
        dimensions: if flat { 2 } else { 3 },
        domain,
        names,
        tag: (1..=x.len() as i32).collect(),
        v: Some(v),
        x,
        species,
    }))
}

/// The number of eight bytes at a place; 0 beyond the end.
fn long(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// The chunks of a frame in the order of [`NAMES`]; `None` for a box that the format cannot hold.
fn chunks(frame: &Frame, masses: &[f64], first: bool) -> Option<Vec<Chunk>> {
    let [a, b, c] = [0, 1, 2].map(|k| frame.domain.edge(k));
    if [a[1], a[2], b[2]] != [0.0; 3] {
        return None;
    }
    let flat = frame.dimensions == 2;
    let middle = frame.domain.point([0.5; 3]);
    let height = if flat { 0.0 } else { c[2] };
    let shape = [a[0], b[1], height, b[0] / b[1], c[0] / c[2], c[1] / c[2]];
    let x =
        frame.x.iter().flat_map(|x| (0..3).map(move |k| if flat && k == 2 { 0.0 } else { x[k] - middle[k] }));
    let v = (0..frame.len()).flat_map(|k| frame.v.map_or([0.0; 3], |v| v[k]));
    let mut chunks = vec![
        Chunk::new(4, 1, [frame.step.to_le_bytes()].into_iter()),
        Chunk::singles(1, shape.into_iter()),
        Chunk::singles(3, x),
        Chunk::singles(3, v),
        Chunk::new(10, 1, [frame.time.to_le_bytes()].into_iter()),
    ];
    if first {
        let width = frame.names.iter().map(|name| name.len() + 1).max().unwrap_or(1);
        let names = frame.names.iter().flat_map(|name| name.bytes().chain(std::iter::repeat(0)).take(width));
        chunks.extend([
            Chunk::bytes([frame.dimensions as u8].into_iter()),
            Chunk::integers([frame.len() as u32].into_iter()),
            Chunk::new(5, width, names.map(|x| [x])),
            Chunk::integers(frame.species.iter().map(|s| *s as u32)),
            Chunk::singles(1, frame.species.iter().map(|s| masses[*s as usize])),
        ]);
    }
    Some(chunks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use psidpd_core::engine::PeriodicBox;

    fn frame<'a>(step: u64, domain: &'a PeriodicBox, names: &'a [String], x: &'a [[f64; 3]]) -> Frame<'a> {
        let (species, tag) = (&[0, 1][..], &[1, 2][..]);
        Frame { step, time: 0.1 * step as f64, dimensions: 3, domain, names, x, v: Some(x), species, tag }
    }

    /// A file that was cut after any byte, or has later frames, ends in the same bytes; one that lacks frames is refused.
    #[test]
    fn a_file_is_continued_to_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.gsd");
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0, 5.0, 6.0], [true; 3]).unwrap();
        let names = ["A".to_owned(), "long".to_owned()];
        let x = [[0.5, 1.0, 2.0], [3.0, 0.25, 5.5]];
        let write = |file: &mut GsdFile, steps: std::ops::Range<u64>| {
            steps.for_each(|step| file.write(&frame(step, &domain, &names, &x), &[1.0, 2.0]).unwrap());
        };
        let mut file = GsdFile::create(&path, 4).unwrap();
        write(&mut file, 0..4);
        assert!(file.write(&frame(4, &domain, &names, &x), &[1.0, 2.0]).is_err());
        let whole = std::fs::read(&path).unwrap();
        // Of more frames it becomes the file that had room for them from the start.
        let longer = folder.path().join("longer.gsd");
        write(&mut GsdFile::create(&longer, 9).unwrap(), 0..9);
        for kept in 0..=4 {
            std::fs::write(&path, &whole).unwrap();
            write(&mut GsdFile::reopen(&path, kept, 9).unwrap(), kept..9);
            assert!(std::fs::read(&path).unwrap() == std::fs::read(&longer).unwrap(), "{kept}");
        }
        for kept in 0..=4 {
            std::fs::write(&path, &whole).unwrap();
            let mut file = GsdFile::reopen(&path, kept, 4).unwrap();
            let length = std::fs::metadata(&path).unwrap().len();
            assert!(kept == 4 || length < whole.len() as u64);
            write(&mut file, kept..4);
            assert_eq!(std::fs::read(&path).unwrap(), whole);
            // The data of a frame may be cut; what is there before suffices.
            std::fs::write(&path, &whole[..length as usize]).unwrap();
            write(&mut GsdFile::reopen(&path, kept, 4).unwrap(), kept..4);
            assert_eq!(std::fs::read(&path).unwrap(), whole);
            std::fs::write(&path, &whole[..length as usize - 1]).unwrap();
            assert!(GsdFile::reopen(&path, kept, 4).is_err(), "{kept}");
        }
        std::fs::remove_file(&path).unwrap();
        let mut file = GsdFile::create(&path, 4).unwrap();
        write(&mut file, 0..2);
        assert!(GsdFile::reopen(&path, 3, 4).is_err() && GsdFile::reopen(&path, 5, 4).is_err());
        std::fs::write(&path, "not a trajectory, though as long as the header of one").unwrap();
        assert!(GsdFile::reopen(&path, 0, 4).is_err());
    }

    /// The numbers of a chunk of the first frame, as the specification has them: the index names the place of each.
    fn singles(file: &[u8], name: &str) -> Vec<f32> {
        let number = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize;
        let place = number(8) + 32 * NAMES.iter().position(|n| *n == name).unwrap();
        let columns = u32::from_le_bytes(file[place + 24..place + 28].try_into().unwrap()) as usize;
        let (start, count) = (number(place + 16), number(place + 8) * columns);
        let bytes = &file[start..start + 4 * count];
        bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    /// A tilted box and a tilted plane whose numbers are all different and exact in single precision: lengths, then xy, xz and yz,
    /// each the tilt over the height of its edge. Positions are those from the middle of the box; a plane has no height.
    #[test]
    fn boxes_are_those_of_the_schema() {
        let edges = Matrix3::new(8.0, 2.0, 4.0, 0.0, 4.0, 2.0, 0.0, 0.0, 16.0);
        let domain = PeriodicBox::new([1.0, -2.0, 3.0], edges, [true; 3]).unwrap();
        // From the origin and the three edges: 1 + (8 + 2 + 4)/2, -2 + (4 + 2)/2 and 3 + 16/2.
        let middle = [8.0, 1.0, 11.0];
        let flat_edges = Matrix3::new(8.0, 1.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 1.0);
        let flat = PeriodicBox::new([1.0, -2.0, 0.0], flat_edges, [true; 3]).unwrap();
        let names = ["A".to_owned(), "B".to_owned()];
        let (x, v) = ([[7.5, 1.5, 9.0], [3.0, -1.0, 11.5]], [[0.25, -0.5, 0.75], [1.25, 1.5, -1.75]]);
        let expected = |dimensions: usize, middle: [f64; 3]| -> Vec<f32> {
            let part = |x: &[f64; 3]| -> [f32; 3] {
                std::array::from_fn(|k| if k < dimensions { (x[k] - middle[k]) as f32 } else { 0.0 })
            };
            x.iter().flat_map(part).collect()
        };
        let folder = tempfile::tempdir().unwrap();
        for (dimensions, domain, middle, shape) in [
            (3, &domain, middle, [8.0f32, 4.0, 16.0, 0.5, 0.25, 0.125]),
            (2, &flat, [5.5, 0.0, 0.0], [8.0, 4.0, 0.0, 0.25, 0.0, 0.0]),
        ] {
            let path = folder.path().join(format!("{dimensions}.gsd"));
            let frame = Frame { dimensions, v: Some(&v), ..frame(0, domain, &names, &x) };
            GsdFile::create(&path, 1).unwrap().write(&frame, &[1.0, 2.5]).unwrap();
            let file = std::fs::read(&path).unwrap();
            assert_eq!(singles(&file, "configuration/box"), shape, "{dimensions}");
            assert_eq!(singles(&file, "particles/position"), expected(dimensions, middle), "{dimensions}");
            let fast: Vec<f32> = v.iter().flatten().map(|v| *v as f32).collect();
            assert_eq!(singles(&file, "particles/velocity"), fast, "{dimensions}");
            assert_eq!(singles(&file, "particles/mass"), [1.0f32, 2.5], "{dimensions}");
        }
    }

    /// A frame comes back in single precision, about the middle of the box; a file that was cut or has wrong sizes is an
    /// error or lacks the frame, at whatever byte.
    #[test]
    fn frames_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.gsd");
        let edges = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -0.25, 0.0, 0.0, 6.0);
        let domain = PeriodicBox::new([1.0, 2.0, 3.0], edges, [true; 3]).unwrap();
        let names = ["A".to_owned(), "long".to_owned()];
        let x = [[1.5, 3.0, 5.0], [3.0, 2.25, 8.5]];
        let mut file = GsdFile::create(&path, 4).unwrap();
        (0..3).for_each(|step| file.write(&frame(step, &domain, &names, &x), &[1.0, 2.0]).unwrap());
        drop(file);
        let middle = domain.point([0.5; 3]);
        for (number, step) in [(None, 2), (Some(0), 0), (Some(1), 1), (Some(2), 2)] {
            let read = Configuration::open(&path, number).unwrap();
            assert_eq!((read.step, read.time, read.dimensions), (Some(step), Some(0.1 * step as f64), 3));
            assert_eq!((&read.names[..], &read.species[..], read.tag.len()), (&names[..], &[0, 1][..], 2));
            for (found, real) in read.x.iter().zip(&x) {
                assert!((0..3).all(|k| (found[k] - real[k] + middle[k]).abs() < 1e-6), "{found:?}");
            }
            let same = |k: usize| (0..3).all(|c| (read.domain.edge(k)[c] - domain.edge(k)[c]).abs() < 1e-6);
            assert!((0..3).all(same) && read.v.as_deref().is_some_and(|v| (v[1][2] - 8.5).abs() < 1e-6));
        }
        assert_eq!(Configuration::count(&path).unwrap(), 3);
        let error = Configuration::open(&path, Some(3)).unwrap_err().to_string();
        assert!(error.contains("no frame 3; the first one is 0, the last one 2"), "{error}");
        assert!(Configuration::open(&path, Some(usize::MAX)).is_err());

        let whole = std::fs::read(&path).unwrap();
        for length in (0..whole.len()).step_by(7) {
            std::fs::write(&path, &whole[..length]).unwrap();
            let _ = Configuration::open(&path, None);
        }
        // A wrong size in the index.
        for at in (0..whole.len().min(2500)).step_by(3) {
            let mut wrong = whole.clone();
            wrong[at..(at + 8).min(whole.len())].fill(0xFE);
            std::fs::write(&path, &wrong).unwrap();
            let _ = Configuration::open(&path, None);
        }
        let mut other = whole;
        other[HEADER as usize..HEADER as usize + 8].copy_from_slice(b"whatever");
        std::fs::write(&path, &other).unwrap();
        let error = Configuration::open(&path, None).unwrap_err().to_string();
        assert!(error.contains("another program"), "{error}");
    }

    #[test]
    fn a_box_that_leans_otherwise_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = GsdFile::create(&folder.path().join("t.gsd"), 1).unwrap();
        let edges = Matrix3::new(4.0, 0.0, 0.0, 1.0, 4.0, 0.0, 0.0, 0.0, 4.0);
        let domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
        let names = ["A".to_owned(), "B".to_owned()];
        assert!(file.write(&frame(0, &domain, &names, &[[0.0; 3]; 2]), &[1.0, 1.0]).is_err());
    }
}
