//! Defines what each table of a scene file contains. The parser uses these definitions to read a file, and the schema uses
//! them to list the keys.

use super::rows::RowKind;
use super::value::{
    Angle, Count, Direction, LARGEST_STRATA, Point, Radiance, Radius, Resolution, SMALLEST, Text,
    Value, normalized,
};
use super::{Camera, DEFAULT_MAX_DEPTH, DEFAULT_STRATA, Light, Place, RenderHints, Shape};
use glam::DVec3;

/// Whether a key may be left out.
pub(super) enum Need<T> {
    Required,
    /// May be left out; this is what the renderer then takes, if it is one value.
    Optional(Option<T>),
}

/// What became of a key.
pub(super) enum Found<T> {
    Value(T),
    Absent,
    /// Breaks the rule of its kind, which has been reported.
    Wrong,
}

/// A table that is being read or described.
///
/// Functions over it ask for all their keys before they use any value, so that every error is
/// found, and a description is complete.
pub(super) trait Table {
    /// The value of `key`; its absence where it is required has been reported.
    fn find<T: Value>(&mut self, key: &'static str, need: Need<T>, about: &'static str)
    -> Found<T>;

    /// Reports that the value of `key` breaks a rule that concerns more than it alone.
    fn refuse(&mut self, key: &str, message: String);

    /// A key that must be there; none when it was wrong.
    fn required<T: Value>(&mut self, key: &'static str, about: &'static str) -> Option<T> {
        match self.find(key, Need::Required, about) {
            Found::Value(v) => Some(v),
            Found::Absent | Found::Wrong => None,
        }
    }

    /// A key with a default; none when it was wrong.
    fn defaulted<T: Value + Copy>(
        &mut self,
        key: &'static str,
        default: T,
        about: &'static str,
    ) -> Option<T> {
        match self.find(key, Need::Optional(Some(default)), about) {
            Found::Value(v) => Some(v),
            Found::Absent => Some(default),
            Found::Wrong => None,
        }
    }

    /// A key that may be left out; none when it was, or was wrong.
    fn optional<T: Value>(
        &mut self,
        key: &'static str,
        default: Option<T>,
        about: &'static str,
    ) -> Option<T> {
        match self.find(key, Need::Optional(default), about) {
            Found::Value(v) => Some(v),
            Found::Absent | Found::Wrong => None,
        }
    }
}

/// `[camera]`.
pub(super) fn camera(t: &mut impl Table) -> Option<Camera> {
    /// Sine of the smallest angle between `up` and the view. Below it, rounding would decide the picture's top.
    const PARALLEL: f64 = 1e-9;

    let eye = t.required::<Point>("eye", "Position of the pinhole.");
    let look_at = t.required::<Point>("look_at", "The point at the centre of the picture.");
    let up = t.defaulted(
        "up",
        Direction(DVec3::Y),
        "Direction of the picture's top. Any length, but not parallel to the view.",
    );
    let vfov = t.required::<Angle>("vfov", "Vertical field of view in degrees.");
    let resolution = t.required::<Resolution>("resolution", "Width and height in pixels.");

    let (eye, look_at) = (eye?.0, look_at?.0);
    let view = look_at - eye;
    let view = normalized(view).filter(|_| view.length() >= SMALLEST);
    let Some(view) = view else {
        let message = format!("look_at equals eye, but must be at least {SMALLEST:e} away from it");
        t.refuse("look_at", message);
        return None;
    };
    let up = up?.0;
    if view.cross(up).length() < PARALLEL {
        let message = format!(
            "up (direction {}) is parallel to the view (direction {}), but must not be",
            brief(up),
            brief(view)
        );
        t.refuse("up", message);
        return None;
    }
    Some(Camera {
        eye,
        look_at,
        up,
        vfov: vfov?.0,
        resolution: resolution?.0,
    })
}

/// A vector for a message, to three digits.
fn brief(v: DVec3) -> String {
    // Adding 0 turns -0 into 0.
    let round = |x: f64| (x * 1e3).round() / 1e3 + 0.0;
    format!("[{}, {}, {}]", round(v.x), round(v.y), round(v.z))
}

/// `[render]`.
pub(super) fn render(t: &mut impl Table) -> RenderHints {
    let max_depth = t.optional(
        "max_depth",
        Some(Count::<1, { u32::MAX }>(DEFAULT_MAX_DEPTH)),
        "Most path vertices after the eye: 1 shows only lights, 2 adds direct light, and so on.",
    );
    let strata = t.optional(
        "strata",
        Some(Count::<1, LARGEST_STRATA>(DEFAULT_STRATA)),
        "Each pixel is divided into strata x strata jittered cells.",
    );
    let seed = t.optional(
        "seed",
        Some(Count::<0, { u32::MAX }>(0)),
        "Seed of the random numbers.",
    );
    RenderHints {
        max_depth: max_depth.map(|c| c.0),
        strata: strata.map(|c| c.0),
        seed: seed.map(|c| c.0),
    }
}

/// The tables of shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShapeKind {
    Sphere,
    Plane,
    Disk,
    Cylinder,
}

