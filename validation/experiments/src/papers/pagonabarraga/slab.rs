//! Figures 7 to 9: a slab of liquid beside its gas, in two dimensions.

use super::SLAB;
use crate::ExperimentError;
use crate::papers::case::{Reproduction, bare, curve, extreme, points};
use crate::papers::context::{Context, edited, mean_field};
use crate::run::Observed;

const SCENE: &str = include_str!("../../../../scenes/full/van-der-waals-2d-slab.toml");
const RUN: &str = "slab";
const KT: f64 = 0.75;

fn slab(context: &Context) -> Result<(Context, Observed), ExperimentError> {
    let context = context.shared("pagonabarraga-slab");
    let msd = context.pick("observe.msd={ length = 250 }", "observe.msd={ length = 2000 }");
    let scene = edited(SCENE, &[msd, "observe.interface_width=true"])?;
    let changes = ["equilibrate=2000", "steps=10000", "output.dump=0", "observe.every=20"];
    let observed = context.shipped(RUN, SLAB, &scene, &changes)?;
    Ok((context, observed))
}

pub fn fig7(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let (context, observed) = slab(context)?;
    // "Does not shift, and corresponds to its nominally assigned value": the last digit of that.
    outcome.equal("kinetic temperature", observed.temperature(), [KT, 0.005]);
    let tension = observed.scalar("surface_tension", "stress");
    outcome.at_least("tension over its error", tension.value / tension.error, 3.0);
    let msd = observed.profile("msd", "msd");
    let width = observed.scalar("interface_width", "width_10_90");
    if let Some((_, last)) = msd.last() {
        let ratio = last.over(width.times(width.value));
        outcome.at_least("mean-square displacement over the square of the width", ratio, 1.0);
    }
    let msd = vec![curve("msd", bare(&msd))];
    outcome.plot("msd", "Mean-square displacement", ["time", "msd"], msd);
    context.plot_thermo(RUN, "Slab", outcome)
}

pub fn fig8(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let (_, observed) = slab(context)?;
    let shape = |column| observed.scalar("interface_width", column);
    let (gas, liquid) = (shape("vapour"), shape("liquid"));
    // Printed without a digit after the point.
    outcome.equal("density of the gas", gas, [10.0, 0.5]);
    // "ρ_liq/ρ_gas = 4": between 3.5 and 4.5.
    outcome.equal("density of the gas over that of the liquid", gas.over(liquid), [0.25, 0.03]);
    // What follows from the printed parameters.
    let binodal = mean_field(SLAB, KT)?.binodal()?;
    // A hundredth is for the correlations that mean field leaves out.
    let expected = [binodal.liquid, 0.01 * binodal.liquid];
    outcome.own("density of the liquid beside mean field", liquid, expected);
    let density = observed.profile("density_profile", "density");
    // "The decay of the density is monotonic": no layer is denser than the liquid, but for noise.
    let share = extreme(&density, 1.0).minus(liquid).over(liquid);
    outcome.at_most("highest density over that of the liquid, less one", share, 0.03);
    outcome.plot("density", "Slab", ["y", "density"], vec![points("density", &density)]);
    let stress = |column| curve(column, bare(&observed.profile("stress_profile", column)));
    outcome.plot("pressures", "Slab", ["y", "pressure"], vec![stress("normal"), stress("tangential")]);
    Ok(())
}

pub fn fig9(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let (_, observed) = slab(context)?;
    let free_energy = observed.scalar("surface_tension", "free_energy");
    // Both of configurations alone. What the integrator carries is smaller in proportion to the step: 5 % at 0.01, 2 % at
    // 0.005.
    let conservative = observed.scalar("surface_tension", "stress_conservative");
    outcome.own("tension by the free energy beside that by the stress", free_energy, conservative);
    let stress = |name, column| curve(name, bare(&observed.profile("stress_profile", column)));
    let lines = vec![stress("P_N − P_T", "difference"), stress("integral", "integral")];
    outcome.plot("difference", "Slab", ["y", "P_N − P_T"], lines);
    Ok(())
}
