//! Growth of lists, and of arrays over particles.

/// Makes room for `more` elements plus an eighth of the length: the doubling of `Vec` would waste much memory.
#[inline(always)]
pub fn make_room<T>(values: &mut Vec<T>, more: usize) {
    if values.capacity() - values.len() < more {
        values.reserve_exact(more.max(values.len() / 8));
    }
}

/// Resizes an array over particles and the copies of some, whose number changes from step to step: it gets room for a sixteenth more. An
/// array that grows is there twice meanwhile, and all of its memory is new.
pub fn resize<T: Clone>(values: &mut Vec<T>, length: usize, value: T) {
    if values.capacity() < length {
        values.reserve_exact(length + length / 16 - values.len());
    }
    values.resize(length, value);
}

#[cfg(test)]
mod tests {
    use super::resize;

    #[test]
    fn arrays_stay_where_a_few_particles_are_added() {
        let mut values = Vec::new();
        resize(&mut values, 1600, 1);
        let (place, room) = (values.as_ptr(), values.capacity());
        assert!(room < 1750);
        for length in [1700, 1600, 1650] {
            resize(&mut values, length, 2);
            assert!(values.len() == length && values.as_ptr() == place && values.capacity() == room);
        }
        assert!(values[..1600].iter().all(|v| *v == 1) && values[1600..].iter().all(|v| *v == 2));
        resize(&mut values, 2000, 2);
        assert!((2000..2200).contains(&values.capacity()));
    }
}
