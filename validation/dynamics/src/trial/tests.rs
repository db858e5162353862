use super::*;
use crate::integrator::{Coupling, Integrator};
use psidpd_core::model::Model;
use std::sync::LazyLock;

const TWO: &str = "title = \"t\"\nspecies = [\"A\", \"B\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\n\
                   range = 1\n[[pair]]\nbetween = [\"A\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n[[pair]]\n\
                   between = [\"B\", \"B\"]\nform = \"soft\"\nstrength = 25\nrange = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

const STEP: Integrator = Integrator::ForceGradient {
    lambda: 0.17,
    gradient: 1.0 / 24.0,
    coupling: Coupling { every: 2, ..Coupling::DEFAULT },
};

fn settled(text: &str, masses: [f64; 2], kt: f64, densities: &[f64]) -> Piece {
    let model = Model::parse("t.toml", text).unwrap();
    let masses = &masses[..densities.len()];
    let of = Composition { model: &model, masses, kt, densities, seed: 7 };
    Piece::settled(&of).unwrap().unwrap()
}

const DENSITIES: [f64; 2] = [2.7, 0.3];
static EQUAL: LazyLock<Piece> = LazyLock::new(|| settled(TWO, [1.0, 1.0], 1.0, &DENSITIES));
static LIGHT: LazyLock<Piece> = LazyLock::new(|| settled(TWO, [1.0, 0.1], 1.0, &DENSITIES));

/// Configurations do not depend on masses, so a species of a tenth of the mass has 100 times the ω⁴, however few its particles, as far
/// as its own motion changes its forces, and 10 times as far as that of its neighbours does: √10 to 1.78 times the ω. The forces of
/// this fluid have both parts alike.
#[test]
fn the_lightest_species_sets_the_frequency() {
    let (equal, light) = (&EQUAL, &LIGHT);
    let ratio = light.frequency / equal.frequency;
    assert!((2.2..3.2).contains(&ratio), "{ratio}");
    // The mean of ∇²U/m over all particles is 1.9 times as large.
    let mean = light.mean_frequency.unwrap() / equal.mean_frequency.unwrap();
    assert!((1.25..1.5).contains(&mean), "{mean}");
}

/// Particles four times as heavy move alike at half the speed.
#[test]
fn units_of_mass_change_no_errors() {
    let heavy = settled(&TWO.replace("gamma = 4.5", "gamma = 9"), [4.0, 4.0], 1.0, &DENSITIES);
    let light = &EQUAL;
    assert!((light.frequency / heavy.frequency - 2.0).abs() < 0.2, "{} {}", light.frequency, heavy.frequency);
    assert!((light.drag / heavy.drag - 2.0).abs() < 0.2, "{} {}", light.drag, heavy.drag);
}

/// Long runs of standard DPD at 0.19: T 1.084(3), p +0.116(3) ρkT; at 0.12, of `docs/force-gradient.md`: T +0.005(1), p +0.006(1).
#[test]
fn a_step_is_measured_on_both_sides_of_the_wall() {
    let piece = &EQUAL;
    let beyond = piece.errors(STEP, 0.19).unwrap().unwrap();
    assert!((0.055..0.13).contains(&beyond.kinetic.value), "{beyond:?}");
    assert!((0.058..0.23).contains(&beyond.carried()), "{beyond:?}");
    let before = piece.errors(STEP, 0.12).unwrap().unwrap();
    assert!(before.worst() < 0.02, "{before:?}");
    let (advised, errors) = piece.longest(STEP).unwrap().unwrap();
    assert!((0.08..0.15).contains(&advised) && errors.worst() < 0.02, "{advised} {errors:?}");
}

/// Long runs with a tenth of the particles at a tenth of the mass, at 0.13: T 1.370(4), T_conf 1.80, p +0.494(6) ρkT.
#[test]
fn few_light_particles_shorten_the_step() {
    let piece = &LIGHT;
    assert!(piece.errors(STEP, 0.13).unwrap().is_none_or(|errors| errors.worst() > 0.2));
    let (advised, _) = piece.longest(STEP).unwrap().unwrap();
    assert!(advised < 0.055, "{advised}");
}

/// A van der Waals fluid between its vapour and its liquid, of densities 0.2 and 16.1, condenses: its particles are as fast as
/// those of the liquid, and in a fluid of the mean density 5 that stays uniform they would be half as fast. The pressure in a drop of
/// 400 particles makes them faster.
#[test]
fn a_fluid_between_two_phases_is_as_fast_as_its_liquid() {
    let fluid = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\nbounds = [0.0, 19.0]\n\
                 [excess_free_energy]\nF = \"-kT*ln(1 - 0.05*n) - 0.3*n\"\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let [between, liquid] = [5.0, 16.1].map(|rho| settled(fluid, [1.0; 2], 0.9, &[rho]).frequency);
    assert!((0.8..2.0).contains(&(between / liquid)), "{between} {liquid}");
}

#[test]
fn errors_too_small_to_matter_are_bounded() {
    let told = [1.8e-12, 0.0, 0.00104, 0.3].map(percent);
    assert_eq!(told, ["less than 0.01 %", "less than 0.01 %", "0.1 %", "30 %"]);
}
