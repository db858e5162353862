//! One configuration, liquid and interface, in every code: forces, energy, virial.

use super::setup::{FINE, Setup};
use super::{Context, Part};
use crate::ExperimentError;
use crate::code::Code;
use crate::fluids::{GAMMA, RC, RD, SET6};
use crate::start::{Filling, equilibrated, simulation};
use psidpd_core::engine::Precision::{Double, Mixed};
use psidpd_core::engine::{PeriodicBox, Step, Want};
use psidpd_core::maximum::largest;
use psidpd_core::model::{ForceLaw, Model};
use psidpd_core::truth;
use psidpd_dynamics::run::{Simulation, State};
use psidpd_lammps_host::Lammps;
use psidpd_report::{Item, Section, Table};
use serde::Serialize;
use serde_json::json;

pub const SEED: u64 = 20_030_520;

/// What a code says of a configuration.
#[derive(Debug, Clone)]
pub(super) struct Point {
    /// Forces by tag.
    pub forces: Vec<[f64; 3]>,
    energy: f64,
    /// xx, yy, zz, xy, xz, yz.
    virial: [f64; 6],
}

/// Relative differences of two [`Point`]s.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Difference {
    /// Largest over the particles, over the root mean square force.
    pub force: f64,
    pub energy: f64,
    /// Over the largest component.
    pub virial: f64,
}

impl Difference {
    pub fn named(&self) -> [(&'static str, f64); 3] {
        [("force", self.force), ("energy", self.energy), ("virial", self.virial)]
    }

    pub fn cells(&self) -> [String; 3] {
        self.named().map(|(_, value)| format!("{value:.1e}"))
    }
}

impl Point {
    pub fn against(&self, truth: &Point) -> Difference {
        let square = |f: &[f64; 3]| f.iter().map(|c| c * c).sum::<f64>();
        let rms = (truth.forces.iter().map(square).sum::<f64>() / truth.forces.len() as f64).sqrt();
        let apart = |(a, b): (&[f64; 3], &[f64; 3])| square(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]).sqrt();
        let furthest = largest(self.forces.iter().zip(&truth.forces).map(apart));
        let virial = largest(self.virial.iter().zip(&truth.virial).map(|(a, b)| (a - b).abs()));
        Difference {
            force: if self.forces.len() == truth.forces.len() { furthest / rms } else { f64::NAN },
            energy: (self.energy - truth.energy).abs() / truth.energy.abs(),
            virial: virial / largest(truth.virial),
        }
    }
}

pub(super) fn point_of(mut simulation: Simulation, step: Option<Step>) -> Result<Point, ExperimentError> {
    simulation.compute(Want::TOTALS, step)?;
    Ok(Point {
        forces: by_tag(&simulation.state().tag, simulation.forces()),
        energy: simulation.potential_energy(),
        virial: simulation.tally().total_virial(),
    })
}

/// The sums over pairs as they are written down, which share no code with those that runs are made with.
fn plain(model: &Model, state: &State, step: Option<Step>) -> Result<Point, ExperimentError> {
    let fluid = model.at(1.0)?;
    let domain = &state.domain;
    let mut x = state.x.clone();
    x.iter_mut().for_each(|x| domain.wrap(x, &mut [0; 3]));
    let species: Vec<usize> = state.species.iter().map(|s| *s as usize).collect();
    let sums = truth::conservative(&fluid, &x, &species, domain)?;
    let energy = sums.energy;
    let (mut forces, mut virial) = (sums.forces, sums.virial);
    if let Some(step) = step {
        let (more, w) = truth::drag_and_noise(&fluid, &x, &state.v, &state.tag, &species, domain, step);
        forces.as_flattened_mut().iter_mut().zip(more.as_flattened()).for_each(|(f, more)| *f += more);
        virial.iter_mut().zip(w).for_each(|(v, w)| *v += w);
    }
    Ok(Point { forces: by_tag(&state.tag, &forces), energy, virial })
}

