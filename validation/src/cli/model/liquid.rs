use super::*;
use psidpd_experiments::model::liquid::{ENTRIES, Entries, Found, Liquid, LiquidError, Row, model};

#[derive(Debug, clap::Args)]
pub struct OfLiquid {
    /// What it is called.
    name: String,
    #[command(flatten)]
    numbers: Numbers,
    /// A TOML file with these numbers, as sound_speed = 1497.0; options replace them.
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    #[command(flatten)]
    search: Search,
}

#[derive(Debug, clap::Args)]
struct Numbers {
    /// Mass density.
    #[arg(long, value_name = "KG/M3")]
    density: Option<f64>,
    /// Surface tension.
    #[arg(long, value_name = "N/M")]
    tension: Option<f64>,
    /// Isothermal compressibility.
    #[arg(long, value_name = "1/PA")]
    compressibility: Option<f64>,
    /// Speed of sound, instead of the compressibility. Sound is isothermal in a fluid with a thermostat.
    #[arg(long, value_name = "M/S")]
    sound_speed: Option<f64>,
    /// Shear viscosity.
    #[arg(long, value_name = "PA.S")]
    viscosity: Option<f64>,
    /// Temperature. If left out the unit of energy is free, and particles fluctuate more than those of the liquid.
    #[arg(long, value_name = "K")]
    temperature: Option<f64>,
    /// Molar mass.
    #[arg(long, value_name = "KG/MOL")]
    molar_mass: Option<f64>,
    /// Size of a particle: molecules in it; needs the molar mass.
    #[arg(long, value_name = "N")]
    molecules: Option<f64>,
    /// Size of a particle: the unit of length, which is the range of the forces.
    #[arg(long, value_name = "M")]
    rc: Option<f64>,
    /// Size of a particle: the diameter of a drop of so many particles.
    #[arg(long, value_name = "M")]
    drop: Option<f64>,
    /// Particles of the drop.
    #[arg(long, value_name = "N")]
    particles: Option<f64>,
    /// Particles in the cube of the unit of length; 6 if left out.
    #[arg(long, value_name = "RHO")]
    number_density: Option<f64>,
    /// A length of the scene, for dimensionless numbers.
    #[arg(long, value_name = "M")]
    length: Option<f64>,
    /// A velocity of the scene.
    #[arg(long, value_name = "M/S")]
    velocity: Option<f64>,
    /// An acceleration of the scene.
    #[arg(long, value_name = "M/S2")]
    gravity: Option<f64>,
}

impl Numbers {
    /// In the order of [`ENTRIES`].
    fn all(&self) -> [Option<f64>; ENTRIES.len()] {
        let n = self;
        [
            n.density,
            n.tension,
            n.compressibility,
            n.sound_speed,
            n.viscosity,
            n.temperature,
            n.molar_mass,
            n.molecules,
            n.rc,
            n.drop,
            n.particles,
            n.number_density,
            n.length,
            n.velocity,
            n.gravity,
        ]
    }
}

impl OfLiquid {
    pub fn files(&self) -> Files {
        Files::reads(&self.data).writes([self.search.out.clone()])
    }
}

pub fn run(a: &OfLiquid, told: Told) -> Result<Verdict, Failure> {
    let liquid = Liquid::new(&a.name, &entries(a)?).map_err(ExperimentError::from)?;
    say_wanted(&liquid);
    let found = model(&liquid, a.search.seed, &command(a), &mut |line| say!("{line}"))?;
    print(&found);
    a.search.write(told, found.text.as_deref(), found.good)?;
    conclude(told, &found, found.good)
}

/// The numbers of the file, and those of options in their place.
fn entries(a: &OfLiquid) -> Result<Entries, Failure> {
    let mut all = a.data.as_deref().map_or(Ok(Entries::default()), Entries::read)?;
    for (entry, value) in ENTRIES.iter().zip(a.numbers.all()) {
        if let Some(value) = value {
            all.set(entry.key, value).map_err(|e: LiquidError| ExperimentError::from(e))?;
        }
    }
    Ok(all)
}

fn say_wanted(liquid: &Liquid) {
    let units = &liquid.units;
    let molecules = liquid.molecules().map_or(String::new(), |n| format!(" ({n:.2} molecules)"));
    say!(
        "r_c = {:.3e} m, a particle has {:.3e} kg{molecules}, kT = {:.3e} J{}",
        units.length,
        units.mass,
        units.energy,
        if liquid.entries.get("temperature").is_some() { "" } else { " (free)" }
    );
    let goals = &liquid.goals;
    let shown = |goal: Option<f64>| goal.map_or("free".to_owned(), |x| format!("{x:.2}"));
    say!(
        "in these units: density {}, stiffness dp/drho {}, tension {}, viscosity {}",
        goals.density,
        shown(goals.stiffness),
        shown(goals.tension),
        shown(goals.viscosity)
    );
}

fn print(found: &Found) {
    let mut table = Table::new(["", "wanted", "got", "off by", "allowed"]);
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    for row in &found.rows {
        let Row { name, unit, wanted, got, tolerance } = row;
        table.push([
            format!("{name}, {unit}"),
            wanted.map_or("free".to_owned(), |x| format!("{x:.4e}")),
            shown(*got),
            wanted.filter(|_| got.value.is_finite()).map_or("".to_owned(), |x| percent(got.value / x - 1.0)),
            wanted
                .and(*tolerance)
                .map_or("".to_owned(), |x| percent(x) + if row.is_met() { "" } else { ", missed" }),
        ]);
    }
    say!("");
    say::table(&table);
    if let Some(step) = found.advice() {
        say!("step: {step}");
    }
    for number in &found.numbers {
        let shown = |x: Option<f64>| x.map_or("unknown".to_owned(), |x| format!("{x:.3e}"));
        let off = if number.is_off(0.1) { ": not met" } else { "" };
        say!(
            "{}: {} of the liquid, {} of the model{off}",
            number.name,
            shown(number.of_liquid),
            shown(number.of_model)
        );
    }
    found.refusals.iter().for_each(|refusal| say!("MISSED: {refusal}"));
}

/// The command line that repeats the search.
fn command(a: &OfLiquid) -> String {
    let mut text = format!("psidpd model liquid {:?}", a.name);
    for (entry, value) in ENTRIES.iter().zip(a.numbers.all()) {
        if let Some(value) = value {
            text += &format!(" --{} {value:?}", entry.key.replace('_', "-"));
        }
    }
    if let Some(data) = &a.data {
        text += &format!(" --data {}", file_name(data));
    }
    text + &a.search.command()
}
