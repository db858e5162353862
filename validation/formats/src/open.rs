//! Reading a configuration from a file of any format.

use super::configuration::{dimensions_of, domain};
use super::{Configuration, FormatError, PathError, read_xyz};
use crate::data::DataFile;
use crate::dump::{self, DumpReader};
use crate::gsd::{is_gsd, read_gsd};
use psidpd_core::document::open_regular;
use std::io::{BufRead, BufReader};
use std::path::Path;

impl Configuration {
    /// Reads a LAMMPS data file, a LAMMPS text dump, an extended XYZ file or psidpd's own GSD; the content tells the format. The
    /// frame is the one with a number, counted from 0, or the last complete frame.
    pub fn open(path: &Path, number: Option<usize>) -> Result<Configuration, FormatError> {
        if let Some(found) = Configuration::find(path, number)? {
            return Ok(found);
        }
        let mut message = "there is no frame".to_owned();
        if let Some(n) = number {
            message += &format!(" {n}");
            let low = last_between(path, 0, n);
            if n > 0 && matches!(Configuration::find(path, Some(low)), Ok(Some(_))) {
                message += &format!("; the first one is 0, the last one {low}");
            }
        }
        Err(FormatError::content(path)(message))
    }

    /// The number of complete frames in a file.
    pub fn count(path: &Path) -> Result<usize, FormatError> {
        Configuration::open(path, None)?;
        let mut above = 1;
        while matches!(Configuration::find(path, Some(above)), Ok(Some(_))) {
            above *= 2;
        }
        Ok(last_between(path, above / 2, above) + 1)
    }

    /// Finds a frame by its number, or the last frame; `None` if the file does not have it.
    fn find(path: &Path, number: Option<usize>) -> Result<Option<Configuration>, FormatError> {
        let mut file = BufReader::new(open_regular(path).map_err(PathError::at("read", path))?);
        // Trajectories may be larger than memory, so their frames are read one by one.
        let start = file.fill_buf().map_err(PathError::at("read", path))?;
        if is_gsd(start) {
            return Ok(read_gsd(path, file.get_ref(), number)?.filter(|c| !c.x.is_empty()));
        }
        let start = String::from_utf8_lossy(start);
        let first = start.lines().find(|l| !l.trim().is_empty()).unwrap_or("").trim().to_owned();
        let found = if first.starts_with("ITEM:") {
            let found = last_or_nth(path, file, number)?.map(|f| from_dump(&f));
            found.transpose().map_err(FormatError::content(path))?
        } else if first.parse::<usize>().is_ok() {
            read_xyz(path, file, number)?
        } else if number.is_none_or(|n| n == 0) {
            Some(from_data(&DataFile::read(path)?).map_err(FormatError::content(path))?)
        } else {
            None
        };
        Ok(found.filter(|c| !c.x.is_empty()))
    }
}

/// The number of the last complete frame from `low` on and before `above`. All frames before it are complete.
fn last_between(path: &Path, mut low: usize, mut above: usize) -> usize {
    while above - low > 1 {
        let middle = low + (above - low) / 2;
        match Configuration::find(path, Some(middle)) {
            Ok(Some(_)) => low = middle,
            _ => above = middle,
        }
    }
    low
}

/// Without a number this is the last complete frame, because a run that is still going may be in the middle of the next.
fn last_or_nth(
    path: &Path,
    input: impl BufRead,
    which: Option<usize>,
) -> Result<Option<dump::Frame>, FormatError> {
    let mut found = None;
    for (number, frame) in DumpReader::new(input).enumerate() {
        match frame {
            Ok(frame) if which.is_none_or(|n| n == number) => {
                found = Some(frame);
                if which.is_some() {
                    break;
                }
            }
            Ok(_) => {}
            Err(_) if which.is_none() && found.is_some() => break,
            Err(fault) => return Err(FormatError::content(path)(fault)),
        }
    }
    Ok(found)
}

fn type_names(types: usize) -> Vec<String> {
    (1..=types).map(|k| k.to_string()).collect()
}

/// The title of a data file may name the periodic directions. Without them all are periodic, except z of a flat box.
fn from_data(data: &DataFile) -> Result<Configuration, String> {
    let x: Vec<[f64; 3]> = data.atoms.iter().map(|a| a.x).collect();
    let dimensions = dimensions_of(&x, [true, true, false]);
    let periodic = data.boundary().unwrap_or([true, true, dimensions == 3]);
    Ok(Configuration {
        step: None,
        time: None,
        dimensions,
        domain: domain(data.boxlo, data.boxhi, data.tilt, periodic)?,
        names: type_names(data.types),
        x,
        v: data.velocities.clone(),
        species: data.atoms.iter().map(|a| a.kind as i32 - 1).collect(),
        tag: data.atoms.iter().map(|a| a.id as i32).collect(),
    })
}

