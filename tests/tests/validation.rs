//! The quick validation on the command line.

use psidpd_tests::{psidpd, said};

/// Every check of the quick validation passes. Its statistical checks together raise a false alarm once in a
/// thousand runs, and its seeds are fixed.
#[test]
fn the_quick_validation_passes() {
    let folder = tempfile::tempdir().unwrap();
    let output = psidpd(folder.path(), &["validate", "--out", "report", "--json", "results.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = std::fs::read_to_string(folder.path().join("results.json")).unwrap();
    let results: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(results["passed"], true);
    let checks = results["checks"].as_array().unwrap();
    for section in ["forces", "thermostat", "mixture", "observables", "trajectory", "energy", "equilibrium"] {
        assert!(checks.iter().any(|c| c["section"] == section), "no check of {section}");
    }
    let page = std::fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Temperature without thermostat"));
}
