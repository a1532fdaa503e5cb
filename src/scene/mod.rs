//! The scene as its author wrote it: f64, the file's own units and order.
//!
//! [`parse`] reads it from TOML, [`schema`] describes the format to editors, [`check`] warns about
//! likely mistakes, and [`World::new`](crate::world::World::new) prepares it for tracing rays.

mod build;
pub mod check;
mod format;
#[doc(hidden)]
pub mod generate;
mod implicit;
mod isosurface;
mod material;
mod order;
pub mod parse;
mod reader;
mod rows;
pub mod schema;
mod source;
mod surfaces;
mod syntax;
mod value;

pub use build::SceneBuilder;
pub(crate) use build::checked;
pub use material::Bsdf;
pub(crate) use material::{MaterialKind, Parameter};
#[doc(hidden)]
pub use order::Canonical;
pub use rows::MAX_ROWS_BYTES;
pub use value::{LARGEST_RESOLUTION, LARGEST_STRATA};

use crate::implicit::Implicit;
use glam::DVec3;
use source::one_line;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// Path vertices after the eye when neither file nor flag says.
pub const DEFAULT_MAX_DEPTH: u32 = 64;

/// Strata a side when neither file nor flag says: the report's 2 x 2.
pub const DEFAULT_STRATA: u32 = 2;

/// A whole scene file. Every value has passed the format's rules.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Where it was read from; empty for scenes made in memory.
    pub path: PathBuf,
    /// The other files that it names: those of rows, and volumes.
    pub row_files: Vec<RowFile>,
    /// `title`, if the file has one.
    pub title: Option<String>,
    /// The pinhole camera.
    pub camera: Camera,
    /// `[render]`: what the file asks for; flags override it, [`Settings`](crate::settings::Settings) decides.
    pub render: RenderHints,
    /// Materials in the order of their names, those of colours in rows last.
    pub materials: Vec<Material>,
    /// Primitives in the order spheres, planes, disks, cylinders, formulas, volumes, each in file order, those from files of rows after the others.
    pub primitives: Vec<Primitive>,
    /// Disk lights in file order, those from files of rows last; at least one.
    pub lights: Vec<Light>,
}

impl Scene {
    /// Begins a scene that is built in code.
    pub fn builder() -> SceneBuilder {
        SceneBuilder::default()
    }
}

/// Another file that a scene names: of rows, or a volume.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowFile {
    /// Where it is.
    pub path: PathBuf,
    /// How many surfaces or lights it holds; a volume is one.
    pub rows: usize,
    /// Where the scene names it.
    pub place: Place,
}

/// Pinhole camera. `up` is not parallel to the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Position of the pinhole.
    pub eye: DVec3,
    /// A point on the optical axis, different from `eye`.
    pub look_at: DVec3,
    /// Points to the picture's top; any length.
    pub up: DVec3,
    /// Vertical field of view in degrees, 0 < vfov < 180.
    pub vfov: f64,
    /// Width and height in pixels, each 1..=65536.
    pub resolution: [u32; 2],
}

/// The optional `[render]` table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RenderHints {
    /// Path vertices after the eye, >= 1.
    pub max_depth: Option<u32>,
    /// The pixel is divided into strata x strata cells, >= 1.
    pub strata: Option<u32>,
    /// Seed of every random number.
    pub seed: Option<u32>,
}

/// A named material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// NAME of `[material.NAME]`.
    pub name: String,
    /// How it scatters.
    pub bsdf: Bsdf,
    /// Where its table stands in the file.
    pub place: Place,
}

/// A place in a file: line and column, in characters, from 1. 0 for scenes made in memory, and for a whole line or file.
#[expect(missing_docs, reason = "what they are is said above")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    pub line: usize,
    pub column: usize,
}

/// A surface with a material.
#[derive(Debug, Clone, PartialEq)]
pub struct Primitive {
    /// Its geometry.
    pub shape: Shape,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Line of its table in the file, from 1; 0 for scenes made in memory.
    pub line: usize,
    /// Column of its table, likewise.
    pub column: usize,
}

impl Primitive {
    /// Where its table stands in the file.
    pub fn place(&self) -> Place {
        let Self { line, column, .. } = *self;
        Place { line, column }
    }
}

/// Analytic shapes. Normals have unit length.
#[expect(missing_docs, reason = "the fields are the format's own keys")]
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// radius > 0.
    Sphere { center: DVec3, radius: f64 },
    /// Infinite; as a dielectric the solid is on the side that `normal` points away from.
    Plane { point: DVec3, normal: DVec3 },
    /// Flat and two-sided, radius > 0.
    Disk {
        center: DVec3,
        normal: DVec3,
        radius: f64,
    },
    /// Solid: side and two caps; base != top, radius > 0.
    Cylinder {
        base: DVec3,
        top: DVec3,
        radius: f64,
    },
    /// Where a formula, or a volume, has a certain value.
    Implicit(Arc<Implicit>),
}

/// Disk luminaire: emits on its front, black and opaque otherwise, reflects nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Centre of the disk.
    pub center: DVec3,
    /// Unit normal of the side that emits.
    pub normal: DVec3,
    /// Radius > 0.
    pub radius: f64,
    /// Emitted radiance, the same in every direction of the front hemisphere.
    pub radiance: DVec3,
    /// Line of its table in the file, from 1; 0 for scenes made in memory.
    pub line: usize,
    /// Column of its table, likewise.
    pub column: usize,
}

impl Light {
    /// Where its table stands in the file.
    pub fn place(&self) -> Place {
        let Self { line, column, .. } = *self;
        Place { line, column }
    }
}

impl Shape {
    /// The format's word for it.
    pub fn kind(&self) -> &'static str {
        match self {
            Shape::Sphere { .. } => "sphere",
            Shape::Plane { .. } => "plane",
            Shape::Disk { .. } => "disk",
            Shape::Cylinder { .. } => "cylinder",
            Shape::Implicit(implicit) if implicit.grid().is_some() => "isosurface",
            Shape::Implicit(_) => "implicit",
        }
    }
}

/// A message about one place in a scene file, printed as `path:line:column: message`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file.
    pub path: PathBuf,
    /// Line from 1; 0 when the message is about the whole file.
    pub line: usize,
    /// Column in characters from 1; 0 when the message is about a whole line.
    pub column: usize,
    /// What is wrong, the value found, and the rule.
    pub message: String,
    /// Whether the only error is that a file which the scene names can't be read.
    pub unreadable: bool,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", one_line(&self.path.display().to_string()))?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        if self.line > 0 && self.column > 0 {
            write!(f, ":{}", self.column)?;
        }
        write!(f, ": {}", one_line(&self.message))
    }
}

impl std::error::Error for Diagnostic {}