fn from_dump(frame: &dump::Frame) -> Result<Configuration, String> {
    let mut periodic = [true; 3];
    for (flag, word) in periodic.iter_mut().zip(frame.boundary.split_whitespace()) {
        *flag = word == "pp";
    }
    let domain = domain(frame.boxlo, frame.boxhi, frame.tilt, periodic)?;
    let x = match (frame.vectors(["x", "y", "z"]), frame.vectors(["xu", "yu", "zu"])) {
        (Some(x), _) | (None, Some(x)) => x,
        _ => match frame.vectors(["xs", "ys", "zs"]) {
            Some(s) => s.into_iter().map(|s| domain.point(s)).collect(),
            None => return Err("the dump has no columns x y z, xu yu zu or xs ys zs".into()),
        },
    };
    if x.iter().flatten().any(|c| !c.is_finite()) {
        return Err("a position is not finite".into());
    }
    let count = x.len();
    let types = frame.get("type").unwrap_or_else(|| vec![1.0; count]);
    if types.iter().any(|t| !(1.0..=1e6).contains(t)) {
        return Err("a type is not a number from 1".into());
    }
    let most = types.iter().fold(1.0, |a: f64, b| a.max(*b));
    let tag = frame.get("id").unwrap_or_else(|| (1..=count).map(|k| k as f64).collect());
    Ok(Configuration {
        step: u64::try_from(frame.step).ok(),
        time: frame.time,
        dimensions: dimensions_of(&x, periodic),
        domain,
        names: type_names(most as usize),
        x,
        v: frame.vectors(["vx", "vy", "vz"]),
        species: types.iter().map(|t| *t as i32 - 1).collect(),
        tag: tag.iter().map(|t| *t as i32).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Frame;
    use crate::data::Atom;
    use crate::dump::write_dump;
    use psidpd_core::engine::PeriodicBox;

    #[test]
    fn the_same_particles_come_out_of_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let x = vec![[0.5, 1.0, 2.0], [3.0, 0.25, 1.0 / 3.0]];
        let v = vec![[0.1, 0.2, 0.3], [-1.0, 0.0, 1.0]];
        let domain = PeriodicBox::orthogonal([0.0, 0.0, -1.0], [4.0, 5.0, 6.0], [true; 3]).unwrap();
        let (species, tag, names) = (vec![0, 1], vec![5, 3], ["A".to_owned(), "B".to_owned()]);
        let atom = |k: usize| Atom { id: [5, 3][k], kind: [1, 2][k], x: x[k], image: [0; 3] };
        let data = DataFile {
            title: "title".into(),
            boxlo: [0.0, 0.0, -1.0],
            boxhi: [4.0, 5.0, 5.0],
            tilt: None,
            types: 2,
            masses: vec![1.0, 2.0],
            names: Vec::new(),
            atoms: vec![atom(0), atom(1)],
            velocities: Some(v.clone()),
        };
        let direct = Configuration {
            step: None,
            time: None,
            dimensions: 3,
            domain,
            names: names.to_vec(),
            x: x.clone(),
            v: Some(v.clone()),
            species,
            tag,
        };
        let path = |name: &str| folder.path().join(name);
        data.write(&path("a.data")).unwrap();
        let mut file = std::fs::File::create(path("a.xyz")).unwrap();
        super::super::write_xyz(&direct.frame(), &mut file).unwrap();
        let mut file = std::fs::File::create(path("a.dump")).unwrap();
        for step in [0, 9] {
            write_dump(&Frame { step, ..direct.frame() }, &mut file).unwrap();
        }
        drop(file);
        for name in ["a.data", "a.xyz", "a.dump"] {
            let mut read = Configuration::open(&path(name), None).unwrap();
            read.name_species(&names, 3);
            read.step = None;
            read.time = None;
            assert_eq!(read, direct, "{name}");
        }
        // Walls that the title of a data file names stay open: nothing is mirrored there.
        data.with_boundary([true, false, true]).write(&path("walls.data")).unwrap();
        let walls = Configuration::open(&path("walls.data"), None).unwrap();
        assert_eq!(walls.domain.periodic(), [true, false, true]);
        assert_eq!(Configuration::open(&path("a.dump"), Some(0)).unwrap().step, Some(0));
        for name in ["a.data", "a.xyz", "a.dump"] {
            let error = Configuration::open(&path(name), Some(2)).unwrap_err().to_string();
            assert!(error.contains("no frame 2"), "{error}");
        }
        let whole = std::fs::read(path("a.dump")).unwrap();
        std::fs::write(path("cut.dump"), &whole[..whole.len() - 30]).unwrap();
        assert_eq!(Configuration::open(&path("cut.dump"), None).unwrap().step, Some(0));
        assert!(Configuration::open(&path("cut.dump"), Some(1)).is_err());
        assert!(Configuration::open(&path("none"), None).is_err());
        std::fs::write(path("rubbish"), "what is this\n").unwrap();
        assert!(Configuration::open(&path("rubbish"), None).is_err());
    }
}
