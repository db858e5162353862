//! The self-contained HTML report.

use minijinja::syntax::SyntaxConfig;
use minijinja::value::Value;
use minijinja::{AutoEscape, Environment, UndefinedBehavior, context};

use super::ReportError;
use super::table::{Table, Verdict};
use super::text::xml_safe;

const TEMPLATE: &str = include_str!("report.html.j2");

/// A report: one page without scripts or external resources, and at the same
/// time well-formed XML.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Title of the page.
    pub title: String,
    /// Line below the title; may be empty.
    pub subtitle: String,
    /// Names and values shown at the top: versions, machine, seeds.
    pub facts: Vec<(String, String)>,
    /// The sections in order.
    pub sections: Vec<Section>,
    /// Number of checks that passed.
    pub passed: usize,
    /// Number of checks that failed.
    pub failed: usize,
}

/// A heading and what belongs to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// The heading.
    pub heading: String,
    /// The content in order.
    pub items: Vec<Item>,
}

/// A piece of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// Text; blank lines separate paragraphs.
    Prose(String),
    /// A table; cells that read "pass" or "fail" are coloured.
    Table(Table),
    /// A figure.
    Figure {
        /// The picture, from [`Plot::render`](super::Plot::render). It is put
        /// into the page as it is, so it must come from a trusted source.
        svg: String,
        /// Text below the picture; may be empty.
        caption: String,
    },
}

impl Report {
    /// The page. All text is escaped.
    pub fn render(&self) -> Result<String, ReportError> {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        environment.set_undefined_behavior(UndefinedBehavior::Strict);
        let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build()?;
        environment.set_syntax(syntax);
        environment.add_template("report.html.j2", TEMPLATE)?;
        let facts: Vec<Value> = self
            .facts
            .iter()
            .map(|(name, value)| context! { name => name.as_str(), value => value.as_str() })
            .collect();
        let sections: Vec<Value> = self
            .sections
            .iter()
            .map(|section| {
                let items: Vec<Value> = section.items.iter().map(item_value).collect();
                context! { heading => section.heading.as_str(), items => items }
            })
            .collect();
        let page = environment.get_template("report.html.j2")?.render(context! {
            title => self.title.as_str(),
            subtitle => self.subtitle.as_str(),
            facts => facts,
            passed => self.passed,
            failed => self.failed,
            sections => sections,
        })?;
        Ok(xml_safe(&page))
    }
}

fn item_value(item: &Item) -> Value {
    match item {
        Item::Prose(text) => {
            let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
            let paragraphs: Vec<String> = lines
                .split(|line| line.trim().is_empty())
                .filter(|lines| !lines.is_empty())
                .map(|lines| lines.join("\n"))
                .collect();
            context! { kind => "prose", paragraphs => paragraphs }
        }
        Item::Table(table) => table_value(table),
        Item::Figure { svg, caption } => {
            context! { kind => "figure", svg => svg, caption => caption }
        }
    }
}

/// Rows filled up to the full number of columns, each cell with its classes.
fn table_value(table: &Table) -> Value {
    let right: Vec<bool> = (0..table.column_count()).map(|c| table.is_right(c)).collect();
    let cells = |row: &[String]| -> Vec<Value> {
        let cell = |(column, &right): (usize, &bool)| {
            let text = row.get(column).map_or("", String::as_str);
            let verdict = match Verdict::of(text) {
                Some(Verdict::Pass) => "pass",
                Some(Verdict::Fail) => "fail",
                None => "",
            };
            let align = if right { "num" } else { "" };
            context! { text => text, class => format!("{align} {verdict}").trim() }
        };
        right.iter().enumerate().map(cell).collect()
    };
    let header = if table.header.is_empty() { Vec::new() } else { cells(&table.header) };
    let rows: Vec<Vec<Value>> = table.rows.iter().map(|row| cells(row)).collect();
    context! { kind => "table", header => header, rows => rows }
}

#[cfg(test)]
mod tests {
    use super::super::{Plot, Series, Style};
    use super::*;
    use proptest::prelude::*;

    fn parse(page: &str) -> roxmltree::Document<'_> {
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        roxmltree::Document::parse_with_options(page, options).unwrap()
    }

    fn report(text: &str) -> Report {
        let text = text.to_owned();
        let mut table = Table::new([text.clone(), "verdict".into()]);
        table.push([text.clone(), "pass".into(), "3.5".into()]);
        table.push(["1", "FAIL"]);
        let plot = Plot {
            title: text.clone(),
            series: vec![Series {
                name: text.clone(),
                points: vec![(1.0, 2.0), (2.0, 3.0)],
                errors: None,
                style: Style::Points,
            }],
            ..Plot::default()
        };
        Report {
            title: text.clone(),
            subtitle: text.clone(),
            facts: vec![(text.clone(), text.clone())],
            sections: vec![Section {
                heading: text.clone(),
                items: vec![
                    Item::Prose(format!("{text}\n\n\nsecond")),
                    Item::Table(table),
                    Item::Figure { svg: plot.render().unwrap(), caption: text.clone() },
                ],
            }],
            passed: 3,
            failed: 1,
        }
    }

    #[test]
    fn text_is_escaped() {
        let attack = "<script>alert(\"x\")</script>{{ 1 }}&amp;";
        let page = report(attack).render().unwrap();
        assert!(!page.contains("<script"));
        let document = parse(&page);
        assert_eq!(document.descendants().filter(|n| n.has_tag_name("script")).count(), 0);
        let heading = document.descendants().find(|n| n.has_tag_name("h2")).unwrap();
        assert_eq!(heading.text(), Some(attack));
    }

    #[test]
    fn nothing_is_loaded_from_elsewhere() {
        let page = report("text").render().unwrap();
        for node in parse(&page).descendants() {
            for attribute in node.attributes() {
                assert!(!matches!(attribute.name(), "src" | "href"), "{attribute:?}");
            }
        }
        assert!(!page.contains("url(") && !page.contains("@import"));
    }

    #[test]
    fn the_banner_tells() {
        let page = report("text").render().unwrap();
        assert!(page.contains("3 passed") && page.contains("1 failed"));
        let good = Report { passed: 2, ..Report::default() }.render().unwrap();
        assert!(good.contains("2 passed") && good.contains("0 failed"));
        parse(&good);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn any_text_gives_a_well_formed_page(text in any::<String>()) {
            parse(&report(&text).render().unwrap());
        }
    }
}
