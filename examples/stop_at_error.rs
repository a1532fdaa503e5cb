//! Renders until the picture's error is small enough, for ten seconds at most, and tells how far it has come.

use etendue::{Error, Options, Scene, StopReason};
use std::ops::ControlFlow;
use std::time::Duration;

fn main() -> Result<(), Error> {
    let scene = Scene::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/diffuse.toml"))?;
    let options = Options {
        size: Some([64, 48]),
        error: Some(0.10),
        time: Some(Duration::from_secs(10)),
        ..Options::default()
    };
    let picture = etendue::render_with(&scene, &options, |progress| {
        println!("{:.0} samples a pixel", progress.samples());
        // `ControlFlow::Break(())` would end it here.
        ControlFlow::Continue(())
    })?;

    match picture.ended() {
        Some(StopReason::Error) => println!("reached the error"),
        reason => println!("ended early: {reason:?}"),
    }
    // Each pixel has an error of its own; this is the largest, as a radiance.
    let errors = picture.errors().iter().flatten();
    println!("largest error {:.3}", errors.fold(0.0, |a, e| e.max(a)));
    Ok(())
}
