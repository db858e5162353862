//! Makes the text of files safe for a terminal.

/// Whether a terminal or a log would interpret the character rather than show it: control characters,
/// except line ends and tabs, and characters that turn the direction of writing.
pub fn is_control(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

/// Replaces control characters by visible characters of the same length in bytes, so that offsets into the text stay valid.
pub fn printable(text: &str) -> String {
    let shown = |c: char| match (is_control(c), c.len_utf8()) {
        (false, _) => c,
        (true, 1) => '?',
        (true, 2) => '¿',
        (true, _) => '\u{FFFD}',
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_told_nothing() {
        let text = "a\u{1b}[31mb\u{9b}c\u{202e}d\te\n\u{7f}";
        let shown = printable(text);
        assert_eq!(shown, "a?[31mb¿c\u{FFFD}d\te\n?");
        assert_eq!(shown.len(), text.len());
    }
}
