use super::*;
use crate::integrator::{Coupling, Integrator};
use crate::particles::State;
use nalgebra::{Matrix3, Vector3};
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

/// `ω⁴ = ⟨Ḟ²⟩/(d kT m)` of a species of TWO at a configuration, by the stiffness of each pair in closed form: with the soft force
/// `a (1 − r)` it is `a` along the pair and `−a (1 − r)/r` across. `⟨Ḟ²⟩` has the velocities of the particle and of its neighbours.
fn fourth_power(state: &State, species: i32) -> f64 {
    let (a, x) = (25.0, &state.x);
    let mut sum = 0.0;
    let own: Vec<usize> = (0..x.len()).filter(|i| state.species[*i] == species).collect();
    for &i in &own {
        let mut all = Matrix3::zeros();
        for j in (0..x.len()).filter(|j| *j != i) {
            let d = Vector3::from(state.domain.minimum_image(x[i], x[j]));
            let r = d.norm();
            if r < 1.0 {
                let along = d * d.transpose() / (r * r);
                let stiffness = a * along - a * (1.0 - r) / r * (Matrix3::identity() - along);
                all += stiffness;
                sum += stiffness.norm_squared() / state.mass[state.species[j] as usize];
            }
        }
        sum += all.norm_squared() / state.mass[species as usize];
    }
    sum / (3.0 * own.len() as f64 * state.mass[species as usize])
}

/// The frequency is that of the lightest species, however few its particles: of these there are 40, whose ω⁴ scatters by 30 % in a
/// configuration, and by as much with the velocities that are drawn: 2 % of ω, of which five are allowed. In equal masses the faster of
/// two samples is taken.
#[test]
fn the_lightest_species_sets_the_frequency() {
    let (equal, light) = (&EQUAL, &LIGHT);
    let expected = fourth_power(light.state(), 1).powf(0.25);
    assert!((light.frequency / expected - 1.0).abs() < 0.1, "{} {expected}", light.frequency);
    let expected = [0, 1].map(|s| fourth_power(equal.state(), s).powf(0.25));
    let found = equal.frequency / expected[0].max(expected[1]);
    assert!((0.9..1.1).contains(&found), "{} {expected:?}", equal.frequency);
    assert!(light.frequency > 2.0 * fourth_power(light.state(), 0).powf(0.25), "{}", light.frequency);
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
