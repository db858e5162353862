use super::*;
use crate::scene::Scene;
use psidpd_core::engine::PeriodicBox;
use psidpd_core::engine::thermostat::Pulls;
use psidpd_observe::flux::{Drag, Line};
use std::io::{self, Cursor, Seek, SeekFrom, Write};

/// Numbers that a conversion may get wrong.
const HARD: [f64; 3] = [-0.0, 5e-324, 0.1 + 0.2];

fn read(path: &Path) -> Result<Checkpoint, CheckpointError> {
    let file = std::fs::File::open(path).map_err(CheckpointError::unreadable(path))?;
    format::read(file, path)
}

fn checkpoint(step: u64) -> Checkpoint {
    let pulls = Pulls {
        i: vec![0, u32::MAX],
        d: [HARD[..2].to_vec(), vec![0.1; 2], vec![0.2; 2]],
        strengths: HARD[1..].to_vec(),
    };
    let drag = Drag {
        sum: [0.3; 6],
        x: vec![HARD; 2],
        pairs: vec![pulls, Pulls::default()],
        friction: vec![Line { from: HARD, d: HARD, f: HARD }],
    };
    Checkpoint {
        instructions: "portable".into(),
        program: "1.2.3".into(),
        identity: Identity::default(),
        finished: false,
        step,
        position: Position { stage: 0, entered: true, done: step, begin: 0.0, time: 0.3 },
        state: State {
            domain: PeriodicBox::orthogonal([0.1, 0.2, 0.3], [3.0, 1.0 / 3.0, 5.0], [true, false, true])
                .unwrap(),
            mass: vec![1.0, 0.1],
            x: vec![HARD, [1.0, 2.0, 3.0]],
            v: vec![[f64::MAX, f64::MIN_POSITIVE, -1.0]; 2],
            species: vec![0, 1],
            tag: vec![i32::MAX, 1],
            image: vec![[0, -1, i32::MIN]; 2],
        },
        forces: vec![HARD; 2],
        held: Held { virial: [0.1; 6], drag: vec![Arc::new(drag)] },
        max_move: Some(0.1),
        out_of_bounds: [u64::MAX, 0],
        last: None,
        sums: Sums::default(),
        before_end: Some(BeforeEnd {
            sums: Sums::default(),
            last: None,
            rows: Some(Written { length: u64::MAX, checksum: 7 }),
        }),
        files: [("thermo.csv".to_owned(), Written { length: 3, checksum: u32::MAX })].into(),
        observers: vec![1, 2, 3],
    }
}

fn bytes_of(checkpoint: &Checkpoint) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    format::write(checkpoint, &mut bytes).unwrap();
    bytes.into_inner()
}

fn any(_: &Checkpoint) -> Result<(), CheckpointError> {
    Ok(())
}

#[test]
fn every_bit_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c");
    let mut written = checkpoint(7);
    written.forces[0] = [f64::NAN, f64::NEG_INFINITY, 0.0];
    std::fs::write(&path, bytes_of(&written)).unwrap();
    let read = read(&path).unwrap();
    let bits = |a: &[[f64; 3]]| a.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&read.forces), bits(&written.forces));
    assert_eq!(bits(&read.state.x), bits(&written.state.x));
    assert_eq!(bits(&read.state.v), bits(&written.state.v));
    assert_eq!(read.state, written.state);
    assert_eq!(bytes_of(&read), bytes_of(&written));
    assert_eq!(read_state(&path).unwrap(), written.state);
}

/// A file truncated at any length, or with any bit changed, is refused, and the error names the fault.
#[test]
fn no_damage_goes_unnoticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c");
    let whole = bytes_of(&checkpoint(7));
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        read(&path)
    };
    read(&whole).unwrap();
    for length in 0..whole.len() {
        match read(&whole[..length]) {
            Err(CheckpointError::Truncated { found, expected, .. }) => {
                assert_eq!(found, length as u64);
                assert!(expected > found);
            }
            other => panic!("{length} bytes: {other:?}"),
        }
    }
    for at in 0..whole.len() {
        for bit in [1, 128] {
            let mut wrong = whole.clone();
            wrong[at] ^= bit;
            let error = read(&wrong).expect_err("a bit is wrong");
            let expected = match at {
                0..8 => matches!(error, CheckpointError::Other { .. }),
                8..12 => matches!(error, CheckpointError::Version { .. }),
                _ => {
                    matches!(error, CheckpointError::Damaged { .. } | CheckpointError::Truncated { .. })
                }
            };
            assert!(expected, "byte {at}: {error}");
        }
    }
    let longer = [whole.as_slice(), b"x"].concat();
    assert!(matches!(read(&longer), Err(CheckpointError::Damaged { .. })));
    let text = read(b"title = \"a scene, and longer than any header\"\n").unwrap_err().to_string();
    assert!(text.ends_with("c is not a checkpoint of psidpd"), "{text}");
    let error = self::read(&folder.path().join("none")).unwrap_err();
    assert!(matches!(error, CheckpointError::Unreadable { .. }), "{error}");
}

