//! The output of a page's commands, compared with the page's text.

use std::path::Path;

/// The printed lines of a page's commands, and the values with errors that they found.
#[derive(Default)]
pub struct Results {
    lines: Vec<String>,
    values: Vec<(f64, f64)>,
    /// Number of the page's numbers that were compared with values.
    pub held: usize,
}

impl Results {
    /// Adds the printed lines of a command, and its values followed by ± and an error.
    pub fn add(&mut self, printed: &[u8]) {
        for line in String::from_utf8_lossy(printed).lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            for part in words.windows(3).filter(|part| part[1] == "±") {
                if let (Ok(value), Ok(error)) = (part[0].parse(), part[2].parse()) {
                    self.values.push((value, error));
                }
            }
            self.lines.push(words.join(" "));
        }
    }

    /// Adds the observables that a run wrote into its folder, if there are any; panics if they are not JSON.
    pub fn add_observables(&mut self, folder: &Path) {
        let Ok(text) = std::fs::read_to_string(folder.join("observables.json")) else { return };
        let observables: serde_json::Value = serde_json::from_str(&text).expect("observables are JSON");
        let columns = observables.as_array().into_iter().flatten();
        for column in columns.flat_map(|observable| observable["columns"].as_array()).flatten() {
            if let (Some(value), Some(error)) = (column["values"][0].as_f64(), column["errors"][0].as_f64()) {
                self.values.push((value, error));
            }
        }
    }

    /// Panics unless every line of a block was printed, up to one unit in the last digit of each number of the block.
    pub fn hold_lines(&self, page: &str, block: &str) {
        for line in block.lines().filter(|line| !line.trim().is_empty()) {
            let printed = self.lines.iter().any(|printed| same(line, printed));
            assert!(printed, "{page}: no command prints\n{line}\nbut\n{}", self.lines.join("\n"));
        }
    }

    /// Panics unless every number of a text with an error in its last digits, as 16.14(4), agrees with a
    /// found value: within four combined errors, which chance exceeds once in 16 000 numbers, and with a
    /// ratio of the errors between a third and three.
    pub fn hold_numbers(&mut self, page: &str, text: &str) {
        for (shown, value, error) in with_errors(text) {
            let found = self.values.iter().any(|(v, e)| {
                (value - v).abs() <= 4.0 * error.hypot(*e) && error <= 3.0 * e && *e <= 3.0 * error
            });
            assert!(found, "{page}: {shown} is not among {:?}", self.values);
            self.held += 1;
        }
    }
}

/// Whether two lines have the same words, and numbers that agree within one unit in the last digit of the first.
fn same(shown: &str, printed: &str) -> bool {
    let (shown, printed): (Vec<&str>, Vec<&str>) =
        (shown.split_whitespace().collect(), printed.split_whitespace().collect());
    let agree = |a: &str, b: &str| {
        let [x, y] = [a, b].map(|word| word.trim_end_matches(',').parse::<f64>());
        match (x, y) {
            (Ok(x), Ok(y)) => (x - y).abs() <= 1.01 * last_digit(a.trim_end_matches(',')),
            _ => a == b,
        }
    };
    shown.len() == printed.len() && shown.iter().zip(&printed).all(|(a, b)| agree(a, b))
}

/// One unit in the last digit of a number.
fn last_digit(number: &str) -> f64 {
    let digits = number.split_once('.').map_or(0, |(_, digits)| digits.len());
    10f64.powi(-(digits as i32))
}

/// The numbers of a text with an error in parentheses: their text, value and error.
fn with_errors(text: &str) -> Vec<(String, f64, f64)> {
    let is_part = |c: char| c.is_ascii_digit() || ".-−".contains(c);
    let mut found = Vec::new();
    for (at, _) in text.match_indices('(') {
        let (before, behind) = (&text[..at], &text[at + 1..]);
        let start = before.trim_end_matches(is_part).len();
        let (number, digits) = (&before[start..], behind.split(')').next().unwrap_or_default());
        let value: Result<f64, _> = number.replace('−', "-").parse();
        if let (Ok(value), Ok(error)) = (value, digits.parse::<u32>()) {
            found.push((format!("{number}({digits})"), value, f64::from(error) * last_digit(number)));
        }
    }
    found
}
