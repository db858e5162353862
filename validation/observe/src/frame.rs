//! One configuration for the observables. Quantities that several observables need are computed once.

use super::flux::{Acted, Carrier, Flux, Line, Lines, Place};
use psidpd_core::engine::pair_sums::{Evaluation, Evaluator, Pair};
use psidpd_core::engine::{PeriodicBox, Pool};
use psidpd_core::model::Model;
use std::cell::OnceCell;

/// A configuration of particles that its owner lends to the observables.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The threads that share long work; results do not depend on their number.
    pub pool: &'a Pool,
    pub step: u64,
    /// The time since the start of the run.
    pub time: f64,
    pub kt: f64,
    pub model: &'a Model,
    pub dimensions: usize,
    pub domain: &'a PeriodicBox,
    pub masses: &'a [f64],
    /// Positions are wrapped into the box.
    pub x: &'a [[f64; 3]],
    pub v: &'a [[f64; 3]],
    /// The numbers of periods that each particle has crossed.
    pub images: &'a [[i32; 3]],
    /// Species are counted from 0.
    pub species: &'a [i32],
    /// Tags are counted from 1.
    pub tags: &'a [i32],
    /// True for particles that never move; empty if all particles move.
    pub frozen: &'a [bool],
    pub temperature: f64,
    /// The kinetic energy `½ Σ m v²`.
    pub kinetic_energy: f64,
    /// The sums Σψ and Σφ of the potential energy, if the step requested energies.
    pub potential: [f64; 2],
    /// The tensor `(Σ m v v + W)/V` in the order xx, yy, zz, xy, xz, yz, if the step requested a virial.
    pub pressure: [f64; 6],
    /// The tensor of pressure with conservative forces only.
    pub conservative_pressure: [f64; 6],
    /// The momentum transport in the step, if the step recorded it.
    pub flux: Option<&'a Flux>,
}

/// A configuration with cached results that several observables share.
pub struct Frame<'a> {
    pub view: View<'a>,
    /// It belongs to the fluid of the configuration.
    pub evaluator: &'a Evaluator,
    evaluation: OnceCell<Evaluation>,
    /// The evaluations of forces that acted at positions other than the present ones.
    earlier: OnceCell<Vec<Option<Earlier>>>,
}

/// Forces that acted at other positions than the present ones.
struct Earlier {
    evaluation: Evaluation,
    /// The displacement of each particle for which the forces were computed; empty without one.
    displacements: Vec<[f64; 3]>,
}

/// Number of particles whose lines a thread takes at a time.
const LINES: usize = 1024;

impl<'a> Frame<'a> {
    pub fn new(view: View<'a>, evaluator: &'a Evaluator) -> Frame<'a> {
        Frame { view, evaluator, evaluation: OnceCell::new(), earlier: OnceCell::new() }
    }

    /// Energies and conservative forces.
    pub fn evaluation(&self) -> &Evaluation {
        let View { pool, x, species, domain, .. } = self.view;
        self.evaluation.get_or_init(|| self.evaluator.evaluate(pool, x, species, domain))
    }

    /// Adds up `width` numbers over all lines of momentum transport in the step; `None` if the step did not record them.
    ///
    /// Threads share the lines. The parts of their sums, and the order in which these are added, do not depend on the number of threads.
    pub fn sum_lines(&self, width: usize, add: impl Fn(&Lines, &mut [f64]) + Sync) -> Option<Vec<f64>> {
        let flux = self.view.flux?;
        let earlier = self.earlier.get_or_init(|| {
            flux.forces.iter().map(|acted| acted.at.as_ref().map(|at| self.earlier(at))).collect()
        });
        let ways = flux.ways.chunks(LINES).map(|lines| Part::Recorded(Carrier::Particle, lines));
        let drag = flux.drag.iter().flat_map(|drag| &drag.lines);
        let recorded = ways.chain(drag.map(|lines| Part::Recorded(Carrier::Pair, lines)));
        let forces = flux.forces.iter().zip(earlier).flat_map(|(acted, earlier)| {
            let evaluation =
                earlier.as_ref().map_or_else(|| self.evaluation(), |earlier| &earlier.evaluation);
            let x = acted.at.as_ref().map_or(self.view.x, |at| &at.x);
            let displacements = earlier.as_ref().map_or(&[][..], |earlier| &earlier.displacements);
            (0..evaluation.parts()).map(move |part| Part::Forces {
                acted,
                evaluation,
                part,
                x,
                displacements,
            })
        });
        let of_walls = flux.forces.iter().zip(earlier).map(|(acted, earlier)| Part::Walls {
            acted,
            evaluation: earlier.as_ref().map_or_else(|| self.evaluation(), |earlier| &earlier.evaluation),
            x: acted.at.as_ref().map_or(self.view.x, |at| &at.x),
            displacements: earlier.as_ref().map_or(&[][..], |earlier| &earlier.displacements),
        });
        let forces = forces.chain(of_walls);
        let mut work: Vec<(Part, Vec<f64>)> = recorded.chain(forces).map(|part| (part, Vec::new())).collect();
        self.view.pool.each(&mut work, |(part, sums)| {
            sums.resize(width, 0.0);
            part.in_blocks(|lines| add(lines, sums));
        });
        let mut all = vec![0.0; width];
        for (_, sums) in &work {
            all.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
        }
        Some(all)
    }

    fn earlier(&self, at: &Place) -> Earlier {
        let View { pool, domain, .. } = self.view;
        let to = at.displaced.as_deref().unwrap_or(&[]);
        Earlier {
            evaluation: self.evaluator.evaluate(
                pool,
                at.displaced.as_ref().unwrap_or(&at.x),
                &at.species,
                domain,
            ),
            // A displaced particle may have crossed a face of the box.
            displacements: to.iter().zip(&at.x).map(|(to, x)| domain.minimum_image(*to, *x)).collect(),
        }
    }

    /// Calls `visit` with every pair of particles closer than `range`, each once.
    pub fn for_each_pair(&self, range: f64, visit: impl FnMut(Pair)) {
        let View { pool, x, domain, .. } = self.view;
        self.evaluator.for_each_pair(pool, x, domain, range, visit);
    }

    /// The pressure tensor of the momentum transport in the whole box; `None` if the step did not record it.
    pub fn carried_pressure(&self) -> Option<[f64; 6]> {
        Some(self.view.flux?.sum().map(|sum| sum / self.volume()))
    }

    pub fn mass(&self, particle: usize) -> f64 {
        self.view.masses[self.view.species[particle] as usize]
    }

    pub fn moves(&self, particle: usize) -> bool {
        !self.view.frozen.get(particle).is_some_and(|frozen| *frozen)
    }

    /// The volume of the box; in two dimensions the area.
    pub fn volume(&self) -> f64 {
        self.view.domain.volume(self.view.dimensions)
    }
}

