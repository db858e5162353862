//! DPD with a repulsive–attractive pair potential, from the coefficients of a LAMMPS style, written as
//! a model file: `φ = a [A W(r, r_A) − B W(r, r_B)]`.

use super::coefficients::{PresetError, quoted, upper_triangle};
use crate::file::Model;
use std::fmt::Write;

/// The coefficients of one pair of species, as `pair_coeff` of `dpd/spline` takes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplinePair {
    /// Strength `a`, an energy.
    pub strength: f64,
    /// Amplitude `A` of the repulsion.
    pub repulsion: f64,
    /// Amplitude `B` of the attraction.
    pub attraction: f64,
    /// Range `r_A` of the repulsion.
    pub repulsion_range: f64,
    /// Range `r_B` of the attraction.
    pub attraction_range: f64,
    /// Drag coefficient γ of the thermostat.
    pub gamma: f64,
}

/// Builds the model of spline DPD for species `species`, as a model file. `pairs` is a row-major table of the
/// coefficients, of which the upper triangle is read; pairs without coefficients do not interact. All
/// pairs share the range of the thermostat.
///
/// # Errors
/// Fails for a table that is not square, or empty; also for a range that is not positive or a negative γ.
pub fn spline_dpd(
    species: &[String],
    pairs: &[Option<SplinePair>],
    thermostat_range: f64,
    dimensions: usize,
) -> Result<Model, PresetError> {
    let names = quoted(species);
    let mut text = format!(
        "title = \"DPD with a spline potential\"\ndimensions = {dimensions}\nspecies = [{}]\n",
        names.join(", "),
    );
    let nothing = SplinePair {
        strength: 0.0,
        repulsion: 0.0,
        attraction: 0.0,
        repulsion_range: thermostat_range,
        attraction_range: thermostat_range,
        gamma: 0.0,
    };
    for (i, j, pair) in upper_triangle(species.len(), pairs, Some(nothing))? {
        let between = format!("between = [{}, {}]", names[i], names[j]);
        let SplinePair { strength, repulsion, attraction, repulsion_range, attraction_range, gamma } = pair;
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n[[pair]]\n{between}\nform = \"spline\"\nstrength = {strength:?}\nA = {repulsion:?}\n\
             B = {attraction:?}\nrange_A = {repulsion_range:?}\nrange_B = {attraction_range:?}\n\n\
             [[thermostat]]\n{between}\ngamma = {gamma:?}\nrange = {thermostat_range:?}\n",
        );
    }
    Ok(Model::parse("dpd/spline", &text)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::PairForm;

    #[test]
    fn coefficients_make_the_potential() {
        let pair = SplinePair {
            strength: 18.75,
            repulsion: 2.0,
            attraction: 1.0,
            repulsion_range: 0.8,
            attraction_range: 1.0,
            gamma: 4.5,
        };
        let names = ["A".into(), "B".into()];
        let model = spline_dpd(&names, &[Some(pair), None, None, Some(pair)], 1.0, 3).unwrap();
        let fluid = model.at(1.0).unwrap();
        assert!((fluid.pairs[0].potential.at(0.0).0 - 18.75).abs() < 1e-12);
        assert_eq!(fluid.pairs[1].potential.at(0.1).0, 0.0);
        assert_eq!(fluid.thermostats[1].unwrap().gamma, 0.0);
        let bad = SplinePair { gamma: -1.0, ..pair };
        assert!(spline_dpd(&names[..1], &[Some(bad)], 1.0, 3).is_err());
        assert_eq!(spline_dpd(&names, &[None], 1.0, 3).unwrap_err(), PresetError::Shape);
    }
}
