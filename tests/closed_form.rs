//! Scenes whose answer is known exactly, rendered on the adapter.
//!
//! The furnace: a diffuse sphere of radius 1 and reflectance ρ closed by a disk light on a chord plane; with F = half the
//! height of the cap behind the light, every point of the wall has L = ρ Le F / (1 - ρ (1 - F)), which is Le for ρ = 1.
//! Whatever loses no energy must vanish in it.

mod common;

use common::{film, gpu, scene};
use etendue::film::Film;
use etendue::settings::{Overrides, Settings};
use etendue::stats::luminance;

const SIZE: [u32; 2] = [48, 36];

/// Renders until one standard error of the mean should be well below 10⁻³ and checks it: within `tolerance` (relative)
/// and four standard errors of `expected`.
fn check(what: &str, text: &str, spp: u64, expected: f64, tolerance: f64) -> Film {
    let scene = scene(text);
    let flags = Overrides {
        size: Some(SIZE),
        max_depth: Some(1500),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let film = film(&mut gpu(&scene, &settings, None), &settings, spp);
    let (mut sum, mut variance, mut n) = (0.0, 0.0, 0.0);
    film.for_each(|_, _, e| {
        sum += luminance(e.mean);
        variance += e.error[3].powi(2);
        n += 1.0;
    });
    let (mean, error) = (sum / n, variance.sqrt() / n);
    let off = (mean - expected).abs();
    assert!(
        error <= 1e-3 * expected,
        "{what}: too noisy to tell, {mean} ± {error}"
    );
    assert!(
        off <= tolerance * expected + 4.0 * error,
        "{what}: {mean} ± {error} instead of {expected}"
    );
    film
}

/// A dome with its light through the centre, white, seen by an eye inside, and things in it.
fn dome(eye: &str, things: &str) -> String {
    format!(
        r#"
[camera]
eye = [{eye}]
look_at = [0.0, 0.35, 0.0]
vfov = 60.0
resolution = [48, 36]
[material.white]
type = "diffuse"
reflectance = [1.0, 1.0, 1.0]
[material.mirror]
type = "mirror"
[material.glass]
type = "dielectric"
[[sphere]]
center = [0.0, 0.0, 0.0]
radius = 1.0
material = "white"
[[light]]
center = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
radius = 1.0
radiance = [1.0, 1.0, 1.0]
{things}"#
    )
}

fn ball(center: [f64; 3], radius: f64, material: &str) -> String {
    format!("[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\"\n")
}

fn rod(base: [f64; 3], top: [f64; 3], radius: f64, material: &str) -> String {
    format!(
        "[[cylinder]]\nbase = {base:?}\ntop = {top:?}\nradius = {radius:?}\nmaterial = \"{material}\"\n"
    )
}

#[test]
fn what_loses_no_energy_vanishes_in_the_white_dome() {
    let c = [0.0, 0.4, 0.0];
    let cases = [
        ("nothing", String::new()),
        ("glass ball", ball(c, 0.25, "glass")),
        ("mirror ball", ball(c, 0.25, "mirror")),
        ("white ball", ball(c, 0.25, "white")),
        (
            "white rod",
            rod([-0.1, 0.2, 0.0], [0.15, 0.6, 0.1], 0.15, "white"),
        ),
        (
            "mirror rod",
            rod([-0.1, 0.2, 0.0], [0.15, 0.6, 0.1], 0.15, "mirror"),
        ),
        (
            "glass rod",
            rod([-0.1, 0.2, 0.0], [0.15, 0.6, 0.1], 0.15, "glass"),
        ),
        (
            "glass balls that touch",
            ball([-0.2, 0.4, 0.0], 0.2, "glass") + &ball([0.2, 0.4, 0.0], 0.2, "glass"),
        ),
        (
            "mirror balls that touch",
            ball([-0.2, 0.4, 0.0], 0.2, "mirror") + &ball([0.2, 0.4, 0.0], 0.2, "mirror"),
        ),
        (
            "glass ball on the light",
            ball([0.0, 0.3, 0.0], 0.3, "glass"),
        ),
        (
            "a glass shell",
            ball(c, 0.3, "glass")
                + "[material.air]\ntype = \"dielectric\"\nior = 0.6578947368421053\n"
                + &ball(c, 0.2999, "air"),
        ),
    ];
    for (what, things) in cases {
        let film = check(what, &dome("0.0, 0.3, 0.9", &things), 1024, 1.0, 1e-3);
        // No part of the picture stands out: 16 blocks, five standard errors each.
        let mut blocks = [[0.0; 3]; 16];
        film.for_each(|x, y, e| {
            let b = &mut blocks[(y / 9 * 4 + x / 12) as usize];
            b[0] += luminance(e.mean);
            b[1] += e.error[3].powi(2);
            b[2] += 1.0;
        });
        for (k, [sum, variance, n]) in blocks.into_iter().enumerate() {
            let (mean, error) = (sum / n, variance.sqrt() / n);
            assert!(
                (mean - 1.0).abs() < 1e-3 + 5.0 * error,
                "{what}, block {k}: {mean} ± {error}"
            );
        }
    }
}

#[test]
fn an_eye_in_glass_sees_n_squared_times_the_dome() {
    // Nearer to the centre of the ball than radius / n, so that nothing is totally reflected.
    let text = dome("0.05, 0.45, 0.05", &ball([0.0, 0.4, 0.0], 0.25, "glass"));
    check("eye in glass", &text, 256, 1.52 * 1.52, 1e-3);
}

/// A furnace of reflectance `rho` with its light on the chord plane at height -`chord`; the eye looks at the wall.
fn furnace(rho: f64, chord: f64) -> String {
    let radius = (1.0 - chord * chord).sqrt();
    format!(
        r#"
[camera]
eye = [0.0, -0.2, 0.0]
look_at = [0.0, 1.0, 0.01]
vfov = 90.0
resolution = [48, 36]
[material.wall]
type = "diffuse"
reflectance = [{rho:?}, {rho:?}, {rho:?}]
[[sphere]]
center = [0.0, 0.0, 0.0]
radius = 1.0
material = "wall"
[[light]]
center = [0.0, {:?}, 0.0]
normal = [0.0, 1.0, 0.0]
radius = {radius:?}
radiance = [1.0, 1.0, 1.0]
"#,
        -chord
    )
}

#[test]
fn a_chord_at_six_tenths_gives_one_sixth() {
    let film = check("chord at 0.6", &furnace(0.5, 0.6), 256, 1.0 / 6.0, 1e-3);
    film.for_each(|x, y, e| {
        let off = (luminance(e.mean) - 1.0 / 6.0).abs();
        // Three degrees of freedom a pixel: nine standard errors and a floor.
        assert!(off < 9.0 * e.error[3] + 0.02, "pixel {x}, {y}: {:?}", e);
    });
}

#[test]
fn a_nearly_white_sphere_with_a_small_light_needs_hundreds_of_vertices() {
    check("F = 0.01", &furnace(0.999, 0.98), 1024, 0.909_01, 2e-3);
}

/// A light that fills a narrow view, and what stands before it.
fn through(things: &str) -> String {
    format!(
        r#"
[camera]
eye = [0.0, 0.0, 5.0]
look_at = [0.0, 0.0, 0.0]
vfov = 0.2
resolution = [48, 36]
[material.glass]
type = "dielectric"
{things}
[[light]]
center = [0.0, 0.0, -3.0]
normal = [0.0, 0.0, 1.0]
radius = 2.0
radiance = [1.0, 1.0, 1.0]
"#
    )
}

#[test]
fn glass_transmits_the_fresnel_series() {
    let slab = rod([0.0, 0.0, -0.5], [0.0, 0.0, 0.5], 1.0, "glass");
    check("slab", &through(&slab), 4096, 0.918_318, 5e-4);
    let shell = ball([0.0; 3], 1.0, "glass")
        + "[material.air]\ntype = \"dielectric\"\nior = 0.6578947368421053\n"
        + &ball([0.0; 3], 0.9999, "air");
    check("shell", &through(&shell), 4096, 0.848_97, 1e-3);
}

#[test]
fn no_light_leaks_into_a_closed_room() {
    let text = r#"
[camera]
eye = [0.1, 0.2, 0.3]
look_at = [0.0, 0.0, -1.0]
vfov = 100.0
resolution = [48, 36]
[material.white]
type = "diffuse"
reflectance = [1.0, 1.0, 1.0]
[[cylinder]]
base = [0.0, -0.5, 0.0]
top = [0.0, 0.5, 0.0]
radius = 0.6
material = "white"
[[light]]
center = [0.0, 2.0, 0.0]
normal = [0.0, -1.0, 0.0]
radius = 1.5
radiance = [1e6, 1e6, 1e6]
[[light]]
center = [2.0, 0.0, 0.0]
normal = [-1.0, 0.0, 0.0]
radius = 1.5
radiance = [1e6, 1e6, 1e6]
"#;
    let scene = scene(text);
    let flags = Overrides {
        size: Some(SIZE),
        max_depth: Some(40),
        ..Overrides::default()
    };
    let settings = Settings::resolve(&scene, &flags);
    let film = film(&mut gpu(&scene, &settings, None), &settings, 256);
    // 442 368 paths of 40 vertices each.
    assert_eq!(film.mean_luminance(), 0.0);
}
