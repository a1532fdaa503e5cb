//! Pictures of formulas against those of the surfaces that they describe.

use crate::common::{block_means_of_seeds, cpu, gpu, scene, settings, worst_t};
use etendue::files::npy::header;
use etendue::gpu::probe::Uniform;
use etendue::reference::Estimator;
use etendue::scene::parse::parse_str;
use std::path::Path;

type Runs = Vec<Vec<[f64; 3]>>;

/// Of pictures that the reference makes too.
const SMALL: [u32; 2] = [24, 18];

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
    let settings = settings(&s, SIZE, first_seed);
    block_means_of_seeds(&mut gpu(&s, &settings, None), &settings, RUNS, 128, 6)
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

/// A lump of noise in coarse cells, the same on every run.
fn lump(center: [f64; 3], half: f64) -> String {
    let origin = center.map(|c| c - half);
    let spacing = [2.0 * half / (SIDE - 1) as f64; 3];
    format!(
        "[[isosurface]]\nfile = 'lump.npy'\norigin = {origin:?}\nspacing = {spacing:?}\nlevel = 20000.5\n"
    )
}

/// Points along each axis of a lump.
const SIDE: usize = 7;

/// Its file.
fn lump_file() -> Vec<u8> {
    let mut r = Uniform(9);
    let along = |k: usize| 2.0 * k as f64 / (SIDE - 1) as f64 - 1.0;
    let numbers = (0..SIDE.pow(3)).map(|i| {
        let p = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(along);
        let out = p.map(|x| x * x).iter().sum::<f64>().sqrt();
        (60_000.0 * (1.0 - 0.7 * out) * (0.6 + 0.4 * r.next())).max(0.0) as u16
    });
    let bytes = numbers.flat_map(u16::to_le_bytes);
    header("<u2", &[SIDE as u64; 3])
        .into_iter()
        .chain(bytes)
        .collect()
}

/// Means of blocks of pictures by the kernel, and by the reference.
fn both(folder: &Path, text: &str) -> [Runs; 2] {
    let scene = parse_str(&folder.join("test.toml"), text).unwrap_or_else(|e| panic!("{e:?}"));
    let of_kernel = settings(&scene, SMALL, 0);
    let of_reference = settings(&scene, SMALL, 500);
    let mut kernel = gpu(&scene, &of_kernel, None);
    let mut reference = cpu(&scene, &of_reference, Estimator::LightSampling);
    [
        block_means_of_seeds(&mut kernel, &of_kernel, RUNS, 256, 6),
        block_means_of_seeds(&mut reference, &of_reference, RUNS, 64, 6),
    ]
}

/// Volumes where other surfaces stand in trees, in crowds of more things than are met one by one, and in glass: as bright as the reference
/// says.
#[test]
fn volumes_beside_other_surfaces() {
    let bubble = "[material.bubble]\ntype = 'dielectric'\nior = 0.6667\n";
    let ball = "[[sphere]]\ncenter = [0.1, 0.9, 0]\nradius = 0.8\nmaterial = 'thing'\n";
    let free = lump([0.2, 0.9, 0.0], 0.7);
    let inner = lump([0.1, 0.9, 0.0], 0.45);
    let other = lump([-0.7, 0.5, 0.3], 0.4);
    let folder = tempfile::tempdir().expect("temporary folder");
    std::fs::write(folder.path().join("lump.npy"), lump_file()).expect("written");
    let [matt, mirror, glass, phong] = MATERIALS;
    let crowded = |thing: &str| crowd() + thing;
    let small = "[[sphere]]\ncenter = [0.1, 0.9, 0]\nradius = 0.1\nmaterial = 'bubble'\n";
    for (name, text) in [
        ("alone", room(glass, &free)),
        ("matt in a crowd", room(matt, &crowded(&free))),
        ("mirror in a crowd", room(mirror, &crowded(&free))),
        ("glass in a crowd", room(glass, &crowded(&free))),
        (
            "two, glossy, in a crowd",
            room(phong, &crowded(&(other + "material = 'white'\n" + &free))),
        ),
        (
            "a bubble in a ball of glass",
            room(
                glass,
                &format!("{ball}{inner}material = 'bubble'\n{}", ball_aside()),
            ) + bubble,
        ),
        (
            "matt in a ball of glass, in a crowd",
            room(
                glass,
                &crowded(&format!(
                    "{ball}{inner}material = 'white'\n{}",
                    ball_aside()
                )),
            ),
        ),
        (
            "glass with a bubble in it, in a crowd",
            room(glass, &crowded(&format!("{small}{free}"))) + bubble,
        ),
    ] {
        let [kernel, reference] = both(folder.path(), &text);
        let worst = worst_t(&kernel, &reference);
        println!("{name}: {worst:?}");
        assert!(worst.tests > 0, "{name}");
        assert!(
            worst.p * worst.tests as f64 > FALSE_ALARM,
            "{name}: {worst:?}"
        );
    }
}

/// The last thing of a room, which gets its material there.
fn ball_aside() -> &'static str {
    "[[sphere]]\ncenter = [1.1, 0.3, 0.5]\nradius = 0.3"
}
