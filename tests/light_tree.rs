//! The light tree: compares its pictures with the CPU reference, which weighs every light for every choice, and checks its
//! probabilities one by one.
//!
//! The pictures have only direct light. Every path chooses a light there, and some hit one without light sampling, so every
//! error in the choice or in its weights fully affects the picture. The mean of the picture is known to 0.2 %.
//!
//! We tried these faults in the shaders, and the tests detect them:
//!
//! - by picture and probabilities: the stated probability of the first half of all lights is 2 % too large; first halves are
//!   chosen 2 % too often, or 4 % in the last level only; halves are swapped in the look-up; the fourth light of
//!   a cluster is never chosen;
//! - only by the picture: lights hit without light sampling are weighted with 1.5 times their probability, or with 1 % for each;
//!   light samples on diffuse surfaces are not weighted at all;
//! - only by the probabilities, since they change the picture by at most 0.25 %: one cluster in eight has a
//!   probability wrong by 2 %; clusters count as dark at cosines below 0.15, of lamps, of the receiver or of both; bounding
//!   balls of clusters are too small by 0.3 of their radius; cones are too narrow by 0.2 in the cosine, or left out.
//!
//! Not detected: lights hit without light sampling are weighted with 0.98 of their probability, which changes the picture by
//! 0.1 %.

mod common;

use common::{block_means, cpu, film, scene, settings, worst_t};
use etendue::gpu::probe::{Probe, UNWRITTEN, Uniform, Values};
use etendue::gpu::{Choice, Gpu, GpuEngine};
use etendue::kernel::{Access, scene_probe_source};
use etendue::reference::Estimator;
use etendue::scene::Scene;
use etendue::settings::{LightParts, Settings};
use etendue::world::{Geometry, MAX_SCANNED_LIGHTS, World};
use glam::DVec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

const FALSE_ALARM: f64 = 1e-4;
const SIZE: [u32; 2] = [32, 24];
/// Pixels along an edge of a block: few enough that a lamp's surroundings are one of their own.
const BLOCK: u32 = 8;
const RUNS: u32 = 16;
/// Samples a run, on the GPU and of the reference.
const SAMPLES: [u64; 2] = [512, 512];

/// With an evenly distributed logarithm.
fn scale(r: &mut Uniform, a: f64, b: f64) -> f64 {
    a * (b / a).powf(r.next())
}

fn inside(r: &mut Uniform, [low, high]: [[f64; 3]; 2]) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|k| r.between(low[k], high[k])))
}

fn direction(r: &mut Uniform) -> DVec3 {
    let (z, turn) = (r.between(-1.0, 1.0), TAU * r.next());
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}

/// The inside of the hall, which is open behind the camera.
const HALL: [[f64; 3]; 2] = [[-4.0, 0.0, -8.0], [4.0, 4.0, 6.0]];

