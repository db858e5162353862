use super::simulation::Simulation;
use crate::lammps::dump::{Digits, DumpWriter, Snapshot};
use std::io::{self, Write};

/// Writes the present step as a frame of a LAMMPS custom dump, `id type x y z vx vy vz`; types are
/// species from 1.
///
/// # Errors
/// `to` cannot be written. Boxes that are not along the axes cannot be told in this format.
pub fn write_frame(simulation: &Simulation, to: &mut impl Write) -> io::Result<()> {
    let domain = simulation.domain();
    let (origin, lengths) = (domain.origin(), domain.lengths());
    let ids: Vec<u32> = simulation.tags().iter().map(|t| *t as u32).collect();
    let kinds: Vec<u32> = simulation.species().iter().map(|s| *s as u32 + 1).collect();
    DumpWriter::new(to, Digits::All).write(&Snapshot {
        step: simulation.step_number() as i64,
        boxlo: origin,
        boxhi: std::array::from_fn(|k| origin[k] + lengths[k]),
        periodic: std::array::from_fn(|k| domain.periodic()[k] && k < simulation.dimensions()),
        ids: &ids,
        kinds: &kinds,
        x: simulation.positions(),
        v: simulation.velocities(),
    })
}
