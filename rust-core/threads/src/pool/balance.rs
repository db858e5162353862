//! Whether the threads of a pool gain anything by sharing work.
//!
//! Where other programs use the processors a thread loses its own for some milliseconds, in the middle of a piece of work that
//! takes microseconds, and all others wait for it: two threads next to one busy program are slower than one. So where threads
//! have waited long the calling thread does all the work for a while, and goes on if that is faster. Which thread does a part
//! changes no result.

use std::time::{Duration, Instant};

/// Time over which work is compared.
const WINDOW: Duration = Duration::from_millis(10);

/// Share of the time that each other thread waits, above which work alone is tried. On processors of their own threads wait for
/// less than a fifth, unless there are more threads than parts.
const HELD: f64 = 0.35;

/// Fewest pieces of a window: of fewer the mean is too uncertain.
const PIECES: u32 = 20;

/// Work alone must take less than this fraction of the time.
const FASTER: f64 = 0.9;

/// Time of work alone until sharing is tried again.
const HOLD: Duration = Duration::from_millis(200);

/// Least and longest time between trials that have shown that sharing is faster.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(10)];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Shared,
    /// Work alone for this number of pieces, each of which took so many seconds when it was shared.
    Trial(u32, f64),
    /// Work alone until then.
    Alone(Instant),
}

/// The state of a pool's decision.
#[derive(Debug)]
pub struct Balance {
    mode: Mode,
    /// Pieces since the window began, and the time that threads have waited for others in them.
    pieces: u32,
    waited: Duration,
    began: Instant,
    next_trial: Instant,
    pause: Duration,
    /// Sum of all times of work alone.
    alone: Duration,
}

impl Balance {
    pub fn new(now: Instant) -> Balance {
        Balance {
            mode: Mode::Shared,
            pieces: 0,
            waited: Duration::ZERO,
            began: now,
            next_trial: now,
            pause: PAUSES[0],
            alone: Duration::ZERO,
        }
    }

    /// Whether the calling thread should do the next piece of work alone, in a pool of so many `threads`.
    pub fn begin(&mut self, now: Instant, threads: usize) -> bool {
        let elapsed = now.saturating_duration_since(self.began);
        // The host did something else meanwhile.
        let is_odd = elapsed > 20 * WINDOW;
        let each = elapsed.as_secs_f64() / f64::from(self.pieces.max(1));
        let next = match self.mode {
            Mode::Shared if elapsed < WINDOW || (self.pieces < PIECES && !is_odd) => None,
            Mode::Shared => {
                let held = self.waited.as_secs_f64() / elapsed.as_secs_f64() / (threads - 1).max(1) as f64;
                let tries = held > HELD && now >= self.next_trial && !is_odd;
                Some(if tries { Mode::Trial(self.pieces, each) } else { Mode::Shared })
            }
            Mode::Trial(pieces, _) if self.pieces < pieces && !is_odd => None,
            Mode::Trial(_, shared) if each < FASTER * shared && !is_odd => {
                self.pause = PAUSES[0];
                Some(Mode::Alone(now + HOLD))
            }
            Mode::Trial(..) => {
                self.next_trial = now + self.pause;
                self.pause = PAUSES[1].min(2 * self.pause);
                Some(Mode::Shared)
            }
            Mode::Alone(until) if now < until => None,
            Mode::Alone(_) => Some(Mode::Shared),
        };
        if let Some(next) = next {
            if self.mode != Mode::Shared && !is_odd {
                self.alone += elapsed;
            }
            (self.mode, self.pieces, self.waited, self.began) = (next, 0, Duration::ZERO, now);
        }
        self.pieces += 1;
        self.mode != Mode::Shared
    }

    /// Adds the time that threads have waited for others in a shared piece.
    pub fn add_wait(&mut self, time: Duration) {
        self.waited += time;
    }

    /// Sum of all times in which the calling thread has worked alone.
    pub fn time_alone(&self) -> Duration {
        self.alone
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    /// Makes pieces of work until `end`; one takes `alone` or `shared`, and threads wait for `held` of the shared time. Returns
    /// how many pieces there were, and how many alone.
    fn work(
        balance: &mut Balance,
        now: &mut Instant,
        time: Duration,
        [alone, shared]: [u64; 2],
        held: f64,
    ) -> [u32; 2] {
        let (end, mut pieces) = (*now + time, [0; 2]);
        while *now < end {
            let is_alone = balance.begin(*now, 2);
            let piece = Duration::from_micros(if is_alone { alone } else { shared });
            *now += piece;
            if !is_alone {
                balance.add_wait(piece.mul_f64(held));
            }
            pieces = [pieces[0] + 1, pieces[1] + u32::from(is_alone)];
        }
        pieces
    }

    #[test]
    fn work_is_shared_where_that_is_faster() {
        let mut now = Instant::now();
        let mut balance = Balance::new(now);
        let second = Duration::from_secs(1);
        // On free processors nothing is tried.
        assert_eq!(work(&mut balance, &mut now, second, [400, 210], 0.1)[1], 0);
        // Threads that wait by design are tried alone more and more rarely.
        let [all, alone] = work(&mut balance, &mut now, 60 * second, [400, 250], 0.9);
        assert!(alone > 0 && alone < all / 100, "{alone} of {all}");
        assert!(balance.time_alone() < second);
    }

    #[test]
    fn one_thread_works_where_others_hold_it() {
        let mut now = Instant::now();
        let mut balance = Balance::new(now);
        let second = Duration::from_secs(1);
        let [all, alone] = work(&mut balance, &mut now, 10 * second, [400, 1000], 0.6);
        // 25 000 pieces would be alone, 10 000 shared.
        assert!(alone > 22_000 && all - alone > 300, "{alone} of {all}");
        assert!(balance.time_alone() > 8 * second);
        // The other program ends.
        let [all, alone] = work(&mut balance, &mut now, 10 * second, [400, 210], 0.1);
        assert!(alone < all / 50, "{alone} of {all}");
    }
}
