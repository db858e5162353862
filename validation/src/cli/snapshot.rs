use super::{Failure, Verdict, write_json};
use crate::files::write_atomically;
use crate::output::picture::{FieldOptions, ParticleOptions, View};
use crate::output::{Configuration, OutputError, Which};
use crate::report::Figure;
use psidpd_core::model::Model;
use psidpd_core::model::kernel::{Kernel, KernelKind};
use serde_json::json;
use std::path::{Path, PathBuf};

/// A picture of the particles, or of their density, in a data, dump or XYZ file.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A LAMMPS data file, a LAMMPS text dump or an extended XYZ file.
    file: PathBuf,
    /// The picture: .png for the picture alone, .svg for one with axes and legend; default: the name of the
    /// file with .svg.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Which frame, from 0; default: the last.
    #[arg(long, value_name = "N")]
    frame: Option<usize>,
    /// The model file, for names of species and the weight function of the density.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// From where; two-dimensional systems are seen along z.
    #[arg(long, value_enum, default_value_t = Eye::Oblique)]
    view: Eye,
    /// Shows only particles within this thickness around the middle of the box, along the line of sight.
    #[arg(long, value_name = "LENGTH")]
    slice: Option<f64>,
    /// Radius of a particle.
    #[arg(long, value_name = "LENGTH")]
    radius: Option<f64>,
    /// The weighted local density in a plane through the middle of the box, instead of particles.
    #[arg(long)]
    density: bool,
    /// The density of one species only.
    #[arg(long, value_name = "NAME", requires = "density")]
    species: Option<String>,
    /// Range of the weight function; default: that of the model's first density, else 1.
    #[arg(long, value_name = "LENGTH", requires = "density")]
    range: Option<f64>,
    /// Most pixels in width and in height.
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = clap::value_parser!(u32).range(16..=8192))]
    size: u32,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Eye {
    Oblique,
    X,
    Y,
    Z,
}

impl From<Eye> for View {
    fn from(eye: Eye) -> View {
        match eye {
            Eye::Oblique => View::Oblique,
            Eye::X => View::X,
            Eye::Y => View::Y,
            Eye::Z => View::Z,
        }
    }
}

pub fn run(a: &Arguments, json: Option<&Path>) -> Result<Verdict, Failure> {
    let out = a.out.clone().unwrap_or_else(|| a.file.with_extension("svg"));
    let svg = match out.extension().and_then(|e| e.to_str()) {
        Some("svg") => true,
        Some("png") => false,
        _ => return Err(request(format!("{}: pictures end in .svg or .png", out.display()))),
    };
    for (name, value) in [("slice", a.slice), ("radius", a.radius), ("range", a.range)] {
        if let Some(value) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(request(format!("--{name} must be a positive number, is {value}")));
        }
    }
    let mut configuration = Configuration::open(&a.file, a.frame.map_or(Which::Last, Which::Number))?;
    let model = a.model.as_deref().map(Model::open).transpose()?;
    if let Some(model) = &model {
        configuration.name_species(model.species(), model.dimensions());
    }
    let frame = configuration.frame();
    let title = a.file.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let title = configuration.step.map_or(title.clone(), |step| format!("{title}, step {step}"));
    let size = [a.size as usize; 2];
    let figure = if a.density {
        let options = FieldOptions {
            view: a.view.into(),
            kernel: kernel(a, model.as_ref(), frame.dimensions)?,
            species: a.species.as_deref().map(|name| index(name, frame.names)).transpose()?,
            size,
        };
        let label = a.species.as_ref().map_or("n".to_owned(), |s| format!("n_{s}"));
        Figure::field(&title, &label, &frame, &options)
    } else {
        let options = ParticleOptions { view: a.view.into(), slice: a.slice, radius: a.radius, size };
        Figure::particles(&title, &frame, &options)
    };
    let bytes = if svg { figure.render()?.into_bytes() } else { figure.image.to_png()? };
    write_atomically(&out, &bytes)?;
    println!("{}", out.display());
    write_json(json, &json!({"picture": out, "particles": frame.len(), "step": configuration.step}))?;
    Ok(Verdict::Good)
}

fn request(message: String) -> Failure {
    Failure::from(OutputError::Request(message))
}

fn index(name: &str, names: &[String]) -> Result<usize, Failure> {
    names
        .iter()
        .position(|n| n == name)
        .ok_or_else(|| request(format!("no species {name}: there are {}", names.join(", "))))
}

/// The weight function of the model's first density, with another range if one is given.
fn kernel(a: &Arguments, model: Option<&Model>, dimensions: usize) -> Result<Kernel, Failure> {
    let own = model.map(|m| m.at(1.0)).transpose()?;
    let own = own.and_then(|f| f.densities.first().map(|d| d.kernel));
    let kind = own.map_or(KernelKind::Quadratic, |k| k.kind());
    let range = a.range.or(own.map(|k| k.range())).unwrap_or(1.0);
    Ok(Kernel::new(kind, range, dimensions))
}
