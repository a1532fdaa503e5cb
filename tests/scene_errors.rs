//! Every rule of the scene format, broken once: file, line, column, value and rule are named.

use etendue::scene::parse::{MAX_FILE_BYTES, ReadError, parse_str, read};
use etendue::scene::{Bsdf, Scene, Shape};
use std::io::ErrorKind;
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

#[test]
fn the_full_scene_is_read_as_written() {
    let scene = parse(FULL).expect("valid");
    assert_eq!(scene.title.as_deref(), Some("Everything"));
    assert_eq!(scene.camera.resolution, [512, 384]);
    assert_eq!(scene.camera.eye.to_array(), [0.0, 1.0, 3.8]);
    assert_eq!(scene.camera.up.to_array(), [0.0, 1.0, 0.0]);
    assert_eq!((scene.render.strata, scene.render.seed), (Some(2), Some(7)));

    let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["glass", "gloss", "steel", "white"]);
    let Bsdf::Dielectric { ior, transmittance } = scene.materials[0].bsdf else {
        panic!("{:?}", scene.materials[0]);
    };
    assert_eq!((ior, transmittance.to_array()), (1.5, [1.0; 3]));

    let primitives: Vec<(&str, &str, usize)> = scene
        .primitives
        .iter()
        .map(|p| (p.shape.kind(), names[p.material], p.line))
        .collect();
    let line = |nth: usize, header: &str| {
        let mut lines = FULL.lines().enumerate().filter(|(_, l)| *l == header);
        lines.nth(nth).expect(header).0 + 1
    };
    assert_eq!(
        primitives,
        [
            ("sphere", "steel", line(0, "[[sphere]]")),
            ("sphere", "glass", line(1, "[[sphere]]")),
            ("plane", "white", line(0, "[[plane]]")),
            ("disk", "white", line(0, "[[disk]]")),
            ("cylinder", "gloss", line(0, "[[cylinder]]")),
        ]
    );
    let Shape::Cylinder { base, top, radius } = scene.primitives[4].shape else {
        panic!("{:?}", scene.primitives[4]);
    };
    assert_eq!(base.to_array(), [0.5, 0.0, -1.0]);
    assert_eq!((top.y, radius), (0.9, 0.25));
    let light = scene.lights[0];
    assert_eq!(light.normal.to_array(), [0.0, -1.0, 0.0]);
    assert_eq!((light.radiance.x, light.line), (12.0, line(0, "[[light]]")));
}

#[test]
fn what_may_be_left_out() {
    let mut text = FULL.to_owned();
    for optional in [
        "title = \"Everything\"\n",
        "up = [0, 2, 0]\n",
        "[render]\nmax_depth = 64\nstrata = 2\nseed = 7\n",
        "ior = 1.5\n",
    ] {
        assert!(text.contains(optional));
        text = text.replace(optional, "");
    }
    let scene = parse(&text).expect("valid");
    assert_eq!(scene.title, None);
    assert_eq!(scene.camera.up.to_array(), [0.0, 1.0, 0.0]);
    assert_eq!(scene.render, etendue::scene::RenderHints::default());
    let Bsdf::Dielectric { ior, .. } = scene.materials[0].bsdf else {
        panic!("{:?}", scene.materials[0]);
    };
    assert_eq!(ior, 1.52);
}

#[test]
fn byte_order_mark_and_crlf_change_nothing() {
    let plain = parse(FULL).expect("valid");
    let crlf = FULL.replace('\n', "\r\n");
    assert_eq!(parse(&crlf).as_ref(), Ok(&plain));
    let marked = format!("\u{feff}{crlf}");
    assert_eq!(parse(&marked).as_ref(), Ok(&plain));
    let wrong = marked.replace("vfov = 42", "vfov = 0");
    assert_eq!(
        parse(&wrong).expect_err("vfov is 0"),
        ["s.toml:7:8: vfov is 0; vfov must be a number above 0 and below 180"]
    );
    let first_line = marked.replace("title = \"Everything\"", "titel = 1");
    let errors = parse(&first_line).expect_err("titel");
    assert!(
        errors[0].starts_with("s.toml:1:1: unknown key \"titel\""),
        "{errors:?}"
    );
}

