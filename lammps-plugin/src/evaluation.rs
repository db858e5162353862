//! Evaluations in the units of LAMMPS.

use crate::bridge::{self, Atoms, Extent, Listed, Totals};
use crate::converted::{Converted, times, triples};
use crate::error::StyleError;
use crate::style::{Style, guard};
use crate::units::Scale;
use nalgebra::Matrix3;
use psidpd_core::engine::{
    Around, Engine, EngineError, Newton, PairsOfHost, Particles, PeriodicBox, Request, Step, Surroundings,
    Tally, Want,
};

impl Scale {
    /// The box of LAMMPS in units of the model, with periods along the closed directions only.
    pub fn domain(&self, extent: &Extent) -> Result<PeriodicBox, StyleError> {
        let [xx, yy, zz, yz, xz, xy] = extent.edges.map(|edge| edge / self.length);
        let edges = Matrix3::new(xx, xy, xz, 0.0, yy, yz, 0.0, 0.0, zz);
        let origin = extent.origin.map(|x| x / self.length);
        Ok(PeriodicBox::new(origin, edges, extent.closed)?.divided(extent.periodic))
    }
}

impl Converted {
    /// Converts a request to units of the model; `None` stands for forces without drag and noise. Beside it is room for
    /// forces.
    pub fn take<'a>(
        &'a mut self,
        scale: &Scale,
        atoms: &Atoms<'a>,
        request: Option<&bridge::Request>,
    ) -> (Request<'a>, &'a mut Vec<f64>) {
        let x = times(atoms.x, 1.0 / scale.length, &mut self.x);
        let v = if request.is_some() { atoms.v } else { &[] };
        let v = times(v, 1.0 / scale.velocity(), &mut self.v);
        let particles = Particles { owned: atoms.owned, x: triples(x), tag: atoms.tag, kind: atoms.kind };
        let step = request.filter(|request| request.thermostat);
        let step = step.map(|r| Step { seed: r.seed, number: r.step, dt: r.dt / scale.time });
        let want = request.map_or(Want::FORCES, bridge::Request::want);
        (Request { particles, v: triples(v), step, want }, &mut self.forces)
    }
}

impl Style {
    /// Runs `evaluate` on the request and on forces in units of the model, and adds these to `f`.
    fn add_forces<R>(
        &mut self,
        atoms: &Atoms,
        request: &bridge::Request,
        f: &mut [f64],
        evaluate: impl FnOnce(&mut Engine, &Request, &mut [[f64; 3]]) -> Result<R, EngineError>,
    ) -> Result<R, StyleError> {
        let Style { engine, scale, converted, .. } = self;
        let (request, forces) = converted.take(scale, atoms, Some(request));
        if scale.is_one() {
            return Ok(evaluate(engine, &request, f.as_chunks_mut::<3>().0)?);
        }
        forces.clear();
        forces.resize(f.len(), 0.0);
        let result = evaluate(engine, &request, forces.as_chunks_mut::<3>().0)?;
        f.iter_mut().zip(&*forces).for_each(|(f, force)| *f += scale.force() * force);
        Ok(result)
    }

    /// Adds to `f` all forces on atoms in a box that this rank has all of.
    pub fn evaluate(
        &mut self,
        extent: &Extent,
        atoms: &Atoms,
        request: &bridge::Request,
        f: &mut [f64],
    ) -> Result<Totals, StyleError> {
        guard(|| {
            let domain = self.scale.domain(extent)?;
            let tally = self.add_forces(atoms, request, f, |engine, request, f| {
                engine.forces(&domain, request, f, true)
            })?;
            Ok(self.totals(&tally))
        })
    }

    /// First half of an evaluation: adds to `f` all forces but those of the slopes of ghosts.
    pub fn densities(
        &mut self,
        extent: &Extent,
        images: &[bool],
        newton: bool,
        atoms: &Atoms,
        request: &bridge::Request,
        f: &mut [f64],
    ) -> Result<(), StyleError> {
        guard(|| {
            let around = Around { domain: &self.scale.domain(extent)?, images };
            self.first(Surroundings::Ghosts(around, newton_of(newton)), atoms, request, f)
        })
    }

