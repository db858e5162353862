//! "Did you mean …?"

/// The candidate that `name` is most likely a slip of, if any is close enough.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    // One slip in a short name, two in a longer one: beyond that it is another name.
    let allowed = match name.len() {
        0..=4 => 1,
        _ => 2,
    };
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= allowed)
        .map(|candidate| (slips(name, candidate), candidate))
        .filter(|&(slips, candidate)| slips <= allowed && slips < candidate.len())
        .min()
        .map(|(_, candidate)| candidate.to_owned())
}

/// The edit distance, letters of the wrong case for free.
fn slips(a: &str, b: &str) -> usize {
    let (a, b) = (a.to_ascii_lowercase(), b.to_ascii_lowercase());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let replace = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replace.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
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
        assert_eq!(closest("temperature", known), None);
        assert_eq!(closest("x", ["n"]), None);
    }
}
