//! Pictures of the last state.

use super::super::figure::Figure;
use super::super::text::escape;
use super::{About, Item, Path, Section};
use psidpd_core::model::kernel::{Kernel, KernelKind};
use psidpd_formats::files::{PathError, open_inside, there};
use psidpd_formats::{Configuration, memory};
use psidpd_pictures::{FieldOptions, ParticleOptions, View, animate, data_url};

pub struct State {
    pub file: &'static str,
    pub configuration: Configuration,
}

impl State {
    /// Searches the files of a run, the latest first.
    pub fn find(folder: &Path, about: Option<&About>, notes: &mut Vec<String>) -> Option<State> {
        for file in ["final.data", "last-good.data", "dump.lammpstrj", "trajectory.xyz", "trajectory.gsd"] {
            let path = folder.join(file);
            if !there(&path) {
                continue;
            }
            // It is opened by its path, which must not lead elsewhere.
            if let Err(error) = open_inside(&path).map_err(PathError::at("read", &path)) {
                notes.push(error.to_string());
                continue;
            }
            // A line of a data file becomes several numbers in memory. Frames of a dump are as large, and their number is not
            // known in advance.
            if file.ends_with(".data")
                && let Ok(about_file) = path.metadata()
                && let Err(error) =
                    memory::fits(4.0 * about_file.len() as f64, || format!("{} needs", path.display()))
            {
                notes.push(format!("{error}; there are no pictures of it"));
                return None;
            }
            match Configuration::open(&path, None) {
                Ok(mut configuration) => {
                    if let Some(a) = about {
                        configuration.name_species(&a.species, a.dimensions);
                    }
                    return Some(State { file, configuration });
                }
                Err(error) => notes.push(error.to_string()),
            }
        }
        None
    }
}

pub fn section(folder: &Path, state: Option<&State>, about: Option<&About>) -> Section {
    let mut items = Vec::new();
    match state {
        None => items.push(Item::prose(
            "There is no final.data, dump, XYZ or GSD file that could be read: no picture of the particles.",
        )),
        Some(state) => figures(state, about, &mut items),
    }
    match animate(folder) {
        Ok(Some(png)) => items.push(Item::Figure {
            svg: format!(
                "<img class=\"movie\" alt=\"{}\" src=\"{}\"/>",
                escape("The particles along the run, repeated"),
                data_url(&png)
            ),
            caption: "The run, from the pictures in snapshots/.".into(),
        }),
        Ok(None) => items.push(Item::prose(
            "There are no snapshots along the run to be shown as a film: [output] snapshot = N makes one every \
             N steps.",
        )),
        Err(error) => items.push(Item::Prose(format!("No film: {error}"))),
    }
    Section::new("Pictures", items)
}

fn figures(state: &State, about: Option<&About>, items: &mut Vec<Item>) {
    let frame = state.configuration.frame();
    let file = state.file;
    let mut push = |figure: Figure, caption: String| match figure.render() {
        Ok(svg) => items.push(Item::Figure { svg, caption }),
        Err(error) => items.push(Item::Prose(format!("{}: {error}", figure.title))),
    };
    let all = ParticleOptions::default();
    let caption = if frame.dimensions == 3 { "; farther particles are paler" } else { "" };
    push(Figure::particles("Particles", &frame, &all), format!("State of {file}{caption}."));
    if frame.dimensions == 3 {
        let thickness = 1.0;
        let slice = ParticleOptions { view: View::Y, slice: Some(thickness), ..all };
        push(
            Figure::particles("Particles in a slice", &frame, &slice),
            format!(
                "Particles within {} of the plane through the middle of the box, seen along y.",
                0.5 * thickness
            ),
        );
    }
    let (options, name) = density(about, frame.dimensions);
    let unit = super::super::text::of_lengths("1/volume", frame.dimensions);
    let named = |name: &str| super::super::text::typeset(&format!("{name} [{unit}]"));
    let (kernel, range) = (options.kernel.kind().name(), options.kernel.range());
    let place = if frame.dimensions == 3 { ", in the plane through the middle of the box" } else { "" };
    let caption = format!("Weighted local density with the {kernel} kernel of range {range}{place}.");
    push(Figure::field("Local density", &named(&name), &frame, &options), caption.clone());
    if frame.names.len() > 1 {
        for (k, species) in frame.names.iter().enumerate() {
            let options = FieldOptions { species: Some(k), ..options };
            let title = format!("Local density of {species}");
            push(
                Figure::field(&title, &named(&format!("{name}_{species}")), &frame, &options),
                caption.clone(),
            );
        }
    }
}

/// The first density of the model, or a quadratic density of range 1.
fn density(about: Option<&About>, dimensions: usize) -> (FieldOptions, String) {
    let own = about.and_then(|a| a.densities.first()).and_then(|d| {
        let kind = KernelKind::from_name(&d.kernel)?;
        let good = d.range.is_finite() && d.range > 0.0;
        good.then(|| (FieldOptions::new(Kernel::new(kind, d.range, dimensions)), d.name.clone()))
    });
    own.unwrap_or_else(|| (FieldOptions::coarse(dimensions), "n".into()))
}
