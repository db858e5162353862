use super::*;

mod time_step;

fn found(text: &str, kt: f64, densities: Option<Vec<f64>>) -> Findings {
    check(&Model::parse("m.toml", text).unwrap(), kt, densities.as_deref()).unwrap()
}

fn has(findings: &Findings, id: &str) -> bool {
    findings.warnings.iter().any(|w| w.id == id)
}

fn spline(repulsion: f64) -> String {
    format!(
        "title = \"spline\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"spline\"\nstrength = 1\n\
         A = {repulsion}\nB = 9.5\nrange_A = 0.8\nrange_B = 1.0\n"
    )
}

/// At other densities warnings are told once and with their place, notes are not, and what is worst comes first.
#[test]
fn warnings_at_other_densities_are_told_once() {
    let warning = |id, severity, message: &str| Warning { id, severity, message: message.into() };
    let mut findings = found(&spline(19.0), 0.5, Some(vec![12.5]));
    findings.warnings = vec![warning("known", Severity::Warning, "it is known")];
    assert!(findings.works());
    let names = ["A".to_owned(), "B".to_owned()];
    let other = vec![
        warning("known", Severity::Warning, "it is known"),
        warning("known", Severity::Warning, "it is another"),
        warning("small", Severity::Note, "it is small"),
        warning("bad", Severity::Error, "it is known"),
    ];
    findings.add_at(&names, &[1.0, 2.5], other.clone());
    findings.add_at(&names, &[3.0, 2.5], other);
    let said: Vec<_> = findings.warnings.iter().map(|w| (w.id, w.severity, w.message.as_str())).collect();
    let place = "at densities A 1.0000, B 2.5000: ";
    assert_eq!(
        said,
        [
            ("bad", Severity::Error, &*format!("{place}it is known")),
            ("known", Severity::Warning, "it is known"),
            ("known", Severity::Warning, &*format!("{place}it is another")),
        ]
    );
    assert!(!findings.works());
}

/// A scene costs what a step of it does; of a large one a small box is tried. Here a step takes a nanosecond for each particle.
#[test]
fn a_scene_costs_what_its_steps_do() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.toml"), crate::shipped::STANDARD).unwrap();
    let of = |edge: f64| {
        let text = format!(
            "model = \"m.toml\"\nkT = 1.0\nseed = 3\nbox = {edge}\ndensity = 3.0\nequilibrate = 7\nsteps = 13\ndt = 0.02\n\
             precision = \"double\"\n[initial]\nkind = \"lattice\"\n"
        );
        psidpd_dynamics::scene::Scene::parse("cost", &text, folder.path()).unwrap()
    };
    for (edge, tried) in [(10.0, 3000), (40.0, 192_000), (50.0, 20_000)] {
        let trial = |scene: &psidpd_dynamics::scene::Scene| {
            let particles = scene.initial.count();
            assert!((particles as f64 / f64::from(tried) - 1.0).abs() < 0.01, "{edge}: {particles}");
            assert_eq!(scene.precision(), psidpd_core::engine::Precision::Double);
            assert_eq!(scene.stages[0].dt, 0.02);
            Ok(1e-9 * particles as f64)
        };
        let cost = cost::by_trial(&of(edge), &trial).unwrap();
        assert_eq!((cost.particles, cost.steps), ((3.0 * edge.powi(3)) as usize, 20));
        assert!((cost.seconds / (20e-9 * cost.particles as f64) - 1.0).abs() < 0.01, "{cost:?}");
        // More than positions and velocities in double precision; a small run has 20 MB of its own.
        let each = cost.bytes / cost.particles as f64;
        assert!(each > 48.0 && cost.bytes < 5000.0 * cost.particles as f64 + 3e7, "{each}");
    }
    let mut scene = of(10.0);
    scene.stages[1].steps = 3;
    assert!(cost(&scene).is_ok_and(|cost| cost.seconds > 0.0 && cost.seconds < 60.0));
}

