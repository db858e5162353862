//! Double-precision positions of the sorted particles of pair lists. They are coordinates of the host
//! instead of fractions of a region, which differs between ranks.

use psidpd_passes::domain::PeriodicBox;

/// Fraction by which the search range is extended, so that rounding to single precision loses no pair.
pub const MARGIN: f64 = 1e-5;

/// Adding and subtracting this constant rounds a number, alike on all instruction sets.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Positions of the sorted particles, followed by those of the first plane's copies, for pairs of the last plane.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    dimensions: usize,
    x: &'a [[f64; 3]],
    order: &'a [u32],
    /// The periods of the box.
    pub images: Images,
}

/// The periods of a box at least twice as wide as the range.
#[derive(Debug, Clone, Copy, Default)]
pub struct Images {
    /// Edge vectors by period and component; zero along open directions.
    edges: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

impl Places<'_> {
    /// The positions `x` of the host, sorted in `order`.
    pub fn new<'a>(
        dimensions: usize,
        domain: &PeriodicBox,
        x: &'a [[f64; 3]],
        order: &'a [u32],
    ) -> Places<'a> {
        let is_periodic = |k: usize| domain.periodic()[k] && k < dimensions;
        let of_periods =
            |rows: [[f64; 3]; 3]| [0, 1, 2].map(|k| if is_periodic(k) { rows[k] } else { [0.0; 3] });
        let images = Images {
            edges: of_periods([0, 1, 2].map(|k| domain.edge(k))),
            inverse: of_periods(domain.inverse()),
        };
        Places { dimensions, x, order, images }
    }

    /// The position of a sorted particle.
    #[inline(always)]
    pub fn x(&self, k: usize) -> [f64; 3] {
        let [x, y, z] = self.x[self.host(k)];
        [x, y, if self.dimensions > 2 { z } else { 0.0 }]
    }

    /// The distance of the nearest images of two sorted particles, where that is below half a height of the box.
    pub fn distance(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (self.x(i), self.x(j));
        let mut d = [0, 1, 2].map(|c| [a[c] - b[c]]);
        self.images.find_nearest(&mut d);
        d.iter().flatten().map(|d| d * d).sum::<f64>().sqrt()
    }

    /// The host's index of a sorted particle.
    #[inline(always)]
    pub fn host(&self, k: usize) -> usize {
        let n = self.order.len();
        self.order[if k < n { k } else { k - n }] as usize
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
