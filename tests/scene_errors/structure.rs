//! Keys, tables and syntax; the form of error messages.

use super::{FULL, errors, one, parse};

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
    // A name that would not be seen.
    let unnamed = FULL.replace("[material.gloss]", "[material.\"\"]");
    assert_eq!(
        parse(&unnamed).expect_err("no gloss"),
        [
            "s.toml:47:12: unknown material \"gloss\"; defined here: \"\", glass, steel, white; did you mean \"glass\"?"
        ]
    );
    one(
        "material = \"glass\"",
        "material = \"foo\"",
        "63:12: unknown material \"foo\"; defined here: glass, gloss, steel, white",
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
         spheres, plane, disk, cylinder, cylinders, implicit, isosurface, light, lights; did you mean \"disk\"?",
    );
    one(
        "ior = 1.5",
        "reflectance = [1, 1, 1]",
        "24:1: unknown key \"reflectance\" in [material.glass]; allowed: type, ior, transmittance; \
         it belongs to diffuse and mirror",
    );
}

#[test]
fn missing_keys_and_tables() {
    one(
        "radius = 0.125\n",
        "",
        "60:1: missing key radius in [[sphere]]; it must be a number from 1e-15 to 1e15",
    );
    one(
        "material = \"glass\"\n",
        "",
        "60:1: missing key material in [[sphere]]; it must be a string",
    );
    one(
        "type = \"mirror\"\n",
        "",
        "19:1: missing key type in [material.steel]; it must be a string",
    );
    one(
        "vfov = 42\n",
        "",
        "3:1: missing key vfov in [camera]; it must be a number above 0 and below 180",
    );

    let (start, rest) = FULL.split_once("[camera]").expect("a camera");
    let without_camera = format!("{start}{}", &rest[rest.find("[render]").expect("render")..]);
    assert_eq!(
        parse(&without_camera).expect_err("no camera"),
        ["s.toml: no [camera]; a scene needs one"]
    );
    let light =
        &FULL[FULL.find("[[light]]").expect("light")..FULL.find("[[plane]]").expect("plane")];
    assert_eq!(
        parse(&FULL.replace(light, "")).expect_err("no light"),
        ["s.toml: no [[light]]; a scene needs at least one"]
    );
    let bare = &FULL[..FULL.find("[[plane]]").expect("plane")];
    let no_primitive = [
        "s.toml: no primitive; a scene needs at least one [[sphere]], [[plane]], [[disk]], [[cylinder]], [[implicit]] or [[isosurface]]",
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
                "s.toml: is empty; a scene needs [camera], a [[light]], and a \
              [[sphere]], [[plane]], [[disk]], [[cylinder]], [[implicit]] or [[isosurface]]"
            ]
        );
    }
}

