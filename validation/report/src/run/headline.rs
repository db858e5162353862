//! The main results of a run, with warnings about them.

mod content;

use super::super::Table;
use super::{About, Item, Observation, Path, Section, Value, read_json_if_there, series, with_error};
use content::Content;
use serde::Serialize;

/// The measured values of a run, the most important first.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Headline {
    pub values: Vec<HeadlineValue>,
    /// Warnings for users of the values.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeadlineValue {
    /// The name is `density`, `temperature`, `pressure`, `liquid`, `vapour`, `tension`, `width`, `radius`, `contact_angle`,
    /// `viscosity`, or the name of a column of an observable that has no other name here.
    pub name: String,
    pub value: f64,
    /// One standard deviation; `None` if the value is exact or the error is unknown.
    pub error: Option<f64>,
    /// The unit in terms of the length, energy and mass of the model.
    pub unit: String,
    /// The file or observable that the value comes from.
    pub source: String,
    pub mean_field: Option<f64>,
    /// The published value for this fluid at this kT, and its error.
    pub published: Option<[f64; 2]>,
}

/// The results of the run in a folder, from the files that exist.
pub fn headline(folder: &Path) -> Headline {
    let about = About::read(folder).ok().flatten();
    let table = series::Table::read(&folder.join("thermo.csv")).ok().flatten();
    let observables = read_json_if_there::<Vec<Observation>>(&folder.join("observables.json")).ok().flatten();
    let summary = read_json_if_there::<Value>(&folder.join("summary.json")).ok().flatten();
    let particles = summary.and_then(|s| s.get("particles")?.as_f64());
    gather(about.as_ref(), particles, table.as_ref(), observables.as_deref().unwrap_or_default())
}

/// The results from the content of the files.
pub fn gather(
    about: Option<&About>,
    particles: Option<f64>,
    table: Option<&series::Table>,
    observables: &[Observation],
) -> Headline {
    let content = Content::new(about, particles, table, observables);
    let values = content.values();
    let notes = content.notes(&values);
    Headline { values, notes }
}

impl Headline {
    pub fn get(&self, name: &str) -> Option<&HeadlineValue> {
        self.values.iter().find(|v| v.name == name)
    }

    /// A table with a row for each value. The columns of mean field and of published values appear only if they have entries.
    pub fn table(&self) -> Table {
        let mean_field = self.values.iter().any(|v| v.mean_field.is_some());
        let published = self.values.iter().any(|v| v.published.is_some());
        let mut header = vec!["result", "value ± error"];
        header.extend(mean_field.then_some("mean field"));
        header.extend(published.then_some("published"));
        header.extend(["unit", "from"]);
        let columns = header.len();
        let mut table = Table::new(header);
        for v in &self.values {
            let mut row = vec![v.name.clone(), with_error(v.value, v.error)];
            if mean_field {
                row.push(v.mean_field.map_or(String::new(), |x| with_error(x, None)));
            }
            if published {
                row.push(v.published.map_or(String::new(), |[x, e]| with_error(x, Some(e))));
            }
            row.extend([super::super::text::typeset(&v.unit), v.source.clone()]);
            table.push(row);
        }
        use super::super::Align::{Left, Right};
        table.align = vec![Left];
        table.align.resize(columns - 2, Right);
        table.align.extend([Left, Left]);
        table
    }

