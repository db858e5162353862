use super::*;
use crate::document::FileErrorKind;

const SET6: &str = r#"title = "Warren 2003, set 6"
species = ["F"]
[parameters]
A = -40.0
B = 25.0
rd = 0.75
[density.n]
kernel = "quadratic"
range = "rd"
[excess_free_energy]
F = "pi/30 * rd^4 * B * n^2"
[[pair]]
between = ["F", "F"]
form = "soft"
strength = "A"
range = 1.0
[[thermostat]]
gamma = 18.0
range = 1.0
"#;

#[test]
fn reads_the_contract() {
    let model = Model::parse("set6.toml", SET6).unwrap();
    let fluid = model.at(1.0).unwrap();
    assert_eq!(fluid.species, ["F"]);
    assert_eq!(fluid.dimensions, 3);
    assert_eq!(fluid.cutoff(), 1.0);
    assert_eq!(fluid.densities[0].kernel.range(), 0.75);
    assert_eq!(fluid.thermostats[0].unwrap().gamma, 18.0);
    assert!(fluid.is_conservative());
}

fn error_of(text: &str) -> FileError {
    Model::parse("m.toml", text).expect_err("this file is wrong")
}

/// Each case has the old text, the new text, the line of the error and a part of its message.
#[test]
fn errors_name_line_key_and_cause() {
    let cases = [
        ("kernel = \"quadratic\"", "kernel = \"gauss\"", 8, "density.n.kernel: unknown kernel \"gauss\""),
        ("range = \"rd\"", "range = \"r_d\"", 9, "unknown name `r_d`"),
        ("range = \"rd\"", "range = \"-rd\"", 9, "must be positive"),
        ("range = \"rd\"", "rang = 1", 9, "density.n.rang: unknown key"),
        ("range = \"rd\"", "", 7, "density.n.range: is missing"),
        ("range = \"rd\"", "range = 1\nrange_A = 2", 10, "density.n.range_A: unknown key"),
        ("B * n^2", "B * m^2", 11, "unknown name `m`"),
        ("B * n^2", "B * n_G^2", 11, "unknown name `n_G`"),
        ("B * n^2", "B * (n^2", 11, "never closed"),
        ("F = \"pi", "G = \"pi", 11, "unknown species \"G\""),
        ("species = [\"F\"]", "species = [\"F\", \"G\"]", 10, "species G has no entry"),
        ("species = [\"F\"]", "species = []", 2, "must name 1 to"),
        ("species = [\"F\"]", "species = [\"F\", \"F\"]", 2, "named twice"),
        ("[\"F\", \"F\"]", "[\"F\", \"H\"]", 13, "unknown species \"H\""),
        ("[\"F\", \"F\"]", "[\"F\"]", 13, "expected two species"),
        ("form = \"soft\"", "form = \"hard\"", 14, "unknown form"),
        ("strength = \"A\"", "strength = true", 15, "pair[1].strength: expected a number"),
        ("strength = \"A\"", "strength = \"1/0\"", 15, "no finite value"),
        ("strength = \"A\"", "strength = nan", 15, "not a finite number"),
        ("gamma = 18.0", "gamma = -1", 18, "must not be negative"),
        ("A = -40.0", "kT = 1", 4, "the scene or the host code sets kT"),
        ("A = -40.0", "ln = 1", 4, "name of a constant or function"),
        ("A = -40.0", "n = 1\nA = 1", 8, "has the name of another"),
        ("A = -40.0", "A = \"C\"\nC = \"A\"", 3, "in a circle"),
        ("title = \"Warren 2003, set 6\"", "", 1, "title: is missing"),
        ("title = \"Warren 2003, set 6\"", "title = \"x\"\ndimensions = 4", 2, "must be 2 or 3"),
        ("title = \"Warren 2003, set 6\"", "title = \"x\"\ntitel = \"y\"", 2, "titel: unknown key"),
        ("title = \"Warren 2003, set 6\"", "title = ", 1, "not valid TOML"),
    ];
    for (from, to, line, message) in cases {
        assert!(SET6.contains(from), "{from}");
        let error = error_of(&SET6.replacen(from, to, 1));
        let text = error.to_string();
        assert!(text.contains(message), "{from} -> {to}: {text}");
        assert_eq!(error.line(), line, "{from} -> {to}: {text}");
        assert!(text.starts_with("m.toml:"), "{text}");
    }
}

