//! What a checkpoint costs: `cargo test --release --test films -- --ignored --nocapture checkpoint`.

use crate::output_support::provenance;
use crate::program::Bench;
use etendue::film::coverage::Rect;
use etendue::film::{Film, REPLICATES};
use etendue::output::store;
use std::time::Instant;

/// Prints the cost of the fastest of five checkpoints, with and without an unfinished block.
#[test]
#[ignore = "a measurement"]
fn checkpoint() {
    let bench = Bench::new();
    let path = bench.path("f.npz");
    for size in [[512, 384], [3840, 2160]] {
        for samples in [256, 300] {
            let whole = Rect::whole(size);
            let mut film = Film::new(size, whole, 2);
            film.put_block(whole, 0..256, |x, y| [[(x ^ y) as f32; 4]; REPLICATES]);
            if samples > 256 {
                film.put_block(whole, 256..samples, |x, y| {
                    [[(x + y) as f32; 4]; REPLICATES]
                });
            }
            let mut times = Vec::new();
            for _ in 0..5 {
                let began = Instant::now();
                let mut its = provenance(size);
                its.describe(&film);
                let described = began.elapsed();
                store::save(&path, &film, &its).expect("saved");
                times.push((began.elapsed(), described));
            }
            let (all, described) = times.iter().min().expect("five");
            let bytes = std::fs::metadata(&path).expect("a film").len();
            println!(
                "{} x {}, {samples} samples: {:.0} MB in {all:.2?}, {described:.2?} of it for the relative error",
                size[0],
                size[1],
                bytes as f64 / 1e6
            );
        }
    }
}
