use super::run::between;
use super::*;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use psidpd_core::engine::pair_sums::{Evaluator, for_each_pair};
use psidpd_core::engine::{Pool, check_reach};
use psidpd_core::model::kernel::{Kernel, KernelKind};
use psidpd_formats::files::SVG;
use psidpd_formats::{Configuration, FormatError, Frame};
use psidpd_pictures::{FieldOptions, Image, ParticleOptions, View};
use psidpd_report::{Figure, extremes};

/// A picture of the particles, or of their density, in a data, dump, XYZ or GSD file; or a film of all its frames.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A LAMMPS data file, a LAMMPS text dump, an extended XYZ file, or a GSD file that psidpd wrote.
    file: PathBuf,
    /// The picture: .png for the picture alone, .svg for one with axes and legend, .gif for a film of the frames of the
    /// file; default: the name of the file with .svg.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Which frame, from 0; default: the last.
    #[arg(long, value_name = "N")]
    frame: Option<usize>,
    /// The model file, for names of species and the weight function of the density.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Direction of view. Two-dimensional systems are seen along z.
    #[arg(long, default_value = "oblique", value_parser = view())]
    view: View,
    /// Shows only particles in a slice of this thickness through the middle of the box, across the line of sight.
    #[arg(long, value_name = "LENGTH")]
    slice: Option<f64>,
    /// How far in front of the middle the slice is, or the plane of --density; negative: behind it.
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0, allow_negative_numbers = true)]
    offset: f64,
    /// Radius of a particle.
    #[arg(long, value_name = "LENGTH")]
    radius: Option<f64>,
    /// What colours of particles stand for; psi needs --model and --kT.
    #[arg(long, value_enum, default_value_t = Colour::Species, conflicts_with = "density")]
    colour: Colour,
    /// kT, for the colours of psi.
    #[arg(long = "kT", value_name = "T", allow_negative_numbers = true, value_parser = temperature)]
    kt: Option<f64>,
    /// The largest number of frames in a film; from a longer trajectory, frames are taken at even intervals.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = between(2, 1000))]
    frames: u32,
    /// The weighted local density in a plane through the middle of the box, instead of particles.
    #[arg(long)]
    density: bool,
    /// The density of one species only.
    #[arg(long, value_name = "NAME", requires = "density")]
    species: Option<String>,
    /// Range of the weight function; default: that of the model's first density, else 1.
    #[arg(long, value_name = "LENGTH", requires = "density")]
    range: Option<f64>,
    /// Largest width and height in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = between(16, 8192))]
    size: u32,
}

/// What the colour of a particle stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Colour {
    Species,
    /// The weighted local density at the particle, without itself.
    Density,
    /// The size of its velocity.
    Speed,
    /// The excess free energy of the particle.
    Psi,
}

fn view() -> impl TypedValueParser<Value = View> {
    PossibleValuesParser::new(["oblique", "x", "y", "z"]).map(|name| match name.as_str() {
        "x" => View::X,
        "y" => View::Y,
        "z" => View::Z,
        _ => View::Oblique,
    })
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.file].into_iter().chain(&self.model)).writes([self.picture()])
    }

    /// The file for the picture.
    fn picture(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| self.file.with_extension("svg"))
    }
}

/// The time in centiseconds for which a film shows each frame.
const DELAY: u16 = 12;

pub fn run(a: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let out = a.picture();
    let kind = out.extension().and_then(|e| e.to_str()).unwrap_or("");
    if !["svg", "png", "gif"].contains(&kind) {
        return Err(request(format!("{}: pictures end in .svg or .png, films in .gif", out.display())));
    }
    for (name, value) in [("slice", a.slice), ("radius", a.radius), ("range", a.range)] {
        if let Some(value) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(request(format!("--{name} must be a positive number, is {value}")));
        }
    }
    if !a.offset.is_finite() {
        return Err(request(format!("--offset must be a number, is {}", a.offset)));
    }
    let model = a.model.as_deref().map(Model::open).transpose()?;
    let open = |number| -> Result<Configuration, Failure> {
        let mut configuration = Configuration::open(&a.file, number)?;
        if let Some(model) = &model {
            configuration.name_species(model.species(), model.dimensions());
        }
        Ok(configuration)
    };
    if kind == "gif" {
        let last = Configuration::count(&a.file)?.saturating_sub(1);
        let most = (a.frames as usize).min(last + 1);
        // The last frame is always chosen.
        let chosen = (0..most).map(|k| (k * last) / (most - 1).max(1));
        let frames = chosen.map(|k| open(Some(k))).collect::<Result<Vec<_>, _>>()?;
        let values = frames.iter().map(|f| values(a, model.as_ref(), f)).collect::<Result<Vec<_>, _>>()?;
        let ends = extremes(values.iter().flatten().flatten().copied());
        let images = frames
            .iter()
            .zip(&values)
            .map(|(f, v)| {
                let mut image = figure(a, model.as_ref(), f, v.as_deref(), ends)?.with_scale_bar();
                match (f.time, f.step) {
                    (Some(time), _) => image.stamp(&format!("t = {}", (1e6 * time).round() / 1e6)),
                    (None, Some(step)) => image.stamp(&format!("step {step}")),
                    (None, None) => {}
                }
                Ok(image)
            })
            .collect::<Result<Vec<_>, Failure>>()?;
        write_bytes(&out, told.existing, &Image::to_gif(&images, DELAY).map_err(request)?)?;
        say!("{}", out.display());
        return conclude(told, &json!({"film": shown(&out), "frames": images.len(), "colours": ends}), true);
    }
    let configuration = open(a.frame)?;
    let values = values(a, model.as_ref(), &configuration)?;
    let ends = extremes(values.iter().flatten().copied());
    let figure = figure(a, model.as_ref(), &configuration, values.as_deref(), ends)?;
    let bytes = if kind == "svg" {
        (figure.render()? + SVG).into_bytes()
    } else {
        figure.with_scale_bar().to_png()?
    };
    write_bytes(&out, told.existing, &bytes)?;
    say!("{}", out.display());
    let particles = configuration.x.len();
    let colours = values.map(|_| ends);
    let results = json!({"picture": shown(&out), "particles": particles, "step": configuration.step, "colours": colours});
    conclude(told, &results, true)
}