#[test]
fn formula_errors_point_into_the_string() {
    let text = SET6.replace("B * n^2", "Bee * n^2");
    let error = error_of(&text);
    assert_eq!(&text[error.place.span.clone()], "Bee");
    assert!(matches!(*error.kind, FileErrorKind::Expression(_)));
}

#[test]
fn temperature_must_be_positive() {
    let model = Model::parse("set6.toml", SET6).unwrap();
    for kt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(model.at(kt).unwrap_err().to_string().contains("must be a positive number"));
    }
}

#[test]
fn species_that_do_not_meet_are_an_error() {
    let text = r#"title = "t"
species = ["A", "B"]
[[pair]]
between = ["A", "A"]
form = "soft"
strength = 25
range = 1
[[pair]]
between = ["B", "B"]
form = "soft"
strength = 25
range = 1
"#;
    let error = error_of(text).to_string();
    assert!(error.contains("nothing acts between species A and B"), "{error}");
    assert!(error.contains("of strength 0 if they do not interact"), "{error}");
    // An ideal gas is a valid fluid.
    assert!(Model::parse("m.toml", "title = \"ideal\"\nspecies = [\"A\", \"B\"]\n").is_ok());
}

#[test]
fn parameters_may_be_formulas_in_any_order() {
    let text = "title = \"t\"\nspecies = [\"A\"]\n[parameters]\nb = \"2*a\"\na = 1.5\nc = \"b + pi - pi\"\n";
    let model = Model::parse("m.toml", text).unwrap();
    assert_eq!(model.parameters()["b"], 3.0);
    assert_eq!(model.parameters()["c"], 3.0);
}

#[test]
fn parameters_know_no_temperature() {
    let e = error_of("title = \"t\"\nspecies = [\"F\"]\n[parameters]\na = 2.0\nb = \"a*kT\"\n");
    assert!(e.to_string().contains("parameters.b: a parameter has one value at all temperatures"), "{e}");
}

#[test]
fn thermostats_replace_the_one_for_every_pair() {
    let text = r#"title = "t"
species = ["A", "B"]
[[thermostat]]
between = ["B", "A"]
gamma = 9
range = 0.7
exponent = 0.5
[[thermostat]]
gamma = 4.5
range = 1
"#;
    let fluid = Model::parse("m.toml", text).unwrap().at(1.0).unwrap();
    let gammas: Vec<f64> = fluid.thermostats.iter().map(|t| t.unwrap().gamma).collect();
    assert_eq!(gammas, [4.5, 9.0, 9.0, 4.5]);
    assert_eq!(fluid.thermostats[1].unwrap().exponent, 0.5);
    let twice = text.replace("between = [\"B\", \"A\"]\n", "");
    assert!(error_of(&twice).to_string().contains("has a thermostat already"));
    let partial = text.replace("gamma = 4.5", "between = [\"A\", \"A\"]\ngamma = 4.5");
    assert!(error_of(&partial).to_string().contains("have no thermostat, but other pairs have one"));
}

#[test]
fn deep_nesting_is_an_error_not_an_overflow() {
    let text = format!("title = \"t\"\nspecies = {}", "[".repeat(100_000));
    assert!(error_of(&text).to_string().contains("nest deeper"));
    let dots = format!("title = \"t\"\nspecies{} = 1", ".a".repeat(100_000));
    assert!(error_of(&dots).to_string().contains("nest deeper"));
}

#[test]
fn a_file_in_the_place_of_a_pressure_is_told_from_a_formula() {
    let parse = |pressure: &str| {
        let text = format!(
            "title = \"t\"\nspecies = [\"F\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n\
             [excess_free_energy]\nF = {{ pressure = \"{pressure}\" }}\n"
        );
        Model::parse("t.toml", &text).unwrap_err()
    };
    assert!(parse("p.csv").help.is_some_and(|help| help.contains("{ table = \"p.csv\" }")));
    assert!(parse("rho*kT + $2.5").help.is_none_or(|help| !help.contains("table")));
}
