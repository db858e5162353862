//! Figures 4, 5 and 8: the mean local density.

use super::{FIT_DENSITIES, K2, K3, K4, fluid, point};
use crate::ExperimentError;
use crate::calibrate::{Point, fit_density};
use crate::papers::case::{Reproduction, curve, line, points};
use crate::papers::context::{Context, Fluid, with_parameters};
use psidpd_observe::Measured;

pub fn fig4(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    for (k, model) in [(3, K3), (4, K4)] {
        for rho in [4.0, 8.0] {
            let observed = context.bulk(&format!("k{k}-rho{rho}"), &fluid(model), &[rho])?;
            let rwg = observed.scalar("local_density_means", "rwg_F_F");
            // "approximately … by a constant equal to 1.05", for all densities above 2: the last digit.
            outcome.equal(format!("-[r w' g]/3, k = {k}, density {rho}"), rwg, [1.0 / 1.05, 0.005 / 1.05]);
        }
    }
    Ok(())
}

/// Compares a linear fit of ρ(⟨n⟩) over densities 2 to 10.
pub fn compare_line(outcome: &mut Reproduction, found: &[Point], offset: f64, slope: f64) {
    let Some(fit) = fit_density(found, 0, 1) else { return };
    let error = |m: usize| fit.errors[m].unwrap_or(f64::NAN);
    let of = |m: usize| [fit.coefficients[m], error(m)];
    outcome.equal("slope of rho(<n>)", of(1), [slope, 0.0005]);
    outcome.equal("offset of rho(<n>)", of(0), [offset, 0.005]);
    let measured: Vec<_> = found.iter().map(|p| (p.means[0].value, p.total.into())).collect();
    let published = curve("published", line(0.5, 10.0, |n| offset + slope * n));
    let series = vec![points("measured", &measured), published];
    outcome.plot("density", "Corrected density", ["<n>", "density"], series);
}

pub fn fig5(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let mut found = Vec::new();
    for rho in FIT_DENSITIES {
        found.push(point(&context.bulk(&format!("rho{rho}"), &fluid(K3), &[rho])?, rho));
    }
    compare_line(outcome, &found, 1.54, 1.047);
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
        let mut found = Vec::new();
        for rho in [3.0, 5.5, 8.0] {
            let observed = context.bulk(&format!("a{a}-rho{rho}"), &fluid, &[rho])?;
            found.push((rho, point(&observed, rho).means[0]));
        }
        curves.push((name, found));
    }
    let at = |a: usize, rho: usize| curves[a].1[rho].1;
    for (k, (rho, n)) in curves[0].1.iter().enumerate() {
        // "Equal to the average density", but for N − 1 neighbours of N particles.
        let others = 1.0 - 1.0 / context.pick(1500.0, 1000.0 * rho);
        outcome.equal(format!("<n>/rho at density {rho}, A = 0"), n.times(1.0 / rho), others);
        let [first, second, third] = [0, 1, 2].map(|a| at(a, k).minus(at(a + 1, k)));
        // "Varies quite strongly" up to 5, "slowly decreases" beyond.
        let name = format!("fall of <n> from A = 5 to 20 over that from 0 to 5, density {rho}");
        outcome.at_most(name, second.over(first), 0.5);
        outcome.at_least(format!("fall of <n> from A = 20 to 100, density {rho}"), third, 0.0);
    }
    for (a, (name, found)) in curves.iter().enumerate() {
        // "Linear in density": the middle is on the line between the ends, to what can be read in the figure.
        let middle = at(a, 0).plus(at(a, 2)).times(0.5);
        let name = format!("<n> at density 5.5 over the line through 3 and 8, {name}");
        outcome.read(name, found[1].1.over(middle), [1.0, 0.01]);
    }
    let mut series: Vec<_> = curves.iter().map(|(name, found)| points(name, found)).collect();
    series.push(curve("density", line(0.0, 9.0, |x| x)));
    outcome.plot("means", "Standard DPD", ["density", "<n>"], series);
    Ok(())
}
