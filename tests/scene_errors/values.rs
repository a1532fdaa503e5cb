//! Wrong types, values out of range, and rules between keys.

use super::{FULL, errors, one, parse};
use etendue::scene::Shape;

#[test]
fn wrong_types() {
    // Where there is no number, the reason for the limits of numbers does not matter.
    let radius = "radius must be a number from 1e-15 to 1e15";
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
    // Tables without text of their own.
    let vfov = "vfov must be a number above 0 and below 180";
    one(
        "vfov = 42",
        "vfov.x = 42",
        &format!("7:1: vfov is a table; {vfov}"),
    );
    one(
        "vfov = 42\nresolution = [512, 384]\n",
        "resolution = [512, 384]\n[[camera.vfov]]\nx = 1\n",
        &format!("8:1: vfov is an array of tables; {vfov}"),
    );
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
        "3:1: camera is [[camera]], but must be a single table [camera]",
    );
    assert_eq!(
        errors("[[plane]]", "[plane]")[0],
        "s.toml:38:1: plane must be an array of tables; write [[plane]] for each one"
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
        "5:11: look_at equals eye, but must be at least 1e-15 away from it",
    );
    one(
        "up = [0, 2, 0]",
        "up = [0, 0, 5e-300]",
        "6:6: up (direction [0, 0, 1]) is parallel to the view (direction [0, 0, -1]), but must not be",
    );
    let up = FULL
        .replace("up = [0, 2, 0]\n", "")
        .replace("eye = [0.0, 1.0, 3.8]", "eye = [0, 9, 0]");
    assert_eq!(
        parse(&up).expect_err("looks down"),
        [
            "s.toml:3:1: up (direction [0, 1, 0]) is parallel to the view (direction [0, -1, 0]), but must not be"
        ]
    );
    one(
        "top = [0.5, 0.9, -1.0]",
        "top = [0.5, 0.0, -1.0]",
        "45:7: top equals base, but must be at least 1e-15 away from it",
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
            "s.toml:58:12: material \"glass\" is dielectric, but a disk is not solid; \
          dielectrics are allowed on spheres, cylinders, planes and closed implicit surfaces and isosurfaces"
        ]
    );
}