/// A payload that postcard accepts can still be invalid: lengths beyond the end, boxes without volume.
#[test]
fn payloads_that_are_none_are_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c");
    let mut random = 1u32;
    for length in 0..200usize {
        let payload: Vec<u8> = (0..length)
            .map(|_| {
                random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (random >> 24) as u8
            })
            .collect();
        let mut bytes = b"psidpdCK".to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(crc32fast::hash(&payload).to_le_bytes());
        bytes.extend((length as u64).to_le_bytes());
        bytes.extend(payload);
        std::fs::write(&path, bytes).unwrap();
        assert!(matches!(read(&path), Err(CheckpointError::Damaged { .. })), "{length}");
    }
}

/// A disk with room for `room` bytes.
struct Disk {
    room: usize,
    file: Cursor<Vec<u8>>,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let left = self.room - self.file.position() as usize;
        if left == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.file.write(&bytes[..bytes.len().min(left)])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[test]
fn a_full_disk_is_told_as_such() {
    let whole = bytes_of(&checkpoint(7));
    for room in 0..whole.len() {
        let disk = Disk { room, file: Cursor::default() };
        let error = format::write(&checkpoint(7), disk).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull, "{room}");
    }
    format::write(&checkpoint(7), Disk { room: whole.len(), file: Cursor::default() }).unwrap();
}

#[test]
fn the_one_before_is_kept_and_found() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path());
    assert!(!store.exists() && store.find(any).unwrap().is_none());
    assert!(matches!(read_state(folder.path()), Err(CheckpointError::Unreadable { .. })));
    store.write(&checkpoint(1)).unwrap();
    store.write(&checkpoint(2)).unwrap();
    let step = |store: &Store| store.find(any).unwrap().unwrap().checkpoint.step;
    assert_eq!(step(&store), 2);
    // The run was killed while it wrote the next checkpoint.
    std::fs::write(folder.path().join("checkpoint.new"), "psid").unwrap();
    assert_eq!(step(&store), 2);
    // The run was killed between two renamings, on a disk without hard links.
    let (newest, old) = (store.path(), folder.path().join("checkpoint.old"));
    let (second, first) = (std::fs::read(&newest).unwrap(), std::fs::read(&old).unwrap());
    std::fs::remove_file(&newest).unwrap();
    assert!(store.exists());
    assert_eq!(step(&store), 1);
    // The newest checkpoint is truncated.
    std::fs::write(&newest, &second[..second.len() - 3]).unwrap();
    let found = store.find(any).unwrap().unwrap();
    assert_eq!(found.checkpoint.step, 1);
    assert!(matches!(found.fallback, Some(CheckpointError::Truncated { .. })));
    assert_eq!(read_state(folder.path()).unwrap(), checkpoint(1).state);
    assert!(matches!(read_state(&newest), Err(CheckpointError::Truncated { .. })));
    // The damaged checkpoint must not replace the good one.
    store.fall_back().unwrap();
    assert_eq!(std::fs::read(&newest).unwrap(), first);
    store.write(&checkpoint(3)).unwrap();
    assert_eq!((step(&store), std::fs::read(&old).unwrap() == first), (3, true));
    // Both checkpoints are damaged.
    std::fs::write(&newest, "x").unwrap();
    std::fs::write(&old, &first[..30]).unwrap();
    assert!(matches!(store.find(any), Err(CheckpointError::Other { .. })));
    std::fs::remove_file(&newest).unwrap();
    assert!(matches!(store.find(any), Err(CheckpointError::Truncated { .. })));
    store.clear().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_checkpoint_that_cannot_be_written_leaves_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path());
    store.write(&checkpoint(1)).unwrap();
    // A folder has the name of the previous checkpoint: unlike the permissions of a folder, this stops root too.
    std::fs::create_dir(folder.path().join("checkpoint.old")).unwrap();
    let error = store.write(&checkpoint(2)).unwrap_err();
    assert_eq!(error.path, folder.path().join("checkpoint"), "{error}");
    assert!(error.to_string().contains("cannot write"), "{error}");
    assert_eq!(store.find(any).unwrap().unwrap().checkpoint.step, 1);
}

