use super::*;
use psidpd_core::engine::check_reach;
use psidpd_dynamics::run::check_memory;
use psidpd_dynamics::scene::Scene;
use psidpd_experiments::check::{
    Cost, Findings, Flow, Severity, StepEstimate, Steps, Warning, check, cost, estimates, flow_of_scene,
};
use psidpd_formats::memory::shown;
use psidpd_report::quantity::{decimal, number, with_error};

/// Say what a model or scene will compute, what mean field predicts, and what cannot work.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A model file, or a scene file, which states kT and densities.
    file: PathBuf,
    /// kT. If left out, that of the scene, or 1 for a model.
    #[arg(long = "kT", value_name = "T", allow_negative_numbers = true, value_parser = temperature)]
    kt: Option<f64>,
    /// Number density, total or one for each species, as 6.05 or 8,8.
    #[arg(long, value_name = "RHO", value_delimiter = ',', value_parser = number_density)]
    density: Vec<f64>,
    #[command(flatten)]
    settings: Settings,
}

impl Arguments {
    pub fn files(&self) -> Files {
        Files::reads([&self.file])
    }
}

/// Parses a number density.
pub fn number_density(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|e| format!("{e}"))?;
    if value >= 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err("a density is a number that is not negative".into())
    }
}

/// Number densities of the species: the given ones, or a given total in equal shares.
pub fn per_species(given: &[f64], species: usize) -> Option<Vec<f64>> {
    match given {
        [] => None,
        [total] => Some(vec![total / species as f64; species]),
        all => Some(all.to_vec()),
    }
}

pub fn run(arguments: &Arguments, told: Told) -> Result<Verdict, Failure> {
    let document = Document::open(&arguments.file)?;
    let progress = Progress::new();
    let (mut too_far, mut too_large) = (None, None);
    let (mut mixtures, mut flow_of_fluid, mut settling) = (Vec::new(), None, Vec::new());
    let (model, kt, densities, steps, taken) = if document.root().get("model").is_some() {
        let scene = arguments.settings.scene(&arguments.file)?;
        let densities = scene.densities();
        if arguments.density.is_empty() {
            mixtures = scene.mixtures();
        }
        let range = scene.model.at(scene.kt)?.cutoff();
        let particles = scene.initial.count();
        too_large = check_memory(&scene).err();
        too_far = check_reach(&scene.domain, scene.model.dimensions(), range, particles).err();
        let (mut steps, mut taken) = (Steps::default(), None);
        if too_far.is_none() {
            steps = progress.spinner("trying timesteps", || estimates(&scene))?;
            taken = progress.spinner("trying the scene", || cost(&scene)).ok();
        }
        flow_of_fluid = Some(flow_of_scene(&scene));
        settling = stages_that_settle(&scene);
        (scene.model.clone(), scene.kt, Some(densities), steps, taken)
    } else {
        let (model, kt) = arguments.settings.model(&arguments.file)?;
        (model, kt.unwrap_or(1.0), None, Steps::default(), None)
    };
    let kt = arguments.kt.unwrap_or(kt);
    let densities = per_species(&arguments.density, model.species().len()).or(densities);
    let Steps { known, unknown } = steps;
    let mut findings = Findings {
        steps: known,
        unknown_steps: unknown,
        cost: taken,
        ..progress.spinner("mean field", || check(&model, kt, densities.as_deref()))?
    };
    if let Some(flow) = flow_of_fluid
        && arguments.kt.is_none()
        && arguments.density.is_empty()
    {
        findings.flow = flow;
    }
    if let Some(warning) = too_long(&findings.steps, &settling) {
        findings.warnings.push(warning);
        findings.warnings.sort_by_key(|w| std::cmp::Reverse(w.severity));
    }
    mixtures.retain(|rho| Some(rho) != findings.densities.as_ref());
    for rho in mixtures {
        let other = check(&model, kt, Some(&rho))?;
        findings.add_at(model.species(), &rho, other.warnings);
    }
    let memory = too_large.map(|error| ("memory", error.to_string()));
    for (id, message) in
        memory.into_iter().chain(too_far.map(|error| ("range-beyond-box", error.to_string())))
    {
        findings.warnings.insert(0, Warning { id, severity: Severity::Error, message });
    }
    print(&findings, model.species());
    conclude(told, &findings, findings.works())
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} minutes", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} hours", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

