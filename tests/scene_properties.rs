//! Random scenes: valid ones are read as written, damaged ones never panic.

mod random_scene;

use etendue::implicit::Clip;
use etendue::scene::check::lint;
use etendue::scene::parse::{ReadError, parse_str, read};
use etendue::scene::{Bsdf, Place, Scene, Shape};
use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;
use random_scene::scenes;
use std::fmt::Write;
use std::io::Write as _;
use std::path::Path;

/// The scene as a file. Rust writes f64 so that it reads back the same, and as TOML does.
fn to_toml(scene: &Scene) -> Result<String, std::fmt::Error> {
    let mut s = String::new();
    let vector = |v: DVec3| format!("{:?}", v.to_array());
    let string = |text: &str| toml::Value::from(text).to_string();
    if let Some(title) = &scene.title {
        writeln!(s, "title = {}", string(title))?;
    }
    let c = &scene.camera;
    writeln!(
        s,
        "[camera]\neye = {}\nlook_at = {}",
        vector(c.eye),
        vector(c.look_at)
    )?;
    writeln!(
        s,
        "up = {}\nvfov = {:?}\nresolution = {:?}",
        vector(c.up),
        c.vfov,
        c.resolution
    )?;
    let r = &scene.render;
    writeln!(s, "[render]")?;
    for (key, value) in [
        ("max_depth", r.max_depth),
        ("strata", r.strata),
        ("seed", r.seed),
    ] {
        if let Some(value) = value {
            writeln!(s, "{key} = {value}")?;
        }
    }
    for p in &scene.primitives {
        writeln!(s, "[[{}]]", p.shape.kind())?;
        match p.shape {
            Shape::Sphere { center, radius } => {
                writeln!(s, "center = {}\nradius = {radius:?}", vector(center))?;
            }
            Shape::Plane { point, normal } => {
                writeln!(s, "point = {}\nnormal = {}", vector(point), vector(normal))?;
            }
            Shape::Disk {
                center,
                normal,
                radius,
            } => {
                writeln!(
                    s,
                    "center = {}\nnormal = {}",
                    vector(center),
                    vector(normal)
                )?;
                writeln!(s, "radius = {radius:?}")?;
            }
            Shape::Cylinder { base, top, radius } => {
                writeln!(s, "base = {}\ntop = {}", vector(base), vector(top))?;
                writeln!(s, "radius = {radius:?}")?;
            }
            Shape::Implicit(ref i) => {
                writeln!(s, "f = {}\nlevel = {:?}", string(i.text()), i.level)?;
                for (name, value) in i.parameters() {
                    writeln!(s, "parameters.{name} = {value:?}")?;
                }
                writeln!(s, "center = {}\nscale = {:?}", vector(i.center), i.scale)?;
                let rows = i.rotation.transpose();
                let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(vector);
                writeln!(s, "rotation = [{}]\nclosed = {}", rows.join(", "), i.closed)?;
                match i.clip {
                    Clip::Ball { radius } => writeln!(s, "bounds.radius = {radius:?}")?,
                    Clip::Box { min, max } => {
                        writeln!(
                            s,
                            "bounds.min = {}\nbounds.max = {}",
                            vector(min),
                            vector(max)
                        )?;
                    }
                }
            }
        }
        writeln!(
            s,
            "material = {}",
            string(&scene.materials[p.material].name)
        )?;
    }
    for m in &scene.materials {
        writeln!(s, "[material.{}]", toml::Value::from(m.name.as_str()))?;
        match m.bsdf {
            Bsdf::Diffuse { reflectance } => {
                writeln!(s, "type = 'diffuse'\nreflectance = {}", vector(reflectance))?;
            }
            Bsdf::Mirror { reflectance } => {
                writeln!(s, "type = 'mirror'\nreflectance = {}", vector(reflectance))?;
            }
            Bsdf::Dielectric { ior, transmittance } => {
                writeln!(s, "type = 'dielectric'\nior = {ior:?}")?;
                writeln!(s, "transmittance = {}", vector(transmittance))?;
            }
            Bsdf::Phong {
                diffuse,
                specular,
                exponent,
            } => {
                writeln!(s, "type = 'phong'\ndiffuse = {}", vector(diffuse))?;
                writeln!(
                    s,
                    "specular = {}\nexponent = {exponent:?}",
                    vector(specular)
                )?;
            }
        }
    }
    for l in &scene.lights {
        writeln!(
            s,
            "[[light]]\ncenter = {}\nnormal = {}",
            vector(l.center),
            vector(l.normal)
        )?;
        writeln!(
            s,
            "radius = {:?}\nradiance = {}",
            l.radius,
            vector(l.radiance)
        )?;
    }
    Ok(s)
}

