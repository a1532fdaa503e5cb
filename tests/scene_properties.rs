//! Random scenes: valid ones are read as written, damaged ones never panic.

mod random_scene;

use etendue::implicit::Clip;
use etendue::scene::check::lint;
use etendue::scene::parse::{ReadError, parse_str, read};
use etendue::scene::{Bsdf, Place, Scene, Shape};
use glam::DVec3;
use proptest::collection::vec;
use proptest::prelude::*;
use random_scene::{Implicits, scenes};
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

/// A scene with strings wherever one may stand: `{k}` are filled in.
const STRINGS: &str = "title = {0}\n\
    [camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n[render]\n{1} = 3\n\
    [material.{2}]\ntype = {3}\nreflectance = [0.5, 0.5, 0.5]\n\
    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = {4}\n\
    [[spheres]]\nfile = {5}\nradius = 1\nmaterial = {2}\n\
    [[implicit]]\nf = {6}\nbounds = { radius = 1 }\nmaterial = {2}\nparameters = { {7} = 1 }\n\
    [[isosurface]]\nfile = {8}\nlevel = 1\norigin = [0, 0, 0]\nspacing = [1, 1, 1]\norder = {9}\nmaterial = {2}\n\
    [[light]]\ncenter = [0, 9, 0]\nnormal = [0, -1, 0]\nradius = 1\nradiance = [1, 1, 1]\n";

/// What is put in where nothing is wrong.
const RIGHT: [&str; 10] = [
    "t", "seed", "white", "diffuse", "white", "rows.csv", "x", "a", "d.npy", "zyx",
];

/// A TOML string of any text, by escapes.
fn escaped(text: &str) -> String {
    let all = text.chars().map(|c| format!("\\U{:08x}", u32::from(c)));
    format!("\"{}\"", all.collect::<String>())
}

fn with_strings(strings: &[String]) -> String {
    let mut text = STRINGS.to_owned();
    for (k, s) in strings.iter().enumerate() {
        text = text.replace(&format!("{{{k}}}"), &escaped(s));
    }
    text
}

/// A `.npy` file.
#[derive(Debug, Clone)]
struct NumbersFile {
    kind: &'static str,
    fortran: bool,
    version: u8,
    shape: [usize; 3],
    values: Vec<f64>,
}

impl NumbersFile {
    fn bytes(&self) -> Vec<u8> {
        let [a, b, c] = self.shape;
        let order = if self.fortran { "True" } else { "False" };
        let dict = format!(
            "{{'descr': '{}', 'fortran_order': {order}, 'shape': ({a}, {b}, {c}), }}\n",
            self.kind
        );
        let mut bytes = vec![0x93];
        bytes.extend(b"NUMPY");
        bytes.extend([self.version, 0]);
        match self.version {
            1 => bytes.extend((dict.len() as u16).to_le_bytes()),
            _ => bytes.extend((dict.len() as u32).to_le_bytes()),
        }
        bytes.extend(dict.bytes());
        for x in &self.values {
            let mut one = match &self.kind[1..] {
                "u1" => vec![*x as u8],
                "u2" => (*x as u16).to_le_bytes().to_vec(),
                "f4" => (*x as f32).to_le_bytes().to_vec(),
                _ => x.to_le_bytes().to_vec(),
            };
            if self.kind.starts_with('>') {
                one.reverse();
            }
            bytes.extend(one);
        }
        bytes
    }

    /// The number at three indices.
    fn at(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [a, b, c] = self.shape;
        self.values[if self.fortran {
            i + a * (j + b * k)
        } else {
            k + c * (j + b * i)
        }]
    }

    /// What a scene of it says. The folder is there as long as the scene is read.
    fn scene(bytes: &[u8], order: &str) -> Result<Scene, Vec<String>> {
        let folder = tempfile::tempdir().expect("temporary folder");
        std::fs::write(folder.path().join("d.npy"), bytes).expect("written");
        std::fs::write(folder.path().join("rows.csv"), "x,y,z\n1,2,3\n").expect("written");
        let mut strings = RIGHT.map(str::to_owned);
        strings[9] = order.to_owned();
        let scene = parse_str(&folder.path().join("x.toml"), &with_strings(&strings));
        let lines =
            |all: Vec<etendue::scene::Diagnostic>| all.iter().map(|d| d.to_string()).collect();
        scene.map_err(lines)
    }
}

