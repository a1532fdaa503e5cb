//! Formulas, and what belongs to them.

use super::parse;

fn with(keys: &str) -> Vec<String> {
    let text = format!(
        "[camera]\neye = [0, 1, 4]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
         [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n[material.glass]\ntype = 'dielectric'\n\
         [[light]]\ncenter = [0, 4, 0]\nnormal = [0, -1, 0]\nradius = 0.5\nradiance = [9, 9, 9]\n\
         [[implicit]]\n{keys}\n"
    );
    parse(&text).err().unwrap_or_default()
}

fn one(keys: &str, message: &str) {
    let found = with(keys);
    assert!(
        found.len() == 1 && found[0].contains(message),
        "{keys}: {found:?}"
    );
}

#[test]
fn formulas_that_are_wrong() {
    let rest = "bounds = { radius = 1 }\nmaterial = 'white'";
    one(
        &format!("f = 'x + (y'\n{rest}"),
        "17:5: f is wrong at line 1, column 5 of the formula: this bracket is never closed",
    );
    one(
        &format!("f = '''x\n + q'''\n{rest}"),
        "f is wrong at line 2, column 4 of the formula: unknown name \"q\"; known: x, y, z, pi, sqrt",
    );
    one(&format!("f = 3\n{rest}"), "f is 3; f must be a string");
    one(rest, "missing key f in [[implicit]]");
}

#[test]
fn bounds_rotations_and_parameters_that_are_wrong() {
    let rest = "f = 'x'\nmaterial = 'white'";
    for bounds in [
        "1",
        "{ radius = 0 }",
        "{ min = [0, 0, 0] }",
        "{ min = [0, 0, 0], max = [1, 1, 0] }",
        "{ min = [0, 0, 0], max = [1, 1, 1], radius = 1 }",
        "{ min = [100, 0, 0], max = [100.00000001, 1, 1] }",
    ] {
        let found = with(&format!("bounds = {bounds}\n{rest}"));
        assert_eq!(found.len(), 1, "{bounds}: {found:?}");
    }
    let rest = "f = 'x'\nmaterial = 'white'\nbounds = { radius = 1 }";
    for rotation in [
        "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
        "[[1, 0, 0], [0, 2, 0], [0, 0, 1]]",
        "{ axis = [0, 0, 0], angle = 3 }",
        "{ axis = [0, 0, 1] }",
        "{ axis = [0, 0, 1], angle = nan }",
    ] {
        one(
            &format!("rotation = {rotation}\n{rest}"),
            "rotation must be { axis = [x, y, z], angle = degrees }",
        );
    }
    for parameters in [
        "{ x = 1 }",
        "{ sin = 1 }",
        "{ a = 'b' }",
        "{ 'a b' = 1 }",
        "3",
    ] {
        one(
            &format!("parameters = {parameters}\n{rest}"),
            "parameters must be a table of names",
        );
    }
    one(
        &format!("closed = 1\n{rest}"),
        "closed is 1; closed must be true or false",
    );
    assert_eq!(
        with(&format!(
            "parameters = {{ a = 1 }}\nrotation = {{ axis = [0, 2, 0], angle = -30 }}\n{rest}"
        )),
        [""; 0]
    );
}

#[test]
fn an_open_surface_is_not_of_glass() {
    let glass = "f = 'x'\nmaterial = 'glass'\nbounds = { radius = 1 }";
    one(
        &format!("closed = false\n{glass}"),
        "material \"glass\" is dielectric, but an open surface is not solid",
    );
    assert_eq!(with(glass), [""; 0]);
}

#[test]
fn formulas_beyond_number() {
    let surface = "f = 'x'\nmaterial = 'white'\nbounds = { radius = 1 }\n";
    let all = |count: usize| with(&vec![surface; count].join("[[implicit]]\n"));
    assert_eq!(all(64), [""; 0]);
    let found = all(65);
    assert!(
        found.len() == 1 && found[0].contains("more than 64 [[implicit]]"),
        "{found:?}"
    );
}
