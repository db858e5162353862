use super::*;
use psidpd_formats::about::Column;
use psidpd_formats::{AboutDensity, AboutStage};

/// The description of a run of two stages.
pub fn about() -> About {
    let stage = |name: &str, begin, end| AboutStage {
        name: name.into(),
        begin,
        end,
        dt: 0.01,
        kt: 1.0,
        thermostat: true,
        body_forces: false,
        integrator: "velocity-verlet".into(),
    };
    About {
        program: "psidpd".into(),
        title: "A title".into(),
        model: "A model".into(),
        dimensions: 3,
        species: vec!["oil".into(), "water".into()],
        masses: vec![1.0; 2],
        densities: vec![AboutDensity { name: "n".into(), kernel: "quadratic".into(), range: 0.75 }],
        kt: 1.0,
        seed: 1,
        precision: "mixed".into(),
        device: "cpu".into(),
        box_origin: [0.0; 3],
        box_edges: [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 6.0]],
        box_periodic: [true; 3],
        stages: vec![stage("equilibrate", 0, 50), stage("produce", 50, 150)],
        units: "reduced".into(),
        thermo: vec![Column { name: "extra".into(), title: "Something else".into(), unit: "energy".into() }],
        expected: Vec::new(),
    }
}

const OBSERVABLES: &str = r#"[
    {"name": "temperature", "title": "Temperature, kinetic", "stage": "produce", "kind": "scalar", "x": null,
     "columns": [{"name": "kT", "unit": "energy", "values": [1.0023], "errors": [0.0011]}], "samples": 10, "note": ""},
    {"name": "tension", "title": "Surface tension", "stage": "produce", "kind": "scalar", "x": null,
     "columns": [{"name": "stress", "unit": "energy/length^2", "values": [7.45], "errors": [0.04]},
                 {"name": "free energy", "unit": "energy/length^2", "values": [null], "errors": [null]}],
     "samples": 10, "note": "two routes"},
    {"name": "profile", "title": "Density profile", "stage": "produce", "kind": "profile",
     "x": {"name": "z", "unit": "length", "values": [0.5, 1.5, 2.5]},
     "columns": [{"name": "rho_oil", "unit": "length^-3", "values": [1, 2, 3], "errors": [0.1, 0.2, 0.1]},
                 {"name": "rho_water", "unit": "length^-3", "values": [3, null, 1], "errors": null},
                 {"name": "kT", "unit": "energy", "values": [1, 1, 1], "errors": [0.1, 0.1, 0.1]}],
     "samples": 10, "note": "bins of 1"},
    {"name": "g", "title": "Radial distribution", "stage": "produce", "kind": "curve",
     "x": {"name": "r", "unit": "length", "values": []}, "columns": [], "samples": 0, "note": null},
    {"name": "map", "title": "Density map", "stage": "produce", "kind": "field", "x": null, "columns": [
     {"name": "x", "unit": "length", "values": [0, 0, 0, 1, 1, 1]}, {"name": "z", "unit": "length", "values": [0, 1, 2, 0, 1, 2]},
     {"name": "rho", "unit": "1", "values": [1, 2, 3, 4, 5, null], "errors": []}], "samples": 3, "note": ""},
    {"name": "surface", "title": "Points of a surface", "kind": "field", "x": null, "columns": [
     {"name": "r", "unit": "length", "values": [0, 0.5, 2]}, {"name": "z", "unit": "length", "values": [4, 5, 7], "errors": [0.5, 0.5, 0.5]}]},
    {"name": "contact_angle", "title": "Cap", "kind": "scalar", "columns": [
     {"name": "angle", "unit": "degree", "values": [120.0], "errors": [2.0]},
     {"name": "radius", "unit": "length", "values": [2.0], "errors": [0.1]}]},
    {"name": "contact_angle_profile", "title": "Contour", "kind": "profile",
     "x": {"name": "height", "unit": "length", "values": [0.5, 1.5, 2.5]},
     "columns": [{"name": "radius", "unit": "length", "values": [1.9, 2.0, 1.3], "errors": [0.1, 0.1, 0.1]}]},
    {"name": "contact_angle_field", "title": "Cap of liquid", "kind": "field", "columns": [
     {"name": "r", "unit": "length", "values": [0.5, 1.5, 2.5, 0.5, 1.5, 2.5]},
     {"name": "height", "unit": "length", "values": [0.5, 0.5, 0.5, 2.5, 2.5, 2.5]},
     {"name": "density", "unit": "1/volume", "values": [6, 6, 0, 6, 5, 0]}]},
    {"name": "clusters_series", "title": "Clusters of drops", "kind": "series",
     "x": {"name": "time", "unit": "time", "values": [1, 2]},
     "columns": [{"name": "count", "unit": "1", "values": [3, 4]}, {"name": "largest", "unit": "1", "values": [4241, 4000]}]},
    {"name": "flat", "title": "Bad map", "kind": "field", "columns": [{"name": "x", "values": [0, 1]}]}
]"#;

