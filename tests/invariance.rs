//! The same scene elsewhere, turned, in another unit, or with its things in another order, is the same picture: Welch's t on
//! blocks of pixels and on the whole picture.
//!
//! Each comparison may reject with probability 10⁻⁴ although both are right (Bonferroni over its blocks and channels).
//!
//! In another order and under other names, it is the same bits.

mod common;

use common::{block_means, cpu, film, gpu, named_scene, settings, worst_t};
use etendue::kernel::Access;
use etendue::provenance::hash::scene_hash;
use etendue::reference::Estimator;
use etendue::scene::{Bsdf, Scene, Shape};
use etendue::selftest::build::{Build, GLASS, MIRROR, cylinder, disk, grey, plane, sphere, v};
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
            Shape::Implicit(_) => unreachable!("these scenes have none"),
        }
    }
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
    let turned = DMat3::from_axis_angle(DVec3::new(0.48, 0.6, -0.64), 2.0);
    let variants = [
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
        // Near the ends of the format's range, where fourth powers of lengths leave f32.
        (
            "10^13 times as small",
            s.clone(),
            (1e-13, DMat3::IDENTITY, DVec3::ZERO),
        ),
        (
            "10^13 times as large",
            s.clone(),
            (1e13, DMat3::IDENTITY, DVec3::ZERO),
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

/// Numbers below `n`, one after another (Knuth's linear congruence).
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as usize
    }

    fn shuffle<T>(&mut self, list: &mut [T]) {
        for k in (1..list.len()).rev() {
            list.swap(k, self.below(k + 1));
        }
    }
}

/// Shuffles `list`, and lets those that have a `rank`, which coincide, stand in the order of their ranks.
fn shuffle<T: Clone>(dice: &mut Dice, list: &mut [T], rank: impl Fn(&T) -> Option<usize>) {
    dice.shuffle(list);
    let places: Vec<usize> = (0..list.len())
        .filter(|&k| rank(&list[k]).is_some())
        .collect();
    let mut ranked: Vec<T> = places.iter().map(|&k| list[k].clone()).collect();
    ranked.sort_by_key(&rank);
    for (place, thing) in places.into_iter().zip(ranked) {
        list[place] = thing;
    }
}

/// Another file with the same meaning. Coincident things have lines, which say their order.
fn shuffled(scene: &Scene, dice: &mut Dice) -> Scene {
    let mut s = scene.clone();
    shuffle(dice, &mut s.primitives, |p| (p.line > 0).then_some(p.line));
    shuffle(dice, &mut s.lights, |l| (l.line > 0).then_some(l.line));
    // Materials elsewhere, under other names; and one that nothing uses.
    let mut to: Vec<usize> = (0..s.materials.len()).collect();
    dice.shuffle(&mut to);
    for (from, &to) in to.iter().enumerate() {
        s.materials[to] = scene.materials[from].clone();
        s.materials[to].name = format!("m{}", dice.below(1 << 20));
    }
    s.primitives
        .iter_mut()
        .for_each(|p| p.material = to[p.material]);
    let mut unused = s.materials[0].clone();
    unused.bsdf = grey(0.123);
    s.materials.push(unused);
    s
}

/// Everything that the format has, and nothing that coincides but what is flush on a wall.
fn everything() -> Scene {
    let gloss = |exponent| Bsdf::Phong {
        diffuse: v(0.3, 0.1, 0.1),
        specular: DVec3::splat(0.4),
        exponent,
    };
    let build = Build::new(v(0.2, 0.1, 0.9), v(0.0, -0.1, 0.0), 70.0)
        .add(plane(-DVec3::X, DVec3::X), grey(0.7))
        .add(plane(DVec3::X, -DVec3::X), grey(0.5))
        .add(plane(-DVec3::Y, DVec3::Y), grey(0.6))
        .add(plane(DVec3::Y, -DVec3::Y), grey(0.7))
        .add(plane(-DVec3::Z, DVec3::Z), gloss(3.0))
        .add(plane(DVec3::Z, -DVec3::Z), grey(0.5))
        .add(sphere(v(-0.5, -0.7, -0.5), 0.3), MIRROR)
        .add(sphere(v(0.0, -0.75, -0.1), 0.25), gloss(20.0))
        .add(sphere(v(0.5, -0.7, 0.1), 0.25), GLASS)
        .add(sphere(v(-0.4, -0.8, 0.3), 0.2), GLASS)
        .add(
            cylinder(v(0.5, -1.0, -0.6), v(0.5, -0.2, -0.6), 0.2),
            grey(0.6),
        )
        .add(cylinder(v(-0.8, 0.2, -0.3), v(-0.6, 0.4, -0.8), 0.1), GLASS)
        .add(disk(v(-0.8, 0.3, -0.2), v(1.0, 0.3, 0.0), 0.2), gloss(50.0))
        .add(disk(v(0.1, 0.1, -1.0), DVec3::Z, 0.3), grey(0.2))
        .light(v(-0.3, 1.0, 0.0), -DVec3::Y, 0.2, 3.0)
        .light(v(0.3, 1.0, 0.0), -DVec3::Y, 0.2, 2.0)
        .light(v(0.99, 0.3, 0.3), -DVec3::X, 0.3, 0.6);
    build.0
}

