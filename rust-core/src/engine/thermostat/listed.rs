//! What an evaluation of forces was asked to list.

use std::sync::atomic::{AtomicU64, Ordering};

/// The pairs of an evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Listed {
    pub dt: f64,
    /// Whether distances are stored.
    pub virial: bool,
    /// Number of the host's particles.
    pub particles: usize,
}

impl Listed {
    /// Whether these pairs are those of `asked`, perhaps with distances beside.
    pub fn serves(self, asked: Listed) -> bool {
        self.dt == asked.dt && self.particles == asked.particles && (self.virial || !asked.virial)
    }
}

/// The pairs of the forces.
#[derive(Debug, Clone, Copy)]
pub struct FromForces {
    /// A number that no other thermostat has.
    pub asker: u64,
    /// The pairs that an engine has listed, for a search that follows.
    pub listed: Option<Listed>,
    /// Whether the present pairs are of the forces.
    pub are_present: bool,
}

impl Default for FromForces {
    fn default() -> FromForces {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        FromForces { asker: NUMBER.fetch_add(1, Ordering::Relaxed), listed: None, are_present: false }
    }
}

impl FromForces {
    /// Takes the listed pairs, once, if they are those that are `asked` for; returns whether they are.
    pub fn serve(&mut self, asked: Listed) -> bool {
        self.are_present = self.listed.take().is_some_and(|there| there.serves(asked));
        self.are_present
    }
}
