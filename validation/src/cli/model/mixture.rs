use super::*;
use psidpd_experiments::model::mixture::{self, Found, Liquid, Sought, TOLERANCE};
use psidpd_observe::Measured;

#[derive(Debug, clap::Args)]
pub struct OfMixture {
    /// The model files of both liquids, of one species each.
    #[arg(num_args = 2, value_names = ["MODEL", "OTHER"], required = true)]
    models: Vec<PathBuf>,
    /// The tension of the interface between them: in N/m if the models have units, else in theirs.
    #[arg(long, value_name = "TENSION", allow_negative_numbers = true, value_parser = positive)]
    tension: f64,
    /// The names of the species; those of the files if left out.
    #[arg(long, num_args = 2, value_names = ["NAME", "OTHER"])]
    species: Option<Vec<String>>,
    /// kT.
    #[arg(long = "kT", value_name = "T", default_value_t = 1.0, allow_negative_numbers = true, value_parser = temperature)]
    kt: f64,
    /// About the number densities of the liquids beside their vapours; those of theory if left out.
    #[arg(long, num_args = 2, value_names = ["RHO", "OTHER"], allow_negative_numbers = true, value_parser = positive)]
    densities: Option<Vec<f64>>,
    #[command(flatten)]
    search: Search,
}

impl OfMixture {
    pub fn files(&self) -> Files {
        Files::reads(&self.models).writes([self.search.out.clone()])
    }
}

/// A name for the species of a file: its own without what names of species cannot have.
fn name(file: &Path) -> String {
    let stem = file.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.is_empty() { "liquid".into() } else { name }
}

pub fn run(a: &OfMixture, told: Told) -> Result<Verdict, Failure> {
    let pair = |list: &[f64]| [list[0], list[1]];
    let names = a.species.clone().unwrap_or_else(|| a.models.iter().map(|file| name(file)).collect());
    let liquid = |k: usize| Liquid::open(&names[k], &a.models[k]);
    let sought = Sought {
        liquids: [liquid(0)?, liquid(1)?],
        kt: a.kt,
        densities: a.densities.as_deref().map(pair),
        tension: a.tension,
        seed: a.search.seed,
    };
    let found = mixture::mixture(&sought, &mut |line| say!("{line}"))?;
    print(&found);
    let text = match found.cross.is_finite() {
        true => Some(mixture::text(&sought, found.cross, &head(a, &found))?),
        false => None,
    };
    a.search.write(told, text.as_deref(), found.good)?;
    conclude(told, &found, found.good)
}

fn print(found: &Found) {
    let Found { species: [first, second], unit, .. } = found;
    let mut table = Table::new(["", "wanted", "got", "allowed"]);
    let missed = if found.good { "" } else { ", missed" };
    table.push([
        format!("tension of {first} and {second}"),
        format!("{:e}", found.wanted),
        shown(found.tension()),
        format!("{:.0} %{missed}", 100.0 * TOLERANCE),
    ]);
    let mut free = |name: String, got: Measured| table.push([name, "free".into(), shown(got), String::new()]);
    for (name, alone) in found.species.iter().zip(&found.alone) {
        free(format!("of {name} and its vapour"), alone.tension.times(*unit));
    }
    if let Some(layers) = &found.layers {
        free(format!("fraction of {second} in {first}"), layers.dissolved[0]);
        free(format!("fraction of {first} in {second}"), layers.dissolved[1]);
    }
    say!("");
    say::table(&table);
    for line in [spreads(found), mass(found)].into_iter().flatten() {
        say!("{line}");
    }
    if let Some(why) = &found.refusal {
        say!("MISSED: {why}");
    }
}

/// Whether one liquid spreads on the other, where this is resolved.
fn spreads(found: &Found) -> Option<String> {
    let (below, coefficient) = found.spreading();
    if coefficient.value.abs() < 2.0 * coefficient.error || !coefficient.value.is_finite() {
        return None;
    }
    let [film, below] = [1 - below, below].map(|k| &found.species[k]);
    let says = if coefficient.value > 0.0 { "spreads" } else { "is a lens" };
    Some(format!("{film} {says} on {below}: spreading coefficient {}", shown(coefficient)))
}

/// The mass that scenes need.
fn mass(found: &Found) -> Option<String> {
    let of = |mass: f64| format!("[masses] of scenes: {} = {mass:.6}", found.species[1]);
    ((found.mass - 1.0).abs() > 1e-9).then(|| of(found.mass))
}

/// What the comment of the file says.
fn head(a: &OfMixture, found: &Found) -> String {
    let mut head = format!("By\n  {}\n", command(a));
    let [first, second] = &found.species;
    head += &format!(
        "The tension of {first} and {second} is {}, wanted {:e}.\n",
        shown(found.tension()),
        found.wanted
    );
    if let Some(mass) = mass(found) {
        head += &format!("{mass}\n");
    }
    if let Some(why) = &found.refusal {
        head += &format!("MISSED: {why}\n");
    }
    head
}

/// The command line that repeats the search.
fn command(a: &OfMixture) -> String {
    let files: Vec<String> = a.models.iter().map(|file| file_name(file)).collect();
    let mut text =
        format!("psidpd model mixture {} --tension {:e} --kT {}", files.join(" "), a.tension, a.kt);
    if let Some(names) = &a.species {
        text += &format!(" --species {}", names.join(" "));
    }
    if let Some(densities) = &a.densities {
        text += &format!(" --densities {} {}", densities[0], densities[1]);
    }
    text + &a.search.command()
}
