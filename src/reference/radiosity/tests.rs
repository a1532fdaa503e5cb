use super::*;
use crate::scene::parse::parse_str;
use std::path::Path;

/// A box of 2 x 1.5 x 3 with walls of the reflectances given, and `lights`.
fn room(reflectance: [f64; 6], lights: &str) -> Room {
    let mut text = String::from(
        "[camera]\neye = [0.1, 0.2, 0.3]\nlook_at = [0.0, 0.0, 0.0]\nvfov = 60.0\nresolution = [4, 4]\n",
    );
    let upper = [1.0, 0.75, 1.5];
    for (w, rho) in reflectance.into_iter().enumerate() {
        let normal = inward(w).to_array();
        let point = normal.map(|n| -n * upper[w / 2]);
        text += &format!(
            "[material.w{w}]\ntype = 'diffuse'\nreflectance = [{rho:?}, {:?}, {rho:?}]\n\
             [[plane]]\npoint = {point:?}\nnormal = {normal:?}\nmaterial = 'w{w}'\n",
            0.5 * rho
        );
    }
    Room::new(&parse_str(Path::new("room.toml"), &(text + lights)).unwrap()).unwrap()
}

const CEILING: &str = "[[light]]\ncenter = [0.2, 0.75, -0.3]\nnormal = [0.0, -1.0, 0.0]\n\
                       radius = 0.4\nradiance = [2.0, 2.0, 1.0]\n";
const SIDE: &str = "[[light]]\ncenter = [1.0, 0.1, 0.7]\nnormal = [-1.0, 0.0, 0.0]\n\
                    radius = 0.25\nradiance = [5.0, 1.0, 0.0]\n";

/// Means of the radiance over each wall, on a grid of points off the lights.
fn wall_means(solution: &Solution) -> [DVec3; 6] {
    const K: usize = 12;
    let [lower, upper] = solution.room.corners;
    from_fn(|w| {
        let [u, v] = across_of(w);
        let points = (0..K * K).filter_map(|k| {
            let at = |k: usize| lower + (upper - lower) * ((k as f64 + 0.5) / K as f64);
            let mut p = DVec3::splat(solution.room.plane(w));
            (p[u], p[v]) = (at(k % K)[u], at(k / K)[v]);
            (solution.room.distance_to_light(w, p) > 0.0).then(|| solution.radiance(w, p))
        });
        let points: Vec<DVec3> = points.collect();
        points.iter().sum::<DVec3>() / points.len() as f64
    })
}

#[test]
fn patches_see_all_around() {
    let room = room([0.5; 6], CEILING);
    let grid = Grid::new(&room, 5);
    for (wall, ends) in grid.patches() {
        let all: f64 = grid.mean_row(&room, wall, ends).1.iter().sum();
        assert!((all - 1.0).abs() < 1e-12, "wall {wall}, {ends:?}: {all}");
    }
}

#[test]
fn in_a_white_room_everything_is_as_bright_as_the_light() {
    let solution = room([1.0; 6], &CEILING.replace("0.4", "0.7")).solve(12);
    for (w, mean) in wall_means(&solution).into_iter().enumerate() {
        assert!((mean.x / 2.0 - 1.0).abs() < 1e-3, "wall {w}: {mean}");
    }
}

#[test]
fn refinement_converges() {
    let room = room(
        [0.7, 0.2, 0.8, 0.75, 0.6, 0.5],
        &(CEILING.to_owned() + SIDE),
    );
    let means = [4, 8, 16].map(|n| wall_means(&room.solve(n)));
    let changes = [0, 1].map(|k| {
        let change = |w: usize| ((means[k + 1][w] - means[k][w]) / means[2][w]).to_array();
        (0..6).flat_map(change).collect::<Vec<f64>>()
    });
    let [first, second] = changes.map(|c| {
        let mean_square = c.iter().map(|x| x * x).sum::<f64>() / c.len() as f64;
        let largest = c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        (mean_square.sqrt(), largest)
    });
    println!("root mean square and largest relative change: {first:?}, {second:?}");
    // Of second order, but for the patches on the rims of lights: a step leaves a quarter or a third.
    assert!(second.0 < 0.4 * first.0, "{first:?} {second:?}");
    assert!(second.1 < 1.5e-3, "{first:?} {second:?}");
}

#[test]
fn what_is_no_room_is_refused() {
    let parse = |text: &str| Room::new(&parse_str(Path::new("x.toml"), text).unwrap());
    let diffuse = include_str!("../../../scenes/diffuse.toml");
    assert!(parse(diffuse).unwrap_err().contains("not a plane"));
}
