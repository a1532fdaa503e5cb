//! Random scenes: valid ones are read as written, damaged ones never panic.

use etendue::scene::check::lint;
use etendue::scene::parse::{ReadError, parse_str, read};
use etendue::scene::{Bsdf, Camera, Light, Material, Primitive, RenderHints, Scene, Shape};
use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;
use std::fmt::Write;
use std::io::Write as _;
use std::path::Path;

/// Coordinates of every magnitude that is allowed.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0,
        1 => Just(0.0),
        1 => (-1.0..1.0f64, -20..=15i32).prop_map(|(m, e)| m * 10f64.powi(e)),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

fn radius() -> impl Strategy<Value = f64> {
    prop_oneof![
        0.01..10.0,
        (1.0..10.0f64, -15..=14i32).prop_map(|(m, e)| m * 10f64.powi(e))
    ]
}

fn unit() -> impl Strategy<Value = DVec3> {
    point()
        .prop_filter("not null", |v| v.length() > 1e-3)
        .prop_map(DVec3::normalize)
}

fn share() -> impl Strategy<Value = DVec3> {
    [0.0..=1.0, 0.0..=1.0, 0.0..=1.0].prop_map(DVec3::from_array)
}

fn bsdf() -> impl Strategy<Value = Bsdf> {
    prop_oneof![
        share().prop_map(|reflectance| Bsdf::Diffuse { reflectance }),
        share().prop_map(|reflectance| Bsdf::Mirror { reflectance }),
        (1e-6..1e6, share())
            .prop_map(|(ior, transmittance)| Bsdf::Dielectric { ior, transmittance }),
        (share(), share(), 0.0..1e6).prop_map(|(diffuse, x, exponent)| Bsdf::Phong {
            diffuse,
            specular: x * (1.0 - diffuse),
            exponent,
        }),
    ]
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        (point(), radius()).prop_map(|(center, radius)| Shape::Sphere { center, radius }),
        (point(), unit()).prop_map(|(point, normal)| Shape::Plane { point, normal }),
        (point(), unit(), radius()).prop_map(|(center, normal, radius)| Shape::Disk {
            center,
            normal,
            radius
        }),
        (point(), point(), radius())
            .prop_filter("some length", |(base, top, _)| base.distance(*top) >= 1e-15)
            .prop_map(|(base, top, radius)| Shape::Cylinder { base, top, radius }),
    ]
}

fn light() -> impl Strategy<Value = Light> {
    (point(), unit(), radius(), share(), 0.0..1e15).prop_map(
        |(center, normal, radius, color, power)| Light {
            center,
            normal,
            radius,
            radiance: color * power,
            line: 0,
        },
    )
}

fn camera() -> impl Strategy<Value = Camera> {
    let view = (point(), point(), unit());
    (view, 0.1..179.9, [1..=65536u32, 1..=65536u32])
        .prop_filter("a view not along up", |((eye, look_at, up), _, _)| {
            let view = *look_at - *eye;
            view.length() > 1e-6 && view.normalize().cross(*up).length() > 1e-6
        })
        .prop_map(|((eye, look_at, up), vfov, resolution)| Camera {
            eye,
            look_at,
            up,
            vfov,
            resolution,
        })
}

/// Valid scenes; the names of materials are such that TOML must quote some.
fn scenes() -> impl Strategy<Value = Scene> {
    let materials = vec(("[a-z .\"\\\\é-]{0,4}", bsdf()), 1..5);
    let primitives = vec((shape(), any::<prop::sample::Index>()), 1..12);
    let hint = || prop::option::of(1..1000u32);
    let rest = (prop::option::of(".*"), hint(), hint(), hint());
    (camera(), materials, primitives, vec(light(), 1..4), rest).prop_map(
        |(camera, materials, primitives, lights, (title, max_depth, strata, seed))| {
            let materials: std::collections::BTreeMap<String, Bsdf> =
                materials.into_iter().collect();
            let materials: Vec<Material> = materials
                .into_iter()
                .map(|(name, bsdf)| Material { name, bsdf })
                .collect();
            let primitives = primitives.into_iter().filter_map(|(shape, index)| {
                let material = index.index(materials.len());
                let is_glass = matches!(materials[material].bsdf, Bsdf::Dielectric { .. });
                let refused = is_glass && matches!(shape, Shape::Disk { .. });
                (!refused).then_some(Primitive {
                    shape,
                    material,
                    line: 0,
                })
            });
            let mut primitives: Vec<Primitive> = primitives.collect();
            if primitives.is_empty() {
                primitives.push(Primitive {
                    shape: Shape::Sphere {
                        center: DVec3::ZERO,
                        radius: 1.0,
                    },
                    material: 0,
                    line: 0,
                });
            }
            primitives.sort_by_key(|p| {
                ["sphere", "plane", "disk", "cylinder"]
                    .iter()
                    .position(|&kind| kind == p.shape.kind())
            });
            Scene {
                path: "random.toml".into(),
                title,
                camera,
                render: RenderHints {
                    max_depth,
                    strata,
                    seed,
                },
                materials,
                primitives,
                lights,
            }
        },
    )
}

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
    read.camera.up = same(read.camera.up, written.camera.up);
    for (a, b) in read.lights.iter_mut().zip(&written.lights) {
        a.line = 0;
        a.normal = same(a.normal, b.normal);
    }
    for (a, b) in read.primitives.iter_mut().zip(&written.primitives) {
        a.line = 0;
        if let (
            Shape::Plane { normal: n, .. } | Shape::Disk { normal: n, .. },
            Shape::Plane { normal: m, .. } | Shape::Disk { normal: m, .. },
        ) = (&mut a.shape, b.shape)
        {
            *n = same(*n, m);
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
    fn valid_scenes_are_read_as_written(scene in scenes()) {
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
    fn damaged_files_never_panic(scene in scenes(), damages in vec(damage(), 1..6)) {
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
    fn any_text_is_taken_calmly(text in "[\\[\\]{}=.,'\"#\\\\ \n\ra-z0-9_-]{0,60}") {
        check(&text)?;
    }
}
