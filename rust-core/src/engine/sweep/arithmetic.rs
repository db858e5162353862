//! Mixed and double precision: what is kept of a particle, and how a pair's distance comes from it.

use super::block::Block;
use super::frame::Frame;
use super::simd::{Isa, Quad, Reals, Scalar, Words};
use crate::model::kernel::Real;

/// A choice of precision on an instruction set.
#[allow(clippy::missing_safety_doc)] // The contract of `simd`.
pub trait Arithmetic<I: Isa>: 'static {
    type Scalar: Scalar;
    type Reals: Reals<Scalar = Self::Scalar>;
    type Record: Record<Scalar = Self::Scalar>;

    /// Fills `own` of the pairs of a block, and their `tag_i`, from its members; runs over by a vector.
    #[inline(always)]
    unsafe fn spread(records: *const Self::Record, block: &mut Block<Self::Scalar>, moving: bool) {
        // SAFETY: the contract of `simd`; the block has room for whole vectors.
        unsafe {
            let mut own = [std::ptr::null_mut(); 6];
            let mut c = 0;
            while c < 6 {
                own[c] = block.own[c].as_mut_ptr();
                c += 1;
            }
            let tag = block.tag_i.as_mut_ptr();
            let (members, begin) = (block.members.as_ptr(), block.begin.as_ptr());
            let mut p = 0;
            let mut m = 0;
            while m < block.members.len() {
                let record = &*records.add(*members.add(m) as usize);
                let end = *begin.add(m + 1) as usize;
                let [x, y, z, u, v, w] = record.own();
                let (x, y, z) = (Self::Reals::splat(x), Self::Reals::splat(y), Self::Reals::splat(z));
                let (u, v, w) = (Self::Reals::splat(u), Self::Reals::splat(v), Self::Reals::splat(w));
                let t = I::U32::splat(record.tag());
                let mut k = p;
                // Sixteen at once, which is mostly enough.
                loop {
                    let stop = k + 16;
                    if moving {
                        t.store(tag.add(k));
                        if I::U32::LANES < 16 {
                            t.store(tag.add(k + 8));
                        }
                    }
                    while k < stop {
                        x.store(own[0].add(k));
                        y.store(own[1].add(k));
                        z.store(own[2].add(k));
                        if moving {
                            u.store(own[3].add(k));
                            v.store(own[4].add(k));
                            w.store(own[5].add(k));
                        }
                        k += Self::Reals::LANES;
                    }
                    if k >= end {
                        break;
                    }
                }
                p = end;
                m += 1;
            }
        }
    }

    /// Fills `d`, `r` and `1/r` of the pairs of a block, and for the thermostat also their velocity along
    /// `ê` and their tags, for whole vectors up to `count`.
    unsafe fn separate(
        frame: &Frame,
        records: *const Self::Record,
        block: &mut Block<Self::Scalar>,
        count: usize,
        moving: bool,
    );

    /// Indices as numbers of the fourth column of rows; whole vectors.
    unsafe fn encode_all(index: *const u32, out: *mut Self::Scalar, count: usize);
    /// The index that a number stands for.
    fn decode(number: Self::Scalar) -> u32;
    unsafe fn load_quad(p: *const Self::Scalar) -> I::Quad;
}

/// What is kept of a particle, in the order of cells.
pub trait Record: Copy + Default + Send + Sync + 'static {
    type Scalar;
    fn new(u: [u32; 3], x: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> Self;
    fn tag(&self) -> u32;
    /// Position, in whatever bits it is kept, and velocity.
    fn own(&self) -> [Self::Scalar; 6];
}

/// Position as fractions of the box in units of 2⁻³²: differences wrap by themselves.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct MixedRecord {
    u: [u32; 3],
    tag: u32,
    v: [f32; 3],
    species: u32,
}

impl Record for MixedRecord {
    type Scalar = f32;
    #[inline(always)]
    fn new(u: [u32; 3], _: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> MixedRecord {
        MixedRecord { u, tag, v: [v[0] as f32, v[1] as f32, v[2] as f32], species }
    }
    #[inline(always)]
    fn tag(&self) -> u32 {
        self.tag
    }
    #[inline(always)]
    fn own(&self) -> [f32; 6] {
        let [x, y, z] = self.u;
        [f32::from_bits(x), f32::from_bits(y), f32::from_bits(z), self.v[0], self.v[1], self.v[2]]
    }
}

/// Everything as the host has it.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct DoubleRecord {
    x: [f64; 3],
    tag: u32,
    species: u32,
    v: [f64; 3],
    rest: f64,
}

