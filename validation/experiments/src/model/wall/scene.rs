//! The scenes that measure a wall: a film on it, and a ridge, which is what is written. Lengths are in ranges of the forces, times in
//! thermal units r √(m/kT).

use super::Found;
use super::ridge::ridge;
use crate::model::seek::rounded;
use crate::model::slabs::{ALONG, FILM, SETTLE, Setting, Units, part, shown, slab};
use std::fmt::Write;

/// The height of the box of a film, in which the vapour has at least as much as the film.
pub const HEIGHT: f64 = 11.0;
/// The length of a ridge, short so that it does not break up into drops.
const DEPTH: f64 = 5.0;

/// What a ridge takes to spread and is measured: the angle of a flat one scatters more.
const SPREAD: f64 = 150.0;
const RIDGE: f64 = 350.0;

/// The lines of a `[[wall]]`.
pub fn wall(strength: f64, units: &Units, faces: &str) -> String {
    let [density, strength] = [units.density, strength].map(rounded);
    format!(
        "[[wall]]\nkind = \"continuum\"\nfaces = [{faces}]\ndensity = {density:?}\nstrength = {strength:?}\n"
    )
}

/// The lines of a box between faces, and of its walls.
fn between_faces(wall: &str) -> String {
    format!("boundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\n{wall}")
}

impl Setting {
    /// A film on the lower of two walls.
    pub fn film(strength: f64, time: f64, units: &Units) -> Setting {
        Setting {
            title: "A film on a wall".into(),
            lines: between_faces(&wall(strength, units, "\"zlo\", \"zhi\"")),
            // A layer that touches the face is pushed off.
            parts: part(&slab(FILM, Some(0.5 * FILM + 0.2), units), units.density),
            observe: "every = 5\nstress_profile = { axis = \"z\", bins = 110 }\n".into(),
            ..units.setting([ALONG, ALONG, HEIGHT], [SETTLE, time])
        }
    }

    /// A ridge with this contact angle on a wall of these lines, whose surface is at a height above the face.
    pub fn ridge(angle: f64, surface: f64, wall: &str, units: &Units) -> Setting {
        let surface = shown(surface.max(0.0));
        let shape = ridge(angle);
        let [half, top] = shape.start;
        let middle = 0.5 * shape.edges[0];
        let corner = |x: f64, y: f64, z: f64| [x, y, z].map(|length| shown(length * units.range));
        Setting {
            title: format!("A ridge on a wall, {angle} degrees"),
            lines: between_faces(wall),
            parts: part(
                &format!(
                    "shape = \"box\"\nlow = {:?}\nhigh = {:?}\n",
                    corner(middle - half, 0.0, 0.0),
                    corner(middle + half, DEPTH, top)
                ),
                units.density,
            ),
            observe: format!(
                "every = 10\ncontact_angle = {{ wall = \"zlo\", axis = \"y\", surface = {surface:?} }}\n"
            ),
            ..units.setting(
                [shape.edges[0], DEPTH, shape.edges[1]],
                [SPREAD, RIDGE / angle.to_radians().sin().powi(2).max(0.25)],
            )
        }
    }
}

impl Found {
    /// The lines of the `[[wall]]`, with the drag on which a liquid of this viscosity does not slip; `None` if no wall was found.
    pub fn lines(&self, faces: &str, viscosity: Option<f64>) -> Option<String> {
        let lines = self.strength.is_finite().then(|| wall(self.strength, &self.units, faces))?;
        Some(lines + &viscosity.map_or(String::new(), |eta| format!("viscosity = {eta:?}\n")))
    }

    /// The scene of the ridge, with a model of this name; `command` goes into its comment. `None` if no wall was found.
    pub fn scene(&self, (model, viscosity): (&str, Option<f64>), seed: u64, command: &str) -> Option<String> {
        let lines = self.lines("\"zlo\"", viscosity)?;
        let mut head = format!(
            "# By\n#   {command}\n# By three tensions the contact angle is {:.1}({:.1}), by the shape of this ridge {:.1}({:.1}) degrees.\n",
            self.young.value, self.young.error, self.ridge.value, self.ridge.error
        );
        if let Some(why) = &self.refusal {
            let _ = writeln!(head, "# MISSED: {why}");
        }
        let surface = self.film.map_or(0.0, |film| film.surface);
        let ridge = Setting::ridge(self.wanted, surface, &lines, &self.units);
        Some(head + &ridge.text(model, self.units.kt, seed))
    }
}