fn numbers_file(wild: bool) -> impl Strategy<Value = NumbersFile> {
    let kinds = vec!["|u1", "<u2", ">u2", "<f4", ">f4", "<f8", ">f8"];
    let side = || 2..6usize;
    let kinds = prop::sample::select(kinds);
    (kinds, any::<bool>(), 1..=3u8, [side(), side(), side()]).prop_flat_map(
        move |(kind, fortran, version, shape)| {
            let value = match &kind[1..] {
                "u1" => (0..=255u16).prop_map(f64::from).boxed(),
                "u2" => any::<u16>().prop_map(f64::from).boxed(),
                _ if wild => any::<f32>().prop_map(f64::from).boxed(),
                _ => (-1e6f32..1e6).prop_map(f64::from).boxed(),
            };
            vec(value, shape.iter().product::<usize>()).prop_map(move |values| NumbersFile {
                kind,
                fortran,
                version,
                shape,
                values,
            })
        },
    )
}

proptest! {
    #[test]
    fn volumes_are_read_as_numpy_would(file in numbers_file(false)) {
        for order in ["zyx", "xyz"] {
            let scene = NumbersFile::scene(&file.bytes(), order);
            let scene = scene.map_err(|e| TestCaseError::fail(e.join("\n")))?;
            let surface = scene.primitives.iter().rev().find_map(|p| match &p.shape {
                Shape::Implicit(i) => i.grid(),
                _ => None,
            });
            let volume = &surface.expect("a volume").volume;
            let [a, b, c] = file.shape;
            prop_assert_eq!(volume.size(), if order == "xyz" { [a, b, c] } else { [c, b, a] });
            for (i, j, k) in (0..a).flat_map(|i| (0..b).flat_map(move |j| (0..c).map(move |k| (i, j, k)))) {
                let at = if order == "xyz" { [i, j, k] } else { [k, j, i] };
                prop_assert_eq!(volume.at(at), file.at([i, j, k]));
            }
        }
    }

    #[test]
    fn damaged_volumes_never_panic(
        file in numbers_file(true),
        damages in vec(damage(), 0..4),
        end in prop::option::of(0..1000usize),
        shape in prop::option::of((0..5u64, any::<u64>(), any::<u64>())),
    ) {
        let mut bytes = file.bytes();
        if let Some(shape) = shape {
            // A header that promises something else.
            let [a, b, c] = file.shape;
            let old = format!("({a}, {b}, {c})");
            let at = bytes.windows(old.len()).position(|w| w == old.as_bytes()).expect("the shape");
            let new = format!("{shape:?}");
            bytes.splice(at..at + old.len(), new.bytes());
            let length = if file.version == 1 { 2 } else { 4 };
            let start = 8 + length;
            let dict = bytes[start..].iter().position(|b| *b == b'\n').expect("its end") + 1;
            let size = (dict as u32).to_le_bytes();
            bytes.splice(8..start, size[..length].iter().copied());
        }
        apply(&damages, &mut bytes);
        if let Some(end) = end {
            bytes.truncate(end);
        }
        match NumbersFile::scene(&bytes, "zyx") {
            Ok(scene) => drop(lint(&scene)),
            Err(messages) => {
                prop_assert!(!messages.is_empty());
                for message in messages {
                    prop_assert!(message.contains("d.npy"), "{}", message);
                    prop_assert!(!message.contains(char::is_control), "{:?}", message);
                }
            }
        }
    }

    #[test]
    fn every_message_is_one_line(
        strings in vec(prop_oneof![3 => "[\\PC\\x00-\\x1f\\x7f-\\x9f\\u{2028}\\u{2029}/]{0,30}", 1 => ".{0,60}"], 10),
        right in vec(any::<bool>(), 10),
        path in "[a-z\\x00-\\x1f]{1,9}",
    ) {
        let all = strings.iter().zip(RIGHT).zip(right);
        let all: Vec<String> = all.map(|((s, r), right)| if right { r.to_owned() } else { s.clone() }).collect();
        let said: Vec<String> = match parse_str(Path::new(&path), &with_strings(&all)) {
            Ok(scene) => lint(&scene).iter().map(ToString::to_string).collect(),
            Err(errors) => errors.iter().map(ToString::to_string).collect(),
        };
        for message in said {
            let ends = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
            prop_assert!(!message.contains(ends), "{:?}", message);
        }
    }

    #[test]
    fn valid_scenes_are_read_as_written(scene in scenes(Implicits::Formulas)) {
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
    fn damaged_files_never_panic(scene in scenes(Implicits::Formulas), damages in vec(damage(), 1..6)) {
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