#[test]
fn duplicates_and_syntax() {
    let once = "keys and [tables] must be unique; only [[tables]] can repeat";
    for (old, new, message) in [
        (
            "vfov = 42",
            "vfov = 42\nvfov = 43",
            "8:1: duplicate \"vfov\", first at line 7",
        ),
        (
            "[[plane]]",
            "[render]\n[[plane]]",
            "38:2: duplicate [render], first at line 10",
        ),
        // The keys of a repeated table are no errors of their own.
        (
            "[[plane]]",
            "[camera]\neye = [0, 0, 0]\nvfov = 1\n\n[[plane]]",
            "38:2: duplicate [camera], first at line 3",
        ),
        (
            "[material.steel]",
            "[material.white]",
            "19:11: duplicate [material.white], first at line 15",
        ),
        (
            "[[disk]]",
            "[ material . \"gloss\" ]\nexponent = 3\n\n[[disk]]",
            "54:14: duplicate [material.gloss], first at line 26",
        ),
        (
            "[[plane]]",
            "[light]\nradius = 3\n\n[[plane]]",
            "38:2: duplicate [light], first at line 32",
        ),
        (
            "vfov = 42",
            "vfov = {x = 1, x = 2}",
            "7:16: duplicate \"x\", first at line 7",
        ),
    ] {
        one(old, new, &format!("{message}: {once}"));
    }
    // What follows is read on.
    let two = FULL
        .replace("[[plane]]", "[camera]\nvfov = 1\n\n[[plane]]")
        .replace("radius = 0.125", "radius = 0.125\nradius = 1");
    let two = parse(&two).expect_err("two duplicates");
    assert_eq!(two.len(), 2, "{two:?}");
    assert!(two[1].starts_with("s.toml:66:1: duplicate \"radius\", first at line 65"));
    for (old, new, place) in [
        (
            "vfov = 42",
            "vfov = ",
            "s.toml:7:8: not TOML: a value is missing",
        ),
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
fn a_missing_comma_is_named() {
    for (old, new, place) in [
        (
            "[0.0, 1.0, 3.8]",
            "[0.0 1.0, 3.8]",
            "4:12: not TOML: expected a comma before `1.0`",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[0.0, 1.0 3.8]",
            "4:17: not TOML: expected a comma before `3.8`",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[1.0 0 0]",
            "4:12: not TOML: expected a comma before `0`",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[\n0.0,\n1.0\n3.8]",
            "7:1: not TOML: expected a comma before `3.8`",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[[0.0, 1.0] [3.8]]",
            "4:19: not TOML: expected a comma before `[3.8`",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "{ a = 1 b = 2 }",
            "4:15: not TOML: expected a comma before `b`",
        ),
        (
            "title = \"Everything\"",
            "title = [\"a\" \"b\"]",
            "1:14: not TOML: expected a comma before `\"b\"`",
        ),
    ] {
        one(old, new, place);
    }
    // No comma belongs there.
    let unit = errors("vfov = 42", "vfov = 42 deg");
    assert!(unit[0].contains("found `42 deg`"), "{unit:?}");
}

#[test]
fn a_bracket_that_is_not_closed_is_one_error() {
    for (old, new, error) in [
        (
            "[0.0, 1.0, 3.8]",
            "[0.0, 1.0, 3.8",
            "4:7: not TOML: this `[` is not closed",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[0.0, # ] no\n1.0, 3.8",
            "4:7: not TOML: this `[` is not closed",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[[0.0, 1.0], 3.8",
            "4:7: not TOML: this `[` is not closed",
        ),
    ] {
        one(old, new, error);
    }
}

#[test]
fn what_was_meant_is_said() {
    for (old, new, hint) in [
        ("vfov = 42", "vfov = 42;", "lines end without a semicolon"),
        ("vfov = 42", "vfov = 42,5", "decimals have a point"),
        ("vfov = 42", "vfov = 42,", "only lists have commas"),
        (
            "vfov = 42",
            "vfov = 90/2",
            "found `90/2`; nothing is calculated here: write the result",
        ),
        ("vfov = 42", "vfov = 2 * 21.0", "nothing is calculated here"),
        (
            "[0.0, 1.0, 3.8]",
            "(0.0, 1.0, 3.8)",
            "lists stand in brackets",
        ),
        ("vfov = 42", "fov = 42", "did you mean \"vfov\"?"),
        (
            "type = \"dielectric\"",
            "type = \"glass\"",
            "did you mean \"dielectric\"?",
        ),
        (
            "vfov = 42",
            "vfov = 42\ntitle = \"x\"",
            "a title stands at the top of the file",
        ),
        (
            "vfov = 42",
            "vfov = .5",
            "digits on both sides of the point",
        ),
        (
            "vfov = 42",
            "vfov = 5.",
            "digits on both sides of the point",
        ),
        (
            "[0.0, 1.0, 3.8]",
            "[.0, 1.0, 3.8]",
            "digits on both sides of the point",
        ),
        ("vfov = 42", "vfov = 1.5f", "numbers have no letters"),
        ("vfov = 42", "vfov: 42", "have = between them"),
        ("vfov = 42", "// vfov", "comments begin with #"),
        ("vfov = 42", "vfov = 42 // degrees", "comments begin with #"),
        (
            "[0.0, 1.0, 3.8]",
            "[0.0, 1.0, 3.8] // it",
            "comments begin with #",
        ),
        (
            "seed = 7",
            "spp = 64",
            "that is the flag --spp of etendue render",
        ),
        (
            "[material.glass]",
            "[glass]",
            "a material is written [material.glass]",
        ),
        ("[[disk]]", "[[box]]", "there are spheres, planes"),
        ("[[disk]]", "[[mesh]]", "no meshes"),
        (
            "[[light]]",
            "[[light]]\ntype = \"point\"",
            "every light is a disk",
        ),
    ] {
        let found = errors(old, new);
        assert!(found.iter().any(|e| e.contains(hint)), "{new}: {found:?}");
    }
    // The table has another name: its materials are missing nowhere.
    let text = FULL.replace("[material.", "[materials.");
    let found = parse(&text).expect_err("no materials");
    assert!(found[0].contains("did you mean \"material\"?"), "{found:?}");
    assert_eq!(found.len(), 1, "{found:?}");
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

/// Of the tables within a table that reads rows.
#[test]
fn what_rows_look_like_is_said_once() {
    for (keys, message) in [
        (
            "material = 'white'\ncolor = { column = 'q', map = 'viridis' }",
            "67:9: material and color both say what the rows look like; give one of them",
        ),
        (
            "color = { column = 'q', map = 'viridi' }",
            "66:31: map is 'viridi'; map must be the name of a colour map: viridis, plasma,",
        ),
        (
            "color = { colum = 'q', map = 'viridis' }",
            "66:9: missing key column in color of [[spheres]]; it must be a string",
        ),
        (
            "color = { column = 'q', map = 'reds', low = 2, high = 1.5 }",
            "66:55: high is 1.5, but must be above low, 2",
        ),
        (
            "color = 'viridis'",
            "66:9: color is 'viridis', but must be a table",
        ),
        (
            "species.O = { radius = 0 }",
            "66:24: radius is 0; radius must be a number from 1e-15 to 1e15",
        ),
        (
            "species.O = 'red'",
            "66:13: species.O is 'red', but must be a table",
        ),
        ("species = {}", "66:11: species is empty"),
        (
            "species.O = { radius = 1, material = 'white', reflectance = [1, 0, 0] }",
            "66:38: reflectance and material both say what a species looks like",
        ),
        (
            "species.O = { radius = 1 }\nspecies.H = { reflectance = [1, 1, 1] }",
            "66:",
        ),
        (
            "radius = 2\nspecies.O = { radius = 1 }",
            "66:10: radius and species both say how large the rows are",
        ),
        (
            "frame = 2",
            "66:9: frame chooses among those of an .xyz file",
        ),
    ] {
        let text = format!("{FULL}[[spheres]]\nfile = 'none.csv'\n{keys}\n");
        let found = parse(&text).expect_err(keys);
        let is_there = found
            .iter()
            .any(|e| e.starts_with(&format!("s.toml:{message}")));
        assert!(is_there, "{keys}: {found:?}");
    }
    let text = format!("{FULL}[[cylinders]]\nfile = 'none.xyz'\nmaterial = 'white'\n");
    let found = parse(&text).expect_err("no points");
    assert!(
        found[0].contains("an XYZ file holds points, which [[spheres]] draws"),
        "{found:?}"
    );
}
