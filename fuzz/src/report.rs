use psidpd::report::run_report;

/// The files of a run that other programs may have written. In the input each follows a line with its name.
const FILES: [&str; 6] =
    ["about.json", "summary.json", "timing.json", "observables.json", "thermo.csv", "final.data"];

/// Any files in the folder of a run make a page, which says what is wrong with them.
pub fn report(text: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for part in text.split("=== ") {
        let (name, text) = part.split_once('\n').unwrap_or((part, ""));
        if FILES.contains(&name) {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
    }
    if let Ok(page) = run_report(folder.path()) {
        let page = page.render();
        assert!(page.ends_with("</html>\n") && page.len() < 20_000_000, "{} bytes", page.len());
    }
}
