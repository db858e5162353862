//! The fluids that codes are compared and timed in.

use crate::ExperimentError;
use crate::lammps::style::PairStyle;
use crate::shipped;
use psidpd_core::model::{ForceLaw, Model, WarrenPair, warren_ab};

/// A fluid with everything the codes need to be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subject {
    /// In results and file names.
    pub name: &'static str,
    pub title: &'static str,
    pub text: &'static str,
    /// Names of the species, as `pair_coeff` wants them.
    pub species: &'static [&'static str],
    pub density: f64,
    pub dt: f64,
    /// Of so many particles one is of the second species; with 0 species alternate.
    pub one_in: usize,
}

/// Density of the many-body fluid, which sizes are counted in.
pub const MDPD_DENSITY: f64 = 6.05;

/// Particles of the many-body fluid in boxes of edge 10, 20 and 40.
pub const SIZES: [usize; 3] = [6_050, 48_400, 387_200];

/// Warren's many-body fluid, set 6: what LAMMPS's `mdpd` is for.
pub const MDPD: Subject = Subject {
    name: "mdpd",
    title: "MDPD: Warren's set 6",
    text: shipped::SET6,
    species: &["F"],
    density: MDPD_DENSITY,
    dt: 0.01,
    one_in: 0,
};

pub const DPD: Subject = Subject {
    name: "dpd",
    title: "DPD: the standard soft fluid",
    text: shipped::STANDARD,
    species: &["W"],
    density: 3.0,
    dt: 0.04,
    one_in: 0,
};

/// The fluid of standard DPD as a pair style of LAMMPS's own.
pub const DPD_PAIR: PairStyle = PairStyle::Dpd { a: 25.0, gamma: 4.5, rc: 1.0 };

/// The fluid of LAMMPS's `dpd` with these coefficients; a term whose coefficient is 0 is left out.
pub fn dpd_model(a: f64, gamma: f64, rc: f64) -> Result<Model, ExperimentError> {
    let mut text = "title = \"dpd\"\nspecies = [\"W\"]\n".to_owned();
    if a != 0.0 {
        text += &format!(
            "[[pair]]\nbetween = [\"W\", \"W\"]\nform = \"soft\"\nstrength = {a:?}\nrange = {rc:?}\n"
        );
    }
    if gamma != 0.0 {
        text += &format!("[[thermostat]]\ngamma = {gamma:?}\nrange = {rc:?}\n");
    }
    Ok(Model::parse("dpd", &text)?)
}

/// Many-body terms in general: two species, two densities, ψ as a formula that tells species apart.
pub const FORMULA: Subject = Subject {
    name: "formula",
    title: "MDPD in general: formulas, two species, two densities",
    text: include_str!("bench/two-species.toml"),
    species: &["A", "B"],
    density: MDPD_DENSITY,
    dt: 0.01,
    one_in: 0,
};

pub const SUBJECTS: [Subject; 3] = [MDPD, DPD, FORMULA];

/// Mixtures of particle sizes, which the native runner alone is timed with.
pub const MIXTURES: [Subject; 2] = [
    Subject {
        name: "colloid",
        title: "Standard DPD with 1 % of large particles: ranges 1, 2, 3",
        text: include_str!("bench/colloid.toml"),
        species: &["A", "B"],
        dt: 0.01,
        one_in: 100,
        ..DPD
    },
    Subject {
        name: "two-sizes",
        title: "Standard DPD with 10 % of larger particles: ranges 1, 1.5, 2",
        text: include_str!("bench/two-sizes.toml"),
        species: &["A", "B"],
        dt: 0.01,
        one_in: 10,
        ..DPD
    },
];

impl Subject {
    pub fn model(&self) -> Result<Model, ExperimentError> {
        Ok(Model::parse(self.name, self.text)?)
    }

    /// Edge of the cube that holds `size` particles of the many-body fluid: every fluid is timed in the same
    /// boxes.
    pub fn edge(size: usize) -> f64 {
        (size as f64 / MDPD_DENSITY).cbrt()
    }

    /// How many particles of this fluid the cube of a size holds.
    pub fn particles(&self, size: usize) -> usize {
        (size as f64 * self.density / MDPD_DENSITY).round() as usize
    }
}

/// One of Warren's parameter sets, with what he measured at kT = 1 (Phys. Rev. E 68, 066702, Table 2).
#[derive(Debug, Clone, Copy)]
pub struct WarrenSet {
    /// The name of the parameter set in the paper.
    pub name: &'static str,
    /// The fluid as it is shipped, at the density of the liquid in equilibrium with its vapour.
    pub fluid: Subject,
    /// `B`; `A` is −40, `r_c` 1 and `r_d` 0.75 in both.
    pub b: f64,
    /// Error of the density of the liquid.
    pub liquid_error: f64,
    pub tension: [f64; 2],
    pub width: [f64; 2],
}

pub const SET5: WarrenSet = WarrenSet {
    name: "set 5",
    fluid: Subject {
        name: "set 5",
        title: "MDPD: Warren's set 5",
        text: shipped::SET5,
        density: 5.08,
        ..MDPD
    },
    b: 40.0,
    liquid_error: 0.01,
    tension: [4.95, 0.03],
    width: [0.78, 0.05],
};

pub const SET6: WarrenSet = WarrenSet {
    name: "set 6",
    fluid: MDPD,
    b: 25.0,
    liquid_error: 0.01,
    tension: [7.45, 0.04],
    width: [0.66, 0.03],
};

pub const RC: f64 = 1.0;
pub const RD: f64 = 0.75;
pub const A: f64 = -40.0;
/// γ of the runs with a thermostat: σ = 6 at kT = 1.
pub const GAMMA: f64 = 18.0;

impl WarrenSet {
    /// Density of the liquid, tension and width, with their errors.
    pub fn published(&self) -> [[f64; 2]; 3] {
        [[self.fluid.density, self.liquid_error], self.tension, self.width]
    }

    /// The name of the parameter set in files.
    pub fn slug(&self) -> String {
        self.name.replace(' ', "")
    }

    pub fn pair(&self, gamma: f64) -> WarrenPair {
        WarrenPair { a: A, b: self.b, gamma, rc: RC, rd: RD, weight: None }
    }

    /// The model with friction `gamma` and one of the two force laws.
    pub fn model(&self, law: ForceLaw, gamma: f64) -> Result<Model, ExperimentError> {
        Ok(warren_ab(&["F".to_owned()], &[Some(self.pair(gamma))], 3, law)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::Plan;

    #[test]
    fn fluids_are_what_their_names_say() {
        let plan = |s: &Subject| Plan::new(&s.model().unwrap().at(1.0).unwrap()).unwrap();
        assert_eq!(SUBJECTS.map(|s| plan(&s).slope_width()), [1, 0, 4]);
        assert_eq!(SUBJECTS.map(|s| plan(&s).cutoff()), [1.0; 3]);
        assert_eq!(MIXTURES.map(|s| plan(&s).cutoff()), [3.0, 2.0]);
        for subject in SUBJECTS.iter().chain(&MIXTURES) {
            assert_eq!(plan(subject).species(), subject.species);
        }
        assert_eq!(MDPD.particles(48_400), 48_400);
        assert_eq!(DPD.particles(6_050), 3_000);
        for (size, edge) in SIZES.into_iter().zip([10.0, 20.0, 40.0]) {
            assert!((Subject::edge(size) - edge).abs() < 1e-12);
        }
    }
}
