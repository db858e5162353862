use super::*;
use psidpd_experiments::model::wall::{Found, Sought, TOLERANCE, wall};
use psidpd_observe::Measured;

#[derive(Debug, clap::Args)]
pub struct OfWall {
    /// The model file of the liquid, of one species.
    model: PathBuf,
    /// The contact angle, through the liquid.
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    contact_angle: f64,
    /// kT.
    #[arg(long = "kT", value_name = "T", default_value_t = 1.0, allow_negative_numbers = true, value_parser = temperature)]
    kt: f64,
    /// About the number density of the liquid beside its vapour; that of theory if left out.
    #[arg(long, value_name = "RHO", allow_negative_numbers = true, value_parser = positive)]
    density: Option<f64>,
    /// The viscosity of the liquid, so that it does not slip on the wall of the scene that is written.
    #[arg(long, value_name = "ETA", allow_negative_numbers = true, value_parser = positive)]
    viscosity: Option<f64>,
    #[command(flatten)]
    search: Search,
}

impl OfWall {
    pub fn files(&self) -> Files {
        Files::reads([&self.model]).writes([self.search.out.clone()])
    }
}

pub fn run(a: &OfWall, told: Told) -> Result<Verdict, Failure> {
    let sought = Sought {
        model_file: a.model.clone(),
        model: Model::open(&a.model)?,
        kt: a.kt,
        density: a.density,
        angle: a.contact_angle,
        seed: a.search.seed,
    };
    let found = wall(&sought, &mut |line| say!("{line}"))?;
    print(&found);
    let scene = found.scene((&reference(a), a.viscosity), sought.seed, &command(a));
    a.search.write(told, scene.as_deref(), found.good)?;
    conclude(told, &found, found.good)
}

fn print(found: &Found) {
    let mut table = Table::new(["", "wanted", "got", "allowed"]);
    for (route, got) in
        [("contact angle by three tensions, degrees", found.young), ("by a ridge, degrees", found.ridge)]
    {
        let missed = if found.meets(got) { "" } else { ", missed" };
        table.push([route.to_owned(), found.wanted.to_string(), shown(got), format!("{TOLERANCE}{missed}")]);
    }
    let mut free =
        |name: &str, got: Measured| table.push([name.to_owned(), "free".into(), shown(got), String::new()]);
    free("tension of the liquid and its vapour", found.slab.tension);
    if let Some(film) = found.film {
        free("of the wall and the liquid", film.liquid.unwrap_or(Measured::NONE));
        free("of the wall and the vapour", film.vapour);
    }
    free("density of the liquid", found.slab.density);
    say!("");
    say::table(&table);
    if let Some(lines) = found.lines("\"zlo\"", None) {
        say!("{}", lines.trim_end());
    }
    if let Some(why) = &found.refusal {
        say!("MISSED: {why}");
    }
}

/// The model as the scene names it: by its file name beside the scene.
fn reference(a: &OfWall) -> String {
    let folder =
        |path: &Path| std::path::absolute(path).ok().and_then(|path| path.parent().map(Path::to_owned));
    match folder(&a.model) == folder(&a.search.out) {
        true => file_name(&a.model),
        false => std::path::absolute(&a.model).unwrap_or_else(|_| a.model.clone()).display().to_string(),
    }
}

/// The command line that repeats the search.
fn command(a: &OfWall) -> String {
    let mut text = format!(
        "psidpd model wall {} --contact-angle {} --kT {}",
        file_name(&a.model),
        a.contact_angle,
        a.kt
    );
    for (option, value) in [("density", a.density), ("viscosity", a.viscosity)] {
        if let Some(value) = value {
            text += &format!(" --{option} {value}");
        }
    }
    text + &a.search.command()
}
