use psidpd::checkpoint::{Checkpoint, VERSION, parse};
use psidpd::observe::Observers;
use psidpd::run::Simulation;
use psidpd::scene::Scene;
use psidpd_core::model::Model;
use std::path::Path;

const MODEL: &str = "title = \"m\"\nspecies = [\"A\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                     [excess_free_energy]\nA = \"n^2\"\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// The number of bytes before the part that postcard writes.
const HEADER: usize = 24;

/// The scene of the corpus, with `steps` steps. Few particles and coarse observables keep its checkpoints short.
fn scene_of_checkpoints(steps: u64) -> String {
    format!(
        r#"title = "c"
model = "model.toml"
kT = 1
seed = 5
[box]
lengths = [3, 3, 3]
[initial]
kind = "random"
count = 6
[[stage]]
name = "run"
steps = {steps}
dt = 0.01
[observe]
every = 2
temperature = true
pressure = true
energy = true
density_profile = {{ axis = "z", bins = 4 }}
temperature_profile = {{ axis = "z", bins = 2 }}
density_field = {{ bins = [2, 2] }}
rdf = {{ range = 1, bins = 4 }}
structure_factor = {{ range = 3 }}
msd = {{ length = 4 }}
viscosity = {{ length = 2, every = 1 }}
drop = {{ distance = 0.8, bins = 12 }}
clusters = {{ distance = 0.8 }}
local_density = {{ bins = 4 }}
"#
    )
}

/// Reads the scene after writing its model into `folder`.
fn read_scene(steps: u64, folder: &Path) -> Scene {
    std::fs::write(folder.join("model.toml"), MODEL).expect("a model");
    Scene::parse("c.toml", &scene_of_checkpoints(steps), folder).unwrap_or_else(|error| panic!("{error}"))
}

/// The body of the checkpoint, without header, at the end of a run of `steps` steps.
pub fn checkpoint_of_a_run(steps: u64) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = read_scene(steps, folder.path());
    let out = folder.path().join("out");
    psidpd::run::run_scene(&scene, &out, &mut |_| ()).unwrap_or_else(|error| panic!("{error}"));
    let file = std::fs::read(out.join("checkpoint")).expect("a checkpoint");
    file[HEADER..].to_vec()
}

/// Any bytes are a checkpoint or an error, both as a whole file and as the body of a file with a correct header. A checkpoint
/// that was read can be used. Returns true if the second one was read to its end.
pub fn checkpoint(bytes: &[u8]) -> bool {
    used(parse(bytes, Path::new("fuzz")).ok());
    let mut file = b"psidpdCK".to_vec();
    file.extend(VERSION.to_le_bytes());
    file.extend(crc32fast::hash(bytes).to_le_bytes());
    file.extend((bytes.len() as u64).to_le_bytes());
    file.extend(bytes);
    used(parse(&file, Path::new("fuzz")).ok())
}

/// Uses a checkpoint. Returns true if its observables are those of the scene.
fn used(checkpoint: Option<Checkpoint>) -> bool {
    thread_local!(static UNUSED: Observers = unused());
    let Some(checkpoint) = checkpoint else { return false };
    if checkpoint.state.len() <= 1000 {
        let model = Model::parse("m.toml", "title = \"m\"\nspecies = [\"A\"]\n").expect("a model");
        let _ = Simulation::new(&model, 1.0, checkpoint.state, 1);
    }
    let observers = UNUSED.with(|unused| unused.restore(&checkpoint.observers));
    observers.is_ok_and(|observers| !observers.finish().is_empty())
}

/// The observables of the scene before its first step.
fn unused() -> Observers {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = read_scene(1, folder.path());
    Observers::new(&scene.observe, scene.stages.iter().map(|s| s.name.as_str()))
}
