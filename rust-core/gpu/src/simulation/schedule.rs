//! The kernels of each step, in their order.

use super::GpuSimulation;
use crate::Rule;
use crate::kernels::{Arguments, DEFERRED, NOISE, Run, groups_of};
use psidpd_core::engine::noise::PairNoise;

/// Tolerance of conjugate gradients and least tolerance, as on the CPU; single precision ends before its `FINEST` of 10⁻⁷.
const TOLERANCE: f32 = 2e-2;
const FINEST: f32 = 3e-5;

/// Runs of kernels, each with its number.
pub(super) struct Runs<'a> {
    list: Vec<Run>,
    side: &'a mut usize,
    sequence: &'a mut u32,
    groups: u32,
    scans: u32,
    passes: bool,
}

impl Runs<'_> {
    pub(super) fn push(&mut self, kernel: &'static str, totals: bool, groups: u32, arguments: Arguments) {
        *self.sequence += 1;
        let arguments = Arguments { sequence: *self.sequence, ..arguments };
        self.list.push(Run { kernel, totals, side: *self.side, groups, arguments });
    }

    pub(super) fn all(&mut self, kernel: &'static str, numbers: [f32; 4], flags: u32) {
        self.push(kernel, false, self.groups, Arguments { numbers, flags, ..Arguments::default() });
    }

    /// Puts the particles, which are counted, into the order of cells.
    pub(super) fn sort(&mut self) {
        let arguments = Arguments::default();
        self.push("scan_cells", false, self.scans, arguments);
        self.push("scan_sums", false, 1, arguments);
        self.push("list_cells", false, self.groups, arguments);
        self.push("sort", false, self.groups, arguments);
        *self.side = 1 - *self.side;
    }

    pub(super) fn densities(&mut self, totals: bool) {
        if self.passes || totals {
            self.push("densities", totals, self.groups, Arguments::default());
        }
    }

    pub(super) fn forces(&mut self, totals: bool, noise: Option<(f32, [u32; 2])>) {
        self.densities(totals);
        self.pair_forces(totals, noise);
    }

    pub(super) fn pair_forces(&mut self, totals: bool, noise: Option<(f32, [u32; 2])>) {
        let (a, key) = noise.unwrap_or_default();
        let flags = if noise.is_some() { NOISE } else { 0 };
        self.push(
            "forces",
            totals,
            self.groups,
            Arguments { numbers: [a, 0.0, 0.0, 0.0], key, flags, ..Default::default() },
        );
    }
}

impl GpuSimulation {
    /// The kernels of one step; `begins` without a deferred kick, and `ends` with all kicks made.
    pub(super) fn step(
        &mut self,
        number: u64,
        dt: f64,
        rule: Rule,
        totals: bool,
        begins: bool,
        ends: bool,
    ) -> Vec<Run> {
        let noise = self.noise_of(rule, dt, number);
        let (heats_before, heats) = (self.heats_at(rule, number - 1), self.heats_at(rule, number));
        let heat = self.heat_of(rule, dt, number, totals);
        let iterations = self.iterations;
        let deferred = if begins || heats_before { 0 } else { DEFERRED };
        let single = |x: f64| x as f32;
        self.record(|runs| match rule {
            Rule::VelocityVerlet => {
                let half = single(0.5 * dt);
                runs.all("kick_drift", [half, single(dt), half, 0.0], deferred);
                runs.sort();
                runs.forces(totals, noise);
                if ends {
                    runs.all("kick", [single(0.5 * dt), 0.0, 0.0, 0.0], 0);
                }
            }
            Rule::TwoStage { lambda, gradient, .. } => {
                // The shares of the held kick that the velocities have, and where that puts the middle of the step.
                let half = single(0.5 * dt);
                let shift = single((0.5 * lambda - 0.125) * dt * dt);
                let kicked = [lambda, 0.5 - lambda].map(|share| single(share * dt));
                runs.all("kick_drift", [kicked[0], half, kicked[0], 0.0], deferred);
                runs.sort();
                runs.forces(false, None);
                if gradient != 0.0 {
                    runs.all("displace", [single(gradient * dt * dt), 0.0, 0.0, 0.0], 0);
                    runs.sort();
                    runs.forces(false, None);
                    runs.all("step_back", [0.0; 4], 0);
                }
                let kick = single((1.0 - 2.0 * lambda) * dt);
                runs.all("kick_drift", [kick, half, kicked[1], shift], 0);
                runs.sort();
                runs.forces(totals, None);
                if ends || heats {
                    runs.all("kick", [single(lambda * dt), 0.0, 0.0, 0.0], 0);
                }
                if heats {
                    runs.push("heat_start", false, runs.groups, heat.arguments);
                    heat.iterate(runs, iterations);
                }
            }
        })
    }