/// The error above which a time step gives a warning.
const TOO_LONG: f64 = 0.1;

/// Above this an error is no small correction, and its value means nothing.
const FAR_OFF: f64 = 1.0;

/// Smaller errors are of no interest.
const LEAST: f64 = 1e-4;

/// An error in percent, as far as it is known.
fn percent(error: f64, resolution: f64) -> String {
    match error {
        e if e < resolution && resolution > TOO_LONG => "what a short trial cannot tell".to_owned(),
        e if e < resolution.max(LEAST) => {
            format!("less than {} %", two_digits(100.0 * resolution.max(LEAST)))
        }
        e if e <= FAR_OFF => format!("about {} %", two_digits(100.0 * e)),
        _ => format!("more than {} %", two_digits(100.0 * FAR_OFF)),
    }
}

/// What step to take instead.
fn remedy(step: &StepEstimate) -> String {
    match step.one_percent {
        Some(dt) => format!("use dt = {}, or an integrator that allows longer steps", two_digits(dt)),
        None => "use a shorter step; psidpd pareto finds how long it may be".to_owned(),
    }
}

/// The names of stages that nothing samples and that others follow: what is a little off in them is forgotten.
fn stages_that_settle(scene: &Scene) -> Vec<String> {
    let is_sampled =
        |name: &String| scene.observe.requests.iter().any(|request| request.stages.contains(name));
    let names = scene.stages.iter().map(|stage| &stage.name);
    let last = scene.stages.last().map(|stage| &stage.name);
    names.filter(|name| Some(*name) != last && !is_sampled(name)).cloned().collect()
}

/// A warning about the worst of the time steps that are too long. Those of stages that settle are if the fluid is far off.
fn too_long(steps: &[StepEstimate], settling: &[String]) -> Option<Warning> {
    let error = |s: &StepEstimate| s.error.max(s.carried);
    let most = |s: &StepEstimate| if settling.contains(&s.stage) { FAR_OFF } else { TOO_LONG };
    let worst = steps.iter().filter(|s| error(s) > most(s)).max_by(|a, b| error(a).total_cmp(&error(b)))?;
    Some(Warning {
        id: "time-step",
        severity: Severity::Warning,
        message: format!(
            "dt = {} of stage \"{}\" changes temperatures by {} and the pressure of the momentum flux by {} of rho kT: {} \
             (docs/integrators.md)",
            worst.dt,
            worst.stage,
            percent(worst.error, worst.resolution),
            percent(worst.carried, worst.resolution),
            remedy(worst)
        ),
    })
}

/// A number with two significant digits.
fn two_digits(x: f64) -> String {
    let digits = (1 - x.abs().max(1e-12).log10().floor() as i32).clamp(-300, 12);
    let unit = 10f64.powi(digits);
    format!("{:.*}", digits.max(0) as usize, (x * unit).round() / unit)
}

fn print_step(step: &StepEstimate, which: &str) {
    let told = step.carried >= step.resolution.max(LEAST) && step.carried <= FAR_OFF;
    let thinner = step.thinner.filter(|by| told && *by >= LEAST).map(|by| {
        format!(
            ", and makes a liquid in equilibrium with its vapour about {} % less dense",
            two_digits(100.0 * by)
        )
    });
    let one_percent = match step.one_percent {
        Some(dt) => format!("about 1 % of both, or less, at dt = {}", two_digits(dt)),
        None => "no step with 1 % is known".to_owned(),
    };
    say!(
        "time step     {} of stage \"{}\"{which}, {}: changes temperatures by {} and the pressure of the momentum flux by {} of rho kT{}; \
         {one_percent} (estimate: frequency {:.1} of the fastest species, drag rate {:.2})",
        step.dt,
        step.stage,
        step.integrator,
        percent(step.error, step.resolution),
        percent(step.carried, step.resolution),
        thinner.unwrap_or_default(),
        step.frequency,
        step.drag
    );
}

