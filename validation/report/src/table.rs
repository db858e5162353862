//! Tables for the terminal and for the page.

use std::io::{IsTerminal, stdout};

use super::text::{columns, one_line};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Align {
    /// To the right if every cell that is not blank looks like a number.
    #[default]
    Auto,
    Left,
    Right,
}

/// A table of text. Rows may be shorter or longer than the header.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// The alignment of each column; columns beyond its end are [`Align::Auto`].
    pub align: Vec<Align>,
}

impl Table {
    pub fn new<S: Into<String>>(header: impl IntoIterator<Item = S>) -> Self {
        Self { header: header.into_iter().map(Into::into).collect(), rows: Vec::new(), align: Vec::new() }
    }

    pub fn push<S: Into<String>>(&mut self, row: impl IntoIterator<Item = S>) {
        self.rows.push(row.into_iter().map(Into::into).collect());
    }

    /// The table as lines for a terminal. If standard output is a terminal and `NO_COLOR` is not set, the header is bold and
    /// cells that read "pass" or "fail" are coloured.
    pub fn to_text(&self) -> String {
        let no_color = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
        self.to_text_with(stdout().is_terminal() && !no_color)
    }

    /// The table as lines, with or without colour.
    pub fn to_text_with(&self, colour: bool) -> String {
        let count = self.column_count();
        let right: Vec<bool> = (0..count).map(|c| self.is_right(c)).collect();
        let mut widths = vec![0; count];
        for row in std::iter::once(&self.header).chain(&self.rows) {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = columns(&one_line(cell)).max(*width);
            }
        }
        let line = |row: &[String], paint: &dyn Fn(&str) -> Option<&'static str>| {
            let mut out = String::new();
            for (c, &width) in widths.iter().enumerate() {
                let cell = row.get(c).map(|s| one_line(s)).unwrap_or_default();
                let pad = " ".repeat(width.saturating_sub(columns(&cell)));
                let code = paint(&cell).filter(|_| colour && !cell.is_empty());
                let cell = match code {
                    Some(code) => format!("\u{1b}[{code}m{cell}\u{1b}[0m"),
                    None => cell,
                };
                if c > 0 {
                    out.push_str("  ");
                }
                out += &if right[c] { pad + &cell } else { cell + &pad };
            }
            out.truncate(out.trim_end().len());
            out.push('\n');
            out
        };
        let mut out = String::new();
        if !self.header.is_empty() {
            out += &line(&self.header, &|_| Some("1"));
            let rules: Vec<String> = widths.iter().map(|&w| "─".repeat(w)).collect();
            out += &line(&rules, &|_| Some("2"));
        }
        for row in &self.rows {
            out += &line(row, &|cell| verdict(cell).map(|passed| if passed { "1;32" } else { "1;31" }));
        }
        out
    }

    /// The number of columns of the header or of the widest row.
    pub(super) fn column_count(&self) -> usize {
        self.rows.iter().map(Vec::len).fold(self.header.len(), usize::max)
    }

    pub(super) fn is_right(&self, column: usize) -> bool {
        match self.align.get(column).copied().unwrap_or_default() {
            Align::Left => false,
            Align::Right => true,
            Align::Auto => {
                let mut numbers = 0;
                for cell in self.rows.iter().filter_map(|row| row.get(column)) {
                    if is_number(cell) {
                        numbers += 1;
                    } else if !is_blank(cell) {
                        return false;
                    }
                }
                numbers > 0
            }
        }
    }
}

/// Whether a cell, in upper or lower case, says that a check passed or failed; `None` if it says neither.
pub(super) fn verdict(cell: &str) -> Option<bool> {
    match cell.trim().to_ascii_lowercase().as_str() {
        "pass" | "passed" => Some(true),
        "fail" | "failed" => Some(false),
        _ => None,
    }
}

fn is_blank(cell: &str) -> bool {
    matches!(cell.trim(), "" | "-" | "–" | "—")
}

/// Returns true if a cell is a number, perhaps with an error or a percent sign.
fn is_number(cell: &str) -> bool {
    let cell = cell.trim();
    if matches!(cell.to_ascii_lowercase().as_str(), "nan" | "inf" | "-inf" | "−inf") {
        return true;
    }
    let body = cell.trim_start_matches(['+', '-', '−', '±', '<', '>', '≤', '≥', '.', ' ']);
    body.starts_with(|c: char| c.is_ascii_digit())
        && body
            .chars()
            .all(|c| c.is_ascii_digit() || "⁰¹²³⁴⁵⁶⁷⁸⁹⁻".contains(c) || " .,+-−±×eE%()/".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> Table {
        let mut table = Table::new(["check", "σ", "verdict"]);
        table.push(["mass", "0.5", "pass"]);
        table.push(["momentum", "-12.25 ± 0.1", "FAIL"]);
        table
    }

    #[test]
    fn columns_line_up() {
        assert_eq!(
            sample().to_text_with(false),
            "check                σ  verdict\n\
             ────────  ────────────  ───────\n\
             mass               0.5  pass\n\
             momentum  -12.25 ± 0.1  FAIL\n"
        );
    }

    #[test]
    fn colour_only_when_asked() {
        assert!(!sample().to_text_with(false).contains('\u{1b}'));
        let text = sample().to_text_with(true);
        assert!(text.contains("\u{1b}[1;32mpass\u{1b}[0m"));
        assert!(text.contains("\u{1b}[1;31mFAIL\u{1b}[0m"));
    }

    #[test]
    fn alignment() {
        let mut table = sample();
        assert_eq!([0, 1, 2, 9].map(|c| table.is_right(c)), [false, true, false, false]);
        table.align = vec![Align::Right, Align::Left];
        assert_eq!([0, 1].map(|c| table.is_right(c)), [true, false]);
        assert!(is_number("1.2(3)×10⁻⁵") && is_number("3 %") && !is_number("3 fluids"));
    }

    #[test]
    fn escape_codes_in_cells_are_disarmed() {
        let mut table = Table::new(["a"]);
        table.push(["\u{1b}[31mred\nnext"]);
        let text = table.to_text_with(false);
        assert!(!text.contains('\u{1b}') && text.lines().count() == 3);
    }

    proptest! {
        #[test]
        fn ragged_rows_are_fine(
            header in prop::collection::vec(".*", 0..4),
            rows in prop::collection::vec(prop::collection::vec(".*", 0..5), 0..4),
        ) {
            let table = Table { header, rows, align: vec![] };
            let extra = if table.header.is_empty() { 0 } else { 2 };
            prop_assert_eq!(table.to_text_with(false).lines().count(), table.rows.len() + extra);
            table.to_text_with(true);
        }
    }
}
