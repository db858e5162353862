//! The files that get all particles at intervals. A thread of its own may write a frame while the run makes the next steps.

use super::RunError;
use super::growing::GrowingFile;
use crate::checkpoint::{Checkpoint, Written};
use crate::particles::State;
use crate::scene::{Scene, every};
use psidpd_core::model::kernel::Kernel;
use psidpd_formats::dump::write_dump;
use psidpd_formats::files::PathError;
use psidpd_formats::{Frame, GsdFile, write_xyz};
use psidpd_pictures::{write_snapshot, write_vtk};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::thread::{Builder, JoinHandle};

pub(super) const DUMP: &str = "dump.lammpstrj";
pub(super) const XYZ: &str = "trajectory.xyz";
pub(super) const GSD: &str = "trajectory.gsd";

/// Frames of fewer particles are written at once: a thread takes as long to start.
const FEW: usize = 1000;

/// Writes frames beside the steps, one at a time and in their order.
pub(super) struct Frames {
    /// `None` while a thread has them, and once no thread could be started for them.
    files: Option<Files>,
    folder: PathBuf,
    writing: Option<JoinHandle<(Files, Result<(), RunError>)>>,
    /// What was written of the growing files when it was last noted; `None` if a frame before that could not be written.
    noted: Option<BTreeMap<String, Written>>,
    /// Whether it was noted since the frame that is being written was given away.
    notes: bool,
    /// Whether a frame could not be written.
    failed: bool,
}

impl Frames {
    pub fn create(scene: &Scene, folder: &Path) -> Result<Frames, RunError> {
        let create = |every: u64, name| (every > 0).then(|| GrowingFile::create(folder, name)).transpose();
        let (dump, xyz) = (create(scene.output.dump, DUMP)?, create(scene.output.xyz, XYZ)?);
        let gsd = open_gsd(scene, folder, |path, every| GsdFile::create(path, frames(scene, every)))?;
        Frames::of(scene, folder, dump, xyz, gsd)
    }

    /// Opens the files of a resumed run and truncates them to what was written at its checkpoint.
    pub fn reopen(scene: &Scene, folder: &Path, checkpoint: &Checkpoint) -> Result<Frames, RunError> {
        let Checkpoint { step, position, ref files, .. } = *checkpoint;
        let (dump, xyz) =
            (GrowingFile::reopen(folder, DUMP, files)?, GrowingFile::reopen(folder, XYZ, files)?);
        // Frames begin with the initial state, once its forces are known.
        let begun = step > 0 || position.entered;
        let gsd = open_gsd(scene, folder, |path, every| {
            GsdFile::reopen(path, if begun { 1 + step / every } else { 0 }, frames(scene, every))
        })?;
        Frames::of(scene, folder, dump, xyz, gsd)
    }

    fn of(
        scene: &Scene,
        folder: &Path,
        dump: Option<GrowingFile>,
        xyz: Option<GrowingFile>,
        gsd: Option<(PathBuf, GsdFile)>,
    ) -> Result<Frames, RunError> {
        let files = Files {
            folder: folder.to_owned(),
            intervals: scene.output,
            dimensions: scene.model.dimensions(),
            names: scene.model.species().to_vec(),
            masses: scene.mass.clone(),
            kernel: scene.model.at(scene.kt)?.densities.first().map(|d| d.kernel),
            dump,
            xyz,
            gsd,
        };
        let (folder, files) = (folder.to_owned(), Some(files));
        Ok(Frames { files, folder, writing: None, noted: None, notes: false, failed: false })
    }

    /// Writes the particles to the files that are due after a step, at once or `beside` the next steps; the error may be that of the
    /// frame before. `time` is measured from the start of the run.
    pub fn write(&mut self, step: u64, time: f64, state: Cow<State>, beside: bool) -> Result<(), RunError> {
        self.wait()?;
        let Some(mut files) = self.files.take() else { return Err(self.missing()) };
        if !beside || state.len() < FEW {
            let done = files.write(step, time, &state);
            return self.take_back(files, done);
        }
        let state = state.into_owned();
        let write = move || {
            let done = files.write(step, time, &state);
            (files, done)
        };
        let thread = Builder::new().name("psidpd-output".into()).spawn(write);
        self.writing = Some(thread.map_err(PathError::at("write", &self.folder))?);
        Ok(())
    }

