//! Mean field of a model over temperatures, as a page.

use psidpd_core::model::Model;
use psidpd_core::theory::{MeanField, composition_critical_point, critical_point_of_model};
use psidpd_report::{Item, Plot, Report, ReportError, Section, Series, Style};

/// Points of a curve over temperatures.
const TEMPERATURES: usize = 25;

/// Points of a curve over densities.
const DENSITIES: usize = 200;

pub struct Scope<'a> {
    /// The temperatures of the isotherms.
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

/// The page.
///
/// # Errors
/// A plot cannot be drawn.
pub fn page(model: &Model, scope: &Scope) -> Result<Report, ReportError> {
    let species = model.species().len();
    let mut sections = Vec::new();
    if !scope.doubts.is_empty() {
        let items = vec![Item::Prose(scope.doubts.join("\n\n"))];
        sections.push(Section { heading: "Where mean field fails".into(), items });
    }
    sections.push(Section { heading: "Equation of state".into(), items: isotherms(model, scope)? });
    match species {
        1 => sections.push(Section { heading: "Vapour and liquid".into(), items: phases(model, scope)? }),
        2 => sections.push(Section { heading: "Demixing".into(), items: compositions(model, scope)? }),
        _ => {}
    }
    let kts: Vec<String> = scope.kts.iter().map(ToString::to_string).collect();
    Ok(Report {
        title: model.title().into(),
        subtitle: "psidpd theory: mean field".into(),
        facts: vec![("kT".into(), kts.join(", ")), ("species".into(), model.species().join(", "))],
        sections,
        ..Report::default()
    })
}

fn figure(plot: &Plot, caption: &str) -> Result<Item, ReportError> {
    Ok(Item::Figure { svg: plot.render()?, caption: caption.into() })
}

