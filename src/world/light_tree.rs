//! The tree of light clusters by which the kernel chooses one of many lights (`shaders/light/choose_by_tree.wgsl`). It is balanced, so
//! all choices take the same number of steps.

use super::{World, WorldLight};
use glam::DVec3;
use std::f64::consts::PI;

/// The number of lights of a leaf, a cluster at the end of the tree. A closed form chooses among them. The shader knows this number.
pub(crate) const LIGHTS_A_CLUSTER: usize = 4;

/// Scenes with more lights than this choose among them by a tree. Every choice in other scenes looks at every light, which chooses
/// better but costs more with every light.
pub const MAX_SCANNED_LIGHTS: usize = 48;

/// A cluster, as the kernel reads it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cluster {
    /// Centre of a ball that holds its lights.
    pub center: DVec3,
    /// Radius of the ball.
    pub radius: f64,
    /// Unit axis of a cone that holds the normals of its lights, times their power relative to the brightest light.
    pub power: DVec3,
    /// Cosine of the cone's half angle.
    pub cos_cone: f64,
}

/// The tree: clusters, and the lights of the leaves.
pub(crate) struct LightTree {
    /// Cluster k has the halves 2k and 2k + 1. Cluster 1 holds all lights; number 0 is not used.
    pub clusters: Vec<Cluster>,
    /// The indices of the lights of each leaf; `u32::MAX` where a leaf has fewer lights.
    pub order: Vec<[u32; LIGHTS_A_CLUSTER]>,
    /// The place of each light in `order`.
    pub places: Vec<u32>,
}

/// The number of leaves of a tree of this many lights, a power of two.
pub(crate) fn ends(lights: usize) -> usize {
    lights.div_ceil(LIGHTS_A_CLUSTER).next_power_of_two()
}

/// The number of steps from the root to a leaf, in a tree of this many lights.
pub(crate) fn levels(lights: usize) -> u32 {
    ends(lights).ilog2()
}

/// Whether scenes with this many lights choose among them by a tree.
pub(crate) fn serves(lights: usize) -> bool {
    lights > MAX_SCANNED_LIGHTS
}

impl LightTree {
    /// The tree of all lights of a world.
    pub fn new(world: &World) -> Self {
        let lights = &world.lights;
        let ends = ends(lights.len());
        let mut tree = Self {
            clusters: vec![Cluster::default(); 2 * ends],
            order: vec![[u32::MAX; LIGHTS_A_CLUSTER]; ends],
            places: vec![0; lights.len()],
        };
        let brightest = lights.iter().map(power).fold(0.0, f64::max);
        let mut order: Vec<usize> = (0..lights.len()).collect();
        tree.split(lights, brightest, 1, &mut order);
        tree
    }

    /// Makes cluster `k` of these lights, and all clusters below it.
    fn split(&mut self, lights: &[WorldLight], brightest: f64, k: usize, these: &mut [usize]) {
        self.clusters[k] = cluster(lights, brightest, these);
        let ends = self.clusters.len() / 2;
        if k >= ends {
            for (place, &light) in these.iter().enumerate() {
                self.order[k - ends][place] = light as u32;
                self.places[light] = ((k - ends) * LIGHTS_A_CLUSTER + place) as u32;
            }
            return;
        }
        let middle = these.len().div_ceil(2);
        if middle < these.len() {
            let along = widest(lights, these);
            // Equal lights are sorted by their number, so that the tree is the same every time.
            these.select_nth_unstable_by(middle, |&a, &b| {
                along(&lights[a])
                    .total_cmp(&along(&lights[b]))
                    .then(a.cmp(&b))
            });
        }
        let (first, second) = these.split_at_mut(middle);
        self.split(lights, brightest, 2 * k, first);
        self.split(lights, brightest, 2 * k + 1, second);
    }
}

/// The weights of a light's channels when one of the lights is chosen: the mean of luminance weights and equal weights. With luminance
/// alone a blue light is so rarely chosen that most of a picture's error is in the blue channel. With equal weights the luminance is
/// noisier.
pub(crate) const LIGHT_COLORS: DVec3 = DVec3::new(0.273, 0.5243, 0.2027);

/// The power of a light, up to a factor.
fn power(l: &WorldLight) -> f64 {
    PI * l.radius * l.radius * l.radiance.dot(LIGHT_COLORS)
}

