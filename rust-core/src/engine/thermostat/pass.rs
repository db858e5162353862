//! A pass over the pairs, which computes `Σ_j g (g·(p_i − p_j) − a ξ)` for every particle `i`.
//!
//! Each plane adds to its own particles and to those of the next in a buffer, and a sum is that of its own plane and that of the plane
//! before, so that its order is fixed, whichever thread computes it.

use super::particle_loops::Join;
use crate::engine::sweep::{PlanePairs, Pool};
use crate::engine::vectors;
use psidpd_passes::instruction_set::InstructionSet;
use psidpd_passes::pair_batch::room::resize;
use psidpd_passes::plane::listed_noise::Drawn;
pub use psidpd_passes::plane::pair_sums::Wide;
use psidpd_passes::plane::pair_sums::{Noise, add_pairs};
use psidpd_threads::{part, take};

/// The vectors of the particles, and the sums over their pairs.
#[derive(Debug, Clone, Default)]
pub struct Sums {
    /// Vector of each sorted particle, followed by those of the first plane's copies, for the pairs of the last plane.
    pub p: Vec<Wide>,
    /// Sum of each sorted particle.
    pub all: Vec<Wide>,
    /// Scratch arrays of each thread.
    of_threads: Vec<OfPlanes>,
}

/// Sums over the pairs of a plane, of its own particles and then of those of the next: the present plane, and the one before.
#[derive(Debug, Clone, Default)]
struct OfPlanes {
    now: Vec<Wide>,
    before: Vec<Wide>,
    /// Number of own particles of the plane before.
    own: usize,
    drawn: Drawn,
}

impl Sums {
    /// Sorts the vectors `v` of the host.
    pub fn gather(&mut self, pool: &Pool, order: &[u32], v: &[[f64; 3]]) {
        fill(pool, &mut self.p, order, |k| {
            let [x, y, z] = v[k];
            Wide([x, y, z, 0.0])
        });
    }

    /// Adds the vectors `v` of the host to those of the particles.
    pub fn add_of_host(&mut self, pool: &Pool, order: &[u32], v: &[[f64; 3]]) {
        each_with(pool, &mut self.p[..order.len()], order, |p, k| (0..3).for_each(|c| p[c] += v[k][c]));
    }

    pub fn compute(&mut self, pool: &Pool, set: InstructionSet, planes: &[PlanePairs], noise: Option<Noise>) {
        let particles = planes.last().map_or(0, |last| last.own.end);
        assert!(self.p.len() >= particles, "a vector for each particle of the pairs");
        close(planes, &mut self.p);
        assert!(noise.is_none_or(|noise| noise.of_pairs.tags.len() >= self.p.len()), "a tag for each vector");
        let Sums { p, all, of_threads } = self;
        all.resize(particles, Wide::ZERO);
        let (p, count) = (&p[..], planes.len());
        let threads = pool.threads().min(count);
        of_threads.resize_with(threads, OfPlanes::default);
        let mut rest = &mut all[..];
        let mut work: Vec<_> = of_threads
            .iter_mut()
            .enumerate()
            .map(|(t, scratch)| {
                let planes = &planes[part(count, t, threads)];
                let particles = planes.iter().map(|plane| plane.own.len()).sum();
                (scratch, planes, take(&mut rest, particles))
            })
            .collect();
        pool.each(&mut work, |(OfPlanes { now, before, own: of_before, drawn }, planes, sums)| {
            let mut rest = &mut sums[..];
            before.clear();
            *of_before = 0;
            for PlanePairs { own, next, lists } in *planes {
                now.resize(own.len() + next.len(), Wide::ZERO);
                // SAFETY: the pairs of a plane are those of its own particles with each other, with the next and with ghosts,
                // as a search that has not failed has listed them; `p` has a vector for each, and a tag, as asserted.
                unsafe { add_pairs(set, lists, noise, p, own.start, now, drawn) };
                let to = take(&mut rest, own.len());
                vectors::run(set, Join { to, own: now, before: &before[*of_before..] });
                std::mem::swap(before, now);
                *of_before = own.len();
            }
        });
        for (t, OfPlanes { before, own, .. }) in of_threads.iter().enumerate() {
            let Some(last) = planes[part(count, t, threads)].last() else { continue };
            for (to, vector) in all[last.next.clone()].iter_mut().zip(&before[*own..]) {
                (0..3).for_each(|c| to[c] += vector[c]);
            }
        }
    }
}

/// Copies what the particles of the first plane have to the end, for the pairs of the last plane.
pub fn close<T: Copy>(planes: &[PlanePairs], of_particles: &mut Vec<T>) {
    let Some(last) = planes.last().filter(|_| !of_particles.is_empty()) else { return };
    of_particles.truncate(last.own.end);
    of_particles.extend_from_within(last.next.clone());
}

/// Fills an array in the order of cells with the values of the host's particles.
pub fn fill<T: Copy + Default + Send>(
    pool: &Pool,
    to: &mut Vec<T>,
    order: &[u32],
    value: impl Fn(usize) -> T + Sync,
) {
    resize(to, order.len(), T::default());
    each_with(pool, to, order, |to, k| *to = value(k));
}

/// Adds `factor` times sorted vectors to vectors in the order of the host, for particles that are not left out.
pub fn add_to_host(pool: &Pool, place: &[u32], from: &[Wide], factor: f64, to: &mut [[f64; 3]]) {
    each_of_host(pool, place, from, to, |to, from| (0..3).for_each(|c| to[c] += factor * from[c]));
}

/// Changes vectors in the order of the host by the sorted ones, for particles that are not left out.
pub fn each_of_host(
    pool: &Pool,
    place: &[u32],
    from: &[Wide],
    to: &mut [[f64; 3]],
    change: impl Fn(&mut [f64; 3], &Wide) + Sync,
) {
    each_with(pool, to, place, |to, place| {
        if let Some(from) = from.get(place) {
            change(to, from);
        }
    });
}

/// Does `work` with each element of an array and its number, divided among the threads.
fn each_with<T: Send>(pool: &Pool, to: &mut [T], numbers: &[u32], work: impl Fn(&mut T, usize) + Sync) {
    pool.parts(to, |first, to| {
        for (to, number) in to.iter_mut().zip(&numbers[first..]) {
            work(to, *number as usize);
        }
    });
}
