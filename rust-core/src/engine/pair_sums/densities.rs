//! Local densities: `n_β,i = Σ_j w(r_ij)` over the neighbours of species β.

use super::pairs::{BLOCK, PairList, Pairs, in_turns};
use crate::engine::plan::Plan;
use crate::engine::vectors::{Loop, run_best};
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};

/// Sums the densities `which` of every owned particle to `n`, which has
/// [`Fluid::variables`](crate::model::Fluid::variables) numbers for each, density-major. Returns
/// the number of sums over pairs.
pub fn sum_densities(
    pairs: &Pairs,
    plan: &Plan,
    which: impl Iterator<Item = usize>,
    species: &[i32],
    n: &mut [f64],
) -> u64 {
    let mut sums = 0;
    let count = plan.species.len();
    let width = plan.densities.len() * count;
    for d in which {
        let density = &plan.densities[d];
        let owned = n.len() / width;
        for list in [&pairs.force, &pairs.density_only] {
            add_density(list, &density.kernel, owned, n, width, d * count);
        }
        sums += 1;
        if density.includes_self {
            let own = density.kernel.value(0.0);
            for (i, species) in species[..owned].iter().enumerate().filter(|(_, s)| **s >= 0) {
                n[i * width + d * count + *species as usize] += own;
            }
        }
    }
    sums
}

/// Adds the contributions of a list's pairs to one density of every owned particle.
///
/// `n` has `width` numbers for each owned particle, with species running fastest; the numbers of
/// this density begin at `offset`.
pub fn add_density(
    pairs: &PairList,
    kernel: &Kernel,
    owned: usize,
    n: &mut [f64],
    width: usize,
    offset: usize,
) {
    struct Pass<'a> {
        pairs: &'a PairList,
        kernel: &'a Kernel,
        owned: usize,
        n: &'a mut [f64],
        width: usize,
        offset: usize,
    }

    impl ShapeVisitor for Pass<'_> {
        type Output = ();

        fn visit<S: Shape>(self) {
            let Pass { pairs: list, kernel, owned, n, width, offset } = self;
            let mut weights = [0.0; BLOCK];
            for from in (0..list.len()).step_by(BLOCK) {
                let pairs = from..(from + BLOCK).min(list.len());
                let r = &list.r[pairs.clone()];
                run_best(Weights { kernel, r, weights: &mut weights, _shape: S::default() });
                if let Some(factors) = list.factor.get(pairs.clone()) {
                    weights.iter_mut().zip(factors).for_each(|(w, factor)| *w *= factor);
                }
                let [i, j] = [&list.i, &list.j].map(|of| &of[pairs.clone()]);
                let [a, b] = [&list.species_i, &list.species_j].map(|of| &of[pairs.clone()]);
                for k in in_turns(r.len()) {
                    let (i, j) = (i[k] as usize, j[k] as usize);
                    n[i * width + offset + usize::from(b[k])] += weights[k];
                    if j < owned {
                        n[j * width + offset + usize::from(a[k])] += weights[k];
                    }
                }
            }
        }
    }

    kernel.kind().visit(Pass { pairs, kernel, owned, n, width, offset });
}

/// The weights of a block of pairs in a density; 0 beyond its range.
struct Weights<'a, S> {
    kernel: &'a Kernel,
    r: &'a [f64],
    weights: &'a mut [f64; BLOCK],
    _shape: S,
}

impl<S: Shape> Loop for Weights<'_, S> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Weights { kernel, r, weights, .. } = self;
        let (inverse_range, factor) = (1.0 / kernel.range(), kernel.value_factor());
        for (r, w) in r.iter().zip(weights) {
            let s = r * inverse_range;
            *w = if s < 1.0 { factor * S::value(s) } else { 0.0 };
        }
    }
}
