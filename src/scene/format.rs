//! Defines what each table of a scene file contains. The parser uses these definitions to read a file, and the schema uses
//! them to list the keys.

use super::rows::{ColorMap, Keys, Map, RowKind, Species, SpeciesLook, is_xyz};
use super::source::quoted;
use super::value::{
    Angle, Count, Direction, Finite, LARGEST_STRATA, Point, Radiance, Radius, Resolution, SMALLEST,
    Share, Text, Value, normalized,
};
use super::{Camera, DEFAULT_MAX_DEPTH, DEFAULT_STRATA, Light, Place, RenderHints, Shape};
use super::{implicit, isosurface};
use crate::implicit::{AxisOrder, Volume};
use glam::DVec3;
use std::sync::Arc;

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

impl<T> Found<T> {
    /// The value if there is one; none at all when it was wrong.
    fn unless_wrong(self) -> Option<Option<T>> {
        match self {
            Self::Value(value) => Some(Some(value)),
            Self::Absent => Some(None),
            Self::Wrong => None,
        }
    }
}

/// A table that is being read or described.
///
/// Functions over it ask for all their keys before they use any value, so that every error is
/// found, and a description is complete.
pub(super) trait Table {
    /// The value of `key`; its absence where it is required has been reported.
    fn find<T: Value>(&mut self, key: &'static str, need: Need<T>, about: &'static str)
    -> Found<T>;

    /// The table `key` within this one, if it is there.
    fn inner<T: Inner>(&mut self, key: &'static str, about: &'static str) -> Found<T>;

    /// The tables within the table `key`, by name, if it is there.
    fn inner_by_name<T: Inner>(
        &mut self,
        key: &'static str,
        about: &'static str,
    ) -> Found<Vec<(String, T)>>;

    /// The volume in the file `name`, a path relative to the scene file; none when it was wrong.
    fn volume(&mut self, name: &str, order: AxisOrder) -> Option<Arc<Volume>>;

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

/// What a table within another one holds.
pub(super) trait Inner: Sized {
    /// What it is, for editors.
    const ABOUT: &'static str;

    /// The table; none when something was wrong, which has been reported.
    fn read(t: &mut impl Table) -> Option<Self>;
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
    Implicit,
    Isosurface,
}

impl ShapeKind {
    /// In the order of [`Scene::primitives`](super::Scene::primitives).
    pub(super) const ALL: [Self; 6] = [
        Self::Sphere,
        Self::Plane,
        Self::Disk,
        Self::Cylinder,
        Self::Implicit,
        Self::Isosurface,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Plane => "plane",
            Self::Disk => "disk",
            Self::Cylinder => "cylinder",
            Self::Implicit => "implicit",
            Self::Isosurface => "isosurface",
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
            Self::Implicit => {
                "Where a formula has a certain value: the surface of the solid where it has less, or a surface without a solid, \
                 which must not be dielectric."
            }
            Self::Isosurface => {
                "Where a volume has a certain value: the surface of the solid where it has more, or a surface without a solid, which \
                 must not be dielectric."
            }
        }
    }
}

