//! Walks through trees against loops over all surfaces: the same surface at the same distance, to the bit where a compiler
//! takes products and sums as they stand.

use super::probe::{Probe, Uniform, Values};
use super::{Choice, Gpu};
use crate::kernel::{Access, scene_probe_source};
use crate::scene::parse::parse_str;
use crate::settings::{Overrides, Settings};
use crate::world::{Geometry, World};
use glam::DVec3;
use std::fmt::Write as _;

/// Rays into each scene.
const RAYS: usize = 170_000;

/// How far distances may differ, relatively, where a compiler may fuse products with sums, and does so otherwise in another
/// kernel: an H200 gave 124 of 170 000 hits in one of the scenes other last bits, the worst by 5·10⁻⁶.
const FUSED: f32 = 1e-5;

const BODY: &str = "
    let ray = Ray(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]), u32(x[6]), 0u, NO_FACE);
    let hit = intersect(ray);
    y[0] = select(f32(hit.key), -1.0, hit.key == NONE);
    y[1] = hit.t;
    let shadow = Ray(ray.o, ray.d, ray.face, 0u, u32(x[7]));
    y[2] = select(0.0, 1.0, occluded(shadow, x[8], 0u));
";

fn vector(r: &mut Uniform, half: f64) -> [f64; 3] {
    [(); 3].map(|()| r.between(-half, half))
}

const STAGE: &str = "\
[camera]
eye = [0.3, 0.2, 30]
look_at = [0, 0, 0]
vfov = 40
resolution = [8, 6]
[material.white]
type = 'diffuse'
reflectance = [0.7, 0.7, 0.7]
[material.glass]
type = 'dielectric'
[[light]]
center = [0, 9, 0]
normal = [0, -1, 0]
radius = 0.5
radiance = [9, 9, 9]
";

fn sphere(s: &mut String, center: [f64; 3], radius: f64, material: &str) {
    let _ = writeln!(
        s,
        "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = '{material}'"
    );
}

fn disk(s: &mut String, kind: &str, center: [f64; 3], normal: [f64; 3], radius: f64) {
    let last = if kind == "disk" {
        "material = 'white'"
    } else {
        "radiance = [1, 2, 3]"
    };
    let _ = writeln!(
        s,
        "[[{kind}]]\ncenter = {center:?}\nnormal = {normal:?}\nradius = {radius:?}\n{last}"
    );
}

fn cylinder(s: &mut String, base: [f64; 3], top: [f64; 3], radius: f64, material: &str) {
    let _ = writeln!(
        s,
        "[[cylinder]]\nbase = {base:?}\ntop = {top:?}\nradius = {radius:?}\nmaterial = '{material}'"
    );
}

/// A bit of everything.
fn mixed(r: &mut Uniform, of_each: usize) -> String {
    let mut s = STAGE.to_owned();
    s += "[[plane]]\npoint = [0, -6, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n";
    for i in 0..of_each {
        let material = if i % 3 == 0 { "glass" } else { "white" };
        let size = r.between(0.02, 0.4);
        sphere(&mut s, vector(r, 5.0), size, material);
        disk(&mut s, "disk", vector(r, 5.0), vector(r, 1.0), size);
        let base = vector(r, 5.0);
        let along = vector(r, 1.0);
        let top = [0, 1, 2].map(|k| base[k] + along[k]);
        cylinder(&mut s, base, top, 0.3 * size, material);
        disk(&mut s, "light", vector(r, 5.0), vector(r, 1.0), 0.5 * size);
    }
    s
}

/// Spheres about one point, many of them equal.
fn concentric(r: &mut Uniform) -> String {
    let mut s = STAGE.to_owned();
    for i in 0..150 {
        let radius = if i % 2 == 0 { 2.0 } else { r.between(0.5, 3.0) };
        sphere(
            &mut s,
            [1.0, 0.0, 0.0],
            radius,
            if i % 5 == 0 { "glass" } else { "white" },
        );
    }
    s
}

/// One giant, and dust all over it.
fn dust(r: &mut Uniform) -> String {
    let mut s = STAGE.to_owned();
    sphere(&mut s, [0.0, -1000.0, 0.0], 998.0, "white");
    for _ in 0..200 {
        let [x, y, z] = vector(r, 4.0);
        sphere(
            &mut s,
            [x, y.abs() * 0.01 - 2.0, z],
            10f64.powf(r.between(-5.0, -1.0)),
            "white",
        );
    }
    s
}

/// Disks and lights in a few planes, one over the other.
fn coplanar(r: &mut Uniform) -> String {
    let mut s = STAGE.to_owned();
    for i in 0..150 {
        let [x, y, _] = vector(r, 4.0);
        let z = f64::from(i % 3);
        let radius = r.between(0.1, 1.0);
        if i % 2 == 0 {
            disk(&mut s, "disk", [x, y, z], [0.0, 0.0, 1.0], radius);
        } else {
            disk(&mut s, "light", [x, y, z], [0.0, 0.0, -1.0], radius);
        }
        cylinder(&mut s, [y, x, z], [y, x, z + 1.0], 0.2, "white");
    }
    s
}

