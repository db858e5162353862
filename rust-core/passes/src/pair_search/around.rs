//! Finds the particles of one species around a point, within a range that may be many columns wide.
//!
//! Each column of cells is compared only where it is within the sphere. Distances are compared in single precision; the range includes the
//! largest rounding error, so that a few particles too many are found and never too few.

use crate::ground::box_geometry::BoxGeometry;
use crate::instruction_set::InstructionSet;
use crate::simd::{self, Isa, Kernel, Reals, Words};

/// Coordinates are in single precision: ranges grow by this fraction of themselves and of the box's extent.
const ROUNDING: f64 = 2e-6;

/// Readable places behind the last particle, for whole vectors.
pub const PADDING: usize = 16;

/// Particles sorted into columns of cells along x, in planes of columns.
#[derive(Debug, Clone, Copy)]
pub struct Columns<'a> {
    geometry: &'a BoxGeometry,
    /// Distances between opposite faces, widths of cells, and their inverses.
    heights: [f64; 3],
    width: [f64; 3],
    per_width: [f64; 3],
    extent: f64,
    is_tilted: bool,
    /// The axes along which columns and planes follow each other.
    axes: [usize; 2],
    count: [usize; 3],
    steps: [usize; 3],
    start: &'a [u32],
    x: [&'a [f32]; 3],
    species: &'a [u8],
    particles: usize,
}

impl<'a> Columns<'a> {
    /// Columns with so many cells along each axis of a box; `steps` are the differences of neighbouring cells' numbers. `start` has the
    /// first particle of each cell and the end of the last; `x` are positions relative to the origin of the box. Behind the last particle
    /// there are [`PADDING`] places.
    ///
    /// # Panics
    /// Panics if an array is too short.
    pub fn new(
        geometry: &'a BoxGeometry,
        [count, steps]: [[usize; 3]; 2],
        start: &'a [u32],
        x: [&'a [f32]; 3],
        species: &'a [u8],
    ) -> Columns<'a> {
        let cells = count.iter().product::<usize>();
        let particles = start[cells] as usize;
        assert!(
            x.iter().all(|x| x.len() >= particles + PADDING) && species.len() >= particles + PADDING,
            "room for whole vectors"
        );
        let axes = if geometry.dimensions == 3 { [1, 2] } else { [2, 1] };
        let heights = [0, 1, 2].map(|k| geometry.height(k));
        let width = [0, 1, 2].map(|k| heights[k] / count[k] as f64);
        let (per_width, extent, is_tilted) =
            (width.map(|w| 1.0 / w), geometry.extent(), geometry.is_tilted());
        let start = &start[..=cells];
        Columns {
            geometry,
            heights,
            width,
            per_width,
            extent,
            is_tilted,
            axes,
            count,
            steps,
            start,
            x,
            species,
            particles,
        }
    }

    /// Writes the numbers of the particles of a species within `range` of a point, from particle `first` on, to
    /// [`Around::found`]; a few may be a little further away, and in a box that is hardly twice as wide a number may be there twice.
    /// `s` are the fractions of the point in units of 2⁻³², `x` its position.
    pub fn find(
        &self,
        set: InstructionSet,
        (s, x): ([u32; 3], [f32; 3]),
        range: f64,
        (species, first): (u8, usize),
        around: &mut Around,
    ) {
        let reach = range + ROUNDING * (range + self.extent);
        // SAFETY: `Columns::new` has checked that vectors from any particle on can be read.
        unsafe { simd::run(set, Find { columns: self, s, x, reach, species, first, around }) };
    }

    /// Lists the columns or planes along an axis that are within a distance.
    #[inline(always)]
    fn lines(&self, axis: usize, s: u32, reach: f64, lines: &mut Vec<Line>) {
        lines.clear();
        if axis >= self.geometry.dimensions {
            return lines.push(Line { cell: 0, square: 0.0, shift: [0.0; 3] });
        }
        let (count, width, per_width) = (self.count[axis] as i32, self.width[axis], self.per_width[axis]);
        let place = f64::from(s) * (self.heights[axis] / TWO_TO_32);
        let (low, high) =
            (((place - reach) * per_width).floor() as i32, ((place + reach) * per_width).floor() as i32);
        let (low, high) = match self.geometry.periodic[axis] {
            true => (low.max(-count), high.min(2 * count - 1)),
            false => (low.max(0), high.min(count - 1)),
        };
        let edge = self.geometry.edge(axis);
        for k in low..=high {
            let from = f64::from(k) * width;
            let distance = (from - place).max(place - from - width).max(0.0);
            // In a tilted box distances along two axes are not those of a right angle.
            let square = if self.is_tilted { 0.0 } else { (distance * distance) as f32 };
            let turn = i32::from(k >= count) - i32::from(k < 0);
            let cell = (k - turn * count) as usize * self.steps[axis];
            let turn = f64::from(turn);
            lines.push(Line { cell, square, shift: [turn * edge[0], turn * edge[1], turn * edge[2]] });
        }
    }
}

const TWO_TO_32: f64 = 4_294_967_296.0;

/// The particles that were found, and scratch arrays.
#[derive(Debug, Default)]
pub struct Around {
    pub found: Vec<u32>,
    columns: Vec<Line>,
    planes: Vec<Line>,
}

