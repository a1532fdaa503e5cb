//! What a scene means once it is read.

use super::{FULL, parse};
use etendue::scene::{Bsdf, Shape};

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
