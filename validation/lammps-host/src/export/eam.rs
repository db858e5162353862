//! Export of a fluid as tables for LAMMPS's `pair_style eam/alloy`, which most LAMMPS builds have.
//!
//! The energy of that style is `Σ_i F_a(ρ_i) + Σ_{i<j} φ_ab(r)`, `ρ_i = Σ_j f_b(r_ij)`: one density, whose
//! kernel depends on the neighbour's species alone. ψ becomes `F` and the kernel becomes `f`. Densities in
//! which every ψ is linear are pair potentials and go into `φ`, with the pair terms of the model.

use crate::LammpsError;
use psidpd_core::engine::Plan;
use psidpd_core::model::expression::Formula;
use psidpd_core::model::pair::PairForm;
use psidpd_core::model::{ExcessFreeEnergy, Fluid};
use psidpd_formats::files::Existing;
use psidpd_formats::setfl::{Element, Setfl};
use std::path::Path;

/// The resolution of the tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Spacing in r. A spline is accurate except near kinks of w′ and φ′, where its error of the force is
    /// proportional to the spacing.
    pub spacing: f64,
    /// Largest density in the table of F; beyond it LAMMPS extrapolates linearly.
    pub largest_density: f64,
    pub densities: usize,
}

impl Default for Grid {
    fn default() -> Grid {
        Grid { spacing: 1e-4, largest_density: 100.0, densities: 10_001 }
    }
}

/// Largest number of values in a file, which has then half a gigabyte.
const MOST: u32 = 20_000_000;

/// Writes the tables of `fluid`; `mass` holds the masses of its species, which become elements.
pub fn write(
    fluid: &Fluid,
    mass: &[f64],
    grid: Grid,
    path: &Path,
    existing: Existing,
) -> Result<(), LammpsError> {
    if fluid.dimensions != 3 {
        return Err(LammpsError::Flat);
    }
    if !fluid.is_conservative() {
        return Err(LammpsError::NotConservative);
    }
    if !(grid.spacing > 0.0 && grid.largest_density > 0.0 && grid.densities > 4) {
        return Err(LammpsError::Grid);
    }
    let plan = Plan::new(fluid)?;
    let pass = match plan.passes() {
        [] => None,
        [d] => Some(*d),
        [a, b, ..] => {
            let name = |d: &usize| fluid.densities[*d].name.clone();
            return Err(LammpsError::TwoDensities(name(a), name(b)));
        }
    };
    if let Some(d) = pass {
        check_density(fluid, d)?;
    }
    let (species, cutoff) = (fluid.species.len() as f64, fluid.conservative_range().max(f64::MIN_POSITIVE));
    let rows = cutoff / grid.spacing;
    let numbers = species * (grid.densities as f64 + rows) + 0.5 * species * (species + 1.0) * rows;
    if numbers.is_nan() || numbers > f64::from(MOST) {
        return Err(LammpsError::TooFine { numbers, most: MOST });
    }
    let drho = grid.largest_density / (grid.densities - 1) as f64;
    let embedding = |alpha: usize, n: f64| embedding(fluid, alpha, pass, n);
    for (alpha, species) in fluid.species.iter().enumerate() {
        for k in 0..grid.densities {
            let density = k as f64 * drho;
            // The table begins at n = 0, an isolated particle, and a spline needs finite values.
            if !embedding(alpha, density).is_finite() {
                return Err(LammpsError::Singular { species: species.clone(), density });
            }
        }
    }
    let elements: Vec<Element> = fluid
        .species
        .iter()
        .zip(mass)
        .map(|(name, mass)| Element { name: name.clone(), mass: *mass })
        .collect();
    let table = Setfl {
        title: &format!("psidpd: {} at kT = {}", fluid.title, fluid.kt),
        elements: &elements,
        nrho: grid.densities,
        drho,
        nr: (cutoff / grid.spacing).ceil() as usize + 6,
        dr: grid.spacing,
        cutoff,
        embedding: &embedding,
        density: &|_, r| pass.map_or(0.0, |d| fluid.densities[d].kernel.value(r)),
        pair: &|a, b, r| {
            let acting = fluid.pairs.iter().filter(|p| p.acts(a, b, r));
            plan.linear_pair_energy(a, b, r) + acting.map(|p| p.potential.at(r).0).sum::<f64>()
        },
    };
    Ok(table.write(path, existing)?)
}

fn check_density(fluid: &Fluid, d: usize) -> Result<(), LammpsError> {
    let density = &fluid.densities[d];
    let count = fluid.species.len();
    if density.correction.iter().any(|p| *p != psidpd_core::model::Polynomial::identity()) {
        return Err(LammpsError::Correction(density.name.clone()));
    }
    if density.bounds.is_some() {
        return Err(LammpsError::Bounds(density.name.clone()));
    }
    for (alpha, excess) in fluid.excess.iter().enumerate() {
        // A curve is a function of the summed density by definition.
        let ExcessFreeEnergy::Formula(psi) = excess else { continue };
        let slopes =
            (0..count).map(|b| psi.derivative(d * count + b)).collect::<Result<Vec<Formula>, _>>()?;
        if slopes.windows(2).any(|pair| pair[0] != pair[1]) {
            return Err(LammpsError::PartialDensities {
                species: fluid.species[alpha].clone(),
                density: density.name.clone(),
            });
        }
    }
    Ok(())
}

