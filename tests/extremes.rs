//! Nothing is ever NaN or infinite: scenes at the ends of the format's ranges, and random ones, on the adapter and on the
//! reference.

mod common;
mod random_scene;

use common::{cpu, gpu, scene};
use etendue::engine::Engine;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::kernel::Access;
use etendue::reference::Estimator;
use etendue::scene::Scene;
use etendue::scene::check::lint;
use etendue::settings::{Overrides, Settings};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use random_scene::{Implicits, scenes};
use std::sync::atomic::AtomicBool;

/// What is wrong with `spp` samples of a few pixels of the picture's corner and middle.
fn fault(engine: &mut dyn Engine, settings: &Settings, spp: u64) -> Option<String> {
    let [width, height] = settings.size;
    for [x, y] in [[0, 0], [width / 2, height / 2]] {
        let rect = Rect {
            x0: x,
            y0: y,
            x1: width.min(x + 8),
            y1: height.min(y + 6),
        };
        let mut film = Film::new(settings.size, rect, settings.strata);
        let counters = match engine.render(&mut film, rect, 0..spp, &AtomicBool::new(false)) {
            Ok(counters) => counters,
            Err(e) => return Some(e.to_string()),
        };
        if counters.nonfinite > 0 {
            return Some(format!("not finite: {counters:?}"));
        }
        let mut wrong = None;
        film.for_each(|x, y, e| {
            let fine = |v: &f64| v.is_finite() && *v >= 0.0;
            if !e.mean.iter().chain(&e.error).all(fine) {
                wrong = Some(format!("pixel {x}, {y}: {e:?}"));
            }
        });
        if wrong.is_some() {
            return wrong;
        }
    }
    None
}

/// Both engines; the adapter's with values in buffers, whose kernels compile faster, or as `access` says.
fn both(scene: &Scene, size: [u32; 2], access: Access) -> Option<String> {
    let flags = Overrides {
        size: Some(size),
        max_depth: Some(16),
        strata: Some(2),
        ..Overrides::default()
    };
    let settings = Settings::resolve(scene, &flags);
    // A pass has as many light paths as a large picture needs, so these are traced for a small one.
    let small = Settings {
        size: size.map(|n| n.min(48)),
        ..settings.clone()
    };
    let by_chance = Settings {
        light_paths: false,
        ..settings.clone()
    };
    let on_gpu = [small, by_chance]
        .iter()
        .find_map(|settings| fault(&mut gpu(scene, settings, Some(access)), settings, 16));
    let on_cpu = || {
        fault(
            &mut cpu(scene, &settings, Estimator::LightSampling),
            &settings,
            16,
        )
    };
    on_gpu
        .map(|f| format!("adapter: {f}"))
        .or_else(|| on_cpu().map(|f| format!("reference: {f}")))
}

/// A room with an object of every material, and with the given `eye`, `look_at`, `vfov` and additional tables.
fn room(eye: &str, look_at: &str, vfov: &str, more: &str) -> String {
    format!(
        r#"
[camera]
eye = [{eye}]
look_at = [{look_at}]
vfov = {vfov}
resolution = [8, 6]
[material.white]
type = "diffuse"
reflectance = [1.0, 1.0, 1.0]
[material.steel]
type = "mirror"
[material.glass]
type = "dielectric"
[material.gloss]
type = "phong"
diffuse = [0.3, 0.2, 0.1]
specular = [0.7, 0.7, 0.7]
exponent = 1e6
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
material = "white"
[[sphere]]
center = [-1.0, 1.0, 0.0]
radius = 1.0
material = "white"
[[sphere]]
center = [1.5, 1.0, 0.0]
radius = 1.0
material = "glass"
[[sphere]]
center = [0.0, 1.0, -2.0]
radius = 1.0
material = "gloss"
[[cylinder]]
base = [3.0, 0.0, -1.0]
top = [3.0, 2.0, -1.0]
radius = 0.4
material = "steel"
[[disk]]
center = [0.0, 1.0, -4.0]
normal = [0.0, 0.0, 1.0]
radius = 2.0
material = "gloss"
[[light]]
center = [0.0, 4.0, 0.0]
normal = [0.0, -1.0, 0.0]
radius = 0.5
radiance = [10.0, 10.0, 10.0]
{more}"#
    )
}

fn finite(what: &str, text: &str, size: [u32; 2]) {
    if let Some(fault) = both(&scene(text), size, Access::Buffers) {
        panic!("{what}: {fault}");
    }
}

#[test]
fn fields_of_view_from_a_hair_to_nearly_all() {
    for vfov in ["0.01", "1e-6", "179.0", "179.999"] {
        for size in [[8, 6], [65_536, 1], [1, 65_536]] {
            let text = room("0.0, 1.5, 6.0", "0.0, 1.0, 0.0", vfov, "");
            finite(&format!("vfov {vfov}, {size:?}"), &text, size);
        }
    }
}

