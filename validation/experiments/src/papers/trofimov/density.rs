//! Figures 4, 5 and 8: the mean local density.

use super::{FIT_DENSITIES, K2, K3, K4, fluid, point};
use crate::ExperimentError;
use crate::calibrate::{Fit, Point, fit_density};
use crate::papers::case::{Reproduction, difference, line, ratio};
use crate::papers::context::{Context, Fluid, with_parameters};
use psidpd_observe::Measured;

pub fn fig4(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    for (k, model) in [(3, K3), (4, K4)] {
        for rho in [4.0, 8.0] {
            let observed = context.bulk(&format!("k{k}-rho{rho}"), &fluid(model), &[rho])?;
            let rwg = observed.scalar("local_density_means", "rwg_F_F");
            // "approximately … by a constant equal to 1.05", for all densities above 2: the last digit.
            outcome.equal(format!("-[r w' g]/3, k = {k}, density {rho}"), rwg, 1.0 / 1.05, 0.005 / 1.05);
        }
    }
    Ok(())
}

/// A linear fit of ρ(⟨n⟩) over densities 2 to 10.
fn straight(points: &[Point]) -> Option<Fit> {
    fit_density(points, 0, 1)
}

pub fn compare_line(outcome: &mut Reproduction, points: &[Point], offset: f64, slope: f64) {
    let Some(fit) = straight(points) else { return };
    let error = |m: usize| fit.errors[m].unwrap_or(f64::NAN);
    // The errors of the paper's coefficients are not printed: those of ours hold for both.
    let of = |m: usize| Measured { value: fit.coefficients[m], error: error(m) };
    outcome.equal("slope of rho(<n>)", of(1), slope, error(1).hypot(0.0005));
    outcome.equal("offset of rho(<n>)", of(0), offset, error(0).hypot(0.005));
    let measured =
        points.iter().map(|p| (p.means[0].value, Measured { value: p.total, error: 0.0 })).collect();
    let published = line(0.5, 10.0, |n| offset + slope * n);
    outcome.plot(
        "density",
        "Corrected density",
        ["<n>", "density"],
        &[("measured", measured)],
        &[("published", published)],
    );
}

pub fn fig5(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut points = Vec::new();
    for rho in FIT_DENSITIES {
        points.push(point(&context.bulk(&format!("rho{rho}"), &fluid(K3), &[rho])?, rho));
    }
    compare_line(outcome, &points, 1.54, 1.047);
    Ok(())
}

/// ⟨n⟩ of standard DPD, `p = ρkT + Aρ²`.
pub fn fig8(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let strengths = [(0.0, "A = 0"), (5.0, "A = 5"), (20.0, "A = 20"), (100.0, "A = 100")];
    let mut curves: Vec<(&str, Vec<(f64, Measured)>)> = Vec::new();
    for (a, name) in strengths {
        let model = with_parameters(K2, &[("A", a)])?;
        // A = 100 is the pair force of strength 955.
        let fluid = Fluid { dt: if a > 50.0 { 0.0025 } else { 0.01 }, ..fluid(&model) };
        let mut curve = Vec::new();
        for rho in [3.0, 5.5, 8.0] {
            let observed = context.bulk(&format!("a{a}-rho{rho}"), &fluid, &[rho])?;
            curve.push((rho, point(&observed, rho).means[0]));
        }
        curves.push((name, curve));
    }
    let at = |a: usize, rho: usize| curves[a].1[rho].1;
    for (k, (rho, n)) in curves[0].1.iter().enumerate() {
        // N − 1 neighbours of N particles; the ideal gas has no other correlation.
        outcome.equal(
            format!("<n>/rho at density {rho}, A = 0"),
            n.times(1.0 / rho),
            1.0,
            1.0 / context.pick(1500.0, 1000.0 * rho),
        );
        let (first, second, third) =
            (difference(at(0, k), at(1, k)), difference(at(1, k), at(2, k)), difference(at(2, k), at(3, k)));
        // "Varies quite strongly" up to 5, "slowly decreases" beyond.
        outcome.at_most(
            format!("fall of <n> from A = 5 to 20 over that from 0 to 5, density {rho}"),
            ratio(second, first),
            0.5,
        );
        outcome.at_least(format!("fall of <n> from A = 20 to 100, density {rho}"), third, 0.0);
    }
    for (a, (name, curve)) in curves.iter().enumerate() {
        // "Linear in density": the middle is on the line between the ends, to what can be read in the figure.
        let middle = Measured {
            value: 0.5 * (at(a, 0).value + at(a, 2).value),
            error: 0.5 * at(a, 0).error.hypot(at(a, 2).error),
        };
        outcome.equal(
            format!("<n> at density 5.5 over the line through 3 and 8, {name}"),
            ratio(curve[1].1, middle),
            1.0,
            0.01,
        );
    }
    outcome.plot("means", "Standard DPD", ["density", "<n>"], &curves, &[("density", line(0.0, 9.0, |x| x))]);
    Ok(())
}
