//! Mean field of a model over temperatures, as a page.

use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, composition_critical_point, critical_point};
use psidpd_report::{Item, Overall, Plot, Progress, Report, ReportError, Section, Series, Style, typeset};

const TEMPERATURES: usize = 25;

const DENSITY: &str = "number density ρ [1/length^d]";
const TEMPERATURE: &str = "kT [energy]";
const TENSION: &str = "σ [energy/length^(d−1)]";

const DENSITIES: usize = 200;

pub struct Scope<'a> {
    pub kts: &'a [f64],
    /// Total number density: of a mixture the density that is held, of one species the middle of the isotherms.
    pub density: f64,
    /// Where a critical point is looked for.
    pub range: [f64; 2],
    /// Measured and published points of tension against kT.
    pub tension: Vec<(f64, [f64; 2], &'static str)>,
    /// What is to be known of the theory of this fluid.
    pub doubts: Vec<String>,
}

/// The name of an axis with its unit in the dimensions of the model.
fn unit(name: &str, model: &Model) -> String {
    let (volume, area) = match model.dimensions() {
        2 => ("length^2", "length"),
        _ => ("length^3", "length^2"),
    };
    typeset(&name.replace("length^(d−1)", area).replace("length^d", volume))
}

pub fn page(model: &Model, scope: &Scope) -> Result<Report, ReportError> {
    let species = model.species().len();
    // At extreme densities a temperature takes seconds.
    let progress = &Progress::new().overall("curves of the page", (scope.kts.len() + TEMPERATURES) as u64);
    let mut sections = Vec::new();
    if !scope.doubts.is_empty() {
        let items = vec![Item::Prose(scope.doubts.join("\n\n"))];
        sections.push(Section::new("Where mean field fails", items));
    }
    sections.push(Section::new("Equation of state", isotherms(model, scope, progress)?));
    match species {
        1 => sections.push(Section::new("Vapour and liquid", phases(model, scope, progress)?)),
        2 => sections.push(Section::new("Demixing", compositions(model, scope, progress)?)),
        _ => {}
    }
    let kts: Vec<String> = scope.kts.iter().map(ToString::to_string).collect();
    Ok(Report {
        title: model.title.clone(),
        subtitle: "psidpd theory: mean field".into(),
        facts: vec![("kT".into(), kts.join(", ")), ("species".into(), model.species().join(", "))],
        sections,
        ..Report::default()
    })
}

fn isotherms(model: &Model, scope: &Scope, progress: &Overall) -> Result<Vec<Item>, ReportError> {
    let species = model.species().len();
    let (mut mean_field, mut correlated, mut highest) = (Vec::new(), Vec::new(), None);
    for kt in scope.kts {
        progress.advance(1);
        let Some(theory) = theory(model, *kt) else { continue };
        let at = |k: usize| 2.0 * scope.density * k as f64 / DENSITIES as f64;
        let pressure = |rho: f64| theory.pressure(&vec![rho / species as f64; species]);
        if let Ok(b) = theory.binodal() {
            let loops = (1..DENSITIES).map(|k| pressure(b.liquid * k as f64 / DENSITIES as f64).abs());
            highest = loops.chain(highest).reduce(f64::max);
        }
        let points = (1..=DENSITIES).map(|k| (at(k), pressure(at(k)))).collect();
        mean_field.push(line(format!("mean field, kT = {kt}"), points));
        if let Some(c) = theory.correlations().ok().flatten() {
            let points =
                (1..=DENSITIES / 2).map(|k| (at(2 * k), c.at(at(2 * k)).map_or(f64::NAN, |c| c.pressure)));
            let name = format!("with correlations, kT = {kt}");
            // In the colour of the same temperature.
            let colour = Some(mean_field.len() - 1);
            correlated.push(Series { colour, ..Series::new(name, points.collect(), Style::Dashed) });
        }
    }
    mean_field.extend(correlated);
    // The loop of coexisting phases fills the plot; the pressure of a liquid beyond them is a hundred times higher.
    if let Some(highest) = highest {
        for (_, p) in mean_field.iter_mut().flat_map(|s| &mut s.points).filter(|(_, p)| *p > 1.5 * highest) {
            *p = f64::NAN;
        }
    }
    let equal = if species > 1 { ", the species in equal shares" } else { "" };
    let plot = Plot::new("Pressure", [unit(DENSITY, model), unit("p [energy/length^d]", model)], mean_field);
    let caption = format!(
        "p(ρ) of the homogeneous fluid{equal}; where it falls, or is below the pressure of coexistence, the fluid \
         separates. Dashed: with correlations to first order (random-phase approximation)."
    );
    Ok(vec![Item::figure(&plot, caption)?])
}

/// Temperatures up to the critical one, closer to each other there.
fn below(critical: f64) -> Vec<f64> {
    (0..TEMPERATURES)
        .map(|k| {
            let t = 1.0 - (k as f64 + 0.5) / TEMPERATURES as f64;
            critical * (1.0 - 0.75 * t * t)
        })
        .collect()
}

fn line(name: impl Into<String>, points: Vec<(f64, f64)>) -> Series {
    Series::new(name, points, Style::Line)
}

fn theory(model: &Model, kt: f64) -> Option<MeanField> {
    MeanField::new(&model.at(kt).ok()?).ok()
}

