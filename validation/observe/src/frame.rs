//! One configuration for the observables. Quantities that several observables need are computed once.

use super::flux::{BLOCK, Carrier, Dragged, Flux, Line, Lines, Place, Pull, Recorded};
use super::options::Centre;
use super::piece::{Piece, Whole};
use psidpd_core::engine::pair_sums::{
    Evaluation, Evaluator, NearWall, Pair, PairBlock, ParticleSums, Wanted,
};
use psidpd_core::engine::thermostat::Pulls;
use psidpd_core::engine::{PeriodicBox, Pool, Precision};
use psidpd_core::model::Model;
use std::cell::OnceCell;
use std::sync::Arc;

/// A configuration of particles that its owner lends to the observables.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// The threads that share long work; results do not depend on their number.
    pub pool: &'a Arc<Pool>,
    /// The precision of the forces of the run.
    pub precision: Precision,
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
    /// The conservative forces on the particles, if the run has these apart from others.
    pub forces: Option<&'a [[f64; 3]]>,
    /// Tags are counted from 1.
    pub tags: &'a [i32],
    /// True for particles that never move; empty if all particles move.
    pub frozen: &'a [bool],
    pub temperature: f64,
    /// The kinetic energy `½ Σ m v²`.
    pub kinetic_energy: f64,
    /// The sums Σψ and Σφ of the potential energy, if the step requested energies.
    pub potential: [f64; 2],
    /// The tensor `(Σ m v v + W)/V` in the order xx, yy, zz, xy, xz, yz, if the step requested it.
    pub pressure: [f64; 6],
    /// The tensor of pressure with conservative forces only, if the step requested a virial.
    pub conservative_pressure: [f64; 6],
    /// The momentum transport in the step, if the step recorded it.
    pub flux: Option<&'a Flux>,
}

impl View<'_> {
    /// All particles, of which a [`Piece`] can be taken.
    pub fn whole(&self) -> Whole<'_> {
        let View { domain, dimensions, x, species, frozen, .. } = *self;
        Whole { domain, dimensions, x, species, frozen }
    }
}

/// A configuration with cached results that several observables share.
pub struct Frame<'a> {
    pub view: View<'a>,
    /// It belongs to the fluid of the configuration.
    pub evaluator: &'a Evaluator,
    /// The piece that the configuration is of a larger one.
    pub piece: Option<&'a Piece>,
    evaluation: OnceCell<Evaluation>,
    sums: OnceCell<Option<ParticleSums>>,
    /// The evaluations of forces that acted at positions other than the present ones.
    earlier: OnceCell<Vec<Option<Earlier>>>,
    /// The symmetric part of `Σ d ⊗ f` over all lines, once they are added up.
    of_lines: OnceCell<[f64; 6]>,
    /// Positions along one axis, most likely those of all profiles: the axis, the centre, and what `Across::fractions` found.
    pub(crate) fractions: OnceCell<(usize, Centre, Option<Vec<f64>>)>,
}

/// Forces that acted at other positions than the present ones.
struct Earlier {
    found: Found,
    /// The displacement of each particle for which the forces were computed; empty without one.
    displacements: Vec<[f64; 3]>,
}

/// What is found where pairs are not expected.
const SHARES: Wanted = Wanted { shares: true, pairs: false };

/// The least number of lines, if there are so many, that a thread adds to sums of its own.
const LINES: usize = 2048;

