//! The fluids that are timed.

use crate::ExperimentError;
use psidpd_core::model::Model;

/// A fluid with everything the codes need to be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Subject {
    /// In results and file names.
    pub name: &'static str,
    /// In words.
    pub title: &'static str,
    /// The model file.
    pub text: &'static str,
    /// Names of the species, as `pair_coeff` wants them.
    pub species: &'static [&'static str],
    /// Number density.
    pub density: f64,
    /// Δt.
    pub dt: f64,
}

/// Density of the many-body fluid, which sizes are counted in.
pub const MDPD_DENSITY: f64 = 6.05;

/// Particles of the many-body fluid in boxes of edge 10, 20 and 40.
pub const SIZES: [usize; 3] = [6_050, 48_400, 387_200];

/// Warren's many-body fluid, set 6: what LAMMPS's `mdpd` is for.
pub const MDPD: Subject = Subject {
    name: "mdpd",
    title: "MDPD: Warren's set 6",
    text: include_str!("../../../models/warren2003-set6.toml"),
    species: &["F"],
    density: MDPD_DENSITY,
    dt: 0.01,
};

/// Standard DPD, pairs only.
pub const DPD: Subject = Subject {
    name: "dpd",
    title: "DPD: the standard soft fluid",
    text: include_str!("../../../models/standard-dpd.toml"),
    species: &["W"],
    density: 3.0,
    dt: 0.04,
};

/// Many-body terms in general: two species, two densities, ψ as a formula that tells species apart.
pub const FORMULA: Subject = Subject {
    name: "formula",
    title: "MDPD in general: formulas, two species, two densities",
    text: include_str!("two-species.toml"),
    species: &["A", "B"],
    density: MDPD_DENSITY,
    dt: 0.01,
};

/// All.
pub const SUBJECTS: [Subject; 3] = [MDPD, DPD, FORMULA];

impl Subject {
    /// The model.
    ///
    /// # Errors
    /// The text is none: never, since a test reads it.
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

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::Plan;

    #[test]
    fn fluids_are_what_their_names_say() {
        let plan = |s: &Subject| Plan::new(&s.model().unwrap().at(1.0).unwrap()).unwrap();
        assert_eq!(SUBJECTS.map(|s| plan(&s).slope_width()), [1, 0, 4]);
        assert_eq!(SUBJECTS.map(|s| plan(&s).cutoff()), [1.0; 3]);
        for subject in &SUBJECTS {
            assert_eq!(plan(subject).species(), subject.species);
        }
        assert_eq!(MDPD.particles(48_400), 48_400);
        assert_eq!(DPD.particles(6_050), 3_000);
        for (size, edge) in SIZES.into_iter().zip([10.0, 20.0, 40.0]) {
            assert!((Subject::edge(size) - edge).abs() < 1e-12);
        }
    }
}
