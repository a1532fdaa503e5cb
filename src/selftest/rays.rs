//! Traces single rays through a scene, with the same functions that paths use.

use super::backend::{Backend, Numbers, OpenGpu, Trouble, written};
use super::build::Build;
use crate::gpu::probe::{Probe, Values};
use crate::kernel::{Access, scene_probe_source};
use crate::reference::{Sampler, frame};
use crate::settings::Settings;
use crate::world::World;
use crate::world::trace::{Met, Ray};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Rays that an adapter gets at once: 8 MiB of them.
const BATCH: usize = 1 << 17;

/// A ray to be shot.
#[derive(Debug, Clone, Copy)]
pub struct Shot {
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    /// The face it stands on; 0 for none.
    pub face: u32,
    /// The dielectric solid that it is in.
    pub medium: u32,
    /// As a shadow ray: the light aimed at, and the distance to the point on it.
    pub aim: Option<(usize, f64)>,
}

impl Shot {
    /// From free space in air.
    pub fn free(origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin,
            direction: direction.normalize(),
            face: 0,
            medium: 0,
            aim: None,
        }
    }

    /// From where another has landed.
    pub fn from(landing: &Landing, direction: DVec3, medium: u32) -> Self {
        Self {
            face: landing.face,
            medium,
            ..Self::free(landing.point, direction)
        }
    }
}

/// The hit of a ray.
#[derive(Debug, Clone, Copy, Default)]
pub struct Landing {
    /// Number of the surface, lights first; `None` for nothing.
    pub surface: Option<usize>,
    /// Distance; 0 for nothing.
    pub t: f64,
    /// The point, put back on a primitive's surface.
    pub point: DVec3,
    /// Unit normal, turned to where the shot came from; zero on lights.
    pub normal: DVec3,
    /// Identity of the face.
    pub face: u32,
    /// For a shot with an aim: whether something is in between.
    pub occluded: bool,
}

impl Landing {
    pub fn is_finite(&self) -> bool {
        self.t.is_finite() && self.point.is_finite() && self.normal.is_finite()
    }
}

const INTERSECT: &str = "
    let ray = Ray(vec3f(x[0], x[1], x[2]), vec3f(x[3], x[4], x[5]), u32(x[6]), u32(x[7]), NO_FACE);
    let hit = intersect(ray);
    y[0] = -1.0;
    if hit.key != NONE {
        y[0] = f32(hit.key >> 2u);
        y[1] = hit.t;
        let p = ray.o + hit.t * ray.d;
        y[2] = p.x;
        y[3] = p.y;
        y[4] = p.z;
        y[5] = 0.0;
        y[6] = 0.0;
        y[7] = 0.0;
        y[8] = 0.0;
    }
    if hit.key != NONE && hit.key >= LIGHT_KEYS {
        let s = surface_at(hit.key);
        let v = vertex_at(ray, hit, s);
        let n = select(v.n, -v.n, dot(v.n, ray.d) > 0.0);
        y[2] = v.p.x;
        y[3] = v.p.y;
        y[4] = v.p.z;
        y[5] = n.x;
        y[6] = n.y;
        y[7] = n.z;
        y[8] = f32(face_at(hit.key, s));
    }
";

const OCCLUDED: &str = "
    let shadow = Ray(ray.o, ray.d, ray.face, ray.medium, u32(x[9]));
    y[9] = select(0.0, 1.0, occluded(shadow, x[10], u32(x[8])));
";

/// A scene to shoot rays into.
pub struct Range<'a> {
    backend: &'a Backend,
    world: World,
    settings: Settings,
    access: Access,
}

impl<'a> Range<'a> {
    /// `access` overrides the rule that picks the kind of kernel.
    pub fn new(backend: &'a Backend, build: &Build, access: Option<Access>) -> Self {
        let settings = build.settings();
        let world = World::new(&build.0, settings.size);
        let access = access
            .or(backend.access())
            .unwrap_or_else(|| Access::choose_for(&world, &backend.device()));
        Self {
            backend,
            world,
            settings,
            access,
        }
    }

    /// The scene; shots are in its coordinates.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Number of the first surface whose primitive is as `wanted` says.
    ///
    /// # Panics
    /// If there is none, since the case's scene is then wrong.
    pub fn number(&self, wanted: impl Fn(&crate::world::WorldPrimitive) -> bool) -> usize {
        let world = self.world();
        let index = world.primitives.iter().position(wanted);
        world.lights.len() + index.expect("the scene has it")
    }

    /// The hits of the shots, in the same order.
    pub fn shoot(&self, shots: &[Shot]) -> Result<Vec<Landing>, Trouble> {
        self.backend.check_stop()?;
        match self.backend.open_gpu() {
            Some(open) => self.shoot_gpu(open, shots),
            None => Ok(shots.par_iter().map(|s| self.shoot_cpu(s)).collect()),
        }
    }

