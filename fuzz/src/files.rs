use psidpd::formats::data::DataFile;
use psidpd::formats::dump::DumpReader;

/// Any text is a LAMMPS data file or an error. A file that was read and can be written is read again as the same.
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
