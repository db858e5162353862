use crate::checkpoint::{Identity, Store};
use crate::scene::{Edit, Scene};
use std::path::Path;
use std::str::FromStr;

/// How many steps the last stage of a run gets that goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    Steps(u64),
    /// More than it has so far.
    More(u64),
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Length, String> {
        let (number, length): (&str, fn(u64) -> Length) = match text.strip_prefix('+') {
            Some(number) => (number, Length::More),
            None => (text, Length::Steps),
        };
        // A second sign would be read as part of the number.
        let count = if number.starts_with('+') { None } else { number.parse().ok().filter(|n| *n > 0) };
        count
            .map(length)
            .ok_or_else(|| "expected a number of steps, as 20000, or of more steps, as +5000".into())
    }
}

impl Length {
    /// The number of steps of the last stage, for a run of `scene` in the folder `out` or, without one, for the scene.
    pub fn steps(self, scene: &Scene, out: &Path) -> u64 {
        let more = match self {
            Length::Steps(steps) => return steps,
            Length::More(more) => more,
        };
        let run = Store::new(out).find(|_| Ok(())).ok().flatten();
        let identities = [run.map(|found| found.checkpoint.identity), Some(Identity::of_scene(scene))];
        let known = identities.into_iter().flatten().find_map(|identity| identity.last_steps());
        known.map_or(more, |(_, steps)| steps.saturating_add(more))
    }

    /// The edit of a scene that gives its last stage this number of steps.
    pub fn edit(steps: u64, scene: &Scene) -> Edit {
        let key = Identity::of_scene(scene).last_steps().map_or_else(|| "steps".into(), |(key, _)| key);
        Edit::new(&key, steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_a_number_or_more() {
        assert_eq!("20".parse(), Ok(Length::Steps(20)));
        assert_eq!("+5".parse(), Ok(Length::More(5)));
        for bad in ["", "+", "++5", "-5", "0", "+0", "1e3", "99999999999999999999"] {
            assert!(bad.parse::<Length>().is_err(), "{bad}");
        }
    }
}