impl Drop for Frame<'_> {
    fn drop(&mut self) {
        let earlier = self.earlier.take().unwrap_or_default().into_iter().flatten();
        let earlier = earlier.map(|earlier| earlier.evaluation);
        self.evaluation.take().into_iter().chain(earlier).for_each(|done| self.evaluator.recycle(done));
    }
}

/// Lines that one thread adds up.
enum Part<'a> {
    Recorded(Carrier, &'a [Line]),
    /// A part of the pairs of an evaluation, whose forces acted on particles at `x`.
    Forces {
        acted: &'a Acted,
        evaluation: &'a Evaluation,
        part: usize,
        x: &'a [[f64; 3]],
        displacements: &'a [[f64; 3]],
    },
    /// The forces of walls, along the lines from their surfaces to the particles at `x`.
    Walls {
        acted: &'a Acted,
        evaluation: &'a Evaluation,
        x: &'a [[f64; 3]],
        displacements: &'a [[f64; 3]],
    },
}

impl Part<'_> {
    fn in_blocks(&self, visit: impl FnMut(&Lines)) {
        match *self {
            // A particle that met a face turned on its way.
            Part::Recorded(carrier, lines) => {
                Lines::in_blocks(carrier, carrier == Carrier::Pair, lines.iter().copied(), visit);
            }
            Part::Forces { acted, evaluation, part, x, displacements } => {
                let back = |k: usize| displacements.get(k).copied().unwrap_or([0.0; 3]);
                // Pairs at zero distance have no direction.
                let apart = evaluation.pairs_of(part).filter(|(pair, _)| pair.r > 0.0);
                let lines = apart.map(|(pair, force)| {
                    let (from_i, from_j) = (back(pair.i), back(pair.j));
                    Line {
                        from: x[pair.i],
                        d: std::array::from_fn(|c| pair.d[c] - (from_i[c] - from_j[c])),
                        f: pair.d.map(|d| acted.share * force / pair.r * d),
                    }
                });
                Lines::in_blocks(Carrier::Pair, displacements.is_empty(), lines, visit);
            }
            Part::Walls { acted, evaluation, x, displacements } => {
                let lines = evaluation.near_walls.iter().map(|near| {
                    let mut d = displacements.get(near.particle).map_or([0.0; 3], |by| by.map(|by| -by));
                    d.iter_mut().zip(near.line()).for_each(|(d, line)| *d += line);
                    let f = near.force().map(|f| acted.share * f);
                    Line { from: x[near.particle], d, f }
                });
                Lines::in_blocks(Carrier::Pair, displacements.is_empty(), lines, visit);
            }
        }
    }
}
