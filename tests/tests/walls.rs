//! The architecture within crates: no file imports from a room above its own, and no files import from each
//! other in a circle. A crate's `Cargo.toml` limits its imports from other crates.
//!
//! A room is a folder or a file. Rooms are listed from the lowest to the highest.

mod walls_imports;

use std::path::Path;
use walls_imports::Crate;

/// Rooms of psidpd-core. A file belongs to the room with the longest name that its module path begins with.
const CORE: &[&[&str]] = &[
    &["free_energy", "memory"],
    &["theory"],
    // The foundations of the engine.
    &[
        "engine::components",
        "engine::counts",
        "engine::error",
        "engine::exclusions",
        "engine::fault",
        "engine::images",
        "engine::particles",
        "engine::path",
        "engine::reach",
        "engine::request",
        "engine::step",
        "engine::surroundings",
        "engine::vectors",
    ],
    &["engine::evaluate", "engine::excess", "engine::plan"],
    &["engine::excess_pass"],
    // What matter behind faces of the box adds.
    &["engine::walls"],
    // Particles at cylinders and spheres of matter.
    &["engine::wall_room", "engine::round_flight"],
    &["engine::reflection"],
    // The fast engine: one traversal of all cells, without a neighbour list.
    &["engine::sweep::terms", "engine::sweep::times"],
    &["engine::sweep::workspace"],
    &["engine::sweep"],
    // Pair potentials of rare species with long ranges, beside a sweep.
    &["engine::long_pairs"],
    // The move of a single particle.
    &["engine::local_energy"],
    // Sums over a list of pairs.
    &["engine::pair_sums"],
    // The sweep with special pairs, whose forces are sums over a list, and with long pairs.
    &["engine::sweep_path"],
    // The engine as hosts use it.
    &["engine::facade"],
    &["engine"],
    &[""],
];

/// Rooms of psidpd-model; the compiler limits the imports of this crate and psidpd-passes from other crates.
const MODEL: &[&[&str]] = &[&["expression"], &["document"], &[""]];

const PASSES: &[&[&str]] = &[
    &["domain", "instruction_set", "noise", "settings", "tally"],
    &["simd"],
    &["vectors"],
    &["ground"],
    &["cells"],
    &["pair_search"],
    &["pair_batch"],
    &["plane"],
    &["compiled"],
    &[""],
];

/// The crates in which even the root of a folder and its files may not import from each other.
const ENGINE: &[&str] = &["rust-core", "rust-core/passes", "rust-core/threads", "rust-core/c-api"];

/// The crates whose files must not import from each other in a circle.
const CRATES: &[&str] = &[
    "rust-core",
    "rust-core/model",
    "rust-core/passes",
    "rust-core/threads",
    "rust-core/c-api",
    "lammps-plugin",
    "validation/formats",
    "validation/pictures",
    "validation/observe",
    "validation/dynamics",
    "validation/lammps-host",
    "validation/report",
    "validation/experiments",
    "validation",
];

fn sources(package: &str) -> Crate {
    Crate::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(package).join("src"))
}

fn room(rooms: &[&[&str]], module: &str) -> usize {
    let holds = |room: &str| room.is_empty() || module == room || module.starts_with(&format!("{room}::"));
    let all = rooms.iter().enumerate().flat_map(|(k, room)| room.iter().map(move |name| (k, *name)));
    let (k, _) =
        all.filter(|(_, name)| holds(name)).max_by_key(|(_, name)| name.len()).expect("the last holds all");
    k
}

/// Imports from a room above.
fn upward(rooms: &[&[&str]], sources: &Crate) -> Vec<String> {
    let all = sources.imports.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to)));
    all.filter(|(from, to)| room(rooms, to) > room(rooms, from))
        .map(|(from, to)| format!("{from} → {to}"))
        .collect()
}

#[test]
fn no_room_of_the_core_imports_from_one_above() {
    assert_eq!(upward(CORE, &sources("rust-core")), [""; 0]);
    assert_eq!(upward(MODEL, &sources("rust-core/model")), [""; 0]);
    assert_eq!(upward(PASSES, &sources("rust-core/passes")), [""; 0]);
}

#[test]
fn no_files_import_from_each_other_in_a_circle() {
    for package in CRATES {
        let mut sources = sources(package);
        if !ENGINE.contains(package) {
            sources = sources.without_gathering();
        }
        let circles = sources.circles();
        assert!(circles.is_empty(), "{package}: {circles:#?}");
    }
}

#[test]
fn the_files_are_found() {
    let passes = sources("rust-core/passes");
    assert!(passes.imports["plane::traversal"].contains("pair_search::find"));
    assert!(passes.imports["plane::first"].contains("tally"));
    let core = sources("rust-core");
    assert!(!core.imports.keys().any(|module| module.ends_with("tests")));
}
