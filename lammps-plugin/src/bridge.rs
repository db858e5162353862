//! The style for C++. Errors arrive there as exceptions, panics as errors.

use crate::style::{Style, StyleError};
use psidpd_core::engine::{Step, Want};
use psidpd_core::model::{ForceLaw, WarrenPair};

#[cxx::bridge(namespace = "psidpd")]
mod ffi {
    /// Coefficients of one pair of types, as `pair_coeff` of LAMMPS's `mdpd` takes them.
    #[derive(Clone, Copy)]
    struct Coefficients {
        /// Whether they were given.
        set: bool,
        a: f64,
        b: f64,
        gamma: f64,
        rc: f64,
        rd: f64,
    }

    /// What a step asks for.
    struct Request {
        /// Dissipative and random forces?
        thermostat: bool,
        seed: u64,
        step: u64,
        dt: f64,
        energy: bool,
        virial: bool,
        particle_energy: bool,
        particle_virial: bool,
    }

    /// Energies and the virial of all forces, of one rank.
    struct Totals {
        excess: f64,
        pair: f64,
        virial: [f64; 6],
    }

    extern "Rust" {
        type Style;

        fn style_from_file(path: &str, kt: f64, names: &Vec<String>, dimensions: usize)
        -> Result<Box<Style>>;
        fn style_from_coefficients(
            kt: f64,
            pairs: &[Coefficients],
            types: usize,
            dimensions: usize,
            lucy: bool,
        ) -> Result<Box<Style>>;

        fn description(self: &Style) -> String;
        fn cutoff(self: &Style) -> f64;
        fn slope_width(self: &Style) -> usize;
        fn needs_velocities(self: &Style) -> bool;
        /// 0 if no noise is drawn.
        fn noise_range(self: &Style) -> f64;

        fn densities(
            self: &mut Style,
            owned: usize,
            x: &[f64],
            tag: &[i32],
            kind: &[i32],
            newton: bool,
        ) -> Result<()>;
        fn slopes_mut(self: &mut Style) -> &mut [f64];
        #[allow(clippy::too_many_arguments)]
        fn style_forces(
            style: &mut Style,
            owned: usize,
            x: &[f64],
            v: &[f64],
            tag: &[i32],
            kind: &[i32],
            request: &Request,
            f: &mut [f64],
        ) -> Result<Totals>;
        fn particle_energy(self: &Style) -> &[f64];
        /// Six numbers a particle.
        fn particle_virial(self: &Style) -> &[f64];
    }
}

fn style_from_file(
    path: &str,
    kt: f64,
    names: &Vec<String>,
    dimensions: usize,
) -> Result<Box<Style>, StyleError> {
    Style::from_file(path, kt, names, dimensions).map(Box::new)
}

fn style_from_coefficients(
    kt: f64,
    pairs: &[ffi::Coefficients],
    types: usize,
    dimensions: usize,
    lucy: bool,
) -> Result<Box<Style>, StyleError> {
    let pairs: Vec<Option<WarrenPair>> = pairs
        .iter()
        .map(|c| c.set.then_some(WarrenPair { a: c.a, b: c.b, gamma: c.gamma, rc: c.rc, rd: c.rd }))
        .collect();
    let law = if lucy { ForceLaw::LucyLammps } else { ForceLaw::Conservative };
    Style::from_coefficients(kt, &pairs, types, dimensions, law).map(Box::new)
}

#[allow(clippy::too_many_arguments)]
fn style_forces(
    style: &mut Style,
    owned: usize,
    x: &[f64],
    v: &[f64],
    tag: &[i32],
    kind: &[i32],
    request: &ffi::Request,
    f: &mut [f64],
) -> Result<ffi::Totals, StyleError> {
    let step = Step { seed: request.seed, number: request.step, dt: request.dt };
    let want = Want {
        energy: request.energy,
        virial: request.virial,
        particle_energy: request.particle_energy,
        particle_virial: request.particle_virial,
    };
    let tally = style.forces(owned, x, v, tag, kind, request.thermostat.then_some(step), want, f)?;
    Ok(ffi::Totals { excess: tally.excess, pair: tally.pair, virial: tally.total_virial() })
}

impl Style {
    fn cutoff(&self) -> f64 {
        self.engine().plan().cutoff()
    }

    fn slope_width(&self) -> usize {
        self.engine().slope_width()
    }

    fn needs_velocities(&self) -> bool {
        self.engine().plan().needs_velocities()
    }

    fn noise_range(&self) -> f64 {
        self.engine().plan().noise_range().unwrap_or(0.0)
    }

    fn particle_energy(&self) -> &[f64] {
        self.engine().particle_energy()
    }

    fn particle_virial(&self) -> &[f64] {
        self.engine().particle_virial().as_flattened()
    }
}
