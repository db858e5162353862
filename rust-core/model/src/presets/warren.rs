//! Warren's A/B model from the coefficients of LAMMPS's `mdpd`, written as a model file.
//!
//! The force of LAMMPS's `mdpd` is `A w_c(r) ê + B_ij (n_i + n_j) w_d(r) ê` with `w_c = 1 − r/r_c`, `w_d = 1 − r/r_d,ij`.
//! With quadratic kernels it is the gradient of `φ = ½ A r_c (1 − r/r_c)²` and `ψ = K n²`, if `K = c_d B_ij r_d,ij^{d+1}`
//! is the same for all pairs: `c_3 = π/30`, `c_2 = π/24` (Warren eq. 13–15), since `−w′` is then `(1 − r/r_d) B / (2 K)`.
//! The density `n_i = Σ_j w(r_ij; r_d,ij)` has a kernel for each range.

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

/// The largest relative difference between equal values of `B r_d^{d+1}`: that of numbers with six digits.
const EQUAL: f64 = 1e-5;

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
    let names = quoted(species);
    let first = upper[0].2;
    let mut text = format!(
        "title = \"Warren A/B model\"\n\
         reference = \"P. B. Warren, Phys. Rev. E 68, 066702 (2003)\"\n\
         dimensions = {dimensions}\n\
         species = [{}]\n\n",
        names.join(", "),
    );
    let one_range = upper.iter().all(|(_, _, pair)| pair.rd == first.rd);
    let strength =
        |pair: &WarrenPair| if one_range { pair.b } else { pair.b * pair.rd.powi(power(dimensions)) };
    let other = upper.iter().map(|(_, _, pair)| strength(pair)).find(|k| !equal(*k, strength(&first)));
    // Writing to a String cannot fail.
    if other.is_none() && one_range {
        let coefficient = if dimensions == 2 { "pi/24 * rd^3" } else { "pi/30 * rd^4" };
        let _ = write!(
            text,
            "[parameters]\nB = {:?}\nrd = {:?}\n\n\
             [density.n]\nkernel = \"quadratic\"\nrange = \"rd\"\n\n\
             [excess_free_energy]\n",
            first.b, first.rd,
        );
        for name in species {
            let _ = writeln!(text, "{name} = \"{coefficient} * B * n^2\"");
        }
    } else {
        text += &nearest(species, &upper, dimensions, other.is_none());
    }
    text += &pair_text(&names, &upper);
    if let Some(second) = other {
        let name = match (one_range, dimensions) {
            (true, _) => "B",
            (false, 2) => "B rd^3",
            (false, _) => "B rd^4",
        };
        return Err(PresetError::NoPotential { name, first: strength(&first), second, nearest: text });
    }
    Ok(Model::parse("mdpd/psi", &text)?)
}

/// The power of `r_d` in ψ.
fn power(dimensions: usize) -> i32 {
    if dimensions == 2 { 3 } else { 4 }
}

fn equal(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= EQUAL * a.abs().max(b.abs())
}

