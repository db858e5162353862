//! Text for plots, tables and pages.

use unicode_width::UnicodeWidthStr;

/// Returns true if XML 1.0 allows the character in a document.
fn allowed(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r') || (c >= ' ' && !matches!(c, '\u{FFFE}' | '\u{FFFF}'))
}

/// Replaces the characters that XML forbids.
pub(super) fn xml_safe(text: &str) -> String {
    text.chars().map(|c| if allowed(c) { c } else { char::REPLACEMENT_CHARACTER }).collect()
}

/// One line without control characters: white space becomes single spaces.
pub(super) fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| match c {
            c if c.is_whitespace() => ' ',
            c if c.is_control() || !allowed(c) => char::REPLACEMENT_CHARACTER,
            c => c,
        })
        .collect()
}

/// Escapes text for use between tags.
pub(super) fn escape(text: &str) -> String {
    xml_safe(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The number of columns of the text in a terminal.
pub(super) fn columns(text: &str) -> usize {
    UnicodeWidthStr::width(text)
}

/// The approximate width of text in a proportional font, in units of `size`.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let capitals = text.chars().filter(|c| c.is_uppercase()).count();
    size * (0.56 * columns(text) as f64 + 0.14 * capitals as f64)
}

/// Shortens one line with an ellipsis so that it fits in `room`.
pub(super) fn fit(text: &str, size: f64, room: f64) -> String {
    let line = one_line(text);
    if width(&line, size) <= room {
        return line;
    }
    let mut kept = String::new();
    for c in line.chars() {
        kept.push(c);
        if width(&kept, size) > room - size {
            kept.pop();
            break;
        }
    }
    kept.push('…');
    kept
}

pub(super) fn superscript(n: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    n.to_string().chars().map(raised).collect()
}

/// A unit of an observable in powers of the length: the volume, the area and `r_c` of the model, in a number of dimensions.
pub(super) fn of_lengths(unit: &str, dimensions: usize) -> String {
    let (volume, area) = match dimensions {
        2 => ("length^2", "length"),
        _ => ("length^3", "length^2"),
    };
    match (unit, dimensions) {
        // The viscosity of two dimensions is a force over a length and a rate.
        ("mass/(r_c time)", 2) => "mass/time".to_owned(),
        ("(energy/volume)^2", _) => format!("(energy/{volume})^2"),
        _ => unit.replace("volume", volume).replace("area", area).replace("r_c", "length"),
    }
}

/// A name with its unit, unless it is a pure number.
pub fn named(name: &str, unit: &str) -> String {
    match unit {
        "" | "1" => name.to_owned(),
        unit => format!("{name} [{}]", typeset(unit)),
    }
}

/// Powers as superscripts: `r_c^-3` becomes `r_c⁻³`. Other exponents stay unchanged.
pub fn typeset(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('^') {
        out.push_str(before);
        let sign = usize::from(after.starts_with('-'));
        let digits = after[sign..].chars().take_while(char::is_ascii_digit).count();
        match after[..sign + digits].parse() {
            Ok(power) => out.push_str(&superscript(power)),
            Err(_) => {
                out.push('^');
                out.push_str(&after[..sign + digits]);
            }
        }
        rest = &after[sign + digits..];
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forbidden_characters_are_replaced() {
        assert_eq!(xml_safe("a\0b\tc\u{FFFF}"), "a\u{FFFD}b\tc\u{FFFD}");
        assert_eq!(one_line("a\nb\u{1b}[1m"), "a b\u{FFFD}[1m");
    }

    #[test]
    fn long_text_is_shortened() {
        let short = fit(&"word ".repeat(100), 10.0, 100.0);
        assert!(short.ends_with('…'));
        assert!(width(&short, 10.0) <= 100.0);
        assert_eq!(fit("short", 10.0, 100.0), "short");
    }

    #[test]
    fn superscripts() {
        assert_eq!(superscript(-120), "⁻¹²⁰");
        assert_eq!(typeset("kT/r_c^2, r_c^-3, (m/kT)^(1/2)"), "kT/r_c², r_c⁻³, (m/kT)^(1/2)");
        assert_eq!(typeset("a^b^ ^-^99999999999"), "a^b^ ^-^99999999999");
    }
}
