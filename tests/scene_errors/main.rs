//! Every rule of the scene format, broken once: file, line, column, value and rule are named.

mod files;
mod implicit;
mod isosurface;
mod reading;
mod structure;
mod values;

use etendue::scene::Scene;
use etendue::scene::parse::parse_str;
use std::path::Path;

/// A scene with everything in it.
const FULL: &str = r#"title = "Everything"

[camera]
eye = [0.0, 1.0, 3.8]
look_at = [0.0, 1.0, 0.0]
up = [0, 2, 0]
vfov = 42
resolution = [512, 384]

[render]
max_depth = 64
strata = 2
seed = 7

[material.white]
type = "diffuse"
reflectance = [0.75, 0.75, 0.75]

[material.steel]
type = "mirror"

[material.glass]
type = "dielectric"
ior = 1.5

[material.gloss]
type = "phong"
diffuse = [0.3, 0.1, 0.1]
specular = [0.4, 0.9, 0.4]
exponent = 60

[[light]]
center = [0.0, 1.98, -0.5]
normal = [0.0, -3.0, 0.0]
radius = 0.4
radiance = [12, 12, 12]

[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = "white"

[[cylinder]]
base = [0.5, 0.0, -1.0]
top = [0.5, 0.9, -1.0]
radius = 0.25
material = "gloss"

[[sphere]]
center = [-0.6, 0.4, -1.1]
radius = 0.5
material = "steel"

[[disk]]
center = [0.0, 0.5, -1.9]
normal = [0.0, 0.0, 1.0]
radius = 0.3
material = "white"

[[sphere]]
center = [0.6, 0.4, -1.1]
radius = 0.125
material = "glass"
"#;

fn parse(text: &str) -> Result<Scene, Vec<String>> {
    parse_str(Path::new("s.toml"), text)
        .map_err(|errors| errors.iter().map(ToString::to_string).collect())
}

/// The errors of the full scene with `old` replaced by `new`.
fn errors(old: &str, new: &str) -> Vec<String> {
    assert!(FULL.contains(old), "no {old} to replace");
    match parse(&FULL.replacen(old, new, 1)) {
        Ok(_) => panic!("{old:?} -> {new:?} passes"),
        Err(errors) => errors,
    }
}

/// Asserts that the replacement makes one error, with exactly this message.
#[track_caller]
fn one(old: &str, new: &str, message: &str) {
    assert_eq!(
        errors(old, new),
        [format!("s.toml:{message}")],
        "{old:?} -> {new:?}"
    );
}
