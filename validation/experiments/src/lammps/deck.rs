//! The commands of a run up to its pair style.

use super::style::PairStyle;
use std::fmt::Write;
use std::path::Path;

#[derive(Debug, Clone)]
pub struct Deck<'a> {
    pub style: &'a PairStyle,
    pub kt: f64,
    pub seed: u64,
    /// The plugin to load, if the style is one of its.
    pub plugin: Option<&'a Path>,
    pub data: String,
    /// Commands for accelerated styles.
    pub acceleration: &'a str,
    pub newton: bool,
    /// Whether particles can be found by tag.
    pub map: bool,
    /// How often the box is repeated along x.
    pub copies: usize,
    pub skin: f64,
    pub build: &'a str,
}

impl<'a> Deck<'a> {
    /// The deck at kT = 1, as comparisons have it.
    pub fn new(style: &'a PairStyle, seed: u64, data: String) -> Deck<'a> {
        Deck {
            style,
            kt: 1.0,
            seed,
            plugin: None,
            data,
            acceleration: "",
            newton: true,
            map: true,
            copies: 1,
            skin: 0.3,
            build: "every 1 check yes",
        }
    }

    pub fn text(&self) -> String {
        let mut text = format!("units lj\n{}atom_style {}\n", self.acceleration, self.style.atom_style());
        if self.map {
            text += "atom_modify map array\n";
        }
        let newton = if self.newton { "on" } else { "off" };
        // Writing to a String cannot fail.
        let _ = write!(text, "newton {newton}\ncomm_modify vel yes\nread_data \"{}\"\n", self.data);
        if self.copies > 1 {
            let _ = writeln!(text, "replicate {} 1 1", self.copies);
        }
        let _ = write!(text, "neighbor {} bin\nneigh_modify delay 0 {}\n", self.skin, self.build);
        if let Some(plugin) = self.plugin.filter(|_| self.style.is_of_the_plugin()) {
            let _ = writeln!(text, "plugin load \"{}\"", plugin.display());
        }
        text + &self.style.commands(self.kt, self.seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fluids::{GAMMA, SET6};

    /// What LAMMPS's manual wants before the box is made stands before `read_data`, and only styles of the plugin load it.
    #[test]
    fn settings_stand_before_the_box_and_the_plugin_before_its_styles() {
        let plugin = Some(Path::new("/p.so"));
        let own = PairStyle::Mdpd(SET6.pair(GAMMA));
        let text = Deck { plugin, newton: false, copies: 2, ..Deck::new(&own, 7, "a.data".into()) }.text();
        let (before, after) = text.split_once("read_data \"a.data\"\nreplicate 2 1 1\n").unwrap();
        for line in ["units lj\n", "atom_style mdpd\n", "newton off\n", "atom_modify map array\n"] {
            assert!(before.contains(line), "{text}");
        }
        assert!(after.ends_with(
            "pair_style hybrid/overlay mdpd/rhosum mdpd 1.0 1.0 7\npair_coeff 1 1 mdpd/rhosum 0.75\n\
             pair_coeff 1 1 mdpd -40.0 25.0 18.0 1.0 0.75\n"
        ));
        assert!(!text.contains("plugin"), "{text}");
        let psi =
            PairStyle::Psi { model: "m.toml".into(), species: "A B".into(), words: "precision mixed".into() };
        let text = Deck { plugin, ..Deck::new(&psi, 7, "a.data".into()) }.text();
        assert!(text.ends_with(
            "plugin load \"/p.so\"\npair_style dpd/psi 1.0 7 precision mixed\npair_coeff * * \"m.toml\" A B\n"
        ));
    }
}
