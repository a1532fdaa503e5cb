//! Layers: what the eye meets first in each pixel, without noise and without light.
//!
//! They are made from the scene, with exact rays in f64, so a film need not hold them. Denoisers want other features, which look
//! through mirrors and glass: [`features`].

pub mod features;
mod planes;

pub use planes::{Layer, beside, planes};

use crate::provenance::Provenance;
use crate::provenance::hash::hash_of;
use crate::scene::{Bsdf, Canonical, Diagnostic, Scene, parse};
use crate::settings::Settings;
use crate::world::trace::{Hit, Met, Ray, camera_ray};
use crate::world::{World, WorldLight, WorldPrimitive};
use glam::DVec3;
use std::path::Path;

/// Rays along a side of a pixel: a box filter of 36.
const SIDE: u32 = 6;

/// Names of materials that a header lists. Rows with colours may have as many materials as rows.
const MOST_NAMES: usize = 4096;

/// What a picture is a picture of.
pub struct View {
    world: World,
    size: [u32; 2],
    /// Of every primitive of the scene, in its order: the number of its material, from 1.
    materials: Vec<u32>,
    /// By number: nothing, then the scene's, then that of lights.
    names: Vec<String>,
    /// Whether lights are seen.
    emitted: bool,
}

/// Why a film's scene can't be had.
#[derive(Debug, thiserror::Error)]
pub enum NoScene {
    /// Its text is no scene, or a file that it names can't be read.
    #[error("{}", .0.iter().map(Diagnostic::to_string).collect::<Vec<_>>().join("\n"))]
    Invalid(Vec<Diagnostic>),
    /// A file that it names has changed, or another scene was given.
    #[error("this is not the scene that the film was rendered from; name that scene with --scene")]
    Other,
}

/// Refuses a scene that a film was not rendered from.
pub fn check_scene(provenance: &Provenance, scene: &Scene) -> Result<(), NoScene> {
    if hash_of(&Canonical::new(scene), &provenance.settings) == provenance.scene_hash {
        Ok(())
    } else {
        Err(NoScene::Other)
    }
}

impl View {
    /// Of a scene as these settings render it.
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        // The world says of each surface on which line it stands. Here that is its number among the scene's.
        let mut numbered = scene.clone();
        for (k, p) in numbered.primitives.iter_mut().enumerate() {
            p.line = k + 1;
        }
        for (k, l) in numbered.lights.iter_mut().enumerate() {
            l.line = scene.primitives.len() + k + 1;
        }
        let names = scene.materials.iter().map(|m| m.name.clone());
        Self {
            world: World::new(&numbered, settings.size),
            size: settings.size,
            materials: scene
                .primitives
                .iter()
                .map(|p| p.material as u32 + 1)
                .collect(),
            names: std::iter::once(String::new())
                .chain(names)
                .chain(["light".to_owned()])
                .collect(),
            emitted: settings.light.emitted,
        }
    }

    /// Of a film. `path` is that of its scene file, or any name beside it: files of rows that the scene names lie there.
    pub fn of_film(provenance: &Provenance, path: &Path) -> Result<Self, NoScene> {
        let scene = parse::parse_str(path, &provenance.scene_text).map_err(NoScene::Invalid)?;
        check_scene(provenance, &scene)?;
        Ok(Self::new(&scene, &provenance.settings))
    }

    /// The names of materials by their number, up to some thousands: 0 is nothing, the last is that of lights.
    pub fn names(&self) -> &[String] {
        &self.names[..self.names.len().min(MOST_NAMES)]
    }

    /// Ray number `k` of SIDE² through pixel (x, y).
    fn ray(&self, [x, y]: [u32; 2], k: u32) -> Ray {
        let at =
            |pixel: u32, cell: u32| f64::from(pixel) + (f64::from(cell) + 0.5) / f64::from(SIDE);
        let (film_x, film_y) = (at(x, k % SIDE), at(y, k / SIDE));
        camera_ray(&self.world.camera, self.size, film_x, film_y)
    }

    /// The number of what was met, from 1: the scene's spheres, planes, disks and cylinders, each in the file's order, those of files of rows
    /// last, then lights.
    fn number(&self, hit: &Hit) -> u32 {
        let line = match hit.met {
            Met::Primitive(index) => self.primitive(index).line,
            Met::Light { index, .. } => self.light(index).line,
        };
        line as u32
    }

    /// The number of its material, from 1.
    fn material(&self, hit: &Hit) -> u32 {
        match hit.met {
            Met::Primitive(index) => self.materials[self.primitive(index).line - 1],
            Met::Light { .. } => self.names.len() as u32 - 1,
        }
    }

    fn primitive(&self, index: usize) -> &WorldPrimitive {
        &self.world.primitives[index]
    }

    fn light(&self, index: usize) -> &WorldLight {
        &self.world.lights[index]
    }

    /// How it scatters; `None` for a light.
    fn bsdf(&self, hit: &Hit) -> Option<&Bsdf> {
        match hit.met {
            Met::Primitive(index) => Some(&self.world.materials[self.primitive(index).material]),
            Met::Light { .. } => None,
        }
    }
}

/// The share of light that a material gives back, 0 to 1: all of it for glass, whose tint is that of what lies beyond.
fn albedo(bsdf: &Bsdf) -> DVec3 {
    match *bsdf {
        Bsdf::Diffuse { reflectance } | Bsdf::Mirror { reflectance } => reflectance,
        Bsdf::Phong {
            diffuse, specular, ..
        } => (diffuse + specular).min(DVec3::ONE),
        Bsdf::Dielectric { .. } => DVec3::ONE,
    }
}
