//! Isosurfaces of volumes: what the kernels meet against the f64 reference, which goes through every cell; and against spheres, whose
//! distance a volume may hold.

use super::judge::failures_of;
use super::rays::shoot;
use crate::common::{gpu, settings};
use etendue::gpu::probe::Uniform;
use etendue::world::World;
use etendue::{Grid, Implicit, Numbers, Scene, Volume};
use glam::DVec3;

/// A volume of `size` points with the value of `f` at each, whose coordinates run from -1 to 1.
fn sampled(size: [usize; 3], f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let [nx, ny, nz] = size;
    let along = |k: usize, n: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
    let mut all = Vec::with_capacity(nx * ny * nz);
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                all.push(f(DVec3::new(along(x, nx), along(y, ny), along(z, nz))));
            }
        }
    }
    all
}

fn noise(count: usize) -> Vec<u8> {
    let mut r = Uniform(77);
    (0..count).map(|_| (256.0 * r.next()) as u8).collect()
}

/// Volumes with a level each, each for another reason: a smooth solid in every type, sheets thinner than a cell, what touches its bounds, noise
/// whose cells have all the cubics that there are, specks of one point, and a plane along the grid.
fn volumes() -> Vec<(&'static str, Implicit)> {
    let of = |size: [usize; 3], numbers: Numbers, level: f64| {
        let volume = Volume::new(size, numbers).unwrap_or_else(|e| panic!("{e}"));
        let cells = DVec3::from_array(size.map(|n| (n - 1) as f64));
        let mut implicit = Implicit::of_volume(Grid::new(volume, 2.0 / cells), level);
        implicit.center = DVec3::splat(-1.0);
        implicit
    };
    let floats = |all: Vec<f64>| Numbers::F32(all.into_iter().map(|x| x as f32).collect());
    let ball = |p: DVec3| 0.7 - p.length();
    let blobs = |p: DVec3| {
        let at = |x: f64, y: f64| (-9.0 * (p - DVec3::new(x, y, 0.1)).length_squared()).exp();
        1e5 + 3.0 * (at(0.4, 0.1) + at(-0.4, 0.0) + at(0.0, 0.5))
    };
    let gyroid = |p: DVec3| {
        let [s, c] = [DVec3::sin, DVec3::cos].map(|f| f(5.0 * p));
        0.25 - (s.x * c.y + s.y * c.z + s.z * c.x).abs()
    };
    let specks = (0..21usize.pow(3)).map(|i| {
        if i % 17 == 13 {
            60_000
        } else {
            40 * (i % 7) as u16
        }
    });
    // A shell of less than a cell.
    let shell = |p: DVec3| 0.03 - (p.length() - 0.7).abs();
    vec![
        ("shell", of([32; 3], floats(sampled([32; 3], shell)), 0.0)),
        ("ball", of([24; 3], floats(sampled([24; 3], ball)), 0.0)),
        (
            "blobs",
            of(
                [20, 31, 17],
                Numbers::F64(sampled([20, 31, 17], blobs)),
                1e5 + 1.2,
            ),
        ),
        ("gyroid", of([40; 3], floats(sampled([40; 3], gyroid)), 0.1)),
        (
            "noise",
            of([12; 3], Numbers::U8(noise(12 * 12 * 12)), 127.5),
        ),
        (
            "specks",
            of([21; 3], Numbers::U16(specks.collect()), 45_000.0),
        ),
        (
            "wall",
            of([9, 5, 6], floats(sampled([9, 5, 6], |p| p.y + 0.3)), 0.05),
        ),
    ]
}

/// A scene of one such surface, with the eye far outside.
pub fn scene_of(implicit: &Implicit, material: &str) -> Scene {
    let scene = Scene::builder()
        .camera([0.3, 0.4, 50.0], [0.01, 0.02, 0.03], 40.0, [8, 8])
        .diffuse("white", [0.5; 3])
        .dielectric("glass", 1.5)
        .isosurface(implicit, material)
        .light([0.0, 90.0, 0.0], [0.0, -1.0, 0.0], 1.0, [1.0; 3]);
    scene.build().unwrap_or_else(|e| panic!("{e}"))
}

