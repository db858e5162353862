//! The settings that are compared with each other: integrator × Δt × precision, and threads.

use crate::code::Host;
use psidpd_core::engine::Precision;
use psidpd_dynamics::integrator::{Coupling, Integrator};
use std::num::NonZeroUsize;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Physics {
    pub integrator: Integrator,
    /// Δt in units of [`super::origin::Origin::unit`].
    pub multiple: f64,
    pub precision: Precision,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    pub host: Host,
    pub physics: Physics,
    pub threads: NonZeroUsize,
}

/// Sampling is about every so many of the scene's own time steps.
pub const INTERVAL: u64 = 24;

impl Physics {
    /// Steps from one sample to the next: of every phase of a thermostat that acts at every k-th step, as many. Without time one: it has
    /// its sweeps.
    pub fn interval(&self) -> u64 {
        if !self.integrator.has_time() {
            return 1;
        }
        let every = { self.integrator }.settings().coupling.map_or(1, |coupling| coupling.every);
        let wanted = ((INTERVAL as f64 / self.multiple).round() as u64).max(1);
        (wanted..).find(|steps| greatest_common_divisor(*steps, every) == 1).unwrap_or(wanted)
    }

    /// What all others are compared with that have no time: no time step at all.
    pub fn reference() -> Physics {
        let integrator = Integrator::MonteCarlo { sweeps: SWEEPS, max_move: None };
        Physics { integrator, multiple: 1.0, precision: Precision::Double }
    }

    /// What diffusion and viscosities are compared with, and all where there is no Monte Carlo: as small an error as a few times the
    /// cost of the scene's own step buys.
    pub fn small_steps() -> Physics {
        Physics { integrator: force_gradient(1.0 / 6.0, 1), multiple: 1.0, precision: Precision::Double }
    }
}

/// Sweeps of the reference between samples.
const SWEEPS: u64 = 3;

fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

fn named(name: &str) -> Integrator {
    Integrator::ALL.iter().find(|(known, _)| *known == name).map_or(Integrator::default(), |found| found.1)
}

fn two_stage(every: u64) -> Integrator {
    let mut integrator = named("two-stage");
    if let Some(coupling) = integrator.settings().coupling {
        *coupling = Coupling { every, ..*coupling };
    }
    integrator
}

/// λ that are tried: of fourth order without kinks in the forces, and what wins in liquids with kinks.
const LAMBDAS: [f64; 3] = [1.0 / 6.0, 0.17, 0.173];

fn force_gradient(lambda: f64, every: u64) -> Integrator {
    let mut integrator = named("force-gradient");
    if let Integrator::ForceGradient { lambda: of, coupling, .. } = &mut integrator {
        *of = lambda;
        coupling.every = every;
    }
    integrator
}

/// The steps that may be longest.
pub fn longest() -> Integrator {
    force_gradient(LAMBDAS[1], 2)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    Few,
    /// The integrators that are known to do well, beside velocity Verlet.
    Quick,
    /// All integrators, and both precisions of each.
    Full,
}

/// The steps that are tried, without the references.
pub fn physics(choice: Choice) -> Vec<Physics> {
    let ladder: Vec<(Integrator, &[f64])> = match choice {
        Choice::Few => vec![
            (named("velocity-verlet"), &[1.0, 4.0]),
            (two_stage(1), &[2.0]),
            (force_gradient(LAMBDAS[0], 1), &[4.0]),
        ],
        Choice::Quick => {
            let mut all: Vec<(Integrator, &[f64])> = vec![
                (named("velocity-verlet"), &[0.25, 0.5, 1.0, 2.0]),
                (named("groot-warren"), &[1.0, 2.0]),
                (named("shardlow-s1"), &[2.0]),
                (named("aboba"), &[2.0]),
                (two_stage(1), &[2.0, 4.0, 6.0]),
                (two_stage(2), &[4.0, 6.0]),
                (force_gradient(LAMBDAS[0], 1), &[4.0]),
            ];
            all.extend(LAMBDAS.map(|lambda| (force_gradient(lambda, 2), &[5.0, 6.0, 7.0, 8.0][..])));
            all
        }
        Choice::Full => {
            let several = |name: &str| matches!(name, "two-stage" | "force-gradient");
            let mut all: Vec<(Integrator, &[f64])> = Integrator::ALL
                .iter()
                .filter(|(name, _)| !several(name))
                .map(|(_, it)| (*it, &[0.25, 0.5, 1.0, 2.0, 4.0][..]))
                .collect();
            all.extend([1, 2, 4].map(|every| (two_stage(every), &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0][..])));
            let each = LAMBDAS.iter().flat_map(|l| [1, 2, 4].map(|every| force_gradient(*l, every)));
            all.extend(each.map(|integrator| (integrator, &[4.0, 5.0, 6.0, 7.0, 8.0, 10.0][..])));
            all
        }
    };
    let precisions: &[Precision] = match choice {
        Choice::Full => &[Precision::Mixed, Precision::Double],
        _ => &[Precision::Mixed],
    };
    let mut found = Vec::new();
    for (integrator, multiples) in ladder {
        for &multiple in multiples {
            found.extend(precisions.iter().map(|&precision| Physics { integrator, multiple, precision }));
        }
    }
    if choice == Choice::Quick {
        let double = |integrator, multiple| Physics { integrator, multiple, precision: Precision::Double };
        found.extend([double(named("velocity-verlet"), 1.0), double(force_gradient(LAMBDAS[1], 2), 6.0)]);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples are at every phase of a cycle of the thermostat, and about as far apart with all settings.
    #[test]
    fn samples_are_at_all_phases() {
        for choice in [Choice::Few, Choice::Quick, Choice::Full] {
            for p in physics(choice) {
                let every = { p.integrator }.settings().coupling.map_or(1, |coupling| coupling.every);
                let phases: std::collections::BTreeSet<u64> =
                    (1..=every).map(|k| k * p.interval() % every).collect();
                assert_eq!(phases.len() as u64, every, "{p:?}");
                let apart = p.interval() as f64 * p.multiple;
                assert!((18.0..32.0).contains(&apart), "{p:?}: {apart}");
            }
        }
        let names: Vec<_> = physics(Choice::Full).iter().map(|p| p.integrator.name()).collect();
        assert!(Integrator::ALL.iter().all(|(name, _)| names.contains(name)));
    }
}