    /// The factor and the key of noise in the forces.
    pub(super) fn noise_of(&self, rule: Rule, dt: f64, number: u64) -> Option<(f32, [u32; 2])> {
        (rule == Rule::VelocityVerlet).then(|| self.noise(self.settings.seed, dt, number)).flatten()
    }

    pub(super) fn noise(&self, seed: u64, dt: f64, number: u64) -> Option<(f32, [u32; 2])> {
        let key = PairNoise::new(seed, number).key();
        self.has_drag().then(|| ((2.0 * self.fluid.kt / dt).sqrt() as f32, key))
    }

    pub(super) fn has_drag(&self) -> bool {
        self.settings.thermostat && self.fluid.thermostats.iter().flatten().any(|law| law.gamma > 0.0)
    }

    /// Whether the implicit thermostat acts in steps by this rule.
    pub(super) fn heats(&self, rule: Rule) -> bool {
        matches!(rule, Rule::TwoStage { .. }) && self.has_drag()
    }

    pub(super) fn heats_at(&self, rule: Rule, number: u64) -> bool {
        matches!(rule, Rule::TwoStage { every, .. } if number.is_multiple_of(every)) && self.heats(rule)
    }

    pub(super) fn heat_of(&self, rule: Rule, dt: f64, number: u64, virial: bool) -> Heat {
        let time = match rule {
            Rule::TwoStage { every, .. } => dt * every as f64,
            Rule::VelocityVerlet => dt,
        };
        let numbers = [(0.5 * time).sqrt() as f32, self.fluid.kt.sqrt() as f32, TOLERANCE, FINEST];
        let key = PairNoise::of_stream(self.settings.seed, number, 1).key();
        let of_virial = [numbers[0], numbers[1], (2.0 / dt) as f32, 0.0];
        Heat {
            arguments: Arguments { numbers, key, ..Arguments::default() },
            of_virial: virial.then_some(Arguments { numbers: of_virial, key, ..Arguments::default() }),
        }
    }

    pub(super) fn record(&mut self, work: impl FnOnce(&mut Runs)) -> Vec<Run> {
        let scans = self.arrays.as_ref().map_or(0, |arrays| arrays.scans);
        let passes = self.kernels.shader().variables > 0;
        let groups = groups_of(self.count);
        let mut runs = Runs {
            list: Vec::new(),
            side: &mut self.side,
            sequence: &mut self.sequence,
            groups,
            scans,
            passes,
        };
        work(&mut runs);
        runs.list
    }
}

/// The arguments of the implicit thermostat's kernels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heat {
    arguments: Arguments,
    of_virial: Option<Arguments>,
}

impl Heat {
    pub(super) fn iterate(&self, runs: &mut Runs, iterations: u32) {
        for _ in 0..iterations {
            runs.push("heat_image", false, runs.groups, self.arguments);
            runs.push("heat_decide", false, 1, self.arguments);
            runs.push("heat_advance", false, runs.groups, self.arguments);
            runs.push("heat_judge", false, 1, self.arguments);
            runs.push("heat_turn", false, runs.groups, self.arguments);
        }
        if let Some(arguments) = self.of_virial {
            runs.push("heat_virial", false, runs.groups, arguments);
        }
        runs.push("heat_apply", false, runs.groups, self.arguments);
    }
}
