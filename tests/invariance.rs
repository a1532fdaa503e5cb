//! The same scene elsewhere, turned, in another unit, or with its things in another order, is the same picture: Welch's t on
//! blocks of pixels and on the whole picture.
//!
//! Each comparison may reject with probability 10⁻⁴ although both are right (Bonferroni over its blocks and channels).

mod common;

use common::{block_means, film, gpu, named_scene, settings, worst_t};
use etendue::scene::{Scene, Shape};
use glam::{DMat3, DVec3};

const FALSE_ALARM: f64 = 1e-4;
const RUNS: u32 = 8;
const SIZE: [u32; 2] = [40, 30];
const SPP: u64 = 96;

/// `scene` with every point p at scale · rotation p + shift.
fn moved(scene: &Scene, scale: f64, rotation: DMat3, shift: DVec3) -> Scene {
    let point = |p: &mut DVec3| *p = rotation * *p * scale + shift;
    let turn = |n: &mut DVec3| *n = rotation * *n;
    let mut s = scene.clone();
    point(&mut s.camera.eye);
    point(&mut s.camera.look_at);
    turn(&mut s.camera.up);
    for l in &mut s.lights {
        point(&mut l.center);
        turn(&mut l.normal);
        l.radius *= scale;
    }
    for p in &mut s.primitives {
        match &mut p.shape {
            Shape::Sphere { center, radius } => {
                point(center);
                *radius *= scale;
            }
            Shape::Plane { point: at, normal } => {
                point(at);
                turn(normal);
            }
            Shape::Disk {
                center,
                normal,
                radius,
            } => {
                point(center);
                turn(normal);
                *radius *= scale;
            }
            Shape::Cylinder { base, top, radius } => {
                point(base);
                point(top);
                *radius *= scale;
            }
        }
    }
    s
}

/// The scene from the other end of its file.
fn reversed(scene: &Scene) -> Scene {
    let mut s = scene.clone();
    s.primitives.reverse();
    s.lights.reverse();
    s
}

fn runs(s: &Scene, first_seed: u32) -> Vec<Vec<[f64; 3]>> {
    let settings = settings(s, SIZE, 0);
    let mut engine = gpu(s, &settings, None);
    let run = |k| {
        engine.reseed(first_seed + k);
        block_means(&film(&mut engine, &settings, SPP), 5)
    };
    (0..RUNS).map(run).collect()
}

fn check(name: &str) {
    let s = named_scene(name);
    let still = (1.0, DMat3::IDENTITY, DVec3::ZERO);
    let turned = DMat3::from_axis_angle(DVec3::new(0.48, 0.6, -0.64), 2.0);
    let variants = [
        ("reversed", reversed(&s), still),
        (
            "shifted",
            s.clone(),
            (1.0, DMat3::IDENTITY, DVec3::new(40.0, -70.0, 100.0)),
        ),
        ("turned", s.clone(), (1.0, turned, DVec3::ZERO)),
        (
            "1000 times as large",
            s.clone(),
            (1000.0, DMat3::IDENTITY, DVec3::ZERO),
        ),
        (
            "1000 times as small",
            s.clone(),
            (1e-3, DMat3::IDENTITY, DVec3::ZERO),
        ),
    ];
    let plain = runs(&s, 0);
    for (k, (what, s, (scale, rotation, shift))) in variants.into_iter().enumerate() {
        let other = runs(&moved(&s, scale, rotation, shift), 100 * (k as u32 + 1));
        let worst = worst_t(&plain, &other);
        println!("{name}, {what}: {worst:?}");
        assert!(worst.tests > 100, "{name}, {what}: {worst:?}");
        assert!(
            worst.p * worst.tests as f64 >= FALSE_ALARM,
            "{name}, {what}: {worst:?}"
        );
    }
}

#[test]
fn three_materials() {
    check("three_materials");
}

#[test]
fn several_lights() {
    check("several_lights");
}
