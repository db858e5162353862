//! The fluids of the cases, and starts.

use std::fmt::Write;

pub const SET6: &str = include_str!("../../../models/warren2003-set6.toml");
pub const DPD: &str = include_str!("../../../models/standard-dpd.toml");
pub const VAN_DER_WAALS: &str = include_str!("../../../models/van-der-waals-2d.toml");
pub const HUGGINS: &str = include_str!("../../../models/huggins.toml");
pub const LINEAR: &str = include_str!("../../../models/groot-warren-linear.toml");
pub const SPLINE: &str = include_str!("../../../models/spline-attractive.toml");

/// A gas that has a thermostat alone.
pub const IDEAL: &str =
    "title = \"ideal gas\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

/// The same with two species.
pub const IDEAL_TWO: &str =
    "title = \"ideal gas\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

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
