//! LAMMPS data files with point particles.

use std::collections::{HashMap, HashSet};
use std::io::{self, Read, Write};
use std::path::Path;

use super::FormatError;
use super::files::{Existing, PathError, write_result};
use super::text::{Problem, TextError, finite, out_of_range, shown, whole};

/// This text precedes the periodic directions in a title.
const BOUNDARY: &str = "; boundary ";

#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataFile {
    pub title: String,
    pub boxlo: [f64; 3],
    pub boxhi: [f64; 3],
    /// Tilt factors xy, xz, yz of a triclinic box.
    pub tilt: Option<[f64; 3]>,
    pub types: usize,
    /// Mass of each type; empty if the file has no masses.
    pub masses: Vec<f64>,
    /// Name of each type, which is written as a comment beside its mass and never read; may be empty.
    pub names: Vec<String>,
    /// Atoms are in the order of the file.
    pub atoms: Vec<Atom>,
    /// Velocities are in the order of `atoms`.
    pub velocities: Option<Vec<[f64; 3]>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Atom {
    /// Tags are counted from 1.
    pub id: u32,
    /// Types are counted from 1.
    pub kind: u32,
    pub x: [f64; 3],
    /// The number of periods that the atom has crossed in each direction.
    pub image: [i32; 3],
}

/// The columns before the position in the section Atoms.
#[derive(Clone, Copy, PartialEq)]
enum Style {
    /// The columns are id, type, x, y, z.
    Atomic,
    /// The columns are id, type, rho, x, y, z.
    Mdpd,
}

/// Sections without positions, which the reader skips.
const IGNORED: [&str; 3] = ["Pair Coeffs", "PairIJ Coeffs", "Atom Type Labels"];
/// Header counts of things other than atoms, which must be zero.
const OTHERS: [&str; 8] =
    ["bonds", "angles", "dihedrals", "impropers", "ellipsoids", "lines", "triangles", "bodies"];
const MAX_ID: i64 = i32::MAX as i64;
const XYZ: [&str; 3] = ["x", "y", "z"];

impl DataFile {
    pub fn read(path: &Path) -> Result<DataFile, FormatError> {
        DataFile::parse(&DataFile::text(path)?).map_err(FormatError::content(path))
    }

