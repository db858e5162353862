//! Double-precision positions of the sorted particles of pair lists. They are coordinates of the host
//! instead of fractions of a region, which differs between ranks.

use psidpd_passes::domain::PeriodicBox;
use std::ops::Range;

/// Fraction by which the search range is extended, so that rounding to single precision loses no pair.
pub const MARGIN: f64 = 1e-5;

/// Adding and subtracting this constant rounds a number, alike on all instruction sets.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Positions of the sorted particles, followed by those of the first plane's copies, for pairs of the last plane.
#[derive(Debug, Clone, Default)]
pub struct Places {
    x: Vec<[f64; 3]>,
    /// The host's index of each sorted particle.
    host: Vec<u32>,
    images: Images,
}

/// The periods of a box at least twice as wide as the range.
#[derive(Debug, Clone, Copy, Default)]
pub struct Images {
    /// Edge vectors by period and component; zero along open directions.
    edges: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

impl Places {
    /// Copies the positions `x` of the host in `order`, and again those of `copies`.
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

    /// Positions of the sorted particles.
    pub fn x(&self) -> &[[f64; 3]] {
        &self.x
    }

    /// The host's index of a sorted particle.
    pub fn host(&self, k: usize) -> usize {
        self.host[k] as usize
    }

    /// The periods of the box.
    pub fn images(&self) -> Images {
        self.images
    }
}

impl Images {
    /// Replaces vectors by their nearest images, component by component: each period is subtracted at
    /// most once, so that vectors of close particles lose no digits.
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