    fn shoot_gpu(&self, open: &OpenGpu, shots: &[Shot]) -> Result<Vec<Landing>, Trouble> {
        let aimed = shots.iter().any(|s| s.aim.is_some());
        let body = format!("{INTERSECT}{}", if aimed { OCCLUDED } else { "" });
        let mut landings = Vec::with_capacity(shots.len());
        for batch in shots.chunks(BATCH) {
            let inputs: Vec<Values> = batch.iter().map(|s| self.values(s)).collect();
            landings.extend(self.run(open, &body, &inputs)?.iter().map(landing));
        }
        Ok(landings)
    }

    /// A function of numbers and of this scene: as [`Backend::evaluate`], beside all that the scene's kernel calls.
    pub fn evaluate(
        &self,
        body: &str,
        twin: impl Fn(&World, &Numbers) -> Numbers,
        inputs: &[Numbers],
    ) -> Result<Vec<Numbers>, Trouble> {
        let Some(open) = self.backend.open_gpu() else {
            return Ok(inputs.iter().map(|x| twin(self.world(), x)).collect());
        };
        let rounded: Vec<Values> = inputs.iter().map(|x| x.map(|x| x as f32)).collect();
        self.run(open, body, &rounded)
    }

    fn run(&self, open: &OpenGpu, body: &str, inputs: &[Values]) -> Result<Vec<Numbers>, Trouble> {
        let source = scene_probe_source(self.world(), &self.settings, self.access, body);
        let mut probes = open.probes.lock().unwrap_or_else(|p| p.into_inner());
        let probe = match probes.get(&source) {
            Some(probe) => probe.clone(),
            None => {
                let (gpu, world) = (&open.gpu, Some(self.world()));
                let probe = Probe::compile_for(gpu, &source, Some(self.access), world)
                    .map_err(Trouble::Device)?;
                probes.entry(source).or_insert(Arc::new(probe)).clone()
            }
        };
        drop(probes);
        let out = probe.run(&open.gpu, Some(self.world()), inputs);
        written(&out.map_err(Trouble::Device)?)
    }

    fn values(&self, s: &Shot) -> Values {
        let mut x = [0.0; 16];
        x[..3].copy_from_slice(&s.origin.as_vec3().to_array());
        x[3..6].copy_from_slice(&s.direction.as_vec3().to_array());
        (x[6], x[7]) = (s.face as f32, s.medium as f32);
        if let Some((light, distance)) = s.aim {
            let face = self.world().lights[light].face;
            (x[8], x[9], x[10]) = (light as f32, face as f32, distance as f32);
        }
        x
    }

    fn shoot_cpu(&self, s: &Shot) -> Landing {
        let ray = Ray {
            origin: s.origin,
            direction: s.direction,
            medium: s.medium,
            face: s.face,
        };
        let mut landing = Landing::default();
        if let Some(hit) = self.world.intersect(&ray) {
            landing.surface = Some(match hit.met {
                Met::Light { index, .. } => index,
                Met::Primitive(index) => self.world().lights.len() + index,
            });
            (landing.t, landing.point, landing.face) = (hit.t, hit.point, hit.face);
            if matches!(hit.met, Met::Primitive(_)) {
                landing.normal = hit.normal;
            }
        }
        if let Some((light, _)) = s.aim {
            landing.occluded = self.world.occluded(&ray, light);
        }
        landing
    }
}

fn landing(y: &Numbers) -> Landing {
    if y[0] < 0.0 {
        return Landing {
            occluded: y[9] == 1.0,
            ..Landing::default()
        };
    }
    Landing {
        surface: Some(y[0] as usize),
        t: y[1],
        point: DVec3::new(y[2], y[3], y[4]),
        normal: DVec3::new(y[5], y[6], y[7]),
        face: y[8] as u32,
        occluded: y[9] == 1.0,
    }
}

/// Random numbers for the set-up of a case.
pub struct Dice(Sampler);

impl Dice {
    pub fn new(seed: u32) -> Self {
        Self(Sampler::new(seed, 0, 0))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }

    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.uniform()
    }

    /// 10 to a power between `a` and `b`.
    pub fn scale(&mut self, a: f64, b: f64) -> f64 {
        10f64.powf(self.between(a, b))
    }

    /// Uniform in a cube.
    pub fn point(&mut self, half: f64) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.between(-half, half)))
    }

    /// Uniform on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        frame::direction_about(DVec3::Y, z, (1.0 - z * z).sqrt(), self.uniform())
    }

    /// At cosine `cosine` to `axis`.
    pub fn around(&mut self, axis: DVec3, cosine: f64) -> DVec3 {
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        frame::direction_about(axis, cosine, sine, self.uniform())
    }

    /// On a disk, at most `within` of its radius from the centre.
    pub fn on_disk(&mut self, center: DVec3, normal: DVec3, radius: f64, within: f64) -> DVec3 {
        let distance = radius * within * self.uniform().sqrt();
        center + distance * self.around(normal, 0.0)
    }
}
