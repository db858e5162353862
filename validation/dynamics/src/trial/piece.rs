//! A small periodic box of a fluid, in equilibrium.

use super::samples::StepErrors;
use super::{CAP, GOAL, two_digits};
use crate::integrator::{Coupling, Integrator, crossing};
use crate::run::{RunError, Simulation, State};
use psidpd_core::engine::noise::{Law, PairNoise};
use psidpd_core::engine::pair_sums::Evaluator;
use psidpd_core::engine::{PeriodicBox, Settings, Want};
use psidpd_core::model::Model;
use psidpd_observe::configurational;
use psidpd_observe::frame::Frame;
use std::num::NonZeroUsize;

/// Particles of a piece, if the range of the forces leaves room for so few, and most.
const PARTICLES: f64 = 400.0;
const MOST: f64 = 6000.0;

/// Edge of the smallest piece, in ranges of the forces.
const EDGE: f64 = 2.2;

/// Rounds that relax a random start, and the steps of each. Velocities are drawn anew after each, so no heat is left.
const ROUNDS: u32 = 10;
const ROUND: u64 = 30;

/// ωΔt of the steps that settle a piece.
const SHORT: f64 = 0.45;

/// Samples of the pressure, and steps between them.
const PRESSURES: usize = 100;
const BETWEEN: u64 = 6;

/// Samples of the pressure to each of the frequency, which scatters where the fastest are few.
const LOOKS: usize = 10;

/// Most trials of a search.
const TRIALS: usize = 6;

/// Most steps that settle a piece of one phase, and of one that condenses; steps between looks at its frequency.
const SETTLE: f64 = 1200.0;
const LONGEST_SETTLE: u64 = 6000;
const STRETCH: u64 = 60;

/// Looks that decide whether a piece is steady, and by how much the second half of them may be faster.
const RECENT: usize = 10;
const GROWTH: f64 = 0.06;

/// Why a fluid has no piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoPiece {
    #[error("there are no particles")]
    Empty,
    #[error("the forces reach so far that even a small piece of the fluid has more than {MOST} particles")]
    Large,
    #[error("a small piece of the fluid does not come to rest in short steps")]
    Unsettled,
    #[error("a small piece of the fluid still condenses or separates after {LONGEST_SETTLE} short steps")]
    Separates,
}

/// Number density of each species, and what else a piece needs to know.
#[derive(Debug, Clone)]
pub struct Composition<'a> {
    pub model: &'a Model,
    pub masses: &'a [f64],
    pub kt: f64,
    pub densities: &'a [f64],
    pub seed: u64,
}

/// A piece of a fluid in equilibrium, and how fast its particles are.
#[derive(Debug)]
pub struct Piece {
    model: Model,
    kt: f64,
    seed: u64,
    state: State,
    /// Frequency ω of the fastest species.
    pub frequency: f64,
    /// The root mean square frequency of all particles, of ∇²U; `None` where forces jump or have no potential.
    pub mean_frequency: Option<f64>,
    /// The rate κ at which drag takes kinetic energy.
    pub drag: f64,
    /// The rate ν at which particles cross the range of the forces.
    pub crossing: f64,
    /// The pressure at kT of its configurations.
    pub pressure: f64,
    /// The thermal pressure of the piece, `∂p/∂kT / ρ`.
    pub thermal_pressure: f64,
}

/// The step that moves a piece while it settles, and its reference.
const ACCURATE: Integrator =
    Integrator::ForceGradient { lambda: 0.17, gradient: 1.0 / 24.0, coupling: Coupling::DEFAULT };