/// A hall with glossy floor, columns and balls, and a hundred lamps of all sizes, colours and directions: hanging, turned up,
/// close to walls and turned to them, far away and very bright.
fn hall() -> Scene {
    let mut text = String::from(
        "[camera]\neye = [0, 1.7, 5.5]\nlook_at = [0, 1.6, 0]\nvfov = 60\nresolution = [32, 24]\n\
         [material.stone]\ntype = 'diffuse'\nreflectance = [0.7, 0.7, 0.6]\n\
         [material.marble]\ntype = 'phong'\ndiffuse = [0.2, 0.2, 0.3]\nspecular = [0.6, 0.6, 0.6]\nexponent = 30\n",
    );
    for (point, normal, material) in [
        ("[0, 0, 0]", "[0, 1, 0]", "marble"),
        ("[0, 4, 0]", "[0, -1, 0]", "stone"),
        ("[-4, 0, 0]", "[1, 0, 0]", "stone"),
        ("[4, 0, 0]", "[-1, 0, 0]", "stone"),
        ("[0, 0, -8]", "[0, 0, 1]", "stone"),
    ] {
        text +=
            &format!("[[plane]]\npoint = {point}\nnormal = {normal}\nmaterial = '{material}'\n");
    }
    for i in 0..6 {
        let (x, z) = ([-2.5, 2.5][i % 2], 3.0 - 3.0 * (i / 2) as f64);
        text += &format!(
            "[[cylinder]]\nbase = [{x}, 0, {z}]\ntop = [{x}, 4, {z}]\nradius = 0.3\nmaterial = 'stone'\n\
             [[sphere]]\ncenter = [{}, 0.5, {}]\nradius = 0.5\nmaterial = 'marble'\n",
            0.5 * x,
            z - 1.0
        );
    }
    let mut r = Uniform(5);
    let mut lamp = |center: DVec3, normal: DVec3, radius: f64, power: f64, r: &mut Uniform| {
        let hue = [0.0, 1.0, 2.0].map(|k| 0.1 + (0.5 + 0.5 * (TAU * k / 3.0 + 9.0 * power).cos()));
        let [red, green, blue] = hue.map(|c| c * power * scale(r, 0.3, 3.0) / (radius * radius));
        text += &format!(
            "[[light]]\ncenter = {:?}\nnormal = {:?}\nradius = {radius}\nradiance = [{red}, {green}, {blue}]\n",
            center.to_array(),
            normal.to_array()
        );
    };
    let air = [[-3.6, 2.3, -7.0], [3.6, 3.5, 4.0]];
    for i in 0..100 {
        let radius = scale(&mut r, 0.03, 0.25);
        let at = inside(&mut r, air);
        let any = direction(&mut r);
        let down = DVec3::NEG_Y + 0.8 * any;
        match i {
            // Hanging, each turned its own way, and not so few turned up.
            0..=59 => lamp(at, down, radius, 0.1, &mut r),
            60..=74 => lamp(at, -down, radius, 0.1, &mut r),
            // Flush with a wall but for a hair.
            75..=82 => {
                let side = if i % 2 == 0 { 1.0 } else { -1.0 };
                let at = DVec3::new(side * (3.99 - 0.1 * radius), at.y - 1.0, at.z);
                lamp(at, DVec3::NEG_X * side, radius, 0.05, &mut r);
            }
            // Turned to the ceiling close by, or to the back wall.
            83..=89 => lamp(
                at.with_y(3.9 - radius),
                DVec3::Y + 0.2 * any,
                radius,
                0.01,
                &mut r,
            ),
            90..=94 => lamp(
                at.with_z(-7.9 + 2.0 * radius),
                DVec3::NEG_Z + 0.5 * any,
                radius,
                0.02,
                &mut r,
            ),
            // Far away.
            _ => lamp(
                at.with_z(50.0 + 5.0 * at.x),
                DVec3::NEG_Z + 0.1 * any,
                0.4 + radius,
                100.0,
                &mut r,
            ),
        }
    }
    scene(&text)
}

fn direct(hall: &Scene, seed: u32) -> Settings {
    let mut settings = settings(hall, SIZE, seed);
    settings.light = LightParts {
        emitted: false,
        direct: true,
        indirect: false,
    };
    settings
}

fn gpu() -> Gpu {
    Gpu::open(&Choice::default()).expect("an adapter; scripts/test installs one")
}

#[test]
fn the_hall_is_as_bright_as_the_reference_says() {
    let hall = hall();
    let mut settings = direct(&hall, 0);
    let world = World::new(&hall, SIZE);
    assert!(world.lights.len() > 2 * MAX_SCANNED_LIGHTS);
    let mut engine = GpuEngine::on(gpu(), &world, &settings, None).expect("an engine");
    let kernel = engine.kernel();
    assert!(kernel.access == Access::Tree && kernel.wgsl.contains("LIGHT_LEVELS"));
    let tree: Vec<_> = (0..RUNS)
        .map(|seed| {
            settings.seed = seed;
            engine.reseed(seed);
            block_means(&film(&mut engine, &settings, SAMPLES[0]), BLOCK)
        })
        .collect();
    let reference: Vec<_> = (0..RUNS)
        .map(|seed| {
            let settings = direct(&hall, 1000 + seed);
            let mut engine = cpu(&hall, &settings, Estimator::LightSampling);
            block_means(&film(&mut engine, &settings, SAMPLES[1]), BLOCK)
        })
        .collect();
    let worst = worst_t(&tree, &reference);
    println!("{worst:?}");
    let p = worst.p * worst.tests as f64;
    assert!(p > FALSE_ALARM, "p = {p}: {worst:?}");
}

