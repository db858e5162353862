//! Colours of species and of values.

/// The parts are red, green, blue.
pub type Rgb = [u8; 3];

/// Okabe and Ito's palette for colour-blind readers, without the yellow, which is hard to see on white. The k-th species
/// and the k-th curve of a plot have the k-th colour. After the last colour the palette starts again.
pub const PALETTE: [Rgb; 7] = [
    [0x00, 0x72, 0xB2],
    [0xD5, 0x5E, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xE6, 0x9F, 0x00],
    [0x56, 0xB4, 0xE9],
    [0x00, 0x00, 0x00],
];

pub fn of_species(species: usize) -> Rgb {
    PALETTE[species % PALETTE.len()]
}

/// Mixes `a` (share 0) and `b` (share 1).
pub fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|k| (f64::from(a[k]) * (1.0 - share) + f64::from(b[k]) * share + 0.5) as u8)
}

/// The scale goes from dark blue over green to yellow. Lightness grows with the value, so it is legible in grey too.
const SCALE: [Rgb; 9] = [
    [0x35, 0x0A, 0x52],
    [0x44, 0x33, 0x80],
    [0x36, 0x57, 0x8C],
    [0x2A, 0x76, 0x8E],
    [0x1F, 0x94, 0x8B],
    [0x3D, 0xB3, 0x76],
    [0x7C, 0xCC, 0x53],
    [0xBE, 0xDE, 0x3A],
    [0xFB, 0xE8, 0x45],
];

/// The colour of a value between 0 and 1. Values outside have the colour of the nearer end.
pub fn of_value(value: f64) -> Rgb {
    if value.is_nan() {
        return [0xD0, 0xD0, 0xD0];
    }
    let at = value.clamp(0.0, 1.0) * (SCALE.len() - 1) as f64;
    let k = (at as usize).min(SCALE.len() - 2);
    mix(SCALE[k], SCALE[k + 1], at - k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_grows_with_the_value() {
        // The relative luminance of ITU-R BT.709.
        let luminance = |c: Rgb| {
            let linear = c.map(|v| (f64::from(v) / 255.0).powf(2.2));
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
        };
        let all: Vec<f64> = (0..=100).map(|k| luminance(of_value(f64::from(k) / 100.0))).collect();
        assert!(all.windows(2).all(|w| w[1] > w[0]), "{all:?}");
        assert_eq!((of_value(-3.0), of_value(7.0)), (SCALE[0], SCALE[8]));
    }

    #[test]
    fn species_have_colours_of_their_own() {
        for a in 0..7 {
            assert!((0..a).all(|b| of_species(a) != of_species(b)));
        }
        assert_eq!(of_species(7), of_species(0));
    }
}
