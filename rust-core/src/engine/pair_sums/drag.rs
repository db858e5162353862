//! The drag between the pairs of an evaluation, for a thermostat that acts at the same positions as the conservative forces.

use super::evaluation::Evaluator;
use super::pair_block::PairBlock;
use super::pairs::BLOCK;
use crate::engine::plan::ThermostatPlan;
use crate::engine::vectors::{Loop, run_best};

impl Evaluator {
    /// The forces of a block of pairs and the drag `−γ w_R² (ê·v_ij)` at the velocities `v` of particles of these `species`, with their
    /// `shares`, divided by distances as [`PairBlock::strengths`]. No pair with drag is missing if
    /// [`Plan::drag_is_within_forces`](crate::engine::Plan::drag_is_within_forces).
    pub fn strengths_with_drag<T: Copy + Into<f64>>(
        &self,
        block: &PairBlock<T>,
        species: &[i32],
        v: &[[f64; 3]],
        shares: [f64; 2],
    ) -> [f64; BLOCK] {
        let [share, of_drag] = shares;
        let mut strengths = [0.0; BLOCK];
        strengths.iter_mut().zip(block.strengths).for_each(|(to, of)| *to = share * (*of).into());
        if let Some(plan) = &self.plan.thermostat {
            let kinds = self.fluid.species.len();
            run_best(Drag { plan, kinds, block, share: of_drag, species, v, strengths: &mut strengths });
        }
        strengths
    }
}

/// Adds a share of drag to the forces of pairs.
struct Drag<'a, T> {
    plan: &'a ThermostatPlan,
    kinds: usize,
    block: &'a PairBlock<'a, T>,
    share: f64,
    species: &'a [i32],
    v: &'a [[f64; 3]],
    strengths: &'a mut [f64; BLOCK],
}

