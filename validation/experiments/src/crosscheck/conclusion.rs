//! What the page of a validation begins with: its conclusion, and what is compared.

use crate::fluids::{A, GAMMA, RC, RD, SET5, SET6};
use psidpd_report::{Item, Results, Section, Table};
use serde_json::Value;

/// Three sentences: whether the codes agree, how LAMMPS's `mdpd` differs, and how Warren's numbers compare.
pub fn section(results: &Results) -> Section {
    let failed = results.failed_count();
    let worst = results
        .checks
        .iter()
        .filter(|c| !c.at_least && c.limit > 0.0)
        .map(|c| c.value.abs() / c.limit)
        .fold(0.0, f64::max);
    let codes = "the native runner, the plugin's two styles and the tables for eam/alloy";
    let agree = if failed == 0 {
        format!(
            "All {} checks pass: {codes} are one fluid, with the same forces to rounding and the same equilibrium within \
             error bars; the check that is closest to its bound is at {:.0} % of it.",
            results.checks.len(),
            100.0 * worst
        )
    } else {
        let first = results.checks.iter().find(|c| !c.passed).map_or("", |c| c.description.as_str());
        format!(
            "{failed} of {} checks fail, first of all \"{first}\": do not rely on {codes} being one fluid before that is \
             understood.",
            results.checks.len()
        )
    };
    let shift = |set: &str, what: &str| {
        let of = |code: &str| number(results, &format!("nvt.{set}.{code}.{what}"), "mean");
        Some(of("mdpd-lucy")? - of("native-conservative")?)
    };
    let shifts: Vec<String> = [SET5, SET6]
        .iter()
        .filter_map(|set| {
            let [density, tension] =
                ["liquid-density", "surface-tension"].map(|what| shift(&set.slug(), what));
            Some(format!("{}: density {:+.2}, tension {:+.2}", set.name, density?, tension?))
        })
        .collect();
    let built_in = format!(
        "LAMMPS's built-in mdpd computes another force, which is not the gradient of an energy: with the thermostat off it heats, \
         and its liquid is another one{}.",
        if shifts.is_empty() { String::new() } else { format!(" ({})", shifts.join("; ")) }
    );
    let found = |set: &str, what: &str| {
        let key = format!("nvt.{set}.native-conservative.{what}");
        let (value, error) = (number(results, &key, "mean")?, number(results, &key, "error")?);
        Some(psidpd_report::quantity::with_error(value, Some(error)))
    };
    let published: Vec<String> = [SET5, SET6]
        .iter()
        .filter_map(|set| {
            let [density, tension] =
                ["liquid-density", "surface-tension"].map(|what| found(&set.slug(), what));
            let [liquid, warren, _] =
                set.published().map(|[value, error]| format!("Warren {value} ± {error}"));
            let (density, tension) = (density?, tension?);
            Some(format!("{}: liquid density {density} ({liquid}), tension {tension} ({warren})", set.name))
        })
        .collect();
    let warren = format!("The native runner compared with the published values: {}.", published.join("; "));
    Section::new("Conclusion", vec![Item::Prose(format!("{agree}\n\n{built_in}\n\n{warren}"))])
}

fn number(results: &Results, key: &str, part: &str) -> Option<f64> {
    results.values.get(key)?.get(part).and_then(Value::as_f64)
}

/// Words of the page, and what they mean.
const WORDS: &str = "\
law conservative: Warren's force, the gradient of U: densities and forces of one kernel, w_d = 15/(2π r_d³) (1 − r/r_d)².
law lucy: the force of LAMMPS's mdpd: densities with Lucy's kernel, 105/(16π r_d³) (1 + 3r/r_d)(1 − r/r_d)³, but forces with \
the slope of the quadratic one; the two do not belong to one energy. The plugin computes it too, to be compared with mdpd.
native: the runner of psidpd, psidpd run.
dpd/psi, mdpd/psi: the pair styles of the plugin in LAMMPS: from a model file, and with mdpd's arguments.
eam/alloy: LAMMPS's own pair style with tables of psi, w and phi from psidpd export eam.
dpd: LAMMPS's own pair style for standard DPD, with its own drag and noise.
newton on, off: LAMMPS's setting: with on, a pair between two ranks is computed once and its force sent; with off, on both \
ranks. Results must not differ.
ranks: processes of MPI that share the box; a trajectory must not depend on their number.
≤, ≥: a bound marked ≤ is the largest size of the value that passes, one marked ≥ the smallest value: there it is an effect \
that must be seen.
±: one standard error; a comparison passes if a difference as large as the one found is likely enough by chance.";

/// The fluid, its parameters, and the words of the page.
pub fn what_is_compared() -> Section {
    let mut sets =
        Table::new(["set", "A", "B", "r_c", "r_d", "γ", "kT", "Warren: density", "tension", "width"]);
    for set in [SET5, SET6] {
        let parameters = [A, set.b, RC, RD, GAMMA, 1.0].map(|x| x.to_string());
        let published = set.published().map(|[value, error]| format!("{value} ± {error}"));
        sets.push([set.name.to_owned()].into_iter().chain(parameters).chain(published));
    }
    let mut words = Table::new(["word", "what it means"]);
    WORDS
        .lines()
        .filter_map(|line| line.split_once(": "))
        .for_each(|(word, meaning)| words.push([word, meaning]));
    Section::new(
        "What is compared",
        vec![
            Item::prose(
                "U = Σ_i ψ(n_i) + Σ_{i<j} φ(r_ij), n_i = Σ_{j≠i} w_d(r_ij), ψ(n) = (π/30) r_d⁴ B n², \
                 φ(r) = ½ A r_c (1 − r/r_c)².\n\n\
                 F_ij = [A (1 − r/r_c) + B (ρ̄_i + ρ̄_j)(1 − r/r_d)] ê_ij, with Warren's ρ̄_i = n_i, each term within its \
                 range; drag −γ (1 − r/r_c)² (ê·v) ê and noise of σ² = 2γkT. Lengths are in r_c, energies in kT, masses in m.",
            ),
            Item::Table(sets),
            Item::Table(words),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use psidpd_report::Check;
    use serde_json::json;

    fn text(results: &Results) -> String {
        section(results).items.iter().map(|item| format!("{item:?}")).collect()
    }

    #[test]
    fn the_conclusion_is_that_of_the_checks() {
        let mut results = Results::new("t", "v");
        results.push(Check::at_most("a", "forces", "one", 0.5, 1.0));
        for (key, mean) in [
            ("nvt.set6.native-conservative.liquid-density", 6.06),
            ("nvt.set6.native-conservative.surface-tension", 7.5),
            ("nvt.set6.mdpd-lucy.liquid-density", 6.56),
            ("nvt.set6.mdpd-lucy.surface-tension", 9.0),
        ] {
            results.record(key, json!({"mean": mean, "error": 0.02})).unwrap();
        }
        let good = text(&results);
        for part in [
            "All 1 checks pass",
            "at 50 % of it",
            "set 6: density +0.50, tension +1.50",
            "6.060 ± 0.020 (Warren 6.05",
        ] {
            assert!(good.contains(part), "{part}: {good}");
        }
        results.push(Check::at_most("b", "forces", "two differ", 2.0, 1.0));
        assert!(
            text(&results).contains("1 of 2 checks fail, first of all \\\"two differ"),
            "{}",
            text(&results)
        );
    }
}