/// What the native runner computes, held to the sums as they are written down: each of its terms shows in one of these,
/// were it wrong.
fn against_plain(part: &mut Part, state: &State) -> Result<(), ExperimentError> {
    let native = |model: &Model, step| point_of(simulation(model, 1.0, state, SEED, Double)?, step);
    let step = Some(Step { seed: SEED, number: 0, dt: 0.01 });
    for (id, law, gamma, step) in [
        ("conservative", ForceLaw::Conservative, 0.0, None),
        ("lucy", ForceLaw::LucyLammps, 0.0, None),
        ("thermostat", ForceLaw::Conservative, GAMMA, step),
    ] {
        let model = SET6.model(law, gamma)?;
        let found = native(&model, step)?.against(&plain(&model, state, step)?);
        let against = "the sums over pairs as they are written down";
        let of = format!("native, {id}");
        part.bound(&format!("forces.native-{id}"), &of, against, &found, [1e-11; 3]);
    }
    let model = SET6.model(ForceLaw::Conservative, 0.0)?;
    let virial = native(&model, None)?.virial;
    let by_stress = virial[2] - 0.5 * (virial[0] + virial[1]);
    let what = "native: W_zz − (W_xx + W_yy)/2, which makes the surface tension, against the change of U as the box is \
                stretched at constant volume, relative";
    let apart = by_stress / stretching(&model, state)? - 1.0;
    part.at_most("forces.native.stretching", what, apart, 1e-4);
    Ok(())
}

/// dU/d ln A as the faces normal to z are stretched to A at constant volume.
fn stretching(model: &Model, state: &State) -> Result<f64, ExperimentError> {
    let energy = |change: f64| -> Result<f64, ExperimentError> {
        let scale = [(1.0 + change).sqrt(), (1.0 + change).sqrt(), 1.0 / (1.0 + change)];
        let lengths = state.domain.lengths();
        let lengths = std::array::from_fn(|c| scale[c] * lengths[c]);
        let origin = state.domain.origin();
        let mut stretched = state.clone();
        stretched.domain = PeriodicBox::orthogonal(origin, lengths, state.domain.periodic())
            .map_err(|e| ExperimentError::Run(psidpd_dynamics::run::RunError::State(e.to_string())))?;
        for x in &mut stretched.x {
            *x = stretched.domain.point(state.domain.fraction(*x));
        }
        Ok(point_of(simulation(model, 1.0, &stretched, SEED, Double)?, None)?.energy)
    };
    // The second derivative jumps where pairs leave a range: a small step, and rounding is far below.
    const H: f64 = 1e-5;
    Ok((energy(H)? - energy(-H)?) / (2.0 * H))
}

pub(super) fn by_tag(tags: &[i32], values: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut ordered = vec![[f64::NAN; 3]; values.len()];
    for (tag, value) in tags.iter().zip(values) {
        ordered[*tag as usize - 1] = *value;
    }
    ordered
}

/// An instance of LAMMPS with the fluid set up and the virial of the pair forces as `c_virial`.
pub fn open(context: &Context, setup: &Setup, state: &State, name: &str) -> Result<Lammps, ExperimentError> {
    open_deck(context, &setup.prepare(context, state, &context.work.join(name), true)?)
}

/// Opens LAMMPS with a deck: any commands up to the pair style.
pub(super) fn open_deck(context: &Context, deck: &str) -> Result<Lammps, ExperimentError> {
    let lammps = Lammps::open(&context.lammps.host, &[])?;
    lammps.commands(deck)?;
    lammps.commands(
        "compute virial all pressure NULL virial\nthermo_style custom step pe press c_virial[1]\n\
         thermo_modify norm no\nfix move all nve\ntimestep 0.01\n",
    )?;
    Ok(lammps)
}

pub(super) fn point(lammps: &Lammps, volume: f64) -> Result<Point, ExperimentError> {
    lammps.command("run 0 post no")?;
    let forces = lammps.gather("f", 3)?.as_chunks::<3>().0.to_vec();
    let pressure = lammps.compute_vector("virial")?;
    Ok(Point {
        forces,
        energy: lammps.thermo("pe")?,
        virial: std::array::from_fn(|k| pressure.get(k).copied().unwrap_or(f64::NAN) * volume),
    })
}