/// Wang and Chen print 17.0 where a = 9.5 and A = 2.0 give 19.0; the fluid with 17.0 collapses.
#[test]
fn the_misprint_of_the_spline_paper_is_caught() {
    let misprint = found(&spline(17.0), 0.5, Some(vec![12.5]));
    assert!(has(&misprint, "no-thermodynamic-limit"), "{misprint:?}");
    assert!(!misprint.works());
    let right = found(&spline(19.0), 0.5, Some(vec![12.5]));
    assert!(right.works(), "{right:?}");
}

fn van_der_waals() -> &'static str {
    "title = \"vdw\"\nspecies = [\"F\"]\n[parameters]\na = 2.0\nb = 0.1\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
     [excess_free_energy]\nF = \"-kT*ln(1 - b*n) - a*n\"\n"
}

/// A stated pressure needs a correction, and a psi that is a table or a formula none.
#[test]
fn only_a_stated_pressure_has_to_be_calibrated() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..40).map(|k| format!("{k}, {}\n", 0.1 * f64::from(k * k))).collect();
    std::fs::write(folder.path().join("psi.csv"), rows).unwrap();
    let warned = |psi: &str, correction: &str| {
        let text = format!(
            "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n{correction}\
             [excess_free_energy]\nF = {psi}\n"
        );
        let model = Model::parse_in(&folder.path().join("m.toml"), &text).unwrap();
        has(&check(&model, 1.0, Some(&[3.0])).unwrap(), "uncalibrated")
    };
    assert!(warned("{ pressure = \"rho*kT + rho^2\" }", ""));
    assert!(!warned("{ pressure = \"rho*kT + rho^2\" }", "correction = [0.1, 1.02]\n"));
    assert!(!warned("{ table = \"psi.csv\" }", "") && !warned("\"0.1*n^2\"", ""));
}

#[test]
fn poles_and_spinodals_are_named() {
    // kT_c = 8a/27b = 5.93, ρ_c = 1/3b = 3.33
    let cold = found(van_der_waals(), 4.0, Some(vec![3.6]));
    assert!(has(&cold, "spinodal") && has(&cold, "singular"), "{cold:?}");
    // The pole is at 1/b.
    let pole = cold.warnings.iter().find(|w| w.id == "singular").unwrap();
    assert!(pole.message.contains("total density 10.0000, 2.78 times the mean"), "{pole:?}");
    let hot = found(van_der_waals(), 8.0, Some(vec![1.0]));
    assert!(!has(&hot, "spinodal"), "{hot:?}");
    let beyond = found(van_der_waals(), 8.0, Some(vec![12.0]));
    assert!(!beyond.works(), "{beyond:?}");
}

fn bounded(psi: &str, density: &str, more: &str) -> String {
    format!(
        "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n{density}\n{more}\n\
         [excess_free_energy]\nF = \"{psi}\"\n"
    )
}

/// The severity of what is said of singularities, worst first.
fn singular(text: &str, density: f64) -> Vec<Severity> {
    let findings = found(text, 1.0, Some(vec![density]));
    findings.warnings.iter().filter(|w| w.id == "singular").map(|w| w.severity).collect()
}

