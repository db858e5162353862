use super::search::{minimum, spaced, turning_point};
use super::{MeanField, TheoryError};
use crate::free_energy::Psi;
use crate::model::Fluid;

/// A density at which ψ or its derivative is not a finite number.
#[derive(Debug, Clone, PartialEq)]
pub struct Singularity {
    /// Index of the species whose `ψ_α` is singular.
    pub species: usize,
    /// The total density, with species in the given proportions.
    pub density: f64,
    /// The kind of the singularity.
    pub kind: SingularityKind,
}

/// The kinds of a [`Singularity`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SingularityKind {
    /// A particle without neighbours has no finite force or energy, as with `ln n` and `1/n` where
    /// neither the self term nor a correction keeps its density from zero.
    Origin,
    /// ψ′ grows without bound from both sides.
    Pole,
    /// ψ or ψ′ is not a number, or overflows, on one side: the edge of the formula's domain, as `n =
    /// 1/b` of `ln(1 − bn)` (Pagonabarraga–Frenkel eq. 24).
    Edge,
}

/// The singularities of every `ψ_α` for total densities in `range`, with species in the proportions of
/// `composition` (which includes every species), within the bounds of the densities; if `range` begins
/// at 0, also those of a particle without neighbours. The function scans 4000 densities and refines, so
/// that it may miss a pair of singularities closer than `range/4000`.
///
/// # Errors
/// Fails as [`MeanField::new`].
pub fn singular_densities(
    fluid: &Fluid,
    composition: &[f64],
    range: [f64; 2],
) -> Result<Vec<Singularity>, TheoryError> {
    let theory = MeanField::new(fluid)?;
    let grid = spaced(range[0].max(0.0), range[1], 4000);
    Ok((0..fluid.species.len()).flat_map(|alpha| along(&theory, alpha, composition, &grid)).collect())
}

impl MeanField {
    /// The total densities at which coexistence and stability are searched, for species in the
    /// proportions of `composition`: logarithmic from `1e-6` to `1e6` particles in the cube of the
    /// longest range, up to the first singularity of ψ and denser towards it.
    pub(super) fn density_grid(&self, composition: &[f64]) -> Vec<f64> {
        let unit = self.ranges[0].powi(-(self.dimensions as i32));
        let (low, high) = ((1e-6 * unit).ln(), (1e6 * unit).ln());
        let all: Vec<f64> = spaced(low, high, 1200).into_iter().map(f64::exp).collect();
        let present = (0..composition.len()).filter(|alpha| composition[*alpha] > 0.0);
        let singular = present.flat_map(|alpha| along(self, alpha, composition, &all));
        let Some(pole) = singular.map(|s| s.density).min_by(f64::total_cmp) else { return all };
        let mut grid: Vec<f64> = all.into_iter().filter(|rho| *rho < 0.5 * pole).collect();
        grid.extend((0..240).map(|i| pole * (1.0 - 0.5 * 2f64.powf(-(i as f64) / 8.0))));
        grid
    }
}

/// A measure of the slopes of ψ; infinite where ψ is not defined.
fn steepness(psi: &Psi) -> f64 {
    let slope = psi.gradient.iter().map(|g| g.abs()).sum::<f64>();
    if psi.value.is_finite() && slope.is_finite() { slope } else { f64::INFINITY }
}

fn along(theory: &MeanField, alpha: usize, composition: &[f64], grid: &[f64]) -> Vec<Singularity> {
    let total: f64 = composition.iter().sum();
    let at = |rho: f64| {
        let densities: Vec<f64> = composition.iter().map(|x| x / total * rho).collect();
        steepness(&theory.psi(alpha, &densities))
    };
    let values: Vec<f64> = grid.iter().map(|rho| at(*rho)).collect();
    let found = |density, kind| Singularity { species: alpha, density, kind };
    let mut all = Vec::new();
    if grid[0] == 0.0 && !steepness(&theory.psi_at(alpha, &theory.isolated[alpha])).is_finite() {
        all.push(found(0.0, SingularityKind::Origin));
    }
    for i in 1..grid.len() {
        match (values[i - 1].is_finite(), values[i].is_finite()) {
            (true, false) | (false, true) if grid[i - 1] > 0.0 => {
                let edge = turning_point(grid[i - 1], grid[i], |rho| at(rho).is_finite());
                // A pole at a grid point looks like two edges.
                let pole = all.last().is_some_and(|s: &Singularity| {
                    s.kind == SingularityKind::Edge && (edge - s.density).abs() < 1e-12 * edge
                });
                if pole {
                    all.pop();
                }
                all.push(found(edge, if pole { SingularityKind::Pole } else { SingularityKind::Edge }));
            }
            // The peak of the slopes grows without bound as the grid is refined.
            (true, true)
                if i + 1 < grid.len()
                    && values[i + 1].is_finite()
                    && values[i] > values[i - 1].min(values[i + 1])
                    && values[i] >= values[i - 1]
                    && values[i] >= values[i + 1] =>
            {
                let (place, value) = minimum(grid[i - 1], grid[i + 1], |rho| -at(rho));
                if -value > 1e5 * values[i - 1].min(values[i + 1]).max(f64::MIN_POSITIVE) {
                    all.push(found(place, SingularityKind::Pole));
                }
            }
            _ => {}
        }
    }
    all
}
