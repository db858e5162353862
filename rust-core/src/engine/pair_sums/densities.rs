//! Local densities: `n_β,i = Σ_j w(r_ij)` over the neighbours of species β.

use super::pairs::{PairList, Pairs};
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
            let list = self.pairs;
            let mut weights = [0.0; BLOCK];
            for from in (0..list.len()).step_by(BLOCK) {
                let r = &list.r[from..(from + BLOCK).min(list.len())];
                run_best(Weights { kernel: self.kernel, r, weights: &mut weights, _shape: S::default() });
                for (at, k) in (from..from + r.len()).enumerate() {
                    let factor = list.factor.get(k).copied().unwrap_or(1.0);
                    let w = weights[at] * factor;
                    let (i, j) = (list.i[k] as usize, list.j[k] as usize);
                    self.n[i * self.width + self.offset + list.species_j[k] as usize] += w;
                    if j < self.owned {
                        self.n[j * self.width + self.offset + list.species_i[k] as usize] += w;
                    }
                }
            }
        }
    }

    kernel.kind().visit(Pass { pairs, kernel, owned, n, width, offset });
}

/// Number of pairs in a block.
const BLOCK: usize = 256;

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