/// Bounds protect from what they leave out, and from nothing else.
#[test]
fn bounds_are_those_of_the_variable_and_must_exclude_the_pole() {
    use Severity::{Error, Note, Warning};
    let other = "[density.m]\nkernel = \"lucy\"\nrange = 1\nbounds = [0.1, 5.0]";
    let pole = "-kT*ln(1 - 0.1*n) + m";
    let elsewhere = found(&bounded(pole, "", other), 1.0, Some(vec![12.0]));
    assert!(!elsewhere.works() && elsewhere.pressure.unwrap().is_nan(), "{elsewhere:?}");
    assert!(has(&elsewhere, "not-finite"), "{elsewhere:?}");
    let pole = "-kT*ln(1 - 0.1*n)";
    assert_eq!(singular(&bounded(pole, "bounds = [0.05, 100]", ""), 12.0), [Error]);
    assert_eq!(singular(&bounded(pole, "bounds = [0.05, 100]", ""), 5.0), [Warning]);
    assert_eq!(singular(&bounded(pole, "bounds = [0.05, 9.5]", ""), 5.0), [Note]);
    let kept = found(&bounded(pole, "bounds = [0.05, 9.5]", ""), 1.0, Some(vec![5.0]));
    let kept = kept.warnings.iter().find(|w| w.id == "singular").unwrap();
    assert!(kept.message.ends_with("keep runs away from it"), "{}", kept.message);
    // Mean field knows how psi goes on.
    let beyond = found(&bounded(pole, "bounds = [0.05, 9.5]", ""), 1.0, Some(vec![12.0]));
    assert!(beyond.pressure.unwrap().is_finite(), "{beyond:?}");
    // But this is no fluid of that psi.
    assert!(!beyond.works(), "{beyond:?}");
    let beyond = beyond.warnings.iter().find(|w| w.id == "singular").unwrap();
    assert!(beyond.severity == Error && beyond.message.contains("nothing but that"), "{beyond:?}");
    for (bounds, expected) in [("[0, 50]", Warning), ("[0.05, 50]", Note)] {
        assert_eq!(singular(&bounded("20*kT*ln(n)", &format!("bounds = {bounds}"), ""), 5.0), [expected]);
    }
}

/// Bounds hold the part of each species: the pole of a sum stays open where two parts together reach it.
#[test]
fn bounds_of_parts_leave_a_pole_of_their_sum_open() {
    let of = |high: f64| {
        let text = format!(
            "title = \"t\"\nspecies = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\nbounds = [0, {high}]\n\
             [excess_free_energy]\nA = \"-kT*ln(1 - 0.1*n)\"\nB = \"n^2\"\n"
        );
        // Nearly pure A never reaches the pole within the bounds.
        let findings = found(&text, 1.0, Some(vec![5.9, 0.1]));
        let warnings = findings.warnings.into_iter().filter(|w| w.id == "singular");
        warnings.map(|w| (w.severity, w.message.contains("still reaches it"))).collect::<Vec<_>>()
    };
    assert_eq!(of(9.5), [(Severity::Warning, true)]);
    assert_eq!(of(4.9), [(Severity::Note, false)]);
}

/// A particle without neighbours has the corrected density that the correction gives it.
#[test]
fn corrected_densities_keep_particles_from_the_origin() {
    assert!(singular(&bounded("kT*ln(n)", "correction = [1.5, 1.0]", ""), 5.0).is_empty());
    assert_eq!(singular(&bounded("kT*ln(n)", "correction = [-0.5, 1.0]", ""), 5.0), [Severity::Warning]);
    assert!(singular(&bounded("kT*ln(n)", "self = true", ""), 5.0).is_empty());
}

/// What a run accepts is looked at as far as it goes.
#[test]
fn a_potential_without_integral_has_a_plan_and_a_warning() {
    let text = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1\n\
                [excess_free_energy]\nF = \"ln(n)\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"expression\"\n\
                phi = \"1/r^12 - 1\"\nrange = 1\n";
    let findings = found(text, 1.0, Some(vec![1.0]));
    assert!(has(&findings, "no-mean-field") && has(&findings, "singular"), "{findings:?}");
    assert!(findings.pressure.is_none() && !findings.plan.is_empty());
}

