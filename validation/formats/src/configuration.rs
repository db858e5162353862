//! Particles at one step, as files have them.

use super::Frame;
use psidpd_core::engine::PeriodicBox;

/// Particles at one step, read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Number of the step, where the file tells it.
    pub step: Option<u64>,
    /// Time since the start of the run, where the file tells it.
    pub time: Option<f64>,
    /// 3, or 2 if nothing differs in z.
    pub dimensions: usize,
    /// The box.
    pub domain: PeriodicBox,
    /// Names of the species; LAMMPS's types have numbers for names.
    pub names: Vec<String>,
    /// Positions.
    pub x: Vec<[f64; 3]>,
    /// Velocities, where the file has them.
    pub v: Option<Vec<[f64; 3]>>,
    /// Species, from 0.
    pub species: Vec<i32>,
    /// Tags.
    pub tag: Vec<i32>,
}

impl Configuration {
    /// Takes names and dimensions from a model: files of LAMMPS know neither.
    pub fn name_species(&mut self, names: &[String], dimensions: usize) {
        // Names that are no numbers are names already.
        if self.names.iter().all(|n| n.parse::<usize>().is_ok()) {
            for (name, given) in self.names.iter_mut().zip(names) {
                name.clone_from(given);
            }
        } else if self.names.iter().all(|n| names.contains(n)) {
            let index = |s: i32| names.iter().position(|n| *n == self.names[s as usize]);
            self.species = self.species.iter().map(|s| index(*s).map_or(*s, |k| k as i32)).collect();
            self.names = names.to_vec();
        }
        self.dimensions = dimensions;
    }

    /// The same, borrowed.
    pub fn frame(&self) -> Frame<'_> {
        Frame {
            step: self.step.unwrap_or(0),
            time: self.time.unwrap_or(f64::NAN),
            dimensions: self.dimensions,
            domain: &self.domain,
            names: &self.names,
            x: &self.x,
            v: self.v.as_deref(),
            species: &self.species,
            tag: &self.tag,
        }
    }
}

/// 2 if every particle is at the same z of a box that does not repeat there, else 3.
pub(super) fn dimensions_of(x: &[[f64; 3]], periodic: [bool; 3]) -> usize {
    let flat = !periodic[2] && x.iter().all(|p| p[2] == x[0][2]);
    if flat { 2 } else { 3 }
}