fn isotherms(model: &Model, scope: &Scope) -> Result<Vec<Item>, ReportError> {
    let species = model.species().len();
    let (mut mean_field, mut correlated, mut highest) = (Vec::new(), Vec::new(), None);
    for kt in scope.kts {
        let Some(theory) = model.at(*kt).ok().and_then(|fluid| MeanField::new(&fluid).ok()) else { continue };
        let at = |k: usize| 2.0 * scope.density * k as f64 / DENSITIES as f64;
        let pressure = |rho: f64| theory.pressure(&vec![rho / species as f64; species]);
        if let Ok(b) = theory.binodal() {
            let loops = (1..DENSITIES).map(|k| pressure(b.liquid * k as f64 / DENSITIES as f64).abs());
            highest = loops.chain(highest).reduce(f64::max);
        }
        mean_field.push(Series {
            name: format!("mean field, kT = {kt}"),
            points: (1..=DENSITIES).map(|k| (at(k), pressure(at(k)))).collect(),
            ..Series::default()
        });
        if let Some(c) = theory.correlations().ok().flatten() {
            let points =
                (1..=DENSITIES / 5).map(|k| (at(5 * k), c.at(at(5 * k)).map_or(f64::NAN, |c| c.pressure)));
            correlated.push(Series {
                name: format!("with correlations, kT = {kt}"),
                points: points.collect(),
                style: Style::Dashed,
                ..Series::default()
            });
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
    let plot = Plot {
        title: "Pressure".into(),
        x_label: "number density ρ [1/length^d]".into(),
        y_label: "p [energy/length^d]".into(),
        series: mean_field,
        ..Plot::default()
    };
    let caption = format!(
        "p(ρ) of the homogeneous fluid{equal}; where it falls, or is below the pressure of coexistence, the fluid \
         separates. Dashed: with correlations to first order (random-phase approximation)."
    );
    Ok(vec![figure(&plot, &caption)?])
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

fn line(name: &str, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.into(), points, ..Series::default() }
}

fn phases(model: &Model, scope: &Scope) -> Result<Vec<Item>, ReportError> {
    let critical = match critical_point_of_model(model, scope.range) {
        Ok(critical) => critical,
        Err(error) => return Ok(vec![Item::Prose(format!("{error}."))]),
    };
    let mut curves: [Vec<(f64, f64)>; 4] = std::array::from_fn(|_| Vec::new());
    let (mut tension, mut width, mut reasons) = (Vec::new(), Vec::new(), Vec::new());
    for kt in below(critical.parameter) {
        let Some(theory) = model.at(kt).ok().and_then(|fluid| MeanField::new(&fluid).ok()) else { continue };
        if let Ok(b) = theory.binodal() {
            curves[0].push((b.vapour, kt));
            curves[1].push((b.liquid, kt));
        }
        if let Some([low, high]) = theory.spinodal().ok().and_then(|s| s.first().copied()) {
            curves[2].push((low, kt));
            curves[3].push((high, kt));
        }
        match theory.interface(101) {
            Ok(i) => {
                tension.push((kt, i.tension));
                width.push((kt, i.width));
            }
            Err(error) => reasons.push(format!("kT = {kt:.4}: {error}")),
        }
    }
    // One curve each, over the critical point.
    let joined = |a: usize, b: usize| {
        let mut curve = curves[a].clone();
        curve.push((critical.density, critical.parameter));
        curve.extend(curves[b].iter().rev());
        curve
    };
    let (binodal, spinodal) = (joined(0, 1), joined(2, 3));
    let diagram = Plot {
        title: "Phase diagram".into(),
        x_label: "number density ρ [1/length^d]".into(),
        y_label: "kT [energy]".into(),
        series: vec![
            line("binodal", binodal),
            Series { style: Style::Dashed, ..line("spinodal", spinodal) },
            Series {
                style: Style::Points,
                ..line("critical point", vec![(critical.density, critical.parameter)])
            },
        ],
        ..Plot::default()
    };
    let mut items = vec![figure(
        &diagram,
        "Vapour and liquid coexist on the binodal; within the spinodal a homogeneous fluid is unstable.",
    )?];
    let mut series = vec![line("mean field", tension)];
    for kind in ["published", "measured"] {
        let points: Vec<_> = scope.tension.iter().filter(|t| t.2 == kind).collect();
        if !points.is_empty() {
            series.push(Series {
                name: kind.into(),
                points: points.iter().map(|(kt, v, _)| (*kt, v[0])).collect(),
                errors: Some(points.iter().map(|(_, v, _)| v[1]).collect()),
                style: Style::Points,
            });
        }
    }
    if series.iter().any(|s| !s.points.is_empty()) {
        let plot = Plot {
            title: "Surface tension".into(),
            x_label: "kT [energy]".into(),
            y_label: "σ [energy/length^(d−1)]".into(),
            series,
            ..Plot::default()
        };
        items.push(figure(&plot, "Square-gradient theory, Pagonabarraga and Frenkel, eq. 29.")?);
    }
    if !width.is_empty() {
        let plot = Plot {
            title: "Width of the interface".into(),
            x_label: "kT [energy]".into(),
            y_label: "w [length]".into(),
            series: vec![line("mean field", width)],
            ..Plot::default()
        };
        items.push(figure(&plot, "w = (ρ_L − ρ_V)/max|dρ/dz|.")?);
    }
    if let Some(first) = reasons.first() {
        items.push(Item::Prose(format!(
            "No interface at {} of {TEMPERATURES} temperatures; at {first}.",
            reasons.len()
        )));
    }
    Ok(items)
}

fn compositions(model: &Model, scope: &Scope) -> Result<Vec<Item>, ReportError> {
    let of = format!("fraction of {}", model.species()[0]);
    let found = composition_critical_point(&|kt| Ok(model.at(kt)?), scope.density, scope.range);
    let critical = match found {
        Ok(critical) => critical,
        Err(error) => return Ok(vec![Item::Prose(format!("At density {}: {error}.", scope.density))]),
    };
    let mut curves: [Vec<(f64, f64)>; 4] = std::array::from_fn(|_| Vec::new());
    let mut tension = Vec::new();
    for kt in below(critical.parameter) {
        let Some(theory) = model.at(kt).ok().and_then(|fluid| MeanField::new(&fluid).ok()) else { continue };
        let c = critical.composition;
        if let Ok(phases) = theory.coexistence([c * scope.density, (1.0 - c) * scope.density]) {
            let [low, high] = phases.composition();
            curves[0].push((low, kt));
            curves[1].push((high, kt));
        }
        if let Some([low, high]) =
            theory.composition_spinodal(scope.density).ok().and_then(|s| s.first().copied())
        {
            curves[2].push((low, kt));
            curves[3].push((high, kt));
        }
        if let Ok(i) = theory.composition_interface(scope.density, 101) {
            tension.push((kt, i.tension));
        }
    }
    let joined = |a: usize, b: usize| {
        let mut curve = curves[a].clone();
        curve.push((critical.composition, critical.parameter));
        curve.extend(curves[b].iter().rev());
        curve
    };
    let diagram = Plot {
        title: format!("Composition diagram at density {}", scope.density),
        x_label: of.clone(),
        y_label: "kT [energy]".into(),
        series: vec![
            line("binodal", joined(0, 1)),
            Series { style: Style::Dashed, ..line("spinodal", joined(2, 3)) },
        ],
        ..Plot::default()
    };
    let caption = format!(
        "The abscissa is the {of}. Binodal: phases of equal chemical potentials and pressure, of a mixture of this density and \
         of the critical composition; their own densities differ. Spinodal: mixtures of this density in which waves of density \
         and composition grow."
    );
    let mut items = vec![figure(&diagram, &caption)?];
    if !tension.is_empty() {
        let plot = Plot {
            title: "Tension between the phases".into(),
            x_label: "kT [energy]".into(),
            y_label: "σ [energy/length^(d−1)]".into(),
            series: vec![line("", tension)],
            ..Plot::default()
        };
        items.push(figure(&plot, "Square-gradient theory, Pagonabarraga and Frenkel, eqs. 36 to 41, which hold the total density: only where phases of \
             this density are in equilibrium.")?);
    }
    Ok(items)
}
