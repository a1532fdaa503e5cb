//! `etendue export`: pbrt's files by a strict reader of its grammar, Mitsuba's by their elements, and what is said of differences.
//! `scripts/against-mitsuba` renders Mitsuba's.

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn export(scene: &Path, to: &str, more: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(assert_cmd::cargo::cargo_bin!("etendue"))
        .arg("export")
        .arg(scene)
        .args(["--to", to, "-o", "-"])
        .args(more)
        .assert()
}

fn text(done: &assert_cmd::assert::Assert) -> String {
    String::from_utf8(done.get_output().stdout.clone()).expect("text")
}

/// Whether the scene has a surface that no other renderer has.
fn is_implicit(scene: &Path) -> bool {
    let text = std::fs::read_to_string(scene).expect("a scene");
    text.contains("[[implicit]]") || text.contains("[[isosurface]]")
}

#[test]
fn implicit_surfaces_are_refused() {
    for (name, line) in [("torus", 33), ("density", 35), ("peptide", 31)] {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let place = format!("{name}.toml:{line}:1: an implicit surface has no equal");
        for to in ["mitsuba", "pbrt"] {
            let done = export(&scene, to, &[]).failure();
            let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
            assert!(said.contains(&place) && text(&done).is_empty(), "{said}");
        }
    }
}

fn scenes() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders =
        ["scenes", "tests/scenes"].map(|f| std::fs::read_dir(root.join(f)).expect("a folder"));
    let paths = folders
        .into_iter()
        .flatten()
        .map(|e| e.expect("an entry").path());
    let mut scenes: Vec<PathBuf> = paths
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .filter(|p| !is_implicit(p))
        .collect();
    scenes.sort();
    assert!(scenes.len() > 15);
    scenes
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Word(String),
    Text(String),
    Number(f64),
    Open,
    Close,
}

/// pbrt-v4's tokens.
fn tokens(text: &str) -> Vec<Token> {
    let mut out = Vec::new();
    for line in text.lines() {
        let mut rest = line.trim_start();
        while let Some(c) = rest.chars().next() {
            let end = match c {
                '#' => break,
                '[' | ']' => {
                    out.push(if c == '[' { Token::Open } else { Token::Close });
                    1
                }
                '"' => {
                    let (mut value, mut escaped, mut end) = (String::new(), false, None);
                    for (k, c) in rest.char_indices().skip(1) {
                        match c {
                            _ if escaped => {
                                value.push(c);
                                escaped = false;
                            }
                            '\\' => escaped = true,
                            '"' => {
                                end = Some(k + 1);
                                break;
                            }
                            c => value.push(c),
                        }
                    }
                    out.push(Token::Text(value));
                    end.unwrap_or_else(|| panic!("a string without an end: {line}"))
                }
                _ => {
                    let end = rest
                        .find(|c: char| c.is_whitespace() || "[]\"#".contains(c))
                        .unwrap_or(rest.len());
                    let word = &rest[..end];
                    out.push(
                        word.parse()
                            .map_or_else(|_| Token::Word(word.into()), Token::Number),
                    );
                    end
                }
            };
            rest = rest[end..].trim_start();
        }
    }
    out
}

/// Parameters that may follow, by the directive and its kind: types and names as in the file format of pbrt-v4.
const PARAMETERS: &[(&str, &str, &[&str])] = &[
    ("Camera", "perspective", &["float fov"]),
    (
        "Film",
        "rgb",
        &[
            "string filename",
            "integer xresolution",
            "integer yresolution",
        ],
    ),
    ("PixelFilter", "box", &["float xradius", "float yradius"]),
    ("Sampler", "independent", &["integer pixelsamples"]),
    ("Integrator", "path", &["integer maxdepth"]),
    ("AreaLightSource", "diffuse", &["rgb L", "bool twosided"]),
    ("Material", "diffuse", &["rgb reflectance"]),
    ("Material", "dielectric", &["float eta"]),
    (
        "Material",
        "conductor",
        &["rgb reflectance", "float roughness", "bool remaproughness"],
    ),
    ("Material", "mix", &["string materials", "float amount"]),
    ("Shape", "sphere", &["float radius"]),
    ("Shape", "disk", &["float radius"]),
    (
        "Shape",
        "cylinder",
        &["float radius", "float zmin", "float zmax"],
    ),
    ("Shape", "bilinearmesh", &["point3 P"]),
];

