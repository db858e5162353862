//! Extended XYZ: two lines of header and one line for each particle.
//!
//! The columns `species`, `pos`, `velo`, `id` have the names of libAtoms and OVITO. The column `Z` stands before `species`
//! for readers such as ASE that take only chemical elements. It holds the number of the species, counted from 1.

use super::rows::Rows;
use super::{Configuration, FormatError, Frame, PathError};
use nalgebra::{Matrix3, Vector3};
use psidpd_core::engine::PeriodicBox;
use std::io::{self, BufRead, Write};
use std::path::Path;

/// Writes a frame in extended XYZ, every number with enough digits to restore the exact value.
pub fn write_xyz(frame: &Frame, to: &mut impl Write) -> io::Result<()> {
    let flag = |periodic: bool| if periodic { "T" } else { "F" };
    let periodic = frame.periodic();
    let edges: Vec<String> = (0..3).flat_map(|k| frame.domain.edge(k)).map(|c| format!("{c:?}")).collect();
    let origin = frame.domain.origin().map(|c| format!("{c:?}"));
    let velocities = if frame.v.is_some() { "velo:R:3:" } else { "" };
    writeln!(
        to,
        "{}\nLattice=\"{}\" Origin=\"{}\" pbc=\"{} {} {}\" \
         Properties=species:S:1:pos:R:3:{velocities}id:I:1:Z:I:1 Time={:?} Step={}",
        frame.len(),
        edges.join(" "),
        origin.join(" "),
        flag(periodic[0]),
        flag(periodic[1]),
        flag(periodic[2]),
        frame.time,
        frame.step
    )?;
    let names: Vec<String> = frame.names.iter().map(|n| name_of(n)).collect();
    let mut rows = Rows::new(to);
    for i in 0..frame.len() {
        let species = frame.species[i] as usize;
        rows.word(&names[species]);
        frame.x[i].into_iter().for_each(|x| rows.number(x));
        frame.v.iter().flat_map(|v| v[i]).for_each(|v| rows.number(v));
        rows.whole(frame.tag[i]);
        rows.whole(species + 1);
        rows.end()?;
    }
    rows.finish()
}

/// The elements of the periodic table in order.
const ELEMENTS: &str = "H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga \
    Ge As Se Br Kr Rb Sr Y Zr Nb Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce Pr Nd Pm Sm Eu Gd Tb Dy \
    Ho Er Tm Yb Lu Hf Ta W Re Os Ir Pt Au Hg Tl Pb Bi Po At Rn Fr Ra Ac Th Pa U Np Pu Am Cm Bk Cf Es Fm Md \
    No Lr Rf Db Sg Bh Hs Mt Ds Rg Cn Nh Fl Mc Lv Ts Og";

/// A name without blanks that is not a chemical element: `F` is a fluid here, not fluorine.
fn name_of(species: &str) -> String {
    let name = species.replace(char::is_whitespace, "_");
    if ELEMENTS.split_whitespace().any(|e| e.eq_ignore_ascii_case(&name)) { name + "_" } else { name }
}

/// Reads a frame of an extended XYZ file; `None` if the file does not have it. `which` is counted from 0. Without it
/// the function takes the last complete frame, because a run that is still going may be in the middle of the next.
///
/// `Lattice` and a column `pos` are required; `species`, `velo`, `id`, `Origin`, `pbc`, `Time`, `Step` are optional.
/// Species are numbered in the order of their first appearance in the frame.
pub fn read_xyz(
    path: &Path,
    input: impl BufRead,
    which: Option<usize>,
) -> Result<Option<Configuration>, FormatError> {
    let wrong = |line: usize, message: String| FormatError::Xyz { path: path.to_owned(), line, message };
    // A frame is the number of its first line and the text of all others.
    let parsed = |found: Option<(usize, Vec<String>)>| {
        let Some((start, lines)) = found else { return Ok(None) };
        let Some((comment, rows)) = lines.split_first() else { return Ok(None) };
        parse_frame(comment, rows).map(Some).map_err(|(line, message)| wrong(start + 1 + line, message))
    };
    let mut found = None;
    let mut lines = input.lines().enumerate();
    let mut next = || match lines.next() {
        Some((k, line)) => line.map(|line| Some((k + 1, line))).map_err(PathError::at("read", path)),
        None => Ok(None),
    };
    let mut number = 0;
    while let Some((start, line)) = next()?.filter(|(_, line)| !line.trim().is_empty()) {
        let count: usize = line
            .trim()
            .parse()
            .map_err(|_| wrong(start, format!("expected a number of particles, found {line:?}")))?;
        let wanted = which.is_none_or(|w| w == number);
        let mut frame = Vec::new();
        for _ in 0..=count {
            match next()? {
                Some((_, line)) if wanted => frame.push(line),
                Some(_) => {}
                None if which.is_none() && found.is_some() => return parsed(found),
                None => {
                    return Err(wrong(start, format!("the file ends within a frame of {count} particles")));
                }
            }
        }
        if wanted {
            found = Some((start, frame));
        }
        number += 1;
    }
    parsed(found)
}

