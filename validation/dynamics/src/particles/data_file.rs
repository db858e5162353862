//! States as LAMMPS data files, from which psidpd and LAMMPS can both start.

use super::state::State;
use super::tags::order_of_tags;
use psidpd_core::model::Model;
use psidpd_formats::data::{Atom, DataFile};

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the initial state is not usable: {message}")]
pub struct StateError {
    pub message: String,
    /// The id of the faulty atom, if the fault is in one.
    pub atom: Option<u32>,
}

impl StateError {
    fn new(message: impl Into<String>) -> StateError {
        StateError { message: message.into(), atom: None }
    }
}

impl State {
    /// Converts the state to a data file of atom style `atomic`. Types are species from 1; `title` becomes
    /// the first line, to which walls are added, because data files have no key for them.
    pub fn to_data(&self, title: &str) -> DataFile {
        self.to_data_in(0..self.len(), title)
    }

    /// As [`State::to_data`], with the particles in the order of their tags.
    pub fn to_data_by_tag(&self, title: &str) -> DataFile {
        self.to_data_in(order_of_tags(&self.tag).into_iter(), title)
    }

    fn to_data_in(&self, order: impl Iterator<Item = usize> + Clone, title: &str) -> DataFile {
        let origin = self.domain.origin();
        let edges = [0, 1, 2].map(|k| self.domain.edge(k));
        let tilt = [edges[1][0], edges[2][0], edges[2][1]];
        let data = DataFile {
            title: title.to_owned(),
            boxlo: origin,
            boxhi: std::array::from_fn(|k| origin[k] + edges[k][k]),
            tilt: (tilt != [0.0; 3]).then_some(tilt),
            types: self.mass.len(),
            masses: self.mass.clone(),
            names: Vec::new(),
            atoms: order
                .clone()
                .map(|k| Atom {
                    id: self.tag[k] as u32,
                    kind: self.species[k] as u32 + 1,
                    x: self.x[k],
                    image: self.image[k],
                })
                .collect(),
            velocities: Some(order.map(|k| self.v[k]).collect()),
        };
        // The third direction of a plane has no images, but no wall either.
        let periodic = self.domain.periodic();
        let is_flat = self.x.iter().all(|x| x[2] == self.x[0][2]);
        let walls = !periodic[0] || !periodic[1] || !periodic[2] && !is_flat;
        if walls { data.with_boundary(periodic) } else { data }
    }

    /// Converts a data file to a state. Walls come from its title; all other directions of the model are
    /// periodic. See [`State::from_data_in`].
    pub fn from_data(data: &DataFile, model: &Model) -> Result<State, StateError> {
        State::from_data_in(data, model, data.boundary().unwrap_or([true, true, model.dimensions() == 3]))
    }

    /// Converts a data file to a state in a box with the given periodic directions; particles outside are
    /// wrapped along these. Types are species from 1. Missing masses are 1, missing velocities are 0.
    pub fn from_data_in(data: &DataFile, model: &Model, periodic: [bool; 3]) -> Result<State, StateError> {
        let species = model.species().len();
        let walls = periodic[..model.dimensions()].iter().any(|p| !p);
        if walls && data.tilt.is_some_and(|tilt| tilt != [0.0; 3]) {
            return Err(StateError::new("a box with tilt has no reflecting walls"));
        }
        let domain =
            psidpd_formats::domain(data.boxlo, data.boxhi, data.tilt, periodic).map_err(StateError::new)?;
        let mut state = State::at_rest(domain, vec![1.0; species], Vec::new());
        state.v = data.velocities.clone().unwrap_or_else(|| vec![[0.0; 3]; data.atoms.len()]);
        for (mass, given) in state.mass.iter_mut().zip(&data.masses) {
            *mass = *given;
        }
        for atom in &data.atoms {
            let kind = atom.kind as usize;
            if kind > species {
                let message = format!(
                    "atom {} has type {kind}, the model has {species} species: {}",
                    atom.id,
                    model.species().join(", ")
                );
                return Err(StateError { message, atom: Some(atom.id) });
            }
            let tag = i32::try_from(atom.id).map_err(|_| {
                let message = format!("atom id {} exceeds the largest tag, 2147483647", atom.id);
                StateError { message, atom: Some(atom.id) }
            })?;
            let (mut x, mut image) = (atom.x, atom.image);
            state.domain.wrap(&mut x, &mut image);
            state.x.push(x);
            state.image.push(image);
            state.species.push(kind as i32 - 1);
            state.tag.push(tag);
        }
        Ok(state)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::support::IDEAL;

    /// LAMMPS's edges are (lx, 0, 0), (xy, ly, 0) and (xz, yz, lz).
    #[test]
    fn the_edges_of_a_tilted_box_are_those_of_lammps() {
        let text = "t\n\n1 atoms\n1 atom types\n\n1 5 xlo xhi\n0 6 ylo yhi\n0 7 zlo zhi\n1.5 -0.5 2 xy xz yz\n\nAtoms # atomic\n\n\
                    1 1 2 3 4\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.data");
        std::fs::write(&path, text).unwrap();
        let model = Model::parse("m", IDEAL).unwrap();
        let state = State::from_data(&DataFile::read(&path).unwrap(), &model).unwrap();
        let edges = [0, 1, 2].map(|k| state.domain.edge(k));
        assert_eq!(edges, [[4.0, 0.0, 0.0], [1.5, 6.0, 0.0], [-0.5, 2.0, 7.0]]);
        assert_eq!((state.domain.origin(), state.x[0]), ([1.0, 0.0, 0.0], [2.0, 3.0, 4.0]));
    }
}
