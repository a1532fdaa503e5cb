//! Compares the JSON Schema of scene files with the parser: both must accept and reject the same files.

use etendue::provenance::hash::scene_hash;
use etendue::scene::parse::parse_str;
use etendue::scene::schema::schema;
use etendue::settings::{Overrides, Settings};
use serde_json::{Value, json};
use std::path::Path;

const SMALL: &str = "\
[camera]
eye = [0, 1, 4]
look_at = [0, 1.0, 0]
vfov = 40
resolution = [64, 48]
[material.white]
type = 'diffuse'
reflectance = [0.7, 0.7, 0.7]
[[sphere]]
center = [0, 0, 0]
radius = 1
material = 'white'
[[light]]
center = [0, 4, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [9, 9, 9]
";

/// With every table and every key.
const LARGE: &str = "\
title = 'Large'
[camera]
eye = [0.0, 1.0, 4e3]
look_at = [0, 1, 0]
up = [0, 1, 0.5]
vfov = 179.5
resolution = [65536, 1]
[render]
max_depth = 1
strata = 1024
seed = 4294967295
[material.white]
type = 'diffuse'
reflectance = [0, 1, 0.5]
[material.steel]
type = 'mirror'
reflectance = [0.9, 0.9, 0.9]
[material.glass]
type = 'dielectric'
ior = 1.5
transmittance = [1, 0.9, 1]
[material.air]
type = 'dielectric'
[material.gloss]
type = 'phong'
diffuse = [0.5, 0.5, 0.5]
specular = [0.5, 0.5, 0.5]
exponent = 0
[[sphere]]
center = [0, 0, 0]
radius = 1e-15
material = 'white'
[[plane]]
point = [1e15, 0, 0]
normal = [0, 1e-20, 0]
material = 'glass'
[[disk]]
center = [0, 0, 0]
normal = [1, 2, 3]
radius = 5
material = 'steel'
[[cylinder]]
base = [0, 0, 0]
top = [0, 1, 0]
radius = 2
material = 'gloss'
[[implicit]]
f = 'a x^2 + y'
parameters = { a = 2 }
level = -1e3
center = [0, 1, 0]
scale = 0.5
rotation = { axis = [0, 1, 0], angle = 400 }
bounds = { min = [-1, -1, -1], max = [1, 1, 1] }
closed = false
material = 'gloss'
[[implicit]]
f = 'x'
rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
bounds = { radius = 3 }
material = 'glass'
[[isosurface]]
file = 'scenes/density.npy'
order = 'zyx'
level = 1e4
inside = 'above'
origin = [-1, -1, -1]
spacing = [0.05, 0.05, 0.05]
rotation = { axis = [0, 1, 0], angle = 400 }
closed = false
material = 'gloss'
[[isosurface]]
file = 'scenes/density.npy'
level = 2e4
origin = [-1, -1, -1]
spacing = [0.05, 0.05, 0.05]
material = 'glass'
[[light]]
center = [0, 4, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [0, 9, 1e15]
[[light]]
center = [1, 4, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [0, 9, 9]
";

/// Whether `value` satisfies `schema`; knows just the keywords that ours has, and fails on others.
fn valid(schema: &Value, value: &Value) -> bool {
    let keywords = schema.as_object().expect("a schema is an object");
    let count = |v: &Value| v.as_array().map_or(0, Vec::len) as u64;
    keywords
        .iter()
        .all(|(keyword, rule)| match keyword.as_str() {
            "$schema" | "title" | "description" | "default" => true,
            "type" => match rule.as_str().expect("one type") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "boolean" => value.is_boolean(),
                "number" => value.is_number(),
                "integer" => value.is_u64() || value.is_i64(),
                other => panic!("unknown type {other}"),
            },
            "properties" => value.as_object().is_none_or(|object| {
                let known = |key: &String| rule.get(key);
                object
                    .iter()
                    .all(|(key, v)| known(key).is_none_or(|s| valid(s, v)))
            }),
            "additionalProperties" => value.as_object().is_none_or(|object| {
                let known = |key: &&String| schema["properties"].get(key.as_str()).is_some();
                let mut others = object.keys().filter(|k| !known(k));
                match rule {
                    Value::Bool(false) => others.next().is_none(),
                    rule => others.all(|k| valid(rule, &object[k])),
                }
            }),
            "required" => rule
                .as_array()
                .expect("a list")
                .iter()
                .all(|key| value.get(key.as_str().expect("a key")).is_some()),
            "items" => value
                .as_array()
                .is_none_or(|a| a.iter().all(|v| valid(rule, v))),
            "minItems" => !value.is_array() || count(value) >= rule.as_u64().expect("a count"),
            "maxItems" => !value.is_array() || count(value) <= rule.as_u64().expect("a count"),
            "contains" => value
                .as_array()
                .is_none_or(|a| a.iter().any(|v| valid(rule, v))),
            "not" => !valid(rule, value),
            "const" => value == rule || (rule.is_number() && value.as_f64() == rule.as_f64()),
            "enum" => rule.as_array().expect("a list").contains(value),
            "minimum" => value.as_f64() >= rule.as_f64(),
            "maximum" => value.as_f64() <= rule.as_f64(),
            "exclusiveMinimum" => value.as_f64() > rule.as_f64(),
            "exclusiveMaximum" => value.as_f64() < rule.as_f64(),
            "oneOf" => {
                let schemas = rule.as_array().expect("a list");
                schemas.iter().filter(|s| valid(s, value)).count() == 1
            }
            "anyOf" => {
                let schemas = rule.as_array().expect("a list");
                schemas.iter().any(|s| valid(s, value))
            }
            "allOf" => {
                let schemas = rule.as_array().expect("a list");
                schemas.iter().all(|s| valid(s, value))
            }
            other => panic!("unknown keyword {other}"),
        })
}

fn to_json(text: &str) -> Value {
    toml::from_str(text).expect("TOML")
}

#[test]
fn valid_scenes_satisfy_the_schema() {
    for text in [SMALL, LARGE] {
        assert!(parse_str(Path::new("x.toml"), text).is_ok());
        assert!(valid(&schema(), &to_json(text)));
    }
}

#[test]
fn the_parser_rejects_what_the_schema_rejects() {
    for (old, new) in [
        ("vfov = 179.5", "vfov = 180"),
        ("vfov = 179.5", "vfov = '42'"),
        ("vfov = 179.5", ""),
        ("vfov = 179.5", "vfov = 4\nfov = 4"),
        ("[65536, 1]", "[65537, 1]"),
        ("[65536, 1]", "[512.5, 1]"),
        ("[65536, 1]", "[512, 1, 1]"),
        ("max_depth = 1", "max_depth = 0"),
        ("strata = 1024", "strata = 1025"),
        ("seed = 4294967295", "seed = 4294967296"),
        ("[0, 1, 0.5]", "[0, 0, 0]"),
        ("[0, 1e-20, 0]", "[0.0, 0, -0.0]"),
        ("reflectance = [0, 1, 0.5]", "reflectance = [0, 1.1, 0.5]"),
        ("reflectance = [0, 1, 0.5]", ""),
        ("reflectance = [0, 1, 0.5]", "transmittance = [0, 1, 0.5]"),
        ("type = 'phong'", "type = 'plastic'"),
        ("type = 'phong'", "type = 'mirror'"),
        ("exponent = 0", "exponent = -1"),
        ("ior = 1.5", "ior = 0"),
        ("radius = 1e-15", "radius = 0"),
        ("radius = 5", "radius = 1e16"),
        ("[1e15, 0, 0]", "[2e15, 0, 0]"),
        ("[0, 9, 1e15]", "[0, 9, -1]"),
        ("material = 'steel'", ""),
        ("material = 'steel'", "material = 3"),
        ("[[disk]]", "[[disc]]"),
        ("title = 'Large'", "title = 3"),
    ] {
        // `up` is the first of the vectors that are alike.
        assert!(LARGE.contains(old), "no {old}");
        let text = LARGE.replacen(old, new, 1);
        let place = Path::new("x.toml");
        assert!(parse_str(place, &text).is_err(), "parser: {old} -> {new}");
        assert!(!valid(&schema(), &to_json(&text)), "schema: {old} -> {new}");
    }
}

#[test]
fn whole_tables_are_required() {
    let (before, light) = SMALL.split_at(SMALL.find("[[light]]").expect("a light"));
    let (head, _) = before.split_at(before.find("[[sphere]]").expect("a sphere"));
    let camera = head.find("[material").expect("a material");
    for text in [
        before.to_owned(),
        format!("light = []\n{before}"),
        format!("{head}{light}"),
        format!("sphere = []\n{head}{light}"),
        SMALL[camera..].to_owned(),
    ] {
        assert!(!valid(&schema(), &to_json(&text)), "{text}");
        assert!(parse_str(Path::new("x.toml"), &text).is_err(), "{text}");
    }
}

#[test]
fn rows_of_spheres_and_lights_stand_for_tables() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write("points.csv", "x,y,z,radius\n0,0,0,1\n");
    write(
        "lamps.csv",
        "x,y,z,nx,ny,nz,radius,r,g,b\n0,4,0,0,-1,0,0.5,9,9,9\n",
    );
    let (head, _) = SMALL.split_at(SMALL.find("[[sphere]]").expect("a sphere"));
    let text = format!(
        "{head}[[spheres]]\nfile = 'points.csv'\nmaterial = 'white'\n[[lights]]\nfile = 'lamps.csv'\n"
    );
    let place = folder.path().join("x.toml");
    let rows = parse_str(&place, &text).expect("a scene");
    assert!(valid(&schema(), &to_json(&text)));
    // The same in tables is the same scene.
    let tables = parse_str(&place, SMALL).expect("a scene");
    let hash = |s| scene_hash(s, &Settings::resolve(s, &Overrides::default()));
    assert_eq!(hash(&rows), hash(&tables));

    for (old, new, fault) in [
        (
            "file = 'points.csv'\n",
            "",
            "missing key file in [[spheres]]",
        ),
        ("points.csv", "no.csv", "cannot read"),
        ("'white'", "'wite'", "did you mean \"white\"?"),
        (
            "material = 'white'\n",
            "",
            "points.csv:1: no column material",
        ),
    ] {
        let text = text.replacen(old, new, 1);
        let errors = parse_str(&place, &text).expect_err(new);
        assert!(errors[0].to_string().contains(fault), "{}", errors[0]);
    }
}

#[test]
fn rows_with_colors_stand_for_materials_and_cylinders() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write(
        "atoms.csv",
        "r,g,b,x,y,z,radius\n0.5,0.25,1,0,0,0,1\n0.5,0.25,1,3,0,0,1\n",
    );
    write(
        "bonds.csv",
        "x1,y1,z1,x2,y2,z2,radius,r,g,b\n0,0,0,3,0,0,0.1,-0,1,0\n",
    );
    let (head, tail) = SMALL.split_at(SMALL.find("[[sphere]]").expect("a sphere"));
    let light = &tail[tail.find("[[light]]").expect("a light")..];
    let text = format!(
        "{head}[[spheres]]\nfile = 'atoms.csv'\n[[cylinders]]\nfile = 'bonds.csv'\n{light}"
    );
    let place = folder.path().join("x.toml");
    let rows = parse_str(&place, &text).expect("a scene");
    assert!(valid(&schema(), &to_json(&text)));
    let tables = format!(
        "{head}[material.a]\ntype = 'diffuse'\nreflectance = [0.5, 0.25, 1]\n\
         [material.b]\ntype = 'diffuse'\nreflectance = [0, 1, 0]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'a'\n\
         [[sphere]]\ncenter = [3, 0, 0]\nradius = 1\nmaterial = 'a'\n\
         [[cylinder]]\nbase = [0, 0, 0]\ntop = [3, 0, 0]\nradius = 0.1\nmaterial = 'b'\n{light}"
    );
    let tables = parse_str(&place, &tables).expect("a scene");
    let hash = |s| scene_hash(s, &Settings::resolve(s, &Overrides::default()));
    assert_eq!(hash(&rows), hash(&tables));
    assert_eq!(rows.row_files.len(), 2);
    // A colour beside a material is none too many or none too few.
    let both = text.replace("'atoms.csv'\n", "'atoms.csv'\nmaterial = 'white'\n");
    let errors = parse_str(&place, &both).expect_err("both");
    assert!(
        errors[0]
            .to_string()
            .contains("column \"r\" and the key material of the scene's table say the same"),
        "{}",
        errors[0]
    );
}

