use super::simulation::Simulation;
use std::io::{self, Write};

/// Writes the present step as a frame of a LAMMPS custom dump, `id type x y z vx vy vz`; types are
/// species from 1.
///
/// # Errors
/// `to` cannot be written. Boxes that are not along the axes cannot be told in this format.
pub fn write_frame(simulation: &Simulation, to: &mut impl Write) -> io::Result<()> {
    let domain = simulation.domain();
    let (origin, lengths) = (domain.origin(), domain.lengths());
    writeln!(to, "ITEM: TIMESTEP\n{}", simulation.step_number())?;
    writeln!(to, "ITEM: NUMBER OF ATOMS\n{}", simulation.len())?;
    writeln!(to, "ITEM: BOX BOUNDS pp pp pp")?;
    for k in 0..3 {
        writeln!(to, "{:?} {:?}", origin[k], origin[k] + lengths[k])?;
    }
    writeln!(to, "ITEM: ATOMS id type x y z vx vy vz")?;
    let (x, v) = (simulation.positions(), simulation.velocities());
    for (k, tag) in simulation.tags().iter().enumerate() {
        write!(to, "{tag} {}", simulation.species()[k] + 1)?;
        for c in x[k].iter().chain(&v[k]) {
            write!(to, " {c:?}")?;
        }
        writeln!(to)?;
    }
    Ok(())
}