/// From a hundredth of a thousandth to a hundred thousand.
fn scales(r: &mut Uniform) -> String {
    let mut s = STAGE.to_owned();
    for _ in 0..200 {
        let scale = 10f64.powf(r.between(-2.0, 5.0));
        let size = 0.2 * scale * r.next() + 1e-5;
        let material = if r.next() < 0.2 { "glass" } else { "white" };
        sphere(&mut s, vector(r, scale), size, material);
        disk(&mut s, "disk", vector(r, scale), vector(r, 1.0), size);
    }
    s
}

/// Rays from all about, some along the axes, some from surfaces, aimed at nothing or at the light.
fn rays(world: &World, r: &mut Uniform, half: f64) -> Vec<Values> {
    (0..RAYS)
        .map(|i| {
            let mut x: Values = [0.0; 16];
            let from = vector(r, half).map(|v| v as f32);
            let d = loop {
                let v = vector(r, 1.0);
                let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
                if length > 0.1 && length < 1.0 {
                    break v.map(|c| (c / length) as f32);
                }
            };
            x[..3].copy_from_slice(&from);
            x[3..6].copy_from_slice(&d);
            if i % 10 == 0 {
                let axis = i / 10 % 3;
                for k in 0..3 {
                    let sign = if r.next() < 0.5 { -1.0 } else { 1.0 };
                    x[3 + k] = if k == axis { sign } else { sign * 0.0 };
                }
            }
            if i % 3 == 0 {
                // Standing on a face.
                let p = &world.primitives[(r.next() * world.primitives.len() as f64) as usize];
                let out = DVec3::from_array(vector(r, 1.0)).normalize();
                let at = match p.geometry {
                    Geometry::Sphere { center, radius } => Some(center + radius * out),
                    Geometry::Disk { center, .. } => Some(center),
                    Geometry::Cylinder {
                        base, axis, radius, ..
                    } => Some(base + 0.1 * axis + radius * axis.cross(out).normalize()),
                    _ => None,
                };
                if let Some(at) = at {
                    x[..3].copy_from_slice(&at.as_vec3().to_array());
                    x[6] = p.faces[0] as f32;
                }
            }
            if i % 2 == 0 {
                let l = &world.lights[(r.next() * world.lights.len() as f64) as usize];
                x[7] = l.face as f32;
            }
            x[8] = (half * r.next()) as f32;
            x
        })
        .collect()
}

#[test]
fn a_walk_through_trees_meets_what_a_loop_meets() {
    let gpu = Gpu::open(&Choice::default()).expect("an adapter");
    let mut r = Uniform(11);
    let scenes = [
        ("few", mixed(&mut r, 3), 6.0),
        ("mixed", mixed(&mut r, 60), 6.0),
        ("concentric", concentric(&mut r), 4.0),
        ("dust", dust(&mut r), 4.0),
        ("coplanar", coplanar(&mut r), 5.0),
        ("scales", scales(&mut r), 300.0),
    ];
    for (name, text, half) in scenes {
        let scene = parse_str(format!("{name}.toml").as_ref(), &text).expect("a scene");
        let settings = Settings::resolve(&scene, &Overrides::default());
        let world = World::new(&scene, settings.size);
        let inputs = rays(&world, &mut r, half);
        let run = |access| {
            let source = scene_probe_source(&world, &settings, access, BODY);
            let probe = Probe::compile(&gpu, &source, Some(access)).expect("a probe");
            probe.run(&gpu, Some(&world), &inputs).expect("outputs")
        };
        let (loops, walks) = (run(Access::Buffers), run(Access::Tree));
        let hits = loops.iter().filter(|y| y[0] >= 0.0).count();
        let shadows = loops.iter().filter(|y| y[2] == 1.0).count();
        println!("{name}: {hits} hits, {shadows} shadows of {RAYS}");
        assert!(
            hits > RAYS / 100 && shadows > RAYS / 1000,
            "{name}: {hits} {shadows}"
        );
        let fuses = !gpu.info().software;
        let same = |a: &Values, b: &Values| {
            let alike = |a: f32, b: f32| fuses && (a - b).abs() <= FUSED * b.abs();
            let equal = |k: usize| a[k].to_bits() == b[k].to_bits();
            equal(0) && equal(2) && (equal(1) || alike(a[1], b[1]))
        };
        let wrong: Vec<usize> = (0..RAYS).filter(|&i| !same(&loops[i], &walks[i])).collect();
        if let Some(&i) = wrong.first() {
            let (x, a, b) = (&inputs[i][..9], &loops[i][..3], &walks[i][..3]);
            panic!(
                "{name}: {} of {RAYS} differ; {x:?}: {a:?}, but {b:?}",
                wrong.len()
            );
        }
    }
}

