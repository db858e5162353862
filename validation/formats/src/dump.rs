//! LAMMPS text dumps. The reader takes any `dump custom` and `dump atom`.

use std::io::{self, BufRead, Write};
use std::path::Path;

use super::rows::Rows;
use super::text::{Problem, TextError, any_f64, finite, shown, whole};
use super::{FormatError, PathError};

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    pub step: i64,
    pub time: Option<f64>,
    /// The corners are those of the box, not of the bounding box of a tilted box.
    pub boxlo: [f64; 3],
    pub boxhi: [f64; 3],
    /// Tilt factors xy, xz, yz of a triclinic box.
    pub tilt: Option<[f64; 3]>,
    /// Boundary conditions in the notation of LAMMPS: `pp pp ff`.
    pub boundary: String,
    pub columns: Vec<String>,
    pub natoms: usize,
    /// The table, row after row. A column of words (element, typelabel) holds NaN.
    pub values: Vec<f64>,
    /// The columns of words, each with its column number.
    pub words: Vec<(usize, Vec<String>)>,
}

impl Frame {
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns.len().max(1))
    }

    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == name)
    }

    pub fn get(&self, name: &str) -> Option<Vec<f64>> {
        let c = self.column(name)?;
        Some(self.rows().map(|row| row[c]).collect())
    }

    /// The values of three columns, such as x, y and z.
    pub fn vectors(&self, names: [&str; 3]) -> Option<Vec<[f64; 3]>> {
        let [a, b, c] = [self.column(names[0])?, self.column(names[1])?, self.column(names[2])?];
        Some(self.rows().map(|row| [row[a], row[b], row[c]]).collect())
    }

    /// Sorts the rows by the column `id`; returns false if the dump has no such column.
    pub fn sort_by_id(&mut self) -> bool {
        let Some(ids) = self.get("id") else {
            return false;
        };
        let mut order: Vec<usize> = (0..ids.len()).collect();
        order.sort_by(|&a, &b| ids[a].total_cmp(&ids[b]));
        let width = self.columns.len();
        let row = |i: &usize| &self.values[i * width..(i + 1) * width];
        self.values = order.iter().flat_map(|i| row(i).to_vec()).collect();
        for (_, words) in &mut self.words {
            *words = order.iter().map(|&i| std::mem::take(&mut words[i])).collect();
        }
        true
    }
}

/// An iterator over the frames of a dump, which ends after the first error.
#[derive(Debug)]
pub struct DumpReader<R> {
    input: R,
    line: usize,
    text: String,
    ended: bool,
}

pub fn read(path: &Path) -> Result<Vec<Frame>, FormatError> {
    let file = psidpd_core::document::open_regular(path).map_err(PathError::at("read", path))?;
    DumpReader::new(io::BufReader::new(file)).collect::<Result<_, _>>().map_err(FormatError::content(path))
}

impl<R: BufRead> DumpReader<R> {
    pub fn new(input: R) -> Self {
        DumpReader { input, line: 0, text: String::new(), ended: false }
    }

    /// Reads the next line; returns false at the end.
    fn advance(&mut self) -> Result<bool, TextError> {
        self.text.clear();
        self.line += 1;
        match self.input.read_line(&mut self.text) {
            Ok(n) => Ok(n > 0),
            Err(e) => Err(self.fail(Problem::Read(e.to_string()))),
        }
    }

    fn expect(&mut self, what: &str) -> Result<(), TextError> {
        if self.advance()? { Ok(()) } else { Err(self.fail(Problem::Ended(what.into()))) }
    }

    fn fail(&self, problem: Problem) -> TextError {
        problem.at(self.line)
    }

    fn number(&mut self, what: &str, min: i64, max: i64) -> Result<i64, TextError> {
        self.expect(what)?;
        whole(self.text.trim(), what, min, max, self.line)
    }

