//! Totals against time, and their means.

use super::super::text::{named, typeset};
use super::super::{Plot, Series, Style, extremes};
use super::{About, FormatError, Item, Path, Section, with_error};
use psidpd_formats::THERMO;
use psidpd_formats::files::read_if_there;
use psidpd_observe::statistics::{MINIMUM_SAMPLES, estimate};

/// The numbers of `thermo.csv`.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub header: Vec<String>,
    /// The columns have equal lengths. Entries that are not numbers become NaN.
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a file of comma-separated numbers with one line of names; `None` if the file does not exist. An incomplete last
    /// line, which a killed run may leave, is ignored.
    pub fn read(path: &Path) -> Result<Option<Table>, FormatError> {
        let Some(text) = read_if_there(path)? else { return Ok(None) };
        let mut lines = text.lines().filter(|l| !l.trim().is_empty());
        let header: Vec<String> =
            lines.next().unwrap_or("").split(',').map(|w| w.trim().to_owned()).collect();
        let mut columns = vec![Vec::new(); header.len()];
        for line in lines {
            let words: Vec<&str> = line.split(',').collect();
            if words.len() == header.len() {
                for (column, word) in columns.iter_mut().zip(words) {
                    column.push(word.trim().parse().unwrap_or(f64::NAN));
                }
            }
        }
        Ok(Some(Table { header, columns }))
    }

    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.header.iter().position(|h| h == name).map(|k| self.columns[k].as_slice())
    }

    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// The largest number of points of a curve; more would not be visible.
const POINTS: usize = 1200;

pub fn section(table: Option<&Table>, about: Option<&About>, particles: Option<usize>) -> Section {
    let heading = "Series";
    let say = |text: &str| Section::new(heading, vec![Item::prose(text)]);
    let Some(table) = table else {
        return say("There is no thermo.csv: the scene asks for none, or the run has not begun.");
    };
    if table.rows() == 0 {
        return say("thermo.csv has no rows yet.");
    }
    let mut curves = Curves::of(table, about);
    let mut items = vec![Item::Prose(curves.describe())];
    items.push(Item::Table(curves.means(particles)));
    for (plot, caption) in curves.plots(particles) {
        items.push(
            Item::figure(&plot, caption)
                .unwrap_or_else(|error| Item::Prose(format!("{}: {error}", plot.title))),
        );
    }
    Section::new(heading, items)
}

/// The rows of the last stage that has any.
pub fn last_stage(table: &Table, about: Option<&About>) -> std::ops::Range<usize> {
    let stages = Curves::of(table, about).stages;
    stages[stages.len() - 1].1.clone()
}

/// The table with the properties of its rows.
struct Curves<'a> {
    table: &'a Table,
    about: Option<&'a About>,
    /// The name and the values of the abscissa.
    x: (&'static str, Vec<f64>),
    /// The rows of each stage, with its name.
    stages: Vec<(String, std::ops::Range<usize>)>,
    drawn: Vec<&'a str>,
}