/// What a file has of each directive. Panics where it breaks a rule.
fn read_pbrt(text: &str) -> BTreeMap<String, usize> {
    let all = tokens(text);
    let mut at = 0;
    let mut counts = BTreeMap::new();
    let mut materials = BTreeSet::new();
    let (mut world, mut depth) = (false, 0);
    while at < all.len() {
        let Token::Word(word) = &all[at] else {
            panic!("{:?} in place of a directive", all[at])
        };
        at += 1;
        *counts.entry(word.clone()).or_insert(0) += 1;
        let mut string = || {
            let Token::Text(text) = &all[at] else {
                panic!("{:?} in place of a string", all[at])
            };
            at += 1;
            text.clone()
        };
        let options = [
            "Camera",
            "Film",
            "PixelFilter",
            "Sampler",
            "Integrator",
            "LookAt",
            "Scale",
            "WorldBegin",
        ];
        assert_eq!(
            options.contains(&word.as_str()),
            !world,
            "{word} stands on the wrong side of WorldBegin"
        );
        match word.as_str() {
            "WorldBegin" => world = true,
            "AttributeBegin" => depth += 1,
            "AttributeEnd" => {
                depth -= 1;
                assert!(depth >= 0);
            }
            "Scale" | "Translate" => at += numbers(&all[at..], 3),
            "LookAt" => at += numbers(&all[at..], 9),
            "ConcatTransform" => {
                assert_eq!(all[at], Token::Open);
                let m = &all[at + 1..at + 17];
                let number = |k: usize| match m[k] {
                    Token::Number(x) => x,
                    _ => panic!("{m:?}"),
                };
                // Axes of unit length at right angles, and no mirror image.
                let column = |c: usize| [0, 1, 2].map(|r| number(4 * c + r));
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let [x, y, z] = [0, 1, 2].map(column);
                let cross = [
                    x[1] * y[2] - x[2] * y[1],
                    x[2] * y[0] - x[0] * y[2],
                    x[0] * y[1] - x[1] * y[0],
                ];
                assert!(
                    (dot(x, x) - 1.0).abs() < 1e-9
                        && dot(x, y).abs() < 1e-9
                        && (dot(cross, z) - 1.0).abs() < 1e-9
                );
                assert_eq!(
                    [number(3), number(7), number(11), number(15)],
                    [0.0, 0.0, 0.0, 1.0]
                );
                assert_eq!(all[at + 17], Token::Close);
                at += 18;
            }
            "NamedMaterial" => {
                assert!(materials.contains(&string()), "a material that is not made");
            }
            "MakeNamedMaterial" => {
                assert!(materials.insert(string()), "a material made twice");
                assert_eq!(string(), "string type");
                let kind = string();
                at += parameters(&all[at..], "Material", &kind);
            }
            _ => {
                let kind = string();
                at += parameters(&all[at..], word, &kind);
            }
        }
    }
    assert!(world && depth == 0);
    counts
}

fn numbers(tokens: &[Token], count: usize) -> usize {
    assert!(
        tokens[..count]
            .iter()
            .all(|t| matches!(t, Token::Number(_))),
        "{:?}",
        &tokens[..count]
    );
    count
}

