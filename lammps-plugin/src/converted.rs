//! Converts positions, velocities and results between the units of LAMMPS and those of the model.

/// Positions and velocities in units of the model, and results in those of LAMMPS.
#[derive(Debug, Default)]
pub struct Converted {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub forces: Vec<f64>,
    pub densities: Vec<f64>,
    pub excess: Vec<f64>,
}

/// Views a flat array as vectors of three numbers, as LAMMPS stores them.
pub fn triples(flat: &[f64]) -> &[[f64; 3]] {
    flat.as_chunks::<3>().0
}

/// Numbers in another unit, in `out` if they differ.
pub fn times<'a>(numbers: &'a [f64], factor: f64, out: &'a mut Vec<f64>) -> &'a [f64] {
    if factor == 1.0 {
        return numbers;
    }
    out.clear();
    out.extend(numbers.iter().map(|x| x * factor));
    out
}