impl<'a> Frame<'a> {
    pub fn new(view: View<'a>, evaluator: &'a Evaluator) -> Frame<'a> {
        let (evaluation, sums) = (OnceCell::new(), OnceCell::new());
        let (earlier, of_lines, fractions) = (OnceCell::new(), OnceCell::new(), OnceCell::new());
        Frame { view, evaluator, piece: None, evaluation, sums, earlier, of_lines, fractions }
    }

    /// A piece of a configuration, or all of it.
    pub fn of_piece(view: View<'a>, piece: Option<&'a Piece>, evaluator: &'a Evaluator) -> Frame<'a> {
        let of_piece = |Piece { x, species, still, .. }: &'a Piece| View {
            x,
            species,
            frozen: still,
            v: &[],
            images: &[],
            forces: None,
            tags: &[],
            flux: None,
            ..view
        };
        let mut frame = Frame::new(piece.map_or(view, of_piece), evaluator);
        frame.piece = piece;
        frame
    }

    /// Energies and conservative forces.
    pub fn evaluation(&self) -> &Evaluation {
        let View { pool, x, species, domain, .. } = self.view;
        self.evaluation.get_or_init(|| self.evaluator.evaluate(pool, x, species, domain))
    }

    /// Sums over the pairs of each particle with their shares in the Laplacian, which take less time than [`Frame::evaluation`]; `None` if that was
    /// there before, if pairs of the run are in double precision, and where [`Evaluator::particle_sums`] has none.
    pub fn sums(&self) -> Option<&ParticleSums> {
        self.sums_with(SHARES).filter(|sums| sums.found.shares)
    }

    /// The sums that were found first, which may lack what is `wanted` now.
    fn sums_with(&self, wanted: Wanted) -> Option<&ParticleSums> {
        if self.sums.get().is_none() && self.evaluation.get().is_some() {
            return None;
        }
        self.sums.get_or_init(|| self.find_sums(self.view.x, self.view.species, wanted)).as_ref()
    }

    /// Sums over the pairs of particles at `x`, unless pairs of the run are in double precision.
    fn find_sums(&self, x: &[[f64; 3]], species: &[i32], wanted: Wanted) -> Option<ParticleSums> {
        let View { pool, precision, domain, .. } = self.view;
        let is_mixed = precision == Precision::Mixed;
        is_mixed.then(|| self.evaluator.particle_sums(pool, x, species, domain, wanted))?
    }

    /// The pairs with the forces that act now.
    fn acting(&self, shares: bool) -> Acting<'_> {
        let sums = self.sums_with(Wanted { shares, pairs: true });
        let sums = sums.filter(|sums| sums.found.pairs);
        sums.map_or_else(|| Acting::Double(self.evaluation()), Acting::Single)
    }

    /// Uncorrected local densities, one for each density and species, density-major, particle by particle.
    pub fn densities(&self) -> &[f64] {
        self.sums_with(SHARES).map_or_else(|| &self.evaluation().densities[..], |sums| &sums.densities)
    }

    /// Sum `Σ ψ` over the particles of each species.
    pub fn excess(&self) -> &[f64] {
        self.sums_with(SHARES).map_or_else(|| &self.evaluation().excess[..], |sums| &sums.excess)
    }

    /// Adds up `width` numbers over all lines of momentum transport in the step: over those of particles, and over those of pairs;
    /// `None` if the step did not record them.
    ///
    /// Threads share the lines. The parts of their sums, and the order in which these are added, do not depend on the number of threads.
    /// `add` gets a block of lines, arrays of its own, which it may leave as they are, and the sums.
    pub fn sum_lines<A: Default>(
        &self,
        width: usize,
        add: impl Fn(&Lines, &mut A, &mut [f64]) + Sync,
    ) -> Option<[Vec<f64>; 2]> {
        let flux = self.view.flux?;
        let earlier = self.earlier.get_or_init(|| {
            flux.forces.iter().map(|acted| acted.at.as_ref().map(|at| self.earlier(at))).collect()
        });
        let mut parts: Vec<(Part, Carrier, usize)> = Vec::new();
        parts.extend(
            flux.ways.chunks(LINES).map(|ways| (Part::Recorded(ways), Carrier::Particle, ways.len())),
        );
        for drag in &flux.drag {
            parts.push((Part::Recorded(&drag.friction), Carrier::Pair, drag.friction.len()));
            let of_pairs = |pairs| (Part::Drag { pairs, x: &drag.x }, Carrier::Pair, pairs.i.len());
            parts.extend(drag.pairs.iter().map(of_pairs));
        }
        for (acted, earlier) in flux.forces.iter().zip(earlier) {
            let (x, species) = match &acted.at {
                Some(Place { x, species, .. }) => (&x[..], &species[..]),
                None => (self.view.x, self.view.species),
            };
            let forces = Forces {
                share: acted.share,
                acting: earlier.as_ref().map_or_else(|| self.acting(false), Earlier::acting),
                x,
                species,
                displacements: earlier.as_ref().map_or(&[][..], |earlier| &earlier.displacements),
                drag: acted.dragged.as_ref().map(|dragged| (self.evaluator, dragged)),
            };
            let of_pairs = forces.acting.parts().into_iter().enumerate();
            parts.extend(of_pairs.map(|(part, count)| (Part::Forces(forces, part), Carrier::Pair, count)));
            if let Acting::Double(Evaluation { near_walls, .. }) = forces.acting {
                parts.push((Part::Walls(forces, near_walls), Carrier::Pair, near_walls.len()));
            }
        }
        let mut work: Vec<Work> = Vec::new();
        for (part, carrier, count) in parts {
            match work.last_mut() {
                Some(last) if last.carrier == carrier && last.count < LINES => {
                    last.count += count;
                    last.parts.push(part);
                }
                _ => {
                    work.push(Work { carrier, count, parts: vec![part], sums: Vec::new(), tensor: [0.0; 6] })
                }
            }
        }
        self.view.pool.each(&mut work, |Work { parts, sums, tensor, .. }| {
            sums.resize(width, 0.0);
            let (mut lines, mut arrays) = (Lines::default(), A::default());
            let mut visit = |lines: &Lines| {
                lines.add_to(tensor);
                add(lines, &mut arrays, sums);
            };
            parts.iter().for_each(|part| part.in_blocks(&mut lines, &mut visit));
        });
        let mut all = [vec![0.0; width], vec![0.0; width]];
        let mut of_lines = [0.0; 6];
        for Work { carrier, sums, tensor, .. } in &work {
            all[*carrier as usize].iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
            of_lines.iter_mut().zip(tensor).for_each(|(all, sum)| *all += sum);
        }
        self.of_lines.get_or_init(|| of_lines);
        Some(all)
    }

    fn earlier(&self, at: &Place) -> Earlier {
        let View { pool, domain, .. } = self.view;
        let Place { x, species, displaced } = at;
        let (to, acted) = (displaced.as_deref().unwrap_or(&[]), displaced.as_ref().unwrap_or(x));
        let sums = self.find_sums(acted, species, Wanted { shares: false, pairs: true });
        let evaluate = || Found::Double(self.evaluator.evaluate(pool, acted, species, domain));
        Earlier {
            found: sums.map_or_else(evaluate, Found::Single),
            // A displaced particle may have crossed a face of the box.
            displacements: to.iter().zip(x).map(|(to, x)| domain.minimum_image(*to, *x)).collect(),
        }
    }

    /// Finds the present pairs with forces if [`Frame::sum_lines`] will need them, and `shares` in the Laplacian besides where these are
    /// read; then nothing else needs a search of its own.
    pub fn expect_lines(&self, shares: bool) {
        if self.view.flux.is_some_and(|flux| flux.forces.iter().any(|acted| acted.at.is_none())) {
            self.acting(shares);
        }
    }

    /// Calls `visit` with every pair of particles closer than `range`, each once.
    pub fn for_each_pair(&self, range: f64, visit: impl FnMut(Pair)) {
        let View { pool, x, domain, .. } = self.view;
        let sums = self.sums.get().and_then(Option::as_ref).filter(|sums| sums.has_pairs_within(range));
        if let Some(pairs) = self.evaluation.get().and_then(|done| done.pairs_within(range)) {
            pairs.for_each(visit);
        } else if let Some(sums) = sums {
            sums.for_each_pair(range, visit);
        } else {
            self.evaluator.for_each_pair(pool, x, domain, range, visit);
        }
    }

    /// The pressure tensor of the momentum transport in the whole box; `None` if the step did not record it.
    pub fn carried_pressure(&self) -> Option<[f64; 6]> {
        let flux = self.view.flux?;
        let sum = match (flux.recorded, self.of_lines.get()) {
            (Recorded::Nothing | Recorded::Sum, _) => flux.sum(),
            (Recorded::Lines, Some(known)) => *known,
            (Recorded::Lines, None) => {
                self.sum_lines(0, |_, (), _| ())?;
                *self.of_lines.get()?
            }
        };
        Some(sum.map(|sum| sum / self.volume()))
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
        let earlier =
            self.earlier.take().unwrap_or_default().into_iter().flatten().map(|earlier| earlier.found);
        let present = self.evaluation.take().map(Found::Double);
        let sums = self.sums.take().flatten().map(Found::Single);
        earlier.chain(present).chain(sums).for_each(|found| match found {
            Found::Single(sums) => self.evaluator.recycle_sums(sums),
            Found::Double(evaluation) => self.evaluator.recycle(evaluation),
        });
    }
}