impl ShapeKind {
    /// In the order of [`Scene::primitives`](super::Scene::primitives).
    pub(super) const ALL: [Self; 4] = [Self::Sphere, Self::Plane, Self::Disk, Self::Cylinder];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Plane => "plane",
            Self::Disk => "disk",
            Self::Cylinder => "cylinder",
        }
    }

    pub(super) fn about(self) -> &'static str {
        match self {
            Self::Sphere => "A sphere.",
            Self::Plane => {
                "An infinite plane. If dielectric, the solid is on the side that the normal points away from."
            }
            Self::Disk => "A flat disk. Its material must not be dielectric.",
            Self::Cylinder => "A solid cylinder: side and two caps.",
        }
    }
}

/// `[[sphere]]`, `[[plane]]`, `[[disk]]` or `[[cylinder]]`, and the name of its material.
pub(super) fn primitive(t: &mut impl Table, kind: ShapeKind) -> Option<(Shape, String)> {
    let shape = match kind {
        ShapeKind::Sphere => sphere(t),
        ShapeKind::Plane => plane(t),
        ShapeKind::Disk => disk(t),
        ShapeKind::Cylinder => cylinder(t),
    };
    let material = t.required::<Text>("material", "NAME of a [material.NAME].");
    Some((shape?, material?.0))
}

fn sphere(t: &mut impl Table) -> Option<Shape> {
    let center = t.required::<Point>("center", "Centre.");
    let radius = t.required::<Radius>("radius", "Radius.");
    Some(Shape::Sphere {
        center: center?.0,
        radius: radius?.0,
    })
}

fn plane(t: &mut impl Table) -> Option<Shape> {
    let point = t.required::<Point>("point", "Any point of the plane.");
    let normal = t.required::<Direction>(
        "normal",
        "Direction perpendicular to the plane. Any length.",
    );
    Some(Shape::Plane {
        point: point?.0,
        normal: normal?.0,
    })
}

fn disk(t: &mut impl Table) -> Option<Shape> {
    let center = t.required::<Point>("center", "Centre.");
    let normal =
        t.required::<Direction>("normal", "Direction perpendicular to the disk. Any length.");
    let radius = t.required::<Radius>("radius", "Radius.");
    Some(Shape::Disk {
        center: center?.0,
        normal: normal?.0,
        radius: radius?.0,
    })
}

fn cylinder(t: &mut impl Table) -> Option<Shape> {
    let base = t.required::<Point>("base", "Centre of one cap.");
    let top = t.required::<Point>("top", "Centre of the other cap.");
    let radius = t.required::<Radius>("radius", "Radius.");
    let (base, top) = (base?.0, top?.0);
    // Shorter ones could not be told from nothing in f32, and squares in f64 are safe above.
    if base.distance(top) < SMALLEST {
        let message = format!("top equals base, but must be at least {SMALLEST:e} away from it");
        t.refuse("top", message);
        return None;
    }
    Some(Shape::Cylinder {
        base,
        top,
        radius: radius?.0,
    })
}

/// `[[spheres]]` or `[[cylinders]]`: the file of rows, and the name of their material if they have one in common.
pub(super) fn surfaces(t: &mut impl Table, kind: RowKind) -> Option<(String, Option<String>)> {
    let about = match kind {
        RowKind::Sphere => {
            "CSV file whose first row names the columns: x, y, z, radius and, without the key material, material or r, g, b \
             (the reflectance of a diffuse material). Its path is relative to the scene file."
        }
        RowKind::Cylinder => {
            "CSV file whose first row names the columns: x1, y1, z1, x2, y2, z2 (centres of both caps), radius and, without the \
             key material, material or r, g, b (the reflectance of a diffuse material). Its path is relative to the scene file."
        }
    };
    let file = t.required::<Text>("file", about);
    let material = t.optional::<Text>(
        "material",
        None,
        "NAME of a [material.NAME], for all rows of the file.",
    );
    Some((file?.0, material.map(|m| m.0)))
}

/// `[[lights]]`: the file of rows.
pub(super) fn lights(t: &mut impl Table) -> Option<String> {
    let about = "CSV file whose first row names the columns: x, y, z, nx, ny, nz, radius, r, g, b (centre, normal, \
                 radius, radiance). Its path is relative to the scene file.";
    t.required::<Text>("file", about).map(|f| f.0)
}

/// `[[light]]`, at `place` in the file.
pub(super) fn light(t: &mut impl Table, place: Place) -> Option<Light> {
    let center = t.required::<Point>("center", "Centre.");
    let about = "Direction of the side that emits. Any length. The other side is black.";
    let normal = t.required::<Direction>("normal", about);
    let radius = t.required::<Radius>("radius", "Radius.");
    let about = "Emitted radiance, equal in every direction of the front.";
    let radiance = t.required::<Radiance>("radiance", about);
    Some(Light {
        center: center?.0,
        normal: normal?.0,
        radius: radius?.0,
        radiance: radiance?.0,
        line: place.line,
        column: place.column,
    })
}
