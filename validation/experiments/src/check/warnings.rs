//! The checks, one function each.

use super::findings::{Severity, Warning};
use crate::ExperimentError;
use psidpd_core::maximum::largest;
use psidpd_core::model::curve::CurveForm;
use psidpd_core::model::kernel::KernelKind;
use psidpd_core::model::pair::PairForm;
use psidpd_core::model::{ExcessFreeEnergy, Fluid};
use psidpd_core::theory::{
    Singularity, SingularityKind, Stability, TheoryError, singular_densities, thermodynamic_limit,
};
use std::f64::consts::TAU;

/// What mean field says of the fluid, as far as it applies.
pub struct State<'a> {
    pub densities: Option<&'a [f64]>,
    pub pressure: Option<f64>,
    pub stability: Option<&'a Stability>,
    /// Why there is no mean field, where there should be one.
    pub no_theory: Option<TheoryError>,
}

/// All warnings, the most severe first.
pub fn all(fluid: &Fluid, state: &State) -> Result<Vec<Warning>, ExperimentError> {
    let mut found = Vec::new();
    found.extend(not_conservative(fluid));
    if let Some(species) = fluid.stated_slopes() {
        found.push(no_free_energy(species));
    } else {
        match &state.no_theory {
            Some(reason) => found.push(no_mean_field(reason)),
            None => found.extend(collapse(fluid)?),
        }
        if !matches!(state.no_theory, Some(TheoryError::TooLarge(_))) {
            found.extend(singular(fluid, state.densities)?);
        }
    }
    found.extend(uncalibrated(fluid));
    found.extend(state.pressure.and_then(not_finite));
    found.extend(state.stability.and_then(|stability| unstable(fluid, stability)));
    found.extend(jumps(fluid));
    found.sort_by_key(|w| std::cmp::Reverse(w.severity));
    Ok(found)
}

/// A warning if the model states a pressure, and its density is not corrected for correlations.
pub fn uncalibrated(fluid: &Fluid) -> Option<Warning> {
    let target = fluid.excess.iter().find_map(|excess| match excess {
        ExcessFreeEnergy::Curve(curve) if matches!(curve.form, CurveForm::Pressure(_)) => Some(curve.density),
        _ => None,
    })?;
    let density = &fluid.densities[target];
    let message = format!(
        "a run will not have the pressure that the model asks for: density {} has no correction for the correlations of \
         particles, which often cost a fifth of the pressure; find it with: psidpd calibrate MODEL --kT {} --density LOW:HIGH \
         --out FILE",
        density.name, fluid.kt
    );
    let missing = density.correction.iter().all(|c| c.is_identity());
    missing.then_some(Warning { id: "uncalibrated", severity: Severity::Warning, message })
}

fn no_mean_field(reason: &TheoryError) -> Warning {
    let message = format!("{reason}; neither stability nor the thermodynamic limit is checked");
    Warning { id: "no-mean-field", severity: Severity::Warning, message }
}

fn not_finite(pressure: f64) -> Option<Warning> {
    let message = format!(
        "the mean-field pressure at these densities is {pressure}: psi is not defined there; choose other densities, or set \
         bounds on the density that leave such places out"
    );
    (!pressure.is_finite()).then_some(Warning { id: "not-finite", severity: Severity::Error, message })
}

fn not_conservative(fluid: &Fluid) -> Option<Warning> {
    let density = fluid.densities.iter().find(|d| d.force_kernel != d.kernel)?;
    let message = format!(
        "the force of density {} is not the gradient of its {} kernel (force_kernel = {}): it has no potential, does work \
         around closed loops and heats the fluid; leave force_kernel out unless that law is what you study",
        density.name,
        density.kernel.kind().name(),
        density.force_kernel.kind().name()
    );
    Some(Warning { id: "not-conservative", severity: Severity::Warning, message })
}

