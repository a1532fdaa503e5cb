//! What the kernel of a scene needs, decided once from world and settings.

use super::access::{Access, BAKED_LIMIT};
use super::bulbs;
use super::glances;
use super::layout::ShapeKind;
use super::light_paths::LightPaths;
use super::literal::{float, vector};
use super::trees::Parted;
use crate::film::{BLOCK, REPLICATES};
use crate::scene::MaterialKind;
use crate::settings::{Integrator, LightParts, Settings};
use crate::world::{
    AIR, Geometry, World, WorldCamera, WorldPrimitive, bulbs::Bulb, light_tree, near_light,
    visibility,
};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// Pixels along a side of the block that a workgroup is.
pub(crate) const GROUP_SIDE: u32 = 8;

/// The fourth powers of radii outside this range come near the ends of f32.
const ORDINARY_RADII: RangeInclusive<f64> = 1e-8..=1e8;

/// How one of the lights is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LightChoice {
    /// There is one.
    Only,
    /// By a line of code for each.
    Unrolled,
    /// By a loop over them.
    Loop,
    /// Down a tree of clusters.
    Tree,
}

/// A name that `#if` knows in the shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flag {
    /// There are cylinders.
    Cylinder,
    /// There are planes, disks, or cylinders with their caps.
    Flat,
    /// There are spheres or cylinders.
    Round,
    /// There are huge spheres.
    HugeSphere,
    /// A light lies flush on a cylinder's cap.
    LitCaps,
    /// Some light's radius is out of the ordinary.
    ExtremeLights,
    /// There are implicit surfaces.
    Implicit,
    /// There are surfaces with several parts.
    Parts,
    /// There are surfaces with smooth normals.
    Smooth,
}

impl Flag {
    const ALL: [Self; 9] = [
        Self::Cylinder,
        Self::Flat,
        Self::Round,
        Self::HugeSphere,
        Self::LitCaps,
        Self::ExtremeLights,
        Self::Implicit,
        Self::Parts,
        Self::Smooth,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Cylinder => "CYLINDER",
            Self::Flat => "FLAT",
            Self::Round => "ROUND",
            Self::HugeSphere => "HUGE_SPHERE",
            Self::LitCaps => "LIT_CAPS",
            Self::ExtremeLights => "EXTREME_LIGHTS",
            Self::Implicit => "IMPLICIT",
            Self::Parts => "PARTS",
            Self::Smooth => "SMOOTH",
        }
    }

    /// The flag with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// What a kernel needs.
#[derive(Debug, Clone)]
pub(super) struct Features {
    /// How it reaches the scene's values.
    pub access: Access,
    materials: BTreeSet<MaterialKind>,
    shapes: BTreeSet<ShapeKind>,
    /// There are implicit surfaces of formulas.
    pub has_formulas: bool,
    /// There are those of volumes.
    pub has_volumes: bool,
    /// Some of those have smooth normals.
    pub has_smooth_normals: bool,
    lit_caps: bool,
    extreme_lights: bool,
    /// Lights are sampled.
    pub light_sampling: bool,
    /// Some of them by straight shadow rays.
    pub direct: bool,
    /// Those that are sampled through glass.
    pub bulbs: Vec<Bulb>,
    /// How one of them is chosen.
    pub choice: LightChoice,
    /// Some of them overlap in one plane.
    pub hidden_lights: bool,
    /// Light samples at a vertex.
    pub shadow_rays: u32,
    /// Diffuse bounces that meet a light by chance are weighed against light sampling.
    mis_cosine: bool,
    /// What light that is met by chance is weighed against.
    pub light_paths: Option<LightPaths>,
    /// Materials are evaluated for given directions.
    pub evaluates: bool,
    /// The last vertex at which glances look for lights; 0: none are sent.
    pub sight: u32,
    /// Strata along a pixel's side.
    pub strata: u32,
    /// Places in the pixel are drawn together with points on lights. In scenes of many things every pixel has edges, and edges of
    /// shadows. Large things are no less noisy with it, and a kernel without trees would be a twentieth slower.
    pub draws_together: bool,
    /// Rays wait in a queue: see `shaders/rays/queued.wgsl`. In kernels without trees all rays take the same time. In closed rooms, where every
    /// path goes on, a queue gives 0.95 to 1.05 times the speed.
    pub queued: bool,
    /// Number of the last vertex that can matter, for the light that is kept.
    pub last_depth: u32,
    /// Some paths are cut there that could still find light.
    count_truncated: bool,
}

