use super::Meter;
use crate::observe::frame::Frame;
use crate::observe::keys::Table;
use crate::observe::observation::{Kind, Observation};
use crate::observe::request::Options;
use crate::observe::series::Series;
use psidpd_core::document::FileError;
use psidpd_core::engine::Want;
use serde::{Deserialize, Serialize};

/// Names of the components of a pressure tensor.
const NAMES: [&str; 6] = ["xx", "yy", "zz", "xy", "xz", "yz"];

/// The pressure tensor of the whole box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pressure {
    dimensions: usize,
    /// Tensor of all forces, tensor of conservative forces.
    series: Series,
}

impl Meter for Pressure {
    const TABLE: Table = Table {
        path: "pressure",
        title: "pressure tensor",
        array: false,
        forms: ("", &[]),
        about: "P = (Σ m v v + W)/V with the virial W = Σ r_ij ⊗ F_ij, exact with the many-body pair forces. \
                `conservative` and its components leave drag and noise out of W; `total` has them, as LAMMPS's \
                `compute pressure`. The two means differ by a term of the order of the time step: the drag of \
                velocity Verlet sees the velocity that brought particles to where they are. `conservative` has \
                less noise.",
        keys: &[],
    };

    fn read(options: &Options) -> Result<Pressure, FileError> {
        Ok(Pressure { dimensions: options.place.fluid.dimensions, series: Series::new(12) })
    }

    fn needs(&self) -> Want {
        Want::TOTALS
    }

    fn sample(&mut self, frame: &Frame) -> bool {
        let total = frame.view.pressure;
        let conservative = frame.view.conservative_pressure;
        self.series.push(&[total, conservative].concat())
    }

    fn finish(&self) -> Vec<Observation> {
        let d = self.dimensions;
        let mut out = Observation::new("pressure", "Pressure", Kind::Scalar).samples(self.series.samples());
        for (what, first) in [("conservative", 6), ("total", 0)] {
            let trace = self.series.linear(|s| s[first..first + d].iter().sum::<f64>() / d as f64);
            out = out.column(what, "energy/volume", [trace]);
        }
        for (what, first) in [("conservative", 6), ("total", 0)] {
            let there = |k: &usize| d == 3 || [0, 1, 3].contains(k);
            for k in (0..6).filter(there) {
                let name = format!("{what}_{}", NAMES[k]);
                out = out.column(&name, "energy/volume", [self.series.mean(first + k)]);
            }
        }
        vec![out]
    }
}
