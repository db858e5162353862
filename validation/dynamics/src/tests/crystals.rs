//! Runs of a crystal say that they are none of a liquid, and runs of liquids do not.

use super::{find, run};
use crate::tests::support;
use psidpd_observe::Observation;

/// Warren's fluid with r_d = 0.75 r_c.
fn warren(a: f64, b: f64, gamma: f64) -> String {
    format!(
        "title = \"w\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n[excess_free_energy]\n\
         F = \"pi/30*0.75^4*{b}*n^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = {a}\nrange = 1\n\
         [[thermostat]]\ngamma = {gamma}\nrange = 1\n"
    )
}

/// 250 particles that start on the sites of a bcc lattice at the density of zero pressure, in vacuum or in a box that they fill.
fn observed(model: &str, density: f64, film: bool, step: &str, observe: &str) -> Vec<Observation> {
    let edge = (250.0 / density).cbrt();
    let (height, kind) = match film {
        true => (edge + 3.0, format!("kind = \"slab\"\nthickness = {edge}")),
        false => (edge, "kind = \"lattice\"".to_owned()),
    };
    let text = format!(
        "title = \"t\"\nmodel = \"m.toml\"\nkT = 1.0\nseed = 3\nbox = [{edge}, {edge}, {height}]\n[initial]\n{kind}\n\
         density = {density}\nlattice = \"bcc\"\n[[stage]]\nname = \"run\"\n{step}\n[observe]\n{observe}\n"
    );
    run(&support::scene(model, &text).unwrap_or_else(|e| panic!("{e}"))).1
}

const STEPS: &str = "steps = 1320\ndt = 0.01";

#[test]
fn a_crystal_is_said_beside_what_assumes_a_liquid() {
    let crystal = warren(-100.0, 80.0, 4.5);
    let liquids = "every = 20\nmsd = { every = 20 }\nviscosity = { length = 20 }\npressure = true\n";
    let slabs = "every = 20\nsurface_tension = true\ninterface_width = true\nstress_profile = true\n";
    let trials = "steps = 70\nintegrator = \"monte-carlo\"\nsweeps = 10\nmax_move = 0.08";
    type Case<'a> = (bool, &'a str, &'a str, &'a [&'a str], &'a [&'a str]);
    let cases: [Case; 3] = [
        (false, STEPS, liquids, &["diffusion", "viscosity"], &["pressure"]),
        (true, STEPS, slabs, &["surface_tension", "interface_width", "stress_profile_integral"], &[]),
        (
            true,
            trials,
            "every = 1\ninterface_width = true\nenergy = true\n",
            &["interface_width"],
            &["energy"],
        ),
    ];
    for (film, step, observe, warned, silent) in cases {
        let all = observed(&crystal, 5.7, film, step, observe);
        for name in warned {
            assert!(find(&all, name).note.contains("are a crystal"), "{film}: {:?}", find(&all, name).note);
        }
        for name in silent {
            assert!(!find(&all, name).note.contains("crystal"), "{:?}", find(&all, name).note);
        }
    }
}

/// Warren's liquid from the same start, and one so viscous that it has not gone far; the crystal in a run too short to tell.
#[test]
fn liquids_and_short_runs_are_not_called_crystals() {
    let liquids = "every = 20\nmsd = { every = 20 }\ninterface_width = true\n";
    let cases = [
        (warren(-40.0, 25.0, 4.5), 6.05, STEPS),
        (warren(-40.0, 25.0, 400.0), 6.05, "steps = 1320\ndt = 0.01\nintegrator = \"aboba\""),
        (warren(-100.0, 80.0, 4.5), 5.7, "steps = 200\ndt = 0.01"),
    ];
    for (model, density, step) in cases {
        for film in [false, true] {
            let all = observed(&model, density, film, step, liquids);
            assert!(all.iter().all(|o| !o.note.contains("crystal")), "{film} {step}: {all:?}");
        }
    }
}