#[test]
fn foreign_checkpoints_are_not_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::new(folder.path());
    store.write(&checkpoint(1)).unwrap();
    store.write(&checkpoint(2)).unwrap();
    let foreign = |checkpoint: &Checkpoint| match checkpoint.step {
        2 => Err(CheckpointError::Foreign { path: store.path(), differences: vec!["kT".into()] }),
        _ => Ok(()),
    };
    assert!(matches!(store.find(foreign), Err(CheckpointError::Foreign { .. })));
}

const MODEL: &str = "title = \"m\"\nspecies = [\"A\"]\n[parameters]\ng = 4.5\n[density.n]\n\
    kernel = \"quadratic\"\nrange = 1\n[excess_free_energy]\nA = { table = \"psi.txt\" }\n\
    [[thermostat]]\ngamma = \"g\"\nrange = 1.0\n";

const PSI: &str = "# n psi\n0 0\n1 1\n2 4\n3 9\n40 1600\n";

const SCENE: &str = "title = \"s\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 7\n[box]\nlengths = [4.0, 4.0, 4.0]\n\
    [initial]\nkind = \"random\"\ndensity = 3.0\n[[stage]]\nname = \"one\"\nsteps = 10\ndt = 0.01\n\
    [[stage]]\nname = \"two\"\nsteps = 20\ndt = 0.01\n";

fn identity(scene: &str, model: &str, psi: &str) -> Identity {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    std::fs::write(folder.path().join("psi.txt"), psi).unwrap();
    let scene = Scene::parse("s.toml", scene, folder.path()).unwrap_or_else(|e| panic!("{e}"));
    Identity::of(scene.source.text(), &scene.folder, scene.precision(), &scene.model)
}

#[test]
fn what_differs_is_named() {
    let good = identity(SCENE, MODEL, PSI);
    let scene = |from: &str, to: &str| {
        assert!(SCENE.contains(from), "{from}");
        identity(&SCENE.replace(from, to), MODEL, PSI).differences(&good)
    };
    // The layout of a file, its title and the interval of checkpoints do not change the identity.
    for (from, to) in [
        ("kT = 1.0", "kT = 1 # the same"),
        ("kT = 1.0\nseed = 7", "seed = 7\nkT = 1e0"),
        ("title = \"s\"", "title = \"another\""),
        ("[[stage]]\nname = \"one\"", "[output]\ncheckpoint = 5\n[[stage]]\nname = \"one\""),
    ] {
        assert_eq!(scene(from, to), [""; 0], "{to}");
    }
    assert_eq!(scene("kT = 1.0", "kT = 1.1"), ["kT is 1.1, was 1"]);
    assert_eq!(scene("steps = 20", "steps = 21"), ["stage[2].steps is 21, was 20"]);
    assert_eq!(scene("4.0, 4.0, 4.0", "4.0, 4.0, 4.5"), ["box.lengths is [4, 4, 4.5], was [4, 4, 4]"]);
    assert_eq!(
        scene("dt = 0.01\n[[", "dt = 0.01\nthermostat = false\n[["),
        ["stage[1].thermostat is false, was not given"]
    );
    let model = identity(SCENE, &MODEL.replace("4.5", "4.6"), PSI).differences(&good);
    assert_eq!(model, ["the model's parameters.g is 4.6, was 4.5"]);
    assert_eq!(
        good.differences(&identity(SCENE, &MODEL.replace("title", "reference = \"x\"\ntitle"), PSI)),
        [""; 0]
    );
    let [table] = &identity(SCENE, MODEL, &PSI.replace("2 4", "2 5")).differences(&good)[..] else {
        panic!("one file differs")
    };
    assert!(table.starts_with("the model's excess_free_energy.A.table is a file of 32 bytes"), "{table}");
    let text = CheckpointError::Foreign { path: "c".into(), differences: vec!["x is 1, was 2".into(); 8] };
    assert!(text.to_string().ends_with("x is 1, was 2; and 3 more"), "{text}");
}