    /// A section for the top of a page; `None` without values and notes.
    pub fn section(&self) -> Option<Section> {
        if self.values.is_empty() && self.notes.is_empty() {
            return None;
        }
        let mut items = vec![Item::Table(self.table())];
        if !self.notes.is_empty() {
            let mut notes = Table::new(["before you use them"]);
            self.notes.iter().for_each(|n| notes.push([n.clone()]));
            items.push(Item::Table(notes));
        }
        items.push(Item::prose("Errors are one standard deviation of the mean."));
        Some(Section::new("Results", items))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::about;
    use super::content::WITHOUT_FLOW;
    use super::*;
    use psidpd_formats::{AboutStage, Expected};
    use psidpd_observe::{Kind, Measured, Series};

    fn table(values: &[f64]) -> series::Table {
        let n = values.len();
        series::Table {
            header: ["step", "temperature", "potential", "pressure"].map(String::from).to_vec(),
            columns: vec![
                (1..=n).map(|k| k as f64).collect(),
                vec![1.0; n],
                values.to_vec(),
                (0..n).map(|k| if k % 2 == 0 { 2.0 } else { 3.0 }).collect(),
            ],
        }
    }

    fn noise(k: usize) -> f64 {
        (12.9898 * k as f64).sin().mul_add(43758.5453, 1e6).fract()
    }

    fn notes(values: &[f64]) -> String {
        gather(None, None, Some(&table(values)), &[]).notes.join("\n")
    }

    #[test]
    fn short_and_drifting_series_are_told_from_good_ones() {
        let good: Vec<f64> = (0..400).map(noise).collect();
        assert_eq!(notes(&good), "");
        assert!(notes(&good[..5]).contains("too short for error bars"));
        assert!(notes(&good[..9]).contains("short: "), "{}", notes(&good[..9]));
        let drifting: Vec<f64> = (0..400).map(|k| noise(k) + 0.01 * k as f64).collect();
        assert!(
            notes(&drifting).contains("drifting: over the last stage the potential energy changes by "),
            "{}",
            notes(&drifting)
        );
    }

    /// The first number behind some words.
    fn number_after(text: &str, words: &str) -> f64 {
        let rest = text.split_once(words).unwrap_or_else(|| panic!("{text}")).1;
        let end = rest.find(|c: char| !(c.is_ascii_digit() || ".-+".contains(c))).unwrap_or(rest.len());
        rest[..end].parse().unwrap_or_else(|_| panic!("{rest}"))
    }

    /// Of n independent values an error is uncertain by 1/√(2n); a line that rises by 0.01 a row rises by 3.99 over 400.
    #[test]
    fn notes_have_their_numbers() {
        let short: Vec<f64> = (0..9).map(noise).collect();
        let note = notes(&short);
        let [values, part] = ["has about ", "itself uncertain by "].map(|words| number_after(&note, words));
        assert!((part - 100.0 / (2.0 * values).sqrt()).abs() < 2.0, "{values} {part}");
        let rising: Vec<f64> = (0..400).map(|k| 0.01 * noise(k) + 0.01 * k as f64).collect();
        let by = number_after(&notes(&rising), "changes by ");
        assert!((by - 3.99).abs() < 0.01, "{by}");
    }

    /// Of 400 independent numbers between 0 and 3, whose variance is 3/4, the error of the mean is √(3/4/400), to a few percent.
    #[test]
    fn means_of_rows_have_the_error_of_the_mean() {
        let mut table = table(&(0..400).map(noise).collect::<Vec<f64>>());
        table.columns[1] = (0..400).map(|k| 3.0 * noise(k + 1000)).collect();
        let found = gather(None, None, Some(&table), &[]);
        let temperature = found.get("temperature").unwrap();
        let error = temperature.error.unwrap();
        assert!((temperature.value - 1.5).abs() < 4.0 * error, "{temperature:?}");
        assert!((error / (0.75f64 / 400.0).sqrt() - 1.0).abs() < 0.25, "{temperature:?}");
    }

    /// An observable with scalars of a name, a unit, a value and its error.
    fn scalars(name: &str, columns: &[(&str, &str, f64, f64)]) -> Observation {
        let none = Observation::new(name, name, Kind::Scalar, &Series::new(1));
        columns.iter().fold(none, |all, &(name, unit, value, error)| {
            all.column(name, unit, [Measured { value, error }])
        })
    }

    /// The same with a tenth of each value as its error.
    fn observed(name: &str, columns: &[(&str, &str, f64)]) -> Observation {
        let columns: Vec<_> =
            columns.iter().map(|&(name, unit, value)| (name, unit, value, 0.1 * value)).collect();
        scalars(name, &columns)
    }

    fn drop(radius: f64) -> Observation {
        let columns = [("radius", radius), ("width", 0.5), ("tension", 3.0)];
        let columns = columns.map(|(name, value)| (name, "length", value, 0.1));
        Observation { note: "It percolates.".into(), ..scalars("drop", &columns) }
    }

    fn values(found: &Headline) -> Vec<(&str, f64, &str)> {
        found.values.iter().map(|v| (v.name.as_str(), v.value, v.unit.as_str())).collect()
    }

    /// Of two routes to one tension the one with the smaller error counts and is named, and a width says what it is a width of.
    #[test]
    fn the_better_tension_is_named() {
        let slab = |errors: [f64; 2]| {
            let column = |name, error: f64| (name, "", 7.0 + error, error);
            let tensions = [column("stress", errors[0]), column("free_energy", errors[1])];
            [scalars("surface_tension", &tensions), scalars("interface_width", &[column("width", 0.1)])]
        };
        for (errors, source, value) in
            [([0.1, 0.2], "surface_tension.stress", 7.1), ([0.2, 0.1], "surface_tension.free_energy", 7.1)]
        {
            let found = gather(None, None, None, &slab(errors));
            let tension = found.get("tension").unwrap();
            assert_eq!((tension.source.as_str(), tension.value, tension.error), (source, value, Some(0.1)));
            assert_eq!(found.get("width").unwrap().source, "interface_width.width: 2 d of tanh(z/d)");
        }
    }

    /// Each observable has a number among the results, in one spelling of units; a mixture has all compositions. Numbers that
    /// do not exist are left out.
    #[test]
    fn every_observable_has_a_result() {
        let all = [
            observed("poiseuille", &[("viscosity", "mass/(r_c time)", 0.8), ("deviation", "1", 0.1)]),
            observed("coexistence", &[("rich_oil", "1", 0.9), ("poor_oil", "1", 0.2)]),
            observed(
                "diffusion",
                &[("diffusion_oil", "r_c^2/time", 0.3), ("diffusion_water", "r_c^2/time", f64::NAN)],
            ),
            observed("rdf_peak", &[("height", "1", 2.1), ("at", "length", 0.8)]),
            observed("velocity_profile_mean", &[("x", "r_c/time", 0.5), ("y", "r_c/time", 0.1)]),
            observed("clusters", &[("count", "1", 3.0), ("largest", "1", 40.0)]),
            observed("contact_angle", &[("angle", "degree", 100.0), ("liquid", "1/volume", 6.0)]),
            observed("interface_width", &[("liquid", "1/volume", f64::NAN)]),
        ];
        let mut about = about();
        for (dimensions, volume) in [(3, "1/length^3"), (2, "1/length^2")] {
            about.dimensions = dimensions;
            about.stages.clear();
            let found = gather(Some(&about), None, None, &all);
            assert_eq!(
                values(&found),
                [
                    ("liquid", 6.0, volume),
                    ("contact_angle", 100.0, "degree"),
                    ("viscosity", 0.8, if dimensions == 3 { "mass/(length time)" } else { "mass/time" }),
                    ("rich_oil", 0.9, "1"),
                    ("poor_oil", 0.2, "1"),
                    ("diffusion_oil", 0.3, "length^2/time"),
                    ("rdf_peak_height", 2.1, "1"),
                    ("rdf_peak_at", 0.8, "length"),
                    ("velocity_profile_mean_x", 0.5, "length/time"),
                    ("velocity_profile_mean_y", 0.1, "length/time"),
                    ("clusters_count", 3.0, "1"),
                ]
            );
            assert!(found.values.iter().all(|v| v.error == Some(0.1 * v.value)), "{found:?}");
        }
    }

    /// The advice on a temperature that is off: a shorter step, but not for a flow.
    #[test]
    fn a_driven_flow_is_not_blamed_on_the_step() {
        let mut hot = table(&[0.0; 80]);
        hot.columns[1] = (0..80).map(|k| 1.4 + 0.01 * noise(k)).collect();
        let mut about = about();
        for (body_forces, says) in
            [(false, "a smaller time step than 0.01"), (true, "`temperature_profile` in [observe]")]
        {
            about.stages.iter_mut().for_each(|s| s.body_forces = body_forces);
            let notes = gather(Some(&about), None, Some(&hot), &[]).notes;
            let temperature: Vec<&String> =
                notes.iter().filter(|n| n.starts_with("the temperature is")).collect();
            assert!(temperature.len() == 1 && temperature[0].contains(says), "{notes:?}");
        }
        // Without the flow the temperature is that of the profile, and what is off then is the step's.
        let profile = |value: f64| scalars(WITHOUT_FLOW, &[("mean", "energy", value, 0.002)]);
        let kt = about.stages.last().unwrap().kt;
        for (value, says) in [(kt, None), (1.2 * kt, Some("a smaller time step"))] {
            let found = gather(Some(&about), None, Some(&hot), &[profile(value)]);
            assert_eq!(found.values.iter().filter(|v| v.unit == "energy").count(), 1, "{found:?}");
            assert_eq!(found.get("temperature").unwrap().value, value);
            let said = found.notes.iter().find(|n| n.starts_with("the temperature is"));
            assert!(
                said.is_some() == says.is_some() && said.is_none_or(|n| n.contains(says.unwrap())),
                "{said:?}"
            );
        }
    }

    #[test]
    fn a_drop_that_reaches_its_image_is_noticed() {
        let about = about();
        let side = about.box_edges[0][0];
        let found = |radius: f64| gather(Some(&about), Some(100.0), None, &[drop(radius)]);
        assert!(found(0.48 * side).notes.iter().any(|n| n.contains("touches its image")));
        let small = found(0.1 * side);
        assert_eq!(small.notes, ["drop: It percolates."]);
        assert_eq!(small.get("tension").map(|v| (v.value, v.error)), Some((3.0, Some(0.1))));
        assert!(small.get("density").is_some_and(|v| v.error.is_none()));
    }

    /// A stage at kT = 0.7 whose temperature is what is given, constant but for what it scatters by; the rows of the stage before are
    /// far off.
    fn run_at(temperature: f64, scatter: f64) -> (About, series::Table) {
        let mut about = about();
        about.stages.iter_mut().for_each(|s| s.kt = 0.7);
        about.box_edges = [[4.0, 0.0, 0.0], [1.0, 5.0, 0.0], [0.5, -0.5, 6.0]];
        let of = |before: f64, value: f64, scatter: f64| -> Vec<f64> {
            let produced = |k| value + if k % 2 == 0 { scatter } else { -scatter };
            (1..=50).map(|_| before).chain((0..100).map(produced)).collect()
        };
        let table = series::Table {
            header: ["step", "temperature", "potential", "pressure"].map(String::from).to_vec(),
            columns: vec![
                (1..=150).map(f64::from).collect(),
                of(50.0, temperature, scatter),
                of(-1.0, -20.0, 0.1),
                of(99.0, 1.25, 0.01),
            ],
        };
        (about, table)
    }

    fn of_temperature(found: &Headline) -> Vec<&String> {
        found.notes.iter().filter(|n| n.starts_with("the temperature is")).collect()
    }

    /// Means are of the last stage alone, the density is that of all particles in the tilted box of 4 · 5 · 6, and what was expected is
    /// told as it was.
    #[test]
    fn values_are_those_of_the_last_stage() {
        let (mut about, table) = run_at(0.7, 0.002);
        let expected =
            |name: &str, mean_field, published| Expected { name: name.into(), mean_field, published };
        about.expected = vec![
            expected("pressure", Some(1.3), Some([1.24, 0.03])),
            expected("temperature", None, Some([0.71, 0.01])),
            expected("tension", Some(4.0), Some([5.0, 0.5])),
        ];
        let found = gather(Some(&about), Some(360.0), Some(&table), &[]);
        let value = |name: &str| found.get(name).unwrap();
        let names: Vec<&str> = found.values.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["density", "temperature", "pressure"]);
        assert!((value("density").value - 3.0).abs() < 1e-12 && value("density").error.is_none());
        assert!(
            (value("temperature").value - 0.7).abs() < 1e-12
                && (value("pressure").value - 1.25).abs() < 1e-12
        );
        assert_eq!(
            (value("pressure").mean_field, value("pressure").published),
            (Some(1.3), Some([1.24, 0.03]))
        );
        assert_eq!(
            (value("temperature").mean_field, value("temperature").published),
            (None, Some([0.71, 0.01]))
        );
        assert_eq!((value("density").mean_field, value("density").published), (None, None));
        let units = ["density", "temperature", "pressure"].map(|name| value(name).unit.as_str());
        assert_eq!(units, ["1/length^3", "energy", "energy/length^3"]);
        assert!(found.notes.is_empty(), "{:?}", found.notes);
    }