#[test]
fn columns_count_characters() {
    one(
        "look_at = [0.0, 1.0, 0.0]",
        "look_at = [0.0, 1.0, 0.0]\n\"ö\" = 1",
        "6:1: unknown key \"ö\" in [camera]; allowed: eye, look_at, up, vfov, resolution",
    );
    let inline = FULL.replace("[render]", "[x]").replace(
        "title = \"Everything\"",
        "title = \"öäü\"\nrender = { \"ß\" = 1, seed = -1 }",
    );
    let errors = parse(&inline).expect_err("wrong keys");
    assert!(
        errors[0].starts_with("s.toml:2:12: unknown key"),
        "{errors:?}"
    );
    assert!(
        errors[1].starts_with("s.toml:2:28: seed is -1"),
        "{errors:?}"
    );
}

#[test]
fn unknown_keys_and_names_get_suggestions() {
    one(
        "vfov = 42",
        "vfov = 42\nlookat = 1",
        "8:1: unknown key \"lookat\" in [camera]; allowed: eye, look_at, up, vfov, resolution; \
         did you mean \"look_at\"?",
    );
    one(
        "material = \"glass\"",
        "material = \"glas\"",
        "63:12: unknown material \"glas\"; defined here: glass, gloss, steel, white; \
         did you mean \"glass\"?",
    );
    one(
        "material = \"glass\"",
        "material = \"velvet\"",
        "63:12: unknown material \"velvet\"; defined here: glass, gloss, steel, white",
    );
    assert_eq!(
        errors("type = \"mirror\"", "type = \"Miror\"")[0],
        "s.toml:20:8: unknown material type \"Miror\"; allowed: diffuse, mirror, dielectric, phong; \
         did you mean \"mirror\"?"
    );
    one(
        "[[disk]]",
        "[[discs]]",
        "54:3: unknown key \"discs\" in the scene; allowed: title, camera, render, material, sphere, \
         plane, disk, cylinder, light; did you mean \"disk\"?",
    );
    one(
        "ior = 1.5",
        "reflectance = [1, 1, 1]",
        "24:1: unknown key \"reflectance\" in [material.glass]; allowed: type, ior, transmittance; \
         it belongs to diffuse and mirror",
    );
}

#[test]
fn wrong_types() {
    let radius = "radius must be a number from 1e-15 to 1e15 (limits of f32 kernels)";
    for (value, found) in [
        ("\"big\"", "\"big\""),
        ("true", "true"),
        ("[0.5]", "[0.5]"),
        ("{ x = 1 }", "{ x = 1 }"),
        ("1979-05-27", "1979-05-27"),
        ("[\n 1,\n 2 ]", "[ 1, 2 ]"),
    ] {
        one(
            "radius = 0.125",
            &format!("radius = {value}"),
            &format!("62:10: radius is {found}; {radius}"),
        );
    }
    one(
        "\"Everything\"",
        "3",
        "1:9: title is 3; title must be a string",
    );
    one(
        "material = \"glass\"",
        "material = 1",
        "63:12: material is 1; material must be a string",
    );
    one(
        "type = \"mirror\"",
        "type = 1",
        "20:8: type is 1; type must be a string",
    );
    let pixels = "resolution must be [width, height], two whole numbers from 1 to 65536";
    one(
        "[512, 384]",
        "[512, 384.0]",
        &format!("8:20: resolution[1] is 384.0; {pixels}"),
    );
    one(
        "[512, 384]",
        "[512]",
        &format!("8:14: resolution is [512]; {pixels}"),
    );
    one(
        "[512, 384]",
        "512",
        &format!("8:14: resolution is 512; {pixels}"),
    );
    let color = "reflectance must be three numbers from 0 to 1";
    one(
        "[0.75, 0.75, 0.75]",
        "[0.75, \"x\", 0.75]",
        &format!("17:22: reflectance[1] is \"x\"; {color}"),
    );
    one(
        "[0.75, 0.75, 0.75]",
        "0.75",
        &format!("17:15: reflectance is 0.75; {color}"),
    );
    one(
        "[camera]",
        "[[camera]]",
        "3:1: camera is [[camera]], but must be one table, [camera]",
    );
    assert_eq!(
        errors("[[plane]]", "[plane]")[0],
        "s.toml:38:1: plane must be an array of tables: write [[plane]] for each"
    );
    assert_eq!(
        errors("[[plane]]", "[plane]").len(),
        1,
        "and not that there is no primitive"
    );
    let disks = FULL[..FULL.find("[[disk]]").expect("disk")].replace("title", "disk = [1]\ntitle");
    assert_eq!(
        parse(&disks).expect_err("a number"),
        ["s.toml:1:9: [[disk]] is 1, but must be a table"]
    );
    one(
        "[material.white]",
        "[material]\nx = 1\n[material.white]",
        "16:5: [material.x] is 1, but must be a table",
    );
}

