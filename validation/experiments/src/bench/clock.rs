//! The clock that cycles are counted by.

#[cfg(target_arch = "x86_64")]
const WHILE: std::time::Duration = std::time::Duration::from_millis(20);

/// Gigahertz of the processor's time stamp counter, which ticks at one rate whatever clock the cores have at the time: cycles
/// of the processor at its nominal clock. `None` where there is no such counter.
#[cfg(target_arch = "x86_64")]
pub fn gigahertz() -> Option<f64> {
    let (begin, first) = at_once()?;
    std::thread::sleep(WHILE);
    let (end, last) = at_once()?;
    let rate = 1e-9 * last.checked_sub(first)? as f64 / (end - begin).as_secs_f64();
    // Beyond this it is not a clock of a processor.
    (0.1..20.0).contains(&rate).then_some(rate)
}

/// Time and counter, read so soon after each other that nothing came between them: on a busy machine another process may,
/// for as long as the measurement takes.
#[cfg(target_arch = "x86_64")]
fn at_once() -> Option<(std::time::Instant, u64)> {
    (0..1000).find_map(|_| {
        let before = std::time::Instant::now();
        // SAFETY: every processor of this architecture that runs Linux has the instruction.
        let ticks = unsafe { std::arch::x86_64::_rdtsc() };
        (before.elapsed() < WHILE / 400).then_some((before, ticks))
    })
}

#[cfg(not(target_arch = "x86_64"))]
pub fn gigahertz() -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    /// Two measurements agree to what may come between reading time and counter: a counter that is no clock would give two
    /// numbers.
    #[test]
    fn it_ticks_at_one_rate() {
        let [a, b] = [(); 2].map(|()| super::gigahertz());
        match (a, b) {
            (Some(a), Some(b)) => assert!((a / b - 1.0).abs() < 0.05, "{a} {b}"),
            other => assert_eq!(other, (None, None)),
        }
    }
}
