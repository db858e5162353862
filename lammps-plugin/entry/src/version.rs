//! LAMMPS's versions are dates: 20250722 is the 22 Jul 2025.

const MONTHS: [&str; 12] =
    ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];

/// The version as LAMMPS prints it, or the number if it is no date.
pub fn in_words(number: u32) -> String {
    let (year, month, day) = (number / 10_000, number / 100 % 100, number % 100);
    match (month as usize).checked_sub(1).and_then(|m| MONTHS.get(m)) {
        Some(month) => format!("{day} {month} {year}"),
        None => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::in_words;

    #[test]
    fn versions_in_words() {
        assert_eq!(in_words(20_250_722), "22 Jul 2025");
        assert_eq!(in_words(20_210_929), "29 Sep 2021");
        assert_eq!(in_words(20_250_204), "4 Feb 2025");
        for no_date in [0, 7, 20_250_022, 20_251_322, u32::MAX] {
            assert_eq!(in_words(no_date), no_date.to_string());
        }
    }
}
