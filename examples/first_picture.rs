//! A scene built in code, its picture, and how wrong the picture still is.

use etendue::{Error, Options, Scene};

fn main() -> Result<(), Error> {
    let scene = Scene::builder()
        .title("A glass ball on the floor")
        .camera([0.0, 1.5, 5.0], [0.0, 0.7, 0.0], 35.0, [96, 72])
        .diffuse("floor", [0.7, 0.6, 0.5])
        .dielectric("glass", 1.52)
        .plane([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], "floor")
        .sphere([0.0, 0.7, 0.0], 0.7, "glass")
        .light([1.0, 4.0, 1.0], [-0.2, -1.0, -0.2], 0.8, [12.0; 3])
        .build()?;
    let options = Options {
        spp: Some(64),
        ..Options::default()
    };
    let picture = etendue::render(&scene, &options)?;

    let path = std::env::temp_dir().join("first_picture.png");
    picture.save(&path)?;
    let device = &picture.provenance().devices[0].device.name;
    println!("{} on {device}", path.display());
    println!("relative error {}", picture.relative_error());
    Ok(())
}
