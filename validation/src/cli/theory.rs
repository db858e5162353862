use super::check::{number_density, per_species};
use super::run::at_least;
use super::*;
use psidpd_core::theory::{MeanField, TheoryError, composition_critical_point, critical_point};
use psidpd_dynamics::prediction::{Prediction, predict, published};
use psidpd_experiments::theory::measure::{self, Effort};
use psidpd_experiments::theory::page::{self, Scope};
use psidpd_report::Headline;
use psidpd_report::quantity::{decimal, number, with_error};
use serde_json::Value;

/// Mean field: equation of state, critical point, spinodal, binodal, surface tension; and how far to trust it.
///
/// Mean field leaves out correlations. Where they matter this verb says so, by how much, and what the fluid is expected to do;
/// --measure runs it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The model file.
    model: PathBuf,
    /// kT; several with commas.
    #[arg(
        long = "kT",
        value_name = "T,…",
        value_delimiter = ',',
        default_value = "1",
        allow_negative_numbers = true,
        value_parser = temperature
    )]
    kt: Vec<f64>,
    /// Number density, total or one for each species: where a mixture is looked at, and the middle of the
    /// table of the equation of state.
    #[arg(long, value_name = "RHO", value_delimiter = ',', value_parser = number_density)]
    density: Vec<f64>,
    /// Rows of the table.
    #[arg(long, default_value_t = 12)]
    rows: usize,
    /// Range of kT in which a critical point is looked for, as multiples of kT.
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', num_args = 1..=2, default_values_t = [0.05, 20.0])]
    search: Vec<f64>,
    /// Measure the fluid in short runs, and compare with mean field: homogeneous at --density, and a slab of liquid if
    /// there should be one. Some seconds for each kT.
    #[arg(long)]
    measure: bool,
    /// Steps of each run of --measure.
    #[arg(long, value_name = "N", default_value_t = 5000, value_parser = at_least(30))]
    steps: u64,
    /// Time step of --measure.
    #[arg(long, default_value_t = 0.01)]
    dt: f64,
    /// Write a page with plots: p(rho), phase diagram, tension and width over kT, compositions of a mixture.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.model]).writes(self.report.clone())
    }
}

/// The assumptions behind the answers for a mixture.
const ASSUMPTIONS: [(&str, &str); 4] = [
    (
        "critical point and spinodal",
        "from the lowest eigenvalue of d2f/drho_a drho_b, in which composition and density change together; at the critical \
         point f has no third derivative along its eigenvector",
    ),
    (
        "coexistence",
        "equal chemical potentials of every species and equal pressure; the phases share the particles of these densities",
    ),
    (
        "binodal at this pressure",
        "equal chemical potentials of every species and this pressure, that of the homogeneous mixture",
    ),
    (
        "binodal and interface at this density",
        "the total density is held, as in Pagonabarraga and Frenkel; given where the pressures of the phases are equal too, \
         and of the interface only the composition changes across it",
    ),
];

/// A sentence about rows with empty cells.
fn without_numbers(densities: &[f64]) -> Option<String> {
    let (first, last) = (densities.first()?, densities.last()?);
    let place = if first == last { format!("{first:.6}") } else { format!("{first:.6} to {last:.6}") };
    Some(match *last == 0.0 {
        true => "an empty cell has no value: at density 0 there are no particles to share an energy".into(),
        false => {
            format!("an empty cell has no value: psi or its slope is not finite at densities {place}")
        }
    })
}

