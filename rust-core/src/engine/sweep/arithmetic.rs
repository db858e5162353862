//! Mixed and double precision: what is kept of a particle, and how a pair's distance comes from it.

use super::block::PLACE_BITS;
use super::forces::Kind;
use super::frame::Frame;
use super::simd::{Isa, Reals, Scalar, Words};
use crate::model::kernel::Real;

/// A vector's worth of particles, column by column: the first particle of a pair picks its own of each.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct Own<T> {
    /// As the record has it.
    pub position: [[T; 16]; 3],
    pub velocity: [[T; 16]; 3],
    pub tag: [u32; 16],
    pub species: [u32; 16],
}

/// How a vector of pairs lies and moves; `d = r_i − r_j`.
#[derive(Clone, Copy)]
pub struct Apart<R: Reals> {
    pub d: [R; 3],
    pub r: R,
    pub inverse: R,
    /// `ê·v_ij`, for the thermostat.
    pub along: R,
}

/// The same, with what else is known of the pairs before any term.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Pairs<R: Reals> {
    pub apart: Apart<R>,
    /// Which pairs of species, with several.
    pub kind: Kind<R>,
}

/// Tags of both particles of pairs, and the species of the second.
#[derive(Clone, Copy)]
pub struct Names<R: Reals> {
    pub tags: [R::Words; 2],
    pub species_j: R::Words,
}

const _: () =
    assert!(size_of::<MixedRecord>() == 1 << PLACE_BITS && size_of::<DoubleRecord>() == 2 << PLACE_BITS);

/// A choice of precision on an instruction set.
#[allow(clippy::missing_safety_doc)] // The contract of `simd`.
pub trait Arithmetic<I: Isa>: 'static {
    type Scalar: Scalar;
    type Reals: Reals<Scalar = Self::Scalar>;
    type Record: Record<Scalar = Self::Scalar>;
    /// What distances are measured with.
    type Metric: Copy;

    unsafe fn metric(frame: &Frame) -> Self::Metric;

    /// The columns of the records from `first` on, as many as a vector has lanes.
    unsafe fn own(first: *const Self::Record, own: &mut Own<Self::Scalar>);

    /// Pairs of particles of `own`, `which`, with others, at 32 times their `places` in the records. Velocities and
    /// species of the others are there with `ALL` only, how fast pairs part if they are `moving`.
    unsafe fn separate<const ALL: bool>(
        metric: &Self::Metric,
        records: *const Self::Record,
        own: *const Own<Self::Scalar>,
        which: <Self::Reals as Reals>::Words,
        places: *const u32,
        moving: bool,
    ) -> (Apart<Self::Reals>, Names<Self::Reals>);

    /// The columns of rows of eight numbers, at 32 times their `places`; with `ALL`, else only the first four.
    unsafe fn columns_at<const ALL: bool>(rows: *const Self::Scalar, places: *const u32) -> [Self::Reals; 8];

    /// The same of rows that follow each other.
    #[inline(always)]
    unsafe fn own_columns(rows: *const Self::Scalar) -> [Self::Reals; 8] {
        // SAFETY: the contract of `simd`.
        unsafe { Self::columns_at::<true>(rows, IN_ORDER.as_ptr()) }
    }

    unsafe fn load_quad(p: *const Self::Scalar) -> I::Quad;
}

/// What is kept of a particle, in the order of cells.
pub trait Record: Copy + Default + Send + Sync + 'static {
    type Scalar;
    fn new(u: [u32; 3], x: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> Self;
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
}

/// Pairs in single precision.
pub struct Mixed;

/// Pairs in double precision.
pub struct Double;

/// Particles on one point have no direction; this keeps `1/r` finite, and `d/r` zero.
const TINY: f64 = 1e-30;

/// Thirty-two times the place of records that follow each other.
const IN_ORDER: [u32; 16] = [0, 32, 64, 96, 128, 160, 192, 224, 256, 288, 320, 352, 384, 416, 448, 480];

const TWO_TO_32: f64 = 4_294_967_296.0;

/// Lengths of the frame, and how it leans, over 2³².
#[derive(Clone, Copy)]
pub struct MixedMetric<R> {
    scale: [R; 3],
    lean: [R; 3],
    tilted: bool,
}

impl<I: Isa> Arithmetic<I> for Mixed {
    type Scalar = f32;
    type Reals = I::F32;
    type Record = MixedRecord;
    type Metric = MixedMetric<I::F32>;