/// How many tokens the parameters take.
fn parameters(tokens: &[Token], directive: &str, kind: &str) -> usize {
    let found = PARAMETERS.iter().find(|p| p.0 == directive && p.1 == kind);
    let known = found
        .unwrap_or_else(|| panic!("no {directive} \"{kind}\""))
        .2;
    let mut at = 0;
    while let Some(Token::Text(name)) = tokens.get(at) {
        assert!(
            known.contains(&name.as_str()),
            "{directive} \"{kind}\" has no \"{name}\""
        );
        at += 1;
        let values: &[Token] = if tokens[at] == Token::Open {
            let end = tokens[at..]
                .iter()
                .position(|t| *t == Token::Close)
                .expect("a bracket without an end");
            let values = &tokens[at + 1..at + end];
            at += end + 1;
            values
        } else {
            at += 1;
            &tokens[at - 1..at]
        };
        let number = |t: &Token| matches!(t, Token::Number(x) if x.is_finite());
        let whole = |t: &Token| matches!(t, Token::Number(x) if x.fract() == 0.0 && x.abs() < 2f64.powi(31));
        let right = match name.split_once(' ').expect("a type and a name").0 {
            "float" => values.len() == 1 && number(&values[0]),
            "integer" => values.len() == 1 && whole(&values[0]),
            "rgb" => values.len() == 3 && values.iter().all(number),
            "point3" => values.len() == 12 && values.iter().all(number),
            "string" => values.iter().all(|t| matches!(t, Token::Text(_))),
            "bool" => matches!(values, [Token::Word(w)] if w == "true" || w == "false"),
            _ => false,
        };
        assert!(right, "{directive} \"{kind}\": {name} is {values:?}");
    }
    at
}

#[test]
fn every_scene_is_a_pbrt_file() {
    for scene in scenes() {
        let counts = read_pbrt(&text(&export(&scene, "pbrt", &[]).success()));
        let toml = std::fs::read_to_string(&scene).expect("a scene");
        let count = |table: &str| {
            toml.lines()
                .filter(|l| l.starts_with(&format!("[[{table}]]")))
                .count()
        };
        assert_eq!(
            counts["AreaLightSource"],
            count("light"),
            "{}",
            scene.display()
        );
        // A cylinder has two caps; planes behind others are left out.
        let most = count("light")
            + count("sphere")
            + count("disk")
            + count("plane")
            + 3 * count("cylinder");
        let behind = most - counts["Shape"];
        assert!(behind <= count("plane"), "{}", scene.display());
    }
}

/// What pbrt-v4 would refuse, or take for something else, our reader refuses.
#[test]
fn the_reader_is_strict() {
    let sphere = "Shape \"sphere\" \"float radius\" 1";
    read_pbrt(&format!("WorldBegin\n{sphere}"));
    for (text, why) in [
        (
            "WorldBegin\nShape \"sphere\" \"float raduis\" 1",
            "has no \"float raduis\"",
        ),
        (
            "WorldBegin\nShape \"sphere\" \"integer radius\" 1",
            "has no \"integer radius\"",
        ),
        (
            "WorldBegin\nShape \"ball\" \"float radius\" 1",
            "no Shape \"ball\"",
        ),
        (
            "WorldBegin\nShape \"sphere\" \"float radius\" \"1\"",
            "float radius is",
        ),
        (
            "WorldBegin\nShape \"sphere\" \"float radius\" inf",
            "float radius is",
        ),
        (
            "WorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 1]",
            "rgb L is",
        ),
        (
            "WorldBegin\nAreaLightSource \"diffuse\" \"bool twosided\" \"false\"",
            "bool twosided is",
        ),
        (
            "Sampler \"independent\" \"integer pixelsamples\" 1.5\nWorldBegin",
            "integer pixelsamples is",
        ),
        (
            "WorldBegin\nNamedMaterial \"glass\"",
            "a material that is not made",
        ),
        (
            "WorldBegin\nMakeNamedMaterial \"a\" \"string type\" \"phong\"",
            "no Material \"phong\"",
        ),
        (
            "WorldBegin\nCamera \"perspective\" \"float fov\" 40",
            "on the wrong side of WorldBegin",
        ),
        (sphere, "on the wrong side of WorldBegin"),
        ("WorldBegin\nAttributeEnd", "depth >= 0"),
        ("WorldBegin\nAttributeBegin", "depth == 0"),
        (
            "WorldBegin\nTranslate 1 2",
            "index out of range|out of range for slice|range end index",
        ),
        ("WorldBegin\n\"sphere\"", "in place of a directive"),
        ("WorldBegin\nShape \"sphere", "a string without an end"),
    ] {
        let fault = std::panic::catch_unwind(|| read_pbrt(text)).expect_err(text);
        let said = fault.downcast_ref::<String>().cloned();
        let said = said.or_else(|| fault.downcast_ref::<&str>().map(|s| (*s).to_owned()));
        let said = said.unwrap_or_default();
        assert!(why.split('|').any(|w| said.contains(w)), "{text:?}: {said}");
    }
}

