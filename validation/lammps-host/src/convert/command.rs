//! The commands of a script.

/// A command, which may span several lines.
pub struct Command<'a> {
    pub line: usize,
    /// The text of the command with its line breaks.
    pub text: &'a str,
    /// The words of the command, without comments.
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

fn command(line: usize, text: &str) -> Command<'_> {
    let code = text.lines().flat_map(|line| line.split('#').next());
    let words = code.flat_map(str::split_whitespace).filter(|word| *word != "&").collect();
    Command { line, text, words }
}

impl Command<'_> {
    /// A command with `words` after `name`, aligned with the old words. If the command name is the same, the
    /// old comment stays.
    pub fn with(&self, name: &str, words: &[&str]) -> String {
        let indent = &self.text[..self.text.len() - self.text.trim_start().len()];
        let rest = &self.text.trim_start()[self.words[0].len()..];
        let gap = &rest[..rest.len() - rest.trim_start_matches([' ', '\t']).len()];
        let width = self.words[0].len() + gap.len();
        let comment = match self.text.lines().last().and_then(|line| line.split_once('#')) {
            Some((_, comment)) if name == self.words[0] => format!("  #{comment}"),
            _ => String::new(),
        };
        let column = width.max(name.len() + 1);
        format!("{indent}{name:column$}{}{comment}\n", words.join(" "))
    }
}