/// A table of a shape, and the name of its material.
pub(super) fn primitive(t: &mut impl Table, kind: ShapeKind) -> Option<(Shape, String)> {
    let shape = match kind {
        ShapeKind::Sphere => sphere(t),
        ShapeKind::Plane => plane(t),
        ShapeKind::Disk => disk(t),
        ShapeKind::Cylinder => cylinder(t),
        ShapeKind::Implicit => implicit::read(t),
        ShapeKind::Isosurface => isosurface::read(t),
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

/// `[[spheres]]` or `[[cylinders]]`: the file of rows, and what the table says of all of them.
pub(super) fn surfaces(t: &mut impl Table, kind: RowKind) -> Option<(String, Keys)> {
    let about = match kind {
        RowKind::Sphere => {
            "CSV file whose first row names the columns: x, y, z, and, unless keys say the same of all rows, radius and material or \
             r, g, b (the reflectance of a diffuse material). Or an extended XYZ file, whose name ends in .xyz. Its path is \
             relative to the scene file."
        }
        RowKind::Cylinder => {
            "CSV file whose first row names the columns: x1, y1, z1, x2, y2, z2 (centres of both caps), and, unless keys say the \
             same of all rows, radius and material or r, g, b (the reflectance of a diffuse material). Its path is relative to the \
             scene file."
        }
    };
    let file = t.required::<Text>("file", about);
    let about = "NAME of a [material.NAME], for all rows of the file.";
    let material = t.optional::<Text>("material", None, about);
    let radius = t.optional::<Radius>("radius", None, "Radius of all rows of the file.");
    let color = t.inner::<ColorMap>("color", ColorMap::ABOUT);
    let mut species = Found::Absent;
    let mut frame = None;
    if kind == RowKind::Sphere {
        let about = "What the atoms of each species are drawn as; the file has a column species.";
        species = t.inner_by_name::<Species>("species", about);
        let about = "Number of the frame, from 0, of an XYZ file with several.";
        frame = t.optional::<Count<0, { u32::MAX }>>("frame", None, about);
    }
    let keys = Keys {
        material: material.map(|m| m.0),
        radius: radius.map(|r| r.0),
        species: species.unless_wrong()?,
        color: color.unless_wrong()?,
        frame: frame.map(|f| f.0),
    };
    let file = file?.0;
    said_once(t, &keys)?;
    let is_xyz = is_xyz(file.as_ref());
    if is_xyz && kind == RowKind::Cylinder {
        let message =
            "an XYZ file holds points, which [[spheres]] draws; cylinders are read from CSV files";
        t.refuse("file", message.into());
        return None;
    }
    if frame.is_some() && !is_xyz {
        t.refuse(
            "frame",
            "frame chooses among those of an .xyz file, and a CSV file has none".into(),
        );
        return None;
    }
    Some((file, keys))
}

/// Refuses two keys that say the same, and species of which only some say it.
fn said_once(t: &mut impl Table, keys: &Keys) -> Option<()> {
    let (radii, looks) = (keys.has_radii(), keys.has_looks());
    let twice = [
        (
            keys.material.is_some() && keys.color.is_some(),
            "color",
            "material and color both say what the rows look like",
        ),
        (
            keys.material.is_some() && looks,
            "material",
            "material and species both say what the rows look like",
        ),
        (
            keys.color.is_some() && looks,
            "color",
            "color and species both say what the rows look like",
        ),
        (
            keys.radius.is_some() && radii,
            "radius",
            "radius and species both say how large the rows are",
        ),
    ];
    for (wrong, key, message) in twice {
        if wrong {
            t.refuse(key, format!("{message}; give one of them"));
            return None;
        }
    }
    for (name, species) in keys.species.iter().flatten() {
        let lacks = [
            (radii && species.radius.is_none(), "radius"),
            (looks && species.look.is_none(), "reflectance or material"),
        ];
        if let Some((_, what)) = lacks.iter().find(|l| l.0) {
            let name = quoted(name);
            t.refuse(
                "species",
                format!("species {name} has no {what}, but others have"),
            );
            return None;
        }
    }
    Some(())
}

impl Inner for Species {
    const ABOUT: &'static str = "A species of atoms.";

    fn read(t: &mut impl Table) -> Option<Self> {
        let radius = t.optional::<Radius>("radius", None, "Radius.");
        let about = "Reflectance of a diffuse material.";
        let reflectance = t.optional::<Share>("reflectance", None, about);
        let material = t.optional::<Text>("material", None, "NAME of a [material.NAME].");
        let look = match (reflectance, material) {
            (Some(_), Some(_)) => {
                let message =
                    "reflectance and material both say what a species looks like; give one of them";
                t.refuse("material", message.into());
                return None;
            }
            (Some(reflectance), None) => Some(SpeciesLook::Reflectance(reflectance.0)),
            (None, Some(material)) => Some(SpeciesLook::Material(material.0)),
            (None, None) => None,
        };
        let radius = radius.map(|r| r.0);
        Some(Self { radius, look })
    }
}

impl Inner for ColorMap {
    const ABOUT: &'static str =
        "Colours of the rows by the numbers of a column, as reflectances of diffuse materials.";

    fn read(t: &mut impl Table) -> Option<Self> {
        let about = "Name of the column; of a property of several columns, such as a velocity, the length is taken.";
        let column = t.required::<Text>("column", about);
        let map = t.required::<Map>("map", "Name of the colour map.");
        let about = "The number that has the first colour, and all below it; the column's least if not given.";
        let low = t.optional::<Finite>("low", None, about).map(|x| x.0);
        let about = "The number that has the last colour, and all above it; the column's greatest if not given.";
        let high = t.optional::<Finite>("high", None, about).map(|x| x.0);
        if let (Some(low), Some(high)) = (low, high)
            && low >= high
        {
            t.refuse(
                "high",
                format!("high is {high}, but must be above low, {low}"),
            );
            return None;
        }
        let (column, map) = (column?.0, map?);
        Some(Self {
            column,
            map,
            low,
            high,
        })
    }
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