/// Shows a named answer, or the reason why there is none. The absence of coexistence is an answer too.
fn answer<T>(
    name: &'static str,
    found: Result<T, TheoryError>,
    show: impl FnOnce(T) -> Value,
) -> (&'static str, Value) {
    let value = found.map_or_else(|why| json!({ "none": why.to_string() }), show);
    // Each answer is shown when it is there: some take seconds.
    say!("{name}: {}", shown(&value));
    (name, value)
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let (model, set) = arguments.settings.model(&arguments.model)?;
    let kts = set.map_or_else(|| arguments.kt.clone(), |kt| vec![kt]);
    let (mut all, mut defined) = (Vec::new(), true);
    let mut scope = Scope {
        kts: &kts,
        density: 3.0,
        range: [f64::INFINITY, 0.0],
        tension: Vec::new(),
        doubts: Vec::new(),
    };
    for (k, kt) in kts.iter().enumerate() {
        if k > 0 {
            say!("");
        }
        let (value, good) = one(arguments, &model, *kt, &mut scope)?;
        all.push(value);
        defined &= good;
    }
    if let Some(path) = &arguments.report {
        let page = page::page(&model, &scope)?.render();
        write_bytes(path, told.existing, page.as_bytes())?;
        say!("report: {}", path.display());
    }
    match all.as_slice() {
        [single] => conclude(told, single, defined),
        several => conclude(told, &json!({"title": model.title, "temperatures": several}), defined),
    }
}

/// The answers at one temperature, and whether the pressure is defined.
fn one(arguments: &Arguments, model: &Model, kt: f64, scope: &mut Scope) -> Result<(Value, bool), Failure> {
    let fluid = model.at(kt)?;
    let theory = MeanField::new(&fluid)?;
    let species = model.species().len();
    let prediction = predict(&fluid, arguments.density.first().copied());
    let densities = per_species(&arguments.density, species)
        .unwrap_or_else(|| vec![prediction.as_ref().map_or(3.0, |p| p.density) / species as f64; species]);
    if densities.len() != species {
        let error = psidpd_experiments::ExperimentError::Densities { given: densities.len(), species };
        return Err(error.into());
    }
    let [low, high] = arguments.search[..] else {
        return Err(TheoryError::NoCriticalPoint(0.0, 0.0).into());
    };
    let range = [low * kt, high * kt];
    let total: f64 = densities.iter().sum();
    scope.density = scope.density.max(total);
    scope.range = [scope.range[0].min(range[0]), scope.range[1].max(range[1])];

    say!("{} at kT = {}", model.title, number(kt));
    let rows = equation_of_state(&theory, &densities, arguments.rows);
    let middle = theory.pressure(&densities);
    let defined = middle.is_finite();
    if !defined {
        say!("at density {} there is no pressure: psi or its slope is not finite there\n", number(total));
    }

    let answers = answers(&theory, model, &densities, range);
    if species == 2 {
        say!("composition and spinodal: the fraction of {}", model.species()[0]);
        for (of, rests_on) in ASSUMPTIONS {
            say!("{of}: {rests_on}");
        }
    }
    let known = published(model, kt, Some(total));
    scope.tension.extend(known.iter().filter(|p| p.0 == "tension").map(|p| (kt, p.1, "published")));
    let measured = if arguments.measure {
        measure(arguments, model, kt, &densities, prediction.as_ref())?
    } else {
        Vec::new()
    };
    let found = |name: &str| measured.iter().find_map(|h: &Headline| h.get(name));
    if let Some(t) = found("tension") {
        scope.tension.push((kt, [t.value, t.error.unwrap_or(f64::NAN)], "measured"));
    }
    if prediction.is_some() || !measured.is_empty() {
        let table = beside(total, middle, prediction.as_ref(), &known, &measured);
        say!("");
        say::table(&table);
    }
    for note in measured.iter().flat_map(|h| &h.notes) {
        say!("note: {note}");
    }
    let doubts = prediction.as_ref().map_or(Vec::new(), Prediction::doubts);
    for doubt in &doubts {
        say!("note: {doubt}");
        scope.doubts.push(format!("kT = {kt}: {doubt}"));
    }
    let mut all = json!({"title": model.title, "kT": kt, "equation_of_state": rows, "doubts": doubts});
    if let Some(p) = &prediction {
        all["correlated"] = json!({
            "density": p.density,
            "local_density": p.correlated.as_ref().map(|c| &c.mean_density),
            "pressure": p.correlated.as_ref().map(|c| c.pressure),
            "liquid": p.correlated_liquid,
        });
    }
    all["published"] = known.iter().map(|(name, value)| (name.to_string(), json!(value))).collect();
    if !measured.is_empty() {
        all["measured"] = json!(measured);
    }
    if species == 2 {
        all["assumptions"] =
            ASSUMPTIONS.iter().map(|(of, rests_on)| (of.replace(' ', "_"), json!(rests_on))).collect();
    }
    for (name, value) in answers {
        all[name.replace(' ', "_")] = value;
    }
    Ok((all, defined))
}

