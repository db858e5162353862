use crate::checkpoint::Written;
use psidpd_formats::files::{PathError, create_inside, open_inside_to_write};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file that grows during a run. It records what was written to it, buffered bytes included, so that a
/// checkpoint can state which part belongs to the completed steps.
pub(super) struct GrowingFile {
    name: &'static str,
    path: PathBuf,
    out: BufWriter<File>,
    pub written: Written,
}

impl GrowingFile {
    pub fn create(folder: &Path, name: &'static str) -> Result<GrowingFile, PathError> {
        let path = folder.join(name);
        let file = create_inside(&path).map_err(PathError::at("write", &path))?;
        Ok(GrowingFile { name, path, out: BufWriter::new(file), written: Written::default() })
    }

    /// Opens the file of a resumed run and truncates it to the bytes that were written at the checkpoint; `None` if it has no record.
    pub fn reopen(
        folder: &Path,
        name: &'static str,
        records: &BTreeMap<String, Written>,
    ) -> Result<Option<GrowingFile>, PathError> {
        let Some(written) = records.get(name).copied() else { return Ok(None) };
        let path = folder.join(name);
        let open = || {
            let mut file = open_inside_to_write(&path)?;
            file.set_len(written.length)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        let file = open().map_err(PathError::at("write", &path))?;
        Ok(Some(GrowingFile { name, path, out: BufWriter::new(file), written }))
    }

    /// Its name, and what is written of it.
    pub fn record(&self) -> (String, Written) {
        (self.name.to_owned(), self.written)
    }

    /// Calls `write`; an error names the file.
    pub fn attempt(&mut self, write: impl FnOnce(&mut Self) -> io::Result<()>) -> Result<(), PathError> {
        write(self).map_err(PathError::at("write", &self.path))
    }

    /// Writes a line and flushes it, so that other programs can follow the file.
    pub fn line(&mut self, text: &str) -> Result<(), PathError> {
        self.attempt(|file| writeln!(file, "{text}").and_then(|()| file.flush()))
    }

    pub fn sync(&mut self) -> Result<(), PathError> {
        self.attempt(|file| {
            file.out.flush()?;
            file.out.get_ref().sync_data()
        })
    }
}

impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.out.write(bytes)?;
        self.written.add(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
