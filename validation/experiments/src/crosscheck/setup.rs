//! What a code is to compute, and how it is told.

use super::Context;
use crate::ExperimentError;
use crate::code::{Code, Told};
use crate::fluids::WarrenSet;
use crate::lammps::deck::Deck;
use crate::lammps::style::GRID;
use psidpd_core::engine::Precision;
use psidpd_core::model::ForceLaw;
use psidpd_dynamics::run::State;
use psidpd_formats::files::{Existing, work_folder, write_bytes};
use psidpd_lammps_host::export::eam::{self, Grid};
use std::path::Path;

#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    pub code: Code,
    pub precision: Precision,
    pub set: &'a WarrenSet,
    pub law: ForceLaw,
    /// Friction; 0 leaves drag and noise out.
    pub gamma: f64,
    pub seed: u64,
    pub newton: bool,
    /// Spacing in r of the tables of [`Code::Eam`].
    pub spacing: f64,
}

/// Spacing of tables for comparing forces. A spline is exact but near the kink of w′ at r_d, where its
/// error is proportional to the spacing.
pub const FINE: f64 = 1e-6;

impl<'a> Setup<'a> {
    /// Double precision, no drag, no noise, `newton on`.
    pub fn new(code: Code, set: &'a WarrenSet, law: ForceLaw) -> Setup<'a> {
        let (precision, spacing) = (Precision::Double, GRID.spacing);
        Setup { code, precision, set, law, gamma: 0.0, seed: 1, newton: true, spacing }
    }

    fn is_mixed(&self) -> bool {
        self.precision == Precision::Mixed
    }

    pub fn label(&self) -> String {
        self.code.label() + if self.is_mixed() { ", mixed precision" } else { "" }
    }

    pub fn slug(&self) -> String {
        let slug = match self.code {
            Code::Eam => "eam".to_owned(),
            code => code.label().replace("plugin ", "").replace("LAMMPS ", "").replace('/', "-"),
        };
        slug + if self.is_mixed() { "-mixed" } else { "" }
    }

    /// Writes data, model or tables into `folder` and returns the commands up to the pair style. Paths
    /// in them are relative to `folder` unless `absolute`.
    pub fn prepare(
        &self,
        context: &Context,
        state: &State,
        folder: &Path,
        absolute: bool,
    ) -> Result<String, ExperimentError> {
        work_folder(folder)?;
        let place = |name: &str| {
            if absolute { folder.join(name).display().to_string() } else { name.to_owned() }
        };
        let told = Told {
            model: place("model.toml"),
            tables: place("fluid.eam.alloy"),
            species: "F".to_owned(),
            pair: self.set.pair(self.gamma),
            law: self.law,
            words: format!("precision {}", self.precision),
        };
        let Some(style) = self.code.style(told) else { return Ok(String::new()) };
        match self.code {
            Code::Psi => {
                let path = folder.join("model.toml");
                let model = self.set.model(self.law, self.gamma)?;
                write_bytes(&path, Existing::Keep, model.source().text().as_bytes())?;
            }
            Code::Eam => {
                // ψ as embedding function, w as density and φ as pair potential: LAMMPS's own route to the same
                // conservative forces.
                let fluid = self.set.model(ForceLaw::Conservative, 0.0)?.at(1.0)?;
                let grid = Grid { spacing: self.spacing, ..GRID };
                eam::write(&fluid, &[1.0], grid, &folder.join("fluid.eam.alloy"), Existing::Keep)?;
            }
            _ => {}
        }
        let (data, path) = (state.to_data("psidpd"), folder.join("start.data"));
        if self.code == Code::Mdpd {
            data.write_mdpd(&path)?
        } else {
            data.write(&path)?
        }
        let (plugin, newton) = (context.lammps.plugin.as_deref(), self.newton);
        Ok(Deck { plugin, newton, ..Deck::new(&style, self.seed, place("start.data")) }.text())
    }
}
