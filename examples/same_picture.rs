//! Asserts that two pictures show the same up to their noise, and that a third does not: no threshold to choose.

use etendue::{Error, Options, Picture, Scene};

fn picture(seed: u32, scene: &Scene) -> Result<Picture, Error> {
    let options = Options {
        size: Some([48, 36]),
        spp: Some(128),
        seed: Some(seed),
        ..Options::default()
    };
    etendue::render(scene, &options)
}

fn main() -> Result<(), Error> {
    let mut scene = Scene::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/diffuse.toml"))?;
    let reference = picture(1, &scene)?;
    let same = picture(2, &scene)?.compare(&reference)?;
    assert!(same.same(), "{}", same.report());

    // A light that is a tenth brighter is found out.
    scene.lights[0].radiance *= 1.1;
    let brighter = picture(3, &scene)?.compare(&reference)?;
    assert!(!brighter.same(), "{}", brighter.report());
    println!("{}", brighter.report());
    Ok(())
}