fn print_flow(flow: &Flow) {
    let shown = |[x, error]: [f64; 2]| with_error(x, Some(error));
    let more = match (flow.diffusion, flow.schmidt) {
        (Some(d), Some(sc)) => format!(", diffusion coefficient {}, Schmidt number {}", shown(d), shown(sc)),
        _ => String::new(),
    };
    let how = if flow.interpolated { "between measured drags" } else { "measured" };
    say!(
        "viscosity     {}{more} ({how}: {}, density {}, gamma {}, short steps; docs/choosing.md)",
        shown(flow.viscosity),
        flow.fluid,
        decimal(flow.density, 3),
        number(flow.gamma)
    );
}

fn print(findings: &Findings, species: &[String]) {
    if let Some(reference) = &findings.reference {
        say!("reference     {reference}");
    }
    say!("{}", findings.plan);
    say!("kT            {}", number(findings.kt));
    if let Some(densities) = &findings.densities {
        let each: Vec<String> =
            species.iter().zip(densities).map(|(s, rho)| format!("{s} {}", decimal(*rho, 6))).collect();
        say!("densities     {}", each.join(", "));
    }
    if let (Some(p), Some(slope)) = (findings.pressure, findings.pressure_slope) {
        let shown = |x: f64| {
            if x.is_finite() { decimal(x, 6) } else { "none (psi is not finite there)".into() }
        };
        say!("mean field    pressure {}, dp/drho {}", shown(p), shown(slope));
    }
    if let Some(s) = &findings.stability {
        let verdict = if s.stable { "stable" } else { "unstable" };
        let place = match s.k_star {
            Some(k) => format!("at k* = {k:.4}"),
            None if s.spinodal => "at k = 0".to_owned(),
            None => "(S(k) has no peak)".to_owned(),
        };
        say!("stability     {verdict}: smallest 1/S(k) is {:.5} {place}", s.min_inverse_s);
    } else if findings.densities.is_none() {
        say!("stability     give --density to have pressure and stability");
    }
    for line in &findings.theory {
        say!("theory        {line}");
    }
    if let Some(flow) = &findings.flow {
        print_flow(flow);
    }
    if let Some(Cost { particles, steps, bytes, seconds }) = findings.cost {
        say!(
            "takes         {particles} particles, {steps} steps: about {} of memory and {} on one thread of this machine",
            shown(bytes),
            duration(seconds)
        );
    }
    for of_stage in
        findings.steps.chunk_by(|a, b| (&a.stage, &a.integrator, a.dt) == (&b.stage, &b.integrator, b.dt))
    {
        match of_stage {
            [first, .., last] => {
                print_step(first, " (first of its temperatures)");
                print_step(last, " (last)");
            }
            all => all.iter().for_each(|step| print_step(step, "")),
        }
    }
    for step in &findings.unknown_steps {
        say!(
            "time step     {} of stage \"{}\", {}: no estimate: {}",
            step.dt,
            step.stage,
            step.integrator,
            step.why
        );
    }
    for warning in &findings.warnings {
        let kind = match warning.severity {
            Severity::Error => "ERROR",
            Severity::Warning => "WARNING",
            Severity::Note => "note",
        };
        say!("{kind:<13} [{}] {}", warning.id, warning.message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(stage: &str, error: f64, carried: f64) -> StepEstimate {
        StepEstimate {
            stage: stage.into(),
            integrator: "velocity-verlet".into(),
            dt: 0.02,
            frequency: 10.0,
            mean_frequency: Some(10.0),
            drag: 2.0,
            error,
            carried,
            resolution: 0.0,
            thinner: None,
            one_percent: Some(0.0054321),
        }
    }

    /// A temperature or a carried pressure that is more than a tenth off is warned of; of several steps the worst.
    #[test]
    fn steps_that_err_by_a_tenth_are_too_long() {
        assert_eq!(too_long(&[step("a", 0.099, 0.099)], &[]), None);
        assert_eq!(too_long(&[], &[]), None);
        for (error, carried) in [(0.101, 0.0), (0.0, 0.101)] {
            assert!(too_long(&[step("a", error, carried)], &[]).is_some());
        }
        let steps = [step("a", 0.2, 0.1), step("b", 0.01, 0.3), step("c", 0.25, 0.15)];
        let warning = too_long(&steps, &[]).unwrap();
        assert!(warning.id == "time-step" && warning.severity == Severity::Warning);
        let says = "dt = 0.02 of stage \"b\" changes temperatures by about 1.0 % and the pressure of the momentum flux by about \
                    30 % of rho kT: use dt = 0.0054, ";
        assert!(warning.message.starts_with(says), "{}", warning.message);
        let unknown = StepEstimate { one_percent: None, ..step("a", 0.2, 0.1) };
        assert!(too_long(&[unknown], &[]).unwrap().message.contains("use a shorter step"));
        // In a stage that settles a third does not matter, and a fluid that does not last does.
        let settling = ["b".to_owned()];
        let warning = too_long(&steps, &settling).unwrap();
        assert!(warning.message.contains("stage \"c\""), "{}", warning.message);
        assert_eq!(too_long(&[step("b", 0.2, 0.99)], &settling), None);
        assert!(too_long(&[step("b", f64::INFINITY, f64::INFINITY)], &settling).is_some());
    }

    /// The first stage of the slab settles; sampled, or alone, it does not.
    #[test]
    fn stages_that_nothing_samples_settle() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("m.toml"), include_str!("../../models/warren2003-set6.toml"))
            .unwrap();
        let scene = |more: &str| {
            let text = "model = \"m.toml\"\nkT = 1.0\nbox = 4.0\ndensity = 6.0\n[[stage]]\nname = \"a\"\nsteps = 5\n\
                        [[stage]]\nname = \"b\"\nsteps = 5\n[observe]\n";
            Scene::parse("s", &(text.to_owned() + more), folder.path()).unwrap()
        };
        assert_eq!(stages_that_settle(&scene("pressure = true\n")), ["a"]);
        assert!(stages_that_settle(&scene("pressure = { stages = [\"a\"] }\n")).is_empty());
        assert_eq!(stages_that_settle(&scene("")), ["a"]);
    }

    #[test]
    fn errors_are_told_as_far_as_they_are_known() {
        for (error, resolution, expected) in [
            (0.0123, 0.0, "about 1.2 %"),
            (0.5, 0.002, "about 50 %"),
            (1.5, 0.002, "more than 100 %"),
            (f64::INFINITY, 0.0, "more than 100 %"),
            (0.001, 0.002, "less than 0.20 %"),
            (0.00001, 0.0, "less than 0.010 %"),
            (0.1, 0.2, "what a short trial cannot tell"),
        ] {
            assert_eq!(percent(error, resolution), expected);
        }
        assert_eq!(
            [119.0, 600.0, 9000.0, 200_000.0].map(duration),
            ["119 s", "10 minutes", "2.5 hours", "2.3 days"]
        );
        assert_eq!([0.0, 1.0, 12.0, 1234.0].map(two_digits)[1..], ["1.0", "12", "1200"]);
        assert_eq!(per_species(&[6.0], 3), Some(vec![2.0; 3]));
        assert_eq!((per_species(&[1.0, 2.0], 2), per_species(&[], 2)), (Some(vec![1.0, 2.0]), None));
    }
}
