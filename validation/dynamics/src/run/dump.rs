use psidpd_formats::Frame;
use psidpd_formats::dump::{Digits, DumpWriter, Snapshot};
use std::io::{self, Write};

/// Writes a frame of a LAMMPS custom dump, `id type x y z vx vy vz`. Particles keep their order in the frame;
/// types are species from 1. Unknown velocities are written as 0.
pub fn write_frame(frame: &Frame, to: &mut impl Write) -> io::Result<()> {
    let (origin, lengths) = (frame.domain.origin(), frame.domain.lengths());
    let ids: Vec<u32> = frame.tag.iter().map(|t| *t as u32).collect();
    let kinds: Vec<u32> = frame.species.iter().map(|s| *s as u32 + 1).collect();
    let none = if frame.v.is_none() { vec![[0.0; 3]; frame.len()] } else { Vec::new() };
    DumpWriter::new(to, Digits::All).write(&Snapshot {
        step: frame.step as i64,
        boxlo: origin,
        boxhi: std::array::from_fn(|k| origin[k] + lengths[k]),
        periodic: frame.periodic(),
        ids: &ids,
        kinds: &kinds,
        x: frame.x,
        v: frame.v.unwrap_or(&none),
    })
}
