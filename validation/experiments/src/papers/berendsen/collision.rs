//! Section 11.4: two liquids that do not mix, and drops that meet.

use super::IMMISCIBLE;
use crate::ExperimentError;
use crate::machine::peak_kilobytes;
use crate::papers::case::{Reproduction, bare, curve, points};
use crate::papers::context::Context;

const SMALL: &str = include_str!("../../../../scenes/drop-collision.toml");
const FULL: &str = include_str!("../../../../scenes/full/drop-collision.toml");

pub fn tension(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let [edge, height] = context.pick([6.0, 12.0], [10.0, 20.0]);
    let scene = format!(
        "kT = 1.0\nseed = 1\nbox = [{edge:?}, {edge:?}, {height:?}]\ndensity = 10.0\ndt = 0.01\nequilibrate = {}\nsteps = {}\n\
         [[part]]\nshape = \"layer\"\nface = \"zlo\"\nthickness = {half:?}\nspecies = \"D\"\n\
         [[part]]\nshape = \"layer\"\nface = \"zhi\"\nthickness = {half:?}\nspecies = \"M\"\n\
         [output]\nthermo = 0\n[observe]\nevery = 10\ntemperature = true\ncomposition_profile = {{ recentre = false }}\nsurface_tension = {{ axis = \"z\" }}\n",
        context.pick(1500, 10_000),
        context.pick(6000, 100_000),
        half = 0.5 * height,
    );
    let observed = context.scene("layers", IMMISCIBLE, &scene)?;
    // Printed without a digit after the point.
    outcome.equal("tension by the stress", observed.scalar("surface_tension", "stress"), [28.0, 0.5]);
    outcome.equal(
        "tension by the free energy",
        observed.scalar("surface_tension", "free_energy"),
        [28.0, 0.5],
    );
    let fraction = vec![points("fraction", &observed.profile("composition_profile", "fraction_D"))];
    outcome.plot("fraction", "Two liquids", ["z", "fraction of D"], fraction);
    Ok(())
}

pub fn merge(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let observed = context.shipped("collision", IMMISCIBLE, context.pick(SMALL, FULL), &[])?;
    let largest = observed.profile("clusters_series", "largest");
    let drops = context.pick(2.0_f64, 15.0).powi(3) * 10.0 * 8.0 / 3.0 * std::f64::consts::PI;
    if let [(_, first), .., (_, last)] = largest[..] {
        outcome.equal("largest drop over one drop, before", 2.0 * first.value / drops, [1.0, 0.02]);
        outcome.equal("largest drop over both, after", last.value / drops, [1.0, 0.02]);
    }
    let axes = ["time", "particles of the largest drop"];
    outcome.plot("largest", "Collision", axes, vec![curve("largest", bare(&largest))]);
    Ok(())
}

pub fn size(context: &Context, outcome: &mut Reproduction) -> Result<(), ExperimentError> {
    let smaller = format!("box={:?}", [60.0, 60.0, 104.1667].map(|l| l / 100_f64.cbrt()));
    // A few steps of the scene, with nothing observed; at quick size one liquid fills a smaller box.
    let head = FULL.split("[[part]]").next().unwrap_or(FULL).replace("steps   = 5000", "steps = 20");
    let text = format!(
        "{head}[initial]\nkind = \"lattice\"\nspecies = \"D\"\n[output]\nthermo = 20\n[observe]\nevery = 10\ntemperature = true\n"
    );
    let begun = std::time::Instant::now();
    context.shipped("size", IMMISCIBLE, &text, &[&smaller])?;
    let seconds = begun.elapsed().as_secs_f64();
    let particles = context.pick(3.75e4, 3.75e6);
    // What this process ever had, in GB: 3.75 million particles fit into the memory of a small computer.
    outcome.at_most("memory, GB", peak_kilobytes()? as f64 / 1e6, 4.0);
    let each = seconds / 20.0 * 3.75e6 / particles;
    outcome.at_most("seconds for a step of 3.75 million particles", each, 60.0);
    Ok(())
}