    /// The table for a page has what is known of each value, and no column that nothing is in; notes have a table of their own.
    #[test]
    fn a_page_begins_with_what_is_known() {
        use super::super::super::Align::{Left, Right};
        let value = |name: &str, mean_field, published| HeadlineValue {
            name: name.into(),
            value: 1.25,
            error: Some(0.02),
            unit: "r_c".into(),
            source: "a file".into(),
            mean_field,
            published,
        };
        let mut found = Headline::default();
        assert!(found.section().is_none());
        found.values = vec![value("one", None, None), value("two", None, None)];
        let Section { heading, items } = found.section().unwrap();
        assert!(heading == "Results" && matches!(items[..], [Item::Table(_), Item::Prose(_)]));
        let table = found.table();
        let unit = super::super::super::text::typeset("r_c");
        let measured = with_error(1.25, Some(0.02));
        assert_eq!(table.header, ["result", "value ± error", "unit", "from"]);
        assert_eq!(table.align, [Left, Right, Left, Left]);
        assert_eq!(table.rows[1], ["two", &measured, &unit, "a file"]);
        found.values[0].published = Some([1.24, 0.03]);
        found.values[1].mean_field = Some(1.5);
        let table = found.table();
        assert_eq!(table.header, ["result", "value ± error", "mean field", "published", "unit", "from"]);
        assert_eq!(table.align, [Left, Right, Right, Right, Left, Left]);
        let published = with_error(1.24, Some(0.03));
        assert_eq!(table.rows[0], ["one", &measured, "", &published, &unit, "a file"]);
        assert_eq!(table.rows[1], ["two", &measured, "1.5", "", &unit, "a file"]);
        assert_eq!(found.get("two"), Some(&found.values[1]));
        assert_eq!(found.get("three"), None);
        found.notes = vec!["a note".into(), "another".into()];
        let items = found.section().unwrap().items;
        let [Item::Table(_), Item::Table(notes), Item::Prose(_)] = &items[..] else {
            panic!("{}", items.len())
        };
        assert_eq!(notes.rows, [["a note"], ["another"]]);
        found.values.clear();
        assert!(found.section().is_some());
    }

