//! Steps on the CPU with the engine of psidpd-core in mixed precision.

use psidpd_core::engine::noise::Law;
use psidpd_core::engine::thermostat::{Bodies, PairThermostat, Stream, Update};
use psidpd_core::engine::{self, Engine, Pool, Precision, Request, Step, Tally, Want};
use psidpd_core::model::Fluid;
use psidpd_gpu::{FROZEN, Particles, Rule, Settings, body_force_mark};

pub struct Cpu {
    settings: Settings,
    pub particles: Particles,
    engine: Engine,
    thermostat: Option<PairThermostat>,
    pub tally: Tally,
    number: u64,
    dimensions: usize,
}

impl Cpu {
    pub fn new(fluid: &Fluid, settings: Settings, particles: &Particles, number: u64) -> Cpu {
        let of_engine = engine::Settings { precision: Precision::Mixed, ..Default::default() };
        let engine = Engine::new(fluid, of_engine).unwrap();
        let thermostat =
            PairThermostat::new(engine.plan(), fluid.kt, &of_engine).filter(|_| settings.thermostat);
        let particles = Particles { force: vec![[0.0; 3]; particles.x.len()], ..particles.clone() };
        Cpu {
            settings,
            particles,
            engine,
            thermostat,
            tally: Tally::default(),
            number,
            dimensions: fluid.dimensions,
        }
    }

    pub fn forces(&mut self, dt: f64, drag: bool) {
        let Particles { x, v, force, species, tag, marks, .. } = &mut self.particles;
        let of = engine::Particles { owned: x.len(), x, tag, kind: species };
        let step = Step { seed: self.settings.seed, number: self.number, dt };
        let step = (drag && self.thermostat.is_some()).then_some(step);
        let request = Request { particles: of, v, step, want: Want::TOTALS };
        self.tally = self.engine.forces(&self.settings.domain, &request, force, false).unwrap();
        for k in 0..x.len() {
            for (b, body) in self.settings.body_forces.iter().enumerate() {
                if marks[k] & body_force_mark(b) != 0 {
                    let upper = |c: usize| self.settings.domain.fraction(x[k])[c] >= 0.5;
                    let sign = if body.reversed_along.is_some_and(upper) { -1.0 } else { 1.0 };
                    let mass = self.settings.mass[species[k] as usize];
                    (0..3).for_each(|c| force[k][c] += sign * mass * body.acceleration[c]);
                }
            }
            if marks[k] & FROZEN != 0 {
                force[k] = [0.0; 3];
            }
        }
    }

    fn kick(&mut self, h: f64) {
        let Particles { v, force, species, .. } = &mut self.particles;
        for ((v, f), s) in v.iter_mut().zip(force).zip(species) {
            (0..3).for_each(|c| v[c] += h / self.settings.mass[*s as usize] * f[c]);
        }
    }

    fn drift(&mut self, dt: f64) {
        let Particles { x, v, image, .. } = &mut self.particles;
        let domain = &self.settings.domain;
        for ((x, v), image) in x.iter_mut().zip(v).zip(image) {
            (0..3).for_each(|c| x[c] += dt * v[c]);
            for k in (0..self.dimensions).filter(|k| !domain.periodic()[*k]) {
                let (low, high) = (domain.origin()[k], domain.origin()[k] + domain.lengths()[k]);
                if x[k] < low || x[k] > high {
                    x[k] = if x[k] < low { 2.0 * low - x[k] } else { 2.0 * high - x[k] };
                    v[k] = -v[k];
                }
            }
            domain.wrap(x, image);
        }
    }

    pub fn step(&mut self, dt: f64, rule: Rule) {
        self.number += 1;
        match rule {
            Rule::VelocityVerlet => {
                self.kick(0.5 * dt);
                self.drift(dt);
                self.forces(dt, true);
                self.kick(0.5 * dt);
            }
            Rule::TwoStage { lambda, gradient, every } => {
                self.kick(lambda * dt);
                self.drift(0.5 * dt);
                self.forces(dt, false);
                if gradient != 0.0 {
                    let Particles { x, v, image, .. } = self.particles.clone();
                    self.particles.v.fill([0.0; 3]);
                    self.kick(gradient * dt * dt);
                    self.drift(1.0);
                    self.forces(dt, false);
                    self.particles = Particles { x, v, image, ..self.particles.clone() };
                }
                self.kick((1.0 - 2.0 * lambda) * dt);
                self.drift(0.5 * dt);
                self.forces(dt, false);
                self.kick(lambda * dt);
                if self.number.is_multiple_of(every) {
                    self.heat(dt, every as f64 * dt);
                }
            }
        }
    }

    fn heat(&mut self, dt: f64, time: f64) {
        let Some(thermostat) = &mut self.thermostat else { return };
        let Particles { x, v, species, tag, marks, .. } = &mut self.particles;
        let frozen: Vec<bool> = marks.iter().map(|m| m & FROZEN != 0).collect();
        let pool = Pool::new(std::num::NonZeroUsize::MIN);
        let Settings { domain, mass, seed, .. } = &self.settings;
        let bodies = Bodies { domain, x, tag, species, mass, frozen: &frozen };
        thermostat.find_pairs(&pool, &bodies, time, true).unwrap();
        thermostat.draw(&pool, *seed, self.number, Stream(0), Law::Gaussian);
        let virial = thermostat.act(&pool, Update::Midpoint, v);
        (0..6).for_each(|k| self.tally.thermostat_virial[k] += virial[k] * time / dt);
    }

    pub fn iterations(&self) -> u64 {
        self.thermostat.as_ref().map_or(0, |t| t.effort().iterations)
    }
}
