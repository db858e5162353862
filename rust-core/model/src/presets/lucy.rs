//! The force law of LAMMPS's `mdpd` and `mdpd/rhosum`, written as a model file, for comparison with them.
//!
//! ```text
//! F_ij = A_ij (1 − r/r_c,ij) + B_ij (ρ_i + ρ_j)(1 − r/r_d,ij)
//! ρ_i  = Σ_j m_j w(r_ij; r_d,ij),   w(r; h) = 105/(16π h³) (1 + 3r/h)(1 − r/h)³, in two dimensions too
//! ```
//!
//! `ρ` is a mass density summed over all types, so that these forces have no potential unless all `B_ij` and
//! `r_d,ij` are equal (Warren, Phys. Rev. E 87, 045303 (2013)); with Lucy's kernel they never have one.

use super::coefficients::{PresetError, WarrenPair, pair_text, quoted, upper_triangle};
use crate::file::Model;
use std::fmt::Write;

/// Builds the model of the law of LAMMPS's `mdpd` for species `species` of masses `masses`, with `pairs` a row-major table of
/// the coefficients (the upper triangle is read). `A`, `B`, `γ`, `r_c` and `r_d` may all differ by pair.
///
/// The reported energy `Σ_i Σ_β c r_d^{d+1} B n_β ρ_i`, `c_3 = π/30`, `c_2 = π/24`, is that of Warren's
/// ψ, `c r_d^{d+1} B n²`, where all coefficients are equal; the force is not its gradient.
///
/// # Errors
/// Fails for a pair without coefficients, and if the number of masses differs from that of species; also for a range that is not positive, a negative γ, or more than 16 different `r_d`.
pub fn lucy_mdpd(
    species: &[String],
    pairs: &[Option<WarrenPair>],
    masses: &[f64],
    dimensions: usize,
) -> Result<Model, PresetError> {
    let count = species.len();
    let upper = upper_triangle(count, pairs, None)?;
    if masses.len() != count {
        return Err(PresetError::Shape);
    }
    let mut ranges: Vec<f64> = Vec::new();
    // For each pair of species: the index of its density, and its coefficients.
    let mut table = vec![(0, upper[0].2); count * count];
    for (i, j, pair) in &upper {
        let density = ranges.iter().position(|rd| *rd == pair.rd).unwrap_or_else(|| {
            ranges.push(pair.rd);
            ranges.len() - 1
        });
        table[i * count + j] = (density, *pair);
        table[j * count + i] = (density, *pair);
    }

    let names = quoted(species);
    let mut text = format!(
        "title = \"LAMMPS's mdpd: Warren's A/B model with Lucy's kernel\"\n\
         reference = \"P. B. Warren, Phys. Rev. E 68, 066702 (2003), and 87, 045303 (2013)\"\n\
         dimensions = {dimensions}\nspecies = [{}]\n",
        names.join(", "),
    );
    // Writing to a String cannot fail.
    for (k, range) in ranges.iter().enumerate() {
        let _ = write!(
            text,
            "\n[density.{}]\nkernel = \"lucy\"\nforce_kernel = \"quadratic\"\nrange = {range:?}\n",
            density_name(k, ranges.len())
        );
    }
    for (alpha, name) in species.iter().enumerate() {
        let row = &table[alpha * count..][..count];
        let variable = |beta: usize| format!("{}_{}", density_name(row[beta].0, ranges.len()), species[beta]);
        let rho: Vec<String> = (0..count)
            .map(|beta| format!("{}*{}", weight(masses[beta], row[beta].1.rd, dimensions), variable(beta)))
            .collect();
        let rho = rho.join(" + ");
        let energy: Vec<String> = (0..count)
            .map(|beta| format!("{}*{}", strength(row[beta].1, dimensions), variable(beta)))
            .collect();
        let _ = write!(
            text,
            "\n[excess_free_energy.{name}]\nenergy = \"({})*({rho})\"\n\n[excess_free_energy.{name}.slopes]\n",
            energy.join(" + ")
        );
        for beta in 0..count {
            let _ =
                writeln!(text, "{} = \"2*{}*({rho})\"", variable(beta), strength(row[beta].1, dimensions));
        }
    }
    text += &pair_text(&names, &upper);
    Ok(Model::parse("mdpd/psi", &text)?)
}

/// Name of a density: `n`, or `n1`, `n2` … where there are several.
fn density_name(k: usize, densities: usize) -> String {
    if densities == 1 { "n".to_owned() } else { format!("n{}", k + 1) }
}

/// The factor of the kernel in a neighbour's contribution to ρ: its mass, and in two dimensions the
/// ratio of the norms of Lucy's kernel, `105/(16π h³)` over `5/(π h²)`.
fn weight(mass: f64, rd: f64, dimensions: usize) -> String {
    if dimensions == 2 { format!("{mass:?}*21/(16*{rd:?})") } else { format!("{mass:?}") }
}

/// The strength `c r_d^{d+1} B` of ψ.
fn strength(pair: WarrenPair, dimensions: usize) -> String {
    let WarrenPair { b, rd, .. } = pair;
    if dimensions == 2 { format!("(pi/24*{rd:?}^3*({b:?}))") } else { format!("(pi/30*{rd:?}^4*({b:?}))") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(a: f64, b: f64, rc: f64, rd: f64) -> Option<WarrenPair> {
        Some(WarrenPair { a, b, gamma: 4.5, rc, rd, weight: None })
    }

    #[test]
    fn masses_are_needed_for_every_species() {
        let error = lucy_mdpd(&["A".into()], &[pair(-40.0, 25.0, 1.0, 0.75)], &[], 3).unwrap_err();
        assert_eq!(error, PresetError::Shape);
    }

    /// Six species have 21 pairs, but a model file has at most 16 densities.
    #[test]
    fn too_many_ranges_are_an_error() {
        let names: Vec<String> = (1..=6).map(|k| format!("T{k}")).collect();
        let table = |ranges: usize| -> Vec<Option<WarrenPair>> {
            let entry =
                |k: usize| pair(-40.0, 25.0, 1.0, 0.5 + 0.01 * ((k / 6 + 6 * (k % 6)) % ranges) as f64);
            (0..36).map(entry).collect()
        };
        assert!(lucy_mdpd(&names, &table(8), &[1.0; 6], 3).is_ok());
        let error = lucy_mdpd(&names, &table(36), &[1.0; 6], 3).unwrap_err().to_string();
        assert!(error.contains("21 densities, more than 16"), "{error}");
    }
}
