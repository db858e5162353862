//! The pairs that an evaluation of forces lists on its way, where the thermostat acts at the same positions.
//!
//! A host asks for them before the evaluation, and lets the thermostat find its pairs with the engine, which hands them out once as
//! [`ListedPairs`]: a loan that a thermostat of the same plan takes for the same time at the same positions, and no other. So a host
//! may always ask and always try: where the loan does not fit, or the evaluation could list nothing, for it was no sweep, had drag and
//! noise among its forces or excluded pairs, the thermostat searches. Listed particles of a cell are in the order of the host's
//! arrays, instead of that of their tags.

use super::{Bodies, PairThermostat, Rank, Update};
use crate::engine::error::EngineError;
use crate::engine::facade::Engine;
use crate::engine::plan::Plan;
use crate::engine::sweep::{ListedFor, ListedPairs};
use std::sync::Arc;

impl PairThermostat {
    /// Asks the next evaluation of `engine` to list the pairs for a time `dt`, if it can: if it computes the same fluid.
    pub fn ask(&mut self, engine: &mut Engine, dt: f64) {
        if !self.is_of(engine.plan()) {
            return;
        }
        let terms = self.terms(dt);
        let sweep = engine.sweep_mut();
        sweep.ask_for_pairs(Some((terms, ListedFor { plan: self.plan.clone(), dt })));
        // The memory of lists goes to and fro, so that there is one list of all pairs, not two.
        if self.are_of_forces {
            self.has_pairs = false;
            sweep.lend_lists(&mut self.planes);
        }
    }

    /// Whether a plan has the tables that the thermostat has.
    fn is_of(&self, plan: &Plan) -> bool {
        plan.dimensions() == self.dimensions && plan.thermostat.as_ref() == Some(&self.plan)
    }

    /// As [`PairThermostat::find_pairs`], by the threads of `engine`; the pairs are those that its last evaluation has listed, if it has
    /// been asked to for this time and was at these positions.
    ///
    /// # Errors
    /// Fails as [`PairThermostat::find_pairs`].
    pub fn find_pairs_with(
        &mut self,
        engine: &mut Engine,
        bodies: &Bodies,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        let pool = Arc::clone(engine.pool());
        self.find_pairs_among(engine.sweep_mut().listed_pairs(), &pool, bodies, dt, virial)
    }

    /// As [`PairThermostat::find_pairs_of_rank`], with the pairs of `engine` as [`PairThermostat::find_pairs_with`].
    ///
    /// # Errors
    /// Fails as [`PairThermostat::find_pairs_of_rank`].
    pub fn find_pairs_of_rank_with(
        &mut self,
        engine: &mut Engine,
        rank: &Rank,
        dt: f64,
        virial: bool,
    ) -> Result<(), EngineError> {
        let pool = Arc::clone(engine.pool());
        self.find_pairs_of_rank_among(engine.sweep_mut().listed_pairs(), &pool, rank, dt, virial)
    }

    /// As [`PairThermostat::act`], by the threads of `engine`, and in memory that only its evaluations need.
    pub fn act_with(&mut self, engine: &mut Engine, update: Update, v: &mut [[f64; 3]]) -> [f64; 6] {
        let pool = Arc::clone(engine.pool());
        self.exchange_memory(engine);
        let virial = self.act(&pool, update, v);
        self.exchange_memory(engine);
        virial
    }

    fn exchange_memory(&mut self, engine: &mut Engine) {
        engine.sweep_mut().exchange_memory([&mut self.sums.all, &mut self.solution.change]);
    }

    /// Takes listed pairs, if they are those of this thermostat for a time `dt` between particles at `x`.
    pub(super) fn take(&mut self, listed: Option<ListedPairs>, x: &[[f64; 3]], dt: f64) {
        let listed = listed.filter(|listed| listed.serve(&self.plan, dt, x));
        self.are_of_forces = listed.is_some();
        if let Some(listed) = listed {
            listed.give(&mut self.lists, &mut self.planes);
        }
    }
}
