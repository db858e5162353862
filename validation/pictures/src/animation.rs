use super::Image;
use super::snapshot::{SNAPSHOTS, snapshots, step_of};
use psidpd_formats::FormatError;
use psidpd_formats::files::read_inside;
use std::path::Path;

/// The largest number of frames of an animation. Longer series are thinned to every second, third, … frame.
const MOST: usize = 40;
const PER_SECOND: u16 = 8;

/// The snapshots of a run as one animated PNG of half their size; `None` with fewer than two. At most forty
/// evenly spaced snapshots are shown, the last one among them.
pub fn animate(folder: &Path) -> Result<Option<Vec<u8>>, FormatError> {
    let all = snapshots(folder);
    if all.len() < 2 {
        return Ok(None);
    }
    let stride = all.len().div_ceil(MOST);
    let mut images = Vec::new();
    for path in all.iter().rev().step_by(stride) {
        let bytes = read_inside(path)?;
        let mut image = Image::from_png(&bytes).map_err(FormatError::content(path))?.reduced(2);
        if let Some(step) = step_of(path) {
            image.stamp(&format!("step {step}"));
        }
        images.push(image);
    }
    images.reverse();
    let packed = Image::to_apng(&images, PER_SECOND);
    packed.map(Some).map_err(FormatError::content(&folder.join(SNAPSHOTS)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snapshot::snapshot_name;

    #[test]
    fn frames_are_in_order_and_end_with_the_last() {
        let folder = tempfile::tempdir().unwrap();
        assert!(animate(folder.path()).unwrap().is_none());
        std::fs::create_dir(folder.path().join(SNAPSHOTS)).unwrap();
        let write = |step: u64, image: Image| {
            let path = folder.path().join(SNAPSHOTS).join(snapshot_name(step));
            std::fs::write(path, image.to_png().unwrap()).unwrap();
        };
        let shade = |step: u64| [step as u8; 3];
        for step in (0..90).rev() {
            write(step, Image::filled(8, 4, shade(step)));
        }
        std::fs::write(folder.path().join(SNAPSHOTS).join("notes.txt"), "").unwrap();
        let bytes = animate(folder.path()).unwrap().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let frames = reader.info().animation_control.unwrap().num_frames;
        assert_eq!(frames, 30);
        let mut seen = Vec::new();
        for _ in 0..frames {
            let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut buffer).unwrap();
            assert_eq!((info.width, info.height), (4, 2));
            seen.push(buffer[0]);
        }
        assert!(seen.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(seen.last(), Some(&89));
        write(89, Image::filled(4, 4, shade(0)));
        assert!(animate(folder.path()).unwrap_err().to_string().contains("differ in size"));
        std::fs::write(folder.path().join(SNAPSHOTS).join(snapshot_name(89)), "no").unwrap();
        assert!(animate(folder.path()).is_err());
    }
}