/// Pairs with forces, in either precision.
enum Found {
    Single(ParticleSums),
    Double(Evaluation),
}

impl Earlier {
    fn acting(&self) -> Acting<'_> {
        match &self.found {
            Found::Single(sums) => Acting::Single(sums),
            Found::Double(evaluation) => Acting::Double(evaluation),
        }
    }
}

/// Pairs with forces that acted.
#[derive(Clone, Copy)]
enum Acting<'a> {
    Single(&'a ParticleSums),
    Double(&'a Evaluation),
}

impl Acting<'_> {
    /// The number of pairs in each part.
    fn parts(&self) -> Vec<usize> {
        match self {
            Acting::Single(sums) => sums.parts().collect(),
            Acting::Double(evaluation) => evaluation.parts().collect(),
        }
    }
}

/// Lines of one carrier that one thread adds up.
struct Work<'a> {
    carrier: Carrier,
    count: usize,
    parts: Vec<Part<'a>>,
    sums: Vec<f64>,
    /// The symmetric part of `Σ d ⊗ f`.
    tensor: [f64; 6],
}

enum Part<'a> {
    Recorded(&'a [Line]),
    /// The drag of pairs on particles at `x`.
    Drag {
        pairs: &'a Pulls,
        x: &'a [[f64; 3]],
    },
    /// A part of the pairs with forces.
    Forces(Forces<'a>, usize),
    /// The forces of walls, along the lines from their surfaces to the particles.
    Walls(Forces<'a>, &'a [NearWall]),
}

/// Forces that acted, for a share of the step, on particles at `x`.
#[derive(Clone, Copy)]
struct Forces<'a> {
    share: f64,
    acting: Acting<'a>,
    x: &'a [[f64; 3]],
    species: &'a [i32],
    displacements: &'a [[f64; 3]],
    drag: Option<(&'a Evaluator, &'a Dragged)>,
}