    fn missing(&self) -> RunError {
        PathError::at("write", &self.folder)(io::Error::other("a frame is missing")).into()
    }

    /// Waits for the frame that is being written.
    pub fn wait(&mut self) -> Result<(), RunError> {
        let Some(writing) = self.writing.take() else { return Ok(()) };
        let (files, done) = writing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        self.take_back(files, done)
    }

    fn take_back(&mut self, files: Files, done: Result<(), RunError>) -> Result<(), RunError> {
        self.failed |= done.is_err();
        self.files = Some(files);
        if std::mem::take(&mut self.notes) {
            self.note();
        }
        done
    }

    /// Notes what is written of the growing files, all frames so far included.
    pub fn note(&mut self) {
        self.notes = self.writing.is_some();
        if let Some(files) = &self.files {
            self.noted = (!self.failed).then(|| files.written());
        }
    }

    /// Syncs all files to the disk, and returns what was written of the growing ones when it was last noted.
    pub fn sync(&mut self) -> Result<BTreeMap<String, Written>, RunError> {
        self.wait()?;
        let Some(files) = &mut self.files else { return Err(self.missing()) };
        files.sync()?;
        self.noted.clone().ok_or_else(|| self.missing())
    }
}

impl Drop for Frames {
    /// No thread writes after the run.
    fn drop(&mut self) {
        if let Some(writing) = self.writing.take() {
            let _ = writing.join();
        }
    }
}

struct Files {
    folder: PathBuf,
    intervals: crate::scene::Output,
    dimensions: usize,
    names: Vec<String>,
    masses: Vec<f64>,
    /// The weight function of the density that is drawn.
    kernel: Option<Kernel>,
    dump: Option<GrowingFile>,
    xyz: Option<GrowingFile>,
    gsd: Option<(PathBuf, GsdFile)>,
}

impl Files {
    fn write(&mut self, step: u64, time: f64, state: &State) -> Result<(), RunError> {
        let frame = &Frame {
            step,
            time,
            dimensions: self.dimensions,
            domain: &state.domain,
            names: &self.names,
            x: &state.x,
            v: Some(&state.v),
            species: &state.species,
            tag: &state.tag,
        };
        let intervals = self.intervals;
        if let Some(file) = self.dump.as_mut().filter(|_| every(intervals.dump, step)) {
            file.attempt(|file| write_dump(frame, file))?;
        }
        if let Some(file) = self.xyz.as_mut().filter(|_| every(intervals.xyz, step)) {
            file.attempt(|file| write_xyz(frame, file))?;
        }
        if let Some((path, file)) = self.gsd.as_mut().filter(|_| every(intervals.gsd, step)) {
            file.write(frame, &self.masses).map_err(PathError::at("write", path))?;
        }
        if every(intervals.vtk, step) {
            write_vtk(&self.folder, frame, self.kernel)?;
        }
        if every(intervals.snapshot, step) {
            write_snapshot(&self.folder, frame)?;
        }
        Ok(())
    }

    /// The record of each file that grows at its end alone.
    fn written(&self) -> BTreeMap<String, Written> {
        [&self.dump, &self.xyz].into_iter().flatten().map(GrowingFile::record).collect()
    }

    fn sync(&mut self) -> Result<(), PathError> {
        if let Some((path, file)) = &self.gsd {
            file.sync().map_err(PathError::at("write", path))?;
        }
        [&mut self.dump, &mut self.xyz].into_iter().flatten().try_for_each(GrowingFile::sync)
    }
}

/// The number of frames of a run at an interval.
fn frames(scene: &Scene, every: u64) -> u64 {
    1 + scene.steps() / every
}

