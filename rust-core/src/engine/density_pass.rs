//! Local densities: `n_β,i = Σ_j w(r_ij)` over the neighbours of species β.

use super::pairs::{PairList, Pairs};
use crate::model::kernel::{Kernel, Shape, ShapeVisitor};

/// Adds one density of every owned particle to `n`.
///
/// `n` has `width` numbers for each owned particle, species running fastest; this density's begin at
/// `offset`.
pub fn add_density(pairs: &Pairs, kernel: &Kernel, owned: usize, n: &mut [f64], width: usize, offset: usize) {
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
            let inverse_range = 1.0 / self.kernel.range();
            let factor = self.kernel.value_factor();
            let list = self.pairs;
            for k in 0..list.len() {
                let s = list.r[k] * inverse_range;
                if s < 1.0 {
                    let mut w = factor * S::value(s);
                    if !list.factor.is_empty() {
                        w *= list.factor[k];
                    }
                    let (i, j) = (list.i[k] as usize, list.j[k] as usize);
                    self.n[i * self.width + self.offset + list.species_j[k] as usize] += w;
                    if j < self.owned {
                        self.n[j * self.width + self.offset + list.species_i[k] as usize] += w;
                    }
                }
            }
        }
    }

    for pairs in [pairs.force(), pairs.density_only()] {
        kernel.kind().visit(Pass { pairs, kernel, owned, n, width, offset });
    }
}