#[test]
fn laws_without_potential_and_jumps_are_named() {
    let lucy =
        van_der_waals().replace("kernel = \"quadratic\"", "kernel = \"lucy\"\nforce_kernel = \"quadratic\"");
    assert!(has(&found(&lucy, 8.0, None), "not-conservative"));
    let stated = "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"lucy\"\nrange = 1\n\
                  [excess_free_energy]\nF = { slopes = { n = \"2*n\" } }\n";
    let findings = found(stated, 1.0, Some(vec![3.0]));
    assert!(has(&findings, "no-free-energy") && findings.pressure.is_none(), "{findings:?}");
    let linear = van_der_waals().replace("quadratic", "linear");
    assert!(has(&found(&linear, 8.0, None), "force-jump"));
    let cut = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"expression\"\n\
               phi = \"exp(-r)\"\nrange = 1\n";
    assert!(has(&found(cut, 1.0, None), "energy-jump"));
    // A jump counts from a millionth of the potential within its range on.
    for (step, counts) in [("1e-4", true), ("2e-6", true), ("1e-8", false)] {
        let steep = cut.replace("exp(-r)", &format!("(1 - r)^2 + {step}"));
        assert_eq!(has(&found(&steep, 1.0, None), "energy-jump"), counts, "{step}");
    }
    // It is 22 at 2/3 of the range and 6e-3 at a twentieth.
    for (step, counts) in [("3e-5", true), ("1e-5", false)] {
        let far = cut.replace("exp(-r)", &format!("1000*r^4*(1 - r)^2 + {step}"));
        assert_eq!(has(&found(&far, 1.0, None), "energy-jump"), counts, "{step}");
    }
}

#[test]
fn a_plain_fluid_has_nothing_to_warn_of() {
    let soft = "title = \"t\"\nspecies = [\"F\"]\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = 25\n\
                range = 1\n[[thermostat]]\ngamma = 4.5\nrange = 1\n";
    let findings = found(soft, 1.0, Some(vec![3.0]));
    assert!(findings.warnings.is_empty(), "{findings:?}");
    // α_MF = π/30: p = 3 + π/30 · 25 · 9
    let expected = 3.0 + std::f64::consts::PI / 30.0 * 225.0;
    assert!((findings.pressure.unwrap() - expected).abs() < 1e-9, "{findings:?}");
}

/// Advice for a fluid that clusters names a kernel only where the kernel is the cause.
#[test]
fn a_quadratic_kernel_is_not_advised_where_it_is_quadratic() {
    let cluster = |kernel: &str| {
        let text = format!(
            "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"{kernel}\"\nrange = 1\n\
             [excess_free_energy]\nF = \"50*n\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"expression\"\n\
             phi = \"200*(1 - r)^2*(r - 0.3)\"\nrange = 1\n"
        );
        let findings = found(&text, 1.0, Some(vec![20.0]));
        let warning = findings.warnings.iter().find(|w| w.id == "clustering");
        warning.unwrap_or_else(|| panic!("{findings:?}")).message.clone()
    };
    assert!(cluster("bell").contains("positive definite kernel"));
    let message = cluster("quadratic");
    assert!(!message.contains("kernel"));
    // The wavelength is 2π/k*.
    let after = |words: &str| -> f64 {
        let rest = message.split(words).nth(1).unwrap();
        rest.split([':', ';']).next().unwrap().trim().parse().unwrap()
    };
    let product = after("at k* = ") * after("wavelength ");
    assert!((product / std::f64::consts::TAU - 1.0).abs() < 2e-3, "{message}");
}

/// The crystal of A = −100 and B = 80 is announced as what it is, and Warren's liquid is not.
#[test]
fn crystals_are_not_called_liquids() {
    let warren = |a: f64, b: f64| {
        format!(
            "title = \"w\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 0.75\n[excess_free_energy]\n\
             F = \"pi/30*0.75^4*{b}*n^2\"\n[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = {a}\nrange = 1\n"
        )
    };
    for density in [None, Some(vec![5.7]), Some(vec![2.9])] {
        let solid = found(&warren(-100.0, 80.0), 1.0, density.clone());
        let said = solid.theory.join("\n");
        assert!(has(&solid, "crystal") && solid.works(), "{solid:?}");
        assert!(
            said.contains("expect a crystal") && said.contains("Vanya") && !said.contains("expect a liquid"),
            "{said}"
        );
        let liquid = found(&warren(-40.0, 25.0), 1.0, density);
        assert!(!has(&liquid, "crystal") && !liquid.theory.join(" ").contains("crystal"), "{liquid:?}");
    }
}
