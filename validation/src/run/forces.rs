//! Forces of one fluid on the particles of a simulation, by the engine that suits what is asked for.

use psidpd_core::engine::{
    Engine, EngineError, Images, Newton, Particles, PassCounts, PeriodicBox, Plan, Pool, Settings, Step,
    Sweep, Tally, Want,
};
use psidpd_core::model::Fluid;
use psidpd_core::model::expression::TooLarge;
use std::sync::Arc;

/// The engines of one fluid.
///
/// The sweep is fast. The plain engine, with images as ghosts, does what the sweep leaves to it: energies and
/// virials of single particles, densities that no force needs, boxes so narrow that a particle meets two
/// images of another.
#[derive(Debug, Clone)]
pub struct Forces {
    dimensions: usize,
    engine: Engine,
    sweep: Sweep,
    images: Images,
    all_densities: bool,
    /// Whether the last evaluation was swept.
    swept: bool,
}

/// The arrays of the particles. Where the plain engine is used they grow by the images.
pub struct Arrays<'a> {
    pub owned: usize,
    pub x: &'a mut Vec<[f64; 3]>,
    pub v: &'a mut Vec<[f64; 3]>,
    pub tag: &'a mut Vec<i32>,
    pub species: &'a mut Vec<i32>,
    pub force: &'a mut Vec<[f64; 3]>,
}

impl Forces {
    /// Engines for a fluid.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn new(fluid: &Fluid, settings: Settings) -> Result<Forces, TooLarge> {
        let pool = Arc::new(Pool::new(settings.threads));
        Forces::with_pool(fluid, settings, pool)
    }

    /// The same, with threads that are there already.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn with_pool(fluid: &Fluid, settings: Settings, pool: Arc<Pool>) -> Result<Forces, TooLarge> {
        let plan = Plan::new(fluid)?;
        Ok(Forces {
            engine: Engine::of_plan(plan.clone()),
            sweep: Sweep::of_plan(plan, settings, pool),
            images: Images::default(),
            all_densities: false,
            swept: false,
            dimensions: fluid.dimensions,
        })
    }

    /// What the sweep was told.
    pub fn settings(&self) -> Settings {
        self.sweep.settings()
    }

    /// The threads.
    pub fn pool(&self) -> &Arc<Pool> {
        self.sweep.pool()
    }

    /// The sweep.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The plan of the fluid.
    pub fn plan(&self) -> &Plan {
        self.engine.plan()
    }

    /// As [`Engine::out_of_bounds`].
    pub fn out_of_bounds(&self) -> [u64; 2] {
        let (a, b) = (self.engine.out_of_bounds(), self.sweep.out_of_bounds());
        [a[0] + b[0], a[1] + b[1]]
    }

    /// How often each pass has run.
    pub fn counts(&self) -> PassCounts {
        self.engine.counts() + self.sweep.counts()
    }

    /// As [`Engine::sum_all_densities`].
    pub fn sum_all_densities(&mut self, all: bool) {
        self.all_densities = all;
        self.engine.sum_all_densities(all);
    }

    /// Densities of the last evaluation with all of them, or of single particles.
    pub fn local_densities(&self) -> &[f64] {
        self.engine.local_densities()
    }

    /// The particles in the order in which the last evaluation swept them, all of them; `None` if it did not, or
    /// failed.
    pub fn order(&self) -> Option<&[u32]> {
        self.swept.then(|| self.sweep.order())
    }

    /// Whether an evaluation that asks for `want` can be swept in `domain`.
    pub fn sweeps(&self, domain: &PeriodicBox, want: Want) -> bool {
        !(self.all_densities || want.of_particles()) && self.sweep.fits(domain)
    }

    /// Writes the forces on all particles to `force`, and returns what was asked for.
    ///
    /// # Errors
    /// As [`Sweep::evaluate`], or [`Engine::densities`] and [`Engine::forces`].
    pub fn compute(
        &mut self,
        domain: &PeriodicBox,
        arrays: Arrays,
        step: Option<Step>,
        want: Want,
    ) -> Result<Tally, EngineError> {
        let Arrays { owned, x, v, tag, species, force } = arrays;
        self.swept = false;
        force.resize(owned, [0.0; 3]);
        if self.sweeps(domain, want) {
            x.truncate(owned);
            tag.truncate(owned);
            species.truncate(owned);
            v.truncate(owned);
            let particles = Particles { owned, x, tag, kind: species };
            let tally = self.sweep.evaluate(domain, &particles, v, step, want, force, false)?;
            self.swept = true;
            return Ok(tally);
        }
        let Forces { engine, images, .. } = self;
        images.build(domain, self.dimensions, engine.plan().cutoff(), owned, x);
        images.forward(1, tag);
        images.forward(1, species);
        if step.is_some() {
            images.forward(1, v);
        }
        let particles = Particles { owned, x, tag, kind: species };
        engine.densities(&particles, Newton::On)?;
        let width = engine.slope_width();
        engine.slopes_mut().truncate(owned * width);
        images.forward(width, engine.slopes_mut());
        force.clear();
        force.resize(x.len(), [0.0; 3]);
        let tally = engine.forces(&particles, v, step, want, force)?;
        images.reverse(force);
        Ok(tally)
    }
}
