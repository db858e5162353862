//! The self-contained HTML report.

use psidpd_formats::files::PAGE;
use std::fmt::Display;

use super::table::{Table, verdict};
use super::text::escape;
use super::{Plot, ReportError};

const STYLE: &str = include_str!("page.css");

/// A report on one page without scripts or external resources. The page is also well-formed XML.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    pub title: String,
    /// The line below the title; may be empty.
    pub subtitle: String,
    /// Names and values at the top of the page: versions, machine, seeds.
    pub facts: Vec<(String, String)>,
    pub sections: Vec<Section>,
    pub passed: usize,
    pub failed: usize,
}

#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    pub heading: String,
    pub items: Vec<Item>,
}

impl Section {
    pub fn new(heading: impl Into<String>, items: Vec<Item>) -> Section {
        Section { heading: heading.into(), items }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// Text; blank lines separate paragraphs.
    Prose(String),
    /// A table; cells that read "pass" or "fail" are coloured.
    Table(Table),
    Figure {
        /// The picture from [`Plot::render`](super::Plot::render). It is inserted unescaped, so it must come from a trusted
        /// source.
        svg: String,
        /// The text below the picture; may be empty.
        caption: String,
    },
}

impl Item {
    pub fn prose(text: impl Into<String>) -> Item {
        Item::Prose(text.into())
    }

    pub fn figure(plot: &Plot, caption: impl Into<String>) -> Result<Item, ReportError> {
        Ok(Item::Figure { svg: plot.render()?, caption: caption.into() })
    }
}

impl Report {
    /// Makes the page. All text is escaped.
    pub fn render(&self) -> String {
        let title = escape(&self.title);
        let subtitle = some(&self.subtitle, |text| format!("<p class=\"subtitle\">{text}</p>\n"));
        let facts = lines(&self.facts, |(name, value)| {
            format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(value))
        });
        let facts = if facts.is_empty() { facts } else { format!("<dl>\n{facts}</dl>\n") };
        let sections = lines(&self.sections, |section| {
            let items = lines(&section.items, render_item);
            format!("<section>\n<h2>{}</h2>\n{items}</section>", escape(&section.heading))
        });
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n{PAGE}\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <meta name=\"color-scheme\" content=\"light dark\"/>\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             <header>\n<h1>{title}</h1>\n{subtitle}</header>\n\
             {banner}{facts}<main>\n{sections}</main>\n</body>\n</html>\n",
            banner = self.banner(),
        )
    }

    fn banner(&self) -> String {
        match (self.passed, self.failed) {
            (0, 0) => String::new(),
            (passed, 0) => format!(
                "<div class=\"banner pass\">\n<span>✓ {passed} passed</span><span>0 failed</span>\n</div>\n"
            ),
            (passed, failed) => format!(
                "<div class=\"banner fail\">\n<span>✗ {failed} failed</span><span>{passed} passed</span>\n</div>\n"
            ),
        }
    }
}

/// Writes `show` of each part on its own line.
fn lines<T, S: Display>(parts: impl IntoIterator<Item = T>, show: impl Fn(T) -> S) -> String {
    parts.into_iter().map(|part| format!("{}\n", show(part))).collect()
}

/// Writes `show` of the escaped text; empty text gives nothing.
fn some(text: &str, show: impl Fn(String) -> String) -> String {
    if text.is_empty() { String::new() } else { show(escape(text)) }
}

fn render_item(item: &Item) -> String {
    match item {
        Item::Prose(text) => {
            let text: Vec<&str> = text.lines().map(str::trim_end).collect();
            let paragraphs = text.split(|line| line.trim().is_empty()).filter(|lines| !lines.is_empty());
            lines(paragraphs, |lines| format!("<p>{}</p>", escape(&lines.join("\n"))))
        }
        Item::Table(table) => render_table(table),
        Item::Figure { svg, caption } => {
            let caption = some(caption, |text| format!("<figcaption>{text}</figcaption>\n"));
            format!("<figure>\n{svg}\n{caption}</figure>")
        }
    }
}

/// Short rows are filled up to the full number of columns.
fn render_table(table: &Table) -> String {
    let right: Vec<bool> = (0..table.column_count()).map(|c| table.is_right(c)).collect();
    let cells = |tag: &str, row: &[String]| -> String {
        let cell = |(column, &right): (usize, &bool)| {
            let text = row.get(column).map_or("", String::as_str);
            let verdict = verdict(text).map_or("", |passed| if passed { "pass" } else { "fail" });
            let align = if right { "num" } else { "" };
            let class = format!("{align} {verdict}");
            format!("<{tag} class=\"{}\">{}</{}>", class.trim(), escape(text), &tag[..2])
        };
        format!("<tr>{}</tr>", right.iter().enumerate().map(cell).collect::<String>())
    };
    let header = match table.header.as_slice() {
        [] => String::new(),
        header => format!("<thead>{}</thead>\n", cells("th scope=\"col\"", header)),
    };
    let rows = lines(&table.rows, |row| cells("td", row));
    format!("<div class=\"scroll\"><table>\n{header}<tbody>\n{rows}</tbody>\n</table></div>")
}

#[cfg(test)]
mod tests {
    use super::super::{Series, Style};
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
        let series = Series::new(text.clone(), vec![(1.0, 2.0), (2.0, 3.0)], Style::Points);
        let plot = Plot::new(text.clone(), ["", ""], vec![series]);
        Report {
            title: text.clone(),
            subtitle: text.clone(),
            facts: vec![(text.clone(), text.clone())],
            sections: vec![Section::new(
                text.clone(),
                vec![
                    Item::Prose(format!("{text}\n\n\nsecond")),
                    Item::Table(table),
                    Item::figure(&plot, text.clone()).unwrap(),
                ],
            )],
            passed: 3,
            failed: 1,
        }
    }

    #[test]
    fn text_is_escaped() {
        let attack = "<script>alert(\"x\")</script>{{ 1 }}&amp;";
        let page = report(attack).render();
        assert!(!page.contains("<script"));
        let document = parse(&page);
        assert_eq!(document.descendants().filter(|n| n.has_tag_name("script")).count(), 0);
        let heading = document.descendants().find(|n| n.has_tag_name("h2")).unwrap();
        assert_eq!(heading.text(), Some(attack));
    }

    #[test]
    fn nothing_is_loaded_from_elsewhere() {
        let page = report("text").render();
        for node in parse(&page).descendants() {
            for attribute in node.attributes() {
                assert!(!matches!(attribute.name(), "src" | "href"), "{attribute:?}");
            }
        }
        assert!(!page.contains("url(") && !page.contains("@import"));
    }

    #[test]
    fn the_banner_tells() {
        let page = report("text").render();
        assert!(page.contains("3 passed") && page.contains("1 failed"));
        let good = Report { passed: 2, ..Report::default() }.render();
        assert!(good.contains("2 passed") && good.contains("0 failed"));
        parse(&good);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn any_text_gives_a_well_formed_page(text in any::<String>()) {
            parse(&report(&text).render());
        }
    }
}
