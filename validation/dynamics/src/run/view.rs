//! Views of a simulation for observables and files.

use super::{Simulation, State};
use psidpd_formats::Frame;
use psidpd_observe::frame::View;

impl Simulation {
    /// The present step as observables see it; `time` is measured from the start of the run.
    pub fn view(&self, time: f64) -> View<'_> {
        let State { domain, mass: masses, x, v, species, tag: tags, image: images } = self.state();
        View {
            pool: self.engine().pool(),
            step: self.step_number(),
            time,
            kt: self.kt(),
            model: self.model(),
            dimensions: self.dimensions(),
            domain,
            masses,
            x,
            v,
            images,
            species,
            tags,
            frozen: self.frozen(),
            temperature: self.temperature(),
            kinetic_energy: self.kinetic_energy(),
            potential: [self.tally().excess, self.tally().pair],
            pressure: self.pressure_tensor(),
            conservative_pressure: self.conservative_pressure_tensor(),
            flux: self.flux(),
        }
    }

    /// The present step for files and pictures, with its particles in the order of `state`; `time` is measured from the
    /// start of the run.
    pub(super) fn frame<'a>(&'a self, state: &'a State, time: f64) -> Frame<'a> {
        Frame {
            step: self.step_number(),
            time,
            dimensions: self.dimensions(),
            domain: &state.domain,
            names: self.model().species(),
            x: &state.x,
            v: Some(&state.v),
            species: &state.species,
            tag: &state.tag,
        }
    }
}
