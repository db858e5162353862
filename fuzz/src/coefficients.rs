use crate::bytes::Bytes;
use psidpd_core::model::{SplinePair, WarrenPair};
use psidpd_styles::style::Style;

/// Any coefficients of LAMMPS's pair styles, and any model file with any species, make a style or an error. The text of a
/// style's model, which restart files hold, makes the same style again.
pub fn coefficients(input: &[u8]) {
    let mut bytes = Bytes(input);
    let (form, dimensions, kt) = (bytes.below(4), bytes.below(5), bytes.number());
    let types = bytes.below(5);
    // The number of coefficients is sometimes wrong.
    let count = if bytes.byte() == 0 { bytes.below(30) } else { types * types };
    let style = match form {
        0 | 1 => {
            let pairs: Vec<Option<WarrenPair>> = (0..count)
                .map(|_| {
                    let [a, b, gamma, rc, rd] = std::array::from_fn(|_| bytes.number());
                    (bytes.byte() > 8).then_some(WarrenPair { a, b, gamma, rc, rd, weight: None })
                })
                .collect();
            let masses: Vec<f64> = (0..types).map(|_| bytes.number()).collect();
            let masses = (form == 1).then_some(&masses[..]);
            Style::from_coefficients(kt, &pairs, types, dimensions, masses)
        }
        2 => {
            let pairs: Vec<Option<SplinePair>> = (0..count)
                .map(|_| {
                    let [strength, repulsion, attraction, repulsion_range, attraction_range, gamma] =
                        std::array::from_fn(|_| bytes.number());
                    let pair = SplinePair {
                        strength,
                        repulsion,
                        attraction,
                        repulsion_range,
                        attraction_range,
                        gamma,
                    };
                    (bytes.byte() > 8).then_some(pair)
                })
                .collect();
            Style::from_spline_coefficients(kt, &pairs, types, bytes.number(), dimensions)
        }
        _ => {
            let names: Vec<String> =
                (0..types).map(|_| ["A", "B", "F", "NULL", ""][bytes.below(5)].to_owned()).collect();
            let text = String::from_utf8_lossy(bytes.0).into_owned();
            Style::from_text("fuzz.toml", &text, "lj", kt, &names, dimensions)
        }
    };
    let mut style = match style {
        Ok(style) => style,
        // A caught panic is an internal error.
        Err(error) => return assert!(!error.to_string().contains("internal error"), "{error}"),
    };
    assert!(!style.description("a fuzzer", false, true).is_empty());
    assert!(style.engine.plan().cutoff() >= 0.0);
    if form < 3 {
        let text = style.model.source().text().to_owned();
        let names = style.model.species().to_vec();
        let again = Style::from_text("restart", &text, "lj", kt, &names, dimensions);
        let again = again.unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(again.engine.plan().cutoff(), style.engine.plan().cutoff());
    }
    let _ = style.set_temperature(Bytes(input).number());
}