/// Densities and ψ with `ψ_α = n Σ_β K_αβ n_β`, `n = Σ_β n_β`, where `n_β` has the range of the pair `α`, `β`. Its forces are those
/// of the coefficients if all `K` are equal. If they are not, it is the ψ with the symmetric second derivatives that differ least
/// from the slopes `2 K_αβ n` of the coefficients, whose derivatives are not symmetric.
fn nearest(
    species: &[String],
    upper: &[(usize, usize, WarrenPair)],
    dimensions: usize,
    equal_strengths: bool,
) -> String {
    let mut ranges: Vec<f64> = Vec::new();
    for (_, _, pair) in upper {
        if !ranges.contains(&pair.rd) {
            ranges.push(pair.rd);
        }
    }
    let name = |rd: f64| match (ranges.len(), ranges.iter().position(|r| *r == rd)) {
        (2.., Some(k)) => format!("n{}", k + 1),
        _ => "n".to_owned(),
    };
    let mut text = String::new();
    // Writing to a String cannot fail.
    for rd in &ranges {
        let _ = write!(text, "[density.{}]\nkernel = \"quadratic\"\nrange = {rd:?}\n\n", name(*rd));
    }
    text += "[excess_free_energy]\n";
    let c = if dimensions == 2 { "pi/24" } else { "pi/30" };
    let strength = |pair: &WarrenPair| format!("{:?}", pair.b * pair.rd.powi(power(dimensions)));
    for (alpha, title) in species.iter().enumerate() {
        let with = |beta: usize| {
            let pair = upper.iter().find(|(i, j, _)| (*i, *j) == (alpha.min(beta), alpha.max(beta)));
            &pair.unwrap_or(&upper[0]).2
        };
        let variables: Vec<String> =
            (0..species.len()).map(|beta| format!("{}_{}", name(with(beta).rd), species[beta])).collect();
        let same_range = (0..species.len()).all(|beta| with(beta).rd == with(0).rd);
        let sum = if same_range { name(with(0).rd) } else { format!("({})", variables.join(" + ")) };
        if equal_strengths {
            let _ = writeln!(text, "{title} = \"{c} * {} * {sum}^2\"", strength(&upper[0].2));
        } else {
            let terms: Vec<String> = (0..species.len())
                .map(|beta| format!("{}*{}", strength(with(beta)), variables[beta]))
                .collect();
            let _ = writeln!(text, "{title} = \"{c} * {sum} * ({})\"", terms.join(" + "));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::coefficients::DragWeight;
    use super::*;

    fn pair(a: f64, b: f64) -> Option<WarrenPair> {
        Some(WarrenPair { a, b, gamma: 18.0, rc: 1.0, rd: 0.75, weight: None })
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
        let PresetError::NoPotential { name, first, second, nearest } = &error else { panic!("{error}") };
        assert_eq!((*name, *first, *second), ("B", 25.0, 20.0));
        assert!(
            error.to_string().contains("gradient of no potential") && error.to_string().ends_with(nearest),
            "{error}"
        );
        // What the message names is a model file.
        Model::parse("nearest", nearest).unwrap().at(1.0).unwrap();
        let missing = [pair(-40.0, 25.0), None, None, pair(-40.0, 25.0)];
        let error = warren_ab(&names, &missing, 3, ForceLaw::Conservative).unwrap_err();
        assert_eq!(error, PresetError::Missing(1, 2));
        let different_a = [pair(-40.0, 25.0), pair(-30.0, 25.0), None, pair(-20.0, 25.0)];
        assert!(warren_ab(&names, &different_a, 3, ForceLaw::Conservative).is_ok());
    }

    /// Ranges by pair with one `B r_d^{d+1}`: the slopes of ψ are those of the force `B_ij (n_i + n_j)(1 − r/r_d,ij)`.
    #[test]
    fn ranges_by_pair_have_a_potential_if_the_strength_of_psi_is_one() {
        let names = ["A".into(), "B".into()];
        for (dimensions, power) in [(3, 4), (2, 3)] {
            let with = |rd: f64| {
                let b = 7.9 / rd.powi(power);
                // Six digits, as decks have them.
                let b: f64 = format!("{b:.5}").parse().unwrap();
                Some(WarrenPair { a: -40.0, b, gamma: 4.5, rc: 1.0, rd, weight: None })
            };
            let pairs = [with(0.75), with(0.7), None, with(0.65)];
            let fluid =
                warren_ab(&names, &pairs, dimensions, ForceLaw::Conservative).unwrap().at(1.0).unwrap();
            assert!(fluid.is_conservative());
            assert_eq!(fluid.densities.len(), 3);
            let other = [with(0.75), Some(WarrenPair { b: 20.0, ..with(0.7).unwrap() }), None, with(0.65)];
            let error = warren_ab(&names, &other, dimensions, ForceLaw::Conservative).unwrap_err();
            let PresetError::NoPotential { name, nearest, .. } = &error else { panic!("{error}") };
            assert_eq!(*name, if dimensions == 2 { "B rd^3" } else { "B rd^4" });
            Model::parse("nearest", nearest).unwrap().at(1.0).unwrap();
        }
    }

    #[test]
    fn drag_may_have_its_own_weight() {
        let weight = Some(DragWeight { range: 1.3, exponent: 0.5 });
        let pair = Some(WarrenPair { weight, ..pair(-40.0, 25.0).unwrap() });
        let fluid = warren_ab(&["F".into()], &[pair], 3, ForceLaw::Conservative).unwrap().at(1.0).unwrap();
        let thermostat = fluid.thermostats[0].unwrap();
        assert_eq!((thermostat.range, thermostat.exponent), (1.3, 0.5));
        assert_eq!(fluid.cutoff(), 1.3);
    }
}