/// Coinciding surfaces of every kind, whose order decides which one rays meet.
fn coincident() -> Scene {
    let mut s = Build::new(v(0.0, 1.2, 2.5), v(0.0, 0.3, 0.0), 60.0)
        // By rank, which is their order: planes, disks, cylinders, spheres, each in one place.
        .add(plane(DVec3::ZERO, DVec3::Y), grey(0.7))
        .add(plane(DVec3::ZERO, -DVec3::Y), grey(0.1))
        .add(disk(v(-0.5, 0.0, 0.5), DVec3::Y, 0.4), grey(0.9))
        .add(disk(v(-0.2, 0.0, 0.5), -DVec3::Y, 0.4), grey(0.3))
        .add(disk(v(-0.4, 0.0, 0.8), DVec3::Y, 0.4), MIRROR)
        .add(cylinder(v(0.9, 0.0, 0.0), v(0.9, 0.5, 0.0), 0.3), grey(0.8))
        .add(cylinder(v(0.9, 0.7, 0.0), v(0.9, 0.2, 0.0), 0.3), MIRROR)
        .add(cylinder(v(1.1, 0.2, 0.1), v(1.1, 0.7, 0.1), 0.3), grey(0.2))
        .add(sphere(v(-0.9, 0.5, -0.5), 0.4), grey(0.1))
        .add(sphere(v(-0.9, 0.5, -0.5), 0.4), MIRROR)
        .add(sphere(v(0.2, 0.3, 0.2), 0.2), GLASS)
        .add(sphere(v(0.2, 0.3, 0.2), 0.2), grey(0.4))
        // And what coincides with nothing.
        .add(sphere(v(0.4, 0.3, -0.9), 0.3), grey(0.5))
        .add(disk(v(0.0, 0.5, -2.0), DVec3::Z, 1.0), grey(0.6))
        .light(v(0.0, 1.5, 0.0), -DVec3::Y, 0.4, 5.0)
        .light(v(0.3, 1.5, 0.0), -DVec3::Y, 0.4, 1.0)
        .light(v(0.1, 1.5, 0.2), DVec3::Y, 0.4, 9.0)
        .light(v(-2.0, 1.0, 1.0), v(1.0, 0.0, -0.5), 0.2, 4.0)
        .0;
    for (k, p) in s.primitives.iter_mut().take(12).enumerate() {
        p.line = k + 1;
    }
    for (k, l) in s.lights.iter_mut().take(3).enumerate() {
        l.line = k + 1;
    }
    s
}

/// The bits of a small picture, from the adapter by either kernel and from the reference.
fn bits(s: &Scene) -> Vec<Vec<[u64; 3]>> {
    let settings = settings(s, [24, 18], 3);
    let of = |engine: &mut dyn etendue::engine::Engine, spp| {
        let mut out = Vec::new();
        film(engine, &settings, spp).for_each(|_, _, e| out.push(e.mean.map(f64::to_bits)));
        out
    };
    vec![
        of(&mut gpu(s, &settings, Some(Access::Baked)), 16),
        of(&mut gpu(s, &settings, Some(Access::Buffers)), 16),
        of(&mut cpu(s, &settings, Estimator::LightSampling), 4),
    ]
}

fn same_in_any_order(s: &Scene) {
    let (expected, hash) = (bits(s), scene_hash(s, &settings(s, [24, 18], 3)));
    let mut dice = Dice(1);
    for k in 0..6 {
        let other = shuffled(s, &mut dice);
        assert_ne!(other.primitives, s.primitives);
        assert_eq!(scene_hash(&other, &settings(&other, [24, 18], 3)), hash);
        assert!(bits(&other) == expected, "shuffle {k}");
    }
}

#[test]
fn order_and_names_change_no_bit() {
    same_in_any_order(&everything());
    for name in ["three_materials", "several_lights"] {
        let mut s = named_scene(name);
        s.primitives.iter_mut().for_each(|p| p.line = 0);
        s.lights.iter_mut().for_each(|l| l.line = 0);
        same_in_any_order(&s);
    }
}

#[test]
fn coincident_surfaces_are_met_in_file_order_wherever_they_stand() {
    let s = coincident();
    same_in_any_order(&s);
    // Each of them the other way round is another picture, of another name.
    let (expected, hash) = (bits(&s), scene_hash(&s, &settings(&s, [24, 18], 3)));
    let turned = [[0, 1], [2, 3], [5, 6], [6, 7], [8, 9], [10, 11]];
    let swaps = turned.map(|[a, b]| {
        let mut s = s.clone();
        s.primitives.swap(a, b);
        (format!("primitives {a} and {b}"), s)
    });
    let lights = [[0, 1], [1, 2]].map(|[a, b]| {
        let mut s = s.clone();
        s.lights.swap(a, b);
        (format!("lights {a} and {b}"), s)
    });
    for (what, other) in swaps.into_iter().chain(lights) {
        assert_ne!(
            scene_hash(&other, &settings(&other, [24, 18], 3)),
            hash,
            "{what}"
        );
        for (a, b) in bits(&other).iter().zip(&expected) {
            assert!(a != b, "{what}");
        }
    }
}
