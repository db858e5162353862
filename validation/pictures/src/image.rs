use super::colour::{Rgb, mix};
use base64::Engine as _;
use psidpd_formats::files::SOFTWARE;

/// Pixels are stored row after row from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    /// The slice has `width · height` colours.
    pub pixels: Vec<Rgb>,
}

impl Image {
    pub fn filled(width: usize, height: usize, colour: Rgb) -> Image {
        Image { width, height, pixels: vec![colour; width * height] }
    }

    /// The colour of a pixel, counted from the upper left; `None` outside the image.
    pub fn get(&self, x: usize, y: usize) -> Option<Rgb> {
        (x < self.width).then(|| self.pixels.get(y * self.width + x).copied())?
    }

    /// Averages each square of `factor` by `factor` pixels into one. Incomplete squares at the right and at the bottom
    /// are dropped.
    pub fn reduced(&self, factor: usize) -> Image {
        let factor = factor.max(1);
        let (width, height) = (self.width / factor, self.height / factor);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0u32; 3];
                for dy in 0..factor {
                    let from = (y * factor + dy) * self.width + x * factor;
                    for pixel in &self.pixels[from..from + factor] {
                        for (s, c) in sum.iter_mut().zip(pixel) {
                            *s += u32::from(*c);
                        }
                    }
                }
                let count = (factor * factor) as u32;
                pixels.push(sum.map(|s| ((s + count / 2) / count) as u8));
            }
        }
        Image { width, height, pixels }
    }

    /// Mixes a colour into a pixel. Pixels outside the image are ignored.
    pub(super) fn blend(&mut self, x: usize, y: usize, colour: Rgb, share: f64) {
        if x < self.width && y < self.height {
            let pixel = &mut self.pixels[y * self.width + x];
            *pixel = mix(*pixel, colour, share);
        }
    }

    pub fn to_png(&self) -> Result<Vec<u8>, png::EncodingError> {
        Image::to_apng(std::slice::from_ref(self), 1)
    }

    /// Encodes as [`Image::to_png`] in a small part of the time, in a larger file.
    pub fn to_png_fast(&self) -> Result<Vec<u8>, png::EncodingError> {
        // Of all filters this one makes the smallest files; the choice of one for each row makes them no smaller, and takes twice the time.
        Image::encode(std::slice::from_ref(self), 1, png::Compression::Fast, png::Filter::Paeth)
    }

    /// The first image of an animation, whose images must have one size.
    fn first_of(images: &[Image]) -> Result<&Image, &'static str> {
        let first = images.first().ok_or("an animation without images")?;
        match images.iter().all(|i| (i.width, i.height) == (first.width, first.height)) {
            true => Ok(first),
            false => Err("the images of an animation differ in size"),
        }
    }

    /// Encodes an animated PNG file that repeats forever, with `per_second` frames in a second; one image gives a plain
    /// PNG. Programs that support only plain PNG show the first image.
    pub fn to_apng(images: &[Image], per_second: u16) -> Result<Vec<u8>, png::EncodingError> {
        // The highest level takes three times as long, for files smaller by 0 to 5 %; a choice of filters makes them larger by 1 to 15 %.
        Image::encode(images, per_second, png::Compression::Balanced, png::Filter::Sub)
    }

    fn encode(
        images: &[Image],
        per_second: u16,
        compression: png::Compression,
        filter: png::Filter,
    ) -> Result<Vec<u8>, png::EncodingError> {
        let wrong = |what| std::io::Error::new(std::io::ErrorKind::InvalidInput, what);
        let first = Image::first_of(images).map_err(wrong)?;
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, first.width as u32, first.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(compression);
        encoder.set_filter(filter);
        if images.len() > 1 {
            encoder.set_animated(images.len() as u32, 0)?;
            encoder.set_frame_delay(1, per_second.max(1))?;
        }
        let [keyword, text] = SOFTWARE.map(str::to_owned);
        encoder.add_text_chunk(keyword, text)?;
        let mut writer = encoder.write_header()?;
        for image in images {
            writer.write_image_data(image.pixels.as_flattened())?;
        }
        writer.finish()?;
        Ok(bytes)
    }

    /// Encodes an animated GIF file that repeats forever and shows each frame for `centiseconds`.
    pub fn to_gif(images: &[Image], centiseconds: u16) -> Result<Vec<u8>, String> {
        let first = Image::first_of(images)?;
        let side = |n: usize| u16::try_from(n).map_err(|_| "the images are too large for a GIF".to_owned());
        let (width, height) = (side(first.width)?, side(first.height)?);
        let mut bytes = Vec::new();
        let mut encoder = gif::Encoder::new(&mut bytes, width, height, &[]).map_err(|e| e.to_string())?;
        encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| e.to_string())?;
        let comment = gif::AnyExtension(gif::Extension::Comment as u8);
        encoder.write_raw_extension(comment, &[SOFTWARE[1].as_bytes()]).map_err(|e| e.to_string())?;
        for image in images {
            // Each frame has its own palette, from a tenth of its pixels.
            let mut frame = gif::Frame::from_rgb_speed(width, height, image.pixels.as_flattened(), 10);
            frame.delay = centiseconds;
            encoder.write_frame(&frame).map_err(|e| e.to_string())?;
        }
        drop(encoder);
        Ok(bytes)
    }

    /// Reads the first image of a PNG file with eight bits for red, green and blue, as [`Image::to_png`] writes it.
    pub fn from_png(bytes: &[u8]) -> Result<Image, String> {
        let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
        let size = reader.output_buffer_size().ok_or("the picture is too large")?;
        let mut buffer = vec![0; size];
        let info = reader.next_frame(&mut buffer).map_err(|e| e.to_string())?;
        if (info.color_type, info.bit_depth) != (png::ColorType::Rgb, png::BitDepth::Eight) {
            return Err("not a picture of eight-bit red, green and blue".into());
        }
        let (pixels, _) = buffer[..info.buffer_size()].as_chunks::<3>();
        Ok(Image { width: info.width as usize, height: info.height as usize, pixels: pixels.to_vec() })
    }

    /// The image as a data address: `data:image/png;base64,…`.
    pub fn to_data_url(&self) -> Result<String, png::EncodingError> {
        Ok(data_url(&self.to_png()?))
    }
}

