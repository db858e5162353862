//! The commands of a script.

/// A command, which may span several lines.
pub struct Command<'a> {
    pub line: usize,
    /// The text of the command with its line breaks.
    pub text: &'a str,
    /// The words of the command, without comments; quoted text is one word, with its quotes.
    pub words: Vec<&'a str>,
}

/// Splits a script into commands. Text in triple quotes belongs to its command.
pub fn commands(script: &str) -> Vec<Command<'_>> {
    let mut found = Vec::new();
    let (mut start, mut first, mut quoted) = (0, 1, false);
    let mut end = 0;
    for (k, line) in script.split_inclusive('\n').enumerate() {
        end += line.len();
        quoted ^= line.matches("\"\"\"").count() % 2 == 1;
        if !quoted && !line.trim_end().ends_with('&') {
            found.push(command(first, &script[start..end]));
            (start, first) = (end, k + 2);
        }
    }
    if start < script.len() {
        found.push(command(first, &script[start..]));
    }
    found
}

/// A command that begins in a line of the script.
pub fn command(line: usize, text: &str) -> Command<'_> {
    let mut words = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        if c.is_whitespace() {
            at += c.len_utf8();
        } else if c == '#' {
            at += rest.find('\n').unwrap_or(rest.len());
        } else {
            let length = length_of_word(rest);
            if &rest[..length] != "&" {
                words.push(&rest[..length]);
            }
            at += length;
        }
    }
    Command { line, text, words }
}

/// The length of the word at the beginning of a text.
fn length_of_word(text: &str) -> usize {
    for quote in ["\"\"\"", "\"", "'"] {
        if let Some(inside) = text.strip_prefix(quote) {
            return inside.find(quote).map_or(text.len(), |end| 2 * quote.len() + end);
        }
    }
    // Blanks within the braces of a variable or the parentheses of a formula belong to the word.
    let mut depth = 0;
    for (k, c) in text.char_indices() {
        match c {
            '(' | '{' => depth += 1,
            ')' | '}' => depth -= 1,
            _ => {}
        }
        if c == '#' || c == '\n' || c.is_whitespace() && depth <= 0 {
            return k;
        }
    }
    text.len()
}

/// A word without its quotes.
pub fn bare(word: &str) -> &str {
    for quote in ["\"\"\"", "\"", "'"] {
        if let Some(inside) = word.strip_prefix(quote).and_then(|w| w.strip_suffix(quote)) {
            return inside;
        }
    }
    word
}

impl Command<'_> {
    /// A command with `words` after `name`, aligned with the old words. If the command name is the same, the
    /// old comment stays.
    pub fn with(&self, name: &str, words: &[&str]) -> String {
        let indent = &self.text[..self.text.len() - self.text.trim_start().len()];
        let rest = &self.text.trim_start()[self.words[0].len()..];
        let gap = &rest[..rest.len() - rest.trim_start_matches([' ', '\t']).len()];
        let width = self.words[0].len() + gap.len();
        let last = self.words.last().map_or(0, |word| self.place(word) + word.len());
        let comment = match self.text[last..].trim_end().split_once('#') {
            Some((_, comment)) if name == self.words[0] => format!("  #{comment}"),
            _ => String::new(),
        };
        let column = width.max(name.len() + 1);
        let end = if self.text.ends_with('\n') { "\n" } else { "" };
        let line = format!("{indent}{name:column$}{}{comment}", words.join(" "));
        format!("{}{end}", line.trim_end())
    }

    /// Where a word of the command begins in its text.
    fn place(&self, word: &str) -> usize {
        word.as_ptr() as usize - self.text.as_ptr() as usize
    }

    /// The text with some words, given by their numbers, replaced.
    pub fn replaced(&self, new: &[(usize, String)]) -> String {
        let mut text = String::new();
        let mut at = 0;
        for (k, word) in new {
            let begin = self.place(self.words[*k]);
            text += &self.text[at..begin];
            text += word;
            at = begin + self.words[*k].len();
        }
        text + &self.text[at..]
    }
}