#[test]
fn values_out_of_range() {
    let length = "a number from 1e-15 to 1e15 (limits of f32 kernels)";
    for bad in [
        "0",
        "-1",
        "inf",
        "-inf",
        "nan",
        "1e-16",
        "2e15",
        "1e999",
        "0x7fffffffffffffff",
    ] {
        one(
            "radius = 0.125",
            &format!("radius = {bad}"),
            &format!("62:10: radius is {bad}; radius must be {length}"),
        );
    }
    let coordinate = "three numbers from -1e15 to 1e15 (limits of f32 kernels)";
    for bad in ["inf", "nan", "-1.1e15"] {
        one(
            "eye = [0.0",
            &format!("eye = [{bad}"),
            &format!("4:8: eye[0] is {bad}; eye must be {coordinate}"),
        );
    }
    let radiance = "radiance must be three numbers from 0 to 1e15 (limits of f32 kernels)";
    one(
        "[12, 12",
        "[12, -1",
        &format!("36:17: radiance[1] is -1; {radiance}"),
    );
    one(
        "[12, 12",
        "[12, 1e16",
        &format!("36:17: radiance[1] is 1e16; {radiance}"),
    );
    let color = "reflectance must be three numbers from 0 to 1";
    one(
        "[0.75",
        "[1.0001",
        &format!("17:16: reflectance[0] is 1.0001; {color}"),
    );
    one(
        "[0.75",
        "[-0.1",
        &format!("17:16: reflectance[0] is -0.1; {color}"),
    );
    for bad in ["0", "180", "-3", "nan"] {
        one(
            "vfov = 42",
            &format!("vfov = {bad}"),
            &format!("7:8: vfov is {bad}; vfov must be a number above 0 and below 180"),
        );
    }
    let pixels = "resolution must be [width, height], two whole numbers from 1 to 65536";
    one(
        "[512,",
        "[0,",
        &format!("8:15: resolution[0] is 0; {pixels}"),
    );
    one(
        "[512,",
        "[65537,",
        &format!("8:15: resolution[0] is 65537; {pixels}"),
    );
    for (key, value, bad, rule) in [
        ("max_depth", "64", "0", "1 to 4294967295"),
        ("strata", "2", "0", "1 to 1024"),
        ("strata", "2", "1025", "1 to 1024"),
        ("seed", "7", "-1", "0 to 4294967295"),
        ("seed", "7", "4294967296", "0 to 4294967295"),
        ("seed", "7", "1.0", "0 to 4294967295"),
    ] {
        let found = errors(&format!("{key} = {value}"), &format!("{key} = {bad}"));
        let expected = format!("{key} is {bad}; {key} must be a whole number from {rule}");
        assert!(found[0].ends_with(&expected), "{found:?}");
    }
    let ior = "ior must be a number from 1e-6 to 1e6 (limits of f32 kernels)";
    one(
        "ior = 1.5",
        "ior = 0.0",
        &format!("24:7: ior is 0.0; {ior}"),
    );
    let exponent = "exponent must be a number from 0 to 1e15 (limits of f32 kernels)";
    one(
        "exponent = 60",
        "exponent = -1",
        &format!("30:12: exponent is -1; {exponent}"),
    );
}

