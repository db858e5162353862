use super::Frame;
use nalgebra::{Matrix3, Vector3};
use psidpd_core::engine::PeriodicBox;

/// A box with its first edge along x and its second in the plane of x and y, as LAMMPS has them: its corners, and the tilt
/// factors xy, xz, yz.
pub fn domain(
    lo: [f64; 3],
    hi: [f64; 3],
    tilt: Option<[f64; 3]>,
    periodic: [bool; 3],
) -> Result<PeriodicBox, String> {
    let [xy, xz, yz] = tilt.unwrap_or([0.0; 3]);
    let [lx, ly, lz]: [f64; 3] = std::array::from_fn(|k| hi[k] - lo[k]);
    let edges = Matrix3::from_columns(&[
        Vector3::new(lx, 0.0, 0.0),
        Vector3::new(xy, ly, 0.0),
        Vector3::new(xz, yz, lz),
    ]);
    PeriodicBox::new(lo, edges, periodic).map_err(|e| e.to_string())
}

/// The particles at one step, read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    pub step: Option<u64>,
    /// The time since the start of the run, if the file has it.
    pub time: Option<f64>,
    /// The number of dimensions is 2 if all particles have the same z, else 3.
    pub dimensions: usize,
    pub domain: PeriodicBox,
    /// Names of the species. LAMMPS types are named by their numbers.
    pub names: Vec<String>,
    pub x: Vec<[f64; 3]>,
    pub v: Option<Vec<[f64; 3]>>,
    /// Species are counted from 0.
    pub species: Vec<i32>,
    pub tag: Vec<i32>,
}

impl Configuration {
    /// Takes names and dimensions from a model, because files of LAMMPS contain neither.
    pub fn name_species(&mut self, names: &[String], dimensions: usize) {
        // Names that are not numbers come from the file and stay.
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

/// Returns 2 if all particles have the same z in a box that is not periodic along z, else 3.
pub(super) fn dimensions_of(x: &[[f64; 3]], periodic: [bool; 3]) -> usize {
    let flat = !periodic[2] && x.iter().all(|p| p[2] == x[0][2]);
    if flat { 2 } else { 3 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file has names in the order of their first appearance, or numbers; the model has an order of its own.
    #[test]
    fn species_are_those_of_the_model() {
        let domain = PeriodicBox::orthogonal([0.0; 3], [4.0; 3], [true; 3]).unwrap();
        let named = |found: &[&str]| {
            let mut read = Configuration {
                step: None,
                time: None,
                dimensions: 3,
                domain: domain.clone(),
                names: found.iter().map(|n| (*n).to_owned()).collect(),
                x: vec![[1.0; 3]; 3],
                v: None,
                species: vec![0, 1, 0],
                tag: vec![1, 2, 3],
            };
            read.name_species(&["A".to_owned(), "B".to_owned()], 2);
            assert_eq!(read.dimensions, 2);
            (read.names.concat(), read.species)
        };
        assert_eq!(named(&["B", "A"]), ("AB".to_owned(), vec![1, 0, 1]));
        assert_eq!(named(&["1", "2"]), ("AB".to_owned(), vec![0, 1, 0]));
        assert_eq!(named(&["B", "oil"]), ("Boil".to_owned(), vec![0, 1, 0]));
    }
}
