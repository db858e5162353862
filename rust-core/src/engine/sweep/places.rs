//! Where the sorted particles of pair lists are, to measure pairs in double precision: not in fractions of a region, which is
//! of one rank, but by the coordinates of the host.

use psidpd_passes::domain::PeriodicBox;
use std::ops::Range;

/// By how much further pairs are searched, so that none is lost by rounding to single precision.
pub const MARGIN: f64 = 1e-5;

/// What is added to a number and subtracted again to round it: no instruction set has it otherwise than others.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Sorted particles, behind them once more those of the first plane, which the last one sees.
#[derive(Debug, Clone, Default)]
pub struct Places {
    x: Vec<[f64; 3]>,
    /// Indices of the host.
    host: Vec<u32>,
    images: Images,
}

/// The periods of a box at least twice as wide as pairs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Images {
    /// By period and component; zero for those there are none of.
    edges: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

impl Places {
    /// Takes the places `x` of the host in `order`, and once more those of `copies`.
    pub fn gather(
        &mut self,
        dimensions: usize,
        domain: &PeriodicBox,
        x: &[[f64; 3]],
        order: &[u32],
        copies: Range<usize>,
    ) {
        let is_periodic = |k: usize| domain.periodic()[k] && k < dimensions;
        let of_periods =
            |rows: [[f64; 3]; 3]| [0, 1, 2].map(|k| if is_periodic(k) { rows[k] } else { [0.0; 3] });
        self.images = Images {
            edges: of_periods([0, 1, 2].map(|k| domain.edge(k))),
            inverse: of_periods(domain.inverse()),
        };
        self.x.clear();
        self.x.extend(order.iter().map(|k| {
            let [x, y, z] = x[*k as usize];
            [x, y, if dimensions > 2 { z } else { 0.0 }]
        }));
        self.x.extend_from_within(copies.clone());
        self.host.clear();
        self.host.extend(order);
        self.host.extend_from_within(copies);
    }

    /// The places of sorted particles.
    pub fn x(&self) -> &[[f64; 3]] {
        &self.x
    }

    /// The host's index of a sorted particle.
    pub fn host(&self, k: usize) -> usize {
        self.host[k] as usize
    }

    /// The periods.
    pub fn images(&self) -> Images {
        self.images
    }
}

impl Images {
    /// The nearest images of some vectors, by component: periods are taken off once, so that vectors of close particles lose no
    /// digits.
    #[inline(always)]
    pub fn find_nearest<const N: usize>(&self, [x, y, z]: &mut [[f64; N]; 3]) {
        let Images { inverse: [a, b, c], edges: [e, f, g] } = self;
        for n in 0..N {
            let d = [x[n], y[n], z[n]];
            let p = (a[0] * d[0] + a[1] * d[1] + a[2] * d[2] + ROUND) - ROUND;
            let q = (b[0] * d[0] + b[1] * d[1] + b[2] * d[2] + ROUND) - ROUND;
            let r = (c[0] * d[0] + c[1] * d[1] + c[2] * d[2] + ROUND) - ROUND;
            x[n] = d[0] - (p * e[0] + q * f[0] + r * g[0]);
            y[n] = d[1] - (p * e[1] + q * f[1] + r * g[1]);
            z[n] = d[2] - (p * e[2] + q * f[2] + r * g[2]);
        }
    }
}