/// Of each volume, as a solid seen from outside, a solid of glass, its outside as a solid of glass, and a sheet.
fn all(count: usize) {
    let mut failures = Vec::new();
    for (name, implicit) in volumes() {
        for kind in ["solid", "glass", "hollow", "sheet", "turned"] {
            let mut implicit = implicit.clone();
            let mut material = "glass";
            match kind {
                "solid" => material = "white",
                "hollow" => {
                    let grid = implicit.grid().expect("a volume").clone();
                    let (level, center) = (implicit.level, implicit.center);
                    implicit = Implicit::of_volume(
                        Grid {
                            above: false,
                            smooth: false,
                            ..grid
                        },
                        level,
                    );
                    implicit.center = center;
                }
                "sheet" => {
                    material = "white";
                    implicit.closed = false;
                }
                "turned" => {
                    implicit.center = DVec3::new(5.0, 1.0, -2.0);
                    implicit.rotation =
                        glam::DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.9);
                }
                _ => {}
            }
            let world = World::new(&scene_of(&implicit, material), [8, 8]);
            let report = shoot(&world, count, 1 + count as u64);
            failures.extend(failures_of(&format!("{name} {kind}"), &report, count));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn random_rays_meet_what_the_reference_meets() {
    all(2000);
}

#[test]
#[ignore = "takes half an hour or more: cargo test --release --test implicit -- --ignored a_million_rays_of_each_volume"]
fn a_million_rays_of_each_volume() {
    // A fifth for each of the five kinds; ETENDUE_RAYS for fewer.
    let count = std::env::var("ETENDUE_RAYS")
        .ok()
        .and_then(|n| n.parse().ok());
    all(count.unwrap_or(200_000));
}

/// The distance from a point, less a radius, at so many points a side of a cube from -1 to 1.
pub fn distances(side: usize, radius: f64) -> Implicit {
    let all = sampled([side; 3], |p| radius - (p - DVec3::splat(0.013)).length());
    let numbers = Numbers::F32(all.into_iter().map(|x| x as f32).collect());
    let volume = Volume::new([side; 3], numbers).unwrap_or_else(|e| panic!("{e}"));
    let spacing = DVec3::splat(2.0 / (side - 1) as f64);
    let mut implicit = Implicit::of_volume(Grid::new(volume, spacing), 0.0);
    implicit.center = DVec3::splat(-1.0);
    implicit
}

/// The root mean square distance of hits from the sphere, and the largest.
fn off_sphere(side: usize) -> [f64; 2] {
    let world = World::new(&scene_of(&distances(side, 0.8), "white"), [8, 8]);
    let hits = super::rays::hits(&world, 20_000, 3);
    let off = hits
        .iter()
        .map(|p| (*p - DVec3::splat(0.013)).length() - 0.8);
    let (mut squares, mut most) = (0.0, 0.0f64);
    for o in off {
        squares += o * o;
        most = most.max(o.abs());
    }
    assert!(hits.len() > 4000, "{}", hits.len());
    [(squares / hits.len() as f64).sqrt(), most]
}

/// Linear interpolation is wrong by the second derivative times the square of a cell's side: a volume of a sphere's distance comes nearer to the
/// sphere with the square of the number of points.
fn converges(sides: &[usize]) {
    let all: Vec<[f64; 2]> = sides.iter().map(|n| off_sphere(*n)).collect();
    for (n, off) in sides.iter().zip(&all) {
        println!("{n}: {:.3e} off on average, at most {:.3e}", off[0], off[1]);
    }
    for (pair, off) in sides.windows(2).zip(all.windows(2)) {
        let ratio = ((pair[1] - 1) as f64 / (pair[0] - 1) as f64).powi(2);
        let found = off[0][0] / off[1][0];
        // What f32 adds to both.
        let rounding = 2e-7;
        assert!(
            found < 1.15 * ratio && (found > 0.85 * ratio || off[1][0] < 3.0 * rounding),
            "{pair:?}: {found}, not {ratio}"
        );
    }
}

#[test]
fn distances_of_a_sphere_converge_to_it() {
    converges(&[16, 32, 64, 128]);
}

#[test]
#[ignore = "takes minutes and gigabytes: cargo test --release --test implicit -- --ignored converge_up_to"]
fn distances_of_a_sphere_converge_up_to_512() {
    converges(&[64, 128, 256, 512]);
}

#[test]
fn two_volumes_beside_each_other_are_told_apart() {
    let [mut a, mut b] = [distances(20, 0.3), distances(24, 0.4)];
    (a.center.x, b.center.x) = (-2.0, 0.5);
    let scene = Scene::builder()
        .camera([0.0, 0.0, 9.0], [0.0; 3], 40.0, [32, 24])
        .diffuse("white", [0.5; 3])
        .diffuse("red", [0.5, 0.0, 0.0])
        .isosurface(&a, "white")
        .isosurface(&b, "red")
        .light([0.0, 9.0, 9.0], [0.0, -1.0, -1.0], 1.0, [9.0; 3])
        .build()
        .unwrap_or_else(|e| panic!("{e}"));
    let world = World::new(&scene, [32, 24]);
    let settings = settings(&scene, [32, 24], 0);
    let film = crate::common::film(&mut gpu(&scene, &settings, None), &settings, 16);
    let [mut left, mut right] = [DVec3::ZERO; 2];
    film.for_each(|x, _, e| {
        let side = if x < 16 { &mut left } else { &mut right };
        *side += DVec3::from_array(e.mean);
    });
    assert_eq!(world.primitives.len(), 2);
    assert!(left.x > 0.0 && (left.x - left.y).abs() < 1e-6, "{left}");
    assert!(right.x > 0.0 && right.y == 0.0, "{right}");
}