/// A column or plane, perhaps in a neighbouring period.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Its part in the numbers of cells.
    cell: usize,
    /// The square of its distance.
    square: f32,
    /// The shift of the period.
    shift: [f64; 3],
}

struct Find<'a> {
    columns: &'a Columns<'a>,
    s: [u32; 3],
    x: [f32; 3],
    reach: f64,
    species: u8,
    first: usize,
    around: &'a mut Around,
}

impl Kernel for Find<'_> {
    type Out = ();

    #[inline(always)]
    unsafe fn run<I: Isa>(self) {
        let Find { columns, s, x, reach, species, first, around } = self;
        let Around { found, columns: across, planes } = around;
        found.clear();
        columns.lines(columns.axes[0], s[columns.axes[0]], reach, across);
        columns.lines(columns.axes[1], s[columns.axes[1]], reach, planes);
        let Columns { geometry, count, start, .. } = *columns;
        let is_periodic = geometry.periodic[0];
        let count = count[0];
        let cells = count as f32;
        // In cells along x.
        let middle = (f64::from(s[0]) * (count as f64 / TWO_TO_32)) as f32;
        let per_length = columns.per_width[0] as f32;
        let square = (reach * reach) as f32;
        let edge = geometry.length[0];
        let mut compare = Compare { columns, species: u32::from(species), limit: square, first };
        let mut p = 0;
        while p < planes.len() {
            let plane = planes[p];
            let left = square - plane.square;
            let mut c = 0;
            while c < across.len() {
                let column = across[c];
                c += 1;
                let left = left - column.square;
                if left <= 0.0 {
                    continue;
                }
                let half = left.sqrt() * per_length;
                let (low, end) = (middle - half, middle + half + 1.0);
                let cell = plane.cell + column.cell;
                let mut point = [0.0; 3];
                let mut k = 0;
                while k < 3 {
                    point[k] = f64::from(x[k]) - plane.shift[k] - column.shift[k];
                    k += 1;
                }
                // SAFETY: the caller fulfils the contract of `simd`, `start` is sorted, and its ends are checked.
                unsafe {
                    let of_cells = &start[cell..=cell + count];
                    let from = of_cells[low.max(0.0) as i32 as usize];
                    let to = of_cells[(end as i32 as usize).min(count)];
                    compare.run::<I>(point, [from, to], found);
                    if is_periodic && low < 0.0 {
                        let from = of_cells[(low + cells).max(0.0) as i32 as usize];
                        let beside = [point[0] + edge, point[1], point[2]];
                        compare.run::<I>(beside, [from, of_cells[count]], found);
                    }
                    if is_periodic && end > cells {
                        let to = of_cells[((end - cells) as i32 as usize).min(count)];
                        let beside = [point[0] - edge, point[1], point[2]];
                        compare.run::<I>(beside, [of_cells[0], to], found);
                    }
                }
            }
            p += 1;
        }
    }
}

struct Compare<'a> {
    columns: &'a Columns<'a>,
    species: u32,
    limit: f32,
    first: usize,
}

impl Compare<'_> {
    /// Appends the particles of a range that are near a point.
    ///
    /// # Safety
    /// The caller fulfils the contract of `simd`.
    #[inline(always)]
    unsafe fn run<I: Isa>(&mut self, point: [f64; 3], [from, to]: [u32; 2], found: &mut Vec<u32>) {
        let Compare { columns: Columns { x, species, particles, .. }, .. } = *self;
        let (mut k, to) = ((from as usize).max(self.first), (to as usize).min(*particles));
        if k >= to {
            return;
        }
        found.reserve(to - k + PADDING);
        let mut count = found.len();
        // SAFETY: vectors from particles below `particles` on can be read; room has been reserved for all of them and a
        // vector, and `count` numbers are written.
        unsafe {
            let at = [
                I::F32::splat(point[0] as f32),
                I::F32::splat(point[1] as f32),
                I::F32::splat(point[2] as f32),
            ];
            let (limit, kind) = (I::F32::splat(self.limit), <I::F32 as Reals>::Words::splat(self.species));
            let lanes = <I::F32 as Reals>::Words::load(LANES.as_ptr());
            let out = found.as_mut_ptr();
            while k < to {
                let dx = at[0] - I::F32::load(x[0].as_ptr().add(k));
                let dy = at[1] - I::F32::load(x[1].as_ptr().add(k));
                let dz = at[2] - I::F32::load(x[2].as_ptr().add(k));
                let square = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
                let alike = <I::F32 as Reals>::Words::load_bytes(species.as_ptr().add(k)).mask_equal(kind);
                let inside = u32::MAX >> (32 - (to - k).min(I::F32::LANES));
                let near = square.mask_below(limit) & alike & inside;
                let numbers = lanes.add(<I::F32 as Reals>::Words::splat(k as u32));
                I::of_bits(numbers).compress(near).store(out.add(count).cast());
                count += near.count_ones() as usize;
                k += I::F32::LANES;
            }
            found.set_len(count);
        }
    }
}

static LANES: [u32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Whether two particles within a range may be near two images of each other as far as single precision tells.
pub fn may_meet_twice(geometry: &BoxGeometry, range: f64) -> bool {
    let reach = range + ROUNDING * (range + geometry.extent());
    (0..geometry.dimensions).any(|k| geometry.periodic[k] && geometry.height(k) < 2.0 * reach)
}
