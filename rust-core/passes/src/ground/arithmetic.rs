//! Mixed and double precision: the packed particle, and the geometry of pairs computed from it.

use super::box_geometry::BoxGeometry;
use super::species_pairs::SpeciesPair;
use crate::simd::{Isa, OFFSET_BITS, Reals, Scalar, Words};
use psidpd_model::kernel::Real;

/// The i-particles of a batch, field by field. Pairs pick fields of their i-particle from a vector register.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct IParticles<T> {
    /// Positions in the coordinates of the packed particle.
    pub position: [[T; 16]; 3],
    pub velocity: [[T; 16]; 3],
    pub tag: [u32; 16],
    pub species: [u32; 16],
}

/// Separations and distances of a vector of pairs.
#[derive(Clone, Copy)]
pub struct PairGeometry<R: Reals> {
    /// Separation `r_i − r_j`.
    pub d: [R; 3],
    pub r: R,
    pub inverse: R,
    /// Radial velocity `ê·v_ij`, if the thermostat acts.
    pub radial_velocity: R,
}

/// The input of the terms, for a vector of pairs.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct PairVector<R: Reals> {
    pub geometry: PairGeometry<R>,
    /// Set only with several species.
    pub species_pair: SpeciesPair<R>,
}

/// Tags of both particles, and the species of the j-particle.
#[derive(Clone, Copy)]
pub struct PairTags<R: Reals> {
    pub tags: [R::Words; 2],
    pub species_j: R::Words,
}

const _: () = assert!(
    size_of::<MixedParticle>() == 1 << OFFSET_BITS && size_of::<DoubleParticle>() == 2 << OFFSET_BITS
);

/// A precision of pairs on an instruction set. Callers of its functions fulfil the contract of `simd`.
#[allow(clippy::missing_safety_doc)]
pub trait Arithmetic<I: Isa>: 'static {
    type Scalar: Scalar;
    type Reals: Reals<Scalar = Self::Scalar>;
    type PackedParticle: PackedParticle<Scalar = Self::Scalar>;
    type Metric: Copy;

    unsafe fn metric(geometry: &BoxGeometry) -> Self::Metric;

    /// Loads one vector of particles, beginning with `first`.
    unsafe fn load_i_particles(
        first: *const Self::PackedParticle,
        i_particles: &mut IParticles<Self::Scalar>,
    );

    /// The geometry of a vector of pairs of `i_particles[i_in_batch]` with the particles at
    /// `j_offsets`. With `ALL` it loads velocities and species of j-particles; with `with_velocities`
    /// it computes radial velocities.
    unsafe fn pair_geometry<const ALL: bool>(
        metric: &Self::Metric,
        packed: *const Self::PackedParticle,
        i_particles: *const IParticles<Self::Scalar>,
        i_in_batch: <Self::Reals as Reals>::Words,
        j_offsets: *const u32,
        with_velocities: bool,
    ) -> (PairGeometry<Self::Reals>, PairTags<Self::Reals>);

    /// Loads records of eight numbers at `j_offsets`: the first number of each, then the second …
    /// Without `ALL` it loads only the first four numbers.
    unsafe fn load_transposed<const ALL: bool>(
        records: *const Self::Scalar,
        j_offsets: *const u32,
    ) -> [Self::Reals; 8];

    /// Loads `count` consecutive records, at least one. Lanes beyond `count` repeat the last record.
    #[inline(always)]
    unsafe fn load_transposed_in_order(records: *const Self::Scalar, count: usize) -> [Self::Reals; 8] {
        type W<I, A> = <<A as Arithmetic<I>>::Reals as Reals>::Words;
        let mut offsets = [0; 16];
        // SAFETY: `IN_ORDER` and `offsets` are as long as a vector, and all offsets are among the `count` records
        // that the caller promises. Records behind these may belong to another thread, which may be writing them.
        unsafe {
            let last = W::<I, Self>::splat(((count - 1) << OFFSET_BITS) as u32);
            W::<I, Self>::load(IN_ORDER.as_ptr()).min(last).store(offsets.as_mut_ptr());
            Self::load_transposed::<true>(records, offsets.as_ptr())
        }
    }

    /// Loads four numbers, widened to double precision.
    unsafe fn load_quad(p: *const Self::Scalar) -> I::Quad;
}

