//! Runs in memory, step by step, against runs with files.

use super::resume::finished;
use super::*;
use psidpd_formats::data::DataFile;
use std::num::NonZeroUsize;

/// Trial moves that tune their length, then two splittings, drag and noise among the forces, and trial moves of constant length.
const STAGES: &str = "\
    [[stage]]\nname = \"rest\"\nsteps = 6\nintegrator = \"monte-carlo\"\nkT = 1.5\n\
    [[stage]]\nname = \"a\"\nsteps = 5\ndt = 0.02\nintegrator = \"aboba\"\nthermostat_every = 3\n\
    [[stage]]\nname = \"b\"\nsteps = 4\ndt = 0.03\nintegrator = \"two-stage\"\n\
    [[stage]]\nname = \"c\"\nsteps = 3\ndt = 0.01\nkT = 0.7\n\
    [[stage]]\nname = \"moves\"\nsteps = 4\nintegrator = \"monte-carlo\"\nsweeps = 2\n\
    [[stage]]\nname = \"d\"\nsteps = 3\ndt = 0.02\nintegrator = \"aboba\"\n";
/// The steps at which stages end, and their lengths of step; a step of trial moves counts as a time of 1.
const ENDS: [(u64, f64, &str); 6] = [
    (6, 1.0, "rest"),
    (11, 0.02, "a"),
    (15, 0.03, "b"),
    (18, 0.01, "c"),
    (22, 1.0, "moves"),
    (25, 0.02, "d"),
];

/// The stage and the time after a number of steps.
fn after(step: u64) -> (&'static str, f64) {
    let (mut begin, mut time) = (0, 0.0);
    for (end, dt, name) in ENDS {
        time += dt * (step.min(end) - begin) as f64;
        if step <= end {
            return (name, time);
        }
        begin = end;
    }
    ("d", time + 0.02 * (step - begin) as f64)
}

/// The particles in the order of their tags: positions, boxes crossed, and velocities.
fn particles(data: &DataFile) -> Vec<([f64; 3], [i32; 3], [f64; 3])> {
    let velocities = data.velocities.as_ref().unwrap();
    data.atoms.iter().zip(velocities).map(|(atom, v)| (atom.x, atom.image, *v)).collect()
}

/// Through all stages in pieces of any length, the bits are those of the run with files, and stage and time those of the scene.
#[test]
fn pieces_of_a_run_end_as_the_run() {
    let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, STAGES).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let last = finished(&scene, folder.path(), Begin::New).last;
    let expected = particles(&DataFile::read(&folder.path().join("final.data")).unwrap());
    for piece in [1, 4, 25] {
        let mut live = Live::new(scene.clone(), NonZeroUsize::MIN).unwrap();
        let mut made = 0;
        while made < 25 {
            let steps = piece.min(25 - made);
            live.run(steps, || false).unwrap();
            made += steps;
            let (stage, time) = after(made);
            assert_eq!(live.stage().name, stage, "{made} steps in pieces of {piece}");
            assert!((live.time() - time).abs() < 1e-12, "{made}: {} {time}", live.time());
            assert_eq!((live.simulation().step_number(), live.left()), (made, 25 - made));
        }
        let found = particles(&live.simulation().state().to_data_by_tag("t"));
        assert!(found == expected, "pieces of {piece}");
        // Energies and the pressure are those of the present step.
        let run = live.simulation();
        assert_eq!(
            (run.temperature(), run.pressure_tensor()),
            (last.temperature, last.tensor),
            "pieces of {piece}"
        );
        let potential = run.potential_energy() / last.potential;
        assert!((potential - 1.0).abs() < 1e-12, "pieces of {piece}: {potential}");
        // Beyond its end the last stage goes on.
        live.run(2, || false).unwrap();
        assert_eq!((live.stage().name.as_str(), live.left()), ("d", 0));
        assert!((live.time() - after(27).1).abs() < 1e-12, "{}", live.time());
    }
}

/// Between two actions of the thermostat the pressure has the mean force of the last, however many steps were made at once.
#[test]
fn pressures_do_not_depend_on_pieces() {
    for (name, every) in [("aboba", 3), ("force-gradient", 2), ("two-stage", 1)] {
        let stages = format!(
            "[[stage]]\nname = \"a\"\nsteps = 12\ndt = 0.02\nintegrator = \"{name}\"\nthermostat_every = {every}\n\
             [output]\nthermo = 1\n"
        );
        let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, &stages).unwrap();
        for steps in 5..=8 {
            let [mut one, mut pieces] = [0, 1].map(|_| Live::new(scene.clone(), NonZeroUsize::MIN).unwrap());
            one.run(steps, || false).unwrap();
            (0..steps).for_each(|_| pieces.run(1, || false).unwrap());
            let tensors = [&one, &pieces].map(|live| live.simulation().pressure_tensor());
            let rest = one.simulation().conservative_pressure_tensor();
            assert!(tensors[0] != rest, "{name} {steps}");
            for (found, expected) in tensors[0].iter().zip(tensors[1]) {
                assert!(
                    (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                    "{name} {steps}: {tensors:?}"
                );
            }
        }
    }
}

/// The step after the first `true` is the last, and the run then goes on as if it had not stopped.
#[test]
fn a_stop_ends_after_the_step() {
    let scene = scene_of(SET6, "[3.0, 3.0, 3.0]", 6.05, STAGES).unwrap();
    let [whole, stopped] = [false, true].map(|stops| {
        let mut live = Live::new(scene.clone(), NonZeroUsize::MIN).unwrap();
        if stops {
            let mut asked = 0;
            live.run(20, || {
                asked += 1;
                asked == 13
            })
            .unwrap();
            assert_eq!((live.simulation().step_number(), asked), (13, 13));
            live.run(7, || false).unwrap();
        } else {
            live.run(20, || false).unwrap();
        }
        particles(&live.simulation().state().to_data_by_tag("t"))
    });
    assert!(whole == stopped);
}
