//! The order in which a round goes through the runs.

/// Places in a list of runs, each with its fluid and size, in the order of a round: fluid by fluid; of its
/// sizes the smallest, then the largest, then the others; there and back, so that the last of a size and the
/// last of the next are neighbours in time. A goal compares the largest size with the smallest, and a machine
/// changes less within seconds than within minutes.
pub fn turns(runs: &[(&str, usize)]) -> Vec<usize> {
    let fluids = psidpd_report::distinct(runs.iter().map(|(fluid, _)| *fluid));
    let mut order = Vec::with_capacity(runs.len());
    for fluid in fluids {
        let mut sizes: Vec<usize> = runs.iter().filter(|r| r.0 == fluid).map(|r| r.1).collect();
        sizes.sort_unstable();
        sizes.dedup();
        if sizes.len() > 2 {
            sizes[1..].rotate_right(1);
        }
        for (place, size) in sizes.into_iter().enumerate() {
            let begin = order.len();
            order.extend((0..runs.len()).filter(|k| runs[*k] == (fluid, size)));
            if place % 2 == 1 {
                order[begin..].reverse();
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::turns;

    #[test]
    fn smallest_and_largest_meet_where_both_end() {
        let runs = [("a", 1), ("a", 1), ("b", 1), ("a", 2), ("a", 2), ("b", 2), ("a", 3), ("a", 3)];
        assert_eq!(turns(&runs), [0, 1, 7, 6, 3, 4, 2, 5]);
        assert_eq!(turns(&[]), [0; 0]);
    }
}
