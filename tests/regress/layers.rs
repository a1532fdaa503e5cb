//! Layers of goldens: ignored, or held as asked.

use super::{BALL, Folder, render};
use etendue::film::coverage::Rect;
use etendue::layers::{Layer, View, beside};
use etendue::output::{ExrChannels, read_exr_header, read_exr_layers, write_exr_with};
use etendue::scene::parse::parse_str;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::path::Path;

const MOVED: [&str; 2] = ["center = [0.0, 0.5, 0.0]", "center = [0.0, 0.5, 0.2]"];

fn has(f: &Folder, layer: &str) -> bool {
    let header = read_exr_header(&f.golden("one.exr")).expect("a golden");
    header.channels.iter().any(|c| c.starts_with(layer))
}

/// Replaces the golden by one with the layers of another scene, that says it is of this one: what finds surfaces has changed since.
fn spoil(f: &Folder, other: &str) {
    let path = f.golden("one.exr");
    let samples = etendue::output::read_exr(&path).unwrap().samples.unwrap()[0];
    let (film, provenance) = render(BALL, 5, samples.into());
    let scene = parse_str(Path::new("ball.toml"), other).expect("legal");
    let view = View::new(&scene, &provenance.settings);
    let layers = beside(&view, &Layer::ALL, Rect::whole(film.size), |_| ());
    write_exr_with(&path, &film, &provenance, ExrChannels::All, &layers).expect("written");
}

#[test]
fn goldens_hold_layers_if_asked() {
    let f = Folder::new(&["one"]);
    f.bless();
    assert!(!has(&f, "id.I"));
    // A golden without them can't be held to them.
    f.run(&["--layers", "id,depth"])
        .code(2)
        .stdout(contains("one.exr: it has no layer id").and(contains("--bless --layers id,depth")));
    f.run(&["--bless", "--power", "5%", "--layers", "id,material"])
        .code(0)
        .stdout(contains("it lacks layers that were asked for"));
    assert!(has(&f, "id.I") && has(&f, "material.I") && !has(&f, "depth.Z"));
    let header = read_exr_header(&f.golden("one.exr")).expect("a golden");
    assert_eq!(
        header.attributes["material_names"],
        r#"["","white","light"]"#
    );
    f.run(&["--layers", "material,id"]).code(0);
    // The same is left alone, and one that is made again keeps what it has.
    f.run(&["--bless", "--layers", "id"])
        .code(0)
        .stdout(contains("kept  one"));
    f.run(&["--bless", "--power", "4%", "--layers", "depth"])
        .code(0)
        .stdout(contains("blessed  one"));
    assert!(has(&f, "id.I") && has(&f, "material.I") && has(&f, "depth.Z"));
    f.run(&["--layers", "colour"])
        .code(2)
        .stderr(contains("invalid value 'colour'"));
}

#[test]
fn a_change_of_layers_is_told_apart_from_one_of_the_light() {
    let f = Folder::new(&["one"]);
    f.bless();
    spoil(&f, &BALL.replace(MOVED[0], MOVED[1]));
    let junit = f.path("r.xml");
    f.run(&[
        "--layers",
        "position,material",
        "--junit",
        junit.to_str().unwrap(),
    ])
    .code(1)
    .stdout(
        contains("FAILED  one: different: layer position: differs in ")
            .and(contains("the light: equal up to noise"))
            .and(contains("layer material").not()),
    );
    let xml = std::fs::read_to_string(junit).expect("written");
    assert!(xml.contains("layer position: differs in"), "{xml}");
    let page = std::fs::read_to_string(f.golden("one.report.html")).expect("a page");
    assert!(page.contains("layer position: differs in"));
    // Layers are ignored unless asked for.
    f.run(&[]).code(0);
    f.run(&["--layers", "material"]).code(0);
    f.run(&["--layers", "position"]).code(1);
    // The film that is left becomes a golden with the layers of the scene.
    let folder = f.path("golden");
    f.run(&["--accept", folder.to_str().unwrap()]).code(0);
    f.run(&["--layers", "position,depth,id,normal,albedo,material"])
        .code(0);
}

#[test]
fn of_a_scene_that_was_changed_layers_say_whether_the_eye_sees_it() {
    let f = Folder::new(&["one"]);
    f.run(&["--bless", "--power", "5%", "--layers", "id,position"])
        .code(0);
    f.put("one", &BALL.replace(MOVED[0], MOVED[1]));
    f.run(&["--layers", "position"])
        .code(2)
        .stdout(contains("is of another scene than").and(contains("layer position: differs in ")));
    f.put("one", &BALL.replace("20.0, 20.0, 20.0", "24.0, 24.0, 24.0"));
    f.run(&["--layers", "id,position"])
        .code(2)
        .stdout(contains("is of another scene than").and(contains("differs in ").not()));
    let names = ["id".to_owned()];
    assert_eq!(
        read_exr_layers(&f.golden("one.exr"), &names).unwrap()[0].width,
        24
    );
}