fn thermo() -> String {
    let mut text =
        "step,time,temperature,potential,kinetic,pressure,pxx,pyy,pzz,pxy,pxz,pyz,extra\n".to_owned();
    for k in 0..=15 {
        let noise = f64::from(k * 37 % 11) / 11.0;
        let row: Vec<String> = (0..11).map(|c| format!("{}", f64::from(c) + noise)).collect();
        text += &format!("{},{},{}\n", 10 * k, 0.1 * f64::from(k), row.join(","));
    }
    text + "160,1.6,1.0"
}

const DATA: &str = "title\n\n2 atoms\n2 atom types\n\n0 4 xlo xhi\n0 4 ylo yhi\n0 6 zlo zhi\n\nAtoms # atomic\n\n\
                    1 1 1 2 1 0 0 0\n2 2 3 2 5 0 0 0\n";

fn texts(page: &str) -> Vec<String> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(page, options).unwrap();
    for node in document.descendants() {
        for attribute in node.attributes().filter(|a| matches!(a.name(), "src" | "href")) {
            assert!(attribute.value().starts_with("data:image/png;base64,"), "{attribute:?}");
        }
    }
    document.descendants().filter_map(|n| n.text()).map(|t| t.trim().to_owned()).collect()
}

fn page(folder: &Path) -> (Vec<String>, String) {
    let path = write_run_report(folder, Existing::Keep).unwrap();
    let page = std::fs::read_to_string(path).unwrap();
    (texts(&page), page)
}

