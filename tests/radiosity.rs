//! An independent judge: pictures of diffuse rooms against a radiosity solution, wall by wall.

mod common;

use common::{cpu, film, gpu, scene, settings};
use etendue::film::Film;
use etendue::reference::Estimator;
use etendue::reference::radiosity::{Room, Solution};
use etendue::scene::Scene;
use etendue::world::World;
use etendue::world::trace::camera_ray;
use glam::DVec3;

/// Patches a side of a wall: what a finer solution would change is below 5·10⁻⁴ of a wall's radiance.
const PATCHES: usize = 16;

/// Largest relative difference of a wall's mean radiance.
const TOLERANCE: f64 = 2e-3;

/// The Cornell box, seen from its open side, which is a dark wall here.
const CORNELL: &str = r#"
[camera]
eye = [0.1, 1.6, 1.9]
look_at = [0.0, 0.5, 0.0]
vfov = 100.0
resolution = [48, 36]
[material.white]
type = "diffuse"
reflectance = [0.76, 0.75, 0.72]
[material.red]
type = "diffuse"
reflectance = [0.62, 0.07, 0.06]
[material.green]
type = "diffuse"
reflectance = [0.13, 0.46, 0.10]
[material.dark]
type = "diffuse"
reflectance = [0.2, 0.2, 0.2]
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
material = "white"
[[plane]]
point = [0.0, 2.0, 0.0]
normal = [0.0, -1.0, 0.0]
material = "white"
[[plane]]
point = [0.0, 0.0, -1.0]
normal = [0.0, 0.0, 1.0]
material = "white"
[[plane]]
point = [0.0, 0.0, 2.0]
normal = [0.0, 0.0, -1.0]
material = "dark"
[[plane]]
point = [-1.0, 0.0, 0.0]
normal = [1.0, 0.0, 0.0]
material = "red"
[[plane]]
point = [1.0, 0.0, 0.0]
normal = [-1.0, 0.0, 0.0]
material = "green"
[[light]]
center = [0.0, 2.0, 0.1]
normal = [0.0, -1.0, 0.0]
radius = 0.45
radiance = [10.0, 9.0, 7.0]
"#;

/// Lamps of other colours on a side wall and on the floor.
const MORE_LIGHTS: &str = r#"
[[light]]
center = [-1.0, 0.7, -0.4]
normal = [1.0, 0.0, 0.0]
radius = 0.2
radiance = [2.0, 6.0, 20.0]
[[light]]
center = [0.4, 0.0, 0.9]
normal = [0.0, 1.0, 0.0]
radius = 0.3
radiance = [5.0, 3.0, 6.0]
"#;