/// The coordinate in which these lights differ most. It is one of the place or one of the normal, whose differences count relative to
/// the extent of the places.
fn widest(lights: &[WorldLight], these: &[usize]) -> impl Fn(&WorldLight) -> f64 + use<> {
    // A difference of 1 between normals counts as much as this fraction of the extent.
    const TURN: f64 = 0.25;

    let extent = |of: &dyn Fn(&WorldLight) -> DVec3| {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &i in these {
            (low, high) = (low.min(of(&lights[i])), high.max(of(&lights[i])));
        }
        high - low
    };
    let places = extent(&|l| l.center);
    let normals = extent(&|l| l.normal) * (places.max_element() * TURN);
    let longest = |v: DVec3| (0..3).max_by(|&a, &b| v[a].total_cmp(&v[b])).unwrap_or(0);
    let turned = normals.max_element() > places.max_element();
    let axis = longest(if turned { normals } else { places });
    move |l| {
        if turned {
            l.normal[axis]
        } else {
            l.center[axis]
        }
    }
}

/// The cluster of these lights.
fn cluster(lights: &[WorldLight], brightest: f64, these: &[usize]) -> Cluster {
    // Smallest power of a cluster, relative to the brightest light. The kernel squares it in f32.
    const MIN_POWER: f64 = 1e-15;

    let shining: Vec<&WorldLight> = these
        .iter()
        .map(|&i| &lights[i])
        .filter(|l| power(l) > 0.0)
        .collect();
    if shining.is_empty() {
        return Cluster::default();
    }
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for l in &shining {
        (low, high) = (low.min(l.center), high.max(l.center));
    }
    let center = (low + high) / 2.0;
    let reach = |l: &&WorldLight| l.center.distance(center) + l.radius;
    let radius = shining.iter().map(reach).fold(0.0, f64::max);
    let axis: DVec3 = shining.iter().map(|l| l.normal).sum();
    let axis = axis.try_normalize().unwrap_or(shining[0].normal);
    let cosine = |l: &&WorldLight| l.normal.dot(axis);
    let cos_cone = shining.iter().map(cosine).fold(1.0, f64::min);
    let total: f64 = shining.iter().map(|l| power(l) / brightest).sum();
    Cluster {
        center,
        // A little larger, so that it still holds the lights after rounding to f32.
        radius: (radius + 1e-6 * center.length()) * (1.0 + 1e-5),
        power: axis * total.max(MIN_POWER),
        cos_cone: (cos_cone - 1e-5).max(-1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse::parse_str;

    #[test]
    fn clusters_hold_their_lights_and_every_light_has_its_place() {
        let mut text = String::from(
            "[camera]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\nvfov = 40\nresolution = [4, 4]\n\
             [material.white]\ntype = 'diffuse'\nreflectance = [1, 1, 1]\n\
             [[plane]]\npoint = [0, -99, 0]\nnormal = [0, 1, 0]\nmaterial = 'white'\n",
        );
        for i in 0..77 {
            let (x, y, z) = (i % 7, i % 11, i % 5);
            text += &format!(
                "[[light]]\ncenter = [{x}, {y}, {z}]\nnormal = [{}, -1, {}]\nradius = 0.1\nradiance = [{i}, 1, {i}]\n",
                y - 5,
                x - 3
            );
        }
        let scene = parse_str("lights.toml".as_ref(), &text).expect("a scene");
        let world = World::new(&scene, [4, 4]);
        let tree = LightTree::new(&world);
        let ends = tree.clusters.len() / 2;
        assert_eq!(ends, 32);
        for (i, l) in world.lights.iter().enumerate() {
            let place = tree.places[i] as usize;
            assert_eq!(
                tree.order[place / LIGHTS_A_CLUSTER][place % LIGHTS_A_CLUSTER],
                i as u32
            );
            let mut k = ends + place / LIGHTS_A_CLUSTER;
            while k > 0 {
                let c = tree.clusters[k];
                assert!(c.center.distance(l.center) + l.radius <= c.radius);
                assert!(c.power.normalize().dot(l.normal) >= c.cos_cone);
                k /= 2;
            }
        }
        let root = tree.clusters[1].power.length();
        let halves = tree.clusters[2].power.length() + tree.clusters[3].power.length();
        assert!((root - halves).abs() < 1e-9 * root);
    }
}
