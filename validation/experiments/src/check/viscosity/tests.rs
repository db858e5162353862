use super::*;
use psidpd_core::model::Model;
use std::path::Path;

const IDEAL: &str = "";

fn soft(a: f64, range: f64) -> String {
    format!(
        "[[pair]]\nbetween = [\"F\", \"F\"]\nform = \"soft\"\nstrength = {}\nrange = {}\n",
        decimal(a),
        decimal(range)
    )
}

fn warrens(a: f64, b: f64, range: f64) -> String {
    let rd = 0.75 * range;
    format!(
        "[density.n]\nkernel = \"quadratic\"\nrange = {rd}\n[excess_free_energy]\nF = \"pi/30*{rd}^4*{b}*n^2\"\n{}",
        soft(a, range)
    )
}

fn decimal(x: f64) -> String {
    format!("{x:?}")
}

fn at(forces: &str, gamma: f64, range: f64, kt: f64, more: &str) -> Fluid {
    let text = format!(
        "title = \"w\"\nspecies = [\"F\"]\n{more}{forces}[[thermostat]]\ngamma = {}\nrange = {}\n",
        decimal(gamma),
        decimal(range)
    );
    Model::parse("m.toml", &text).unwrap_or_else(|e| panic!("{e}")).at(kt).unwrap()
}

/// Viscosities without forces that others have measured with their own programs, by Poiseuille flow and from the fluctuations of the stress.
#[test]
fn the_ideal_gas_has_the_viscosities_of_others() {
    for (gamma, viscosity, error) in [
        (4.5, 1.246, 0.015),
        (4.5, 1.47, 0.10),
        (100.0, 1.667, 0.021),
        (100.0, 1.81, 0.17),
        (1000.0, 9.14, 0.12),
        (1000.0, 8.8, 1.0),
    ] {
        let found = flow(&at(IDEAL, gamma, 1.0, 1.0, ""), 1.0, Some(3.0)).unwrap();
        let apart = (found.viscosity[0] - viscosity).abs();
        assert!(apart < 2.5 * found.viscosity[1].hypot(error) && !found.interpolated, "{gamma}: {found:?}");
    }
}

/// Between rows there is what lies between, with an error that grows with the distance, and beyond them nothing.
#[test]
fn drags_between_rows_are_interpolated_and_no_others() {
    for usual in USUAL {
        let of = |gamma| between(usual.rows, gamma, |row| Some(row.viscosity));
        let [first, last] = [0, usual.rows.len() - 1].map(|k| usual.rows[k].gamma);
        assert!(of(0.99 * first).is_none() && of(1.01 * last).is_none(), "{}", usual.name);
        for pair in usual.rows.windows(2) {
            assert!(pair[0].gamma < pair[1].gamma, "{}", usual.name);
            let middle = of((pair[0].gamma * pair[1].gamma).sqrt());
            assert_eq!(middle.is_some(), usual.rows.len() > 2, "{}", usual.name);
            if let Some([eta, error]) = middle {
                let [a, b] = [&pair[0], &pair[1]].map(|row| row.viscosity);
                assert!((eta - (a[0] * b[0]).sqrt()).abs() < 1e-9 * eta && error > 0.5 * a[1].min(b[1]));
            }
        }
    }
    // A power of the drag is its own interpolation; a parabola in logarithms is as far as the error says.
    for bend in [0.0, 0.03] {
        let exact = |gamma: f64| (0.5 * gamma.ln() + bend * gamma.ln().powi(2)).exp();
        let rows = [1.0f64, 10.0, 100.0].map(|gamma| row(gamma, [exact(gamma), 0.0], None));
        let [eta, error] = between(&rows, 30.0, |row| Some(row.viscosity)).unwrap();
        assert!(((eta - exact(30.0)).abs() - error).abs() < 0.05 * error + 1e-9, "{eta} {error}");
        assert_eq!(between(&rows, 30.0, |row| row.diffusion), None);
    }
}