pub fn run(context: &Context) -> Result<Part, ExperimentError> {
    let lengths = if context.full { [15.0, 15.0, 20.0] } else { [10.0, 10.0, 15.0] };
    let filling = Filling { lengths, thickness: 0.5 * lengths[2] };
    let state = equilibrated(Double, &SET6.fluid, filling, 500, SEED)?;
    let volume = state.domain.volume(3);
    let text = format!(
        "{} particles of Warren's set 6: a slab of liquid with two interfaces, equilibrated by the \
         native runner (seed {SEED}).",
        state.len()
    );
    let heading = "Forces, energy and virial of one configuration";
    let mut part = Part { section: Section::new(heading, vec![Item::Prose(text)]), ..Part::of("forces") };
    let mut table = Table::new(["code", "law", "against", "force", "energy", "virial"]);
    let mut compare =
        |part: &mut Part, setup: Setup, id: &str, truth: &Point, limits: [f64; 3], note: &str| {
            let lammps = open(context, &setup, &state, &format!("forces-{id}"))?;
            let found = point(&lammps, volume)?.against(truth);
            let law = match setup.law {
                ForceLaw::Conservative => "conservative",
                ForceLaw::LucyLammps => "Lucy",
            };
            let label = format!("{}{}", setup.label(), if setup.newton { "" } else { ", newton off" });
            let [force, energy, virial] = found.cells();
            table.push([label.clone(), law.to_owned(), note.to_owned(), force, energy, virial]);
            let id = format!("forces.{id}");
            part.bound(&id, &format!("{label}, {law} law"), note, &found, limits);
            part.values.push((id, json!(found)));
            Ok::<(), ExperimentError>(())
        };
    let setup = |code, law| Setup { seed: SEED, spacing: FINE, ..Setup::new(code, &SET6, law) };
    // These sums go over every pair and its images.
    let small = Filling { lengths: [6.0, 6.0, 9.0], thickness: 4.5 };
    against_plain(&mut part, &equilibrated(Double, &SET6.fluid, small, 500, SEED)?)?;
    use ForceLaw::{Conservative, LucyLammps};
    let native = |model: &Model, step| point_of(context.simulation(model, 1.0, &state, SEED)?, step);
    let truth = native(&SET6.model(Conservative, 0.0)?, None)?;
    let tight = [1e-12; 3];
    let plugin = setup(Code::Psi, Conservative);
    compare(&mut part, plugin, "psi", &truth, tight, "native")?;
    compare(&mut part, Setup { newton: false, ..plugin }, "psi-newton-off", &truth, tight, "native")?;
    compare(&mut part, setup(Code::MdpdPsi, Conservative), "mdpd-psi", &truth, tight, "native")?;
    compare(&mut part, setup(Code::Eam, Conservative), "eam", &truth, [1e-6; 3], "native")?;
    // The largest error of a force is near 2e-6 of the rms force.
    let loose = [2e-5, 1e-6, 1e-5];
    compare(&mut part, Setup { precision: Mixed, ..plugin }, "psi-mixed", &truth, loose, "native")?;
    let model = SET6.model(Conservative, 0.0)?;
    let mixed = point_of(simulation(&model, 1.0, &state, SEED, Mixed)?, None)?.against(&truth);
    let of = "native in mixed precision";
    part.bound("forces.native-mixed", of, "double precision", &mixed, loose);
    part.values.push(("forces.native-mixed".into(), json!(mixed)));
    let step = Step { seed: SEED, number: 0, dt: 0.01 };
    let noisy = native(&SET6.model(Conservative, GAMMA)?, Some(step))?;
    compare(&mut part, Setup { gamma: GAMMA, ..plugin }, "psi-noise", &noisy, tight, "native, noise on")?;
    let lucy = native(&SET6.model(LucyLammps, 0.0)?, None)?;
    compare(&mut part, setup(Code::MdpdPsi, LucyLammps), "mdpd-psi-lucy", &lucy, tight, "native")?;
    let built_in = setup(Code::Mdpd, LucyLammps);
    // The energy that mdpd tallies is not that of any potential: see the report.
    let but_energy = [1e-10, f64::INFINITY, 1e-10];
    compare(&mut part, built_in, "mdpd", &lucy, but_energy, "native, same law")?;
    let unlike = [f64::INFINITY; 3];
    compare(&mut part, built_in, "mdpd-conservative", &truth, unlike, "native, conservative law")?;

    part.section.items.push(Item::Table(table));
    part.section.items.push(Item::prose(
        "Force: largest difference over all particles, over the root mean square force. Virial: largest \
         difference of a component, over the largest component. The last row is no check: it is how far the \
         built-in's force is from the conservative one. The energy that mdpd tallies is not the potential of \
         any force: its many-body term has the prefactor ½ B r_d, where the potential of the quadratic kernel \
         has ¼ B r_d.",
    ));
    let what = "plugin dpd/psi: force against the central difference of compute pe, relative";
    part.at_most("forces.gradient", what, gradient(context)?, 1e-8);
    Ok(part)
}

