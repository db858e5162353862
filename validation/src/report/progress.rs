//! Progress bars on the terminal.

use std::borrow::Cow;
use std::io::{IsTerminal, stderr};
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};

use super::text::one_line;

const BAR: &str = "{prefix:24!} {bar:32.cyan/dim} {percent:>3}% {human_pos}/{human_len} \
                   {elapsed_precise:.dim} {eta:.dim} left";
const SPINNER: &str = "{prefix} {spinner:.cyan} {elapsed_precise:.dim}";

/// A group of bars on standard error; silent if that is not a terminal.
#[derive(Debug, Clone)]
pub struct Progress {
    bars: MultiProgress,
    visible: bool,
}

/// One bar or spinner of a [`Progress`]. Clones share the same bar, and may be
/// sent to other threads. It disappears when finished or when the last clone
/// is dropped.
#[derive(Debug, Clone)]
pub struct Bar {
    inner: ProgressBar,
}

impl Progress {
    /// A new group, drawn only if standard error is a terminal.
    pub fn new() -> Self {
        let visible = stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        Self { bars: MultiProgress::with_draw_target(target), visible }
    }

    /// Adds a bar that counts up to `total`.
    pub fn bar(&self, name: &str, total: u64) -> Bar {
        let style = style(BAR).progress_chars("━╸─");
        self.add(ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden()), name, style)
    }

    /// Adds a spinner, for work of unknown length.
    pub fn spinner(&self, name: &str) -> Bar {
        let style = style(SPINNER);
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        self.add(bar, name, style)
    }

    /// Prints a line above the bars; silent if standard error is no terminal.
    pub fn note(&self, line: &str) {
        if self.visible {
            // A terminal that went away is no reason to stop the work.
            let _ = self.bars.println(line);
        }
    }

    fn add(&self, bar: ProgressBar, name: &str, style: ProgressStyle) -> Bar {
        let bar = bar
            .with_finish(ProgressFinish::AndClear)
            .with_style(style)
            .with_prefix(Cow::Owned(one_line(name)));
        let inner = self.bars.add(bar);
        if self.visible {
            // Keeps the elapsed time moving through long steps.
            inner.enable_steady_tick(Duration::from_millis(120));
        }
        Bar { inner }
    }
}

impl Default for Progress {
    fn default() -> Self {
        Self::new()
    }
}

impl Bar {
    /// Counts `n` more.
    pub fn advance(&self, n: u64) {
        self.inner.inc(n);
    }

    /// Sets the count to `n`.
    pub fn set(&self, n: u64) {
        self.inner.set_position(n);
    }

    /// Ends the bar and removes it from the screen.
    pub fn finish(&self) {
        self.inner.finish_and_clear();
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_shared_between_threads() {
        let progress = Progress::new();
        let bar = progress.bar("work", 10);
        let other = bar.clone();
        std::thread::spawn(move || other.advance(4)).join().unwrap();
        bar.advance(3);
        assert_eq!(bar.inner.position(), 7);
        bar.set(20);
        bar.finish();
        progress.bar("nothing", 0).advance(u64::MAX);
        progress.spinner("wait\nhere").advance(1);
        progress.note("a line");
    }

    #[test]
    fn templates_are_valid() {
        for template in [BAR, SPINNER] {
            ProgressStyle::with_template(template).unwrap();
        }
    }
}