    fn text(path: &Path) -> Result<String, PathError> {
        let mut bytes = Vec::new();
        psidpd_core::document::open_regular(path)
            .and_then(|mut file| file.read_to_end(&mut bytes))
            .map_err(PathError::at("read", path))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// The line of an atom in a file, counted from 1, for messages.
    pub fn line_of(path: &Path, id: u32) -> Option<usize> {
        let text = DataFile::text(path).ok()?;
        let first = |line: &str| line.split_whitespace().next().map(str::to_owned);
        let atoms = text.lines().position(|line| first(line).as_deref() == Some("Atoms"))?;
        let line =
            text.lines().skip(atoms).position(|line| first(line).and_then(|w| w.parse().ok()) == Some(id))?;
        Some(atoms + line + 1)
    }

    /// Reads the text of a data file of `atom_style` atomic or mdpd. Densities of mdpd are skipped.
    ///
    /// A comment at the section Atoms may name its style, as LAMMPS writes it; the default is atomic. Sections of pair
    /// coefficients and of type labels are skipped. Bonds, angles and the like are errors.
    pub fn parse(text: &str) -> Result<DataFile, TextError> {
        let mut parser = Parser::new(text);
        let mut data = DataFile { title: parser.title.to_owned(), ..DataFile::default() };
        parser.header(&mut data)?;
        parser.sections(&mut data)?;
        Ok(data)
    }

    /// Writes a file that must not exist, except in a folder of psidpd's own work.
    pub fn write(&self, path: &Path) -> Result<(), PathError> {
        self.write_over(path, Existing::Keep)
    }

    /// Writes a file as the user says.
    pub fn write_over(&self, path: &Path, existing: Existing) -> Result<(), PathError> {
        write_result(path, existing, |mut out| self.print(&mut out, Style::Atomic))
    }

    /// Writes a file of `atom_style mdpd`, with densities of zero, which that style computes anew.
    pub fn write_mdpd(&self, path: &Path) -> Result<(), PathError> {
        write_result(path, Existing::Keep, |mut out| self.print(&mut out, Style::Mdpd))
    }

    /// The periodic directions, if the title has them as [`DataFile::with_boundary`] writes them.
    pub fn boundary(&self) -> Option<[bool; 3]> {
        let (_, words) = self.title.rsplit_once(BOUNDARY)?;
        let flags: Vec<bool> = words
            .split_whitespace()
            .map(|word| match word {
                "p" => Some(true),
                "f" => Some(false),
                _ => None,
            })
            .collect::<Option<_>>()?;
        flags.try_into().ok()
    }

    /// Appends the periodic directions to the title in the notation of LAMMPS's command `boundary`. LAMMPS ignores the title.
    pub fn with_boundary(mut self, periodic: [bool; 3]) -> DataFile {
        let words = periodic.map(|p| if p { "p" } else { "f" }).join(" ");
        self.title = format!("{}{BOUNDARY}{words}", self.title);
        self
    }

    /// Writes a data file of `atom_style atomic` with 17 significant digits, so that reading it gives the same bits.
    ///
    /// A line break in the title becomes a space. Data that LAMMPS cannot read are an error of kind `InvalidInput`.
    pub fn write_to(&self, out: &mut impl Write) -> io::Result<()> {
        self.print(out, Style::Atomic)
    }

    fn print(&self, out: &mut impl Write, style: Style) -> io::Result<()> {
        self.check().map_err(|e| io::Error::new(io::ErrorKind::InvalidInput, e))?;
        writeln!(out, "{}\n", self.title.replace(['\n', '\r'], " "))?;
        writeln!(out, "{} atoms\n{} atom types\n", self.atoms.len(), self.types)?;
        for (d, name) in XYZ.iter().enumerate() {
            writeln!(out, "{:.16e} {:.16e} {name}lo {name}hi", self.boxlo[d], self.boxhi[d])?;
        }
        if let Some([xy, xz, yz]) = self.tilt {
            writeln!(out, "{xy:.16e} {xz:.16e} {yz:.16e} xy xz yz")?;
        }
        if !self.masses.is_empty() {
            writeln!(out, "\nMasses\n")?;
            for (k, mass) in self.masses.iter().enumerate() {
                // `write_data` writes type labels in the same place; OVITO shows them.
                let name = self.names.get(k).map_or(String::new(), |name| format!(" # {name}"));
                writeln!(out, "{} {mass:.16e}{name}", k + 1)?;
            }
        }
        if !self.atoms.is_empty() {
            let name = if style == Style::Mdpd { "mdpd" } else { "atomic" };
            writeln!(out, "\nAtoms # {name}\n")?;
        }
        let rho = if style == Style::Mdpd { "0 " } else { "" };
        for a in &self.atoms {
            let ([x, y, z], [i, j, k]) = (a.x, a.image);
            writeln!(out, "{} {} {rho}{x:.16e} {y:.16e} {z:.16e} {i} {j} {k}", a.id, a.kind)?;
        }
        if let Some(velocities) = self.velocities.as_ref().filter(|v| !v.is_empty()) {
            writeln!(out, "\nVelocities\n")?;
            for (a, [x, y, z]) in self.atoms.iter().zip(velocities) {
                writeln!(out, "{} {x:.16e} {y:.16e} {z:.16e}", a.id)?;
            }
        }
        Ok(())
    }

    pub fn sort_by_id(&mut self) {
        let mut order: Vec<usize> = (0..self.atoms.len()).collect();
        order.sort_by_key(|&i| self.atoms[i].id);
        self.atoms = order.iter().map(|&i| self.atoms[i]).collect();
        if let Some(v) = &mut self.velocities {
            *v = order.iter().map(|&i| v[i]).collect();
        }
    }

    /// Checks for data that LAMMPS would refuse.
    fn check(&self) -> Result<(), String> {
        if (0..3).any(|d| !finite_box(self.boxlo[d], self.boxhi[d])) {
            return Err("the box is not finite, or has no extent".into());
        }
        if self.tilt.iter().flatten().any(|t| !t.is_finite()) {
            return Err("a tilt factor is not finite".into());
        }
        if !self.masses.is_empty() && self.masses.len() != self.types {
            return Err(format!("{} masses for {} types", self.masses.len(), self.types));
        }
        if self.masses.iter().any(|m| !(m.is_finite() && *m > 0.0)) {
            return Err("a mass is not positive".into());
        }
        let mut seen = HashSet::with_capacity(self.atoms.len());
        for a in &self.atoms {
            if a.id == 0 || i64::from(a.id) > MAX_ID || !seen.insert(a.id) {
                return Err(format!("atom id {} is out of range or given twice", a.id));
            }
            if a.kind == 0 || a.kind as usize > self.types {
                return Err(format!("atom {} has type {}", a.id, a.kind));
            }
            if a.x.iter().any(|x| !x.is_finite()) {
                return Err(format!("the position of atom {} is not finite", a.id));
            }
        }
        if let Some(v) = &self.velocities {
            if v.len() != self.atoms.len() {
                return Err(format!("{} velocities for {} atoms", v.len(), seen.len()));
            }
            if v.iter().flatten().any(|x| !x.is_finite()) {
                return Err("a velocity is not finite".into());
            }
        }
        Ok(())
    }
}

fn finite_box(lo: f64, hi: f64) -> bool {
    lo.is_finite() && hi.is_finite() && lo < hi
}

/// A line that is not blank: its number, its words, its comment.
struct Line<'a> {
    number: usize,
    text: &'a str,
    comment: &'a str,
}

