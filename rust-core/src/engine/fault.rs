//! Deliberate faults, for tests that a check of results can fail.
//!
//! Production code knows nothing of them but the one call where a sweep is made: [`Fault::during`] holds for the thread that calls it.

use psidpd_passes::ground::species_pairs::SpeciesPairTable;
use psidpd_passes::ground::terms::Terms;
use psidpd_passes::simd::Scalar;
use psidpd_passes::tally::Tally;
use std::cell::Cell;

/// A term of the sweep that is 5 % too strong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Forces of soft pair potentials.
    PairForce,
    /// Many-body forces, which derive from ψ.
    ManyBodyForce,
    /// Drag coefficient γ of the forces.
    Drag,
    /// Noise amplitude σ of the forces.
    Noise,
    /// The virial of all forces.
    Virial,
}

const FACTOR: f64 = 1.05;

thread_local! {
    static PRESENT: Cell<Option<Fault>> = const { Cell::new(None) };
}

impl Fault {
    /// The list of all faults.
    pub const ALL: [Fault; 5] =
        [Fault::PairForce, Fault::ManyBodyForce, Fault::Drag, Fault::Noise, Fault::Virial];

    /// Does `work` while engines that this thread makes have a fault, or none.
    #[doc(hidden)]
    pub fn during<T>(fault: Option<Fault>, work: impl FnOnce() -> T) -> T {
        struct Before(Option<Fault>);
        impl Drop for Before {
            fn drop(&mut self) {
                PRESENT.set(self.0);
            }
        }
        let _before = Before(PRESENT.replace(fault));
        work()
    }

    /// The fault of engines that this thread makes, to hand on to others.
    #[doc(hidden)]
    pub fn present() -> Option<Fault> {
        PRESENT.get()
    }

    /// Makes the terms of a sweep wrong.
    pub(super) fn spoil<T: Scalar>(self, terms: &mut Terms<T>) {
        let strengthen = |value: &mut T| *value = T::of(FACTOR * value.wide());
        let all =
            |table: &mut SpeciesPairTable<T>| (0..table.count()).for_each(|k| strengthen(&mut table[k]));
        match self {
            Fault::PairForce => terms.soft.iter_mut().for_each(|soft| all(&mut soft.strength)),
            Fault::ManyBodyForce => {
                terms.passes.iter_mut().for_each(|pass| strengthen(&mut pass.force));
                terms.linear.iter_mut().for_each(|linear| all(&mut linear.force));
            }
            Fault::Drag => terms.thermostat.iter_mut().for_each(|tables| all(&mut tables.gamma)),
            Fault::Noise => terms.thermostat.iter_mut().for_each(|tables| all(&mut tables.sigma)),
            Fault::Virial => {}
        }
    }

    /// Makes the virials of a sweep wrong.
    pub(super) fn spoil_virial(self, tally: &mut Tally) {
        if self == Fault::Virial {
            tally
                .virial
                .iter_mut()
                .chain(&mut tally.thermostat_virial)
                .chain(&mut tally.drag_virial)
                .for_each(|w| *w *= FACTOR);
        }
    }
}
