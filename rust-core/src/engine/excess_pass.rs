//! Evaluates ψ and its slopes for all particles, between the two passes over pairs.

use super::error::EngineError;
use super::excess::{ExcessPlan, ExcessWork};
use super::plan::Plan;
use psidpd_passes::instruction_set::InstructionSet;

/// Number of particles in an evaluation of ψ: enough to amortise the interpreter, few enough for the first-level cache.
pub const LANES: usize = 128;

/// Most particles in an evaluation if some are skipped: larger, so that few particles are left for a second evaluation.
const LISTED: usize = LANES + LANES / 2;

/// Scratch arrays for evaluating ψ in lanes, and counts.
#[derive(Debug, Clone, Default)]
pub struct ExcessPass {
    at: Vec<f64>,
    correction: Vec<f64>,
    psi: Vec<f64>,
    slopes: Vec<f64>,
    work: ExcessWork,
    /// Number of evaluations below and above the bounds of a density.
    pub out_of_bounds: [u64; 2],
    /// Number of evaluations of a ψ that depends on a density, each of a block of particles.
    pub evaluations: u64,
}

/// Arrays over consecutive particles, with a row for each; the first row is that of particle `first`.
pub struct Rows<'a> {
    pub first: usize,
    /// Variable of ψ in each column of the densities.
    pub columns: &'a [usize],
    pub densities: &'a [f64],
    /// Excess free energy of each particle.
    pub excess: &'a mut [f64],
    pub slopes: &'a mut [f64],
}

/// The rows of the lanes of one evaluation.
#[derive(Debug, Clone, Copy)]
enum Lanes<'a> {
    /// Consecutive rows.
    Run { first: usize, count: usize },
    /// Ascending rows that are not consecutive.
    Listed(&'a [u32]),
}

impl<'a> Lanes<'a> {
    fn of(members: &'a [u32]) -> Lanes<'a> {
        match *members {
            [first, .., last] if (last - first) as usize == members.len() - 1 => {
                Lanes::Run { first: first as usize, count: members.len() }
            }
            _ => Lanes::Listed(members),
        }
    }

    fn count(&self) -> usize {
        match self {
            Lanes::Run { count, .. } => *count,
            Lanes::Listed(members) => members.len(),
        }
    }

    fn row(&self, lane: usize) -> usize {
        match self {
            Lanes::Run { first, .. } => first + lane,
            Lanes::Listed(members) => members[lane] as usize,
        }
    }

    /// Calls `f` with each lane and its row, in a separate loop for each variant.
    #[inline(always)]
    fn each(&self, mut f: impl FnMut(usize, usize)) {
        match *self {
            Lanes::Run { first, count } => (0..count).for_each(|lane| f(lane, first + lane)),
            Lanes::Listed(members) => {
                members.iter().enumerate().for_each(|(lane, row)| f(lane, *row as usize));
            }
        }
    }
}

impl ExcessPass {
    /// Creates a pass with loops for an instruction set; results do not depend on it.
    pub fn new(set: InstructionSet) -> ExcessPass {
        ExcessPass { work: ExcessWork::new(set), ..ExcessPass::default() }
    }

    /// Evaluates ψ and its slopes for the particles of `rows`. `species` is negative for particles
    /// without a species, and `None` if there is one species only; `tag` names particles in errors.
    pub fn run(
        &mut self,
        plan: &Plan,
        species: Option<impl Fn(usize) -> i32>,
        tag: impl Fn(usize) -> i32,
        rows: &mut Rows,
    ) -> Result<(), EngineError> {
        let end = rows.excess.len();
        let mut members = [0; LISTED];
        for alpha in 0..plan.species.len() {
            let mut next = 0;
            while next < end {
                let lanes = match &species {
                    None => Lanes::Run { first: next, count: LANES.min(end - next) },
                    Some(species) => {
                        let mut count = 0;
                        while next < end && count < LISTED {
                            members[count] = next as u32;
                            count += (species(rows.first + next) == alpha as i32) as usize;
                            next += 1;
                        }
                        Lanes::of(&members[..count])
                    }
                };
                if species.is_none() {
                    next += lanes.count();
                }
                self.evaluate(plan, alpha, lanes, &tag, rows)?;
            }
        }
        Ok(())
    }

