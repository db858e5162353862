use super::cell_order::TWO_TO_32;
use super::input::VECTOR_PADDING;
use super::*;
use crate::engine::particles::Particles;
use crate::engine::plan::Plan;
use crate::model::Model;
use nalgebra::Matrix3;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::arithmetic::{Double, Mixed};
use psidpd_passes::noise::threefry2x32;
use psidpd_passes::settings::Instructions;
use psidpd_threads::part;
use std::num::NonZeroUsize;

fn portable() -> InstructionSet {
    InstructionSet::new(Instructions::Portable).unwrap()
}

/// This number is no multiple of a block or of a vector.
const COUNT: usize = 32 * 30 + 21;

fn uniform(k: usize) -> f64 {
    f64::from(threefry2x32::<20>([k as u32, 1], [2, 3])[0]) / TWO_TO_32
}

/// Points in and around a box, some on its edges, with types of which the first is left out.
struct Points {
    x: Vec<[f64; 3]>,
    tag: Vec<i32>,
    kind: Vec<i32>,
}

impl Points {
    fn new(domain: &PeriodicBox, room: f64) -> Points {
        let part = |k: usize, c: usize| match k % 50 {
            0 => 0.0,
            1 => 1.0,
            _ => uniform(3 * k + c) * (1.0 + 2.0 * room) - room,
        };
        Points {
            x: (0..COUNT).map(|k| domain.point([part(k, 0), part(k, 1), part(k, 2)])).collect(),
            tag: (1..=COUNT as i32).collect(),
            // No particle of the first blocks is left out.
            kind: (0..COUNT).map(|k| i32::from(k < 500 || k % 5 != 0)).collect(),
        }
    }

    fn input(&self, owned: usize) -> Input<'_> {
        let particles = Particles { owned, x: &self.x, tag: &self.tag, kind: &self.kind };
        Input {
            particles,
            images: &[],
            v: &[],
            species_of_type: &[-1, 0],
            added_densities: &[],
            exclusions: None,
            thermostat: None,
            totals: false,
        }
    }
}

fn workspace<P: PairPrecision>(dimensions: usize, set: InstructionSet, threads: usize) -> Workspace<P> {
    let model = Model::open(
        &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models/warren2003-set6.toml"),
    );
    let mut fluid = model.unwrap().at(1.0).unwrap();
    fluid.dimensions = dimensions;
    Workspace::new(&Plan::new(&fluid).unwrap(), set, threads)
}

/// Box geometries, each with points that reach beyond it by fractions of the edges, and the number of owned points.
fn geometries() -> Vec<(BoxGeometry, Points, usize)> {
    let straight = Matrix3::from_diagonal(&[9.0, 7.0, 8.0].into());
    let leaning = Matrix3::new(9.0, 1.5, -2.0, 0.0, 7.0, 0.7, 0.0, 0.0, 8.0);
    let mut geometries = Vec::new();
    for (edges, periodic) in [
        (straight, [true; 3]),
        (straight, [true, false, true]),
        (straight, [false, true, false]),
        (leaning, [true; 3]),
    ] {
        for dimensions in [3, 2] {
            let domain = PeriodicBox::new([0.5, -3.0, 2.0], edges, periodic).unwrap();
            let mut geometry = BoxGeometry::of_box(&domain, dimensions).unwrap();
            let points = Points::new(&domain, if periodic == [true; 3] { 0.6 } else { 0.0 });
            geometry.periodic[2] &= dimensions == 3;
            geometries.push((geometry, points, COUNT));
        }
    }
    // Some of the ghosts are out of reach.
    let domain = PeriodicBox::new([0.0; 3], straight, [true; 3]).unwrap();
    let geometry = BoxGeometry::enclosing([-1.0; 3], [10.0, 8.0, 9.0], 3, 1.0);
    let mut points = Points::new(&domain, 0.3);
    points.x[..600].copy_from_slice(&Points::new(&domain, 0.0).x[..600]);
    geometries.push((geometry, points, 600));
    geometries
}

