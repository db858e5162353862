//! The coefficients of pairs of species as LAMMPS users write them, and errors in them.

use crate::document::FileError;
use std::fmt::Write;

/// The coefficients of one pair of species, as `pair_coeff` of LAMMPS's `mdpd` takes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarrenPair {
    /// Strength `A`, a force; negative attracts.
    pub a: f64,
    /// Strength `B`, a force per density.
    pub b: f64,
    /// Drag coefficient γ of the thermostat.
    pub gamma: f64,
    /// Range of the pair force and of the thermostat.
    pub rc: f64,
    /// Range of the density.
    pub rd: f64,
    /// The weight of drag and noise, if it is not `1 − r/rc`.
    pub weight: Option<DragWeight>,
}

/// The weight `w_R = (1 − r/range)^exponent` of drag and noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DragWeight {
    /// Where the weight ends.
    pub range: f64,
    /// The power of the linear weight, above 0.
    pub exponent: f64,
}

/// Reasons why coefficients define no model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PresetError {
    /// Species `i` and `j` (from 1) have no coefficients.
    #[error("no coefficients for types {0} and {1}: this style does not mix them, set them with pair_coeff")]
    Missing(usize, usize),
    /// The table is not square or empty, or the number of masses differs from that of types.
    #[error("expected coefficients for every pair of types, and as many masses as types")]
    Shape,
    /// `B r_d^{d+1}` differs between pairs, which Warren's no-go theorem excludes (Phys. Rev. E 87, 045303 (2013)).
    #[error(
        "{name} differs between pairs of types ({first} and {second}): the force then is the gradient of no potential (Warren, \
         Phys. Rev. E 87, 045303). Take one {name} for all pairs, or 'law lucy', the force of LAMMPS's mdpd, which has no \
         potential either, or pair_style dpd/psi with a model file; the nearest model is\n\n{nearest}"
    )]
    NoPotential {
        /// The coefficient: `B`, or its product with a power of `rd`.
        name: &'static str,
        /// The value of the coefficient for one pair.
        first: f64,
        /// The value of the coefficient for another pair.
        second: f64,
        /// The text of the model file that comes nearest.
        nearest: String,
    },
    /// The model file's reader refuses a coefficient.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The upper triangle of a row-major table: indices of the species and their coefficients, `nothing` where a pair has none.
pub(super) fn upper_triangle<P: Copy>(
    species: usize,
    pairs: &[Option<P>],
    nothing: Option<P>,
) -> Result<Vec<(usize, usize, P)>, PresetError> {
    if species == 0 || pairs.len() != species * species {
        return Err(PresetError::Shape);
    }
    let of = |(i, j): (usize, usize)| {
        let pair = pairs[i * species + j].or(nothing).ok_or(PresetError::Missing(i + 1, j + 1))?;
        Ok((i, j, pair))
    };
    (0..species).flat_map(|i| (i..species).map(move |j| (i, j))).map(of).collect()
}

/// The names of species as strings of a model file.
pub(super) fn quoted(species: &[String]) -> Vec<String> {
    species.iter().map(|name| format!("\"{name}\"")).collect()
}

/// Writes pair forces and thermostats, as a part of a model file.
pub(super) fn pair_text(names: &[String], upper: &[(usize, usize, WarrenPair)]) -> String {
    let mut text = String::new();
    for (i, j, pair) in upper {
        let between = format!("between = [{}, {}]", names[*i], names[*j]);
        let weight = pair.weight.unwrap_or(DragWeight { range: pair.rc, exponent: 1.0 });
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n[[pair]]\n{between}\nform = \"soft\"\nstrength = {:?}\nrange = {:?}\n\n\
             [[thermostat]]\n{between}\ngamma = {:?}\nrange = {:?}\n",
            pair.a, pair.rc, pair.gamma, weight.range,
        );
        if weight.exponent != 1.0 {
            let _ = writeln!(text, "exponent = {:?}", weight.exponent);
        }
    }
    text
}
