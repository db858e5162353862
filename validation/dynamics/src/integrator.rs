//! Integrators by name, with their keys and what is known of each. The steps themselves are in `run/integrator/`.
//!
//! Scene files, `about.json` and the export to LAMMPS take names and keys from here.

use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::Update;
use std::fmt;

#[cfg(test)]
mod tests;

/// λ in the paper of Groot and Warren.
const GROOT_WARREN: f64 = 0.65;
/// λ of the two-stage splitting with small errors of averages in liquids of many-body DPD.
const TWO_STAGE: f64 = 0.21;

/// λ and ξ of the force-gradient step. It is of fourth order with λ = 1/6; a little more makes up for the kinks of forces at their
/// range, so that averages in liquids err less at the steps that are of use (`docs/force-gradient.md`).
const FORCE_GRADIENT: [f64; 2] = [0.17, 1.0 / 24.0];

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Integrator {
    /// Velocity Verlet, as `fix nve` of LAMMPS: drag sees the half-step velocity.
    #[default]
    VelocityVerlet,
    /// The modified velocity Verlet of Groot and Warren: drag sees the velocity predicted with λ.
    GrootWarren { lambda: f64 },
    /// Drag once more from the velocity at the end of the step.
    DpdVv { noise: Law },
    /// Drag from the velocity at the end of the step, which it makes.
    SelfConsistent { noise: Law },
    /// Pair by pair, half explicit and half implicit; then velocity Verlet.
    ShardlowS1 { noise: Law },
    /// [`Integrator::ShardlowS1`] by halves: pairs for half a step before velocity Verlet, and for half a step after it.
    ShardlowS2 { noise: Law },
    /// Velocity Verlet, then the Ornstein–Uhlenbeck process of each pair.
    Peters { noise: Law },
    /// Velocity Verlet, then new relative velocities for some pairs.
    LoweAndersen,
    /// Drift, kick, thermostat, kick, drift.
    Aboba(Coupling),
    /// Kick, drift, thermostat, drift, kick.
    Baoab(Coupling),
    /// Two kicks and a half in a step, then the thermostat.
    TwoStage {
        /// Share of a step in the first kick and in the last.
        lambda: f64,
        coupling: Coupling,
    },
    /// Two-stage steps whose middle kick is by forces at displaced positions.
    ForceGradient {
        /// Share of a step in the first kick and in the last.
        lambda: f64,
        /// ξ: the displacement is `ξ Δt² F/m`.
        gradient: f64,
        coupling: Coupling,
    },
    /// Metropolis Monte Carlo: trial moves of single particles, no time.
    MonteCarlo {
        /// Sweeps of a step; a sweep has one trial for each particle that moves.
        sweeps: u64,
        /// The furthest that a trial goes along each direction; found while the run settles if left out.
        max_move: Option<f64>,
    },
}

/// Which thermostat a splitting has, and how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    pub update: Update,
    /// It acts at every so many steps, for as many Δt.
    pub every: u64,
    pub noise: Law,
}

pub const THERMOSTAT_STEPS: [(&str, Update); 2] =
    [("midpoint", Update::Midpoint), ("pairwise", Update::OrnsteinUhlenbeck)];

impl Coupling {
    /// The midpoint rule at every step.
    pub const DEFAULT: Coupling = Coupling { update: Update::Midpoint, every: 1, noise: Law::Gaussian };

    pub fn name(&self) -> &'static str {
        THERMOSTAT_STEPS.iter().find(|(_, update)| *update == self.update).map_or("", |found| found.0)
    }
}

/// What is known of an integrator's errors, for estimates; `docs/integrators.md` has the runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// The relative error of the temperatures: `a`, `b` and `c` of the largest of `a (ΩΔt)²`, `b κΔt` and `c νΔt`.
    pub temperature: [f64; 3],
    /// The error of the pressure of the momentum flux, in ρkT: `a` and `b` of `a (ΩΔt)² + b κΔt`.
    pub pressure: [f64; 2],
}

/// How fast a fluid is, in units of one over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// The root mean square frequency Ω of the forces, of ∇²U.
    pub frequency: f64,
    /// The rate κ at which drag takes kinetic energy.
    pub drag: f64,
    /// The rate ν at which particles cross the range of the forces, by [`crossing`].
    pub crossing: f64,
}

/// The rate ν at which particles of the least of `masses` cross a range: `√(kT/m)` over it, or 0 where it is 0.
pub fn crossing(kt: f64, masses: &[f64], range: f64) -> f64 {
    let lightest = masses.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    if range > 0.0 { (kt / lightest).sqrt() / range } else { 0.0 }
}

impl Accuracy {
    /// Nothing that short steps would show.
    const EXACT: Accuracy = Accuracy { temperature: [0.0; 3], pressure: [0.0; 2] };

