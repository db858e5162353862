//! Views of a simulation for observables.

use super::{Simulation, State};
use psidpd_observe::frame::View;

impl Simulation {
    /// The present step as observables see it; `time` is measured from the start of the run.
    pub fn view(&self, time: f64) -> View<'_> {
        let State { domain, mass: masses, x, v, species, tag: tags, image: images } = self.state();
        View {
            pool: self.engine().pool(),
            precision: self.settings().precision,
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
            forces: self.known_conservative_forces(),
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
}