fn no_free_energy(species: &str) -> Warning {
    let message = format!(
        "the force of species {species} is stated (slopes) and not derived from a psi: unless its slopes are those of one \
         psi it has no potential and heats the fluid, and there is no mean field to check it by; write psi as a formula of \
         the partial densities unless that law is what you study"
    );
    Warning { id: "no-free-energy", severity: Severity::Warning, message }
}

fn collapse(fluid: &Fluid) -> Result<Option<Warning>, ExperimentError> {
    let Err(limit) = thermodynamic_limit(fluid)? else { return Ok(None) };
    let (severity, how) = if limit.is_uniform() {
        (Severity::Error, "it collapses at once")
    } else {
        (Severity::Warning, "it may collapse onto a lattice, at densities that a run may never come near")
    };
    let message = format!(
        "{limit}: {how}; make the repulsion stronger or of longer range, or add a psi that grows faster than n"
    );
    Ok(Some(Warning { id: "no-thermodynamic-limit", severity, message }))
}

/// How far beyond the mean density a particle's local density goes in a run, with a random start.
const REACH: f64 = 3.0;

fn singular(fluid: &Fluid, densities: Option<&[f64]>) -> Result<Vec<Warning>, ExperimentError> {
    let count = fluid.species.len();
    let (composition, total) = match densities {
        Some(rho) if rho.iter().sum::<f64>() > 0.0 => (rho.to_vec(), rho.iter().sum()),
        _ => (vec![1.0; count], 10.0),
    };
    // The pair potentials do not matter here, and may have no integral.
    let mut bounded = fluid.clone();
    bounded.pairs.clear();
    let mut unbounded = bounded.clone();
    unbounded.densities.iter_mut().for_each(|d| d.bounds = None);
    let range = [0.0, REACH * total];
    let left = singular_densities(&bounded, &composition, range)?;
    let mut all = left.clone();
    let among = |list: &[Singularity], s: &Singularity| {
        list.iter().any(|t| t.species == s.species && (t.density - s.density).abs() <= 1e-6 * s.density)
    };
    all.extend(singular_densities(&unbounded, &composition, range)?.into_iter().filter(|s| !among(&left, s)));
    let corner = singular_in_sums(&bounded)?;
    let warnings = all.iter().enumerate().map(|(place, s)| {
        let excluded = place >= left.len();
        let open = corner.contains(&s.species);
        let bounds: Vec<&str> = bounds_of(fluid, s.species);
        let name = &fluid.species[s.species];
        let (what, advice) = match s.kind {
            SingularityKind::Origin => (
                format!("psi of {name} or its slope is not finite for a particle without neighbours: it stops the run"),
                "count the self term (self = true), or set bounds on the density",
            ),
            SingularityKind::Pole | SingularityKind::Edge => (
                format!(
                    "psi of {name} is singular at total density {:.4}, {:.2} times the mean",
                    s.density,
                    s.density / total
                ),
                "start from a lattice with a short time step, or set bounds on the density",
            ),
        };
        let inside = densities.is_some() && s.density > 0.0 && s.density <= total;
        let message = match (excluded, bounds.is_empty()) {
            (true, _) if inside => format!(
                "{what}: bounds of {} put another psi in its place, and this density is nothing but that; lower the density",
                bounds.join(", ")
            ),
            (true, _) if open => format!(
                "{what}; the bounds of {} hold for the part of each species, and a mixture of parts within them still reaches \
                 it: a run can stop there; lower the upper bound to a share of the sum",
                bounds.join(", ")
            ),
            (true, _) => format!("{what}; the bounds of {} keep runs away from it", bounds.join(", ")),
            (false, true) => format!("{what}; {advice}"),
            (false, false) => format!("{what}; {advice} that leave it out: those of {} do not", bounds.join(", ")),
        };
        let severity = match (excluded, inside) {
            (_, true) => Severity::Error,
            (true, false) if !open => Severity::Note,
            (_, false) => Severity::Warning,
        };
        Warning { id: "singular", severity, message }
    });
    Ok(warnings.collect())
}

