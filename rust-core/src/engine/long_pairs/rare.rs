//! The particles of rare species, in cells of their own.

use crate::engine::sweep::Sorted;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::pair_search::around::{Columns, PADDING};

/// Cells in a range along x, and columns along the other axes.
const FINE: [f64; 2] = [4.0, 1.0];

/// The particles of rare species, sorted into cells for the ranges between each other.
#[derive(Debug)]
pub struct RareParticles {
    /// Whether each species is rare.
    is_rare: Vec<bool>,
    count: [usize; 3],
    start: Vec<u32>,
    x: [Vec<f32>; 3],
    species: Vec<u8>,
    host: Vec<u32>,
    /// In the sweep's order the index of each particle there, and its cell.
    places: Vec<[u32; 2]>,
}

impl RareParticles {
    pub fn new(is_rare: Vec<bool>) -> RareParticles {
        RareParticles {
            is_rare,
            count: [1; 3],
            start: Vec::new(),
            x: Default::default(),
            species: Vec::new(),
            host: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.host.len()
    }

    /// Finds the particles among all, and sorts them into cells for a range; without one into a single cell.
    pub fn sort(&mut self, sorted: &Sorted, range: f64) {
        let Sorted { order, x: all, species: of_all } = *sorted;
        let RareParticles { is_rare, places, .. } = self;
        places.clear();
        let owned = of_all[..order.particles()].iter().zip(0u32..);
        places.extend(owned.filter(|(species, _)| is_rare[**species as usize]).map(|(_, k)| [k, 0]));
        let total = places.len();
        let geometry = &order.geometry;
        let mut width = range;
        loop {
            self.count = [0, 1, 2].map(|axis| match axis < geometry.dimensions && range > 0.0 {
                true => (geometry.height(axis) * FINE[axis.min(1)] / width).clamp(1.0, 1e6) as usize,
                false => 1,
            });
            // Empty cells cost time too.
            if self.count.iter().product::<usize>() <= 4 * total + 64 {
                break;
            }
            width *= 1.5;
        }
        let (count, steps) = (self.count, self.steps());
        self.start.clear();
        self.start.resize(count.iter().product::<usize>() + 2, 0);
        let start = &mut self.start;
        for [k, cell] in &mut self.places {
            let u = order.fixed32[order.order[*k as usize] as usize];
            let along = |c: usize| ((u64::from(u[c]) * count[c] as u64) >> 32) as usize * steps[c];
            *cell = (along(0) + along(1) + along(2)) as u32;
            // Two places further, so that the end of each cell becomes the start of the next while cells are filled.
            start[*cell as usize + 2] += 1;
        }
        (2..start.len()).for_each(|k| start[k] += start[k - 1]);
        self.host.resize(total, 0);
        self.species.resize(total + PADDING, 0);
        self.x.iter_mut().for_each(|x| x.resize(total + PADDING, 0.0));
        for [k, cell] in &self.places {
            let (k, next) = (*k as usize, &mut start[*cell as usize + 1]);
            let to = *next as usize;
            *next += 1;
            (self.host[to], self.species[to]) = (order.order[k], of_all[k]);
            (0..3).for_each(|c| self.x[c][to] = all[c][k]);
        }
    }

    fn steps(&self) -> [usize; 3] {
        [1, self.count[0], self.count[0] * self.count[1]]
    }

    /// The cells, with the host's number of each particle.
    pub fn columns<'a>(&'a self, geometry: &'a BoxGeometry) -> (Columns<'a>, &'a [u32]) {
        let RareParticles { count, start, x, species, host, .. } = self;
        let x = x.each_ref().map(|x| &x[..]);
        (Columns::new(geometry, [*count, self.steps()], start, x, species), host)
    }

    /// The host's number of a particle, its species, and its position as that of columns.
    pub fn particle(&self, k: usize) -> (usize, u8, [f32; 3]) {
        (self.host[k] as usize, self.species[k], [self.x[0][k], self.x[1][k], self.x[2][k]])
    }

    /// Size in bytes of the arrays.
    pub fn memory(&self) -> usize {
        let RareParticles { start, x, species, host, places, .. } = self;
        (start.capacity() + host.capacity()) * size_of::<u32>()
            + x.iter().map(Vec::capacity).sum::<usize>() * size_of::<f32>()
            + species.capacity()
            + places.capacity() * size_of::<[u32; 2]>()
    }
}