/// Prints the equation of state at densities in the proportion of `densities`, up to twice as many, and returns its rows.
fn equation_of_state(theory: &MeanField, densities: &[f64], count: usize) -> Vec<Value> {
    let total: f64 = densities.iter().sum();
    let mut table = Table::new(["density", "pressure", "dp/drho", "excess free energy per particle"]);
    let (mut rows, mut empty) = (Vec::new(), Vec::new());
    for k in 1..=count.min(10_000) {
        let scale = 2.0 * k as f64 / count as f64;
        let rho: Vec<f64> = densities.iter().map(|d| d * scale).collect();
        let (p, slope) = (theory.pressure(&rho), theory.pressure_slope(&rho));
        let f = theory.excess_free_energy_density(&rho) / (scale * total);
        let cell = |x: f64| if x.is_finite() { decimal(x, 6) } else { String::new() };
        if ![p, slope, f].iter().all(|x| x.is_finite()) {
            empty.push(scale * total);
        }
        table.push([scale * total, p, slope, f].map(cell));
        rows.push(json!({"density": scale * total, "pressure": p, "pressure_slope": slope, "excess": f}));
    }
    say::table(&table);
    if let Some(line) = without_numbers(&empty) {
        say!("{line}\n");
    }
    rows
}

/// Prints what mean field says of the phases of one or of two species, and returns it by name.
fn answers(
    theory: &MeanField,
    model: &Model,
    densities: &[f64],
    range: [f64; 2],
) -> Vec<(&'static str, Value)> {
    let total: f64 = densities.iter().sum();
    let middle = theory.pressure(densities);
    match densities.len() {
        1 => vec![
            answer(
                "critical point",
                critical_point(&|kt| Ok(model.at(kt)?), range),
                |c| json!({"kT": c.parameter, "density": c.density, "pressure": c.pressure}),
            ),
            answer("spinodal", theory.spinodal(), |s| json!(s)),
            answer("binodal", theory.binodal(), |b| {
                json!({"vapour": b.vapour, "liquid": b.liquid, "pressure": b.pressure,
                       "chemical_potential": b.chemical_potential})
            }),
            answer("interface", theory.interface(201), |i| json!({"tension": i.tension, "width": i.width})),
        ],
        2 => vec![
            answer(
                "critical point at this density",
                composition_critical_point(&|kt| Ok(model.at(kt)?), total, range),
                |c| {
                    json!({"kT": c.parameter, "composition": c.composition, "pressure": c.pressure,
                           "stability_limit": c.limit})
                },
            ),
            answer("spinodal at this density", theory.composition_spinodal(total), |s| json!(s)),
            answer("coexistence", theory.coexistence([densities[0], densities[1]]), |c| {
                json!({"composition": c.composition(), "density": c.density(), "pressure": c.pressure,
                       "chemical_potentials": c.chemical_potentials, "share": c.share,
                       "metastable": c.more_stable.is_some()})
            }),
            answer(
                "binodal at this density",
                theory.composition_binodal(total),
                |b| json!({"composition": b.composition, "pressure": b.pressure}),
            ),
            answer(
                "binodal at this pressure",
                theory.composition_binodal_at_pressure(middle),
                |b| json!({"composition": b.composition, "density": b.density, "pressure": b.pressure}),
            ),
            answer(
                "interface at this density",
                theory.composition_interface(total, 201),
                |i| json!({"tension": i.tension, "width": i.width}),
            ),
        ],
        _ => Vec::new(),
    }
}