/// Lengths doubled, energies tripled, masses five: a fluid is the same in other units.
#[test]
fn units_do_not_matter() {
    let (l, e, m) = (2.0, 3.0, 5.0);
    let time = l * f64::sqrt(m / e);
    for (plain, scaled, rho) in [
        (IDEAL.to_owned(), IDEAL.to_owned(), 3.0),
        (soft(25.0, 1.0), soft(25.0 * e / l, l), 3.0),
        (warrens(-40.0, 25.0, 1.0), warrens(-40.0 * e / l, 25.0 * e * l * l, l), 6.05),
        (warrens(-40.0, 40.0, 1.0), warrens(-40.0 * e / l, 40.0 * e * l * l, l), 5.08),
    ] {
        let one = flow(&at(&plain, 4.5, 1.0, 1.0, ""), 1.0, Some(rho)).unwrap();
        let other = flow(&at(&scaled, 4.5 * m / time, l, e, ""), m, Some(rho / l.powi(3))).unwrap();
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
        assert!(near(other.viscosity[0], one.viscosity[0] * m / (l * time)), "{one:?} {other:?}");
        assert!(
            near(other.diffusion.unwrap()[0], one.diffusion.unwrap()[0] * l * l / time),
            "{one:?} {other:?}"
        );
        assert!(near(other.schmidt.unwrap()[0], one.schmidt.unwrap()[0]), "{one:?} {other:?}");
    }
}

#[test]
fn other_fluids_are_not_judged() {
    let silent = |fluid: Fluid, rho| assert_eq!(flow(&fluid, 1.0, Some(rho)), None, "{fluid:?}");
    let standard = soft(25.0, 1.0);
    silent(at(&standard, 4.5, 1.0, 1.0, ""), 4.0);
    silent(at(&standard, 4.5, 1.0, 2.0, ""), 3.0);
    silent(at(&soft(30.0, 1.0), 4.5, 1.0, 1.0, ""), 3.0);
    silent(at(&standard, 4.5, 1.5, 1.0, ""), 3.0);
    silent(at(&standard, 4.5, 1.0, 1.0, "dimensions = 2\n"), 3.0);
    silent(at(&format!("{standard}{standard}"), 4.5, 1.0, 1.0, ""), 3.0);
    for (a, b, rho) in [(-40.0, 30.0, 6.05), (-38.0, 25.0, 6.05), (-40.0, 25.0, 5.08), (-40.0, 40.0, 6.05)] {
        silent(at(&warrens(a, b, 1.0), 18.0, 1.0, 1.0, ""), rho);
    }
    assert!(flow(&at(&warrens(-40.0, 25.0, 1.0), 18.0, 1.0, 1.0, ""), 1.0, Some(6.05)).is_some());
    let steep = at(IDEAL, 4.5, 1.0, 1.0, "");
    let drag = steep.thermostats[0].map(|t| psidpd_core::model::Thermostat { exponent: 0.5, ..t });
    silent(Fluid { thermostats: vec![drag], ..steep.clone() }, 3.0);
    silent(Fluid { thermostats: vec![None], ..steep }, 3.0);
    assert!(flow(&at(&standard, 4.5, 1.0, 1.0, ""), 1.0, None).is_some());
}

/// The page has the table of this file; `PSIDPD_UPDATE_DOCS=1` writes it anew.
#[test]
fn the_page_has_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/choosing.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let start = page.find("| fluid | γ | η |").expect("the table's head");
    let end = start + page[start..].find("\n\n").expect("the table's end") + 1;
    let renewed = format!("{}{}{}", &page[..start], table(), &page[end..]);
    if std::env::var_os("PSIDPD_UPDATE_DOCS").is_some() {
        std::fs::write(&path, &renewed).unwrap();
    }
    assert!(
        std::fs::read_to_string(&path).is_ok_and(|t| t == renewed),
        "PSIDPD_UPDATE_DOCS=1 cargo test renews it"
    );
}

fn table() -> String {
    let mut out =
        String::from("| fluid | γ | η | D | Sc | kinetic theory's η |\n|---|---|---|---|---|---|\n");
    for usual in USUAL {
        for (k, row) in usual.rows.iter().enumerate() {
            let Row { gamma, viscosity, diffusion } = row;
            let name = if k == 0 { format!("{}, ρ = {}", usual.name, usual.density) } else { String::new() };
            let kinetic = if usual.strength == 0.0 {
                let (pi, rho) = (std::f64::consts::PI, usual.density);
                format!("{:.2}", 45.0 / (4.0 * pi * gamma) + 2.0 * pi * gamma * rho * rho / 1575.0)
            } else {
                String::new()
            };
            let schmidt = diffusion.map(|d| schmidt(*viscosity, d, usual.density));
            let [eta, d, sc] =
                [Some(*viscosity), *diffusion, schmidt].map(|v| v.map_or(String::new(), bracketed));
            out.push_str(&format!("| {name} | {gamma} | {eta} | {d} | {sc} | {kinetic} |\n"));
        }
    }
    out
}

/// A value with the last digits of its error in brackets: 1.246(15).
fn bracketed([value, error]: Value) -> String {
    let places = (1.0 - error.log10().floor()).max(0.0) as usize;
    format!("{value:.places$}({:.0})", error * 10f64.powi(places as i32))
}
