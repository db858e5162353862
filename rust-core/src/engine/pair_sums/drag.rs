//! The drag between the pairs of an evaluation, for a thermostat that acts at the same positions as the conservative forces.

use super::evaluation::{Evaluation, Evaluator};
use super::plane_list::PlaneList;
use crate::engine::plan::ThermostatPlan;
use crate::engine::vectors::{Loop, run_best};

impl Evaluator {
    /// The forces of the pairs of a part and the drag `−γ w_R² (ê·v_ij)` at the velocities `v` of the particles, with their `shares`, divided
    /// by distances as [`PairBlock::strengths`](super::PairBlock::strengths). No pair with drag is missing if
    /// [`Plan::drag_is_within_forces`](crate::engine::Plan::drag_is_within_forces).
    pub fn strengths_with_drag(
        &self,
        evaluation: &Evaluation,
        part: usize,
        shares: [f64; 2],
        v: &[[f64; 3]],
    ) -> Vec<f64> {
        let plane = &evaluation.planes[part];
        let [share, of_drag] = shares;
        let mut strengths: Vec<f64> = plane.strengths.iter().map(|strength| share * strength).collect();
        if let Some(plan) = &self.plan.thermostat {
            let v: Vec<[f64; 3]> = plane.hosts.iter().map(|k| v[*k as usize]).collect();
            let kinds = self.fluid.species.len();
            run_best(Drag { plan, kinds, plane, share: of_drag, v: &v, strengths: &mut strengths });
        }
        strengths
    }
}

/// Adds a share of drag to the forces of the pairs of a plane, whose particles have the velocities `v` by their local numbers.
struct Drag<'a> {
    plan: &'a ThermostatPlan,
    kinds: usize,
    plane: &'a PlaneList,
    share: f64,
    v: &'a [[f64; 3]],
    strengths: &'a mut [f64],
}

impl Loop for Drag<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Drag { plan: ThermostatPlan { gamma, range, exponent, .. }, kinds, plane, share, v, strengths } =
            self;
        let list = &plane.list;
        let is_linear = exponent.iter().all(|exponent| *exponent == 1.0);
        let [x, y, z] = list.d.each_ref();
        let particles = list.i.iter().zip(&list.j).zip(list.species_i.iter().zip(&list.species_j));
        let pairs = particles.zip(x.iter().zip(y).zip(z)).zip(&list.r);
        for (strength, ((((i, j), (a, b)), ((x, y), z)), r)) in strengths.iter_mut().zip(pairs) {
            let (v_i, v_j) = (v[*i as usize], v[*j as usize]);
            let kinds = *a as usize * kinds + *b as usize;
            let (gamma, range) = (gamma[kinds], range[kinds]);
            let dot = x * (v_i[0] - v_j[0]) + y * (v_i[1] - v_j[1]) + z * (v_i[2] - v_j[2]);
            // w_R/r, if w_R is linear in r.
            let weight = (range - r) / (range * r);
            let mut drag = share * gamma * weight * weight * dot;
            if !is_linear && *r < range {
                drag *= (1.0 - r / range).powf(2.0 * exponent[kinds] - 2.0);
            }
            // A pair at zero distance has no direction.
            *strength -= if (*r < range) & (*r > 0.0) { drag } else { 0.0 };
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

    /// Each pair has the drag of its species by the definition, besides its conservative force, in their shares; two at one place have none.
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
            let mut slowed = 0;
            for (part, count) in evaluation.parts().enumerate() {
                let found = evaluator.strengths_with_drag(&evaluation, part, [0.7, 0.4], &v);
                let blocks = evaluation.blocks_of(part).flat_map(|block| {
                    let at = |k: usize| ([0, 1, 2].map(|c| block.d[c][k]), block.r[k], block.strengths[k]);
                    block.particles().enumerate().map(|(k, ij)| (ij, at(k))).collect::<Vec<_>>()
                });
                assert_eq!(found.len(), count);
                for (([i, j], (d, r, conservative)), found) in blocks.zip(found) {
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
                    assert!((found - expected).abs() < 1e-13 * scale, "{i} {j} {r}: {found} {expected}");
                }
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