/// Small things in general position, of each kind, in a box of side 2; nothing else but the light.
fn crowd(r: &mut Uniform, of_each: usize) -> String {
    let mut s = STAGE.to_owned();
    for _ in 0..of_each {
        sphere(&mut s, vector(r, 1.0), 0.01, "white");
        disk(&mut s, "disk", vector(r, 1.0), vector(r, 1.0), 0.01);
        let base = vector(r, 1.0);
        let top = base.map(|x| x + 0.01);
        cylinder(&mut s, base, top, 0.005, "white");
    }
    s
}

/// The same, and far away a giant of each kind, which shares a function, and might share a tree, with the small things.
fn crowd_and_giants(r: &mut Uniform, of_each: usize) -> String {
    let mut s = crowd(r, of_each);
    sphere(&mut s, [2e7, 0.0, 0.0], 2e4, "white");
    disk(&mut s, "disk", [0.0, 2e7, 0.0], [0.0, 1.0, 1.0], 2e4);
    let (base, top) = ([0.0, 0.0, -2e7], [0.0, 1e5, -2e7]);
    cylinder(&mut s, base, top, 2e4, "white");
    s
}

/// A ray from afar is known only to 2^-24 of its distance. It may meet another thing than it should by that much, but it is one ray: the
/// walk visits no more of the tree than one from near by.
#[test]
fn a_walk_from_afar_is_as_short_as_one_from_near_by() {
    const BODY: &str = "
        let ray = Ray(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]), NO_FACE, 0u, NO_FACE);
        let all = trips_left;
        let hit = intersect(ray);
        y[0] = select(0.0, 1.0, hit.key != NONE);
        y[1] = hit.t;
        y[2] = f32(all - trips_left);
    ";
    const EACH: usize = 20_000;
    let gpu = Gpu::open(&Choice::default()).expect("an adapter");
    let mut r = Uniform(12);
    let scenes = [
        ("crowd", crowd(&mut r, 1000)),
        ("giants", crowd_and_giants(&mut r, 1000)),
    ];
    for (name, text) in scenes {
        let scene = parse_str(format!("{name}.toml").as_ref(), &text).expect("a scene");
        let settings = Settings::resolve(&scene, &Overrides::default());
        let world = World::new(&scene, settings.size);
        let source = scene_probe_source(&world, &settings, Access::Tree, BODY);
        let probe = Probe::compile(&gpu, &source, Some(Access::Tree)).expect("a probe");
        // Where the small things are, in the world's coordinates.
        let boxes = world.primitives.iter().filter_map(|p| p.geometry.bounds());
        let small = boxes.filter(|b| (b.max - b.min).max_element() < 1.0);
        let corners: Vec<[DVec3; 2]> = small.map(|b| [b.min, b.max]).collect();
        let low = corners.iter().map(|c| c[0]).reduce(DVec3::min);
        let high = corners.iter().map(|c| c[1]).reduce(DVec3::max);
        let (low, high) = (low.expect("things"), high.expect("things"));
        // The mean of hits, the mean of trips, and the most trips of rays towards the box from so many of its sizes away.
        let mut of = |distance: f64| -> (f64, f64, f64) {
            let inputs: Vec<Values> = (0..EACH)
                .map(|_| {
                    let out = DVec3::from_array(vector(&mut r, 1.0)).normalize();
                    let to = low + (high - low) * DVec3::from_array([(); 3].map(|()| r.next()));
                    let from = (to + distance * (high - low).length() * out).as_vec3();
                    let d = -out.as_vec3();
                    let mut x: Values = [0.0; 16];
                    x[..3].copy_from_slice(&from.to_array());
                    x[3..6].copy_from_slice(&d.to_array());
                    x
                })
                .collect();
            let outputs = probe.run(&gpu, Some(&world), &inputs).expect("outputs");
            let mean =
                |k: usize| outputs.iter().map(|y| f64::from(y[k])).sum::<f64>() / EACH as f64;
            let longest = outputs.iter().map(|y| f64::from(y[2])).fold(0.0, f64::max);
            (mean(0), mean(2), longest)
        };
        let near = of(5.0);
        let (hits, trips, longest) = near;
        println!("{name}: {near:?}");
        assert!(hits > 0.1, "{name}: {hits}");
        for distance in [1e2, 1e4, 1e6, 1e8] {
            let far = of(distance);
            println!("{name}, {distance:e}: {far:?}");
            // The share of hits is that of near rays, to eight standard errors. From 1e8 sizes away, a point in f32 is no longer on
            // its ray.
            assert!(
                distance > 1e6 || (far.0 - hits).abs() < 0.02,
                "{name}, {distance:e}: {} hits",
                far.0
            );
            assert!(
                far.1 < 1.1 * trips && far.2 < 2.0 * longest,
                "{name}, {distance:e}: {far:?}, not {trips} {longest}"
            );
        }
    }
}
