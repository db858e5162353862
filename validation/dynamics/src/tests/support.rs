//! Models and scenes that several tests share.

use psidpd_core::document::FileError;
use psidpd_dynamics::scene::Scene;

/// Warren's liquid, set 6.
pub const SET6: &str = include_str!("../../../models/warren2003-set6.toml");

/// A model with a thermostat and no other forces.
pub const IDEAL: &str =
    "title = \"ideal gas\"\nspecies = [\"A\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

/// A model of two species with a thermostat and no other forces.
pub const IDEAL_MIXTURE: &str =
    "title = \"ideal gas\"\nspecies = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n";

pub const SOFT: &str = "title = \"soft\"\nspecies = [\"A\"]\n[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\n\
                        range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";

/// Parses a scene whose text calls its model `m.toml`.
pub fn scene(model: &str, text: &str) -> Result<Scene, FileError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), model).unwrap();
    Scene::parse("s.toml", text, folder.path())
}
