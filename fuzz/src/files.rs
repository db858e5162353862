use psidpd::checkpoint::{Checkpoint, VERSION, parse};
use psidpd::lammps::data::DataFile;
use psidpd::lammps::dump::DumpReader;
use psidpd::observe::Observers;
use psidpd::run::Simulation;
use psidpd_core::model::Model;
use std::path::Path;

/// Any text is a LAMMPS data file or an error; what was read and can be written is read again as the same.
pub fn data(text: &str) {
    let Ok(data) = DataFile::parse(text) else { return };
    let mut written = Vec::new();
    if data.write_to(&mut written).is_ok() {
        let again = DataFile::parse(&String::from_utf8_lossy(&written));
        let again = again.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.atoms.len(), data.atoms.len());
        assert_eq!((again.types, again.masses), (data.types, data.masses));
    }
}

/// Any bytes are frames of a LAMMPS dump, or end in an error.
pub fn dump(bytes: &[u8]) {
    for frame in DumpReader::new(bytes) {
        let Ok(mut frame) = frame else { return };
        let width = frame.rows().map(<[f64]>::len).next().unwrap_or(0);
        assert!(frame.rows().all(|row| row.len() == width));
        frame.sort_by_id();
        let _ = frame.vectors(["x", "y", "z"]);
    }
}

/// Any bytes are a checkpoint or an error: as a file, and as what is in one whose header is right. What was read can be
/// used, or is an error.
pub fn checkpoint(bytes: &[u8]) {
    used(parse(bytes, Path::new("fuzz")).ok());
    let mut file = b"psidpdCK".to_vec();
    file.extend(VERSION.to_le_bytes());
    file.extend(crc32fast::hash(bytes).to_le_bytes());
    file.extend((bytes.len() as u64).to_le_bytes());
    file.extend(bytes);
    used(parse(&file, Path::new("fuzz")).ok());
}

fn used(checkpoint: Option<Checkpoint>) {
    let Some(checkpoint) = checkpoint else { return };
    if checkpoint.state.len() <= 1000 {
        let model = Model::parse("m.toml", "title = \"m\"\nspecies = [\"A\"]\n").expect("a model");
        let _ = Simulation::new(&model, 1.0, checkpoint.state, 1);
    }
    // What they have seen is only of use with the scene that they belong to.
    let _ = Observers::from_bytes(&checkpoint.observers);
}