    /// What is not in the folder is not among the results; the number of particles is that of the summary.
    #[test]
    fn results_are_those_of_the_files_that_exist() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(headline(folder.path()), Headline::default());
        let about = super::super::tests::about();
        std::fs::write(folder.path().join("about.json"), serde_json::to_string(&about).unwrap()).unwrap();
        assert_eq!(headline(folder.path()).values, []);
        std::fs::write(folder.path().join("summary.json"), "{\"particles\": 60}").unwrap();
        let rows: String = (1..=40).map(|k| format!("{k},0.5,-1,2\n")).collect();
        std::fs::write(
            folder.path().join("thermo.csv"),
            format!("step,temperature,potential,pressure\n{rows}"),
        )
        .unwrap();
        let observables = serde_json::to_string(&[drop(1.5)]).unwrap();
        std::fs::write(folder.path().join("observables.json"), observables).unwrap();
        let found = headline(folder.path());
        let value = |name: &str| found.get(name).unwrap().value;
        let volume: f64 = (0..3).map(|k| about.box_edges[k][k]).product();
        assert!((value("density") - 60.0 / volume).abs() < 1e-12);
        assert_eq!([value("temperature"), value("radius")], [0.5, 1.5]);
    }

    /// At kT = 0.7 a temperature that is off by 2 % is noticed with its sign and part, one that is off by less than 1 % or by less
    /// than four of its errors is not; nor is one without thermostat, or of Monte Carlo.
    #[test]
    fn a_temperature_that_is_off_is_told_in_parts_of_kt() {
        let notes = |temperature: f64, scatter: f64, change: &dyn Fn(&mut AboutStage)| {
            let (mut about, table) = run_at(temperature, scatter);
            about.stages.iter_mut().for_each(change);
            let found = gather(Some(&about), None, Some(&table), &[]);
            of_temperature(&found).into_iter().cloned().collect::<Vec<String>>()
        };
        let nothing = |_: &mut AboutStage| {};
        for (temperature, says) in [(0.714, "+2.0 % off the kT = 0.7 "), (0.6895, "-1.5 % off the kT = 0.7 ")]
        {
            let found = notes(temperature, 0.002, &nothing);
            assert!(found.len() == 1 && found[0].contains(says), "{found:?}");
        }
        assert!(notes(0.7065, 0.002, &nothing).is_empty() && notes(0.6935, 0.002, &nothing).is_empty());
        assert_eq!(notes(0.7075, 0.002, &nothing).len(), 1);
        assert!(notes(0.714, 0.002, &|s| s.thermostat = false).is_empty());
        assert!(notes(0.714, 0.002, &|s| s.integrator = "monte-carlo, sweeps = 2".into()).is_empty());
    }

    /// Of a temperature with a known error: 4 of it are 0.02, of a kT of 0.7.
    #[test]
    fn a_temperature_within_four_errors_is_not_off() {
        let about = run_at(0.7, 0.0).0;
        let noted = |value: f64| {
            let observed = scalars("temperature", &[("kinetic", "", value, 0.005)]);
            let observed = Observation { stage: "produce".into(), ..observed };
            let mut before = Observation { stage: "equilibrate".into(), ..observed.clone() };
            before.columns[0].values[0] = 9.0;
            let found = gather(Some(&about), None, None, &[before, observed]);
            assert_eq!(found.get("temperature").map(|t| (t.value, t.error)), Some((value, Some(0.005))));
            !of_temperature(&found).is_empty()
        };
        assert_eq!([0.679, 0.681, 0.719, 0.721].map(noted), [true, false, false, true]);
    }

    /// What observables measure, by the name that the headline has for it; each value is its own number.
    #[test]
    fn observables_have_their_names_in_the_headline() {
        let of = |name: &str, columns: &[(&str, f64)]| {
            let columns: Vec<_> = columns.iter().map(|(name, value)| (*name, "", *value)).collect();
            observed(name, &columns)
        };
        let slab = [
            of("temperature", &[("configurational", 1.0), ("kinetic", 2.0)]),
            of("pressure", &[("conservative", 3.0), ("carried", 4.0)]),
            of("interface_width", &[("liquid", 5.0), ("vapour", 6.0), ("width", 7.0)]),
            of("contact_angle", &[("angle", 80.0)]),
        ];
        let found = gather(None, None, None, &slab);
        let expected = [
            ("temperature", 2.0, "energy"),
            ("pressure", 4.0, "energy/length^3"),
            ("liquid", 5.0, "1/length^3"),
            ("vapour", 6.0, "1/length^3"),
            ("width", 7.0, "length"),
            ("contact_angle", 80.0, "degree"),
        ];
        assert_eq!(values(&found), expected);
        assert!(found.values.iter().all(|v| v.error == Some(0.1 * v.value)), "{found:?}");
        let drop = of(
            "drop",
            &[("radius", 1.0), ("liquid", 2.0), ("vapour", 3.0), ("width", 4.0), ("tension", 5.0)],
        );
        let mut plane = about();
        plane.dimensions = 2;
        let found = gather(Some(&plane), None, None, &[drop]);
        let expected = [
            ("liquid", 2.0, "1/length^2"),
            ("vapour", 3.0, "1/length^2"),
            ("tension", 5.0, "energy/length"),
            ("width", 4.0, "length"),
            ("radius", 1.0, "length"),
        ];
        assert_eq!(values(&found), expected);
    }

    /// A drop is as wide as twice its radius and its interface; it touches its image where less than the longest range of the model
    /// is left of the narrowest periodic edge.
    #[test]
    fn a_drop_needs_the_range_of_its_model_beside_it() {
        let mut about = about();
        about.box_edges = [[9.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 4.0]];
        about.box_periodic = [true, true, false];
        let touches = |about: &About, radius: f64| {
            let found = gather(Some(about), Some(100.0), None, &[drop(radius)]);
            found.notes.iter().any(|n| n.contains("touches its image") && n.contains("in a box of 8.00"))
        };
        // 2 · 3.24 + 0.5 leaves 1.02 of 8, and the range is 1.
        assert!(!touches(&about, 3.24) && touches(&about, 3.26));
        about.densities[0].range = 1.5;
        assert!(!touches(&about, 2.99) && touches(&about, 3.01));
    }
}
