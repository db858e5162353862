//! Warren's A/B model from the coefficients that LAMMPS users know, written as a model file.
//!
//! LAMMPS's `mdpd` calls its force `A w_c(r) ê + B (n_i + n_j) w_d(r) ê` with `w_c = 1 − r/r_c`,
//! `w_d = 1 − r/r_d`. With the quadratic kernel this is the gradient of
//! `φ = ½ A r_c (1 − r/r_c)²` and `ψ = c_d r_d^{d+1} B n²`, `c_3 = π/30`, `c_2 = π/24`
//! (Warren eq. 13–15), since `−w′` is then `(1 − r/r_d) / (2 c_d r_d^{d+1})`.

use super::file::Model;
use super::preset_lucy::lucy_mdpd_text;
use crate::document::FileError;
use std::fmt::Write;

/// Which density goes with the force `B (n_i + n_j)(1 − r/r_d)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ForceLaw {
    /// The quadratic kernel: the force has a potential (Warren eq. 10).
    Conservative,
    /// The Lucy kernel, as LAMMPS's `mdpd/rhosum`, for masses of 1: the force has no potential, and heats.
    LucyLammps,
}

/// The coefficients of one pair of species, as `pair_coeff` of LAMMPS's `mdpd` takes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarrenPair {
    /// `A`, force; negative attracts.
    pub a: f64,
    /// `B`, force per density.
    pub b: f64,
    /// γ of the thermostat.
    pub gamma: f64,
    /// Range of the pair force and of the thermostat.
    pub rc: f64,
    /// Range of the density.
    pub rd: f64,
}

/// Why coefficients make no model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PresetError {
    /// Species `i` and `j` (from 1) have no coefficients.
    #[error("no coefficients for types {0} and {1}: there is no mixing, set them with pair_coeff")]
    Missing(usize, usize),
    /// Not a square table, or a table of nothing, or not as many masses.
    #[error("expected coefficients for every pair of types, and as many masses as types")]
    Shape,
    /// `B` or `r_d` differ between pairs: Warren's no-go theorem, Phys. Rev. E 87, 045303 (2013).
    #[error(
        "{name} differs between type pairs ({first} and {second}): with one density that does not \
         tell types apart no potential gives such forces (Warren, Phys. Rev. E 87, 045303); use one \
         {name} for all pairs, or pair_style dpd/psi with a model file whose psi depends on the \
         partial densities n_A, n_B, or 'law lucy' for the force of LAMMPS's mdpd, which has no potential"
    )]
    NoPotential {
        /// `B` or `rd`.
        name: &'static str,
        /// One value.
        first: f64,
        /// Another.
        second: f64,
    },
    /// A coefficient that the model file's reader refuses.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The upper triangle of a row-major table of coefficients: species and what was given.
pub(super) fn upper_triangle(
    species: usize,
    pairs: &[Option<WarrenPair>],
) -> Result<Vec<(usize, usize, WarrenPair)>, PresetError> {
    if species == 0 || pairs.len() != species * species {
        return Err(PresetError::Shape);
    }
    let mut upper = Vec::new();
    for i in 0..species {
        for j in i..species {
            let pair = pairs[i * species + j].ok_or(PresetError::Missing(i + 1, j + 1))?;
            upper.push((i, j, pair));
        }
    }
    Ok(upper)
}

/// Pair forces and thermostats, as a part of a model file.
pub(super) fn pair_text(names: &[String], upper: &[(usize, usize, WarrenPair)]) -> String {
    let mut text = String::new();
    for (i, j, pair) in upper {
        let between = format!("between = [{}, {}]", names[*i], names[*j]);
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n[[pair]]\n{between}\nform = \"soft\"\nstrength = {:?}\nrange = {:?}\n\n\
             [[thermostat]]\n{between}\ngamma = {:?}\nrange = {:?}\n",
            pair.a, pair.rc, pair.gamma, pair.rc,
        );
    }
    text
}

/// Writes the model file of Warren's A/B model for species `species`, with `pairs` a row-major table
/// of the coefficients (the upper triangle is read).
///
/// # Errors
/// A pair without coefficients, or coefficients that no potential can give where `law` has one.
pub fn warren_ab_text(
    species: &[String],
    pairs: &[Option<WarrenPair>],
    dimensions: usize,
    law: ForceLaw,
) -> Result<String, PresetError> {
    if law == ForceLaw::LucyLammps {
        return lucy_mdpd_text(species, pairs, &vec![1.0; species.len()], dimensions);
    }
    let upper = upper_triangle(species.len(), pairs)?;
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
    let names: Vec<String> = species.iter().map(|s| format!("\"{s}\"")).collect();
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
    Ok(text)
}

/// The model of [`warren_ab_text`].
///
/// # Errors
/// As [`warren_ab_text`]; also a range that is not positive or a negative γ.
pub fn warren_ab(
    species: &[String],
    pairs: &[Option<WarrenPair>],
    dimensions: usize,
    law: ForceLaw,
) -> Result<Model, PresetError> {
    let text = warren_ab_text(species, pairs, dimensions, law)?;
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