/// Mean over the square of pixel (x, y) of the solution's radiance, with the wall that is seen there; `None` where that
/// is more than one wall, or a light.
fn expected(
    room: &Room,
    solution: &Solution,
    world: &World,
    size: [u32; 2],
    [x, y]: [u32; 2],
) -> Option<(usize, DVec3)> {
    let look = |[u, v]: [f64; 2]| {
        let ray = camera_ray(&world.camera, size, f64::from(x) + u, f64::from(y) + v);
        room.seen(ray.origin + world.origin, ray.direction)
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(look);
    let wall = corners[0].0;
    let [a, b, c, d] = corners.map(|(_, p)| p);
    let diameter = a.distance(d).max(b.distance(c));
    let unclear = |(w, p): (usize, DVec3)| w != wall || room.distance_to_light(w, p) <= diameter;
    if corners.into_iter().any(unclear) {
        return None;
    }
    // Gauss's rule of two points a side.
    let at = [0.5 - 0.75f64.sqrt() / 3.0, 0.5 + 0.75f64.sqrt() / 3.0];
    let points = [
        [at[0], at[0]],
        [at[1], at[0]],
        [at[0], at[1]],
        [at[1], at[1]],
    ];
    let radiance = |(wall, p)| solution.radiance(wall, p);
    Some((
        wall,
        points.map(|p| radiance(look(p))).iter().sum::<DVec3>() / 4.0,
    ))
}

/// Pixels, and for each channel the sums of picture, squared standard error and solution.
type Sums = (u32, [[f64; 3]; 3]);

/// What a picture shows of each wall.
fn wall_sums(s: &Scene, film: &Film, room: &Room, solution: &Solution) -> [Sums; 6] {
    let world = World::new(s, film.size);
    let mut walls = [Sums::default(); 6];
    film.for_each(|x, y, e| {
        if let Some((wall, radiance)) = expected(room, solution, &world, film.size, [x, y]) {
            walls[wall].0 += 1;
            for (c, sums) in walls[wall].1.iter_mut().enumerate() {
                sums[0] += e.mean[c];
                sums[1] += e.error[c].powi(2);
                sums[2] += radiance[c];
            }
        }
    });
    walls
}

fn add_sums(to: &mut Sums, (pixels, channels): Sums) {
    to.0 += pixels;
    for (to, sum) in to.1.iter_mut().flatten().zip(channels.iter().flatten()) {
        *to += sum;
    }
}

/// Means within the tolerance, and their standard errors well below it.
fn check(what: &str, (pixels, channels): Sums) {
    assert!(pixels >= 100, "{what}: only {pixels} pixels show it alone");
    for (c, [picture, variance, expected]) in channels.into_iter().enumerate() {
        let (off, error) = (picture / expected - 1.0, variance.sqrt() / expected);
        println!("{what}, channel {c}: {pixels} pixels, off by {off:+.1e} ± {error:.0e}");
        assert!(
            error <= 0.25 * TOLERANCE,
            "{what}: too noisy to tell, {error}"
        );
        let message = format!("{what}, channel {c}: off by {off} ± {error}");
        assert!(off.abs() <= TOLERANCE, "{message}");
    }
}

/// The adapter's pictures from the front of the room and from below show every wall as the solution has it.
fn walls_agree(what: &str, text: &str) {
    let front = scene(text);
    let below = scene(&text.replace(
        "eye = [0.1, 1.6, 1.9]\nlook_at = [0.0, 0.5, 0.0]",
        "eye = [0.1, 0.3, -0.3]\nlook_at = [0.1, 2.0, 0.3]",
    ));
    let room = Room::new(&front).expect("a room");
    let solution = room.solve(PATCHES);
    let mut walls = [Sums::default(); 6];
    // The ceiling gets no direct light from its own lamp, and the front wall fills little of the picture.
    for (s, spp) in [(front, 12_288), (below, 32_768)] {
        let settings = settings(&s, [48, 36], 0);
        let film = film(&mut gpu(&s, &settings, None), &settings, spp);
        for (wall, seen) in walls.iter_mut().zip(wall_sums(&s, &film, &room, &solution)) {
            add_sums(wall, seen);
        }
    }
    for (wall, sums) in walls.into_iter().enumerate() {
        check(&format!("{what}, wall {wall}"), sums);
    }
}

#[test]
fn a_cornell_box_is_as_radiosity_has_it() {
    walls_agree("Cornell box", CORNELL);
}

#[test]
fn a_room_with_lights_on_three_walls_is_as_radiosity_has_it() {
    walls_agree("three lights", &(CORNELL.to_owned() + MORE_LIGHTS));
}

/// The reference is slower: all walls together.
#[test]
fn the_reference_is_as_radiosity_has_it() {
    let s = scene(CORNELL);
    let room = Room::new(&s).expect("a room");
    let solution = room.solve(PATCHES);
    let settings = settings(&s, [24, 18], 0);
    let mut reference = cpu(&s, &settings, Estimator::LightSampling);
    let film = film(&mut reference, &settings, 4096);
    let mut all = Sums::default();
    for seen in wall_sums(&s, &film, &room, &solution) {
        add_sums(&mut all, seen);
    }
    check("reference", all);
}