    /// Errors at a step of `dt`: of the temperatures, and in ρkT of the carried pressure.
    pub fn errors(&self, dt: f64, rates: Rates) -> [f64; 2] {
        let Accuracy { temperature: [stiff, dragged, crossed], pressure: [second, first] } = self;
        let (square, lost) = ((rates.frequency * dt).powi(2), rates.drag * dt);
        let temperature = (stiff * square).max(dragged * lost).max(crossed * rates.crossing * dt);
        [temperature, second * square + first * lost]
    }
}

/// What LAMMPS has for an integrator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counterpart {
    Nve,
    /// `fix dpd/splitting` of the plugin.
    Splitting,
    None,
}

pub struct Settings<'a> {
    /// λ, and the range that is allowed.
    pub lambda: Option<(&'a mut f64, [f64; 2])>,
    pub gradient: Option<&'a mut f64>,
    /// The thermostat of a splitting, with the law of its noise.
    pub coupling: Option<&'a mut Coupling>,
    /// The law of the noise, where the thermostat is no choice.
    pub noise: Option<&'a mut Law>,
    /// Sweeps of a step and the furthest move.
    pub trials: Option<(&'a mut u64, &'a mut Option<f64>)>,
}

/// What is known of an integrator apart from its step.
#[derive(Debug, Clone, Copy)]
pub struct Properties {
    pub accuracy: Accuracy,
    pub lammps: Counterpart,
    /// Whether drag and noise act inside the forces.
    pub drag_in_forces: bool,
    /// Evaluations of forces in a step.
    pub evaluations: u64,
    /// For which part of a step each of its evaluations of forces acts, on average.
    pub force_shares: [f64; 2],
    /// Whether the last forces of a step are those at its end.
    pub forces_at_end: bool,
}

impl Integrator {
    /// Names in scene files, and what they mean with all other keys left out.
    pub const NAMED: [(&str, Integrator); 13] = [
        ("velocity-verlet", Integrator::VelocityVerlet),
        ("groot-warren", Integrator::GrootWarren { lambda: GROOT_WARREN }),
        ("dpd-vv", Integrator::DpdVv { noise: Law::Gaussian }),
        ("self-consistent", Integrator::SelfConsistent { noise: Law::Gaussian }),
        ("shardlow-s1", Integrator::ShardlowS1 { noise: Law::Gaussian }),
        ("shardlow-s2", Integrator::ShardlowS2 { noise: Law::Gaussian }),
        ("peters", Integrator::Peters { noise: Law::Gaussian }),
        ("lowe-andersen", Integrator::LoweAndersen),
        ("aboba", Integrator::Aboba(Coupling::DEFAULT)),
        ("baoab", Integrator::Baoab(Coupling::DEFAULT)),
        ("two-stage", Integrator::TwoStage { lambda: TWO_STAGE, coupling: Coupling::DEFAULT }),
        (
            "force-gradient",
            Integrator::ForceGradient {
                lambda: FORCE_GRADIENT[0],
                gradient: FORCE_GRADIENT[1],
                coupling: Coupling::DEFAULT,
            },
        ),
        ("monte-carlo", Integrator::MonteCarlo { sweeps: 1, max_move: None }),
    ];

    /// The integrators with a time step.
    pub const ALL: [(&str, Integrator); 12] = {
        let [timed @ .., _] = Integrator::NAMED;
        timed
    };