impl Features {
    /// Those of the kernel of `world` under `settings`, which reaches the scene's values by `access`.
    pub fn new(
        world: &World,
        settings: &Settings,
        access: Access,
        light_paths: Option<LightPaths>,
    ) -> Self {
        let used = || {
            world
                .primitives
                .iter()
                .map(|p| &world.materials[p.material])
        };
        let materials: BTreeSet<MaterialKind> = used().map(|b| b.kind()).collect();
        let shapes = world.primitives.iter().map(|p| ShapeKind::of(&p.geometry));
        let implicit = || {
            let all = world.primitives.iter();
            all.filter_map(|p| match &p.geometry {
                Geometry::Implicit(implicit) => Some(implicit),
                _ => None,
            })
        };
        let lit = |p: &WorldPrimitive| {
            let caps = matches!(p.geometry, Geometry::Cylinder { .. }).then_some(&p.faces[1..]);
            let mut faces = caps.into_iter().flatten();
            faces.any(|f| world.lights.iter().any(|l| l.face == *f))
        };
        let last_depth = last_depth(settings);
        let scatters = materials.iter().any(|m| !m.is_specular());
        let light_sampling = last_depth > 1 && !world.lights.is_empty() && scatters;
        let bulbs = if light_sampling {
            bulbs::sampled(world, settings).to_vec()
        } else {
            Vec::new()
        };
        let choice = match (world.lights.len(), access) {
            (0 | 1, _) => LightChoice::Only,
            (_, Access::Baked) => LightChoice::Unrolled,
            (_, Access::Buffers) => LightChoice::Loop,
            (lights, Access::Tree) if light_tree::serves(lights) => LightChoice::Tree,
            // Lights too few for a tree of their own are chosen as in a small scene.
            (_, Access::Tree) => LightChoice::Unrolled,
        };
        Self {
            access,
            shapes: shapes.collect(),
            has_formulas: implicit().any(|s| s.grid().is_none()),
            has_volumes: implicit().any(|s| s.grid().is_some()),
            has_smooth_normals: implicit().any(|s| s.grid().is_some_and(|g| g.smooth)),
            lit_caps: world.primitives.iter().any(lit),
            extreme_lights: world
                .lights
                .iter()
                .any(|l| !ORDINARY_RADII.contains(&l.radius)),
            light_sampling,
            direct: light_sampling && bulbs.len() < world.lights.len(),
            bulbs,
            choice,
            hidden_lights: light_sampling && visibility::lights_overlap(world),
            shadow_rays: settings.shadow_rays,
            // What a cosine-distributed bounce finds of a light, cap sampling finds as well, unless it is near.
            mis_cosine: light_sampling && near_light::light_near_matt(world),
            light_paths,
            evaluates: light_sampling,
            sight: glances::sight(world, settings, access),
            strata: settings.strata,
            draws_together: access == Access::Tree && settings.strata.is_power_of_two(),
            queued: false,
            last_depth,
            count_truncated: settings.max_depth < needed_depth(settings),
            materials,
        }
    }

    /// Those of a probe, which has every shape and material but no scene.
    pub fn of_probe(probe: &super::ProbeFeatures) -> Self {
        Self {
            access: Access::Baked,
            materials: MaterialKind::ALL.into_iter().collect(),
            shapes: ShapeKind::FIXED.into_iter().collect(),
            has_formulas: false,
            has_volumes: false,
            has_smooth_normals: false,
            lit_caps: false,
            extreme_lights: false,
            light_sampling: probe.glossy,
            direct: probe.glossy,
            bulbs: Vec::new(),
            choice: LightChoice::Unrolled,
            hidden_lights: false,
            shadow_rays: 1,
            mis_cosine: true,
            light_paths: None,
            evaluates: probe.glossy,
            sight: 0,
            strata: probe.strata,
            draws_together: probe.draws_together,
            queued: false,
            last_depth: 64,
            count_truncated: false,
        }
    }