struct Parser<'a> {
    title: &'a str,
    lines: Vec<Line<'a>>,
    next: usize,
    last: usize,
    natoms: usize,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Self {
        let mut all = text.lines();
        let title = all.next().unwrap_or_default();
        let lines = all
            .enumerate()
            .map(|(i, line)| {
                let (text, comment) = line.split_once('#').unwrap_or((line, ""));
                Line { number: i + 2, text: text.trim(), comment: comment.trim() }
            })
            .filter(|line| !line.text.is_empty())
            .collect();
        Parser { title, lines, next: 0, last: text.lines().count().max(1), natoms: 0 }
    }

    /// The next line if it begins with a number, as all lines do except names of sections.
    fn numeric(&mut self) -> Option<(usize, &'a str)> {
        let line = self.lines.get(self.next)?;
        let number = line.text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        number.then(|| {
            self.next += 1;
            (line.number, line.text)
        })
    }

    fn header(&mut self, data: &mut DataFile) -> Result<(), TextError> {
        let (mut natoms, mut types, mut sides, mut tilt) = (None, None, [None; 3], None);
        while let Some((n, text)) = self.numeric() {
            let words: Vec<&str> = text.split_whitespace().collect();
            let values =
                words.iter().take_while(|w| !w.starts_with(|c: char| c.is_ascii_alphabetic())).count();
            let name = words[values..].join(" ");
            let side = XYZ.iter().position(|d| name == format!("{d}lo {d}hi"));
            let expected = match (side, name.as_str()) {
                (Some(_), _) => 2,
                (_, "xy xz yz" | "avec" | "bvec" | "cvec" | "abc origin") => 3,
                _ => 1,
            };
            if values != expected {
                return Err(Problem::Columns {
                    expected: format!("{expected} before '{}'", shown(&name)),
                    found: values,
                }
                .at(n));
            }
            let count = |what: &str, max| whole(words[0], what, 0, max, n).map(|c| c as usize);
            let twice = match (side, name.as_str()) {
                (Some(d), _) => {
                    let lo = finite(words[0], words[2], n)?;
                    let hi = finite(words[1], words[3], n)?;
                    if lo >= hi {
                        return Err(out_of_range(words[3], words[1], format!("above {}", words[2]), n));
                    }
                    sides[d].replace((lo, hi)).is_some()
                }
                (_, "xy xz yz") => {
                    let mut t = [0.0; 3];
                    for d in 0..3 {
                        t[d] = finite(words[d], words[3 + d], n)?;
                    }
                    tilt.replace(t).is_some()
                }
                (_, "atoms") => natoms.replace(count("the number of atoms", MAX_ID)?).is_some(),
                (_, "atom types") => types.replace(count("the number of atom types", MAX_ID)?).is_some(),
                (_, other) if OTHERS.contains(&other) => {
                    if count(other, MAX_ID)? > 0 {
                        return Err(Problem::Unsupported(format!("a file with {other}")).at(n));
                    }
                    false
                }
                (_, "bond types" | "angle types" | "dihedral types" | "improper types") => false,
                (_, other) if other.starts_with("extra ") => false,
                (_, "avec" | "bvec" | "cvec" | "abc origin") => {
                    return Err(Problem::Unsupported("a general triclinic box".into()).at(n));
                }
                _ => return Err(Problem::Unknown(shown(text)).at(n)),
            };
            if twice {
                return Err(Problem::Duplicate(name).at(n));
            }
        }
        let here = self.lines.get(self.next).map_or(self.last, |l| l.number);
        let missing = |what: &str| Problem::Missing(format!("'{what}' in the header")).at(here);
        self.natoms = natoms.ok_or_else(|| missing("atoms"))?;
        data.types = types.ok_or_else(|| missing("atom types"))?;
        for (d, side) in sides.into_iter().enumerate() {
            let name = format!("{0}lo {0}hi", XYZ[d]);
            (data.boxlo[d], data.boxhi[d]) = side.ok_or_else(|| missing(&name))?;
        }
        data.tilt = tilt;
        Ok(())
    }

    fn sections(&mut self, data: &mut DataFile) -> Result<(), TextError> {
        let mut velocities: Option<Vec<(usize, u32, [f64; 3])>> = None;
        let mut seen = HashSet::new();
        while let Some(line) = self.lines.get(self.next) {
            let (n, comment) = (line.number, line.comment);
            let name = line.text.split_whitespace().collect::<Vec<_>>().join(" ");
            self.next += 1;
            if !seen.insert(name.clone()) {
                return Err(Problem::Duplicate(format!("the section {}", shown(&name))).at(n));
            }
            match name.as_str() {
                "Masses" => data.masses = self.masses(data.types, n)?,
                "Atoms" => data.atoms = self.atoms(comment, data.types, n)?,
                "Velocities" => velocities = Some(self.velocities(n)?),
                name if IGNORED.contains(&name) => while self.numeric().is_some() {},
                _ => return Err(Problem::Unknown(shown(&name)).at(n)),
            }
        }
        if self.natoms > 0 && !seen.contains("Atoms") {
            return Err(Problem::Missing("section Atoms".into()).at(self.last));
        }
        let index: HashMap<u32, usize> = data.atoms.iter().enumerate().map(|(i, a)| (a.id, i)).collect();
        if let Some(list) = velocities {
            let mut sorted = vec![[f64::NAN; 3]; data.atoms.len()];
            for (n, id, v) in list {
                let i = index.get(&id).ok_or_else(|| Problem::Missing(format!("atom {id}")).at(n))?;
                if !sorted[*i][0].is_nan() {
                    return Err(Problem::Duplicate(format!("the velocity of atom {id}")).at(n));
                }
                sorted[*i] = v;
            }
            data.velocities = Some(sorted);
        }
        Ok(())
    }

    /// Reads exactly `count` lines of a section.
    fn rows<T>(
        &mut self,
        what: &str,
        count: usize,
        start: usize,
        mut row: impl FnMut(usize, &[&'a str]) -> Result<T, TextError>,
    ) -> Result<Vec<T>, TextError> {
        // The count comes from the file, so reserve no more memory than the file has lines.
        let mut rows = Vec::with_capacity(count.min(self.lines.len()));
        let mut end = start;
        let mut words = Vec::new();
        while let Some((n, text)) = self.numeric() {
            end = n;
            if rows.len() < count {
                words.clear();
                words.extend(text.split_whitespace());
                rows.push(row(n, &words)?);
            } else {
                return Err(Problem::Count { what: what.into(), expected: count, found: count + 1 }.at(n));
            }
        }
        if rows.len() < count {
            return Err(Problem::Count { what: what.into(), expected: count, found: rows.len() }.at(end));
        }
        Ok(rows)
    }

    fn masses(&mut self, types: usize, start: usize) -> Result<Vec<f64>, TextError> {
        let rows = self.rows("Masses", types, start, |n, words| {
            columns(words, &[2], "2", n)?;
            let kind = whole(words[0], "the type", 1, types as i64, n)? as usize;
            let mass = finite(words[1], "the mass", n)?;
            if mass <= 0.0 {
                return Err(out_of_range("the mass", words[1], "positive", n));
            }
            Ok((n, kind, mass))
        })?;
        let mut masses = vec![f64::NAN; rows.len()];
        for (n, kind, mass) in rows {
            if !masses[kind - 1].is_nan() {
                return Err(Problem::Duplicate(format!("the mass of type {kind}")).at(n));
            }
            masses[kind - 1] = mass;
        }
        Ok(masses)
    }

    fn atoms(&mut self, hint: &str, types: usize, start: usize) -> Result<Vec<Atom>, TextError> {
        let style = match hint.split_whitespace().next() {
            None | Some("atomic") => Style::Atomic,
            Some("mdpd") => Style::Mdpd,
            Some(other) => {
                return Err(Problem::Unsupported(format!("atom style {}", shown(other))).at(start));
            }
        };
        let (allowed, expected, first) = match style {
            Style::Atomic => ([5, 8], "5 or 8 (id type x y z, image flags)", 2),
            Style::Mdpd => ([6, 9], "6 or 9 (id type rho x y z, image flags)", 3),
        };
        let mut ids = HashSet::new();
        self.rows("Atoms", self.natoms, start, |n, words| {
            columns(words, &allowed, expected, n)?;
            let mut atom = Atom {
                id: whole(words[0], "the atom id", 1, MAX_ID, n)? as u32,
                kind: whole(words[1], "the atom type", 1, types as i64, n)? as u32,
                ..Atom::default()
            };
            if !ids.insert(atom.id) {
                return Err(Problem::Duplicate(format!("atom {}", atom.id)).at(n));
            }
            if style == Style::Mdpd {
                finite(words[2], "rho", n)?;
            }
            for d in 0..3 {
                atom.x[d] = finite(words[first + d], XYZ[d], n)?;
                if let Some(word) = words.get(first + 3 + d) {
                    let (min, max) = (i64::from(i32::MIN), i64::from(i32::MAX));
                    atom.image[d] = whole(word, "an image flag", min, max, n)? as i32;
                }
            }
            Ok(atom)
        })
    }

    fn velocities(&mut self, start: usize) -> Result<Vec<(usize, u32, [f64; 3])>, TextError> {
        self.rows("Velocities", self.natoms, start, |n, words| {
            columns(words, &[4], "4 (id vx vy vz)", n)?;
            let mut v = [0.0; 3];
            for d in 0..3 {
                v[d] = finite(words[1 + d], ["vx", "vy", "vz"][d], n)?;
            }
            Ok((n, whole(words[0], "the atom id", 1, MAX_ID, n)? as u32, v))
        })
    }
}

fn columns(words: &[&str], allowed: &[usize], expected: &str, n: usize) -> Result<(), TextError> {
    if allowed.contains(&words.len()) {
        return Ok(());
    }
    Err(Problem::Columns { expected: expected.into(), found: words.len() }.at(n))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SMALL: &str = "two atoms\n\n2 atoms # here\n2 atom types\n0 bonds\n\n0 4 xlo xhi\n-1 1.5 ylo yhi\n0 4 zlo zhi\n0.1 0 -.2 xy xz yz\n\n\
        Velocities\n\n7 1 2 3\n3 4 5 6\n\nPair Coeffs # soft\n\n1 10\n2 11\n\nAtoms  # mdpd\n\n3 2 6.05 1 1 1 0 -1 2\n7 1 0 2 2 2\n\nMasses\n\n2 2.5\n1 1\n";

    #[test]
    fn sections_in_any_order() {
        let d = DataFile::parse(SMALL).unwrap();
        assert_eq!((d.title.as_str(), d.types), ("two atoms", 2));
        assert_eq!(d.masses, [1.0, 2.5]);
        assert_eq!(d.tilt, Some([0.1, 0.0, -0.2]));
        assert_eq!((d.boxlo[1], d.boxhi[1]), (-1.0, 1.5));
        assert_eq!(d.atoms[0].image, [0, -1, 2]);
        assert_eq!((d.atoms[0].id, d.atoms[0].kind), (3, 2));
        assert_eq!(d.velocities, Some(vec![[4., 5., 6.], [1., 2., 3.]]));
        let mut sorted = d.clone();
        sorted.atoms.reverse();
        sorted.velocities.as_mut().unwrap().reverse();
        sorted.sort_by_id();
        assert_eq!(sorted, d);
        // Windows line ends have the same meaning.
        assert_eq!(DataFile::parse(&SMALL.replace('\n', "\r\n")).unwrap(), d);
    }

    #[test]
    fn bad_files_are_refused_with_the_line() {
        let change = |from: &str, to: &str| {
            assert!(SMALL.contains(from), "{from}");
            DataFile::parse(&SMALL.replacen(from, to, 1)).unwrap_err()
        };
        for (from, to, line, says) in [
            ("2 atoms", "3 atoms", 15, "2 lines, but 3"),
            ("2 atoms", "1 atoms", 15, "Velocities: 2 lines, but 1"),
            ("2 atoms", "4294967296 atoms", 3, "between"),
            ("2 atoms", "-1 atoms", 3, "between"),
            ("2 atom types", "1 atom types", 24, "between 1 and 1"),
            ("0 bonds", "3 bonds", 5, "bonds"),
            ("0 bonds", "3 wings", 5, "wings"),
            ("0 bonds", "2 atom types", 5, "twice"),
            ("0 4 xlo xhi", "4 0 xlo xhi", 7, "above"),
            ("0 4 xlo xhi", "4 xlo xhi", 7, "columns"),
            ("0 4 xlo xhi", "0 nan xlo xhi", 7, "nan"),
            ("0 4 xlo xhi", "0 1e999 xlo xhi", 7, "finite"),
            ("0 4 xlo xhi", "1 avec", 7, "columns"),
            ("0 4 zlo zhi\n", "", 11, "zlo zhi"),
            ("# mdpd", "# full", 22, "full"),
            ("# mdpd", "", 24, "columns"),
            ("7 1 0 2 2 2", "3 1 0 2 2 2", 25, "twice"),
            ("7 1 0 2 2 2", "7 1 0 2 2 x", 25, "not a number for z"),
            ("7 1 0 2 2 2", "0 1 0 2 2 2", 25, "atom id"),
            ("7 1 0 2 2 2", "7.5 1 0 2 2 2", 25, "atom id"),
            ("7 1 2 3", "8 1 2 3", 14, "no atom 8"),
            ("7 1 2 3", "3 1 2 3", 15, "twice"),
            ("1 1\n", "2 1\n", 30, "twice"),
            ("1 1\n", "1 -1\n", 30, "positive"),
            ("Masses", "Bonds", 27, "Bonds"),
            ("Masses", "Atoms", 27, "twice"),
        ] {
            let e = change(from, to);
            assert!(e.to_string().contains(says), "{from} -> {to}: {e}");
            assert_eq!(e.line, line, "{from} -> {to}: {e}");
        }
        // A file that is cut before its last mass is an error.
        let whole = SMALL.rfind("1 1").unwrap();
        let section = SMALL.find("\n\nMasses").unwrap();
        for i in (0..section - 1).chain(section + 3..whole) {
            assert!(DataFile::parse(&SMALL[..i]).is_err(), "{i}");
        }
        assert!(DataFile::parse("").is_err());
    }

    #[test]
    fn what_lammps_cannot_read_is_not_written() {
        let good = DataFile::parse(SMALL).unwrap();
        let refuse = |change: &dyn Fn(&mut DataFile)| {
            let mut d = good.clone();
            change(&mut d);
            let e = d.write_to(&mut Vec::new()).unwrap_err();
            assert_eq!(e.kind(), io::ErrorKind::InvalidInput);
        };
        refuse(&|d| d.atoms[0].x[1] = f64::NAN);
        refuse(&|d| d.atoms[0].id = 7);
        refuse(&|d| d.atoms[0].id = 0);
        refuse(&|d| d.atoms[0].kind = 3);
        refuse(&|d| d.masses[0] = 0.0);
        refuse(&|d| d.masses.truncate(1));
        refuse(&|d| d.boxhi[0] = f64::INFINITY);
        refuse(&|d| d.velocities = Some(vec![]));
        refuse(&|d| d.tilt = Some([f64::NAN; 3]));
    }

    fn number() -> impl Strategy<Value = f64> {
        use prop::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
        NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE
    }

    fn vector() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(number())
    }

    prop_compose! {
        fn files()(
            title in "[ -~]{0,30}",
            types in 1usize..4,
            ids in prop::collection::btree_set(1u32..=i32::MAX as u32, 1..20),
            lo in prop::array::uniform3(-1e3..1e3f64),
            size in prop::array::uniform3(1e-3..1e6f64),
            tilt in prop::option::of(prop::array::uniform3(-10.0..10.0f64)),
            masses in prop::option::of(prop::array::uniform4(1e-300..1e300f64)),
        )(
            atoms in Just(ids.clone()).prop_shuffle_set().prop_flat_map(move |ids| {
                ids.into_iter().map(move |id| (1..=types as u32, vector(), prop::array::uniform3(any::<i32>()))
                    .prop_map(move |(kind, x, image)| Atom { id, kind, x, image })).collect::<Vec<_>>()
            }),
            velocities in prop::option::of(prop::collection::vec(vector(), ids.len())),
            title in Just(title), lo in Just(lo), size in Just(size), tilt in Just(tilt), masses in Just(masses),
            types in Just(types),
        ) -> DataFile {
            DataFile {
                title, tilt, types, atoms, velocities, names: Vec::new(),
                boxlo: lo,
                boxhi: [lo[0] + size[0], lo[1] + size[1], lo[2] + size[2]],
                masses: masses.map(|m| m[..types].to_vec()).unwrap_or_default(),
            }
        }
    }

    trait ShuffleSet {
        fn prop_shuffle_set(self) -> BoxedStrategy<Vec<u32>>;
    }
    impl ShuffleSet for Just<std::collections::BTreeSet<u32>> {
        fn prop_shuffle_set(self) -> BoxedStrategy<Vec<u32>> {
            Just(self.0.into_iter().collect::<Vec<_>>()).prop_shuffle().boxed()
        }
    }

    fn bits(d: &DataFile) -> Vec<u64> {
        let all = d.atoms.iter().flat_map(|a| a.x);
        let all = all.chain(d.velocities.iter().flatten().flatten().copied());
        let all = all.chain(d.boxlo).chain(d.boxhi).chain(d.tilt.into_iter().flatten());
        all.chain(d.masses.clone()).map(f64::to_bits).collect()
    }

    proptest! {
        #[test]
        fn reading_what_was_written_gives_the_same_bits(d in files()) {
            let mut text = Vec::new();
            d.write_to(&mut text).unwrap();
            let back = DataFile::parse(std::str::from_utf8(&text).unwrap()).unwrap();
            prop_assert_eq!(bits(&back), bits(&d));
            prop_assert_eq!(back, d);
        }

        #[test]
        fn no_text_makes_it_panic(s in "\\PC*(\n\\PC*){0,5}") {
            let _ = DataFile::parse(&s);
        }

        #[test]
        fn no_damage_makes_it_panic(at in 0usize..SMALL.len(), with in "[ 0-9a-zA-Z\n#.+-]{0,4}", cut in 0usize..6) {
            let mut s = SMALL.to_owned();
            s.replace_range(at..(at + cut).min(SMALL.len()), &with);
            let _ = DataFile::parse(&s);
        }
    }
}
