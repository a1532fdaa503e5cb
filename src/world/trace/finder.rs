//! The nearest hit in a world of many surfaces, by a tree of their boxes.

use super::{Hit, Nearest, Ray};
use crate::world::{Below, Bounds, Box32, Geometry, Tree, World};

/// Up to so many surfaces are all looked at: a walk through a tree would cost as much.
const FEW: usize = 16;

/// A world, and where its surfaces are.
pub struct Finder<'a> {
    world: &'a World,
    /// Surfaces without bounds, by their number among lights and primitives; all of them where they are few.
    loose: Vec<usize>,
    /// The numbers of the others, in the order of the tree's boxes.
    boxed: Vec<usize>,
    tree: Tree,
}

impl<'a> Finder<'a> {
    /// Builds the tree.
    pub fn new(world: &'a World) -> Self {
        let bounds = |number: usize| -> Option<Bounds> {
            match world.primitive(number) {
                Some(p) => p.geometry.bounds(),
                None => {
                    let l = &world.lights[number];
                    let disk = Geometry::Disk {
                        center: l.center,
                        normal: l.normal,
                        offset: l.offset,
                        radius: l.radius,
                    };
                    disk.bounds()
                }
            }
        };
        let few = world.surface_count() <= FEW;
        let all = (0..world.surface_count()).map(|n| (n, bounds(n).filter(|_| !few)));
        let (mut loose, mut boxed, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        for (number, bounds) in all {
            match bounds {
                Some(bounds) => {
                    boxed.push(number);
                    boxes.push(bounds);
                }
                None => loose.push(number),
            }
        }
        Self {
            world,
            loose,
            boxed,
            tree: Tree::new(&boxes),
        }
    }

    /// The world.
    pub fn world(&self) -> &World {
        self.world
    }

    /// What [`World::intersect`] finds.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<Nearest> = None;
        for &number in &self.loose {
            self.world.meet_nearer(number, ray, &mut nearest);
        }
        let mut open: Vec<u32> = (0..self.tree.nodes.len().min(1) as u32).collect();
        while let Some(k) = open.pop() {
            let node = &self.tree.nodes[k as usize];
            let most = nearest.as_ref().map_or(f64::INFINITY, |n| n.hit.t);
            if !touches(&node.bounds, ray, most) {
                continue;
            }
            match node.below {
                Below::Item(item) => {
                    let number = self.boxed[item as usize];
                    self.world.meet_nearer(number, ray, &mut nearest);
                }
                Below::Nodes { first, count } => open.extend(first..first + count),
            }
        }
        nearest.map(|n| n.hit)
    }
}

/// Whether the ray meets the box within the distance `most`. Boxes are wider than what they hold by more than f64 rounds.
fn touches(b: &Box32, ray: &Ray, most: f64) -> bool {
    let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
    let (mut near, mut far) = (0.0f64, most);
    for k in 0..3 {
        let inverse = 1.0 / direction[k];
        let a = (f64::from(b.min[k]) - origin[k]) * inverse;
        let b = (f64::from(b.max[k]) - origin[k]) * inverse;
        // NaN, where a ray runs in a side of the box, is left out by `max` and `min`.
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::Sampler;
    use crate::scene::Scene;
    use crate::world::trace::brute_force::{random_direction, random_point};

    #[test]
    fn the_tree_finds_what_looking_at_all_finds() {
        let mut builder = Scene::builder()
            .camera([0.0, 1.0, 9.0], [0.0, 0.0, 0.0], 40.0, [16, 12])
            .diffuse("white", [0.8; 3])
            .plane([0.0, -3.0, 0.0], [0.0, 1.0, 0.0], "white")
            .light([0.0, 6.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3]);
        let mut rng = Sampler::new(8, 0, 0);
        for _ in 0..300 {
            let p = random_point([(); 3].map(|()| rng.uniform()), 2.5);
            builder = builder.sphere(p.to_array(), 0.05 + 0.2 * rng.uniform(), "white");
        }
        let scene = builder.build().unwrap();
        let world = World::new(&scene, [16, 12]);
        let finder = Finder::new(&world);
        assert!(finder.boxed.len() > 200 && finder.loose.len() == 1);
        let mut hits = 0;
        for _ in 0..20_000 {
            let ray = Ray {
                origin: random_point([(); 3].map(|()| rng.uniform()), 4.0),
                direction: random_direction([rng.uniform(), rng.uniform()]),
                medium: 0,
                face: 0,
            };
            let found = finder.intersect(&ray);
            assert_eq!(found, world.intersect(&ray), "{ray:?}");
            hits += usize::from(found.is_some());
        }
        assert!(hits > 5000, "{hits}");
    }
}
