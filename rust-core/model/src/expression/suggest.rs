//! Suggestions "did you mean …?" for misspelt names.

/// The candidate that `name` most likely misspells, if any is close enough.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    // A short name may have one slip, a longer name two: with more it is another name.
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

/// The edit distance; wrong case counts nothing, and two neighbouring letters in the wrong order are one slip.
fn slips(a: &str, b: &str) -> usize {
    let (a, b) = (a.to_ascii_lowercase().into_bytes(), b.to_ascii_lowercase().into_bytes());
    let (mut before, mut row): (Vec<usize>, Vec<usize>) = (Vec::new(), (0..=b.len()).collect());
    for i in 0..a.len() {
        let two_before = std::mem::replace(&mut before, std::mem::replace(&mut row, vec![i + 1]));
        for j in 0..b.len() {
            let replace = before[j] + usize::from(a[i] != b[j]);
            let mut least = replace.min(before[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && (a[i], a[i - 1]) == (b[j - 1], b[j]) {
                least = least.min(two_before[j - 1] + 1);
            }
            row.push(least);
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
        assert_eq!(closest("Tk", known), Some("kT".into()));
        assert_eq!(closest("kidn", ["kind", "radius"]), Some("kind".into()));
        assert_eq!(closest("temperature", known), None);
        assert_eq!(closest("x", ["n"]), None);
    }
}
