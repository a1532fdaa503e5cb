//! Pictures of formulas against those of the surfaces that they describe.

use crate::common::{block_means, film, gpu, scene, settings, worst_t};

const RUNS: u32 = 8;
const SIZE: [u32; 2] = [48, 36];
const FALSE_ALARM: f64 = 1e-4;

/// A room with a light and a thing.
fn room(material: &str, thing: &str) -> String {
    format!(
        "[camera]\neye = [0, 1.6, 4.2]\nlook_at = [0, 0.8, 0]\nvfov = 40\nresolution = [48, 36]\n\
         [render]\nmax_depth = 12\n\
         [material.white]\ntype = 'diffuse'\nreflectance = [0.7, 0.6, 0.5]\n\
         [material.thing]\n{material}\n\
         [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n\
         [[plane]]\npoint = [0, 0, -2]\nnormal = [0, 0, 1]\nmaterial = 'white'\n\
         [[light]]\ncenter = [0.5, 3, 0.5]\nnormal = [0, -1, 0]\nradius = 0.7\nradiance = [9, 9, 9]\n\
         {thing}\nmaterial = 'thing'\n"
    )
}

fn runs(text: &str, first_seed: u32) -> Vec<Vec<[f64; 3]>> {
    let s = scene(text);
    let runs = (0..RUNS).map(|k| {
        let settings = settings(&s, SIZE, first_seed + k);
        block_means(&film(&mut gpu(&s, &settings, None), &settings, 128), 6)
    });
    runs.collect()
}

const MATERIALS: [&str; 4] = [
    "type = 'diffuse'\nreflectance = [0.3, 0.6, 0.4]",
    "type = 'mirror'",
    "type = 'dielectric'\nior = 1.5",
    "type = 'phong'\ndiffuse = [0.2, 0.2, 0.3]\nspecular = [0.5, 0.5, 0.5]\nexponent = 20",
];

fn same(thing: &str, formula: &str) {
    for material in MATERIALS {
        let worst = worst_t(
            &runs(&room(material, thing), 0),
            &runs(&room(material, formula), 100),
        );
        assert!(worst.tests > 0);
        assert!(
            worst.p * worst.tests as f64 > FALSE_ALARM,
            "{material}: {worst:?}"
        );
    }
}

#[test]
fn a_sphere() {
    same(
        "[[sphere]]\ncenter = [0.2, 0.9, 0]\nradius = 0.8",
        "[[implicit]]\nf = 'x^2 + y^2 + z^2'\nlevel = 1\nscale = 0.8\ncenter = [0.2, 0.9, 0]\nbounds = { radius = 1.2 }",
    );
}

#[test]
fn a_cylinder_is_closed_by_its_bounds() {
    same(
        "[[cylinder]]\nbase = [-0.3, 0.1, 0]\ntop = [-0.3, 1.3, 0.5]\nradius = 0.6",
        "[[implicit]]\nf = 'x^2 + y^2 - r^2'\nparameters = { r = 0.6 }\ncenter = [-0.3, 0.1, 0]\n\
         rotation = [[1, 0, 0], [0, 0.3846153846153846, 0.9230769230769231], [0, -0.9230769230769231, 0.3846153846153846]]\n\
         bounds = { min = [-0.7, -0.7, 0], max = [0.7, 0.7, 1.3] }",
    );
}

#[test]
fn a_wall_of_which_one_sees_a_part() {
    same(
        "[[plane]]\npoint = [0, 0, -1]\nnormal = [0.2, 0.1, 1]",
        "[[implicit]]\nf = '0.2 x + 0.1 y + z + 1'\nbounds = { min = [-60, -60, -60], max = [60, 60, 60] }",
    );
}

/// Small spheres on the floor, more than are met one by one, so that the kernel walks through trees.
fn crowd() -> String {
    (0..60)
        .map(|k| {
            let (x, z) = (f64::from(k % 10) * 0.3 - 1.4, f64::from(k / 10) * 0.3 - 0.6);
            format!("[[sphere]]\ncenter = [{x}, 0.05, {z}]\nradius = 0.05\nmaterial = 'white'\n")
        })
        .collect()
}

#[test]
fn beside_trees() {
    let sphere = "[[sphere]]\ncenter = [0.2, 0.9, 0]\nradius = 0.7";
    let formula = "[[implicit]]\nf = 'x^2 + y^2 + z^2 - 1'\nscale = 0.7\ncenter = [0.2, 0.9, 0]\nbounds = { radius = 1.1 }";
    for material in MATERIALS {
        let with = |thing: &str| room(material, &(crowd() + thing));
        let worst = worst_t(&runs(&with(sphere), 0), &runs(&with(formula), 100));
        assert!(worst.tests > 0);
        assert!(
            worst.p * worst.tests as f64 > FALSE_ALARM,
            "{material}: {worst:?}"
        );
    }
}

/// Glass within glass, of which one is a formula: they nest as two spheres do, and the eye may be in them.
#[test]
fn solids_nest() {
    let bubble = "[material.bubble]\ntype = 'dielectric'\nior = 0.6667\n";
    let outer = "[[sphere]]\ncenter = [0.1, 0.9, 0]\nradius = 0.8\nmaterial = 'thing'\n";
    let round = |center: &str, radius: f64| {
        format!(
            "[[implicit]]\nf = 'x^2 + y^2 + z^2 - 1'\nscale = {radius}\ncenter = {center}\nbounds = {{ radius = 1.2 }}\n"
        )
    };
    let inner = "[[sphere]]\ncenter = [0.2, 1, 0]\nradius = 0.4\nmaterial = 'bubble'\n";
    let glass = MATERIALS[2];
    // The last thing of a room gets its material there.
    let last = "[[disk]]\ncenter = [-1.5, 1, -1]\nnormal = [0, 0, 1]\nradius = 0.2";
    let solid = |things: String| {
        let text = room(glass, &(things + last));
        let end = text.rfind("material = 'thing'").expect("the last");
        text[..end].to_owned() + "material = 'white'\n" + bubble
    };
    let plain = runs(&solid(outer.to_owned() + inner), 0);
    for things in [
        round("[0.1, 0.9, 0]", 0.8) + "material = 'thing'\n" + inner,
        outer.to_owned() + &round("[0.2, 1, 0]", 0.4) + "material = 'bubble'\n",
    ] {
        let worst = worst_t(&plain, &runs(&solid(things.clone()), 100));
        assert!(
            worst.p * worst.tests as f64 > FALSE_ALARM,
            "{things}: {worst:?}"
        );
    }
    // From within the glass.
    let inside = |text: String| text.replace("eye = [0, 1.6, 4.2]", "eye = [0.1, 0.7, 0.6]");
    let plain = runs(&inside(solid(outer.to_owned() + inner)), 0);
    let things = round("[0.1, 0.9, 0]", 0.8) + "material = 'thing'\n" + inner;
    let worst = worst_t(&plain, &runs(&inside(solid(things)), 100));
    assert!(worst.p * worst.tests as f64 > FALSE_ALARM, "{worst:?}");
}