impl Piece {
    pub fn settled(of: &Composition) -> Result<Result<Piece, NoPiece>, RunError> {
        let mut state = match start(of)? {
            Ok(state) => state,
            Err(why) => return Ok(Err(why)),
        };
        let fluid = of.model.at(of.kt)?;
        let evaluator = Evaluator::new(fluid)?;
        let (mut number, mut rates) = (3, [0.0; 2]);
        // Without forces a step is limited by the way of a particle through the range of another.
        let crossing = crossing(of.kt, of.masses, evaluator.fluid.cutoff());
        for _ in 0..ROUNDS {
            draw_velocities(&mut state, of, number);
            number += 3;
            let mut run = simulation(of.model, of.kt, state.clone(), of.seed)?;
            rates = [frequency(&run, &evaluator, number), drag(&mut run)?];
            let fastest = rates[0].max(0.1 * rates[1]).max(crossing);
            if fastest <= 0.0 {
                break;
            }
            run.prepare_for(ACCURATE, SHORT / fastest, Want::FORCES)?;
            if run.advance(ROUND, SHORT / fastest, ACCURATE).is_err() {
                return Ok(Err(NoPiece::Unsettled));
            }
            state = run.state().clone();
        }
        if rates[0].max(rates[1]) > 0.0 {
            draw_velocities(&mut state, of, number);
            number += 3;
            let run = simulation(of.model, of.kt, state, of.seed)?;
            state = match come_to_rest(run, &evaluator, crossing, number)? {
                Ok(state) => state,
                Err(why) => return Ok(Err(why)),
            };
        }
        let mut run = simulation(of.model, of.kt, state.clone(), of.seed)?;
        if rates[0].max(rates[1]) > 0.0 {
            rates = [frequency(&run, &evaluator, number), drag(&mut run)?];
        }
        let dt = SHORT / rates[0].max(0.1 * rates[1]).max(crossing);
        let mut samples = Vec::new();
        if dt.is_finite() {
            let mut frequencies = Vec::new();
            for k in 0..PRESSURES {
                if k % LOOKS == 0 {
                    number += 3;
                    frequencies.push(frequency(&run, &evaluator, number));
                }
                let made = run
                    .advance(BETWEEN - 1, dt, ACCURATE)
                    .and_then(|()| run.step(dt, ACCURATE, Want::TOTALS));
                if made.is_err() {
                    return Ok(Err(NoPiece::Unsettled));
                }
                let flux = 2.0 * run.kinetic_energy()
                    / (run.dimensions() as f64 * state.domain.volume(run.dimensions()));
                let virial = run.scalar_pressure(run.conservative_pressure_tensor()) - flux;
                samples.push([virial, run.potential_energy()]);
            }
            rates[0] = frequencies.iter().sum::<f64>() / frequencies.len() as f64;
        }
        let ideal = run.len() as f64 * of.kt / state.domain.volume(run.dimensions());
        let mean = |k: usize| samples.iter().map(|s| s[k]).sum::<f64>() / samples.len().max(1) as f64;
        let (virial, energy) = (mean(0), mean(1));
        let products = samples.iter().map(|s| (s[0] - virial) * (s[1] - energy)).sum::<f64>();
        // ∂⟨W⟩/∂kT at the energies of this kT.
        let covariance = products / samples.len().max(1) as f64 / (ideal * of.kt);
        let mean_frequency = configurational::missing(&evaluator.fluid, &state.domain).is_none().then(|| {
            let square = configurational::mean_square_frequency(&Frame::new(run.view(0.0), &evaluator));
            square.max(0.0).sqrt()
        });
        let [frequency, drag] = rates;
        Ok(Ok(Piece {
            model: of.model.clone(),
            kt: of.kt,
            seed: of.seed,
            state,
            frequency,
            mean_frequency,
            drag,
            crossing,
            pressure: ideal + virial,
            thermal_pressure: 1.0 + covariance.max(0.0),
        }))
    }

    /// The particles of the piece, in equilibrium.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The longest step that may be advised, whatever its errors.
    pub fn cap(&self) -> f64 {
        CAP / self.frequency
    }

    /// Errors of steps of `dt`; `None` where the piece does not survive them.
    pub fn errors(&self, integrator: Integrator, dt: f64) -> Result<Option<StepErrors>, RunError> {
        let run = simulation(&self.model, self.kt, self.state.clone(), self.seed.wrapping_add(1))?;
        StepErrors::measured(run, (integrator, dt), self.drag, self.thermal_pressure)
    }