#[test]
fn degenerate_geometry() {
    let direction = "normal must be three finite numbers, not all 0";
    one(
        "[0, 1, 0]",
        "[0, 0.0, -0]",
        &format!("40:10: normal is [0, 0.0, -0]; {direction}"),
    );
    one(
        "[0, 1, 0]",
        "[0, inf, 0]",
        &format!("40:14: normal[1] is inf; {direction}"),
    );
    one(
        "look_at = [0.0, 1.0, 0.0]",
        "look_at = [0.0, 1.0, 3.8]",
        "5:11: look_at is at eye, but must be at least 1e-15 away from it",
    );
    one(
        "up = [0, 2, 0]",
        "up = [0, 0, 5e-300]",
        "6:6: up, along [0, 0, 1], is parallel to the view, along [0, 0, -1]; it must not be",
    );
    let up = FULL
        .replace("up = [0, 2, 0]\n", "")
        .replace("eye = [0.0, 1.0, 3.8]", "eye = [0, 9, 0]");
    assert_eq!(
        parse(&up).expect_err("looks down"),
        [
            "s.toml:3:1: up, along [0, 1, 0], is parallel to the view, along [0, -1, 0]; it must not be"
        ]
    );
    one(
        "top = [0.5, 0.9, -1.0]",
        "top = [0.5, 0.0, -1.0]",
        "45:7: top is at base, but must be at least 1e-15 away from it",
    );
    // Tiny and huge directions are as good as any.
    let text = FULL.replace("[0, 1, 0]", "[0, 3e-300, 4e-300]");
    let Shape::Plane { normal, .. } = parse(&text).expect("valid").primitives[2].shape else {
        panic!("a plane");
    };
    // A few roundings in f64.
    assert!(
        (normal - glam::DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15,
        "{normal}"
    );
}

#[test]
fn rules_between_keys() {
    one(
        "[0.4, 0.9, 0.4]",
        "[0.4, 0.95, 0.4]",
        "29:12: diffuse[1] + specular[1] is 0.1 + 0.95 = 1.05, but must be at most 1",
    );
    let rounding = FULL.replace("[0.4, 0.9, 0.4]", "[0.4, 0.9000000005, 0.4]");
    assert!(parse(&rounding).is_ok(), "within 1e-9 of 1");
    assert_eq!(
        errors("[0.4, 0.9, 0.4]", "[0.4, 0.900000002, 0.4]").len(),
        1
    );
    let disk = FULL.replace(
        "radius = 0.3\nmaterial = \"white\"",
        "radius = 0.3\nmaterial = \"glass\"",
    );
    assert_eq!(
        parse(&disk).expect_err("a glass disk"),
        [
            "s.toml:58:12: material \"glass\" is dielectric, but a disk bounds no solid; \
          dielectrics may be on spheres, cylinders and planes"
        ]
    );
}

#[test]
fn missing_keys_and_tables() {
    one(
        "radius = 0.125\n",
        "",
        "60:1: [[sphere]] lacks radius, which must be a number from 1e-15 to 1e15 \
         (limits of f32 kernels)",
    );
    one(
        "material = \"glass\"\n",
        "",
        "60:1: [[sphere]] lacks material, which must be a string",
    );
    one(
        "type = \"mirror\"\n",
        "",
        "19:1: [material.steel] lacks type, which must be a string",
    );
    one(
        "vfov = 42\n",
        "",
        "3:1: [camera] lacks vfov, which must be a number above 0 and below 180",
    );

    let (start, rest) = FULL.split_once("[camera]").expect("a camera");
    let without_camera = format!("{start}{}", &rest[rest.find("[render]").expect("render")..]);
    assert_eq!(
        parse(&without_camera).expect_err("no camera"),
        ["s.toml: no [camera]: a scene has one"]
    );
    let light =
        &FULL[FULL.find("[[light]]").expect("light")..FULL.find("[[plane]]").expect("plane")];
    assert_eq!(
        parse(&FULL.replace(light, "")).expect_err("no light"),
        ["s.toml: no [[light]]: a scene has at least one, or it is black"]
    );
    let bare = &FULL[..FULL.find("[[plane]]").expect("plane")];
    let no_primitive = [
        "s.toml: no primitive: a scene has at least one [[sphere]], [[plane]], [[disk]] or [[cylinder]]",
    ];
    assert_eq!(parse(bare).expect_err("nothing there"), no_primitive);
    let empty_array = format!("sphere = []\n{bare}");
    assert_eq!(
        parse(&empty_array).expect_err("nothing there"),
        no_primitive
    );
    for empty in ["", "\n\r\n", "# only a comment\n", "\u{feff}"] {
        assert_eq!(
            parse(empty).expect_err("empty"),
            [
                "s.toml: is empty; a scene has [camera], a [[light]], and a \
              [[sphere]], [[plane]], [[disk]] or [[cylinder]]"
            ]
        );
    }
}

#[test]
fn duplicates_and_syntax() {
    let once = "a key or [table] stands once; only [[tables]] repeat";
    one(
        "vfov = 42",
        "vfov = 42\nvfov = 43",
        &format!("8:1: duplicate \"vfov\": {once}"),
    );
    one(
        "[[plane]]",
        "[render]\n[[plane]]",
        &format!("38:2: duplicate \"render\": {once}"),
    );
    let material = errors("[material.steel]", "[material.white]");
    assert_eq!(
        material[0],
        format!("s.toml:19:11: duplicate \"white\": {once}")
    );
    for (old, new, place) in [
        ("vfov = 42", "vfov = ", "s.toml:7:8: not TOML: "),
        ("[camera]", "[camera", "s.toml:3:8: not TOML: "),
        ("\"Everything\"", "\"Everything", "s.toml:1:20: not TOML: "),
        (
            "vfov = 42",
            "vfov 42",
            "s.toml:7:6: not TOML: key with no value",
        ),
    ] {
        let found = errors(old, new);
        assert!(found[0].starts_with(place), "{found:?}");
    }
    let deep = format!("vfov = {}", "[".repeat(100_000));
    let found = errors("vfov = 42", &deep);
    assert!(
        found[0].contains("recursion") && found.len() < 60,
        "{}",
        found[0]
    );
    let dotted = format!("[a{}]", ".a".repeat(100_000));
    assert!(!errors("[render]", &dotted).is_empty());
}

#[test]
fn independent_errors_are_all_reported_in_file_order() {
    let text = FULL
        .replace("vfov = 42", "vfov = 420")
        .replace("seed = 7", "sead = 7")
        .replace("ior = 1.5", "ior = \"high\"")
        .replace("radius = 0.3", "radius = 0");
    let errors = parse(&text).expect_err("four errors");
    let lines: Vec<&str> = errors.iter().filter_map(|e| e.split(':').nth(1)).collect();
    assert_eq!(lines, ["7", "13", "24", "57"], "{errors:#?}");
    let many = format!("{FULL}{}", "[[sphere]]\n".repeat(100));
    let errors = parse(&many).expect_err("300 missing keys");
    assert_eq!(errors.len(), 51);
    assert_eq!(errors[50], "s.toml: 250 more errors");
}

#[test]
fn messages_are_short_lines_whatever_the_file_holds() {
    let long = "x".repeat(10_000);
    for (old, new) in [
        ("material = \"glass\"", format!("material = \"{long}\"")),
        ("vfov = 42", format!("vfov = \"\"\"\n{long}\n\"\"\"")),
        ("vfov = 42", format!("\"\\u001b[31m\\n{long}\" = 1")),
        (
            "[material.steel]",
            format!("[material.\"\\u001b\\n{long}\"]\nx = 1\n[material.steel]"),
        ),
    ] {
        for error in errors(old, &new) {
            assert!(!error.contains(char::is_control), "{error:?}");
            assert!(error.chars().count() < 400, "{error}");
        }
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let missing = folder.path().join("missing.toml");
    for (path, kind) in [
        (missing.as_path(), ErrorKind::NotFound),
        (folder.path(), ErrorKind::IsADirectory),
    ] {
        match read(path) {
            Err(error @ ReadError::Io { .. }) => {
                let message = error.to_string();
                assert!(
                    message.starts_with(&path.display().to_string()),
                    "{message}"
                );
                let ReadError::Io { source, .. } = error else {
                    unreachable!("matched above");
                };
                assert_eq!(source.kind(), kind);
            }
            other => panic!("{other:?}"),
        }
    }
}

/// The message about a file with this content, without its path.
fn message_about(content: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("s.toml");
    std::fs::write(&path, content).expect("written");
    let Err(ReadError::Invalid(errors)) = read(&path) else {
        panic!("{content:?} passes");
    };
    let shown = errors[0].to_string();
    let name = path.display().to_string();
    shown
        .strip_prefix(&name)
        .expect("begins with the path")
        .to_owned()
}

#[test]
fn files_that_are_no_text() {
    let utf8 = "is not UTF-8, but a scene file is UTF-8 text";
    assert_eq!(
        message_about(b"\xff\xfe[\0c\0"),
        format!(":1:1: byte 0xff {utf8}")
    );
    assert_eq!(
        message_about(b"title = \"x\"\r\n# \xc3\xb6 \xe9t\xe9\n"),
        format!(":2:5: byte 0xe9 {utf8}")
    );
    assert_eq!(
        message_about(b"\xef\xbb\xbf\xc3"),
        format!(":1:1: byte 0xc3 {utf8}")
    );
    let nul = "a NUL character, but a scene file is TOML text";
    assert_eq!(message_about(b"title\0 = 1"), format!(":1:6: {nul}"));
    let png = message_about(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    assert_eq!(png, format!(":1:1: byte 0x89 {utf8}"));
    let zip = message_about(b"PK\x03\x04\x14\x00\x06");
    assert_eq!(zip, format!(":1:6: {nul}"));
    assert!(message_about(b"").starts_with(": is empty"));
}

#[test]
fn files_of_absurd_size() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("large.toml");
    let file = std::fs::File::create(&path).expect("created");
    // Sparse: it takes no room.
    file.set_len(MAX_FILE_BYTES + 1).expect("grown");
    let error = read(&path).expect_err("too large").to_string();
    let expected = "is 67108865 bytes long or longer; a scene file has at most 64 MiB";
    assert!(error.ends_with(expected), "{error}");
    assert!(matches!(read(&path), Err(ReadError::Invalid(_))));

    file.set_len(MAX_FILE_BYTES).expect("cut");
    let error = read(&path).expect_err("NULs").to_string();
    assert!(
        error.contains("NUL"),
        "as large as allowed, and read: {error}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn endless_devices_end() {
    let error = read(Path::new("/dev/zero"))
        .expect_err("endless")
        .to_string();
    assert!(error.ends_with("at most 64 MiB"), "{error}");
}

#[test]
fn a_read_file_knows_its_path() {
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("full.toml");
    std::fs::write(&path, FULL).expect("written");
    let scene = read(&path).expect("valid");
    assert_eq!(scene.path, path);
}