/// The values that the colours of particles show; `None` for species.
fn values(
    a: &Arguments,
    model: Option<&Model>,
    configuration: &Configuration,
) -> Result<Option<Vec<f64>>, Failure> {
    let frame = configuration.frame();
    Ok(match a.colour {
        Colour::Species => None,
        Colour::Density => {
            let kernel = kernel(a, model, frame.dimensions)?;
            within_reach(&frame, kernel.range())?;
            let mut n = vec![0.0; frame.len()];
            for_each_pair(frame.x, frame.domain, frame.dimensions, kernel.range(), |p| {
                let w = kernel.value(p.r);
                n[p.i] += w;
                n[p.j] += w;
            });
            Some(n)
        }
        Colour::Speed => {
            let v = frame.v.ok_or_else(|| request("the file has no velocities".into()))?;
            Some(v.iter().map(|v| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()).collect())
        }
        Colour::Psi => {
            let (Some(model), Some(kt)) = (model, a.kt) else {
                return Err(request("--colour psi needs --model and --kT".into()));
            };
            let fluid = model.at(kt)?;
            within_reach(&frame, fluid.cutoff())?;
            let evaluator = Evaluator::new(fluid)?;
            if configuration.species.iter().any(|s| *s as usize >= model.species().len()) {
                return Err(request(format!(
                    "the model has only {} species, the file has more",
                    model.species().len()
                )));
            }
            let alone = Pool::new(std::num::NonZeroUsize::MIN);
            Some(evaluator.evaluate(&alone, frame.x, frame.species, frame.domain).psi.value)
        }
    })
}

fn figure(
    a: &Arguments,
    model: Option<&Model>,
    configuration: &Configuration,
    values: Option<&[f64]>,
    ends: [f64; 2],
) -> Result<Figure, Failure> {
    let frame = configuration.frame();
    let title = a.file.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    let title = configuration.step.map_or(title.clone(), |step| format!("{title}, step {step}"));
    let size = [a.size as usize; 2];
    if a.density {
        let kernel = kernel(a, model, frame.dimensions)?;
        within_reach(&frame, kernel.range())?;
        let options = FieldOptions {
            view: a.view,
            offset: a.offset,
            kernel,
            species: a.species.as_deref().map(|name| index(name, frame.names)).transpose()?,
            size,
        };
        let label = a.species.as_ref().map_or("n".to_owned(), |s| format!("n_{s}"));
        return Ok(Figure::field(&title, &label, &frame, &options));
    }
    let options = ParticleOptions { view: a.view, slice: a.slice, offset: a.offset, radius: a.radius, size };
    let label = match a.colour {
        Colour::Density => "n",
        Colour::Speed => "speed",
        Colour::Species | Colour::Psi => "ψ",
    };
    Ok(match values {
        Some(values) => Figure::valued(&title, label, &frame, &options, values, ends),
        None => Figure::particles(&title, &frame, &options),
    })
}

/// Refuses ranges whose periodic images would fill the memory.
fn within_reach(frame: &Frame, range: f64) -> Result<(), Failure> {
    check_reach(frame.domain, frame.dimensions, range, frame.len())
        .map_err(|error| request(error.to_string()))
}

fn request(message: String) -> Failure {
    Failure::from(FormatError::Request(message))
}

fn index(name: &str, names: &[String]) -> Result<usize, Failure> {
    names
        .iter()
        .position(|n| n == name)
        .ok_or_else(|| request(format!("no species {name} in the model; it has {}", names.join(", "))))
}

/// The weight function of the model's first density, with the range of the command line if given.
fn kernel(a: &Arguments, model: Option<&Model>, dimensions: usize) -> Result<Kernel, Failure> {
    let own = model.map(|m| m.at(1.0)).transpose()?;
    let own = own.and_then(|f| f.densities.first().map(|d| d.kernel));
    let kind = own.map_or(KernelKind::Quadratic, |k| k.kind());
    let range = a.range.or(own.map(|k| k.range())).unwrap_or(1.0);
    Ok(Kernel::new(kind, range, dimensions))
}