/// The cell of a point, or of a ghost there.
fn cell_of(geometry: &BoxGeometry, grid: &CellGrid, x: &[f64; 3], is_ghost: bool) -> usize {
    let s = geometry.fraction(x, &geometry.length.map(|l| 1.0 / l));
    let mut units = [0u64; 3];
    for c in 0..geometry.dimensions {
        let fixed32 = (s[c] * TWO_TO_32).round_ties_even();
        let end = TWO_TO_32 - 1.0;
        units[c] =
            if geometry.periodic[c] { fixed32.rem_euclid(TWO_TO_32) } else { fixed32.clamp(0.0, end) } as u64;
    }
    let part = |axis: usize, of: usize| (units[axis] as usize * of) >> 32;
    let planes = part(grid.plane_axis, grid.planes) * grid.layers + usize::from(is_ghost);
    let column = planes * grid.columns_per_plane + part(grid.column_axis, grid.columns_per_plane);
    column * grid.cells_per_column + part(0, grid.cells_per_column)
}

fn sorted<P: PairPrecision>(
    geometry: &BoxGeometry,
    points: &Points,
    owned: usize,
    set: InstructionSet,
    threads: usize,
) -> Workspace<P> {
    let mut workspace = workspace(geometry.dimensions, set, threads);
    let grid = CellGrid::new(geometry, 1.0, COUNT).unwrap();
    let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
    workspace.sort(&pool, *geometry, grid, &points.input(owned)).unwrap();
    workspace
}

/// Checks that all particles that are not left out occur once, in the cell of their position, with the right coordinates.
fn is_sorted<P: PairPrecision>(workspace: &Workspace<P>, points: &Points, owned: usize) {
    let (geometry, grid, n) = (&workspace.order.geometry, &workspace.order.grid, workspace.order.particles());
    // Ghosts are inside along all open directions.
    let is_inside = |x: &[f64; 3]| {
        let ends = |c: usize| 0.0..=geometry.length[c];
        (0..geometry.dimensions)
            .all(|c| geometry.periodic[c] || ends(c).contains(&(x[c] - geometry.origin[c])))
    };
    let takes_part = |k: &usize| points.kind[*k] == 1 && (*k < owned || is_inside(&points.x[*k]));
    let expected: Vec<usize> = (0..COUNT).filter(takes_part).collect();
    assert!(expected.len() > 500 && expected.len() < COUNT);
    let mut found: Vec<usize> = workspace.order.order.iter().map(|k| *k as usize).collect();
    for cell in 0..grid.cell_count() {
        let of_cell = &found[workspace.order.start[cell] as usize..workspace.order.start[cell + 1] as usize];
        assert!(of_cell.is_sorted(), "within a bin the order is that of the host");
        assert!(of_cell.iter().all(|k| cell_of(geometry, grid, &points.x[*k], *k >= owned) == cell));
    }
    let longest = geometry.length.iter().fold(0.0, |a: f64, b| a.max(*b));
    let inverse = geometry.length.map(|l| 1.0 / l);
    for (s, k) in found.iter().enumerate() {
        let mut fraction = geometry.fraction(&points.x[*k], &inverse);
        for c in 0..3 {
            let enclosing = if geometry.periodic[c] { fraction[c].floor() } else { 0.0 };
            fraction[c] -= enclosing;
        }
        let point = geometry.point(&fraction);
        for c in 0..geometry.dimensions {
            let off = f64::from(workspace.particles.x[c][s]) - point[c];
            // The point may be in the next period, if it is on the edge between both.
            let off = if off.abs() > 1.0 { continue } else { off };
            assert!(off.abs() < 2.5e-7 * longest, "{off}");
            let word = (point[c] * workspace.particles.fixed16_scale.per_length).floor() as i64 as u16;
            assert!((workspace.particles.fixed16[c][s].wrapping_sub(word) as i16).abs() <= 1);
        }
    }
    found.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!(n, expected.len());
}

