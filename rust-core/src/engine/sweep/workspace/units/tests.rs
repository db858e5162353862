use super::*;
use psidpd_passes::domain::PeriodicBox;
use psidpd_passes::ground::box_geometry::BoxGeometry;
use psidpd_passes::ground::cell_grid::CellGrid;
use std::collections::BTreeSet;

/// A box with a cell of unit size for every column, and one particle in each: a column's number is that of its particle.
fn one_in_each_column(columns: usize, planes: usize, periodic: bool) -> CellOrder {
    let mut order = CellOrder::default();
    let lengths = [2.5, columns as f64, planes as f64].map(|l| l * 1.01);
    let domain = PeriodicBox::orthogonal([0.0; 3], lengths, [true, periodic, periodic]).unwrap();
    order.geometry = BoxGeometry::of_box(&domain, 3).unwrap();
    order.grid = CellGrid {
        cells_per_column: 1,
        ..CellGrid::new(&order.geometry, 1.0, 100 * columns * planes).unwrap()
    };
    assert_eq!((order.grid.columns_per_plane, order.grid.planes), (columns, planes));
    order.order = (0..(columns * planes) as u32).collect();
    order.start = (0..=(columns * (planes + periodic as usize)) as u32).collect();
    order
}

/// Particles of columns interact with the next column, and with three columns of the next plane.
#[test]
fn units_of_a_set_add_to_different_particles() {
    for (columns, periodic) in (2..24).flat_map(|columns| [(columns, true), (columns, false)]) {
        let planes = 3;
        let order = one_in_each_column(columns, planes, periodic);
        let neighbours = |plane: usize, column: usize| {
            let in_plane = move |plane: usize, across: i64| {
                let to = column as i64 + across;
                let inside = periodic || (0..columns as i64).contains(&to);
                inside.then(|| plane * columns + to.rem_euclid(columns as i64) as usize)
            };
            let own = [0, 1].map(|across| in_plane(plane, across));
            let ahead = [-1, 0, 1].map(|across| in_plane(plane + 1, across));
            let ahead = ahead.into_iter().filter(|_| periodic || plane + 1 < planes);
            own.into_iter().chain(ahead).flatten().collect::<Vec<_>>()
        };
        for plane in 0..planes {
            let units = order.units_of(plane, &(0..order.units())).map(|number| order.unit(number));
            let units: Vec<Unit> = units.collect();
            assert!(units.iter().flat_map(|unit| unit.columns.clone()).eq(0..columns));
            let mut sets = [BTreeSet::new(), BTreeSet::new()];
            for unit in &units {
                let expected: BTreeSet<usize> =
                    unit.columns.clone().flat_map(|column| neighbours(plane, column)).collect();
                let reached: Vec<usize> = order.reached(unit).into_iter().flatten().collect();
                assert_eq!(reached.iter().copied().collect::<BTreeSet<_>>(), expected);
                assert_eq!(reached.len(), expected.len(), "each particle once");
                for particle in reached {
                    assert!(sets[unit.set()].insert(particle), "{columns} columns: {particle} twice");
                }
            }
            for unit in &units {
                // The other set has the first column of a unit, and of the next plane the last one too.
                let [first, last] = order.seams(unit);
                for particle in order.particles_of_unit(unit) {
                    let in_other = |particle| sets[1 - unit.set()].contains(&particle);
                    assert_eq!(in_other(particle), first.contains(&particle));
                    let at_seam = first.contains(&particle) || last.contains(&particle);
                    let next = periodic || plane + 1 < planes;
                    assert_eq!(in_other(particle + columns), at_seam && next);
                }
            }
        }
    }
}

/// In a uniform box the work of a thread is proportional to its columns.
#[test]
fn units_feed_sixteen_threads_at_edge_20_and_sixty_four_at_edge_40() {
    println!("edge  threads  mean columns of a thread / most columns");
    let all = [1, 2, 4, 8, 16, 32, 64];
    for (edge, feeds, threads) in [(20, 16), (40, 64)].iter().flat_map(|(e, f)| all.map(|t| (*e, *f, t))) {
        let order = one_in_each_column(edge, edge, true);
        let slabs = order.thread_slabs(threads);
        assert_eq!(slabs.len(), threads);
        let particles: Vec<Range<usize>> = slabs.iter().map(|slab| order.particles_of_units(slab)).collect();
        assert!(particles.iter().cloned().flatten().eq(0..edge * edge), "each column has a thread");
        let most = particles.iter().map(Range::len).max().unwrap();
        let balance = (edge * edge) as f64 / (threads * most) as f64;
        println!("{edge:4}  {threads:7}  {balance:.2}");
        assert!(threads > feeds || balance >= 0.9, "edge {edge}, {threads} threads: {balance:.2}");
    }
}