/// Places where light may be asked for: on surfaces of the hall, and anywhere with any normal, close to lamps too.
fn receivers(world: &World, count: usize) -> Vec<[DVec3; 2]> {
    let mut r = Uniform(7);
    let surface = |r: &mut Uniform| {
        let p = inside(r, HALL) - world.origin;
        let primitive = &world.primitives[(r.next() * world.primitives.len() as f64) as usize];
        match primitive.geometry {
            Geometry::Plane { normal, offset } => [p - normal * (normal.dot(p) - offset), normal],
            Geometry::Sphere { center, radius } => {
                let n = direction(r);
                [center + radius * n, n]
            }
            Geometry::Cylinder {
                base, axis, radius, ..
            } => {
                let n = axis.cross(direction(r)).normalize();
                [base + r.between(0.0, 4.0) * axis + radius * n, n]
            }
            _ => [p, direction(r)],
        }
    };
    let place = |i: usize| match i % 4 {
        0 | 1 => surface(&mut r),
        2 => [inside(&mut r, HALL) - world.origin, direction(&mut r)],
        _ => {
            let l = &world.lights[(r.next() * world.lights.len() as f64) as usize];
            let away = l.radius * scale(&mut r, 0.03, 10.0);
            [l.center + away * direction(&mut r), direction(&mut r)]
        }
    };
    let rounded = |[p, n]: [DVec3; 2]| [p.as_vec3().as_dvec3(), n.as_vec3().as_dvec3()];
    (0..count).map(place).map(rounded).collect()
}

/// Runs `body` in the hall's kernel, in which `at` is a receiver and `x[6]` to `x[8]` are free.
fn probe(
    gpu: &Gpu,
    world: &World,
    settings: &Settings,
    body: &str,
    inputs: &[Values],
) -> Vec<Values> {
    let body = format!(
        "let p = vec3f(x[0], x[1], x[2]);
        let at = Receiver(vec3f(x[3], x[4], x[5]), vec3f(x[9], x[10], x[11]), x[12], x[13], x[14]);
        {body}"
    );
    let source = scene_probe_source(world, settings, Access::Tree, &body);
    let probe = Probe::compile(gpu, &source, Some(Access::Tree)).expect("a probe");
    let out = probe.run(gpu, Some(world), inputs).expect("outputs");
    assert!(out.iter().all(|y| y[0] != UNWRITTEN), "nothing written");
    out
}

/// The material of a receiver: the mirror direction of the eye, diffuse and specular reflectance, an eighth of the exponent.
/// Two in five are diffuse. The others are glossy, from dull to almost a mirror; a third of these have no diffuse part.
fn gloss([p, n]: [DVec3; 2]) -> [f64; 6] {
    let mut r = Uniform(p.x.to_bits() ^ p.z.to_bits().rotate_left(21));
    let (kind, share) = ([(); 4].map(|()| r.next())[3], r.next());
    let d = direction(&mut r);
    let [x, y, z] = (d - n * (2.0 * d.dot(n)).min(0.0)).to_array();
    if kind < 0.4 {
        return [x, y, z, 1.0, 0.0, 0.0];
    }
    let exponent = scale(&mut r, 1.0, 1e4);
    let diffuse = if kind < 0.6 { 0.0 } else { 0.5 * share };
    [
        x,
        y,
        z,
        diffuse,
        (0.9 - diffuse) * (0.5 * exponent + 1.0),
        0.125 * exponent,
    ]
}

fn input(at: [DVec3; 2], rest: [f64; 3]) -> Values {
    let mut x = Values::default();
    let [p, n] = at.map(|v| v.to_array());
    let numbers = p.into_iter().chain(n).chain(rest).chain(gloss(at));
    x.iter_mut().zip(numbers).for_each(|(x, v)| *x = v as f32);
    x
}

