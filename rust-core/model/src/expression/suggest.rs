//! Suggestions "did you mean …?" for misspelt names.

use strsim::osa_distance;

/// The candidate that `name` most likely misspells, if any is close enough.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    // A short name may have one slip, a longer name two: with more it is another name.
    let allowed = match name.len() {
        0..=4 => 1,
        _ => 2,
    };
    // Wrong case counts nothing, and two neighbouring letters in the wrong order are one slip.
    let slips = |candidate: &str| osa_distance(&name.to_ascii_lowercase(), &candidate.to_ascii_lowercase());
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= allowed)
        .map(|candidate| (slips(candidate), candidate))
        .filter(|&(slips, candidate)| slips <= allowed && slips < candidate.len())
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_slip() {
        let known = ["alpha3", "kT", "n_A", "n_B"];
        assert_eq!(closest("alpha", known), Some("alpha3".into()));
        assert_eq!(closest("KT", known), Some("kT".into()));
        assert_eq!(closest("n_a", known), Some("n_A".into()));
        assert_eq!(closest("Tk", known), Some("kT".into()));
        assert_eq!(closest("kidn", ["kind", "radius"]), Some("kind".into()));
        assert_eq!(closest("temperature", known), None);
        assert_eq!(closest("x", ["n"]), None);
    }
}
