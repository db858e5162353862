//! The pairs that an evaluation of forces lists on its way, where the thermostat acts at the same positions.
//!
//! A host asks for them before the evaluation, and gives them to the thermostat before its search, which then takes
//! them instead. It may do so always: the search finds the pairs itself if the evaluation was of another fluid, no sweep,
//! with drag and noise among the forces or with excluded pairs, or if it was asked for another time. Listed particles of a cell
//! are in the order of the host's arrays, instead of that of their tags.

use super::PairThermostat;
use super::listed::Listed;
use crate::engine::facade::Engine;
use crate::engine::plan::Plan;

impl PairThermostat {
    /// Asks the next evaluation of `engine` to list the pairs for a time `dt`, if it can: if it computes the same fluid.
    pub fn ask(&mut self, engine: &mut Engine, dt: f64, virial: bool) {
        self.from_forces.listed = None;
        if !self.is_of(engine.plan()) {
            return;
        }
        // No search has so many particles: it needs what `take` takes.
        self.from_forces.listed = Some(Listed { dt, virial, particles: usize::MAX });
        let terms = self.terms(dt, virial);
        let sweep = engine.sweep_mut();
        sweep.ask_for_pairs(Some((terms, self.from_forces.asker)));
        // The memory of lists goes to and fro, so that there is one list of all pairs, not two.
        if self.from_forces.are_present {
            self.has_pairs = false;
            sweep.lend_lists(&mut self.planes);
        }
    }

    /// Whether a plan has the tables that the thermostat has.
    fn is_of(&self, plan: &Plan) -> bool {
        plan.dimensions() == self.dimensions && plan.thermostat.as_ref() == Some(&self.plan)
    }

    /// Takes the pairs that the last evaluation of `engine` has listed, if it has, for the search that follows: at the
    /// same positions, with the particles in the same order.
    pub fn take(&mut self, engine: &mut Engine) {
        // Without listed pairs those of the last search stay.
        let had_pairs = std::mem::replace(&mut self.has_pairs, false);
        let asker = self.from_forces.asker;
        let taken = engine.sweep_mut().take_pairs(asker, &mut self.lists, &mut self.planes);
        self.has_pairs = had_pairs && !taken;
        let particles = self.lists.place.len();
        self.from_forces.listed =
            self.from_forces.listed.filter(|_| taken).map(|listed| Listed { particles, ..listed });
    }
}