/// Forces of the plugin against central differences of `compute pe`, particle by particle.
fn gradient(context: &Context) -> Result<f64, ExperimentError> {
    let filling = Filling { lengths: [4.0, 4.0, 6.0], thickness: 3.5 };
    let state = equilibrated(Double, &SET6.fluid, filling, 300, SEED)?;
    let setup = Setup::new(Code::Psi, &SET6, ForceLaw::Conservative);
    let lammps = open(context, &setup, &state, "forces-gradient")?;
    let truth = point(&lammps, state.domain.volume(3))?;
    let rms = (truth.forces.iter().flatten().map(|c| c * c).sum::<f64>() / truth.forces.len() as f64).sqrt();
    let x0 = lammps.gather("x", 3)?;
    const H: f64 = 1e-3;
    let energy = |index: usize, shift: f64| -> Result<f64, ExperimentError> {
        let mut x = x0.clone();
        x[index] += shift;
        lammps.scatter("x", 3, &x)?;
        lammps.command("run 0 post no")?;
        Ok(lammps.thermo("pe")?)
    };
    let mut worst: f64 = 0.0;
    for particle in smooth_particles(&state, 3.0 * H).into_iter().take(8) {
        for k in 0..3 {
            let index = 3 * particle + k;
            let near = energy(index, H)? - energy(index, -H)?;
            let far = energy(index, 2.0 * H)? - energy(index, -2.0 * H)?;
            let slope = (8.0 * near - far) / (12.0 * H);
            let error = (truth.forces[particle][k] + slope).abs() / rms;
            worst = if error > worst || error.is_nan() { error } else { worst };
        }
    }
    Ok(worst)
}

/// Particles (by tag − 1) none of whose neighbours, nor their neighbours, is about to cross the range of a
/// kernel, where the second derivative of the energy jumps and differences lose their order.
fn smooth_particles(state: &State, margin: f64) -> Vec<usize> {
    let ordered = by_tag(&state.tag, &state.x);
    let smooth = |i: &usize| {
        ordered.iter().enumerate().filter(|(j, _)| j != i).all(|(_, x)| {
            let d = state.domain.minimum_image(ordered[*i], *x);
            let r = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            (r - RC).abs() > margin && (r - RD).abs() > margin
        })
    };
    (0..ordered.len()).filter(smooth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_core::engine::Fault;

    /// An engine one of whose terms is 5 % wrong fails the checks of `psidpd validate`.
    #[test]
    fn every_fault_of_the_engine_fails_a_check() {
        let filling = Filling { lengths: [4.0, 4.0, 6.0], thickness: 3.0 };
        let state = equilibrated(Double, &SET6.fluid, filling, 100, SEED).unwrap();
        let failed = |fault: Option<Fault>| -> Vec<String> {
            let mut part = Part::default();
            Fault::during(fault, || against_plain(&mut part, &state)).unwrap();
            part.checks.iter().filter(|c| !c.passed).map(|c| c.id.clone()).collect()
        };
        assert_eq!(failed(None), Vec::<String>::new());
        for fault in Fault::ALL {
            let failed = failed(Some(fault));
            let sign = match fault {
                Fault::Drag | Fault::Noise => "forces.native-thermostat.force",
                Fault::Virial => "forces.native.stretching",
                _ => "forces.native-conservative.force",
            };
            assert!(failed.iter().any(|id| id == sign), "{fault:?}: {failed:?}");
        }
    }

    /// A term that is 5 % wrong, in the forces or in the virial, is far beyond every limit; so is NaN.
    #[test]
    fn wrong_terms_and_numbers_that_are_none_show() {
        let filling = Filling::cube(4.0);
        let state = equilibrated(Double, &SET6.fluid, filling, 20, SEED).unwrap();
        let step = Some(Step { seed: SEED, number: 0, dt: 0.01 });
        let model = SET6.model(ForceLaw::Conservative, GAMMA).unwrap();
        let right = point_of(Simulation::new(&model, 1.0, state.clone(), SEED).unwrap(), step).unwrap();
        let whole = right.against(&plain(&model, &state, step).unwrap());
        assert!(whole.force < 1e-11 && whole.energy < 1e-11 && whole.virial < 1e-11, "{whole:?}");
        let text = model.source().text();
        let wrong = |from: &str, to: &str| {
            assert!(text.contains(from), "{text}");
            let model = Model::parse("wrong.toml", &text.replace(from, to)).unwrap();
            right.against(&plain(&model, &state, step).unwrap())
        };
        for (from, to) in [("-40.0", "-42.0"), ("25.0", "26.25"), ("18.0", "18.9")] {
            let found = wrong(from, to);
            assert!(found.force > 1e-4 && found.virial > 1e-4, "{from}: {found:?}");
        }
        for bad in [1.05, f64::NAN] {
            let virial = right.virial.map(|w| w * bad);
            let found = Point { virial, ..right.clone() }.against(&right);
            assert!(found.virial.is_nan() || found.virial > 1e-3, "{found:?}");
            let mut forces = right.forces.clone();
            forces[0][1] *= bad;
            let found = Point { forces, ..right.clone() }.against(&right);
            assert!(found.force.is_nan() || found.force > 1e-5, "{found:?}");
        }
    }
}