/// Checks the tree's probability of every light at every receiver: it is positive for every light that can contribute, and the
/// sum is at most 1.
#[test]
fn no_light_is_lost() {
    let (gpu, hall) = (gpu(), hall());
    let settings = direct(&hall, 0);
    let world = World::new(&hall, SIZE);
    let receivers = receivers(&world, 8000);
    let lights = world.lights.len();
    let inputs: Vec<Values> = receivers
        .iter()
        .flat_map(|&at| (0..lights).map(move |i| input(at, [i as f64, 0.0, 0.0])))
        .collect();
    let out = probe(
        &gpu,
        &world,
        &settings,
        "y[0] = light_probability(u32(x[6]), light_at(u32(x[6])), p, at, 0.0);",
        &inputs,
    );
    let mut sending = 0;
    for ([p, n], probabilities) in receivers.iter().zip(out.chunks(lights)) {
        for (l, y) in world.lights.iter().zip(probabilities) {
            // How far p lies before the light, and how far the light reaches above p's horizon.
            let before = l.normal.dot(*p) - l.offset;
            let above = n.dot(l.center - p) + l.radius * n.cross(l.normal).length();
            let rounding = 1e-5 * (1.0 + l.center.length());
            let sends = before > rounding && above > rounding;
            sending += usize::from(sends);
            let probability = f64::from(y[0]);
            assert!(
                (0.0..=1.0001).contains(&probability) && (probability > 0.0 || !sends),
                "{probability}, {before} before, {above} above: {p} {n} {l:?}"
            );
        }
        let sum: f64 = probabilities.iter().map(|y| f64::from(y[0])).sum();
        assert!(sum < 1.0001, "{sum}: {p} {n}");
    }
    assert!(sending > inputs.len() / 5, "{sending} of {}", inputs.len());
}

/// Every light is chosen with its stated probability, both the one that the choice returns and the one for paths that hit the
/// light without light sampling. The choice returns no light with the remaining probability.
#[test]
fn lights_are_chosen_with_the_stated_probability() {
    const TIMES: usize = 4096;
    let (gpu, hall) = (gpu(), hall());
    let settings = direct(&hall, 0);
    let world = World::new(&hall, SIZE);
    let receivers = receivers(&world, 96);
    let lights = world.lights.len();
    let mut r = Uniform(9);
    let mut inputs = Vec::new();
    for &at in &receivers {
        inputs.extend((0..lights).map(|i| input(at, [i as f64, 0.5, 0.5])));
        inputs.extend((0..TIMES).map(|_| input(at, [0.0, r.next(), r.next()])));
    }
    let body = "
        let chosen = choose_light(p, at, vec2f(x[7], x[8]));
        y[0] = select(f32(chosen.index), -1.0, chosen.inverse_probability == 0.0);
        y[1] = chosen.inverse_probability * light_probability(chosen.index, chosen.light, p, at, chosen.weights);
        y[2] = light_probability(u32(x[6]), light_at(u32(x[6])), p, at, 0.0);";
    let out = probe(&gpu, &world, &settings, body, &inputs);
    // By light, and last of all nothing: how often it was chosen, and was to be, and the variance of that.
    let mut counts = vec![[0.0; 3]; lights + 1];
    for (at, out) in receivers.iter().zip(out.chunks(lights + TIMES)) {
        let (said, chosen) = out.split_at(lights);
        let said: Vec<f64> = said.iter().map(|y| f64::from(y[2])).collect();
        let nothing = (1.0 - said.iter().sum::<f64>()).max(0.0);
        for ([_, expected, variance], p) in counts.iter_mut().zip(said.into_iter().chain([nothing]))
        {
            *expected += p * TIMES as f64;
            *variance += p * (1.0 - p) * TIMES as f64;
        }
        for y in chosen {
            let found = y[0] >= 0.0;
            counts[if found { y[0] as usize } else { lights }][0] += 1.0;
            assert!(!found || (y[1] - 1.0).abs() < 1e-3, "{}: {at:?}", y[1]);
        }
    }
    let (rare, often): (Vec<_>, Vec<_>) = counts.into_iter().partition(|[_, e, _]| *e < 20.0);
    let rare = rare
        .iter()
        .fold([0.0; 3], |a, b| [0, 1, 2].map(|k| a[k] + b[k]));
    let all: Vec<_> = often
        .into_iter()
        .chain((rare[1] > 5.0).then_some(rare))
        .collect();
    let chi: f64 = all.iter().map(|[n, e, v]| (n - e).powi(2) / v).sum();
    let p = ChiSquared::new(all.len() as f64).expect("positive").sf(chi);
    println!("χ² = {chi} of {}, p = {p}", all.len());
    assert!(
        all.len() > lights / 2 && p > FALSE_ALARM,
        "{chi} of {}: p = {p}",
        all.len()
    );
}
