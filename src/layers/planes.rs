//! The layers of a picture as channels of an EXR file.

use super::{SIDE, View, albedo};
use crate::film::coverage::Rect;
use crate::output::{Extra, Value};
use crate::world::trace::{Finder, Hit, Ray};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Layer {
    /// The share of light that the surface gives back, times the share of the pixel where there is one, which is in A.
    Albedo,
    /// The normal in the scene's axes, on the side of the eye; 0 where nothing is met.
    Normal,
    /// Where it is, in the scene's lengths.
    Position,
    /// How far it is, along the view axis.
    Depth,
    /// Which object it is.
    Id,
    /// Of which material.
    Material,
}

impl Layer {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Albedo,
        Self::Normal,
        Self::Position,
        Self::Depth,
        Self::Id,
        Self::Material,
    ];

    /// What its channels begin with, before a dot.
    pub fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Position => "position",
            Self::Depth => "depth",
            Self::Id => "id",
            Self::Material => "material",
        }
    }

    /// The channels, in the order of their values.
    fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo => &["albedo.R", "albedo.G", "albedo.B", "albedo.A"],
            Self::Normal => &["normal.X", "normal.Y", "normal.Z"],
            Self::Position => &["position.X", "position.Y", "position.Z"],
            Self::Depth => &["depth.Z"],
            Self::Id => &["id.I"],
            Self::Material => &["material.I"],
        }
    }
}

/// What the rays through a pixel have met.
#[derive(Default)]
struct Pixel {
    hits: u32,
    albedo: DVec3,
    normal: DVec3,
    position: DVec3,
    depth: f64,
    /// Rays by what they have met: object and material.
    met: BTreeMap<(u32, u32), u32>,
}

impl Pixel {
    fn add(&mut self, view: &View, ray: &Ray, hit: &Hit) {
        let world = &view.world;
        self.hits += 1;
        self.albedo += view.bsdf(hit).map_or(DVec3::ZERO, albedo);
        self.normal += hit.shading;
        self.position += hit.point;
        self.depth += hit.t * ray.direction.dot(world.camera.forward);
        let met = (view.number(hit), view.material(hit));
        *self.met.entry(met).or_default() += 1;
    }

    /// The object and material that most rays have met, and the first of those that as many have met; 0 if most have met nothing.
    fn most(&self) -> (u32, u32) {
        let missed = SIDE * SIDE - self.hits;
        let first = |best: ((u32, u32), u32), (met, n): (&(u32, u32), &u32)| {
            if *n > best.1 { (*met, *n) } else { best }
        };
        self.met.iter().fold(((0, 0), missed), first).0
    }

    /// The values of a layer's channels.
    fn values(&self, layer: Layer, view: &View) -> Vec<f64> {
        let all = f64::from(SIDE * SIDE);
        let met = f64::from(self.hits.max(1));
        let (object, material) = self.most();
        match layer {
            Layer::Albedo => {
                let [r, g, b] = (self.albedo / all).to_array();
                vec![r, g, b, f64::from(self.hits) / all]
            }
            Layer::Normal => (self.normal / all).to_array().to_vec(),
            Layer::Position if self.hits == 0 => vec![0.0; 3],
            Layer::Position => {
                let world = &view.world;
                let p = self.position / met * world.unit + world.origin;
                p.to_array().to_vec()
            }
            Layer::Depth => vec![self.depth / met * view.world.unit],
            Layer::Id => vec![f64::from(object)],
            Layer::Material => vec![f64::from(material)],
        }
    }
}

/// The channels of `layers`, each a value for every pixel of the whole picture, row by row; 0 outside of `bounds`. A pixel is the mean over
/// what 6 x 6 rays through it meet. `done` hears how many rows are done.
pub fn planes(
    view: &View,
    layers: &[Layer],
    bounds: Rect,
    mut done: impl FnMut(u32),
) -> Vec<(&'static str, Vec<f32>)> {
    /// Rows between two words of progress.
    const BAND: u32 = 32;
    let finder = Finder::new(&view.world);
    let width = view.size[0] as usize;
    let pixels = width * view.size[1] as usize;
    let names = || layers.iter().flat_map(|l| l.channels());
    let mut out: Vec<Vec<f32>> = names().map(|_| vec![0.0; pixels]).collect();
    let mut y = bounds.y0;
    while y < bounds.y1 {
        let end = bounds.y1.min(y + BAND);
        let band: Vec<Vec<f32>> = (y..end)
            .into_par_iter()
            .flat_map_iter(|y| (bounds.x0..bounds.x1).map(move |x| [x, y]))
            .map(|place| {
                let mut pixel = Pixel::default();
                for k in 0..SIDE * SIDE {
                    let ray = view.ray(place, k);
                    if let Some(hit) = finder.intersect(&ray) {
                        pixel.add(view, &ray, &hit);
                    }
                }
                let values = layers.iter().flat_map(|l| pixel.values(*l, view));
                values.map(|v| v as f32).collect()
            })
            .collect();
        for (k, values) in band.iter().enumerate() {
            let (x, y) = (
                bounds.x0 as usize + k % bounds.width() as usize,
                y as usize + k / bounds.width() as usize,
            );
            for (plane, v) in out.iter_mut().zip(values) {
                plane[y * width + x] = *v;
            }
        }
        y = end;
        done(y - bounds.y0);
    }
    names().copied().zip(out).collect()
}

