//! A state as a LAMMPS data file, to go on from, in either code.

use super::error::RunError;
use super::state::State;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes `state` as a LAMMPS data file of atom style `atomic`, every number with the seventeen digits
/// that bring it back unchanged. Types are species from 1; `title` becomes the first line.
///
/// # Errors
/// The file cannot be written.
pub fn write_data(path: &Path, title: &str, state: &State) -> Result<(), RunError> {
    File::create(path)
        .and_then(|file| {
            let mut to = BufWriter::new(file);
            write(&mut to, title, state)?;
            to.flush()
        })
        .map_err(RunError::output(path))
}

fn write(to: &mut impl Write, title: &str, state: &State) -> io::Result<()> {
    writeln!(to, "{}\n", title.lines().next().unwrap_or(""))?;
    writeln!(to, "{} atoms\n{} atom types\n", state.len(), state.mass.len())?;
    let domain = &state.domain;
    let origin = domain.origin();
    let edges = [0, 1, 2].map(|k| domain.edge(k));
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        writeln!(to, "{:.16e} {:.16e} {name}lo {name}hi", origin[k], origin[k] + edges[k][k])?;
    }
    let tilt = [edges[1][0], edges[2][0], edges[2][1]];
    if tilt != [0.0; 3] {
        writeln!(to, "{:.16e} {:.16e} {:.16e} xy xz yz", tilt[0], tilt[1], tilt[2])?;
    }
    writeln!(to, "\nMasses\n")?;
    for (k, mass) in state.mass.iter().enumerate() {
        writeln!(to, "{} {mass:.16e}", k + 1)?;
    }
    writeln!(to, "\nAtoms # atomic\n")?;
    for (k, x) in state.x.iter().enumerate() {
        let [a, b, c] = state.image[k];
        let kind = state.species[k] + 1;
        writeln!(to, "{} {kind} {:.16e} {:.16e} {:.16e} {a} {b} {c}", state.tag[k], x[0], x[1], x[2])?;
    }
    writeln!(to, "\nVelocities\n")?;
    for (tag, v) in state.tag.iter().zip(&state.v) {
        writeln!(to, "{tag} {:.16e} {:.16e} {:.16e}", v[0], v[1], v[2])?;
    }
    Ok(())
}
