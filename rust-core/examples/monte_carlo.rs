//! Times trial moves of Monte Carlo: `cargo run --release -p psidpd-core --example monte_carlo 3098 8 0.15`.

use psidpd_core::engine::{LocalEnergy, Particles, PeriodicBox, noise};
use psidpd_core::model::Model;
use std::time::Instant;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<f64>().expect("a number"));
    let count = arguments.next().unwrap_or(3098.0) as usize;
    let edge = arguments.next().unwrap_or(8.0);
    let most = arguments.next().unwrap_or(0.15);
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/models/warren2003-set6.toml");
    let fluid = Model::open(&path).expect("a model").at(1.0).expect("a fluid");
    let domain = PeriodicBox::orthogonal([0.0; 3], [edge; 3], [true; 3]).expect("a box");
    let mut counter = 0u32;
    let mut uniform = || {
        counter = counter.wrapping_add(1);
        f64::from(noise::threefry2x32::<13>([counter, 0], [5, 9])[0]) / 4_294_967_296.0
    };
    let x: Vec<[f64; 3]> = (0..count).map(|_| [0; 3].map(|_| edge * uniform())).collect();
    let tag: Vec<i32> = (1..=count as i32).collect();
    let kind = vec![0; count];
    let mut local = LocalEnergy::new(&fluid).expect("an energy");
    local.load(&domain, &Particles { owned: count, x: &x, tag: &tag, kind: &kind }).expect("a state");
    for round in 0..10 {
        let (since, mut accepted) = (Instant::now(), 0);
        for _ in 0..20 {
            for k in 0..count {
                let x = local.positions()[k];
                let to = [0, 1, 2].map(|c: usize| x[c] + most * (2.0 * uniform() - 1.0));
                let change = local.change(k, to, 1).expect("an energy");
                if change <= 0.0 || uniform() < (-change).exp() {
                    local.accept(&mut [0; 3]);
                    accepted += 1;
                }
            }
        }
        let trials = 20.0 * count as f64;
        let each = 1e9 * since.elapsed().as_secs_f64() / trials;
        let since = Instant::now();
        let x = local.positions().to_vec();
        local.load(&domain, &Particles { owned: count, x: &x, tag: &tag, kind: &kind }).expect("a state");
        let load = 1e9 * since.elapsed().as_secs_f64() / count as f64;
        println!(
            "{round}: {each:.0} ns a trial, {:.3} accepted, load {load:.0} ns a particle",
            f64::from(accepted) / trials
        );
    }
}
