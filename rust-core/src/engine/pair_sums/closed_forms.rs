//! Pair potentials that are closed formulas without branches, for all pairs of a block in vectors: those that a term does not act on
//! count as none. The other forms compute the pairs that they act on one after the other.

use super::pairs::PairList;
use crate::engine::vectors::{Loop, run_best};
use crate::model::PairTerm;
use crate::model::pair::{PairForm, PairPotential};
use std::ops::Range;

/// Pairs of a list, and the species of a term.
struct Acting<'a> {
    r: &'a [f64],
    species: [&'a [u8]; 2],
    between: [u8; 2],
    range: f64,
}

impl Acting<'_> {
    fn of<'a>(term: &PairTerm, list: &'a PairList, pairs: &Range<usize>) -> Acting<'a> {
        Acting {
            r: &list.r[pairs.clone()],
            species: [&list.species_i, &list.species_j].map(|species| &species[pairs.clone()]),
            between: term.between.map(|s| s as u8),
            range: term.potential.range(),
        }
    }

    /// Whether the term acts on a pair.
    #[inline(always)]
    fn on(&self, r: f64, i: u8, j: u8) -> bool {
        let [a, b] = self.between;
        (((i == a) & (j == b)) | ((i == b) & (j == a))) & (r < self.range)
    }
}

/// Subtracts the slopes of a term from the `forces` of a block of pairs, and adds its values to their `energies`. Returns false,
/// and does nothing, for a form that is not closed.
pub fn subtract_slopes(
    term: &PairTerm,
    list: &PairList,
    pairs: &Range<usize>,
    forces: &mut [f64],
    energies: &mut [f64],
) -> bool {
    let acting = Acting::of(term, list, pairs);
    match &term.potential {
        PairPotential::Soft(form) => run_best(Slopes { form, acting, forces, energies }),
        PairPotential::Spline(form) => run_best(Slopes { form, acting, forces, energies }),
        _ => return false,
    }
    true
}

struct Slopes<'a, F> {
    form: &'a F,
    acting: Acting<'a>,
    forces: &'a mut [f64],
    energies: &'a mut [f64],
}

impl<F: PairForm> Loop for Slopes<'_, F> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Slopes { form, acting, forces, energies } = self;
        let [i, j] = acting.species;
        for ((((r, i), j), force), energy) in acting.r.iter().zip(i).zip(j).zip(forces).zip(energies) {
            let acts = acting.on(*r, *i, *j);
            let (phi, slope) = form.at(*r);
            *force -= if acts { slope } else { 0.0 };
            *energy += if acts { phi } else { 0.0 };
        }
    }
}

/// Adds the Laplacians `φ″ + rest φ′/r` of a term to the `sums` of a block of pairs, none for pairs at zero distance. Returns false, and
/// does nothing, for a form that is not closed.
pub fn add_laplacians(
    term: &PairTerm,
    list: &PairList,
    pairs: &Range<usize>,
    rest: f64,
    sums: &mut [f64],
) -> bool {
    let acting = Acting::of(term, list, pairs);
    match &term.potential {
        PairPotential::Soft(form) => run_best(Laplacians { form, acting, rest, sums }),
        PairPotential::Spline(form) => run_best(Laplacians { form, acting, rest, sums }),
        _ => return false,
    }
    true
}

struct Laplacians<'a, F> {
    form: &'a F,
    acting: Acting<'a>,
    rest: f64,
    sums: &'a mut [f64],
}

impl<F: PairForm> Loop for Laplacians<'_, F> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Laplacians { form, acting, rest, sums } = self;
        let [i, j] = acting.species;
        for (((r, i), j), sum) in acting.r.iter().zip(i).zip(j).zip(sums) {
            let acts = acting.on(*r, *i, *j) & (*r > 0.0);
            let laplacian = form.curvature(*r) + rest * form.at(*r).1 / r;
            *sum += if acts { laplacian } else { 0.0 };
        }
    }
}