#[test]
fn every_scene_is_xml_for_mitsuba() {
    for scene in scenes() {
        let xml = text(&export(&scene, "mitsuba", &["--spp", "9", "--size", "30x20"]).success());
        assert!(
            xml.contains("<default name=\"spp\" value=\"9\"/>")
                && xml.contains("name=\"width\" value=\"30\"")
        );
        // Every element is closed in its turn.
        let mut open = Vec::new();
        for tag in xml
            .split('<')
            .skip(1)
            .map(|t| t.split_once('>').expect("a tag").0)
        {
            let name = tag.split_whitespace().next().expect("a name");
            if let Some(name) = name.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name));
            } else if !tag.ends_with('/') && !tag.starts_with('!') {
                open.push(name);
            }
        }
        assert!(open.is_empty());
        for reference in xml.split("<ref id=\"").skip(1) {
            let id = reference.split('"').next().expect("an id");
            assert!(xml.contains(&format!("\" id=\"{id}\">")), "{id}");
        }
    }
}

#[test]
fn what_differs_is_said_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = |name: &str| root.join("scenes").join(name);
    export(&scene("three_materials.toml"), "mitsuba", &[])
        .success()
        .stderr("");
    export(&scene("phong_gallery.toml"), "mitsuba", &[])
        .success()
        .stderr(
            contains("has no Phong")
                .count(1)
                .and(contains("metal_1, metal_10,")),
        );
    export(&scene("caustic.toml"), "pbrt", &["-q"])
        .success()
        .stderr(contains(
            "warning: materials amber, aqua: pbrt's glass has no tint",
        ))
        .stderr(contains("reflects more at grazing angles"));
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("odd.toml");
    std::fs::write(&path, ODD).expect("written");
    let done = export(&path, "mitsuba", &[])
        .success()
        .stderr(contains(
            "a plane of a \"b\" & <c> has no end; the export has a rectangle of ",
        ))
        .stderr(contains("material air: ior = 1 becomes 1.000001"));
    let xml = text(&done);
    assert!(xml.starts_with("<!-- a - - - b &lt;!- - &quot;"), "{xml}");
    assert!(xml.contains("id=\"a &quot;b&quot; &amp; &lt;c&gt;\""));
    read_pbrt(&text(&export(&path, "pbrt", &[]).success()));
}

/// Names and a title that other formats must quote, glass of index 1, and a floor without an end.
const ODD: &str = r#"
title = 'a --- b <!-- "'
[camera]
eye = [0, 1, 4]
look_at = [0, 1, 0]
vfov = 40
resolution = [30, 40]
[material.'a "b" & <c>']
type = "diffuse"
reflectance = [0.5, 0.5, 0.5]
[material.air]
type = "dielectric"
ior = 1
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
material = 'a "b" & <c>'
[[sphere]]
center = [0, 1, 0]
radius = 0.5
material = "air"
[[light]]
center = [0, 3, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [9, 9, 9]
"#;

#[test]
fn wrong_input_is_named() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    export(&root.join("scenes/none.toml"), "pbrt", &[])
        .code(4)
        .stderr(contains("none.toml"));
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("odd.toml");
    std::fs::write(&path, ODD).expect("written");
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("etendue"));
    command
        .arg("export")
        .arg(&path)
        .args(["--to", "pbrt", "-o"])
        .arg(&path);
    command
        .assert()
        .code(2)
        .stderr(contains("would overwrite the scene"));
    assert_eq!(std::fs::read_to_string(&path).expect("a scene"), ODD);
}