type Fault = (usize, String);

/// Parses one frame. The line of a fault is counted from the comment, which is line 0.
fn parse_frame(comment: &str, rows: &[String]) -> Result<Configuration, Fault> {
    let head = |message: &str| (0, message.to_owned());
    let pairs = key_values(comment);
    let value = |key: &str| pairs.iter().find(|(k, _)| k.eq_ignore_ascii_case(key)).map(|(_, v)| v.as_str());
    let numbers = |key: &str| -> Option<Vec<f64>> {
        value(key)?.split_whitespace().map(|w| w.parse().ok().filter(|x: &f64| x.is_finite())).collect()
    };
    let lattice = numbers("Lattice")
        .filter(|l| l.len() == 9)
        .ok_or_else(|| head("there is no Lattice=\"…\" of nine numbers"))?;
    let origin = numbers("Origin").filter(|o| o.len() == 3).unwrap_or_else(|| vec![0.0; 3]);
    let periodic: Vec<bool> =
        value("pbc").unwrap_or("T T T").split_whitespace().map(|w| matches!(w, "T" | "1" | "True")).collect();
    let flag = |k: usize| periodic.get(k).copied().unwrap_or(true);
    let edges = Matrix3::from_columns(&[0, 3, 6].map(|k| Vector3::from_column_slice(&lattice[k..k + 3])));
    let domain = PeriodicBox::new([origin[0], origin[1], origin[2]], edges, [flag(0), flag(1), flag(2)])
        .map_err(|e| head(&e.to_string()))?;
    let columns = columns(value("Properties").unwrap_or("species:S:1:pos:R:3")).map_err(|m| head(&m))?;
    let at = |name: &str, width: usize| columns.iter().find(|c| c.0 == name && c.2 == width).map(|c| c.1);
    let pos = at("pos", 3).ok_or_else(|| head("there is no column pos:R:3"))?;
    let (species_at, velo, id) = (at("species", 1), at("velo", 3), at("id", 1));
    let width: usize = columns.iter().map(|c| c.2).sum();
    let mut this = Configuration {
        step: value("Step").and_then(|v| v.parse().ok()),
        time: value("Time").and_then(|v| v.parse().ok()),
        dimensions: 3,
        domain,
        names: Vec::new(),
        x: Vec::with_capacity(rows.len()),
        v: velo.map(|_| Vec::with_capacity(rows.len())),
        species: Vec::with_capacity(rows.len()),
        tag: Vec::with_capacity(rows.len()),
    };
    for (k, row) in rows.iter().enumerate() {
        let words: Vec<&str> = row.split_whitespace().collect();
        if words.len() != width {
            return Err((k + 1, format!("{} columns, Properties names {width}", words.len())));
        }
        let vector = |at: usize| -> Result<[f64; 3], Fault> {
            let mut vector = [0.0; 3];
            for (c, word) in vector.iter_mut().zip(&words[at..at + 3]) {
                *c = word
                    .parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .ok_or_else(|| (k + 1, format!("{word:?} is not a finite number")))?;
            }
            Ok(vector)
        };
        this.x.push(vector(pos)?);
        if let (Some(at), Some(v)) = (velo, &mut this.v) {
            v.push(vector(at)?);
        }
        let name = species_at.map_or("X", |at| words[at]);
        let name = name.strip_suffix('_').filter(|stem| name_of(stem) != *stem).unwrap_or(name);
        let species = this.names.iter().position(|n| n == name).unwrap_or_else(|| {
            this.names.push(name.to_owned());
            this.names.len() - 1
        });
        this.species.push(species as i32);
        let tag = id.map_or(Some(k as i32 + 1), |at| words[at].parse().ok());
        this.tag.push(tag.ok_or_else(|| (k + 1, "the id is not a whole number".to_owned()))?);
    }
    this.dimensions = super::configuration::dimensions_of(&this.x, this.domain.periodic());
    Ok(this)
}

/// The pairs `key=value`; a value may be quoted.
fn key_values(comment: &str) -> Vec<(String, String)> {
    let mut pairs = Vec::new();
    let mut rest = comment.trim();
    while let Some((key, after)) = rest.split_once('=') {
        let key = key.split_whitespace().last().unwrap_or("").to_owned();
        let after = after.trim_start();
        let (value, left) = match after.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => after.split_once(char::is_whitespace).unwrap_or((after, "")),
        };
        pairs.push((key, value.to_owned()));
        rest = left;
    }
    pairs
}