    /// Those of the kernel that traces light paths, which samples no lights.
    pub fn of_light_paths(&self) -> Self {
        Self {
            light_sampling: false,
            direct: false,
            hidden_lights: false,
            evaluates: true,
            queued: false,
            ..self.clone()
        }
    }

    /// Whether the rays of a path loop should wait in a queue. One walk takes all of it, and what lies outside its tree is met beforehand,
    /// without a loop. There is room for one shadow ray.
    pub fn gains_by_queue(&self, world: &World, parted: &Parted) -> bool {
        parted.groups.len() == 1
            && parted.apart.len() <= BAKED_LIMIT
            && self.light_sampling
            && self.bulbs.is_empty()
            && self.shadow_rays == 1
            && !self.has_implicit()
            && visibility::rays_escape(world)
    }

    pub fn has_material(&self, kind: MaterialKind) -> bool {
        self.materials.contains(&kind)
    }

    /// In the order of their tags.
    pub fn materials(&self) -> impl Iterator<Item = MaterialKind> {
        self.materials.iter().copied()
    }

    /// Whether any material scatters into the whole hemisphere.
    pub fn scatters(&self) -> bool {
        self.materials.iter().any(|m| !m.is_specular())
    }

    pub fn has_shape(&self, kind: ShapeKind) -> bool {
        self.shapes.contains(&kind)
    }

    /// Whether there are implicit surfaces.
    pub fn has_implicit(&self) -> bool {
        self.has_shape(ShapeKind::Implicit)
    }

    /// Whether what a ray takes is not known beforehand, so that the kernel counts its loop trips.
    pub fn counts_trips(&self) -> bool {
        self.access == Access::Tree || self.has_implicit()
    }

    /// Whether lights are sampled for lobes.
    pub fn glossy(&self) -> bool {
        self.light_sampling && self.materials.iter().any(|m| m.is_glossy())
    }

    /// Whether light met by chance is weighed against light sampling anywhere.
    fn mis(&self) -> bool {
        self.glossy() || self.mis_cosine
    }

    /// Whether its lines of the shaders count.
    pub fn flag(&self, flag: Flag) -> bool {
        let any = |kinds: &[ShapeKind]| kinds.iter().any(|k| self.has_shape(*k));
        match flag {
            Flag::Cylinder => any(&[ShapeKind::Cylinder]),
            // Of implicit surfaces alone, something must stand in the place of what others have.
            Flag::Flat => {
                any(&[ShapeKind::Plane, ShapeKind::Disk, ShapeKind::Cylinder])
                    || self.shapes.iter().all(|k| *k == ShapeKind::Implicit)
            }
            Flag::Round => any(&[
                ShapeKind::Cylinder,
                ShapeKind::Sphere,
                ShapeKind::HugeSphere,
            ]),
            Flag::HugeSphere => any(&[ShapeKind::HugeSphere]),
            Flag::LitCaps => self.lit_caps,
            Flag::ExtremeLights => self.extreme_lights,
            Flag::Implicit => self.has_implicit(),
            Flag::Smooth => self.has_smooth_normals,
            Flag::Parts => any(&[ShapeKind::Cylinder, ShapeKind::Implicit]),
        }
    }