impl<'a> Curves<'a> {
    fn of(table: &'a Table, about: Option<&'a About>) -> Curves<'a> {
        let count = || (0..table.rows()).map(|k| k as f64).collect();
        let x = [("time", "time [length √(mass/energy)]"), ("step", "step")]
            .into_iter()
            .find_map(|(name, label)| Some((label, table.get(name)?.to_vec())))
            .unwrap_or_else(|| ("row", count()));
        let steps = table.get("step").map_or_else(count, <[f64]>::to_vec);
        let mut stages = Vec::new();
        for stage in about.map_or(&[][..], |a| &a.stages) {
            // The initial state of a stage does not belong to that stage.
            let first = steps.partition_point(|s| *s <= stage.begin as f64);
            let end = steps.partition_point(|s| *s <= stage.end as f64);
            if end > first {
                stages.push((stage.name.clone(), first..end));
            }
        }
        if stages.is_empty() {
            stages.push(("run".into(), 0..table.rows()));
        }
        Curves { table, about, x, stages, drawn: vec!["step", "time"] }
    }

    /// A label with the unit of a column.
    fn label(&self, symbol: &str, name: &str) -> String {
        named(symbol, &self.column(name).1)
    }

    /// The title and the unit of a column.
    fn column(&self, name: &str) -> (String, String) {
        let told = self.about.and_then(|a| a.thermo.iter().find(|c| c.name == name));
        let known = THERMO.iter().find(|c| c.0 == name);
        match (told, known) {
            (Some(c), _) => (c.title.clone(), c.unit.clone()),
            (None, Some(c)) => (c.1.into(), c.2.into()),
            (None, None) => (name.into(), String::new()),
        }
    }

    fn describe(&self) -> String {
        let (name, rows) = &self.stages[self.stages.len() - 1];
        format!(
            "{} rows. Means are over the {} rows of the last stage, “{name}”; their errors are one standard \
             deviation of the mean, correlation of the rows taken into account. \
             Fewer than {MINIMUM_SAMPLES} rows have none. In the figures pale lines are single rows, strong \
             ones means from the start of each stage up to that row.",
            self.table.rows(),
            rows.len()
        )
    }

    fn means(&self, particles: Option<usize>) -> super::super::Table {
        let mut out =
            super::super::Table::new(["quantity", "mean ± error", "independent rows", "unit", "what it is"]);
        let rows = self.stages[self.stages.len() - 1].1.clone();
        for (name, column) in self.table.header.iter().zip(&self.table.columns) {
            if name == "step" || name == "time" {
                continue;
            }
            let (title, unit) = self.column(name);
            let values = &column[rows.clone()];
            let row = |name: String, scale: f64, title: String| {
                let (text, worth) = match estimate(values) {
                    Ok(e) => {
                        (with_error(e.mean / scale, Some(e.error / scale)), format!("{:.0}", e.effective()))
                    }
                    Err(_) => {
                        let mean = values.iter().sum::<f64>() / values.len() as f64;
                        (with_error(mean / scale, None), String::new())
                    }
                };
                [name, text, worth, typeset(&unit), title]
            };
            out.push(row(name.clone(), 1.0, title));
            if let (Some(n), "potential" | "kinetic") = (particles, name.as_str()) {
                out.push(row(format!("{name} / N"), n as f64, "the same for each particle".into()));
            }
        }
        out.align = vec![super::super::Align::Left, super::super::Align::Right];
        out
    }

    fn plots(&mut self, particles: Option<usize>) -> Vec<(Plot, String)> {
        let mut plots = Vec::new();
        let scale = particles.map_or(1.0, |n| n.max(1) as f64);
        let each = if particles.is_some() { " / N" } else { "" };
        if let Some(values) = self.take("temperature") {
            let mut plot = self.plot("Temperature", &self.label("kT", "temperature"), values);
            let last = self.about.and_then(|a| a.stages.last());
            if let Some(stage) = last.filter(|s| s.thermostat) {
                plot.levels.push((stage.kt, format!("set: {}", stage.kt)));
            }
            plots.push((plot, "Kinetic temperature.".into()));
        }
        let kinetic = self.take("kinetic");
        if let Some(potential) = self.take("potential") {
            let values: Vec<f64> = potential.iter().map(|u| u / scale).collect();
            plots.push((
                self.plot("Potential energy", &self.label(&format!("U{each}"), "potential"), &values),
                String::new(),
            ));
            if let Some(kinetic) = kinetic {
                let total: Vec<f64> = potential.iter().zip(kinetic).map(|(u, k)| (u + k) / scale).collect();
                let caption = "Potential and kinetic energy together: constant where no thermostat acts, up to \
                               the error of the time step.";
                plots.push((
                    self.plot("Total energy", &self.label(&format!("E{each}"), "potential"), &total),
                    caption.into(),
                ));
            }
        }
        if let Some(values) = self.take("pressure") {
            plots.push((self.plot("Pressure", &self.label("p", "pressure"), values), String::new()));
        }
        let diagonal = [("pxx", "p_xx"), ("pyy", "p_yy"), ("pzz", "p_zz")];
        let others = [("pxy", "p_xy"), ("pxz", "p_xz"), ("pyz", "p_yz")];
        for (title, names) in
            [("Pressure tensor, diagonal", diagonal), ("Pressure tensor, off the diagonal", others)]
        {
            let mut plot = self.empty(title, &self.label("running mean", names[0].0));
            for (name, label) in names {
                // In two dimensions all components that involve z are zero.
                if let Some(values) = self.take(name).filter(|v| v.iter().any(|p| *p != 0.0)) {
                    plot.series.push(Series::new(label, self.running(values), Style::Line));
                }
            }
            if !plot.series.is_empty() {
                plots.push((plot, "Means from the start of each stage.".into()));
            }
        }
        let rest: Vec<&str> = self.table.header.iter().map(String::as_str).collect();
        for name in rest {
            if let Some(values) = self.take(name) {
                let title = self.column(name).0;
                plots.push((self.plot(&title, &self.label(name, name), values), String::new()));
            }
        }
        for (plot, caption) in &mut plots {
            let hidden = self.clip(plot);
            if hidden > 0 {
                let space = if caption.is_empty() { "" } else { " " };
                let points = if hidden == 1 { "point is" } else { "points are" };
                *caption +=
                    &format!("{space}{hidden} {points} not shown: far outside the range of the last stage.");
            }
        }
        plots
    }

    /// Removes rows from a plot that would leave no room for the last stage; returns their number.
    fn clip(&self, plot: &mut Plot) -> usize {
        let rows = &self.stages[self.stages.len() - 1].1;
        // A single stage begins with its own equilibration.
        let first = if self.stages.len() > 1 { rows.start } else { rows.start + rows.len() / 2 };
        let from = self.x.1[first];
        let late = |p: &&(f64, f64)| p.0 >= from && p.1.is_finite();
        let of_last = plot.series.iter().flat_map(|s| s.points.iter().filter(late).map(|p| p.1));
        let [low, high] = extremes(of_last.chain(plot.levels.iter().map(|l| l.0)));
        let room = if high > low { high - low } else { high.abs().max(1.0) };
        let inside = |y: f64| y >= low - room && y <= high + room;
        let mut hidden = 0;
        for series in &mut plot.series {
            let outside: Vec<_> =
                series.points.iter_mut().filter(|p| p.1.is_finite() && !inside(p.1)).collect();
            hidden = hidden.max(outside.len());
            outside.into_iter().for_each(|p| p.1 = f64::NAN);
        }
        hidden
    }

    /// A column that no plot has shown yet.
    fn take(&mut self, name: &str) -> Option<&'a [f64]> {
        let at = self.table.header.iter().position(|h| h == name)?;
        let name = self.table.header[at].as_str();
        (!self.drawn.contains(&name)).then(|| {
            self.drawn.push(name);
            self.table.columns[at].as_slice()
        })
    }

    fn empty(&self, title: &str, label: &str) -> Plot {
        let end = |rows: &std::ops::Range<usize>| {
            let (a, b) = (self.x.1[rows.start.saturating_sub(1)], self.x.1[rows.start]);
            if rows.start == 0 { f64::NAN } else { 0.5 * (a + b) }
        };
        let marks = if self.stages.len() > 1 {
            self.stages.iter().map(|(name, rows)| (end(rows), name.clone())).collect()
        } else {
            Vec::new()
        };
        Plot { marks, ..Plot::new(title, [self.x.0, label], Vec::new()) }
    }

    /// Plots single rows and their running mean.
    fn plot(&self, title: &str, label: &str, values: &[f64]) -> Plot {
        let mut plot = self.empty(title, label);
        let rows: Vec<(f64, f64)> = self.x.1.iter().copied().zip(values.iter().copied()).collect();
        plot.series.push(Series::new("rows", thin(&rows), Style::Faint));
        plot.series.push(Series::new("running mean", self.running(values), Style::Line));
        plot
    }

    /// Means from the start of each stage. A gap separates the stages.
    fn running(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let mut points = Vec::new();
        for (_, rows) in &self.stages {
            let (mut sum, mut count) = (0.0, 0.0);
            let mut stage = Vec::new();
            for k in rows.clone() {
                if values[k].is_finite() {
                    sum += values[k];
                    count += 1.0;
                }
                stage.push((self.x.1[k], sum / count));
            }
            points.extend(thin(&stage));
            // A NaN ends the line here.
            points.push((f64::NAN, f64::NAN));
        }
        points.pop();
        points
    }
}