/// The fields of a particle that pairs read, in one or two cache lines.
pub trait PackedParticle: Copy + Default + Send + Sync + 'static {
    type Scalar;
    /// Packs a particle; `u` is its position in 32-bit fixed point.
    fn new(u: [u32; 3], x: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> Self;
}

/// Position in 32-bit fixed point, in units of 2⁻³² of the box: differences wrap.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub struct MixedParticle {
    u: [u32; 3],
    tag: u32,
    v: [f32; 3],
    species: u32,
}

impl PackedParticle for MixedParticle {
    type Scalar = f32;
    #[inline(always)]
    fn new(u: [u32; 3], _: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> MixedParticle {
        MixedParticle { u, tag, v: [v[0] as f32, v[1] as f32, v[2] as f32], species }
    }
}

/// A particle in double precision.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub struct DoubleParticle {
    x: [f64; 3],
    tag: u32,
    species: u32,
    v: [f64; 3],
    rest: f64,
}

impl PackedParticle for DoubleParticle {
    type Scalar = f64;
    #[inline(always)]
    fn new(_: [u32; 3], x: &[f64; 3], v: &[f64; 3], tag: u32, species: u32) -> DoubleParticle {
        DoubleParticle { x: *x, tag, species, v: *v, rest: 0.0 }
    }
}

/// Pairs in single precision.
pub struct Mixed;

/// Pairs in double precision.
pub struct Double;

/// Lower bound of `r²`: for two particles at one point `1/r` is finite and `d/r` zero.
const TINY: f64 = 1e-30;

/// Offsets of consecutive records.
const IN_ORDER: [u32; 16] = [0, 32, 64, 96, 128, 160, 192, 224, 256, 288, 320, 352, 384, 416, 448, 480];

const TWO_TO_32: f64 = 4_294_967_296.0;

/// Lengths and tilt of the box over 2³².
#[derive(Clone, Copy)]
pub struct MixedMetric<R> {
    scale: [R; 3],
    tilt: [R; 3],
    tilted: bool,
}

impl<I: Isa> Arithmetic<I> for Mixed {
    type Scalar = f32;
    type Reals = I::F32;
    type PackedParticle = MixedParticle;
    type Metric = MixedMetric<I::F32>;

    #[inline(always)]
    unsafe fn metric(geometry: &BoxGeometry) -> Self::Metric {
        let per_unit = |l: f64| I::F32::constant(l / TWO_TO_32);
        let ([a, b, c], [d, e, f]) = (geometry.length, geometry.tilt);
        MixedMetric {
            scale: [per_unit(a), per_unit(b), per_unit(c)],
            tilt: [per_unit(d), per_unit(e), per_unit(f)],
            tilted: geometry.is_tilted(),
        }
    }

    #[inline(always)]
    unsafe fn load_i_particles(first: *const MixedParticle, i_particles: &mut IParticles<f32>) {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe {
            let [x, y, z, tag, u, v, w, species] =
                I::load_transposed::<true>(first.cast(), IN_ORDER.as_ptr());
            x.store(i_particles.position[0].as_mut_ptr().cast());
            y.store(i_particles.position[1].as_mut_ptr().cast());
            z.store(i_particles.position[2].as_mut_ptr().cast());
            tag.store(i_particles.tag.as_mut_ptr());
            u.store(i_particles.velocity[0].as_mut_ptr().cast());
            v.store(i_particles.velocity[1].as_mut_ptr().cast());
            w.store(i_particles.velocity[2].as_mut_ptr().cast());
            species.store(i_particles.species.as_mut_ptr());
        }
    }