    /// The constants of the shaders, but for those of one scene's camera and lights.
    pub fn constants(&self) -> String {
        let mut s = String::new();
        for kind in MaterialKind::ALL {
            let name = kind.name().to_uppercase();
            constant(
                &mut s,
                &format!("MATERIAL_{name}"),
                "u32",
                format!("{}u", kind as u32),
            );
        }
        let made = ShapeKind::ALL.into_iter();
        let made = made.filter(|k| ShapeKind::FIXED.contains(k) || self.has_shape(*k));
        for kind in made {
            let name = kind.name().to_uppercase();
            constant(
                &mut s,
                &format!("SHAPE_{name}"),
                "u32",
                format!("{}u", kind as u32),
            );
        }
        let round = self.strata * self.strata;
        for (name, value) in [
            ("BLOCK", BLOCK as u32),
            ("REPLICATES", REPLICATES as u32),
            ("STRATA", self.strata),
            ("ROUND_SAMPLES", round),
            ("LAST_DEPTH", self.last_depth),
            ("GROUP_SIDE", GROUP_SIDE),
        ] {
            constant(&mut s, name, "u32", format!("{value}u"));
        }
        for (name, value) in [
            ("GLOSSY", self.glossy()),
            ("MIS", self.mis()),
            ("MIS_COSINE", self.mis_cosine),
            ("COUNT_TRUNCATED", self.count_truncated),
            ("GLANCE_CHAINS", self.sight > 1),
        ] {
            constant(&mut s, name, "bool", value.to_string());
        }
        constant(
            &mut s,
            "SHADOW_RAYS",
            "f32",
            float(f64::from(self.shadow_rays)),
        );
        constant(
            &mut s,
            "LIGHT_COLORS",
            "vec3f",
            vector(light_tree::LIGHT_COLORS),
        );
        if let Some(paths) = &self.light_paths {
            paths.constants(&mut s);
        }
        s
    }

    /// The constants of one scene.
    pub fn scene_constants(&self, world: &World, settings: &Settings) -> String {
        let mut s = camera_constants(&world.camera, settings.size);
        let whitted = settings.integrator == Integrator::Whitted;
        constant(&mut s, "WHITTED", "bool", whitted.to_string());
        for (name, value) in [
            ("LIGHT_KEYS", 4 * world.lights.len() as u32),
            ("LIGHT_COUNT", world.lights.len() as u32),
            ("GLANCES", glances::GLANCES),
            ("CHAIN_GLANCES", glances::in_chains(settings)),
            ("BRANCH_SHIFT", glances::BRANCH_SHIFT),
            ("MANY_SHIFT", glances::MANY_SHIFT),
        ] {
            constant(&mut s, name, "u32", format!("{value}u"));
        }
        s
    }
}

pub(super) fn constant(s: &mut String, name: &str, kind: &str, value: String) {
    let _ = writeln!(s, "const {name}: {kind} = {value};");
}

fn camera_constants(c: &WorldCamera, size: [u32; 2]) -> String {
    let mut s = String::new();
    for (name, value) in [
        ("CAMERA_EYE", c.eye),
        ("CAMERA_FORWARD", c.forward),
        ("CAMERA_DX", c.dx),
        ("CAMERA_DY", c.dy),
    ] {
        constant(&mut s, name, "vec3f", vector(value));
    }
    let [w, h] = size.map(|n| float(f64::from(n) / 2.0));
    constant(&mut s, "CAMERA_CENTER", "vec2f", format!("vec2f({w}, {h})"));
    constant(&mut s, "CAMERA_WIDTH", "u32", format!("{}u", size[0]));
    let pixel = c.dx.length_squared();
    constant(&mut s, "CAMERA_SCALE", "f32", float(1.0 / pixel));
    constant(&mut s, "PIXEL_AREA", "f32", float(pixel));
    constant(&mut s, "CAMERA_MEDIUM", "u32", format!("{}u", c.medium));
    debug_assert_eq!(AIR, 0, "the kernel's comments say so");
    s
}

/// Number of the last vertex that can matter, for the light that is kept.
pub(super) fn last_depth(settings: &Settings) -> u32 {
    settings.max_depth.min(needed_depth(settings))
}

/// Vertices beyond which none of the light that is kept can be found.
fn needed_depth(settings: &Settings) -> u32 {
    match settings.light {
        LightParts { indirect: true, .. } => u32::MAX,
        LightParts { direct: true, .. } => 2,
        _ => 1,
    }
}