    fn frame(&mut self) -> Result<Option<Frame>, TextError> {
        let mut frame = Frame::default();
        let (mut step, mut natoms, mut sides) = (None, None, false);
        loop {
            if !self.advance()? {
                // The dump ends here if the end comes before the first item.
                return match step {
                    None => Ok(None),
                    Some(_) => Err(self.fail(Problem::Ended("ITEM: ATOMS".into()))),
                };
            }
            let text = self.text.trim().to_owned();
            if text.is_empty() && step.is_none() {
                continue;
            }
            let Some(item) = text.strip_prefix("ITEM:").map(str::trim) else {
                return Err(self.fail(Problem::Unknown(shown(&text))));
            };
            if item == "TIMESTEP" {
                if step.is_some() {
                    return Err(self.fail(Problem::Missing("ITEM: ATOMS".into())));
                }
                step = Some(self.number("the time step", 0, i64::MAX)?);
            } else if item == "UNITS" {
                self.expect("the units")?;
            } else if item == "TIME" {
                self.expect("the time")?;
                frame.time = Some(any_f64(self.text.trim(), "the time", self.line)?);
            } else if item == "NUMBER OF ATOMS" {
                natoms = Some(self.number("the number of atoms", 0, i64::MAX)? as usize);
            } else if let Some(kind) = item.strip_prefix("BOX BOUNDS") {
                self.bounds(kind.trim(), &mut frame)?;
                sides = true;
            } else if let Some(names) = item.strip_prefix("ATOMS") {
                frame.columns = names.split_whitespace().map(Into::into).collect();
                let missing = |what: &str| Problem::Missing(what.into());
                frame.step = step.ok_or_else(|| self.fail(missing("ITEM: TIMESTEP")))?;
                frame.natoms = natoms.ok_or_else(|| self.fail(missing("ITEM: NUMBER OF ATOMS")))?;
                if !sides {
                    return Err(self.fail(missing("ITEM: BOX BOUNDS")));
                }
                if frame.columns.is_empty() {
                    return Err(self.fail(missing("name of a column")));
                }
                self.table(&mut frame)?;
                return Ok(Some(frame));
            } else {
                return Err(self.fail(Problem::Unknown(shown(&text))));
            }
        }
    }

    fn bounds(&mut self, kind: &str, frame: &mut Frame) -> Result<(), TextError> {
        if kind.starts_with("abc") {
            return Err(self.fail(Problem::Unsupported("a general triclinic box".into())));
        }
        let tilted = kind.strip_prefix("xy xz yz");
        frame.boundary = tilted.unwrap_or(kind).trim().into();
        let expected = if tilted.is_some() { 3 } else { 2 };
        let mut tilt = [0.0; 3];
        for (d, tilt) in tilt.iter_mut().enumerate() {
            self.expect("the box")?;
            let words: Vec<&str> = self.text.split_whitespace().collect();
            if words.len() != expected {
                return Err(
                    self.fail(Problem::Columns { expected: expected.to_string(), found: words.len() })
                );
            }
            frame.boxlo[d] = finite(words[0], "the box", self.line)?;
            frame.boxhi[d] = finite(words[1], "the box", self.line)?;
            if expected == 3 {
                *tilt = finite(words[2], "the tilt", self.line)?;
            }
        }
        if tilted.is_some() {
            // The dump contains the bounding box of the tilted box.
            let [xy, xz, yz] = tilt;
            let x = [0.0, xy, xz, xy + xz];
            frame.boxlo[0] -= x.into_iter().fold(0.0, f64::min);
            frame.boxhi[0] -= x.into_iter().fold(0.0, f64::max);
            frame.boxlo[1] -= yz.min(0.0);
            frame.boxhi[1] -= yz.max(0.0);
            frame.tilt = Some(tilt);
        }
        Ok(())
    }

    fn table(&mut self, frame: &mut Frame) -> Result<(), TextError> {
        let width = frame.columns.len();
        let is_word = |name: &String| name == "element" || name == "typelabel";
        frame.words = (0..width).filter(|&c| is_word(&frame.columns[c])).map(|c| (c, Vec::new())).collect();
        for _ in 0..frame.natoms {
            self.expect("another atom")?;
            let mut found = 0;
            for word in self.text.split_whitespace() {
                let Some(name) = frame.columns.get(found) else {
                    found += 1;
                    continue;
                };
                frame.values.push(if is_word(name) {
                    if let Some((_, words)) = frame.words.iter_mut().find(|(c, _)| *c == found) {
                        words.push(word.to_owned());
                    }
                    f64::NAN
                } else {
                    any_f64(word, name, self.line)?
                });
                found += 1;
            }
            if found != width {
                return Err(self.fail(Problem::Columns { expected: width.to_string(), found }));
            }
        }
        Ok(())
    }
}

impl<R: BufRead> Iterator for DumpReader<R> {
    type Item = Result<Frame, TextError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let frame = self.frame().transpose();
        self.ended = !matches!(frame, Some(Ok(_)));
        frame
    }
}

