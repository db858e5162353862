//! Starts from files of another run.

use super::{FileError, Model, Path, PathBuf, PeriodicBox, Section, State, Tags, Velocities};
use crate::checkpoint;
use nalgebra::{Matrix3, Vector3};
use psidpd_formats::data::DataFile;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Data,
    /// A checkpoint, or the folder of a run with a checkpoint.
    Checkpoint,
}

impl Format {
    pub fn of(kind: &str) -> Option<Format> {
        match kind {
            "data" => Some(Format::Data),
            "checkpoint" => Some(Format::Checkpoint),
            _ => None,
        }
    }
}

/// Reads the particles and the box of a file. `periodic` sets the boundaries. Without it, a checkpoint keeps
/// its boundaries, and so does a data file that names walls; other data files are periodic.
pub fn open(
    format: Format,
    path: &Path,
    model: &Model,
    periodic: Option<[bool; 3]>,
) -> Result<State, String> {
    match format {
        Format::Data => {
            let data = DataFile::read(path).map_err(|e| e.to_string())?;
            let periodic = periodic.or(data.boundary()).unwrap_or([true; 3]);
            State::from_data_in(&data, model, periodic).map_err(|e| e.to_string())
        }
        Format::Checkpoint => {
            let state = checkpoint::read_state(path).map_err(|e| e.to_string())?;
            let periodic = periodic.unwrap_or_else(|| state.domain.periodic());
            let edges = Matrix3::from_columns(&[0, 1, 2].map(|k| Vector3::from(state.domain.edge(k))));
            let domain =
                PeriodicBox::new(state.domain.origin(), edges, periodic).map_err(|e| e.to_string())?;
            let state = State { domain, ..state };
            match state.fault(model.species().len(), model.dimensions()) {
                Some(fault) => Err(format!("is not a state of this model: {fault}")),
                None => Ok(state),
            }
        }
    }
}

pub struct Saved {
    pub path: PathBuf,
    pub state: State,
    /// The distribution of new velocities; `None` keeps the velocities of the file.
    pub velocities: Option<Velocities>,
    pub frozen: Tags,
}

pub fn read(
    section: &Section,
    format: Format,
    model: &Model,
    base: &Path,
    periodic: Option<[bool; 3]>,
) -> Result<Saved, FileError> {
    let value = section.require("file")?;
    let path = base.join(value.string()?.value);
    let state = open(format, &path, model, periodic)
        .map_err(|why| value.error(why).with_help("the path is relative to the scene file"))?;
    Ok(Saved {
        velocities: Velocities::read_or_keep(section, format == Format::Checkpoint)?,
        frozen: read_frozen(section, &state)?,
        path,
        state,
    })
}

fn read_frozen(section: &Section, state: &State) -> Result<Tags, FileError> {
    let Some(value) = section.get("frozen_ids") else { return Ok(Tags::none()) };
    let wrong = |message: String| value.error(message);
    let ids: Vec<u64> = value.array()?.iter().map(|v| v.count()).collect::<Result<_, _>>()?;
    let [first, last] = ids[..] else {
        return Err(wrong(format!(
            "expected the first and the last id, found an array of length {}",
            ids.len()
        )));
    };
    let (Ok(first), Ok(last)) = (i32::try_from(first), i32::try_from(last)) else {
        return Err(wrong(format!("{last} exceeds the largest id, 2147483647")));
    };
    let tags = Tags::Ranges(vec![first..=last]);
    match state.tag.iter().filter(|t| tags.contain(**t)).count() {
        0 => Err(wrong(format!("no particle of the file has an id from {first} to {last}"))),
        all if all == state.len() => Err(wrong("every particle is frozen: nothing would move".into())),
        _ => Ok(tags),
    }
}
