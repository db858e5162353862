//! The scenes that measure: a slab of the liquid, a film on a wall, and a ridge, which is what is written. Lengths are in ranges of the
//! forces, times in thermal units r √(m/kT).

use super::Found;
use super::ridge::ridge;
use super::search::rounded;
use crate::steps::{FIRST, STEP};
use serde::Serialize;
use std::fmt::Write;

/// Edges of a film along its wall, its thickness, and the height of the box, in which the vapour has at least as much.
const ALONG: f64 = 6.0;
pub const FILM: f64 = 5.0;
pub const HEIGHT: f64 = 11.0;
/// The length of a ridge, short so that it does not break up into drops.
const DEPTH: f64 = 5.0;

/// What settles, the slab, and what a ridge takes to spread and is measured: the angle of a flat one scatters more.
const SETTLE: f64 = 40.0;
const SLAB: f64 = 300.0;
const SPREAD: f64 = 150.0;
const RIDGE: f64 = 350.0;

/// The liquid in units of its model, and the step that it is moved with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Units {
    pub kt: f64,
    /// The range of the forces.
    pub range: f64,
    /// The number density of the liquid.
    pub density: f64,
    pub dt: f64,
}

/// A box with or without a wall, and where the liquid is.
pub struct Setting {
    pub title: String,
    edges: [f64; 3],
    /// The lines of the [`wall`], if there is one.
    wall: String,
    /// The shape of the liquid.
    shape: String,
    settle: f64,
    time: f64,
    observe: String,
}

/// The lines of a `[[wall]]`.
pub fn wall(strength: f64, units: &Units, faces: &str) -> String {
    let [density, strength] = [units.density, strength].map(rounded);
    format!(
        "[[wall]]\nkind = \"continuum\"\nfaces = [{faces}]\ndensity = {density:?}\nstrength = {strength:?}\n"
    )
}

/// A length with three decimals.
fn shown(length: f64) -> f64 {
    (1e3 * length).round() / 1e3
}

impl Setting {
    pub fn slab(units: &Units) -> Setting {
        let thickness = shown((FILM + 1.0) * units.range);
        Setting {
            title: "A slab".into(),
            edges: [ALONG, ALONG, HEIGHT + 1.0],
            wall: String::new(),
            shape: format!("shape = \"slab\"\nthickness = {thickness:?}\n"),
            settle: SETTLE,
            time: SLAB,
            observe: "every = 5\nsurface_tension = true\ninterface_width = { every = 25 }\n".into(),
        }
    }

    /// A film on the lower of two walls.
    pub fn film(strength: f64, time: f64, units: &Units) -> Setting {
        // A layer that touches the face is pushed off.
        let [thickness, middle] = [FILM, 0.5 * FILM + 0.2].map(|length| shown(length * units.range));
        Setting {
            title: "A film on a wall".into(),
            edges: [ALONG, ALONG, HEIGHT],
            wall: wall(strength, units, "\"zlo\", \"zhi\""),
            shape: format!("shape = \"slab\"\nthickness = {thickness:?}\nat = {middle:?}\n"),
            settle: SETTLE,
            time,
            observe: "every = 5\nstress_profile = { axis = \"z\", bins = 110 }\n".into(),
        }
    }

    /// A ridge with this contact angle on a wall of these lines, whose surface is at a height above the face.
    pub fn ridge(angle: f64, surface: f64, wall: String, units: &Units) -> Setting {
        let surface = shown(surface.max(0.0));
        let shape = ridge(angle);
        let [half, top] = shape.start;
        let middle = 0.5 * shape.edges[0];
        let corner = |x: f64, y: f64, z: f64| [x, y, z].map(|length| shown(length * units.range));
        Setting {
            title: format!("A ridge on a wall, {angle} degrees"),
            edges: [shape.edges[0], DEPTH, shape.edges[1]],
            wall,
            shape: format!(
                "shape = \"box\"\nlow = {:?}\nhigh = {:?}\n",
                corner(middle - half, 0.0, 0.0),
                corner(middle + half, DEPTH, top)
            ),
            settle: SPREAD,
            time: RIDGE / angle.to_radians().sin().powi(2).max(0.25),
            observe: format!(
                "every = 10\ncontact_angle = {{ wall = \"zlo\", axis = \"y\", surface = {surface:?} }}\n"
            ),
        }
    }

    /// The scene, with a model of this name and without the section on output.
    pub fn text(&self, model: &str, units: &Units, seed: u64) -> String {
        let Units { kt, range, density, dt } = *units;
        let steps = |time: f64| (time * range / kt.sqrt() / dt).ceil().max(100.0);
        let edges = self.edges.map(|edge| shown(edge * range));
        let mut text = format!(
            "title = \"{}\"\nmodel = {}\nkT    = {kt:?}\nseed  = {seed}\n\n[box]\nlengths  = {edges:?}\n",
            self.title,
            toml::Value::String(model.to_owned()),
        );
        if !self.wall.is_empty() {
            let _ = write!(text, "boundary = [\"periodic\", \"periodic\", \"reflecting\"]\n\n{}", self.wall);
        }
        let density = rounded(density);
        let _ = write!(text, "\n[[part]]\n{}density = {density:?}\nlattice = \"fcc\"\n", self.shape);
        for (name, steps, dt) in [
            ("begin", 400.0, FIRST * dt),
            ("settle", steps(self.settle), dt),
            ("measure", steps(self.time), dt),
        ] {
            let dt = rounded(dt);
            let _ = write!(text, "\n[[stage]]\nname = \"{name}\"\nsteps = {steps}\ndt = {dt:?}\n{STEP}");
        }
        text + "\n[observe]\nstages = [\"measure\"]\n" + &self.observe
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
        let ridge = Setting::ridge(self.wanted, surface, lines, &self.units);
        Some(head + &ridge.text(model, &self.units, seed))
    }
}