/// Layers as what a picture holds beside the film's own channels, each once; with the material go the names of materials.
pub fn beside(view: &View, layers: &[Layer], bounds: Rect, done: impl FnMut(u32)) -> Extra {
    let mut layers = layers.to_vec();
    layers.sort_unstable();
    layers.dedup();
    let mut extra = Extra::default();
    if layers.is_empty() {
        return extra;
    }
    extra.channels = planes(view, &layers, bounds, done);
    if layers.contains(&Layer::Material) {
        // A list of strings can always be written.
        let names = serde_json::to_string(view.names()).unwrap_or_default();
        extra.entries.push(("material_names", Value::Text(names)));
    }
    extra
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::settings::{Overrides, Settings};

    /// A ball before a wall, both seen straight on, beside a lamp; the eye is at z = 4.
    fn view() -> View {
        let scene = Scene::builder()
            .camera([10.0, 0.0, 4.0], [10.0, 0.0, 0.0], 90.0, [40, 40])
            .diffuse("wall", [0.25, 0.5, 0.75])
            .dielectric("glass", 1.5)
            .mirror("mirror", [0.9, 0.8, 0.7])
            .sphere([10.0, 0.0, 0.0], 1.0, "glass")
            .disk([10.0, 0.0, -4.0], [0.0, 0.0, 1.0], 4.1, "wall")
            .light([10.0, 3.0, 0.0], [0.0, 0.0, -1.0], 0.5, [9.0; 3])
            .build()
            .unwrap();
        let settings = Settings::resolve(&scene, &Overrides::default());
        View::new(&scene, &settings)
    }

    #[test]
    fn layers_say_what_the_eye_meets() {
        let view = view();
        let planes = planes(&view, &Layer::ALL, Rect::whole([40, 40]), |_| ());
        let at = |x: usize, y: usize| -> BTreeMap<&str, f32> {
            planes.iter().map(|(n, v)| (*n, v[y * 40 + x])).collect()
        };
        assert_eq!(view.names(), ["", "glass", "mirror", "wall", "light"]);
        // The ball's front.
        let ball = at(20, 20);
        assert_eq!((ball["id.I"], ball["material.I"]), (1.0, 1.0));
        assert_eq!((ball["albedo.R"], ball["albedo.A"]), (1.0, 1.0));
        assert!((ball["depth.Z"] - 3.0).abs() < 0.01 && ball["normal.Z"] > 0.99);
        assert!((ball["position.X"] - 10.0).abs() < 0.2 && (ball["position.Z"] - 1.0).abs() < 0.02);
        // The wall beside it: depth along the axis is the same everywhere.
        let wall = at(27, 20);
        assert_eq!((wall["id.I"], wall["material.I"]), (2.0, 3.0));
        assert!((wall["depth.Z"] - 8.0).abs() < 1e-5);
        assert_eq!((wall["albedo.G"], wall["normal.Z"]), (0.5, 1.0));
        // The lamp's back reflects nothing. Around everything is nothing.
        let lamp = at(20, 5);
        assert_eq!((lamp["id.I"], lamp["material.I"]), (3.0, 4.0));
        assert_eq!((lamp["albedo.R"], lamp["albedo.A"]), (0.0, 1.0));
        assert!(at(0, 39).values().all(|v| *v == 0.0));
        // Where a pixel is shared, ids are those of its larger part, and A is what is covered.
        let shared: Vec<_> = (0..20).map(|x| at(x, 20)).collect();
        let edge = shared
            .iter()
            .find(|p| p["albedo.A"] > 0.0 && p["albedo.A"] < 1.0)
            .unwrap();
        assert_eq!(edge["id.I"], if edge["albedo.A"] > 0.5 { 2.0 } else { 0.0 });
        assert!((edge["albedo.G"] - 0.5 * edge["albedo.A"]).abs() < 1e-6);
        assert!((edge["depth.Z"] - 8.0).abs() < 1e-5);
    }

    #[test]
    fn a_part_of_the_picture_is_that_of_the_whole() {
        let view = view();
        let whole = planes(&view, &[Layer::Depth], Rect::whole([40, 40]), |_| ());
        let part = Rect {
            x0: 7,
            y0: 3,
            x1: 31,
            y1: 39,
        };
        let cut = planes(&view, &[Layer::Depth], part, |_| ());
        for (k, (a, b)) in whole[0].1.iter().zip(&cut[0].1).enumerate() {
            let inside = part.contains(k as u32 % 40, k as u32 / 40);
            assert_eq!(*b, if inside { *a } else { 0.0 });
        }
    }
}
