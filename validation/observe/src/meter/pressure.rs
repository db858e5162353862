use super::*;

/// The names of the components of a pressure tensor.
const NAMES: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pressure {
    dimensions: usize,
    /// Tensor of all forces, tensor of conservative forces, tensor of the momentum transport, and the configurational pressure.
    series: Series,
}

impl Meter for Pressure {
    const TABLE: Table = Table {
        path: "pressure",
        title: "pressure tensor",
        about: "Three tensors with the same limit as the time step goes to 0. `carried` is the flux of momentum that the \
                integrator makes: Σ m u u with the velocities u that moved the particles in the step, and the virial Σ r_ij \
                ⊗ F_ij of all pair forces where they acted, drag included; the random force, whose mean is 0, is left out. \
                It is the pressure that walls feel and that balances in interfaces, at any time step. `total` is (Σ m v v + \
                W)/V with the velocities at the end of the step and the virial of all forces, noise included, those of \
                `thermostat_every` steps as a mean, as `pressure` in `thermo.csv`, as LAMMPS's `compute pressure` and its \
                thermo output: in velocity Verlet too low by ¼ Δt² ⟨Σ f²/m⟩/(dV), which is of first order, as the random \
                force is. `conservative` leaves drag and noise out of W, and lacks drag as well. `configurational` is the \
                scalar ρkT + tr W/(dV) of conservative forces with the kT of the stage: what configurations tell, without \
                the scatter of velocities and their error at a time step, as a Monte Carlo run has it. In a dilute fluid it \
                has much the least noise.",
        ..PLAIN
    };

    const NEEDS: Want = Want::TOTALS;
    const FLUX: Recorded = Recorded::Sum;

    fn read(options: &Options) -> Result<Pressure, FileError> {
        Ok(Pressure { dimensions: options.place.fluid.dimensions, series: Series::new(19) })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let view = frame.view;
        let (total, conservative) = (view.pressure, view.conservative_pressure);
        let Some(carried) = frame.carried_pressure() else { return false };
        let d = self.dimensions as f64;
        let mobile = (0..view.x.len()).filter(|k| frame.moves(*k)).count() as f64;
        let ideal = (mobile * view.kt - 2.0 / d * view.kinetic_energy) / frame.volume();
        let configurational = conservative[..self.dimensions].iter().sum::<f64>() / d + ideal;
        self.series.push(&[&total[..], &conservative, &carried, &[configurational]].concat())
    }

    fn series(&mut self) -> Vec<&mut Series> {
        vec![&mut self.series]
    }

    fn finish(&self) -> Vec<Observation> {
        let d = self.dimensions;
        let mut out = Observation::new("pressure", "Pressure", Kind::Scalar, &self.series);
        for (what, first) in [("carried", 12), ("conservative", 6), ("total", 0)] {
            let trace = self.series.linear(|s| s[first..first + d].iter().sum::<f64>() / d as f64);
            out = out.column(what, "energy/volume", [trace]);
        }
        out = out.column("configurational", "energy/volume", [self.series.mean(18)]);
        for (what, first) in [("carried", 12), ("conservative", 6), ("total", 0)] {
            let there = |k: &usize| d == 3 || [0, 1, 3].contains(k);
            for k in (0..6).filter(there) {
                let name = format!("{what}_{}", NAMES[k]);
                out = out.column(&name, "energy/volume", [self.series.mean(first + k)]);
            }
        }
        vec![out]
    }
}
