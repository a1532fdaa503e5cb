use super::*;
use crate::provenance::hash::scene_hash;
use crate::scene::parse::parse_str;
use crate::settings::{Overrides, Settings};
use std::path::Path;

fn room() -> SceneBuilder {
    Scene::builder()
        .title("a \"room\"\u{7f}\n")
        .camera([0.0, 1.0, 4.0], [0.1, 0.5, 0.0], 40.0, [8, 6])
        .up([0.0, 2.0, 0.1])
        .diffuse("white wall", [0.1 + 0.2, 0.7, 1e-3])
        .mirror("m", [1.0; 3])
        .dielectric("glass", 1.52)
        .phong("gloss", [0.2; 3], [0.5; 3], 30.0)
        .plane([0.0; 3], [0.1, 3.0, 0.2], "white wall")
        .sphere([0.0, 0.5, 0.0], 0.5, "glass")
        .disk([1.0, 1.0, 0.0], [1.0, 1.0, 1.0], 0.25, "m")
        .cylinder([-1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], 0.2, "gloss")
        .light([0.0, 3.0, 1.0], [0.3, -1.0, 0.0], 0.5, [20.0, 1e-9, 3.0])
}

#[test]
fn a_built_scene_is_what_its_file_says_and_survives_being_checked() {
    let built = room().build().unwrap();
    assert_eq!(built.title.as_deref(), Some("a \"room\"\u{7f}\n"));
    let read = parse_str(Path::new("x.toml"), &room().to_toml()).unwrap();
    let hash = |s: &Scene| scene_hash(s, &Settings::resolve(s, &Overrides::default()));
    assert_eq!(hash(&built), hash(&read));
    assert!(built.primitives.iter().all(|p| p.line == 0));
    let (same, text) = checked(&built).unwrap();
    assert_eq!(same, built);
    assert_eq!(
        hash(&parse_str(Path::new(""), &text).unwrap()),
        hash(&built)
    );
}

#[test]
fn every_rule_of_files_holds_and_the_thing_is_named() {
    let wrong = room()
        .sphere([f64::NAN, 0.0, 0.0], 1.0, "glass")
        .sphere([0.0; 3], f64::INFINITY, "glas")
        .light([0.0; 3], [0.0; 3], 1.0, [1.0; 3])
        .disk([0.0; 3], [0.0, 1.0, 0.0], 1.0, "glass")
        .diffuse("bright", [1.5; 3])
        .build()
        .unwrap_err();
    let text = wrong.to_string();
    for expected in [
        "sphere 2: center[0] is nan",
        "sphere 3: radius is inf",
        "light 2: normal is [0.0, 0.0, 0.0]",
        "disk 2: material \"glass\" is dielectric",
        "material \"bright\": reflectance[0] is 1.5",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let empty = Scene::builder().build().unwrap_err().to_string();
    assert!(
        empty.starts_with("the scene: is empty; a scene needs"),
        "{empty}"
    );
    let twice = room().diffuse("m", [0.5; 3]).build().unwrap_err();
    let said = "material \"m\": duplicate; every material has a name of its own";
    assert_eq!(twice.to_string(), said);
    let cameras = room().camera([1.0; 3], [0.0; 3], 40.0, [8, 6]).build();
    let said = cameras.unwrap_err().to_string();
    assert_eq!(said, "camera: duplicate; a scene has one camera");
}

#[test]
fn a_scene_that_was_changed_is_checked_again() {
    let good = room().build().unwrap();
    let mut scene = good.clone();
    scene.primitives[0].material = 9;
    assert!(
        checked(&scene).unwrap_err()[0]
            .message
            .contains("material is 9")
    );
    let mut scene = good.clone();
    scene.camera.vfov = 180.0;
    assert!(
        checked(&scene).unwrap_err()[0]
            .to_string()
            .starts_with("camera: vfov")
    );
    let mut scene = good.clone();
    scene.lights[0].normal *= 3.0;
    let (scene, _) = checked(&scene).unwrap();
    assert!((scene.lights[0].normal - good.lights[0].normal).length() < UNIT);
}