/// Binodal and spinodal, each one curve over the critical point `top` from both of its sides. `interface` sees the theory of
/// every temperature.
fn diagram(
    model: &Model,
    progress: &Overall,
    top: (f64, f64),
    sides: impl Fn(&MeanField) -> [Option<[f64; 2]>; 2],
    mut interface: impl FnMut(f64, &MeanField),
) -> Vec<Series> {
    let mut curves: [[Vec<(f64, f64)>; 2]; 2] = Default::default();
    for kt in below(top.1) {
        progress.advance(1);
        let Some(theory) = theory(model, kt) else { continue };
        for (curves, found) in curves.iter_mut().zip(sides(&theory)) {
            curves.iter_mut().zip(found.into_iter().flatten()).for_each(|(curve, x)| curve.push((x, kt)));
        }
        interface(kt, &theory);
    }
    let [binodal, spinodal] =
        curves.map(|[low, high]| low.into_iter().chain([top]).chain(high.into_iter().rev()).collect());
    vec![line("binodal", binodal), Series::new("spinodal", spinodal, Style::Dashed)]
}

fn phases(model: &Model, scope: &Scope, progress: &Overall) -> Result<Vec<Item>, ReportError> {
    let critical = match critical_point(&|kt| Ok(model.at(kt)?), scope.range) {
        Ok(critical) => critical,
        Err(error) => return Ok(vec![Item::Prose(format!("{error}."))]),
    };
    let (mut tension, mut width, mut reasons) = (Vec::new(), Vec::new(), Vec::new());
    let top = (critical.density, critical.parameter);
    let sides = |theory: &MeanField| {
        let spinodal = theory.spinodal().ok().and_then(|s| s.first().copied());
        [theory.binodal().ok().map(|b| [b.vapour, b.liquid]), spinodal]
    };
    let mut series = diagram(model, progress, top, sides, |kt, theory| match theory.interface(101) {
        Ok(i) => {
            tension.push((kt, i.tension));
            width.push((kt, i.width));
        }
        Err(error) => reasons.push(format!("kT = {kt:.4}: {error}")),
    });
    series.push(Series::new("critical point", vec![top], Style::Points));
    let diagram = Plot::new("Phase diagram", [unit(DENSITY, model), TEMPERATURE.into()], series);
    let mut items = vec![Item::figure(
        &diagram,
        "Vapour and liquid coexist on the binodal; within the spinodal a homogeneous fluid is unstable.",
    )?];
    let mut series = vec![line("mean field", tension)];
    for kind in ["published", "measured"] {
        let points: Vec<_> = scope.tension.iter().filter(|t| t.2 == kind).collect();
        if !points.is_empty() {
            let errors = points.iter().map(|(_, v, _)| v[1]).collect();
            let points = points.iter().map(|(kt, v, _)| (*kt, v[0])).collect();
            series.push(Series::new(kind, points, Style::Points).with_errors(errors));
        }
    }
    if series.iter().any(|s| !s.points.is_empty()) {
        let plot = Plot::new("Surface tension", [TEMPERATURE.into(), unit(TENSION, model)], series);
        items.push(Item::figure(&plot, "Square-gradient theory, Pagonabarraga and Frenkel, eq. 29.")?);
    }
    if !width.is_empty() {
        let series = vec![line("mean field", width)];
        let plot = Plot::new("Width of the interface", [TEMPERATURE, "w [length]"], series);
        items.push(Item::figure(&plot, "w = (ρ_L − ρ_V)/max|dρ/dz|.")?);
    }
    if let Some(first) = reasons.first() {
        items.push(Item::Prose(format!(
            "No interface at {} of {TEMPERATURES} temperatures; at {first}.",
            reasons.len()
        )));
    }
    Ok(items)
}

fn compositions(model: &Model, scope: &Scope, progress: &Overall) -> Result<Vec<Item>, ReportError> {
    let of = format!("fraction of {}", model.species()[0]);
    let found = composition_critical_point(&|kt| Ok(model.at(kt)?), scope.density, scope.range);
    let critical = match found {
        Ok(critical) => critical,
        Err(error) => return Ok(vec![Item::Prose(format!("At density {}: {error}.", scope.density))]),
    };
    let mut tension = Vec::new();
    let c = critical.composition;
    let sides = |theory: &MeanField| {
        let phases = theory.coexistence([c * scope.density, (1.0 - c) * scope.density]);
        let spinodal = theory.composition_spinodal(scope.density).ok();
        [phases.ok().map(|phases| phases.composition()), spinodal.and_then(|s| s.first().copied())]
    };
    let series = diagram(model, progress, (c, critical.parameter), sides, |kt, theory| {
        tension.extend(theory.composition_interface(scope.density, 101).ok().map(|i| (kt, i.tension)));
    });
    let title = format!("Composition diagram at density {}", scope.density);
    let diagram = Plot::new(title, [of.as_str(), TEMPERATURE], series);
    let caption = format!(
        "The abscissa is the {of}. Binodal: phases of equal chemical potentials and pressure, of a mixture of this density and \
         of the critical composition; their own densities differ. Spinodal: mixtures of this density in which waves of density \
         and composition grow."
    );
    let mut items = vec![Item::figure(&diagram, caption)?];
    if !tension.is_empty() {
        let plot = Plot::new(
            "Tension between the phases",
            [TEMPERATURE.into(), unit(TENSION, model)],
            vec![line("", tension)],
        );
        items.push(Item::figure(
            &plot,
            "Square-gradient theory, Pagonabarraga and Frenkel, eqs. 36 to 41, which hold the total density: only where phases of \
             this density are in equilibrium.",
        )?);
    }
    Ok(items)
}