    /// First half of an evaluation over pairs that LAMMPS lists: the second half adds all forces.
    pub fn densities_of_pairs(
        &mut self,
        &Listed { i, j, factor }: &Listed,
        newton: bool,
        atoms: &Atoms,
        request: &bridge::Request,
    ) -> Result<(), StyleError> {
        let surroundings = Surroundings::Listed(PairsOfHost { i, j, factor }, newton_of(newton));
        guard(|| self.first(surroundings, atoms, request, &mut []))
    }

    fn first(
        &mut self,
        surroundings: Surroundings,
        atoms: &Atoms,
        request: &bridge::Request,
        f: &mut [f64],
    ) -> Result<(), StyleError> {
        self.pending = None;
        let pending =
            self.add_forces(atoms, request, f, |engine, request, f| engine.first(surroundings, request, f))?;
        self.pending = Some(pending);
        Ok(())
    }

    /// Sums every density of the model at the positions of the last evaluation, also those that it did not need.
    pub fn sum_densities(&mut self, extent: &Extent, atoms: &Atoms) -> Result<(), StyleError> {
        guard(|| {
            let Style { engine, scale, converted, .. } = self;
            // LAMMPS has ghosts on all sides of its atoms, also across periods.
            let around =
                Around { domain: &scale.domain(&Extent { closed: [false; 3], ..*extent })?, images: &[] };
            let (request, _) = converted.take(scale, atoms, None);
            engine.sum_densities(Surroundings::Ghosts(around, Newton::On), &request.particles)?;
            Ok(())
        })
    }

    pub fn single(&mut self, kinds: [i32; 2], r: f64, particles: [i32; 2]) -> Result<[f64; 2], StyleError> {
        guard(|| {
            let width = self.engine.plan().slope_width();
            let known = self.engine.slopes_mut().len().checked_div(width);
            let index = |i: i32| match known {
                None => Some(0),
                Some(known) => usize::try_from(i).ok().filter(|i| *i < known),
            };
            let [Some(i), Some(j)] = particles.map(index) else {
                return Err(StyleError(format!(
                    "asked for the pair of particles {} and {}, which the last evaluation did not both contain",
                    particles[0], particles[1]
                )));
            };
            let (energy, force) = self.engine.single(kinds, r / self.scale.length, [i, j]);
            Ok([self.scale.energy * energy, self.scale.force() * force])
        })
    }

    /// Second half of an evaluation: adds the rest of the forces to `f`.
    pub fn forces(
        &mut self,
        atoms: &Atoms,
        request: &bridge::Request,
        f: &mut [f64],
    ) -> Result<Totals, StyleError> {
        guard(|| {
            let pending = self.pending.take().ok_or_else(|| {
                StyleError("the second half of an evaluation needs the first half before it".to_owned())
            })?;
            let tally =
                self.add_forces(atoms, request, f, |engine, request, f| pending.finish(engine, request, f))?;
            Ok(self.totals(&tally))
        })
    }

    /// The totals of the pair style, without what a fix reports of its walls.
    fn totals(&self, tally: &Tally) -> Totals {
        let [below, above] = self.engine.statistics().out_of_bounds.map(|n| n as f64);
        let (unit, mut tally) = (self.scale.energy, *tally);
        for taken in self.engine.on_walls() {
            tally.pair -= taken.energy;
            tally.virial.iter_mut().zip(taken.virial).for_each(|(sum, virial)| *sum -= virial);
        }
        let virial = std::array::from_fn(|k| unit * tally.virial[k] + unit * tally.thermostat_virial[k]);
        Totals { excess: unit * tally.excess, pair: unit * tally.pair, virial, below, above }
    }
}

fn newton_of(newton: bool) -> Newton {
    if newton { Newton::On } else { Newton::Off }
}