impl Forces<'_> {
    /// Passes the lines of pairs on.
    fn along<'b, T: Copy + Into<f64> + 'b>(
        &self,
        blocks: impl Iterator<Item = PairBlock<'b, T>>,
        lines: &mut Lines,
        mut visit: impl FnMut(&Lines),
    ) {
        let Forces { share, x, species, displacements, drag, .. } = *self;
        for block in blocks {
            let (particles, d, places) = (block.particles(), block.d, (x, displacements));
            if let Some((evaluator, Dragged { share: of_drag, v })) = drag {
                // Both with their shares of the step.
                let both = evaluator.strengths_with_drag(&block, species, v, [share, *of_drag]);
                let strengths = &both[..block.strengths.len()];
                lines.join(particles, places, Pull { d, strengths, share: 1.0 });
            } else {
                lines.join(particles, places, Pull { d, strengths: block.strengths, share });
            }
            visit(lines);
        }
    }
}

impl Part<'_> {
    /// Passes the lines on in blocks.
    fn in_blocks(&self, lines: &mut Lines, mut visit: impl FnMut(&Lines)) {
        match *self {
            // A particle that met a face turned on its way, and friction is across its line.
            Part::Recorded(all) => lines.in_blocks(false, all.iter().copied(), visit),
            Part::Drag { pairs: Pulls { i, d, strengths }, x } => {
                for from in (0..i.len()).step_by(BLOCK) {
                    let pairs = from..(from + BLOCK).min(i.len());
                    let (d, strengths) = (d.each_ref().map(|d| &d[pairs.clone()]), &strengths[pairs.clone()]);
                    let particles = i[pairs].iter().map(|i| [*i as usize; 2]);
                    lines.join(particles, (x, &[]), Pull { d, strengths, share: 1.0 });
                    visit(lines);
                }
            }
            Part::Forces(forces, part) => match forces.acting {
                Acting::Single(sums) => forces.along(sums.blocks_of(part), lines, visit),
                Acting::Double(evaluation) => forces.along(evaluation.blocks_of(part), lines, visit),
            },
            Part::Walls(Forces { share, x, displacements, .. }, near_walls) => {
                let all = near_walls.iter().map(|near| {
                    let mut d = displacements.get(near.particle).map_or([0.0; 3], |by| by.map(|by| -by));
                    d.iter_mut().zip(near.line()).for_each(|(d, line)| *d += line);
                    let f = near.force().map(|f| share * f);
                    Line { from: x[near.particle], d, f }
                });
                lines.in_blocks(displacements.is_empty(), all, visit);
            }
        }
    }
}