    /// The longest step up to the cap whose errors are about [`GOAL`] or less, with its errors; `None` where no step is known.
    pub fn longest(&self, integrator: Integrator) -> Result<Option<(f64, StepErrors)>, RunError> {
        let mut dt = two_digits(self.cap());
        if !dt.is_finite() {
            return Ok(None);
        }
        for _ in 0..TRIALS {
            let errors = self.errors(integrator, dt)?;
            match errors {
                // Where configurations scatter too much to tell, shorter steps tell no more.
                Some(errors) if !errors.is_known() => break,
                Some(errors) if errors.worst() <= GOAL.max(errors.resolution()) => {
                    return Ok(Some((dt, errors)));
                }
                _ => {}
            }
            let worst = errors.map_or(f64::INFINITY, |errors| errors.worst());
            let shorter = two_digits(dt * (GOAL / worst).powf(1.0 / 6.0).clamp(0.7, 0.93));
            if shorter * self.frequency <= SHORT {
                break;
            }
            dt = shorter;
        }
        Ok(None)
    }
}

/// Steps until the frequency of the fastest species no longer grows. A fluid between two phases condenses meanwhile, and its steps
/// are those of the denser phase.
fn come_to_rest(
    mut run: Simulation,
    evaluator: &Evaluator,
    crossing: f64,
    number: u32,
) -> Result<Result<State, NoPiece>, RunError> {
    let (mut steps, mut relaxation) = (0, 0.0);
    let mut frequencies = Vec::new();
    while steps < LONGEST_SETTLE {
        let [frequency, drag] = [frequency(&run, evaluator, number), drag(&mut run)?];
        let fastest = frequency.max(0.1 * drag).max(crossing);
        frequencies.push(frequency);
        if relaxation >= 1.0 && is_steady(&frequencies) {
            return Ok(Ok(run.state().clone()));
        }
        let dt = SHORT / fastest;
        if run.prepare_for(ACCURATE, dt, Want::FORCES).is_err() || run.advance(STRETCH, dt, ACCURATE).is_err()
        {
            return Ok(Err(NoPiece::Unsettled));
        }
        steps += STRETCH;
        let full = (30.0 + 10.0 * drag / fastest) / SHORT;
        relaxation += STRETCH as f64 / full.min(SETTLE);
    }
    Ok(Err(NoPiece::Separates))
}

/// Whether the second half of the frequencies of a piece is no larger than the first, but for the scatter of few particles.
fn is_steady(frequencies: &[f64]) -> bool {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let recent = &frequencies[frequencies.len().saturating_sub(RECENT)..];
    let (before, after) = recent.split_at(recent.len() / 2);
    !before.is_empty() && mean(after) <= (1.0 + GROWTH) * mean(before)
}

/// On one thread: a piece is too small for more.
fn simulation(model: &Model, kt: f64, state: State, seed: u64) -> Result<Simulation, RunError> {
    // A piece is far from all walls.
    let mut run = Simulation::new(&model.clone().with_walls(Vec::new()), kt, state, seed)?;
    run.set_settings(Settings { threads: NonZeroUsize::MIN, ..run.settings() })?;
    Ok(run)
}

