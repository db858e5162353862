use std::borrow::Cow;
use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{
    MultiProgress, ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressState, ProgressStyle,
};

use super::text::one_line;

const BAR: &str = "{prefix:24!} {bar:32.cyan/dim} {percent:>3}% {human_pos}/{human_len} \
                   {elapsed_precise:.dim} {eta:.dim} left";
// The line fits eighty columns; the bar gets the rest.
const STEPS: &str =
    "{prefix:14!} {percent:>3}% {human_pos}/{human_len} {rate}, {eta} left {wide_bar:.cyan/dim}";
const SPINNER: &str = "{prefix} {spinner:.cyan} {elapsed_precise:.dim}";

/// A group of bars on standard error. It prints nothing if standard error is not a terminal.
#[derive(Debug, Clone)]
pub struct Progress {
    bars: MultiProgress,
    visible: bool,
}

/// One bar of a [`Progress`]. Clones share the same bar, and may be sent to other threads. The bar disappears when the last
/// clone is dropped.
#[derive(Debug, Clone)]
pub struct Bar {
    inner: ProgressBar,
}

/// The progress of the whole work. Without a terminal it prints a line every minute instead of a bar.
#[derive(Debug)]
pub struct Overall {
    bar: Bar,
    name: String,
    total: u64,
    made: AtomicU64,
    start: Instant,
    /// The number of minutes at the last printed line; `None` if the bar is visible.
    told: Option<AtomicU64>,
}

impl Overall {
    pub fn advance(&self, n: u64) {
        self.bar.advance(n);
        let made = n + self.made.fetch_add(n, Ordering::Relaxed);
        let minutes = self.start.elapsed().as_secs() / 60;
        if let Some(told) = &self.told
            && told.fetch_max(minutes, Ordering::Relaxed) < minutes
        {
            to_stderr(&so_far(&self.name, made, self.total, self.start.elapsed()));
        }
    }
}

/// Prints a line to standard error. If that is closed or full, the line has no reader, and the work goes on.
pub fn to_stderr(line: &str) {
    let _ = writeln!(stderr(), "{line}");
}

fn so_far(name: &str, made: u64, total: u64, elapsed: Duration) -> String {
    let share = made as f64 / total.max(1) as f64;
    let left = elapsed.as_secs_f64() * (1.0 - share).max(0.0) / share;
    let left = if left.is_finite() { format!("{:.0} min", left / 60.0) } else { "unknown".into() };
    format!("{name}: {:.0} % after {} min, left: {left}", 100.0 * share, elapsed.as_secs() / 60)
}

impl Progress {
    /// A new group, visible only if standard error is a terminal.
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

    /// Adds a bar for a run of `steps` steps of `particles` particles that has already made `made` of them. The bar also
    /// shows the speed: steps per second, and nanoseconds for each step of each particle.
    pub fn steps(&self, name: &str, steps: u64, made: u64, particles: usize) -> Bar {
        let style = style(STEPS).progress_chars("━╸─").with_key(
            "rate",
            move |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                // An error while drawing a bar must not stop the work.
                let _ = to.write_str(&rate(state.per_sec(), particles));
            },
        );
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::hidden());
        let bar = self.add(bar, name, style);
        // Steps of earlier sessions do not count for the speed.
        bar.inner.set_position(made);
        bar.inner.update(|_| ());
        bar.inner.reset_eta();
        bar
    }

    /// Adds a bar for the whole work of `total` parts.
    pub fn overall(&self, name: &str, total: u64) -> Overall {
        Overall {
            bar: self.bar(name, total),
            name: one_line(name),
            total,
            made: AtomicU64::new(0),
            start: Instant::now(),
            told: (!self.visible).then(AtomicU64::default),
        }
    }

    /// Shows a spinner during work of unknown length.
    pub fn spinner<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let _shown = self.add(bar, name, style(SPINNER));
        work()
    }

    /// Prints a line above the bars. It prints nothing if standard error is not a terminal.
    pub fn note(&self, line: &str) {
        if self.visible {
            // A closed terminal must not stop the work.
            let _ = self.bars.println(line);
        }
    }

    /// Prints a line above the bars, or without bars by itself. It is meant for work that takes minutes.
    pub fn tell(&self, line: &str) {
        if self.visible {
            self.note(line);
        } else {
            to_stderr(line);
        }
    }

    fn add(&self, bar: ProgressBar, name: &str, style: ProgressStyle) -> Bar {
        let bar = bar
            .with_finish(ProgressFinish::AndClear)
            .with_style(style)
            .with_prefix(Cow::Owned(one_line(name)));
        let inner = self.bars.add(bar);
        if self.visible {
            // The elapsed time keeps moving through long steps.
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
    pub fn advance(&self, n: u64) {
        self.inner.inc(n);
    }

    pub fn set(&self, n: u64) {
        self.inner.set_position(n);
    }
}

fn rate(steps_per_second: f64, particles: usize) -> String {
    if !(steps_per_second > 0.0 && steps_per_second.is_finite()) {
        return "-".into();
    }
    let digits = if steps_per_second < 10.0 { 2 } else { 0 };
    let nanoseconds = 1e9 / (steps_per_second * particles.max(1) as f64);
    format!("{steps_per_second:.digits$} steps/s, {nanoseconds:.0} ns/particle")
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
        progress.bar("nothing", 0).advance(u64::MAX);
        assert_eq!(progress.spinner("wait\nhere", || 1), 1);
        progress.note("a line");
    }

    #[test]
    fn work_as_a_whole_says_what_is_left() {
        let minutes = |n: u64| Duration::from_secs(60 * n);
        assert_eq!(so_far("runs", 250, 1000, minutes(10)), "runs: 25 % after 10 min, left: 30 min");
        assert_eq!(so_far("runs", 0, 1000, minutes(1)), "runs: 0 % after 1 min, left: unknown");
        let overall = Progress::new().overall("runs", 10);
        overall.advance(3);
        overall.advance(4);
        assert_eq!(overall.made.into_inner(), 7);
    }

    #[test]
    fn speeds_are_of_steps_and_particles() {
        assert_eq!(rate(1000.0, 2000), "1000 steps/s, 500 ns/particle");
        assert_eq!(rate(0.5, 1_000_000), "0.50 steps/s, 2000 ns/particle");
        assert_eq!((rate(0.0, 10), rate(f64::NAN, 0)), ("-".into(), "-".into()));
    }

    /// A resumed run must not count the steps of earlier sessions for its speed.
    #[test]
    fn bars_start_where_a_run_does() {
        let bar = Progress::new().steps("run", 2_000_000, 1_000_000, 10);
        assert_eq!(bar.inner.position(), 1_000_000);
        assert!(bar.inner.per_sec() < 1.0, "{}", bar.inner.per_sec());
        std::thread::sleep(Duration::from_millis(50));
        bar.inner.set_position(1_000_100);
        bar.inner.update(|_| ());
        let speed = bar.inner.per_sec();
        assert!(speed > 0.0 && speed <= 100.0 / 0.050, "{speed}");
    }

    #[test]
    fn templates_are_valid() {
        for template in [BAR, STEPS, SPINNER] {
            ProgressStyle::with_template(template).unwrap();
        }
    }
}