impl<T: Copy + Into<f64>> Loop for Drag<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Drag { plan, kinds, block, share, species, v, strengths } = self;
        let ThermostatPlan { gamma, range, exponent, .. } = plan;
        let is_linear = exponent.iter().all(|exponent| *exponent == 1.0);
        let [x, y, z] = block.d;
        for (((strength, [i, j]), (x, y)), z) in
            strengths.iter_mut().zip(block.particles()).zip(x.iter().zip(y)).zip(z)
        {
            let d: [f64; 3] = [(*x).into(), (*y).into(), (*z).into()];
            let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let kinds = species[i] as usize * kinds + species[j] as usize;
            let (gamma, range) = (gamma[kinds], range[kinds]);
            let dot = d[0] * (v[i][0] - v[j][0]) + d[1] * (v[i][1] - v[j][1]) + d[2] * (v[i][2] - v[j][2]);
            // w_R/r, if w_R is linear in r.
            let weight = (range - r) / (range * r);
            let mut drag = share * gamma * weight * weight * dot;
            if !is_linear && r < range {
                drag *= (1.0 - r / range).powf(2.0 * exponent[kinds] - 2.0);
            }
            // A pair at zero distance has no direction.
            *strength -= if (r < range) & (r > 0.0) { drag } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::plan::Plan;
    use crate::engine::sweep::Pool;
    use crate::model::Model;
    use psidpd_passes::domain::PeriodicBox;
    use psidpd_passes::noise::threefry2x32;
    use std::num::NonZeroUsize;

    const MODEL: &str = r#"
title = "drag"
species = ["A", "B"]
[density.n]
kernel = "quadratic"
range = 1.0
[excess_free_energy]
A = "n^2"
B = "n_A*n^2"
[[thermostat]]
between = ["A", "A"]
gamma = 4.5
range = 0.7
[[thermostat]]
between = ["A", "B"]
gamma = 9.0
range = 1.0
exponent = 0.5
[[thermostat]]
between = ["B", "B"]
gamma = 0.0
range = 1.0
"#;

    /// Compares a block with the definition, and returns how many pairs have drag.
    fn check<T: Copy + Into<f64>>(
        evaluator: &Evaluator,
        block: &PairBlock<T>,
        (species, v): (&[i32], &[[f64; 3]]),
        exponent: f64,
    ) -> usize {
        let found = evaluator.strengths_with_drag(block, species, v, [0.7, 0.4]);
        let mut slowed = 0;
        for (k, [i, j]) in block.particles().enumerate() {
            let (d, conservative): ([f64; 3], f64) =
                (block.d.map(|d| d[k].into()), block.strengths[k].into());
            let r = d.iter().map(|d| d * d).sum::<f64>().sqrt();
            let (gamma, range, exponent) = match species[i] + species[j] {
                0 => (4.5, 0.7, 1.0),
                1 => (9.0, 1.0, exponent),
                _ => (0.0, 0.0, 1.0),
            };
            let mut expected = 0.7 * conservative;
            if r < range && r > 0.0 {
                let along = (0..3).map(|c| d[c] / r * (v[i][c] - v[j][c])).sum::<f64>();
                expected -= 0.4 * gamma * (1.0 - r / range).powf(2.0 * exponent) * along / r;
                slowed += 1;
            }
            let scale = 1.0 + expected.abs() + conservative.abs();
            assert!((found[k] - expected).abs() < 1e-13 * scale, "{i} {j} {r}: {} {expected}", found[k]);
        }
        slowed
    }

    /// Each pair has the drag of its species by the definition, besides its conservative force, in their shares, in both precisions; two at one
    /// place have none.
    #[test]
    fn pairs_have_their_drag() {
        for (model, exponent) in [(MODEL.to_owned(), 0.5), (MODEL.replace("exponent = 0.5", ""), 1.0)] {
            let fluid = Model::parse("m.toml", &model).unwrap().at(1.0).unwrap();
            let uniform = |k: u32| f64::from(threefry2x32::<20>([k, 0], [5, 9])[0]) / 4_294_967_296.0;
            let mut x: Vec<[f64; 3]> =
                (0..150).map(|k| [0, 1, 2].map(|c| 3.0 * uniform(3 * k + c))).collect();
            x[4] = x[2];
            let v: Vec<[f64; 3]> =
                (0..150).map(|k| [0, 1, 2].map(|c| uniform(3 * k + c + 999) - 0.5)).collect();
            let species: Vec<i32> = (0..150).map(|k| k % 2).collect();
            let domain = PeriodicBox::orthogonal([0.0; 3], [3.0; 3], [true; 3]).unwrap();
            let (evaluator, pool) = (Evaluator::new(fluid).unwrap(), Pool::new(NonZeroUsize::MIN));
            let evaluation = evaluator.evaluate(&pool, &x, &species, &domain);
            let bodies = (&species[..], &v[..]);
            let mut slowed = 0;
            for block in (0..evaluation.parts().count()).flat_map(|part| evaluation.blocks_of(part)) {
                slowed += check(&evaluator, &block, bodies, exponent);
                let single = |of: &[f64]| -> Vec<f32> { of.iter().map(|of| *of as f32).collect() };
                let (d, strengths) = (block.d.map(single), single(block.strengths));
                let (PairBlock { hosts, pairs, .. }, d) = (block, d.each_ref().map(|d| &d[..]));
                check(&evaluator, &PairBlock { hosts, pairs, d, strengths: &strengths }, bodies, exponent);
            }
            assert!(slowed > 500);
        }
    }

    #[test]
    fn drag_that_reaches_farther_than_forces_is_known() {
        for (model, expected) in
            [(MODEL.to_owned(), true), (MODEL.replace("range = 0.7", "range = 1.1"), false)]
        {
            let fluid = Model::parse("m.toml", &model).unwrap().at(1.0).unwrap();
            assert_eq!(Plan::new(&fluid).unwrap().drag_is_within_forces(), expected);
        }
    }
}