    #[inline(always)]
    unsafe fn metric(frame: &Frame) -> Self::Metric {
        let per_unit = |l: f64| I::F32::constant(l / TWO_TO_32);
        let ([a, b, c], [d, e, f]) = (frame.length, frame.tilt);
        MixedMetric {
            scale: [per_unit(a), per_unit(b), per_unit(c)],
            lean: [per_unit(d), per_unit(e), per_unit(f)],
            tilted: frame.is_tilted(),
        }
    }

    #[inline(always)]
    unsafe fn own(first: *const MixedRecord, own: &mut Own<f32>) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let [x, y, z, tag, u, v, w, species] = I::columns::<true>(first.cast(), IN_ORDER.as_ptr());
            x.store(own.position[0].as_mut_ptr().cast());
            y.store(own.position[1].as_mut_ptr().cast());
            z.store(own.position[2].as_mut_ptr().cast());
            tag.store(own.tag.as_mut_ptr());
            u.store(own.velocity[0].as_mut_ptr().cast());
            v.store(own.velocity[1].as_mut_ptr().cast());
            w.store(own.velocity[2].as_mut_ptr().cast());
            species.store(own.species.as_mut_ptr());
        }
    }

    #[inline(always)]
    unsafe fn separate<const ALL: bool>(
        metric: &Self::Metric,
        records: *const MixedRecord,
        own: *const Own<f32>,
        which: <I::F32 as Reals>::Words,
        places: *const u32,
        moving: bool,
    ) -> (Apart<I::F32>, Names<I::F32>) {
        type W<I> = <<I as Isa>::F32 as Reals>::Words;
        // SAFETY: the contract of `simd`.
        unsafe {
            let own = &*own;
            let [sx, sy, sz] = metric.scale;
            let [xj, yj, zj, tag_j, uj, vj, wj, species_j] = I::columns::<ALL>(records.cast(), places);
            let xi = W::<I>::pick(own.position[0].as_ptr().cast(), which);
            let yi = W::<I>::pick(own.position[1].as_ptr().cast(), which);
            let zi = W::<I>::pick(own.position[2].as_ptr().cast(), which);
            let a = I::F32::of_signed(xi.sub(xj));
            let b = I::F32::of_signed(yi.sub(yj));
            let c = I::F32::of_signed(zi.sub(zj));
            let (mut dx, mut dy, dz) = (a * sx, b * sy, c * sz);
            if metric.tilted {
                let [xy, xz, yz] = metric.lean;
                dx = b.mul_add(xy, c.mul_add(xz, dx));
                dy = c.mul_add(yz, dy);
            }
            let tiny = I::F32::constant(TINY);
            let r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).larger(tiny);
            let inverse = r2.inverse_root();
            let mut along = inverse;
            if moving {
                let ui = I::F32::pick(own.velocity[0].as_ptr(), which);
                let vi = I::F32::pick(own.velocity[1].as_ptr(), which);
                let wi = I::F32::pick(own.velocity[2].as_ptr(), which);
                let (u, v, w) = (ui - I::of_bits(uj), vi - I::of_bits(vj), wi - I::of_bits(wj));
                let sum = u.mul_add(dx, v.mul_add(dy, w * dz));
                along = sum * inverse;
            }
            let tag_i = W::<I>::pick(own.tag.as_ptr(), which);
            (
                Apart { d: [dx, dy, dz], r: r2 * inverse, inverse, along },
                Names { tags: [tag_i, tag_j], species_j },
            )
        }
    }

    #[inline(always)]
    unsafe fn columns_at<const ALL: bool>(rows: *const f32, places: *const u32) -> [I::F32; 8] {
        // SAFETY: the contract of `simd`.
        unsafe {
            let columns = I::columns::<ALL>(rows.cast(), places);
            let mut numbers = [I::F32::constant(0.0); 8];
            let mut c = 0;
            while c < if ALL { 8 } else { 4 } {
                numbers[c] = I::of_bits(columns[c]);
                c += 1;
            }
            numbers
        }
    }

    #[inline(always)]
    unsafe fn load_quad(p: *const f32) -> I::Quad {
        // SAFETY: the contract of `simd`.
        unsafe { <I::Quad as super::simd::Quad>::load_f32(p) }
    }
}

/// Lengths of the frame, one over those along periods (zero along others), and how it leans.
#[derive(Clone, Copy)]
pub struct DoubleMetric<R> {
    length: [R; 3],
    inverse: [R; 3],
    lean: [R; 3],
    tilted: bool,
    /// 1, and 0 along the direction that two dimensions do not have.
    flat: R,
}