    pub fn name(&self) -> &'static str {
        let kind = std::mem::discriminant(self);
        Integrator::NAMED
            .iter()
            .find(|(_, other)| std::mem::discriminant(other) == kind)
            .map_or("", |found| found.0)
    }

    /// The settings that a scene may give.
    pub fn settings(&mut self) -> Settings<'_> {
        let none = Settings { lambda: None, gradient: None, coupling: None, noise: None, trials: None };
        match self {
            Integrator::VelocityVerlet | Integrator::LoweAndersen => none,
            Integrator::GrootWarren { lambda } => Settings { lambda: Some((lambda, [0.0, 1.0])), ..none },
            Integrator::DpdVv { noise }
            | Integrator::SelfConsistent { noise }
            | Integrator::ShardlowS1 { noise }
            | Integrator::ShardlowS2 { noise }
            | Integrator::Peters { noise } => Settings { noise: Some(noise), ..none },
            Integrator::Aboba(coupling) | Integrator::Baoab(coupling) => {
                Settings { coupling: Some(coupling), ..none }
            }
            Integrator::TwoStage { lambda, coupling } => {
                Settings { lambda: Some((lambda, [0.0, 0.5])), coupling: Some(coupling), ..none }
            }
            Integrator::ForceGradient { lambda, gradient, coupling } => Settings {
                lambda: Some((lambda, [0.0, 0.5])),
                gradient: Some(gradient),
                coupling: Some(coupling),
                ..none
            },
            Integrator::MonteCarlo { sweeps, max_move } => {
                Settings { trials: Some((sweeps, max_move)), ..none }
            }
        }
    }

    /// The law of its noise, if that can be chosen: inside the forces it is uniform.
    pub fn noise(&mut self) -> Option<&mut Law> {
        let Settings { noise, coupling, .. } = self.settings();
        noise.or(coupling.map(|coupling| &mut coupling.noise))
    }

    /// What is known of it. Errors are right within a factor of two in the fluids of `docs/integrators.md`.
    pub fn properties(&self) -> Properties {
        // Drag and noise in the forces, forces at the end of a step.
        let verlet = |temperature, lammps| Properties {
            accuracy: Accuracy { temperature, pressure: [0.5, 0.75] },
            lammps,
            drag_in_forces: true,
            evaluations: 1,
            force_shares: [1.0, 0.0],
            forces_at_end: true,
        };
        // Velocity Verlet with a thermostat apart from the forces, before or behind it.
        let apart = |stiff: f64| Properties {
            accuracy: Accuracy { temperature: [stiff, 0.0, 0.0], pressure: [0.5, 0.0] },
            drag_in_forces: false,
            ..verlet([0.0; 3], Counterpart::None)
        };
        let exact = Properties { accuracy: Accuracy::EXACT, ..apart(0.0) };
        let splitting = |coupling: &Coupling| {
            if coupling.update == Update::Midpoint { Counterpart::Splitting } else { Counterpart::None }
        };
        match self {
            Integrator::VelocityVerlet => verlet([0.65, 0.0, 0.6], Counterpart::Nve),
            Integrator::GrootWarren { lambda } => {
                verlet([0.45, 0.08, 0.0], if *lambda == 0.5 { Counterpart::Nve } else { Counterpart::None })
            }
            Integrator::DpdVv { .. } => verlet([0.65, 0.12, 0.0], Counterpart::None),
            Integrator::SelfConsistent { .. } => verlet([0.65, 0.24, 0.0], Counterpart::None),
            Integrator::ShardlowS1 { .. }
            | Integrator::ShardlowS2 { .. }
            | Integrator::Peters { .. }
            | Integrator::LoweAndersen => apart(0.65),
            Integrator::Baoab(_) => apart(0.3),
            Integrator::Aboba(coupling) => {
                Properties { lammps: splitting(coupling), forces_at_end: false, ..apart(0.3) }
            }
            Integrator::TwoStage { lambda, coupling } => Properties {
                accuracy: Accuracy { temperature: [0.01, 0.0, 0.0], pressure: [0.1, 0.0] },
                lammps: splitting(coupling),
                evaluations: 2,
                force_shares: [1.0 - 2.0 * lambda, 2.0 * lambda],
                ..exact
            },
            Integrator::ForceGradient { lambda, coupling, .. } => Properties {
                lammps: splitting(coupling),
                evaluations: 3,
                force_shares: [1.0 - 2.0 * lambda, 2.0 * lambda],
                ..exact
            },
            Integrator::MonteCarlo { .. } => Properties { forces_at_end: false, ..exact },
        }
    }

    /// How drag and noise act, where they are apart from the forces and may act at every few steps.
    pub fn coupling(mut self) -> Option<Coupling> {
        self.settings().coupling.copied()
    }

    /// At every how many steps drag and noise act.
    pub fn thermostat_every(self) -> u64 {
        self.coupling().map_or(1, |coupling| coupling.every)
    }

    pub fn has_time(&self) -> bool {
        !matches!(self, Integrator::MonteCarlo { .. })
    }
}

/// With all that differs from what its name alone means.
impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name())?;
        let mut this = *self;
        let settings = this.settings();
        if let Some((lambda, _)) = settings.lambda {
            write!(f, ", lambda = {}", six_digits(*lambda))?;
        }
        if let Some(gradient) = settings.gradient.filter(|gradient| **gradient != FORCE_GRADIENT[1]) {
            write!(f, ", gradient = {}", six_digits(*gradient))?;
        }
        if let Some(coupling) = settings.coupling {
            write!(f, ", thermostat_step = {}", coupling.name())?;
            if coupling.every > 1 {
                write!(f, ", thermostat_every = {}", coupling.every)?;
            }
        }
        if let Some((sweeps, max_move)) = settings.trials {
            if *sweeps > 1 {
                write!(f, ", sweeps = {sweeps}")?;
            }
            if let Some(most) = max_move {
                write!(f, ", max_move = {most}")?;
            }
        }
        match this.noise() {
            Some(Law::Uniform) => write!(f, ", noise = uniform"),
            _ => Ok(()),
        }
    }
}

/// A number without more digits than people read.
fn six_digits(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}
