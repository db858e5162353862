//! The settings that are held against each other: integrator × Δt × precision, and threads.

use crate::integrator::{Coupling, Integrator};
use psidpd_core::engine::Precision;
use serde::Serialize;
use std::num::NonZeroUsize;

/// What errors depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Physics {
    /// How a step is made.
    pub integrator: Integrator,
    /// Δt in units of the scene's own.
    pub multiple: f64,
    /// In what pairs are computed.
    pub precision: Precision,
}

/// Who makes the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Host {
    /// The native runner.
    Native,
    /// `dpd/psi` in LAMMPS, which takes the same steps.
    Plugin,
    /// LAMMPS's own style for the fluid.
    Lammps,
}

/// What cost depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Who.
    pub host: Host,
    /// Which steps.
    pub physics: Physics,
    /// Threads.
    pub threads: NonZeroUsize,
}

/// Sampling is every so many of the scene's own time steps: a whole number of steps for all multiples here.
pub const INTERVAL: u64 = 24;

impl Physics {
    /// Steps from one sample to the next.
    pub fn interval(&self) -> u64 {
        (INTERVAL as f64 / self.multiple).round() as u64
    }

    /// What all others are held against: as small an error as a few times the cost of the scene's own step buys.
    pub fn reference() -> Physics {
        Physics { integrator: two_stage(1), multiple: 0.5, precision: Precision::Double }
    }
}

fn named(name: &str) -> Integrator {
    Integrator::ALL.iter().find(|(known, _)| *known == name).map_or(Integrator::default(), |found| found.1)
}

fn two_stage(every: u64) -> Integrator {
    let mut integrator = named("two-stage");
    if let Some(coupling) = integrator.coupling() {
        *coupling = Coupling { every, ..*coupling };
    }
    integrator
}

/// Which settings are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// Two, for tests.
    Few,
    /// Those that are known to do well, beside velocity Verlet.
    Quick,
    /// All integrators, and both precisions of each.
    Full,
}

/// The steps that are tried, without the reference.
pub fn physics(choice: Choice) -> Vec<Physics> {
    let ladder: Vec<(Integrator, &[f64])> = match choice {
        Choice::Few => vec![(named("velocity-verlet"), &[1.0, 4.0]), (two_stage(1), &[2.0])],
        Choice::Quick => vec![
            (named("velocity-verlet"), &[0.5, 1.0, 2.0, 3.0]),
            (named("groot-warren"), &[1.0, 2.0]),
            (named("dpd-vv"), &[1.0, 2.0]),
            (named("shardlow-s1"), &[1.0, 2.0]),
            (named("aboba"), &[1.0, 2.0, 3.0]),
            (named("baoab"), &[1.0, 2.0]),
            (two_stage(1), &[2.0, 4.0, 6.0, 8.0]),
            (two_stage(2), &[2.0, 4.0, 6.0]),
        ],
        Choice::Full => {
            let several = |name: &str| matches!(name, "two-stage");
            let mut all: Vec<(Integrator, &[f64])> = Integrator::ALL
                .iter()
                .filter(|(name, _)| !several(name))
                .map(|(_, it)| (*it, &[0.5, 1.0, 2.0, 3.0, 4.0][..]))
                .collect();
            all.extend([1, 2, 4].map(|every| (two_stage(every), &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0][..])));
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
        found.extend([double(named("velocity-verlet"), 1.0), double(two_stage(1), 4.0)]);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of all settings must be at the same times.
    #[test]
    fn intervals_are_whole_numbers_of_steps() {
        for choice in [Choice::Few, Choice::Quick, Choice::Full] {
            let mut all = physics(choice);
            all.push(Physics::reference());
            for p in all {
                assert_eq!(p.interval() as f64 * p.multiple, INTERVAL as f64, "{p:?}");
            }
        }
        let names: Vec<_> = physics(Choice::Full).iter().map(|p| p.integrator.name()).collect();
        assert!(Integrator::ALL.iter().all(|(name, _)| names.contains(name)));
        assert_eq!(named("aboba").name(), "aboba");
    }
}