/// Writes a frame with the columns `id type x y z vx vy vz` as LAMMPS does, with the digits that restore the exact values.
/// Particles keep their order; types are species from 1. Unknown velocities are written as 0. Slices of different lengths are
/// an error of kind `InvalidInput`, and so is a box that LAMMPS cannot hold.
pub fn write_dump(frame: &super::Frame, out: &mut impl Write) -> io::Result<()> {
    let n = frame.tag.len();
    if [frame.species.len(), frame.x.len(), frame.v.map_or(n, <[_]>::len)] != [n; 3] {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "ids, types, positions and velocities differ in number",
        ));
    }
    let [a, b, c] = [0, 1, 2].map(|k| frame.domain.edge(k));
    if [a[1], a[2], b[2]] != [0.0; 3] {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "a dump needs a box with its first edge along x and its second in the plane of x and y",
        ));
    }
    let boundary = frame.periodic().map(|p| if p { "pp" } else { "ff" }).join(" ");
    writeln!(out, "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{n}", frame.step)?;
    let (tilt, origin) = ([b[0], c[0], c[1]], frame.domain.origin());
    if tilt == [0.0; 3] {
        writeln!(out, "ITEM: BOX BOUNDS {boundary}")?;
        for (low, length) in origin.into_iter().zip(frame.domain.lengths()) {
            writeln!(out, "{low:.16e} {:.16e}", low + length)?;
        }
    } else {
        // The bounding box of the tilted box.
        let [xy, xz, yz] = tilt;
        writeln!(out, "ITEM: BOX BOUNDS xy xz yz {boundary}")?;
        let ranges = [[0.0, xy, xz, xy + xz], [0.0, yz, 0.0, 0.0], [0.0; 4]];
        for (k, length) in [a[0], b[1], c[2]].into_iter().enumerate() {
            let low = origin[k] + ranges[k].into_iter().fold(0.0, f64::min);
            let high = origin[k] + length + ranges[k].into_iter().fold(0.0, f64::max);
            writeln!(out, "{low:.16e} {high:.16e} {:.16e}", tilt[k])?;
        }
    }
    writeln!(out, "ITEM: ATOMS id type x y z vx vy vz")?;
    let mut rows = Rows::new(out);
    for i in 0..n {
        rows.whole(frame.tag[i] as u32);
        rows.whole(frame.species[i] as u32 + 1);
        frame.x[i].into_iter().chain(frame.v.map_or([0.0; 3], |v| v[i])).for_each(|x| rows.number(x));
        rows.end()?;
    }
    rows.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use proptest::prelude::*;
    use psidpd_core::engine::PeriodicBox;

    fn frame<'a>(
        step: u64,
        domain: &'a PeriodicBox,
        species: &'a [i32],
        tag: &'a [i32],
        x: &'a [[f64; 3]],
        v: &'a [[f64; 3]],
    ) -> crate::Frame<'a> {
        crate::Frame { step, time: 0.0, dimensions: 3, domain, names: &[], x, v: Some(v), species, tag }
    }

    const TWO: &str = "ITEM: UNITS\nlj\nITEM: TIME\n0.5\nITEM: TIMESTEP\n10\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n0 4\n-1 1\n0 3\n\
        ITEM: ATOMS id element c_pea f_1[2]\n2 He 1.5 -2\n1 Xe nan 1e-3\n\
        ITEM: TIMESTEP\n20\nITEM: NUMBER OF ATOMS\n0\nITEM: BOX BOUNDS xy xz yz pp pp pp\n-0.5 5 1\n0 4 -0.5\n0 4 0.25\nITEM: ATOMS id x y z\n";

    fn read_all(text: &str) -> Result<Vec<Frame>, TextError> {
        DumpReader::new(text.as_bytes()).collect()
    }

    /// A box of 4, 5 and 6 from (1, 2, 3): the bounds of LAMMPS hold all of its corners, of which xy and xz move those along x,
    /// alone and together.
    #[test]
    fn bounds_of_tilted_boxes_hold_all_corners() {
        for [xy, xz, yz] in [[1.5, 0.5, 2.0], [-1.5, -0.5, -2.0], [1.5, -0.5, 2.0], [-0.5, 1.5, 2.0f64]] {
            let along_x = [0.0, xy, xz, xy + xz];
            let least = |all: &[f64]| all.iter().copied().fold(f64::INFINITY, f64::min);
            let most = |all: &[f64]| all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let text = format!(
                "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n0\nITEM: BOX BOUNDS xy xz yz pp pp pp\n{} {} {xy}\n{} {} {xz}\n\
                 3 9 {yz}\nITEM: ATOMS id x y z\n",
                1.0 + least(&along_x),
                5.0 + most(&along_x),
                2.0 + least(&[0.0, yz]),
                7.0 + most(&[0.0, yz])
            );
            let frame = read_all(&text).unwrap().remove(0);
            assert_eq!((frame.boxlo, frame.boxhi), ([1.0, 2.0, 3.0], [5.0, 7.0, 9.0]), "{text}");
        }
    }

    /// The bounds that are written hold all corners of a tilted box, and the box is read back as it was. Numbers are exact in binary.
    #[test]
    fn tilted_boxes_are_written_with_their_tilt() {
        for ([xy, xz, yz], bounds) in [
            ([1.5, 0.5, 2.0], [[1.0, 7.0], [2.0, 9.0]]),
            ([-1.5, -0.5, -2.0], [[-1.0, 5.0], [0.0, 7.0]]),
            ([1.5, -0.5, 0.0], [[0.5, 6.5], [2.0, 7.0]]),
            ([0.0, -0.5, 0.0], [[0.5, 5.0], [2.0, 7.0]]),
        ] {
            let edges = Matrix3::new(4.0, xy, xz, 0.0, 5.0, yz, 0.0, 0.0, 6.0);
            let domain = PeriodicBox::new([1.0, 2.0, 3.0], edges, [true; 3]).unwrap();
            let mut text = Vec::new();
            write_dump(&frame(7, &domain, &[0], &[1], &[[1.5, 2.5, 3.5]], &[[0.0; 3]]), &mut text).unwrap();
            let text = String::from_utf8(text).unwrap();
            let mut lines = text.lines().skip_while(|line| !line.starts_with("ITEM: BOX BOUNDS"));
            assert_eq!(lines.next(), Some("ITEM: BOX BOUNDS xy xz yz pp pp pp"));
            for ([low, high], tilt) in bounds.into_iter().chain([[3.0, 9.0]]).zip([xy, xz, yz]) {
                let numbers = lines.next().unwrap().split(' ').map(|word| word.parse::<f64>().unwrap());
                assert_eq!(numbers.collect::<Vec<f64>>(), [low, high, tilt], "{text}");
            }
            let read = read_all(&text).unwrap().remove(0);
            assert_eq!((read.boxlo, read.boxhi), ([1.0, 2.0, 3.0], [5.0, 7.0, 9.0]), "{text}");
            assert_eq!(read.tilt, Some([xy, xz, yz]));
        }
        let edges = Matrix3::new(4.0, 0.0, 0.0, 1.0, 4.0, 0.0, 0.0, 0.0, 4.0);
        let domain = PeriodicBox::new([0.0; 3], edges, [true; 3]).unwrap();
        let made = write_dump(&frame(0, &domain, &[0], &[1], &[[0.0; 3]], &[[0.0; 3]]), &mut Vec::new());
        assert_eq!(made.unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }

    #[test]
    fn frames_of_any_columns() {
        let mut frames = read_all(TWO).unwrap();
        assert_eq!(frames.len(), 2);
        let f = &mut frames[0];
        assert_eq!((f.step, f.time, f.natoms), (10, Some(0.5), 2));
        assert_eq!(f.boundary, "pp pp ff");
        assert!(f.sort_by_id());
        assert_eq!(f.get("id"), Some(vec![1.0, 2.0]));
        assert_eq!(f.words[0].1, ["Xe", "He"]);
        assert_eq!(f.get("f_1[2]"), Some(vec![1e-3, -2.0]));
        assert!(f.get("c_pea").unwrap()[0].is_nan());
        assert_eq!((f.get("vx"), f.vectors(["x", "y", "z"])), (None, None));
        let t = &frames[1];
        assert_eq!((t.step, t.natoms, t.rows().len()), (20, 0, 0));
        assert_eq!((t.boxlo, t.boxhi), ([0.0, 0.0, 0.0], [4.0, 3.75, 4.0]));
        assert_eq!(t.tilt, Some([1.0, -0.5, 0.25]));
    }

    #[test]
    fn bad_dumps_are_refused_with_the_line() {
        for (from, to, line, says) in [
            ("10\n", "x\n", 6, "time step"),
            ("\n2\n", "\n3\n", 16, "not a number"),
            ("\n2\n", "\n1\n", 15, "1 Xe"),
            ("\n2\n", "\n99999999999999999999\n", 8, "between"),
            ("-1 1\n", "-1\n", 11, "columns"),
            ("-1 1\n", "-1 inf\n", 11, "finite"),
            ("1.5", "", 14, "3 columns where 4"),
            ("1.5", "1 1", 14, "5 columns where 4"),
            ("1.5", "1,5", 14, "c_pea"),
            ("ITEM: NUMBER OF ATOMS\n2\n", "", 11, "NUMBER"),
            ("ITEM: ATOMS id element c_pea f_1[2]", "ITEM: ATOMS", 13, "column"),
            ("ITEM: TIME\n", "ITEM: WHAT\n", 3, "WHAT"),
            ("BOUNDS pp", "BOUNDS abc origin pp", 9, "triclinic"),
        ] {
            assert!(TWO.contains(from), "{from}");
            let e = read_all(&TWO.replacen(from, to, 1)).unwrap_err();
            assert!(e.to_string().contains(says), "{from} -> {to}: {e}");
            assert_eq!(e.line, line, "{from} -> {to}: {e}");
        }
        // A killed run can leave a partial frame.
        let mut cut = DumpReader::new(&TWO.as_bytes()[..TWO.len() - 40]);
        assert!(cut.next().unwrap().is_ok());
        assert!(matches!(
            cut.next().unwrap().unwrap_err().problem,
            Problem::Ended(_) | Problem::Columns { .. }
        ));
        assert!(cut.next().is_none());
        assert_eq!(read_all(""), Ok(vec![]));
    }

    #[test]
    fn not_text_is_an_error() {
        let mut r = DumpReader::new(&b"ITEM: TIMESTEP\n\xff\xfe\n"[..]);
        assert!(matches!(r.next().unwrap().unwrap_err().problem, Problem::Read(_)));
    }

    proptest! {
        #[test]
        fn reading_what_was_written_gives_the_same_bits(
            rows in prop::collection::vec((any::<u32>(), 1u32..5, prop::array::uniform3(any::<f64>()), prop::array::uniform3(any::<f64>())), 0..20),
            step in 0u64..i64::MAX as u64, lo in prop::array::uniform3(-1e9..1e9f64), periodic in any::<[bool; 3]>(),
        ) {
            let tag: Vec<i32> = rows.iter().map(|r| r.0 as i32).collect();
            let species: Vec<i32> = rows.iter().map(|r| r.1 as i32 - 1).collect();
            let x: Vec<_> = rows.iter().map(|r| r.2).collect();
            let v: Vec<_> = rows.iter().map(|r| r.3).collect();
            let domain = PeriodicBox::orthogonal(lo, [1.0; 3], periodic).unwrap();
            let s = frame(step, &domain, &species, &tag, &x, &v);
            let mut w = Vec::new();
            write_dump(&s, &mut w).unwrap();
            write_dump(&s, &mut w).unwrap();
            let frames = read_all(std::str::from_utf8(&w).unwrap()).unwrap();
            prop_assert_eq!(frames.len(), 2);
            for f in frames {
                prop_assert_eq!((f.step, f.boxlo, f.natoms), (step as i64, lo, tag.len()));
                prop_assert_eq!(f.get("id"), Some(rows.iter().map(|r| f64::from(r.0)).collect()));
                prop_assert_eq!(f.get("type"), Some(rows.iter().map(|r| f64::from(r.1)).collect()));
                let (fx, fv) = (f.vectors(["x", "y", "z"]).unwrap(), f.vectors(["vx", "vy", "vz"]).unwrap());
                for (a, b) in fx.iter().chain(&fv).flatten().zip(x.iter().chain(&v).flatten()) {
                    prop_assert!(a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan());
                }
            }
        }

        #[test]
        fn no_damage_makes_it_panic(at in 0usize..TWO.len(), with in "[ 0-9a-zA-Z:\n.+-]{0,4}", cut in 0usize..6) {
            let mut s = TWO.to_owned();
            s.replace_range(at..(at + cut).min(TWO.len()), &with);
            let _ = read_all(&s);
        }
    }

    #[test]
    fn lengths_must_agree() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [1.0; 3], [true; 3]).unwrap();
        let e = write_dump(&frame(0, &domain, &[0], &[1], &[[0.0; 3]], &[]), &mut Vec::new());
        assert_eq!(e.unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }
}