#[test]
fn every_observable_and_every_series_is_shown_with_its_error() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    about().write(folder.path()).unwrap();
    write("observables.json", OBSERVABLES);
    write("thermo.csv", &thermo());
    write("final.data", DATA);
    write(
        "summary.json",
        r#"{"title": "A title", "particles": 2, "wall_seconds": 3.5, "out_of_bounds": [0, 7]}"#,
    );
    let (texts, page) = page(folder.path());
    let has = |text: &str| assert!(texts.iter().any(|t| t.contains(text)), "{text} is not in the page");
    // The observables, which the scene asks for, come before the totals.
    let place = |heading: &str| texts.iter().position(|t| t == heading).expect(heading);
    assert!(place("Results") < place("Observables") && place("Observables") < place("Pictures"));
    assert!(place("Pictures") < place("Series"));
    for text in [
        "A title",
        "A model",
        "oil (1)",
        "water (1)",
        "Temperature, kinetic",
        "1.0023 ± 0.0011",
        "Surface tension: stress",
        "7.450 ± 0.040",
        "Surface tension: free energy",
        "two routes",
        "Density profile",
        "rho_oil",
        "rho_water",
        "kT [energy]",
        "rho_oil, rho_water [length⁻³]",
        "x [length]",
        "n [1/length³]",
        "[length⁻³]",
        "Radial distribution",
        "Density map",
        "Points of a surface",
        "z [length]",
        "Bad map: ",
        "Local density",
        "Local density of water",
        "Temperature",
        "Potential energy",
        "Total energy",
        "Pressure tensor, diagonal",
        "p_yz",
        "Something else",
        "produce",
        "0 times below, 7 times above",
        "thermo.csv",
    ] {
        has(text);
    }
    // A drop on a wall is a map with its surface and the fitted circle, not a grid of points.
    let figure = |title: &str| {
        let start = page.find(&format!("<title>{title}</title>")).expect(title);
        &page[start..start + page[start..].find("</svg>").unwrap()]
    };
    let map = figure("Cap of liquid");
    assert!(
        map.contains("<image") && map.contains("1/length³") && map.to_lowercase().contains("#ff5a36"),
        "{map}"
    );
    assert!(figure("Contour").contains("fitted circle"));
    has("Red, dashed: the fitted circle.");
    // The number of drops does not share an axis with their sizes.
    assert_eq!(page.matches("<title>Clusters of drops</title>").count(), 2);
    // Five points of the profile have error bars, each with a stroke and two caps.
    let start = page.find("<title>Density profile</title>").unwrap();
    let plot = &page[start..start + page[start..].find("</svg>").unwrap()];
    assert!(plot.matches("<polyline").count() + plot.matches("<line").count() >= 9, "{plot}");
    // The letters of a picture may spell anything.
    let mut parts = page.split(";base64,");
    let begin = parts.next().unwrap().to_owned();
    let words = parts.fold(begin, |all, part| all + part.split_once('"').map_or("", |(_, rest)| rest));
    assert!(!words.contains("NaN"));
    let missing = texts.iter().find(|t| t.starts_with("Not there")).unwrap();
    assert!(missing.contains("dump.lammpstrj") && !missing.contains("final.data"), "{missing}");
}

#[test]
fn what_is_not_there_is_said() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(write_run_report(folder.path(), Existing::Keep), Err(ReportError::NoRun { .. })));
    assert!(write_run_report(&folder.path().join("none"), Existing::Keep).is_err());
    std::fs::write(folder.path().join("final.data"), DATA).unwrap();
    let (texts, _) = page(folder.path());
    let all = texts.join("\n");
    for text in ["no thermo.csv", "no observables.json", "no summary.json", "no snapshots", "1 (1)"] {
        assert!(all.contains(text), "{text}: {all}");
    }
    std::fs::remove_file(folder.path().join("final.data")).unwrap();
    std::fs::write(folder.path().join("thermo.csv"), "step,time").unwrap();
    let (texts, _) = page(folder.path());
    let all = texts.join("\n");
    assert!(all.contains("no final.data") && all.contains("no rows yet"), "{all}");
}

/// A last state of four terabytes, which takes no room on the disk, does not end the program that makes the page.
#[test]
fn a_state_that_does_not_fit_into_memory_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("thermo.csv"), thermo()).unwrap();
    std::fs::File::create(folder.path().join("final.data")).unwrap().set_len(1 << 42).unwrap();
    let (texts, _) = page(folder.path());
    let all = texts.join("\n");
    assert!(all.contains("final.data needs about 17592.2 GB of memory"), "{all}");
    assert!(all.contains("there are no pictures of it") && all.contains("Pressure"), "{all}");
}

#[test]
fn what_cannot_be_read_is_said_and_the_rest_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("about.json", "{"),
        ("summary.json", "[1, 2]"),
        ("observables.json", "{\"a\": 1}"),
        ("final.data", "rubbish"),
        ("thermo.csv", "step,time,pressure\n1,0.1,oops\n2,0.2,3.0\n"),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    std::fs::create_dir(folder.path().join("snapshots")).unwrap();
    for step in [1, 2] {
        std::fs::write(
            folder.path().join("snapshots").join(psidpd_pictures::snapshot::snapshot_name(step)),
            "x",
        )
        .unwrap();
    }
    let (texts, page) = page(folder.path());
    let all = texts.join("\n");
    for text in
        ["What could not be read", "about.json", "observables.json", "final.data", "No film", "Pressure"]
    {
        assert!(all.contains(text), "{text}: {all}");
    }
    assert!(!page.contains("NaN"));
}
