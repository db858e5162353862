//! Starts whose particles are placed one by one.

use std::fmt::Write;

/// A data file of one species in a cube.
pub fn data(x: &[[f64; 3]], edge: f64) -> String {
    let mut text = format!(
        "psidpd hard case\n\n{} atoms\n1 atom types\n\n0 {edge:?} xlo xhi\n0 {edge:?} ylo yhi\n0 {edge:?} zlo zhi\n\n\
         Masses\n\n1 1.0\n\nAtoms # atomic\n\n",
        x.len()
    );
    for (k, [x, y, z]) in x.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} 1 {x:?} {y:?} {z:?}", k + 1);
    }
    text
}
