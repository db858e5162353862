//! Special pairs: their factors in the lists of pairs, and their contributions to a sweep, which leaves them out.

use super::densities::add_density;
use super::forces::{ForceInput, ForceOutput, add_forces};
use super::pairs::{PairList, Pairs};
use crate::engine::error::EngineError;
use crate::engine::exclusions::Exclusions;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::engine::request::Request;
use crate::engine::surroundings::{Around, Newton, SpecialPair};
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::tally::Tally;
use std::collections::HashMap;

/// Sets the factors of special pairs in the list, and factors of 0 for pairs that marks exclude.
///
/// # Errors
/// Fails in a box where two particles meet in several images, as the special pair is then ambiguous.
pub fn scale(
    pairs: &mut Pairs,
    special: &[SpecialPair],
    exclusions: &Exclusions,
    domain: &PeriodicBox,
    dimensions: usize,
    cutoff: f64,
) -> Result<(), EngineError> {
    if !special.is_empty() && (0..dimensions).any(|k| domain.periodic()[k] && domain.height(k) < 2.0 * cutoff)
    {
        return Err(EngineError::Host("special pairs need a box at least twice as wide as the cut-off"));
    }
    let key = |i: u32, j: u32| (i.min(j), i.max(j));
    let factors: HashMap<_, _> = special.iter().map(|p| (key(p.i, p.j), p.factor)).collect();
    for list in [&mut pairs.force, &mut pairs.density_only] {
        let factor = |(i, j): (&u32, &u32)| match exclusions.excludes(*i as usize, *j as usize) {
            true => 0.0,
            false => factors.get(&key(*i, *j)).copied().unwrap_or(1.0),
        };
        list.factor = list.i.iter().zip(&list.j).map(factor).collect();
        list.thermostat_factor = list.factor.iter().map(|f| if *f == 0.0 { 0.0 } else { 1.0 }).collect();
    }
    Ok(())
}

/// The contributions of special pairs to an evaluation that leaves them out: to densities before ψ is
/// evaluated, and to forces and totals at the end.
#[derive(Debug, Clone, Default)]
pub struct Corrections {
    /// Special pairs within the cut-off with a factor above 0.
    pub pairs: PairList,
}

impl Corrections {
    /// Finds the special pairs within the cut-off, and their contributions to the densities that forces
    /// need: for each owned particle [`Plan::slope_width`] numbers, or an empty list if there are none.
    ///
    /// # Errors
    /// Fails for a pair of particles that do not exist, and for a pair without an owned particle.
    pub fn find(
        &mut self,
        plan: &Plan,
        (special, exclusions): (&[SpecialPair], &Exclusions),
        around: Around,
        particles: &Particles,
        densities: &mut Vec<f64>,
    ) -> Result<(), EngineError> {
        self.pairs.clear();
        densities.clear();
        let Particles { x, kind, owned, .. } = *particles;
        let Around { domain, images } = around;
        let is_periodic = domain.periodic() != [false; 3];
        let (squared, depth) = (plan.cutoff * plan.cutoff, if plan.dimensions == 2 { 0.0 } else { 1.0 });
        let square = |d: &[f64; 3]| d[0] * d[0] + d[1] * d[1] + depth * d[2] * d[2];
        let species = |k: usize| plan.species_of_type.get(kind[k] as usize).copied().unwrap_or(-1);
        for pair in special {
            let (i, j) = (pair.i as usize, pair.j as usize);
            if i >= owned || j >= x.len() {
                return Err(EngineError::Host("a special pair names a particle that does not exist"));
            }
            if pair.factor == 0.0 || exclusions.excludes(i, j) {
                continue;
            }
            let mut d = std::array::from_fn(|c| x[i][c] - x[j][c]);
            // At most one image is within the cut-off.
            if square(&d) >= squared && is_periodic {
                d = domain.minimum_image(x[i], x[j]);
            }
            let is_image = j >= owned && images.get(j - owned).is_some_and(|image| *image);
            let (a, b) = (species(i), species(j));
            if square(&d) < squared && !is_image && a >= 0 && b >= 0 {
                d[2] *= depth;
                self.pairs.push_of(i, j, d, [a, b]);
                self.pairs.factor.push(pair.factor);
                self.pairs.thermostat_factor.push(1.0);
            }
        }
        if self.pairs.len() > 0 {
            let width = plan.slope_width();
            densities.resize(width * owned, 0.0);
            for (k, density) in plan.passes.iter().enumerate() {
                let kernel = &plan.densities[*density].kernel;
                add_density(&self.pairs, kernel, owned, densities, width, k * plan.species.len());
            }
        }
        Ok(())
    }

    /// Adds the forces on owned particles, and returns the contribution to the totals. A pair with a
    /// ghost counts half, as in a sweep.
    ///
    /// # Errors
    /// Fails for a force that is not finite.
    pub fn add_forces(
        &self,
        plan: &Plan,
        slopes: &[f64],
        request: &Request,
        force: &mut [[f64; 3]],
    ) -> Result<Tally, EngineError> {
        let Request { particles, v, step, .. } = *request;
        let (list, newton) = (&self.pairs, Newton::Off);
        let thermostat = plan.noise_of(step, v, particles.x.len())?;
        let input = ForceInput { plan, list, newton, slopes, request: *request, thermostat };
        let mut output = ForceOutput { force: &mut force[..particles.owned], ..ForceOutput::default() };
        add_forces(&input, &mut output);
        let tally = output.tally;
        let members = self.pairs.i.iter().chain(&self.pairs.j).map(|k| *k as usize);
        let is_lost = |k: &usize| *k < particles.owned && !force[*k].iter().all(|f| f.is_finite());
        match members.filter(is_lost).map(|k| particles.tag[k]).min() {
            None => Ok(tally),
            Some(tag) => Err(EngineError::Force { tag }),
        }
    }
}
