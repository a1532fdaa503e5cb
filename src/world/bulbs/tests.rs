use super::*;
use crate::scene::parse::parse_str;
use crate::world::trace::Ray;

/// A world with these things over a floor, and an eye in air.
fn world(things: &str) -> World {
    let text = format!(
        "[camera]\neye = [0, 1, 9]\nlook_at = [0, 1, 0]\nvfov = 40\nresolution = [8, 8]\n\
         [material.white]\ntype = 'diffuse'\nreflectance = [0.5, 0.5, 0.5]\n\
         [material.glass]\ntype = 'dielectric'\nior = 1.5\n\
         [material.dense]\ntype = 'dielectric'\nior = 3\n\
         [material.bubble]\ntype = 'dielectric'\nior = 0.6666666666666666\n\
         [[plane]]\npoint = [0, -2, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n{things}"
    );
    let scene = parse_str("room.toml".as_ref(), &text).expect("a scene");
    World::new(&scene, [8, 8])
}

fn light(center: [f64; 3], radius: f64) -> String {
    format!(
        "[[light]]\ncenter = {center:?}\nnormal = [0.2, -1, 0.1]\nradius = {radius}\nradiance = [1, 1, 1]\n"
    )
}

fn ball(center: [f64; 3], radius: f64, material: &str) -> String {
    format!("[[sphere]]\ncenter = {center:?}\nradius = {radius}\nmaterial = '{material}'\n")
}

/// How many shells the only light's bulb has, and whether reflected light is sampled; `None` if it is in no bulb.
fn bulb(things: &str) -> Option<(u32, bool)> {
    let found = world(things).bulbs;
    assert!(found.len() < 2);
    found.first().map(|b| (b.count, b.reflects))
}

#[test]
fn lights_alone_in_the_middle_of_balls_are_bulbs() {
    let [o, side] = [[0.0; 3], [0.5, 0.0, 0.0]];
    let glass = ball(o, 1.0, "glass");
    let lamp = light(o, 0.1);
    let hollow = glass.clone() + &ball(o, 0.9, "bubble");
    assert_eq!(bulb(&lamp), None, "in air");
    assert_eq!(bulb(&(lamp.clone() + &glass)), Some((1, true)));
    assert_eq!(bulb(&(lamp.clone() + &hollow)), Some((2, true)));
    assert_eq!(bulb(&(light(o, 0.4) + &glass)), Some((1, false)), "large");
    assert_eq!(bulb(&(light(side, 0.2) + &glass)), None, "total reflection");
    assert_eq!(bulb(&(light(side, 0.1) + &ball(o, 1.0, "dense"))), None);
    assert_eq!(bulb(&(light(o, 0.9) + &ball(o, 0.5, "glass"))), None, "cut");
    let aside = glass.clone() + &ball([0.01, 0.0, 0.0], 0.9, "bubble");
    assert_eq!(bulb(&(lamp.clone() + &aside)), None, "shells aside");
    let three = hollow.clone() + &ball(o, 0.8, "glass");
    assert_eq!(bulb(&(lamp.clone() + &three)), None, "three shells");
    // What else is in the ball, cuts it, touches it, or is around it.
    let with = |more: String| bulb(&(lamp.clone() + &glass + &more));
    assert_eq!(with(ball([0.0, 0.5, 0.0], 0.1, "white")), None);
    assert_eq!(with(ball([0.0, 1.0, 0.0], 0.1, "white")), None);
    assert_eq!(with(ball([0.0, 1.5, 0.0], 0.5, "white")), Some((1, true)));
    assert_eq!(with(ball(o, 20.0, "white")), Some((1, true)));
    assert_eq!(
        with("[[plane]]\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n".to_owned()),
        Some((1, true))
    );
    assert_eq!(
        with(
            "[[plane]]\npoint = [0, -0.9, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n".to_owned()
        ),
        None
    );
    let layer = hollow.clone()
        + &lamp
            .replace("[0.0, 0.0, 0.0]", "[0.0, 0.95, 0.0]")
            .replace("= 0.1", "= 0.01");
    assert_eq!(world(&(lamp.clone() + &layer)).bulbs, [], "in the glass");
    // Another light behind it blocks no straight ray, but reflected ones; one before it blocks both.
    let behind = lamp
        .replace("[0.0, 0.0, 0.0]", "[0.0, 0.2, 0.0]")
        .replace("[0.2, -1, 0.1]", "[-0.2, 1, -0.1]");
    let two = world(&(lamp.clone() + &glass + &behind)).bulbs;
    assert_eq!(
        two.iter().map(|b| b.reflects).collect::<Vec<_>>(),
        [false, false]
    );
    let before = behind.replace("[-0.2, 1, -0.1]", "[0.2, -1, 0.1]");
    let one = world(&(lamp.clone() + &glass + &before)).bulbs;
    assert_eq!(one.len(), 1);
}

/// Rays that are found are traced from outside, and must come to the point of the light, by the ways that they are said to take.
#[test]
fn rays_come_from_the_light() {
    let o = [0.0; 3];
    let lamp = light([0.05, 0.02, 0.0], 0.12);
    let solid = ball(o, 1.0, "glass");
    let dense = ball(o, 1.0, "dense");
    let hollow = solid.clone() + &ball(o, 0.8, "bubble");
    for shells in [solid, dense, hollow] {
        let world = world(&(lamp.clone() + &shells));
        let bulb = world.bulbs[0].clone();
        let l = &world.lights[0];
        let mut glass = world.clone();
        glass.lights.clear();
        glass.primitives.retain(|p| p.solid != AIR);
        let ways = [&[Way::Straight], bulb.reflected_ways()].concat();
        assert!(ways.len() as u32 == 1 + bulb.count);
        let mut u = crate::gpu::probe::Uniform(5);
        for way in ways {
            for _ in 0..200 {
                let aside = u.vector().cross(l.normal);
                let y = l.center + aside * (0.7 * l.radius / 2.0);
                let x = bulb.center + u.vector().normalize() * u.between(1.0001, 5.0);
                let found = bulb.ray(way, y, x).expect("a ray");
                let mut ray = Ray {
                    origin: x,
                    direction: found.d,
                    medium: AIR,
                    face: 0,
                };
                let [reflection, last] = bulb.vertices(way);
                for vertex in 1..last {
                    let hit = glass.intersect(&ray).expect("a shell");
                    ray = glass
                        .specular(&hit, &ray, vertex == reflection)
                        .expect("glass");
                }
                assert_eq!(ray.medium, l.medium.expect("a medium"));
                let off = (y - ray.origin).cross(ray.direction).length();
                assert!(off < 1e-6, "{way:?}: {off}");
                assert!((ray.direction + found.leaves).length() < 1e-6, "{way:?}");
            }
        }
    }
}