/// The frequency ω of the fastest species: see the module.
fn frequency(run: &Simulation, evaluator: &Evaluator, number: u32) -> f64 {
    /// Displacement of the differences, in ranges of the forces.
    const SMALL: f64 = 0.01;
    let State { domain, mass, x, species, tag, .. } = run.state();
    let dimensions = run.dimensions();
    let range = evaluator.fluid.cutoff();
    let lightest = mass.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let time = SMALL * range / (run.kt() / lightest).sqrt();
    let draws = PairNoise::new(u64::from(number), 0);
    let tags: Vec<u32> = tag.iter().map(|tag| *tag as u32).collect();
    let mut to = [x.clone(), x.clone()];
    for c in 0..dimensions {
        let mut drawn = vec![0.0; x.len()];
        draws.fill(Law::Gaussian, &tags, &vec![u32::MAX - c as u32; x.len()], &mut drawn);
        for k in 0..x.len() {
            let by = 0.5 * time * (run.kt() / mass[species[k] as usize]).sqrt() * f64::from(drawn[k]);
            to[0][k][c] -= by;
            to[1][k][c] += by;
        }
    }
    to.iter_mut().flatten().for_each(|x| domain.wrap(x, &mut [0; 3]));
    let pool = run.engine().pool();
    let [before, after] =
        to.map(|x| evaluator.evaluate(pool, &x, species, domain).forces(pool, &evaluator.fluid));
    let mut sums = vec![(0.0, 0usize); mass.len()];
    for k in 0..x.len() {
        let (sum, count) = &mut sums[species[k] as usize];
        *sum += (0..dimensions).map(|c| ((after[k][c] - before[k][c]) / time).powi(2)).sum::<f64>();
        *count += 1;
    }
    let of = |((sum, count), mass): (&(f64, usize), &f64)| match count {
        0 => 0.0,
        _ => (sum / *count as f64 / (dimensions as f64 * run.kt() * mass)).powf(0.25),
    };
    sums.iter().zip(mass).map(of).fold(0.0, f64::max)
}

fn drag(run: &mut Simulation) -> Result<f64, RunError> {
    Ok(run.warmth(1e-3, None)?.map_or(0.0, |warmth| warmth.rate))
}

fn gaussian_or_uniform(of: &Composition, tags: &[u32], number: u32, law: Law) -> Vec<f32> {
    let mut drawn = vec![0.0; tags.len()];
    PairNoise::new(of.seed, 0).fill(law, tags, &vec![u32::MAX - number; tags.len()], &mut drawn);
    drawn
}

/// Particles at random in a cube.
fn start(of: &Composition) -> Result<Result<State, NoPiece>, RunError> {
    let fluid = of.model.at(of.kt)?;
    let total: f64 = of.densities.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return Ok(Err(NoPiece::Empty));
    }
    let dimensions = fluid.dimensions;
    let volume = (PARTICLES / total).max((EDGE * fluid.cutoff()).powi(dimensions as i32));
    if volume * total > MOST {
        return Ok(Err(NoPiece::Large));
    }
    // Of one species the density is exact.
    let volume = (volume * total).round() / total;
    let length = volume.powf(1.0 / dimensions as f64);
    let lengths = [length, length, if dimensions == 2 { 1.0 } else { length }];
    let Ok(domain) = PeriodicBox::orthogonal([0.0; 3], lengths, [true, true, dimensions == 3]) else {
        return Ok(Err(NoPiece::Large));
    };
    let species: Vec<i32> = (0..)
        .zip(of.densities)
        .flat_map(|(s, rho)| std::iter::repeat_n(s, (rho * volume).round() as usize))
        .collect();
    let tags: Vec<u32> = (1..=species.len() as u32).collect();
    let mut x = vec![[0.0; 3]; species.len()];
    for c in 0..dimensions {
        for (x, place) in x.iter_mut().zip(gaussian_or_uniform(of, &tags, c as u32, Law::Uniform)) {
            x[c] = lengths[c] * (0.5 + f64::from(place) / 12f64.sqrt());
        }
    }
    Ok(Ok(State { species, ..State::at_rest(domain, of.masses.to_vec(), x) }))
}

/// Velocities of Maxwell's distribution without momentum in sum.
fn draw_velocities(state: &mut State, of: &Composition, number: u32) {
    let dimensions = of.model.dimensions();
    let tags: Vec<u32> = state.tag.iter().map(|tag| *tag as u32).collect();
    for c in 0..dimensions {
        let (mut momentum, mut mass) = (0.0, 0.0);
        let speeds = gaussian_or_uniform(of, &tags, number + c as u32, Law::Gaussian);
        for (k, speed) in speeds.into_iter().enumerate() {
            let m = state.mass[state.species[k] as usize];
            state.v[k][c] = f64::from(speed) * (of.kt / m).sqrt();
            momentum += m * state.v[k][c];
            mass += m;
        }
        state.v.iter_mut().for_each(|v| v[c] -= momentum / mass);
    }
}
