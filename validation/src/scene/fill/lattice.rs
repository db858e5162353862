/// `count` sites of a simple lattice that fits a box of `lengths`, as near to cubic as whole numbers of
/// sites allow; vacancies, if any, are spread evenly.
pub fn fractions(count: usize, lengths: [f64; 3], dimensions: usize) -> Vec<[f64; 3]> {
    let sites = sites(count, lengths, dimensions);
    let total = sites.iter().product::<usize>() as u128;
    (0..count)
        .map(|k| {
            let site = (k as u128 * total / count as u128) as usize;
            let at = [site % sites[0], site / sites[0] % sites[1], site / sites[0] / sites[1]];
            std::array::from_fn(|c| (at[c] as f64 + 0.5) / sites[c] as f64)
        })
        .collect()
}

/// Numbers of sites along the edges, at least `count` in all.
fn sites(count: usize, lengths: [f64; 3], dimensions: usize) -> [usize; 3] {
    let volume: f64 = lengths[..dimensions].iter().product();
    let spacing = (volume / count as f64).powf(1.0 / dimensions as f64);
    let mut sites = [1; 3];
    for k in 0..dimensions {
        sites[k] = ((lengths[k] / spacing).round() as usize).clamp(1, count);
    }
    while sites.iter().product::<usize>() < count {
        let gap = |k: &usize| lengths[*k] / sites[*k] as f64;
        let widest = (0..dimensions).max_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(0);
        sites[widest] += 1;
    }
    sites
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sites_are_distinct_and_near_cubic() {
        assert_eq!(sites(1000, [10.0; 3], 3), [10; 3]);
        assert_eq!(sites(1001, [10.0; 3], 3).iter().max(), Some(&11));
        assert_eq!(sites(50, [10.0, 5.0, 1.0], 2), [10, 5, 1]);
        let mut all = fractions(1234, [7.0, 9.0, 11.0], 3);
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all.dedup();
        assert_eq!(all.len(), 1234);
    }
}