/// Keeps the lowest and the highest point of each short piece of a long curve, so that the curve looks the same.
fn thin(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let piece = (2 * points.len()).div_ceil(POINTS);
    let mut kept = Vec::new();
    for piece in points.chunks(piece) {
        let by = |a: &(f64, f64), b: &(f64, f64)| a.1.total_cmp(&b.1);
        let finite = || piece.iter().copied().filter(|p| p.1.is_finite());
        if let (Some(a), Some(b)) = (finite().min_by(by), finite().max_by(by)) {
            let (a, b) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            kept.push(a);
            if a != b {
                kept.push(b);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_extremes_and_the_order() {
        let mut points: Vec<(f64, f64)> =
            (0..50_000).map(|k| (f64::from(k), (f64::from(k) * 0.1).sin())).collect();
        points[12_345].1 = 7.0;
        points[40_000].1 = -7.0;
        let kept = thin(&points);
        assert!(kept.len() <= POINTS + 2, "{}", kept.len());
        assert!(kept.contains(&(12_345.0, 7.0)) && kept.contains(&(40_000.0, -7.0)));
        assert!(kept.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!(thin(&points[..100]), points[..100]);
    }

    #[test]
    fn running_means_begin_anew_with_each_stage() {
        let table = Table {
            header: vec!["step".into(), "time".into(), "pressure".into()],
            columns: vec![
                vec![0.0, 10.0, 20.0, 30.0, 40.0],
                vec![0.0, 0.1, 0.2, 0.3, 0.4],
                vec![100.0, 1.0, 3.0, 10.0, 20.0],
            ],
        };
        let mut about = super::super::tests::about();
        about.stages[0].end = 20;
        about.stages[1].begin = 20;
        about.stages[1].end = 40;
        let curves = Curves::of(&table, Some(&about));
        let running = curves.running(table.get("pressure").unwrap());
        assert_eq!(running[..2], [(0.1, 1.0), (0.2, 2.0)]);
        assert!(running[2].0.is_nan());
        assert_eq!(running[3..], [(0.3, 10.0), (0.4, 15.0)]);
        assert_eq!(curves.empty("", "").marks[1], (0.25, "produce".to_owned()));
    }
}
