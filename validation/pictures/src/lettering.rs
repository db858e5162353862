//! Text and scale bars on pictures that have no axes.

use super::Image;
use super::colour::Rgb;
use font8x8::UnicodeFonts;

const WHITE: Rgb = [255; 3];
const BLACK: Rgb = [0; 3];
/// The side of a letter in the font's own pixels.
const LETTER: usize = 8;
/// The longest scale bar, as a share of the width of the picture.
const LONGEST: f64 = 0.3;

impl Image {
    /// The pixels of the picture for each pixel of the font.
    fn stroke(&self) -> usize {
        (self.width.min(self.height) / 320).max(1)
    }

    /// Black on a light ground, white on a dark one, and the other one for the rim.
    fn ink(&self, [x, y]: [usize; 2]) -> [Rgb; 2] {
        let ground = self.get(x, y).unwrap_or(WHITE);
        let light = ground.iter().map(|c| u32::from(*c)).sum::<u32>() > 3 * 128;
        if light { [BLACK, WHITE] } else { [WHITE, BLACK] }
    }

    /// Writes a line of text at the upper left. Characters that the font lacks become spaces.
    pub fn stamp(&mut self, text: &str) {
        let stroke = self.stroke();
        self.write(text, [LETTER * stroke; 2]);
    }

    /// Draws a bar at the lower left with its length, a round number, above it. `span` is the length that the width of
    /// the picture stands for.
    pub fn draw_scale_bar(&mut self, span: f64) {
        let Some(length) = round_below(LONGEST * span) else { return };
        let stroke = self.stroke();
        let long = (length / span * self.width as f64).round() as usize;
        let (x, y) = (LETTER * stroke, self.height.saturating_sub(LETTER * stroke));
        let [ink, rim] = self.ink([x, y]);
        self.fill([x.saturating_sub(1), y.saturating_sub(1)], [long + 2, 2 * stroke + 2], rim);
        self.fill([x, y], [long, 2 * stroke], ink);
        self.write(&length.to_string(), [x, y.saturating_sub((LETTER + 2) * stroke)]);
    }

    fn write(&mut self, text: &str, [x, y]: [usize; 2]) {
        let stroke = self.stroke();
        let [ink, rim] = self.ink([x, y]);
        let mut dots = Vec::new();
        for (k, letter) in text.chars().enumerate() {
            for (row, bits) in font8x8::BASIC_FONTS.get(letter).unwrap_or_default().into_iter().enumerate() {
                let set = (0..LETTER).filter(|column| bits >> column & 1 == 1);
                dots.extend(set.map(|column| [x + (k * LETTER + column) * stroke, y + row * stroke]));
            }
        }
        for [x, y] in &dots {
            self.fill([x.saturating_sub(1), y.saturating_sub(1)], [stroke + 2; 2], rim);
        }
        for at in dots {
            self.fill(at, [stroke; 2], ink);
        }
    }

    fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], colour: Rgb) {
        for row in y..y + height {
            for column in x..x + width {
                self.blend(column, row, colour, 1.0);
            }
        }
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a length; `None` for lengths that are not positive.
fn round_below(length: f64) -> Option<f64> {
    let power = length.log10().floor();
    if !power.is_finite() {
        return None;
    }
    let power = power as i32;
    let value = |factor: &f64| {
        if power < 0 { factor / 10f64.powi(-power) } else { factor * 10f64.powi(power) }
    };
    [5.0, 2.0, 1.0].iter().map(value).find(|v| *v <= length * (1.0 + 1e-12))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_the_length_that_it_names() {
        // A third of 12 is 3.6, so the bar is 2 long, which is 60 of 360 pixels.
        let mut image = Image::filled(360, 360, [0x60; 3]);
        image.draw_scale_bar(12.0);
        let bar = (0..360).filter(|x| image.get(*x, 353) == Some(WHITE)).count();
        assert_eq!(bar, 60);
        for (length, below) in [(3.6, 2.0), (0.3, 0.2), (1.0, 1.0), (99.0, 50.0), (0.05, 0.05)] {
            assert_eq!(round_below(length), Some(below));
        }
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(round_below), [None; 4]);
        // A picture smaller than a letter is no reason to fail.
        Image::filled(3, 3, WHITE).draw_scale_bar(1.0);
    }

    #[test]
    fn letters_are_those_of_the_font() {
        let mut image = Image::filled(32, 24, [0x60; 3]);
        image.stamp("|");
        // A vertical stroke: every row of the letter but the gap in its middle has the same two columns.
        let columns =
            |y: usize| -> Vec<usize> { (0..32).filter(|x| image.get(*x, y) == Some(WHITE)).collect() };
        assert_eq!(columns(8), [11, 12]);
        assert_eq!(columns(7), Vec::<usize>::new());
    }
}