    #[inline(always)]
    unsafe fn pair_geometry<const ALL: bool>(
        metric: &Self::Metric,
        packed: *const MixedParticle,
        i_particles: *const IParticles<f32>,
        i_in_batch: <I::F32 as Reals>::Words,
        j_offsets: *const u32,
        with_velocities: bool,
    ) -> (PairGeometry<I::F32>, PairTags<I::F32>) {
        type W<I> = <<I as Isa>::F32 as Reals>::Words;
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe {
            let i_particles = &*i_particles;
            let [sx, sy, sz] = metric.scale;
            let [xj, yj, zj, tag_j, uj, vj, wj, species_j] =
                I::load_transposed::<ALL>(packed.cast(), j_offsets);
            let xi = W::<I>::pick(i_particles.position[0].as_ptr().cast(), i_in_batch);
            let yi = W::<I>::pick(i_particles.position[1].as_ptr().cast(), i_in_batch);
            let zi = W::<I>::pick(i_particles.position[2].as_ptr().cast(), i_in_batch);
            let a = I::F32::of_signed(xi.sub(xj));
            let b = I::F32::of_signed(yi.sub(yj));
            let c = I::F32::of_signed(zi.sub(zj));
            let (mut dx, mut dy, dz) = (a * sx, b * sy, c * sz);
            if metric.tilted {
                let [xy, xz, yz] = metric.tilt;
                dx = b.mul_add(xy, c.mul_add(xz, dx));
                dy = c.mul_add(yz, dy);
            }
            let tiny = I::F32::constant(TINY);
            let r2 = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).larger(tiny);
            let inverse = r2.inverse_root();
            let mut radial_velocity = inverse;
            if with_velocities {
                let ui = I::F32::pick(i_particles.velocity[0].as_ptr(), i_in_batch);
                let vi = I::F32::pick(i_particles.velocity[1].as_ptr(), i_in_batch);
                let wi = I::F32::pick(i_particles.velocity[2].as_ptr(), i_in_batch);
                let (u, v, w) = (ui - I::of_bits(uj), vi - I::of_bits(vj), wi - I::of_bits(wj));
                let sum = u.mul_add(dx, v.mul_add(dy, w * dz));
                radial_velocity = sum * inverse;
            }
            let tag_i = W::<I>::pick(i_particles.tag.as_ptr(), i_in_batch);
            (
                PairGeometry { d: [dx, dy, dz], r: r2 * inverse, inverse, radial_velocity },
                PairTags { tags: [tag_i, tag_j], species_j },
            )
        }
    }

    #[inline(always)]
    unsafe fn load_transposed<const ALL: bool>(records: *const f32, j_offsets: *const u32) -> [I::F32; 8] {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe {
            let bits = I::load_transposed::<ALL>(records.cast(), j_offsets);
            let mut numbers = [I::F32::constant(0.0); 8];
            let mut c = 0;
            while c < if ALL { 8 } else { 4 } {
                numbers[c] = I::of_bits(bits[c]);
                c += 1;
            }
            numbers
        }
    }

    #[inline(always)]
    unsafe fn load_quad(p: *const f32) -> I::Quad {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe { <I::Quad as crate::simd::Quad>::load_f32(p) }
    }
}

/// Lengths, inverse lengths (zero along open directions) and tilt of the box.
#[derive(Clone, Copy)]
pub struct DoubleMetric<R> {
    length: [R; 3],
    inverse: [R; 3],
    tilt: [R; 3],
    tilted: bool,
    /// Factor of z: 0 in two dimensions, else 1.
    flat: R,
}

impl<I: Isa> Arithmetic<I> for Double {
    type Scalar = f64;
    type Reals = I::F64;
    type PackedParticle = DoubleParticle;
    type Metric = DoubleMetric<I::F64>;