/// `read` with lines taken out and unit vectors put back, which normalising again may change in the
/// last digit.
fn like(read: &Scene, written: &Scene) -> Scene {
    // Two roundings of coordinates up to 1.
    let same = |a: DVec3, b: DVec3| if (a - b).length() < 1e-15 { b } else { a };
    let mut read = read.clone();
    for m in &mut read.materials {
        m.place = Place::default();
    }
    read.camera.up = same(read.camera.up, written.camera.up);
    for (a, b) in read.lights.iter_mut().zip(&written.lights) {
        (a.line, a.column) = (0, 0);
        a.normal = same(a.normal, b.normal);
    }
    for (a, b) in read.primitives.iter_mut().zip(&written.primitives) {
        (a.line, a.column) = (0, 0);
        if let (
            Shape::Plane { normal: n, .. } | Shape::Disk { normal: n, .. },
            Shape::Plane { normal: m, .. } | Shape::Disk { normal: m, .. },
        ) = (&mut a.shape, &b.shape)
        {
            *n = same(*n, *m);
        }
    }
    read
}

/// What must hold for any text: a scene, or at least one message, each one line; lints do not panic.
fn check(text: &str) -> Result<(), TestCaseError> {
    let messages: Vec<String> = match parse_str(Path::new("x.toml"), text) {
        Ok(scene) => lint(&scene).iter().map(ToString::to_string).collect(),
        Err(errors) => {
            prop_assert!(!errors.is_empty(), "neither scene nor error");
            errors.iter().map(ToString::to_string).collect()
        }
    };
    for message in messages {
        prop_assert!(message.starts_with("x.toml:"), "{}", message);
        prop_assert!(!message.contains(char::is_control), "{:?}", message);
    }
    Ok(())
}

/// One damage done to a file.
#[derive(Debug, Clone)]
enum Damage {
    Set(usize, u8),
    Insert(usize, Vec<u8>),
    Remove(usize, usize),
    Repeat(usize, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let bytes = prop_oneof![
        vec(any::<u8>(), 1..4),
        // What means something in TOML does more harm than noise.
        prop::sample::select(vec![
            "[",
            "]",
            "[[",
            "]]",
            "{",
            "}",
            "\"",
            "'",
            "\"\"\"",
            "\n",
            "=",
            ".",
            ",",
            "#",
            "\\",
            "nan",
            "inf",
            "-",
            "1e999",
            "0x",
            "[[light]]\n",
            "[material]\n",
            "\r",
            "\u{feff}",
        ])
        .prop_map(|s| s.as_bytes().to_vec()),
    ];
    prop_oneof![
        (any::<usize>(), any::<u8>()).prop_map(|(i, b)| Damage::Set(i, b)),
        (any::<usize>(), bytes).prop_map(|(i, b)| Damage::Insert(i, b)),
        (any::<usize>(), 1..40usize).prop_map(|(i, n)| Damage::Remove(i, n)),
        (any::<usize>(), 1..200usize).prop_map(|(i, n)| Damage::Repeat(i, n)),
    ]
}

fn apply(damage: &[Damage], bytes: &mut Vec<u8>) {
    for d in damage {
        let length = bytes.len();
        let at = |i: usize| i % (length + 1);
        match d {
            Damage::Set(i, b) if length > 0 => bytes[i % length] = *b,
            Damage::Set(..) => {}
            Damage::Insert(i, more) => {
                bytes.splice(at(*i)..at(*i), more.iter().copied());
            }
            Damage::Remove(i, n) => {
                bytes.drain(at(*i)..(at(*i) + n).min(length));
            }
            Damage::Repeat(i, n) => {
                let part = bytes[at(*i)..(at(*i) + n).min(length)].to_vec();
                bytes.splice(at(*i)..at(*i), part);
            }
        }
    }
}

proptest! {
    #[test]
    fn valid_scenes_are_read_as_written(scene in scenes(true)) {
        let text = to_toml(&scene).expect("strings take all text");
        match parse_str(&scene.path, &text) {
            Ok(read) => {
                prop_assert_eq!(like(&read, &scene), scene);
                let lines: Vec<&str> = text.lines().collect();
                for p in &read.primitives {
                    prop_assert_eq!(lines[p.line - 1], format!("[[{}]]", p.shape.kind()));
                }
            }
            Err(errors) => prop_assert!(false, "{}\n{}", errors[0], text),
        }
        check(&text)?;
    }

    #[test]
    fn damaged_files_never_panic(scene in scenes(true), damages in vec(damage(), 1..6)) {
        let mut bytes = to_toml(&scene).expect("strings take all text").into_bytes();
        apply(&damages, &mut bytes);
        check(&String::from_utf8_lossy(&bytes))?;
        let mut file = tempfile::NamedTempFile::new().expect("temporary file");
        file.write_all(&bytes).expect("written");
        if let Err(ReadError::Invalid(errors)) = read(file.path()) {
            prop_assert!(!errors.is_empty());
        }
    }

    #[test]
    fn random_text_never_panics(text in "[\\[\\]{}=.,'\"#\\\\ \n\ra-z0-9_-]{0,60}") {
        check(&text)?;
    }
}