/// Defaults satisfy their own rules, and every key has a text to show.
#[test]
fn the_schema_is_complete_for_editors() {
    fn walk(schema: &Value, defaults: &mut usize) {
        let properties = schema["properties"].as_object();
        for (key, property) in properties.into_iter().flatten() {
            let shown = property["description"]
                .as_str()
                .or(property["items"]["description"].as_str());
            assert!(shown.is_some_and(|s| !s.is_empty()), "{key}");
            if let Some(default) = property.get("default") {
                assert!(valid(property, default), "{key}: {default}");
                *defaults += 1;
            }
            walk(property, defaults);
            walk(&property["items"], defaults);
        }
        for other in schema["additionalProperties"]["oneOf"]
            .as_array()
            .into_iter()
            .flatten()
        {
            assert!(other["title"].is_string());
            walk(other, defaults);
        }
    }
    let schema = schema();
    let mut defaults = 0;
    walk(&schema, &mut defaults);
    // up; max_depth, strata, seed; the mirror's reflectance; ior, transmittance; level, center, scale, rotation, closed of a formula;
    // order, inside, rotation, closed, normals of a volume.
    assert_eq!(defaults, 17);
    assert_eq!(
        schema["$schema"],
        json!("http://json-schema.org/draft-07/schema#")
    );
    assert!(schema["title"].is_string() && schema["description"].is_string());
}