/// The name, first word and number of words of each column.
fn columns(properties: &str) -> Result<Vec<(String, usize, usize)>, String> {
    let words: Vec<&str> = properties.split(':').collect();
    let mut columns = Vec::new();
    let mut at = 0;
    for part in words.chunks(3) {
        let width = match part {
            [_, "S" | "R" | "I" | "L", width] => width.parse().ok().filter(|w| (1..=100).contains(w)),
            _ => None,
        };
        let width = width.ok_or_else(|| format!("Properties={properties} is not name:S|R|I|L:number …"))?;
        columns.push((part[0].to_owned(), at, width));
        at += width;
    }
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(names: &[String], domain: &PeriodicBox) -> String {
        let frame = Frame {
            step: 7,
            time: 0.07,
            dimensions: 3,
            domain,
            names,
            x: &[[0.1, 1.0 / 3.0, 2.5e-9], [1.5, -0.0, 2.0]],
            v: Some(&[[1e-300, -1.0, 0.5], [0.0, 2.0, 1.0 / 7.0]]),
            species: &[1, 0],
            tag: &[2, 1],
        };
        let mut text = Vec::new();
        write_xyz(&frame, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn what_is_written_reads_back_to_the_same_bits() {
        let edges = Matrix3::new(4.0, 1.0, 0.5, 0.0, 5.0, -1.0, 0.0, 0.0, 6.0);
        let domain = PeriodicBox::new([1.0, -2.0, 0.1], edges, [true, false, true]).unwrap();
        let names = ["A".to_owned(), "B".to_owned()];
        let text = frame(&names, &domain) + &frame(&names, &domain).replace("Step=7", "Step=8");
        let path = Path::new("f.xyz");
        let last = read_xyz(path, text.as_bytes(), None).unwrap().unwrap();
        assert_eq!(last.step, Some(8));
        let first = read_xyz(path, text.as_bytes(), Some(0)).unwrap().unwrap();
        assert_eq!((first.step, first.time), (Some(7), Some(0.07)));
        assert_eq!(first.domain, domain);
        assert_eq!(first.x, [[0.1, 1.0 / 3.0, 2.5e-9], [1.5, -0.0, 2.0]]);
        assert_eq!(first.v.unwrap(), [[1e-300, -1.0, 0.5], [0.0, 2.0, 1.0 / 7.0]]);
        assert_eq!(first.tag, [2, 1]);
        // Species are numbered in the order of appearance.
        assert_eq!((first.names, first.species), (vec!["B".to_owned(), "A".to_owned()], vec![0, 1]));
        assert!(read_xyz(path, text.as_bytes(), Some(2)).unwrap().is_none());
        // The last frame of a running simulation may be incomplete.
        let cut = &text.as_bytes()[..text.len() - 80];
        assert_eq!(read_xyz(path, cut, None).unwrap().unwrap().step, Some(7));
        assert!(read_xyz(path, cut, Some(1)).is_err());
    }

    #[test]
    fn nothing_repeats_along_z_in_two_dimensions() {
        let domain = PeriodicBox::orthogonal([0.0, 0.0, -0.5], [4.0, 5.0, 1.0], [true; 3]).unwrap();
        let x = [[1.0, 2.0, 0.0], [2.0, 2.5, 0.0]];
        let frame = Frame {
            step: 0,
            time: 0.0,
            dimensions: 2,
            domain: &domain,
            names: &["A".to_owned()],
            x: &x,
            v: None,
            species: &[0, 0],
            tag: &[1, 2],
        };
        let mut text = Vec::new();
        write_xyz(&frame, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        assert!(text.contains("pbc=\"T T F\""), "{text}");
        let read = read_xyz(Path::new("f"), text.as_bytes(), None).unwrap().unwrap();
        assert_eq!((read.dimensions, read.v), (2, None));
    }

    #[test]
    fn no_name_is_that_of_an_element() {
        for (name, written) in
            [("F", "F_"), ("he", "he_"), ("A", "A"), ("oil phase", "oil_phase"), ("F_", "F_")]
        {
            assert_eq!(name_of(name), written);
        }
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let text = frame(&["F".to_owned(), "B2".to_owned()], &domain);
        assert!(text.contains("\nF_ "), "{text}");
        let read = read_xyz(Path::new("f"), text.as_bytes(), None).unwrap().unwrap();
        assert!(read.names.contains(&"F".to_owned()), "{:?}", read.names);
    }

    #[test]
    fn faults_name_the_line() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [2.0; 3], [true; 3]).unwrap();
        let good = frame(&["A".into(), "B".into()], &domain);
        let cases = [
            (good.replace("Lattice", "Lettuce"), "line 2: there is no Lattice"),
            (good.replace("pos:R:3", "pos:R:2"), "line 2: there is no column pos"),
            (good.replace("0.1 ", "nan "), "line 3: \"nan\""),
            (good.replace("A 1.5", "A 1.5 1.5"), "line 4: 10 columns"),
            (good.replacen('2', "two", 1), "line 1: expected a number"),
            (good.replacen('2', "3", 1), "ends within a frame"),
            (good.replacen('2', "18446744073709551615", 1), "ends within a frame"),
            (good.replace("id:I:1", "id:Q:1"), "line 2: Properties"),
        ];
        for (text, message) in cases {
            let error = read_xyz(Path::new("f.xyz"), text.as_bytes(), None).unwrap_err().to_string();
            assert!(error.contains(message) && error.starts_with("f.xyz"), "{error}, not {message}");
        }
    }
}