pub fn data_url(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(png))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient(shift: u8) -> Image {
        let pixels = (0..6u8).map(|k| [k * 40, 255 - k, shift]).collect();
        Image { width: 3, height: 2, pixels }
    }

    #[test]
    fn png_round_trip() {
        let png = gradient(9).to_png().unwrap();
        assert_eq!(Image::from_png(&png).unwrap(), gradient(9));
        assert_eq!(Image::from_png(&gradient(9).to_png_fast().unwrap()).unwrap(), gradient(9));
        assert!(Image::from_png(&png[..40]).is_err() && Image::from_png(b"no").is_err());
        assert!(gradient(9).to_data_url().unwrap().starts_with("data:image/png;base64,iVBORw0KGgo"));
        assert!(Image::filled(0, 0, [0; 3]).to_png().is_err());
    }

    /// The file has the chunks of an animation, and a decoder finds every frame.
    #[test]
    fn an_animation_has_every_frame() {
        let images = [gradient(1), gradient(2), gradient(3)];
        let bytes = Image::to_apng(&images, 10).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let control = reader.info().animation_control.unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for image in &images {
            let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut buffer).unwrap();
            assert_eq!(buffer, image.pixels.as_flattened());
        }
        assert!(Image::to_apng(&[gradient(1), Image::filled(2, 2, [0; 3])], 10).is_err());
        assert!(Image::to_apng(&[], 10).is_err());
    }

    #[test]
    fn a_gif_has_every_frame() {
        let images = [[0, 0, 250], [250, 0, 0], [0, 250, 0]].map(|c| Image::filled(20, 10, c));
        let bytes = Image::to_gif(&images, 12).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&bytes[..]).unwrap();
        for image in &images {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            assert_eq!((frame.width, frame.height, frame.delay), (20, 10, 12));
            let found = &frame.buffer[..3];
            assert!(found.iter().zip(image.pixels[0]).all(|(a, b)| a.abs_diff(b) < 8), "{found:?}");
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
        assert!(Image::to_gif(&[], 10).is_err());
    }

    #[test]
    fn reduction_averages() {
        let image =
            Image { width: 3, height: 2, pixels: vec![[10; 3], [20; 3], [9; 3], [30; 3], [40; 3], [9; 3]] };
        assert_eq!(image.reduced(2), Image { width: 1, height: 1, pixels: vec![[25; 3]] });
        assert_eq!(image.get(2, 1), Some([9; 3]));
        assert_eq!((image.get(3, 0), image.get(0, 2)), (None, None));
    }
}