    #[inline(always)]
    unsafe fn metric(geometry: &BoxGeometry) -> Self::Metric {
        let inverse =
            |k: usize| I::F64::constant(if geometry.periodic[k] { 1.0 / geometry.length[k] } else { 0.0 });
        let constant = |x: f64| I::F64::constant(x);
        let ([a, b, c], [d, e, f]) = (geometry.length, geometry.tilt);
        DoubleMetric {
            length: [constant(a), constant(b), constant(c)],
            inverse: [inverse(0), inverse(1), inverse(2)],
            tilt: [constant(d), constant(e), constant(f)],
            tilted: geometry.is_tilted(),
            flat: constant(if geometry.dimensions == 3 { 1.0 } else { 0.0 }),
        }
    }

    #[inline(always)]
    unsafe fn load_i_particles(first: *const DoubleParticle, i_particles: &mut IParticles<f64>) {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe {
            let [x, y, z, bits, u, v, w, _] =
                I::load_transposed_wide::<true>(first.cast(), IN_ORDER.as_ptr());
            x.store(i_particles.position[0].as_mut_ptr());
            y.store(i_particles.position[1].as_mut_ptr());
            z.store(i_particles.position[2].as_mut_ptr());
            let [tag, species] = I::halves(bits);
            tag.store(i_particles.tag.as_mut_ptr());
            species.store(i_particles.species.as_mut_ptr());
            u.store(i_particles.velocity[0].as_mut_ptr());
            v.store(i_particles.velocity[1].as_mut_ptr());
            w.store(i_particles.velocity[2].as_mut_ptr());
        }
    }

    #[inline(always)]
    unsafe fn pair_geometry<const ALL: bool>(
        metric: &Self::Metric,
        packed: *const DoubleParticle,
        i_particles: *const IParticles<f64>,
        i_in_batch: <I::F64 as Reals>::Words,
        j_offsets: *const u32,
        with_velocities: bool,
    ) -> (PairGeometry<I::F64>, PairTags<I::F64>) {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe {
            let i_particles = &*i_particles;
            let ([lx, ly, lz], [ix, iy, iz], [xy, xz, yz]) = (metric.length, metric.inverse, metric.tilt);
            let [xj, yj, zj, bits, uj, vj, wj, _] = I::load_transposed_wide::<ALL>(packed.cast(), j_offsets);
            let xi = I::F64::pick(i_particles.position[0].as_ptr(), i_in_batch);
            let yi = I::F64::pick(i_particles.position[1].as_ptr(), i_in_batch);
            let zi = I::F64::pick(i_particles.position[2].as_ptr(), i_in_batch);
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
            let mut radial_velocity = inverse;
            if with_velocities {
                let ui = I::F64::pick(i_particles.velocity[0].as_ptr(), i_in_batch);
                let vi = I::F64::pick(i_particles.velocity[1].as_ptr(), i_in_batch);
                let wi = I::F64::pick(i_particles.velocity[2].as_ptr(), i_in_batch);
                let sum = (ui - uj).mul_add(dx, (vi - vj).mul_add(dy, (wi - wj) * dz));
                radial_velocity = sum * inverse;
            }
            let [tag_j, species_j] = I::halves(bits);
            let tag_i = <I::F64 as Reals>::Words::pick(i_particles.tag.as_ptr(), i_in_batch);
            (
                PairGeometry { d: [dx, dy, dz], r: r2 * inverse, inverse, radial_velocity },
                PairTags { tags: [tag_i, tag_j], species_j },
            )
        }
    }

    #[inline(always)]
    unsafe fn load_transposed<const ALL: bool>(records: *const f64, j_offsets: *const u32) -> [I::F64; 8] {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe { I::load_transposed_wide::<ALL>(records.cast(), j_offsets) }
    }

    #[inline(always)]
    unsafe fn load_quad(p: *const f64) -> I::Quad {
        // SAFETY: `SortedParticles::make_room` pads packed particles and `SearchBuffers` pads
        // lists of pairs to whole vectors.
        unsafe { <I::Quad as crate::simd::Quad>::load(p) }
    }
}