#[test]
fn eyes_on_surfaces() {
    let cases = [
        ("on a ball", "-1.0, 2.0, 0.0", "1.0, 3.0, 0.0"),
        ("on the floor", "0.0, 0.0, 5.0", "0.0, 1.0, 0.0"),
        (
            "on the floor, looking along it",
            "0.0, 0.0, 5.0",
            "0.0, 0.0, 0.0",
        ),
        ("on the glass", "1.5, 1.0, 1.0", "1.5, 1.0, 0.0"),
        (
            "on the glass, looking along it",
            "1.5, 1.0, 1.0",
            "5.0, 1.0, 1.0",
        ),
        ("on a cap", "3.0, 2.0, -1.0", "0.0, 1.0, 0.0"),
        ("on a cylinder's rim", "3.4, 2.0, -1.0", "0.0, 1.0, 0.0"),
        ("on a disk", "0.5, 1.0, -4.0", "0.0, 1.0, 0.0"),
        ("on a light", "0.1, 4.0, 0.0", "0.0, 1.0, 0.1"),
        (
            "on a light, looking along it",
            "0.1, 4.0, 0.0",
            "5.0, 4.0, 0.0",
        ),
        ("on a light's rim", "0.5, 4.0, 0.0", "0.0, 1.0, 0.1"),
    ];
    for (what, eye, look_at) in cases {
        let text =
            room(eye, look_at, "60.0", "").replace("[camera]", "[camera]\nup = [0.3, 1.0, 0.2]");
        finite(what, &text, [8, 6]);
        let told = lint(&scene(&text))
            .iter()
            .any(|d| d.message.contains("the eye is on"));
        assert!(told, "{what}: the lint says nothing");
    }
}

#[test]
fn eyes_in_the_middle_of_things() {
    let cases = [
        ("at an opaque ball's centre", "-1.0, 1.0, 0.0"),
        ("at a glass ball's centre", "1.5, 1.0, 0.0"),
        ("off the centre of a glass ball", "1.9, 1.2, 0.1"),
        ("on a cylinder's axis", "3.0, 1.0, -1.0"),
    ];
    for (what, eye) in cases {
        let text = room(eye, "0.0, 7.0, 1.0", "60.0", "");
        finite(what, &text, [8, 6]);
        let told = lint(&scene(&text))
            .iter()
            .any(|d| d.message.contains("the eye is inside"));
        assert!(told, "{what}: the lint says nothing");
    }
}

/// A sphere of radius 10⁻⁶ on one of radius 10⁶.
fn grain(material: &str, eye: &str) -> String {
    let things = format!(
        "[[sphere]]\ncenter = [0.3, 1e-6, 3.0]\nradius = 1e-6\nmaterial = \"{material}\"\n\
         [[sphere]]\ncenter = [0.0, -1e6, 0.0]\nradius = 1e6\nmaterial = \"{material}\"\n"
    );
    room(eye, "0.3, 1e-6, 3.0", "40.0", &things)
}

#[test]
fn a_grain_beside_a_globe() {
    for material in ["white", "steel", "glass", "gloss"] {
        for eye in ["0.0, 1.5, 6.0", "0.30001, 2e-6, 3.00001"] {
            finite(
                &format!("{material} from {eye}"),
                &grain(material, eye),
                [8, 6],
            );
        }
    }
}

#[test]
fn values_baked_into_the_kernel() {
    let cases = [
        ("0.0, 1.5, 6.0", "0.0, 1.0, 0.0", "179.999", [65_536, 1]),
        ("0.0, 1.5, 6.0", "0.0, 1.0, 0.0", "1e-6", [8, 6]),
        ("1.5, 1.0, 1.0", "1.5, 1.0, 0.0", "60.0", [8, 6]),
        ("1.5, 1.0, 0.0", "1.5, 1.0, 1.0", "60.0", [8, 6]),
    ];
    let texts = cases.map(|(eye, look_at, vfov, size)| (room(eye, look_at, vfov, ""), size));
    let grain = (grain("glass", "0.30001, 2e-6, 3.00001"), [8, 6]);
    for (text, size) in texts.into_iter().chain([grain]) {
        if let Some(fault) = both(&scene(&text), size, Access::Baked) {
            panic!("{fault}\n{text}");
        }
    }
}

#[test]
fn a_thousand_lights_on_one_spot() {
    let light = "[[light]]\ncenter = [0.0, 3.0, 0.0]\nnormal = [0.0, -1.0, 0.0]\nradius = 0.2\n\
                 radiance = [1e15, 1.0, 0.0]\n";
    let text = room(
        "0.0, 1.5, 6.0",
        "0.0, 1.0, 0.0",
        "60.0",
        &light.repeat(1000),
    );
    if let Some(fault) = both(&scene(&text), [8, 6], Access::Buffers) {
        panic!("{fault}");
    }
}

/// The same scenes every time; PROPTEST_RNG_SEED takes others.
fn seeded(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: std::env::var("PROPTEST_RNG_SEED")
            .ok()
            .and_then(|seed| seed.parse().ok())
            .map_or(RngSeed::Fixed(1), RngSeed::Fixed),
        ..ProptestConfig::default()
    }
}

fn is_fine(scene: &Scene) -> Result<(), TestCaseError> {
    let fault = both(scene, scene.camera.resolution, Access::Buffers);
    fault.map_or(Ok(()), |fault| Err(TestCaseError::fail(fault)))
}

proptest! {
    #![proptest_config(seeded(32))]

    #[test]
    fn random_scenes_of_every_magnitude(scene in scenes(Implicits::None)) {
        is_fine(&scene)?;
    }
}

proptest! {
    #![proptest_config(seeded(16))]

    #[test]
    fn random_formulas_of_every_magnitude(scene in scenes(Implicits::Formulas)) {
        is_fine(&scene)?;
    }

    #[test]
    fn random_volumes_of_every_magnitude(scene in scenes(Implicits::Volumes)) {
        is_fine(&scene)?;
    }
}
