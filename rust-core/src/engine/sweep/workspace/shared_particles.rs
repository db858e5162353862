use crate::engine::sweep::cells::ghosts::OwnedOfColumn;
use crate::engine::sweep::ground::fixed_point::FixedPoint16;
use crate::engine::sweep::ground::shared_slice::SharedSlice;

/// The sorted particles while passes are at work: threads fill the places of their own slabs, and read there and one plane behind.
pub struct SharedParticles<'a, R> {
    pub x: [SharedSlice<'a, f32>; 3],
    pub fixed16_scale: FixedPoint16,
    pub fixed16: [SharedSlice<'a, u16>; 3],
    pub packed: SharedSlice<'a, R>,
    pub species: SharedSlice<'a, u8>,
    pub ghost: &'a [bool],
    pub owned_bits: &'a [u8],
    pub owned_of_column: &'a [OwnedOfColumn],
}
