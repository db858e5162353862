use super::Meter;
use crate::observe::frame::Frame;
use crate::observe::keys::Table;
use crate::observe::observation::{Kind, Observation};
use crate::observe::request::Options;
use crate::observe::series::Series;
use psidpd_core::document::FileError;
use serde::{Deserialize, Serialize};

/// kT from velocities and from configurations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Temperature {
    /// Why there is no configurational temperature; empty if there is one.
    missing: String,
    /// Kinetic kT, `Σ F·F`, `−Σ ∇·F`.
    series: Series,
}

impl Meter for Temperature {
    const TABLE: Table = Table {
        name: "temperature",
        title: "temperature, kinetic and configurational",
        about: "`kinetic` is 2K/f, f being d(N − 1) in a periodic box and without walls or frozen particles \
                (`output.md`). `configurational` is ⟨Σ F·F⟩/⟨−Σ ∇·F⟩ with the conservative forces alone (Rugh; Butler et al., J. Chem. Phys. 109, 6519 (1998)), with ∇·F from the second derivatives of ψ, \
                kernels and pair potentials; φ″ of formulas and tables is the five-point difference of the exact φ′. \
                At large time steps the two err differently. There is no configurational temperature for a force \
                that is no gradient, for one that jumps at its range (the linear kernel), and in boxes narrower \
                than twice the range.",
        keys: &[],
    };

    fn read(options: &Options) -> Result<Temperature, FileError> {
        let fluid = options.place.fluid;
        let missing = if !fluid.is_conservative() {
            "a force of the model has no potential"
        } else if fluid.force_jumps() {
            "a force of the model jumps at its range, where its divergence is a delta function"
        } else if options.half_box() < fluid.conservative_range() {
            "the box is narrower than twice the range of the forces"
        } else {
            ""
        };
        let width = if missing.is_empty() { 3 } else { 1 };
        Ok(Temperature { missing: missing.into(), series: Series::new(width) })
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let kinetic = frame.view.temperature;
        if !self.missing.is_empty() {
            return self.series.push(&[kinetic]);
        }
        let evaluation = frame.evaluation();
        let (mut squares, mut laplacian) = (0.0, 0.0);
        let laplacians = evaluation.laplacians(frame.evaluator().fluid(), frame.view.species);
        for (k, (f, l)) in evaluation.forces.iter().zip(laplacians).enumerate() {
            if frame.moves(k) {
                squares += f.iter().map(|f| f * f).sum::<f64>();
                laplacian += l;
            }
        }
        self.series.push(&[kinetic, squares, laplacian])
    }

    fn finish(&self) -> Vec<Observation> {
        let mut out = Observation::new("temperature", "Temperature kT", Kind::Scalar)
            .samples(self.series.samples())
            .column("kinetic", "energy", [self.series.mean(0)]);
        if self.missing.is_empty() {
            out = out.column("configurational", "energy", [self.series.ratio(|s| s[1], |s| s[2])]);
        } else {
            out = out.note(format!("No configurational temperature: {}.", self.missing));
        }
        vec![out]
    }
}