impl Record for DoubleRecord {
    type Scalar = f64;
    #[inline(always)]
    fn new(_: [u32; 3], x: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> DoubleRecord {
        DoubleRecord { x: *x, tag, species, v: *v, rest: 0.0 }
    }
    #[inline(always)]
    fn tag(&self) -> u32 {
        self.tag
    }
    #[inline(always)]
    fn own(&self) -> [f64; 6] {
        [self.x[0], self.x[1], self.x[2], self.v[0], self.v[1], self.v[2]]
    }
}

/// Pairs in single precision.
pub struct Mixed;

/// Pairs in double precision.
pub struct Double;

/// Particles on one point have no direction; this keeps `1/r` finite, and `d/r` zero.
const TINY: f64 = 1e-30;

const TWO_TO_32: f64 = 4_294_967_296.0;

impl<I: Isa> Arithmetic<I> for Mixed {
    type Scalar = f32;
    type Reals = I::F32;
    type Record = MixedRecord;

    #[inline(always)]
    unsafe fn separate(
        frame: &Frame,
        records: *const MixedRecord,
        block: &mut Block<f32>,
        count: usize,
        moving: bool,
    ) {
        // SAFETY: the contract of `simd`; the block has room for whole vectors.
        unsafe {
            let stride = size_of::<MixedRecord>();
            let base: *const u8 = records.cast();
            let scale = per_unit(frame.length);
            let lean = per_unit(frame.tilt);
            let (sx, sy, sz) = (I::F32::splat(scale[0]), I::F32::splat(scale[1]), I::F32::splat(scale[2]));
            let (xy, xz, yz) = (I::F32::splat(lean[0]), I::F32::splat(lean[1]), I::F32::splat(lean[2]));
            let tilted = frame.is_tilted();
            let tiny = I::F32::splat(TINY as f32);
            let mut own = [std::ptr::null(); 6];
            let mut c = 0;
            while c < 6 {
                own[c] = block.own[c].as_ptr();
                c += 1;
            }
            let p_j = block.j.as_ptr();
            let p_d0 = block.d[0].as_mut_ptr();
            let p_d1 = block.d[1].as_mut_ptr();
            let p_d2 = block.d[2].as_mut_ptr();
            let p_r = block.r.as_mut_ptr();
            let p_inverse = block.inverse.as_mut_ptr();
            let p_tag_j = block.tag_j.as_mut_ptr();
            let p_along = block.along.as_mut_ptr();
            let mut k = 0;
            while k < count {
                let pj = p_j.add(k);
                let xi = I::U32::load(own[0].add(k).cast());
                let yi = I::U32::load(own[1].add(k).cast());
                let zi = I::U32::load(own[2].add(k).cast());
                let [xj, yj, zj, tj] = I::word_columns(base, stride, pj);
                let (a, b, c) = (I::signed(xi.sub(xj)), I::signed(yi.sub(yj)), I::signed(zi.sub(zj)));
                let (mut dx, mut dy, dz) = (a * sx, b * sy, c * sz);
                if tilted {
                    dx = b.mul_add(xy, c.mul_add(xz, dx));
                    dy = c.mul_add(yz, dy);
                }
                let r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).larger(tiny);
                let inverse = r2.inverse_root();
                dx.store(p_d0.add(k));
                dy.store(p_d1.add(k));
                dz.store(p_d2.add(k));
                (r2 * inverse).store(p_r.add(k));
                inverse.store(p_inverse.add(k));
                if moving {
                    tj.store(p_tag_j.add(k));
                    let ui = I::F32::load(own[3].add(k));
                    let vi = I::F32::load(own[4].add(k));
                    let wi = I::F32::load(own[5].add(k));
                    let [uj, vj, wj, _] = I::F32::columns(base.add(16), stride, pj);
                    let along = (ui - uj).mul_add(dx, (vi - vj).mul_add(dy, (wi - wj) * dz));
                    (along * inverse).store(p_along.add(k));
                }
                k += <I::F32 as Reals>::LANES;
            }
        }
    }

    // Bits of a number of ordinary size, for indices below 2²⁹.
    #[inline(always)]
    unsafe fn encode_all(index: *const u32, out: *mut f32, count: usize) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let ordinary = I::U32::splat(0x4000_0000);
            let mut k = 0;
            while k < count {
                I::U32::load(index.add(k)).add(ordinary).store(out.add(k).cast());
                k += I::U32::LANES;
            }
        }
    }
    #[inline(always)]
    fn decode(number: f32) -> u32 {
        number.to_bits() - 0x4000_0000
    }
    #[inline(always)]
    unsafe fn load_quad(p: *const f32) -> I::Quad {
        // SAFETY: the contract of `simd`.
        unsafe { I::Quad::load_f32(p) }
    }
}