fn open_gsd(
    scene: &Scene,
    folder: &Path,
    open: impl FnOnce(&Path, u64) -> io::Result<GsdFile>,
) -> Result<Option<(PathBuf, GsdFile)>, PathError> {
    let every = scene.output.gsd;
    if every == 0 {
        return Ok(None);
    }
    let path = folder.join(GSD);
    let file = open(&path, every).map_err(PathError::at("write", &path))?;
    Ok(Some((path, file)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::{SET6, scene};
    use std::fs::{read, read_dir, write};

    fn crowd() -> Scene {
        let text = "model = \"m.toml\"\nkT = 1.0\nbox = [5.0, 6.0, 7.0]\ndensity = 6.05\ndt = 0.01\nsteps = 8\n\
                    [output]\ndump = 1\nxyz = 2\ngsd = 3\nvtk = 4\nsnapshot = 8\n";
        let scene = scene(SET6, text).unwrap();
        assert!(scene.initial.count() > FEW);
        scene
    }

    /// Particles that differ in every step.
    fn moved(scene: &Scene, step: u64) -> State {
        let mut state = scene.initial_state();
        state.v.iter_mut().for_each(|v| v[0] += step as f64);
        state
    }

    /// Writes steps, and notes what is written after step 4.
    fn write_all(folder: &Path, beside: bool) -> BTreeMap<String, Written> {
        let scene = crowd();
        let mut frames = Frames::create(&scene, folder).unwrap();
        for step in 0..=8 {
            frames.write(step, 0.01 * step as f64, Cow::Owned(moved(&scene, step)), beside).unwrap();
            assert_eq!(frames.writing.is_some(), beside);
            if step == 4 {
                frames.note();
            }
        }
        frames.sync().unwrap()
    }

    fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let entries = read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let one = |path: PathBuf| match path.is_dir() {
            true => contents(&path),
            false => BTreeMap::from([(path.file_name().unwrap().into(), read(&path).unwrap())]),
        };
        entries.flat_map(one).collect()
    }

    /// Frames beside the steps are those at once, and what is noted is what was written up to then, however far the writing was.
    #[test]
    fn frames_are_the_same_beside_the_steps() {
        let [at_once, beside] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let [a, b] = [write_all(at_once.path(), false), write_all(beside.path(), true)];
        assert_eq!(a, b);
        let (x, y) = (contents(at_once.path()), contents(beside.path()));
        assert_eq!(x.keys().collect::<Vec<_>>(), y.keys().collect::<Vec<_>>());
        assert_eq!(x.len(), 3 + 2 * 3 + 2);
        assert!(x == y);
        let file = std::fs::File::open(beside.path().join(DUMP)).unwrap();
        let noted = a[DUMP];
        assert_eq!(Written::of(file, noted.length).unwrap(), noted);
        let dump = String::from_utf8(x[Path::new(DUMP)][..noted.length as usize].to_vec()).unwrap();
        assert_eq!(dump.matches("ITEM: TIMESTEP").count(), 5);
    }

    /// A frame that cannot be written is told at the next one, and nothing that is noted after it may stand in a checkpoint.
    #[test]
    fn a_frame_that_fails_is_told_and_not_noted() {
        for noted_before in [true, false] {
            let (folder, scene) = (tempfile::tempdir().unwrap(), crowd());
            let mut frames = Frames::create(&scene, folder.path()).unwrap();
            write(folder.path().join("vtk"), "no folder").unwrap();
            let put =
                |frames: &mut Frames, step| frames.write(step, 0.0, Cow::Owned(moved(&scene, step)), true);
            put(&mut frames, 3).unwrap();
            frames.note();
            put(&mut frames, 4).unwrap();
            if !noted_before {
                frames.note();
            }
            let error = put(&mut frames, 5).unwrap_err();
            assert!(error.is_output() && error.to_string().contains("vtk"), "{error}");
            match noted_before {
                true => assert_eq!(frames.sync().unwrap().len(), 2),
                false => assert!(frames.sync().is_err()),
            }
            frames.note();
            assert!(frames.sync().is_err());
            // As after a thread that could not be started.
            frames.files = None;
            assert!(frames.sync().is_err() && put(&mut frames, 6).is_err());
        }
    }
}
