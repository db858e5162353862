use super::{Failure, Verdict, write_json};
use crate::check::{Conditions, Findings, Severity, Warning, check, estimates};
use crate::run::reach;
use crate::scene::Scene;
use psidpd_core::document::Document;
use psidpd_core::model::Model;
use std::path::{Path, PathBuf};

/// What a model or scene will compute, what mean field says of it, and what cannot work.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A model file, or a scene file, which brings kT and densities along.
    file: PathBuf,
    /// kT; 1 if neither this nor a scene gives it.
    #[arg(long = "kT", value_name = "T", allow_negative_numbers = true)]
    kt: Option<f64>,
    /// Number density, total or one for each species, as 6.05 or 8,8.
    #[arg(long, value_name = "RHO", value_delimiter = ',', value_parser = number_density)]
    density: Vec<f64>,
}

/// A number density on the command line.
pub fn number_density(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err("a density is a number that is not negative".into())
    }
}

/// Number densities of the species: as given, or a total in equal shares.
pub fn per_species(given: &[f64], species: usize) -> Option<Vec<f64>> {
    match given {
        [] => None,
        [total] => Some(vec![total / species as f64; species]),
        all => Some(all.to_vec()),
    }
}

pub fn run(arguments: &Arguments, json: Option<&Path>) -> Result<Verdict, Failure> {
    let document = Document::open(&arguments.file)?;
    let mut too_far = None;
    let (model, kt, densities, steps) = if document.root().get("model").is_some() {
        let scene = Scene::open(&arguments.file)?;
        let densities = scene.densities();
        let range = scene.model.at(scene.kt)?.cutoff();
        let particles = scene.initial.parts().iter().map(|p| p.count).sum();
        too_far = reach::check(&scene.domain, scene.model.dimensions(), range, particles).err();
        let steps = if too_far.is_none() { estimates(&scene)? } else { Vec::new() };
        (scene.model.clone(), scene.kt, Some(densities), steps)
    } else {
        (Model::open(&arguments.file)?, 1.0, None, Vec::new())
    };
    let conditions = Conditions {
        kt: arguments.kt.unwrap_or(kt),
        densities: per_species(&arguments.density, model.species().len()).or(densities),
    };
    let mut findings = Findings { steps, ..check(&model, &conditions)? };
    if let Some(error) = too_far {
        findings.warnings.insert(
            0,
            Warning { id: "range-beyond-box", severity: Severity::Error, message: error.to_string() },
        );
    }
    print(&findings, model.species());
    write_json(json, &findings)?;
    Ok(if findings.works() { Verdict::Good } else { Verdict::CheckFailed })
}

fn print(findings: &Findings, species: &[String]) {
    if let Some(reference) = &findings.reference {
        println!("reference     {reference}");
    }
    println!("{}", findings.plan);
    println!("kT            {}", findings.kt);
    if let Some(densities) = &findings.densities {
        let each: Vec<String> =
            species.iter().zip(densities).map(|(s, rho)| format!("{s} {rho:.6}")).collect();
        println!("densities     {}", each.join(", "));
    }
    if let (Some(p), Some(slope)) = (findings.pressure, findings.pressure_slope) {
        println!("mean field    pressure {p:.6}, dp/drho {slope:.6}");
    }
    if let Some(s) = &findings.stability {
        let verdict = if s.stable { "stable" } else { "unstable" };
        let place = match s.k_star {
            Some(k) => format!("at k* = {k:.4}"),
            None if s.spinodal => "at k = 0".to_owned(),
            None => "(S(k) has no peak)".to_owned(),
        };
        println!("stability     {verdict}: smallest 1/S(k) is {:.5} {place}", s.min_inverse_s);
    } else if findings.densities.is_none() {
        println!("stability     give --density to have pressure and stability");
    }
    for step in &findings.steps {
        println!(
            "time step     {} of stage \"{}\", {}: configurational temperature off by about {:.2} %, 1 % at dt = {:.3} \
             (estimate: frequency {:.1}, drag rate {:.2})",
            step.dt,
            step.stage,
            step.integrator,
            100.0 * step.error,
            step.one_percent,
            step.frequency,
            step.drag
        );
    }
    for warning in &findings.warnings {
        let kind = match warning.severity {
            Severity::Error => "ERROR",
            Severity::Warning => "WARNING",
            Severity::Note => "note",
        };
        println!("{kind:<13} [{}] {}", warning.id, warning.message);
    }
}