/// Lengths over 2³².
#[inline(always)]
fn per_unit(l: [f64; 3]) -> [f32; 3] {
    [(l[0] / TWO_TO_32) as f32, (l[1] / TWO_TO_32) as f32, (l[2] / TWO_TO_32) as f32]
}

impl<I: Isa> Arithmetic<I> for Double {
    type Scalar = f64;
    type Reals = I::F64;
    type Record = DoubleRecord;

    #[inline(always)]
    unsafe fn separate(
        frame: &Frame,
        records: *const DoubleRecord,
        block: &mut Block<f64>,
        count: usize,
        moving: bool,
    ) {
        // SAFETY: the contract of `simd`; the block has room for whole vectors.
        unsafe {
            let stride = size_of::<DoubleRecord>();
            let base: *const u8 = records.cast();
            let mut inverse_length = [0.0; 3];
            for c in 0..3 {
                if frame.periodic[c] {
                    inverse_length[c] = 1.0 / frame.length[c];
                }
            }
            let l = frame.length;
            let (lx, ly, lz) = (I::F64::splat(l[0]), I::F64::splat(l[1]), I::F64::splat(l[2]));
            let ix = I::F64::splat(inverse_length[0]);
            let iy = I::F64::splat(inverse_length[1]);
            let iz = I::F64::splat(inverse_length[2]);
            let t = frame.tilt;
            let (xy, xz, yz) = (I::F64::splat(t[0]), I::F64::splat(t[1]), I::F64::splat(t[2]));
            let tilted = frame.is_tilted();
            let flat = if frame.dimensions == 3 { I::F64::splat(1.0) } else { I::F64::splat(0.0) };
            let tiny = I::F64::splat(TINY);
            let mut own = [std::ptr::null(); 6];
            let mut c = 0;
            while c < 6 {
                own[c] = block.own[c].as_ptr();
                c += 1;
            }
            let p_j = block.j.as_ptr();
            let p_d0 = block.d[0].as_mut_ptr();
            let p_d1 = block.d[1].as_mut_ptr();
            let p_d2 = block.d[2].as_mut_ptr();
            let p_r = block.r.as_mut_ptr();
            let p_inverse = block.inverse.as_mut_ptr();
            let p_along = block.along.as_mut_ptr();
            let mut k = 0;
            while k < count {
                let pj = p_j.add(k);
                let xi = I::F64::load(own[0].add(k));
                let yi = I::F64::load(own[1].add(k));
                let zi = I::F64::load(own[2].add(k));
                let [xj, yj, zj, _] = I::F64::columns(base, stride, pj);
                let (mut dx, mut dy, mut dz) = (xi - xj, yi - yj, (zi - zj) * flat);
                let boxes = (dz * iz).round();
                dz = dz - boxes * lz;
                if tilted {
                    dx = dx - boxes * xz;
                    dy = dy - boxes * yz;
                }
                let boxes = (dy * iy).round();
                dy = dy - boxes * ly;
                if tilted {
                    dx = dx - boxes * xy;
                }
                dx = dx - (dx * ix).round() * lx;
                let r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).larger(tiny);
                let inverse = r2.inverse_root();
                dx.store(p_d0.add(k));
                dy.store(p_d1.add(k));
                dz.store(p_d2.add(k));
                (r2 * inverse).store(p_r.add(k));
                inverse.store(p_inverse.add(k));
                if moving {
                    let ui = I::F64::load(own[3].add(k));
                    let vi = I::F64::load(own[4].add(k));
                    let wi = I::F64::load(own[5].add(k));
                    let [uj, vj, wj, _] = I::F64::columns(base.add(32), stride, pj);
                    let along = (ui - uj).mul_add(dx, (vi - vj).mul_add(dy, (wi - wj) * dz));
                    (along * inverse).store(p_along.add(k));
                }
                k += <I::F64 as Reals>::LANES;
            }
            if moving {
                for k in 0..count {
                    *block.tag_j.get_unchecked_mut(k) = (*records.add(block.j[k] as usize)).tag;
                }
            }
        }
    }

    #[inline(always)]
    unsafe fn encode_all(index: *const u32, out: *mut f64, count: usize) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let mut k = 0;
            while k < count {
                *out.add(k) = f64::from_bits(0x3ff0_0000_0000_0000 | *index.add(k) as u64);
                k += 1;
            }
        }
    }
    #[inline(always)]
    fn decode(number: f64) -> u32 {
        number.to_bits() as u32
    }
    #[inline(always)]
    unsafe fn load_quad(p: *const f64) -> I::Quad {
        // SAFETY: the contract of `simd`.
        unsafe { I::Quad::load(p) }
    }
}
