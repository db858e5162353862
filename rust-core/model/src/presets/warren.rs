//! Warren's A/B model from the coefficients of LAMMPS's `mdpd`, written as a model file.
//!
//! The force of LAMMPS's `mdpd` is `A w_c(r) ê + B (n_i + n_j) w_d(r) ê` with `w_c = 1 − r/r_c`, `w_d = 1 − r/r_d`.
//! With the quadratic kernel it is the gradient of `φ = ½ A r_c (1 − r/r_c)²` and `ψ = c_d r_d^{d+1} B n²`, `c_3 =
//! π/30`, `c_2 = π/24` (Warren eq. 13–15), since `−w′` is then `(1 − r/r_d) / (2 c_d r_d^{d+1})`.

use super::coefficients::{PresetError, WarrenPair, pair_text, quoted, upper_triangle};
use super::lucy::lucy_mdpd;
use crate::file::Model;
use std::fmt::Write;

/// The density in the force `B (n_i + n_j)(1 − r/r_d)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceLaw {
    /// The density has the quadratic kernel: the force has a potential (Warren eq. 10).
    Conservative,
    /// The density has the Lucy kernel, as in LAMMPS's `mdpd/rhosum`, for masses of 1: the
    /// force has no potential, and heats.
    LucyLammps,
}

/// Builds Warren's A/B model for species `species`, as a model file. `pairs` is a row-major table of the
/// coefficients, of which the upper triangle is read.
///
/// # Errors
/// Fails for a pair without coefficients, and for coefficients without a potential where `law` has one;
/// also for a range that is not positive or a negative γ.
pub fn warren_ab(
    species: &[String],
    pairs: &[Option<WarrenPair>],
    dimensions: usize,
    law: ForceLaw,
) -> Result<Model, PresetError> {
    if law == ForceLaw::LucyLammps {
        return lucy_mdpd(species, pairs, &vec![1.0; species.len()], dimensions);
    }
    let upper = upper_triangle(species.len(), pairs, None)?;
    let first = upper[0].2;
    for (_, _, pair) in &upper {
        if pair.b != first.b {
            return Err(PresetError::NoPotential { name: "B", first: first.b, second: pair.b });
        }
        if pair.rd != first.rd {
            return Err(PresetError::NoPotential { name: "rd", first: first.rd, second: pair.rd });
        }
    }
    let coefficient = if dimensions == 2 { "pi/24 * rd^3" } else { "pi/30 * rd^4" };
    let names = quoted(species);
    let mut text = format!(
        "title = \"Warren A/B model\"\n\
         reference = \"P. B. Warren, Phys. Rev. E 68, 066702 (2003)\"\n\
         dimensions = {dimensions}\n\
         species = [{}]\n\n\
         [parameters]\nB = {:?}\nrd = {:?}\n\n\
         [density.n]\nkernel = \"quadratic\"\nrange = \"rd\"\n\n\
         [excess_free_energy]\n",
        names.join(", "),
        first.b,
        first.rd,
    );
    // Writing to a String cannot fail.
    for name in species {
        let _ = writeln!(text, "{name} = \"{coefficient} * B * n^2\"");
    }
    text += &pair_text(&names, &upper);
    Ok(Model::parse("mdpd/psi", &text)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(a: f64, b: f64) -> Option<WarrenPair> {
        Some(WarrenPair { a, b, gamma: 18.0, rc: 1.0, rd: 0.75 })
    }

    #[test]
    fn one_species_is_the_model_of_the_paper() {
        let model = warren_ab(&["F".into()], &[pair(-40.0, 25.0)], 3, ForceLaw::Conservative).unwrap();
        let fluid = model.at(1.0).unwrap();
        assert!(fluid.is_conservative());
        assert_eq!(fluid.cutoff(), 1.0);
        let lucy = warren_ab(&["F".into()], &[pair(-40.0, 25.0)], 3, ForceLaw::LucyLammps).unwrap();
        assert!(!lucy.at(1.0).unwrap().is_conservative());
    }

    #[test]
    fn different_b_is_refused_with_the_reason() {
        let names = ["A".into(), "B".into()];
        let pairs = [pair(-40.0, 25.0), pair(-30.0, 20.0), None, pair(-40.0, 25.0)];
        let error = warren_ab(&names, &pairs, 3, ForceLaw::Conservative).unwrap_err();
        assert!(error.to_string().contains("no potential"), "{error}");
        let missing = [pair(-40.0, 25.0), None, None, pair(-40.0, 25.0)];
        let error = warren_ab(&names, &missing, 3, ForceLaw::Conservative).unwrap_err();
        assert_eq!(error, PresetError::Missing(1, 2));
        let different_a = [pair(-40.0, 25.0), pair(-30.0, 25.0), None, pair(-20.0, 25.0)];
        assert!(warren_ab(&names, &different_a, 3, ForceLaw::Conservative).is_ok());
    }
}