    /// Evaluates ψ_α and its slopes, by the chain rule through ρ̃. Where the layout of `rows` allows
    /// it, reads and writes them in place.
    fn evaluate(
        &mut self,
        plan: &Plan,
        alpha: usize,
        lanes: Lanes,
        tag: &dyn Fn(usize) -> i32,
        rows: &mut Rows,
    ) -> Result<(), EngineError> {
        let count = plan.species.len();
        let (variables, slope_width) = (plan.densities.len() * count, plan.slope_width());
        let ExcessPass { at, correction, psi, slopes, work, out_of_bounds, evaluations } = self;
        let n = lanes.count();
        if n == 0 {
            return Ok(());
        }
        if let ExcessPlan::Constant(value) = plan.excess[alpha] {
            lanes.each(|_, row| {
                rows.excess[row] = value;
                rows.slopes[row * slope_width..][..slope_width].fill(0.0);
            });
            return Ok(());
        }
        *evaluations += 1;

        let polynomial = |v: usize| &plan.densities[v / count].correction[alpha * count + v % count];
        let width = rows.columns.len();
        let at = match lanes {
            Lanes::Run { first, .. } if variables == 1 && width == 1 && polynomial(0).is_identity() => {
                &rows.densities[first..][..n]
            }
            _ => {
                let at = room(at, variables * n);
                let correction = room(correction, variables * n);
                if width < variables {
                    at.fill(0.0);
                }
                for (column, &v) in rows.columns.iter().enumerate() {
                    let at = &mut at[v * n..][..n];
                    lanes.each(|lane, row| at[lane] = rows.densities[row * width + column]);
                    if !polynomial(v).is_identity() {
                        polynomial(v).block(at, &mut correction[v * n..][..n]);
                    }
                }
                at
            }
        };
        let psi_in_place = matches!(lanes, Lanes::Run { .. });
        let slopes_in_place = psi_in_place && slope_width == 1;
        {
            let first = lanes.row(0);
            let psi = if psi_in_place { &mut rows.excess[first..][..n] } else { room(psi, n) };
            let slopes =
                if slopes_in_place { &mut rows.slopes[first..][..n] } else { room(slopes, slope_width * n) };
            let [low, high] = plan.excess[alpha].evaluate(at, psi, slopes, work);
            out_of_bounds[0] += low;
            out_of_bounds[1] += high;
            for (k, slope) in slopes.chunks_exact_mut(n).enumerate() {
                let v = plan.passes[k / count] * count + k % count;
                if !polynomial(v).is_identity() {
                    slope.iter_mut().zip(&correction[v * n..]).for_each(|(slope, factor)| *slope *= factor);
                }
            }
            if let Some(lane) = first_fault(psi, slopes) {
                let at = work.evaluated_at(at);
                let densities: Vec<String> =
                    (0..variables).map(|v| format!("{:.6}", at[v * n + lane])).collect();
                return Err(EngineError::ExcessFreeEnergy {
                    tag: tag(rows.first + lanes.row(lane)),
                    species: plan.species[alpha].clone(),
                    densities: densities.join(", "),
                });
            }
        }
        if !psi_in_place {
            let psi = &psi[..n];
            lanes.each(|lane, row| rows.excess[row] = psi[lane]);
        }
        if !slopes_in_place {
            for (k, slopes) in slopes[..slope_width * n].chunks_exact(n).enumerate() {
                lanes.each(|lane, row| rows.slopes[row * slope_width + k] = slopes[lane]);
            }
        }
        Ok(())
    }
}

/// The first `count` numbers of `scratch`, with unspecified values; `scratch` grows if it is shorter.
fn room(scratch: &mut Vec<f64>, count: usize) -> &mut [f64] {
    if scratch.len() < count {
        scratch.resize(count, 0.0);
    }
    &mut scratch[..count]
}

/// The first lane in which ψ or a slope is not finite.
fn first_fault(psi: &[f64], slopes: &[f64]) -> Option<usize> {
    if (sum(psi) + sum(slopes)).is_finite() {
        return None;
    }
    // There may be no such lane, if only the sum overflows.
    let faulty = |lane: &usize| {
        !psi[*lane].is_finite() || slopes.iter().skip(*lane).step_by(psi.len()).any(|s| !s.is_finite())
    };
    (0..psi.len()).find(faulty)
}

/// Sums in any order, so that the loop vectorises.
fn sum(values: &[f64]) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for k in 0..8 {
            sums[k] += chunk[k];
        }
    }
    sums.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{
        Around, Images, Instructions, Particles, PeriodicBox, Request, Settings, Sweep, Want,
    };
    use crate::model::Model;

    /// Rows of `count` particles of a fluid, with different densities, and room for results.
    struct Case {
        plan: Plan,
        columns: Vec<usize>,
        densities: Vec<f64>,
        species: Vec<i32>,
    }

    impl Case {
        fn new(species: &[&str], text: &str, count: usize) -> Case {
            let names: Vec<String> = species.iter().map(|s| format!("\"{s}\"")).collect();
            let mut text = format!("title = \"test\"\nspecies = [{}]\n{text}", names.join(", "));
            for (a, first) in names.iter().enumerate() {
                for second in &names[a..] {
                    text += &format!(
                        "[[pair]]\nbetween = [{first}, {second}]\nform = \"soft\"\nstrength = 1.0\nrange = 1.0\n"
                    );
                }
            }
            let plan = Plan::new(&Model::parse("test", &text).unwrap().at(1.0).unwrap()).unwrap();
            let kinds = species.len();
            let columns: Vec<usize> =
                plan.passes.iter().flat_map(|d| (0..kinds).map(move |s| d * kinds + s)).collect();
            let densities =
                (0..count * columns.len()).map(|k| 0.1 + 0.7 * ((k * 37) % 101) as f64 / 10.0).collect();
            let species = (0..count).map(|k| ((k * k + k / 3) % kinds) as i32).collect();
            Case { plan, columns, densities, species }
        }

        /// Evaluates ψ and slopes; returns them with the numbers that were there before.
        fn run(&self, pass: &mut ExcessPass, alike: bool) -> Result<(Vec<f64>, Vec<f64>), EngineError> {
            let count = self.species.len();
            let mut excess = vec![7.0; count];
            let mut slopes = vec![7.0; count * self.plan.slope_width()];
            let mut rows = Rows {
                first: 1000,
                columns: &self.columns,
                densities: &self.densities,
                excess: &mut excess,
                slopes: &mut slopes,
            };
            let species = (!alike).then_some(|i: usize| self.species[i - 1000]);
            pass.run(&self.plan, species, |i| i as i32 + 1, &mut rows)?;
            Ok((excess, slopes))
        }

        /// Evaluates one particle after another.
        fn one_by_one(&self, pass: &mut ExcessPass) -> (Vec<f64>, Vec<f64>) {
            let (width, mut excess, mut slopes) = (self.columns.len(), vec![], vec![]);
            for (k, densities) in self.densities.chunks_exact(width).enumerate() {
                let one = Case {
                    plan: self.plan.clone(),
                    columns: self.columns.clone(),
                    densities: densities.to_vec(),
                    species: vec![self.species[k]],
                };
                let (psi, slope) = one.run(pass, false).unwrap();
                excess.extend(psi);
                slopes.extend(slope);
            }
            (excess, slopes)
        }
    }

    const N: &str = "[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n";
    const M: &str = "[density.m]\nkernel = \"wendland-c2\"\nrange = 1.0\n";
    const BOUNDS: &str = "bounds = [1.0, 5.0]\n";
    const CORRECTION: &str = "correction = [0.1, 1.2, 0.01]\n";

    #[test]
    fn blocks_are_what_single_particles_are() {
        let one = "[excess_free_energy]\nA = \"n^3 + exp(-n)\"\n";
        let two = "[excess_free_energy]\nA = \"n^2*m + ln(1 + n)\"\n";
        let linear = "[excess_free_energy]\nA = \"n + m^2\"\n";
        let mixture = "[excess_free_energy]\nA = \"n^2*m_B + n_A^3\"\nB = \"n_A*m + ln(1 + m_B)\"\n";
        let cases: [(&[&str], String); 7] = [
            (&["A"], format!("{N}{one}")),
            (&["A"], format!("{N}{BOUNDS}{one}")),
            (&["A"], format!("{N}{CORRECTION}{one}")),
            (&["A"], format!("{N}{M}{two}")),
            (&["A"], format!("{N}{M}{linear}")),
            (&["A", "B"], format!("{N}{M}{mixture}")),
            (&["A", "B"], format!("{N}{BOUNDS}{CORRECTION}{M}{BOUNDS}{mixture}")),
        ];
        for (species, text) in cases {
            let case = Case::new(species, &text, 3 * LANES + 5);
            let (mut pass, mut single) = (ExcessPass::default(), ExcessPass::default());
            let expected = case.one_by_one(&mut single);
            assert_eq!(case.run(&mut pass, false).unwrap(), expected, "{text}");
            assert_eq!(pass.out_of_bounds, single.out_of_bounds, "{text}");
            for (name, set) in Instructions::ALL {
                let Some(set) = InstructionSet::new(set) else { continue };
                let bits = case.run(&mut ExcessPass::new(set), false).unwrap();
                assert_eq!(bits, expected, "{name}: {text}");
            }
            assert_eq!(pass.out_of_bounds != [0; 2], text.contains(BOUNDS), "{text}");
            if species.len() == 1 {
                assert_eq!(case.run(&mut pass, true).unwrap(), expected, "{text}");
            }
        }
    }

    #[test]
    fn particles_that_have_no_species_are_left_as_they_are() {
        let text = format!("{N}[excess_free_energy]\nA = \"ln(n)\"\n");
        let mut case = Case::new(&["A"], &text, 2 * LANES);
        let expected = case.run(&mut ExcessPass::default(), true).unwrap();
        for k in (0..case.species.len()).filter(|k| k % 3 == 1) {
            // At this density ψ is not finite.
            (case.species[k], case.densities[k]) = (-1, 0.0);
        }
        let (excess, slopes) = case.run(&mut ExcessPass::default(), false).unwrap();
        for (k, species) in case.species.iter().enumerate() {
            let left = [7.0, 7.0];
            let found = [excess[k], slopes[k]];
            assert_eq!(found, if *species < 0 { left } else { [expected.0[k], expected.1[k]] });
        }
    }

    #[test]
    fn the_first_particle_at_fault_is_named() {
        let text = format!("{N}{M}[excess_free_energy]\nA = \"ln(n) + sqrt(m)*m\"\n");
        let mut case = Case::new(&["A"], &text, 3 * LANES);
        for (k, column) in [(LANES + 70, 0), (LANES + 41, 1), (2 * LANES + 3, 0)] {
            case.densities[2 * k + column] = -1.0;
        }
        for alike in [true, false] {
            let fault = case.run(&mut ExcessPass::default(), alike).unwrap_err();
            let EngineError::ExcessFreeEnergy { tag, species, densities } = fault else { panic!("{fault}") };
            assert_eq!((tag, &species[..]), ((1000 + LANES + 41 + 1) as i32, "A"));
            assert!(densities.ends_with(", -1.000000"), "{densities}");
        }
    }

    #[test]
    fn finite_numbers_may_have_a_sum_that_is_not() {
        let text = format!("{N}[excess_free_energy]\nA = \"n^2\"\n");
        let mut case = Case::new(&["A"], &text, LANES);
        case.densities.fill(1e154);
        let (excess, _) = case.run(&mut ExcessPass::default(), true).unwrap();
        assert!(excess.iter().all(|psi| psi.is_finite()));
        assert_eq!(excess.iter().sum::<f64>(), f64::INFINITY);
    }

    /// Particles of a species without ψ take the places of other particles in the next step.
    #[test]
    fn a_species_without_psi_keeps_nothing_of_the_step_before() {
        for constant in ["0", "1.5"] {
            let text = format!("{N}[excess_free_energy]\nA = \"2.5*n^2\"\nB = \"{constant}\"\n");
            let plan = Case::new(&["A", "B"], &text, 1).plan;
            let count = 300;
            let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
            let tag: Vec<i32> = (1..=count).collect();
            let sweep = || {
                let settings = Settings::default();
                Sweep::of_plan(
                    plan.clone(),
                    settings,
                    std::sync::Arc::new(crate::engine::Pool::new(settings.threads)),
                )
            };
            for ghosts in [false, true] {
                let evaluate = |sweep: &mut Sweep, turn: u32| {
                    let place = |k: u32| {
                        4.0 * f64::from(k.wrapping_mul(2654435761).wrapping_add(turn * 77777777))
                            / 2f64.powi(32)
                    };
                    let mut x: Vec<[f64; 3]> =
                        (0..count as u32).map(|k| std::array::from_fn(|c| place(3 * k + c as u32))).collect();
                    let mut kind: Vec<i32> = (0..count).map(|k| k % 2).collect();
                    let (mut tag, mut images) = (tag.clone(), Images::default());
                    if ghosts {
                        images.build(&domain, 3, plan.cutoff, count as usize, &mut x);
                        images.forward(1, &mut tag);
                        images.forward(1, &mut kind);
                    }
                    let particles = Particles { owned: count as usize, x: &x, tag: &tag, kind: &kind };
                    let mut force = vec![[0.0; 3]; count as usize];
                    let open = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [false; 3]).unwrap();
                    let around = Around { domain: &open, images: &[] };
                    let tally = if ghosts {
                        sweep
                            .first(
                                around,
                                &Request { particles, v: &[], step: None, want: Want::TOTALS },
                                &mut force,
                            )
                            .unwrap();
                        let mut slopes = sweep.slopes[..2 * count as usize].to_vec();
                        images.forward(2, &mut slopes);
                        sweep.slopes.copy_from_slice(&slopes);
                        sweep.second(&particles, &mut force).unwrap()
                    } else {
                        sweep
                            .evaluate(
                                &domain,
                                &Request { particles, v: &[], step: None, want: Want::TOTALS },
                                &mut force,
                                false,
                            )
                            .unwrap()
                    };
                    (force, tally.excess)
                };
                let mut used = sweep();
                evaluate(&mut used, 0);
                assert_eq!(evaluate(&mut used, 1), evaluate(&mut sweep(), 1), "{constant}, {ghosts}");
            }
        }
    }
}