/// Makes short runs: the homogeneous fluid if a density was given or there is no liquid, and a slab if there is a liquid.
fn measure(
    arguments: &Arguments,
    model: &Model,
    kt: f64,
    densities: &[f64],
    prediction: Option<&Prediction>,
) -> Result<Vec<Headline>, Failure> {
    let effort = Effort { steps: arguments.steps, dt: arguments.dt };
    let liquid =
        prediction.and_then(|p| p.correlated_liquid.or(p.phases.as_ref().ok().map(|phases| phases.liquid)));
    let mut all = Vec::new();
    if !arguments.density.is_empty() || liquid.is_none() {
        all.push(measure::homogeneous(model, &arguments.model, kt, densities, effort)?);
    }
    if let Some(liquid) = liquid {
        let mut slab = measure::slab(model, &arguments.model, kt, liquid, effort)?;
        // The mean density and pressure of a box with liquid and vapour are not those of a phase.
        slab.values.retain(|v| !["density", "pressure"].contains(&v.name.as_str()));
        all.push(slab);
    }
    Ok(all)
}

/// A table of mean field, mean field with correlations, published values and measured values.
fn beside(
    density: f64,
    pressure: f64,
    prediction: Option<&Prediction>,
    known: &[(&'static str, [f64; 2])],
    measured: &[Headline],
) -> Table {
    let phases = prediction.and_then(|p| p.phases.as_ref().ok());
    let interface = prediction.and_then(|p| p.interface.as_ref().ok());
    let correlated = prediction.and_then(|p| p.correlated.as_ref());
    // The density of no pressure is found to rounding.
    let settled = |p: f64| if p.abs() < 1e-9 * pressure.abs() { 0.0 } else { p };
    let rows = [
        ("pressure", Some(pressure), correlated.map(|c| settled(c.pressure))),
        ("liquid", phases.map(|b| b.liquid), prediction.and_then(|p| p.correlated_liquid)),
        ("vapour", phases.map(|b| b.vapour), None),
        ("tension", interface.map(|i| i.tension), None),
        ("width", interface.map(|i| i.width), None),
    ];
    let show = |x: Option<f64>| x.filter(|x| x.is_finite()).map_or(String::new(), |x| decimal(x, 4));
    let mut header = vec!["", "mean field", "correlated"];
    header.extend((!known.is_empty()).then_some("published"));
    header.extend((!measured.is_empty()).then_some("measured"));
    let mut table = Table::new(header);
    let local = prediction.into_iter().flat_map(|p| {
        let c = p.correlated.as_ref().map_or(&[][..], |c| &c.mean_density);
        p.names.iter().zip(c).map(|(name, n)| (name.clone(), *n))
    });
    for (name, n) in local {
        table.push([format!("<{name}> at density {density:.3}"), format!("{density:.4}"), format!("{n:.4}")]);
    }
    for (name, mean_field, with) in rows {
        let published = known.iter().find(|k| k.0 == name).map(|k| with_error(k.1[0], Some(k.1[1])));
        let value = measured.iter().find_map(|h| h.get(name)).map(|v| with_error(v.value, v.error));
        let title =
            if name == "pressure" { format!("pressure at density {density:.3}") } else { name.into() };
        let mut row = vec![title, show(mean_field), show(with)];
        if !known.is_empty() {
            row.push(published.unwrap_or_default());
        }
        if !measured.is_empty() {
            row.push(value.unwrap_or_default());
        }
        if row[1..].iter().any(|cell| !cell.is_empty()) {
            table.push(row);
        }
    }
    table
}

/// A value as text for people.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(map) => match map.get("none").and_then(Value::as_str) {
            Some(why) => format!("none ({why})"),
            None => {
                let mut parts: Vec<String> = map.iter().map(|(k, v)| format!("{k} {}", shown(v))).collect();
                // The order of a map depends on the features with which serde_json was compiled.
                parts.sort();
                parts.join(", ")
            }
        },
        Value::Array(items) if items.is_empty() => "none".into(),
        Value::Array(items) => items.iter().map(shown).collect::<Vec<_>>().join(" .. "),
        Value::Null => "without end".into(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.into(),
        Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), |x| decimal(x, 6)),
        other => other.to_string(),
    }
}