impl<I: Isa> Arithmetic<I> for Double {
    type Scalar = f64;
    type Reals = I::F64;
    type Record = DoubleRecord;
    type Metric = DoubleMetric<I::F64>;

    #[inline(always)]
    unsafe fn metric(frame: &Frame) -> Self::Metric {
        let inverse =
            |k: usize| I::F64::constant(if frame.periodic[k] { 1.0 / frame.length[k] } else { 0.0 });
        let constant = |x: f64| I::F64::constant(x);
        let ([a, b, c], [d, e, f]) = (frame.length, frame.tilt);
        DoubleMetric {
            length: [constant(a), constant(b), constant(c)],
            inverse: [inverse(0), inverse(1), inverse(2)],
            lean: [constant(d), constant(e), constant(f)],
            tilted: frame.is_tilted(),
            flat: constant(if frame.dimensions == 3 { 1.0 } else { 0.0 }),
        }
    }

    #[inline(always)]
    unsafe fn own(first: *const DoubleRecord, own: &mut Own<f64>) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let [x, y, z, bits, u, v, w, _] = I::wide_columns::<true>(first.cast(), IN_ORDER.as_ptr());
            x.store(own.position[0].as_mut_ptr());
            y.store(own.position[1].as_mut_ptr());
            z.store(own.position[2].as_mut_ptr());
            let [tag, species] = I::halves(bits);
            tag.store(own.tag.as_mut_ptr());
            species.store(own.species.as_mut_ptr());
            u.store(own.velocity[0].as_mut_ptr());
            v.store(own.velocity[1].as_mut_ptr());
            w.store(own.velocity[2].as_mut_ptr());
        }
    }

    #[inline(always)]
    unsafe fn separate<const ALL: bool>(
        metric: &Self::Metric,
        records: *const DoubleRecord,
        own: *const Own<f64>,
        which: <I::F64 as Reals>::Words,
        places: *const u32,
        moving: bool,
    ) -> (Apart<I::F64>, Names<I::F64>) {
        // SAFETY: the contract of `simd`.
        unsafe {
            let own = &*own;
            let ([lx, ly, lz], [ix, iy, iz], [xy, xz, yz]) = (metric.length, metric.inverse, metric.lean);
            let [xj, yj, zj, bits, uj, vj, wj, _] = I::wide_columns::<ALL>(records.cast(), places);
            let xi = I::F64::pick(own.position[0].as_ptr(), which);
            let yi = I::F64::pick(own.position[1].as_ptr(), which);
            let zi = I::F64::pick(own.position[2].as_ptr(), which);
            let (mut dx, mut dy, mut dz) = (xi - xj, yi - yj, (zi - zj) * metric.flat);
            let boxes = (dz * iz).round();
            dz = dz - boxes * lz;
            if metric.tilted {
                dx = dx - boxes * xz;
                dy = dy - boxes * yz;
            }
            let boxes = (dy * iy).round();
            dy = dy - boxes * ly;
            if metric.tilted {
                dx = dx - boxes * xy;
            }
            dx = dx - (dx * ix).round() * lx;
            let tiny = I::F64::constant(TINY);
            let r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).larger(tiny);
            let inverse = r2.inverse_root();
            let mut along = inverse;
            if moving {
                let ui = I::F64::pick(own.velocity[0].as_ptr(), which);
                let vi = I::F64::pick(own.velocity[1].as_ptr(), which);
                let wi = I::F64::pick(own.velocity[2].as_ptr(), which);
                let sum = (ui - uj).mul_add(dx, (vi - vj).mul_add(dy, (wi - wj) * dz));
                along = sum * inverse;
            }
            let [tag_j, species_j] = I::halves(bits);
            let tag_i = <I::F64 as Reals>::Words::pick(own.tag.as_ptr(), which);
            (
                Apart { d: [dx, dy, dz], r: r2 * inverse, inverse, along },
                Names { tags: [tag_i, tag_j], species_j },
            )
        }
    }

    #[inline(always)]
    unsafe fn columns_at<const ALL: bool>(rows: *const f64, places: *const u32) -> [I::F64; 8] {
        // SAFETY: the contract of `simd`.
        unsafe { I::wide_columns::<ALL>(rows.cast(), places) }
    }

    #[inline(always)]
    unsafe fn load_quad(p: *const f64) -> I::Quad {
        // SAFETY: the contract of `simd`.
        unsafe { <I::Quad as super::simd::Quad>::load(p) }
    }
}