impl<P: PairPrecision> Workspace<P> {
    /// Sorts the particles, and fills all arrays at once.
    fn sort(
        &mut self,
        pool: &Pool,
        geometry: BoxGeometry,
        grid: CellGrid,
        input: &Input,
    ) -> Result<(), EngineError> {
        self.sort_into_cells(pool, geometry, grid, input)?;
        let (count, particles) = (self.order.particles(), self.particles.share());
        pool.run(&|t| {
            let some = part(count.div_ceil(VECTOR_PADDING), t, pool.threads());
            let places = VECTOR_PADDING * some.start..count.min(VECTOR_PADDING * some.end);
            // SAFETY: `whole_vectors` gives each place to one thread alone.
            unsafe { particles.fill(self.fluid.set, &self.order, input, places) };
        });
        self.particles.copy_first_plane(&self.order);
        Ok(())
    }
}

fn is_the_same<P: PairPrecision>(a: &Workspace<P>, b: &Workspace<P>) {
    let total = a.particles.packed.len();
    assert!(a.order.order == b.order.order && a.order.start == b.order.start);
    for c in 0..3 {
        assert!(
            a.particles.x[c][..total] == b.particles.x[c][..total]
                && a.particles.fixed16[c][..total] == b.particles.fixed16[c][..total]
        );
    }
}

fn all_ways<P: PairPrecision>() {
    let sets = Instructions::ALL.into_iter().filter_map(|(_, set)| InstructionSet::new(set));
    for set in sets {
        for (geometry, points, owned) in geometries() {
            let one = sorted::<P>(&geometry, &points, owned, set, 1);
            is_sorted(&one, &points, owned);
            is_the_same(&one, &sorted(&geometry, &points, owned, portable(), 1));
            for threads in [2, 5] {
                is_the_same(&one, &sorted(&geometry, &points, owned, set, threads));
            }
        }
    }
}

#[test]
fn particles_are_in_their_bins() {
    all_ways::<Mixed>();
    all_ways::<Double>();
}

#[test]
fn trouble_is_found_in_blocks_and_behind_them() {
    let (geometry, mut points, _) = geometries().swap_remove(0);
    let grid = CellGrid::new(&geometry, 1.0, COUNT).unwrap();
    let pool = Pool::new(NonZeroUsize::MIN);
    for set in [portable(), InstructionSet::best()] {
        let mut workspace = workspace::<Mixed>(3, set, 1);
        for k in [0, 70, COUNT - 1] {
            let tag = points.tag[k];
            let expect = |workspace: &mut Workspace<Mixed>, points: &Points, fault| {
                let found = workspace.sort(&pool, geometry, grid, &points.input(COUNT));
                assert_eq!(found, Err(fault), "{k}");
            };
            let kind = std::mem::replace(&mut points.kind[k], 2);
            expect(&mut workspace, &points, EngineError::Kind { tag, kind: 2 });
            points.kind[k] = -1;
            expect(&mut workspace, &points, EngineError::Kind { tag, kind: -1 });
            points.kind[k] = 1;
            points.tag[k] = 0;
            expect(&mut workspace, &points, EngineError::Tag { tag: 0 });
            points.tag[k] = tag;
            let x = points.x[k];
            for bad in [f64::NAN, f64::INFINITY, 1e17] {
                points.x[k][1] = bad;
                expect(&mut workspace, &points, EngineError::Position { tag });
                if bad != 1e17 {
                    let extremes = extremes(&pool, set, &points.input(COUNT));
                    assert_eq!(extremes, Err(EngineError::Position { tag }));
                }
            }
            // Particles that are left out may be anywhere.
            points.kind[k] = 0;
            assert_eq!(workspace.sort(&pool, geometry, grid, &points.input(COUNT)), Ok(()));
            assert!(extremes(&pool, set, &points.input(COUNT)).is_ok());
            (points.x[k], points.kind[k]) = (x, kind);
        }
    }
}

#[test]
fn extremes_are_those_of_all() {
    let (_, points, _) = geometries().swap_remove(0);
    let lowest = |c: usize| points.x.iter().fold(f64::INFINITY, |a, x| a.min(x[c]));
    let highest = |c: usize| points.x.iter().fold(f64::NEG_INFINITY, |a, x| a.max(x[c]));
    for threads in [1, 3] {
        let pool = Pool::new(NonZeroUsize::new(threads).unwrap());
        let found = extremes(&pool, InstructionSet::best(), &points.input(COUNT));
        assert_eq!(found, Ok([[0, 1, 2].map(lowest), [0, 1, 2].map(highest)]));
    }
}