/// The species whose ψ is singular in a mixture of equal parts that each are within the bounds: bounds hold the part of each
/// species, not their sum.
fn singular_in_sums(fluid: &Fluid) -> Result<Vec<usize>, ExperimentError> {
    let count = fluid.species.len();
    let highest = fluid
        .densities
        .iter()
        .filter_map(|d| d.bounds)
        .map(|bounds| bounds.high)
        .filter(|high| high.is_finite());
    let highest = highest.fold(0.0, f64::max);
    if count == 1 || highest == 0.0 {
        return Ok(Vec::new());
    }
    let found = singular_densities(fluid, &vec![1.0; count], [0.0, highest * count as f64])?;
    Ok(found.iter().filter(|s| s.kind != SingularityKind::Origin).map(|s| s.species).collect())
}

/// The densities with bounds that ψ of `species` depends on.
fn bounds_of(fluid: &Fluid, species: usize) -> Vec<&str> {
    let count = fluid.species.len();
    let depends = |d: usize| match &fluid.excess[species] {
        ExcessFreeEnergy::Formula(psi) => (0..count).any(|s| psi.depends_on(d * count + s)),
        ExcessFreeEnergy::Curve(curve) => curve.density == d,
        ExcessFreeEnergy::Slopes(_) => false,
    };
    let bounded = |d: &usize| fluid.densities[*d].bounds.is_some() && depends(*d);
    (0..fluid.densities.len()).filter(bounded).map(|d| fluid.densities[d].name.as_str()).collect()
}

/// The names of kernels with which a strong repulsion does not make particles cluster.
fn positive_definite() -> String {
    let all = KernelKind::ALL.iter().filter(|kind| kind.is_positive_definite());
    all.map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
}

fn unstable(fluid: &Fluid, stability: &Stability) -> Option<Warning> {
    if stability.spinodal {
        let message = "in mean field this state is inside the spinodal: it separates into phases of other densities or \
                       compositions (fine for a slab, a drop or demixing; not for a bulk equation of state)";
        return Some(Warning { id: "spinodal", severity: Severity::Warning, message: message.into() });
    }
    let k = stability.k_star.filter(|_| !stability.stable)?;
    let may_cluster = fluid.densities.iter().any(|density| !density.kernel.kind().is_positive_definite());
    let kernel = if may_cluster {
        format!("a positive definite kernel ({}), ", positive_definite())
    } else {
        String::new()
    };
    let message = format!(
        "in mean field S(k) diverges before this state is reached, at k* = {k:.3}: the fluid clusters or freezes with \
         wavelength {:.3}; {kernel}a lower density or a higher kT avoids it",
        TAU / k
    );
    Some(Warning { id: "clustering", severity: Severity::Warning, message })
}

/// A fluid that a measured line has found to be a crystal.
pub fn crystal() -> Warning {
    Warning {
        id: "crystal",
        severity: Severity::Warning,
        message: "expect a crystal: tensions, widths, contact angles, viscosities and whatever else assumes a liquid mean nothing; \
                  a weaker attraction or a higher kT melts it"
            .into(),
    }
}

fn jumps(fluid: &Fluid) -> Vec<Warning> {
    let mut found = Vec::new();
    for density in fluid.densities.iter().filter(|d| d.force_kernel.kind() == KernelKind::Linear) {
        let message = format!(
            "the linear kernel of density {} makes the force jump at its range: energy is conserved only to first order in \
             the time step",
            density.name
        );
        found.push(Warning { id: "force-jump", severity: Severity::Note, message });
    }
    for term in &fluid.pairs {
        let range = term.potential.range();
        let edge = term.potential.at(range * (1.0 - 1e-9)).0.abs();
        let inside = largest((1..20).map(|k| term.potential.at(range * k as f64 / 20.0).0.abs()));
        if edge > 1e-6 * inside {
            let [a, b] = term.between.map(|s| &fluid.species[s]);
            let message = format!(
                "the pair potential between {a} and {b} is {edge:.3e} at its range and zero beyond: energy jumps when \
                 particles cross it; let it vanish there"
            );
            found.push(Warning { id: "energy-jump", severity: Severity::Warning, message });
        }
    }
    found
}