/// `F_α(n)`: ψ_α with the linear densities at zero; their terms are pair potentials.
fn embedding(fluid: &Fluid, alpha: usize, pass: Option<usize>, n: f64) -> f64 {
    let count = fluid.species.len();
    let own = |d: usize| {
        let density = &fluid.densities[d];
        if density.includes_self { density.kernel.value(0.0) } else { 0.0 }
    };
    match &fluid.excess[alpha] {
        ExcessFreeEnergy::Formula(psi) => {
            let at: Vec<f64> = (0..fluid.variables())
                .map(|v| {
                    let (d, beta) = (v / count, v % count);
                    let here = if beta == alpha { own(d) } else { 0.0 };
                    let correction = &fluid.densities[d].correction[alpha * count + beta];
                    let neighbours = if pass == Some(d) && beta == 0 { n } else { 0.0 };
                    correction.at(neighbours + here).0
                })
                .collect();
            psi.value(&at)
        }
        // This case was refused earlier, because the law has no potential.
        ExcessFreeEnergy::Slopes(law) => law.energy.value(&vec![0.0; fluid.variables()]),
        ExcessFreeEnergy::Curve(curve) => {
            curve.at(if pass == Some(curve.density) { n + own(curve.density) } else { own(curve.density) })[0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::model::Model;
    use std::f64::consts::PI;

    /// If particles count themselves, the embedding is that at the neighbours' density plus w(0) = 15/(2π).
    /// The test uses a formula and a curve.
    #[test]
    fn a_particle_that_counts_itself_has_its_own_density_in_the_table() {
        let own = 15.0 / (2.0 * PI);
        let folder = tempfile::tempdir().unwrap();
        let grid = Grid { spacing: 0.01, largest_density: 40.0, densities: 41 };
        for (psi, counted) in
            [("\"n^2\"", true), ("\"n^2\"", false), ("{ pressure = \"rho*kT + 2*rho^3\" }", true)]
        {
            let text = format!(
                "title = 't'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\nself = {counted}\n\
                 [excess_free_energy]\nF = {psi}\n"
            );
            let fluid = Model::parse("m.toml", &text).unwrap().at(1.0).unwrap();
            let path = folder.path().join("t.eam.alloy");
            write(&fluid, &[1.0], grid, &path, Existing::Replace).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            let values: Vec<f64> =
                text.lines().skip(6).flat_map(str::split_whitespace).map(|x| x.parse().unwrap()).collect();
            // ψ is n², or has the slope (p − ρkT)/ρ² = 2n.
            let at = |n: f64| (n + if counted { own } else { 0.0 }).powi(2);
            for k in 1..41 {
                let (found, expected) = (values[k] - values[0], at(k as f64) - at(0.0));
                assert!((found / expected - 1.0).abs() < 1e-6, "{psi} {k}: {found} {expected}");
            }
            if psi.contains("n^2") {
                assert!((values[0] - at(0.0)).abs() < 1e-12, "{}", values[0]);
            }
        }
    }

    /// The line of an element has the mass of its species.
    #[test]
    fn elements_have_the_masses_of_their_species() {
        let folder = tempfile::tempdir().unwrap();
        let grid = Grid { spacing: 0.1, largest_density: 40.0, densities: 5 };
        let pair = |a: &str, b: &str| {
            format!("[[pair]]\nbetween = ['{a}', '{b}']\nform = 'soft'\nstrength = 10\nrange = 1\n")
        };
        let text = format!(
            "title = 't'\nspecies = ['F', 'G']\n{}{}{}",
            pair("F", "F"),
            pair("F", "G"),
            pair("G", "G")
        );
        let fluid = Model::parse("m.toml", &text).unwrap().at(1.0).unwrap();
        let path = folder.path().join("t.eam.alloy");
        write(&fluid, &[2.5, 0.75], grid, &path, Existing::Replace).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let masses: Vec<f64> = text
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>())
            .filter(|words| words.len() == 4 && words[3].starts_with(char::is_alphabetic))
            .map(|words| words[1].parse().unwrap())
            .collect();
        assert_eq!(masses, [2.5, 0.75], "{text}");
    }

    /// ψ = 3n is a pair energy of 2 · 3 w(r), with w = 15/(2π)(1 − r)², beside φ = 5(1 − r)²; the table has r times their sum.
    #[test]
    fn a_linear_excess_free_energy_is_a_pair_energy_of_the_table() {
        let folder = tempfile::tempdir().unwrap();
        let grid = Grid { spacing: 0.01, largest_density: 40.0, densities: 41 };
        let text = "title = 't'\nspecies = ['F']\n[density.n]\nkernel = 'quadratic'\nrange = 1\n[excess_free_energy]\nF = '3*n'\n\
                    [[pair]]\nbetween = ['F', 'F']\nform = 'soft'\nstrength = 10\nrange = 1\n";
        let fluid = Model::parse("m.toml", text).unwrap().at(1.0).unwrap();
        let path = folder.path().join("t.eam.alloy");
        write(&fluid, &[1.0], grid, &path, Existing::Replace).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let values: Vec<f64> =
            text.lines().skip(6).flat_map(str::split_whitespace).map(|x| x.parse().unwrap()).collect();
        let pairs = &values[values.len() - (values.len() - 41) / 2..];
        for k in [1usize, 20, 50, 99, 100, 103] {
            let r = 0.01 * k as f64;
            let square = (1.0 - r).max(0.0).powi(2);
            let expected = r * (6.0 * 15.0 / (2.0 * PI) + 5.0) * square;
            assert!((pairs[k] - expected).abs() < 1e-9, "{r}: {} {expected}", pairs[k]);
        }
    }
}
