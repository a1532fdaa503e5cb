//! Reads many spheres, cylinders or lights from a file of rows: `[[spheres]]`, `[[cylinders]]` and `[[lights]]`.
//!
//! A CSV file's first row names the columns, in any order. Every other row is one object. Fields are numbers and names of
//! materials, so there are no quotes. A file of spheres may be an extended XYZ file too, as programs for atoms write it.

mod look;
mod sheet;
mod xyz;

pub(super) use look::{ColorMap, MAPS, Map, Palette, Species, SpeciesLook};
pub(super) use xyz::is_xyz;

use super::value::{Direction, Point, Radiance, Radius, SMALLEST, Share};
use super::{Diagnostic, Light, Place, Primitive, Shape};
use crate::files::kind::FileKind;
use crate::files::reason;
use look::{Kinds, magnitude};
use sheet::{Fault, Form, Row, Sheet};
use std::fs::File;
use std::io::Read as _;
use std::ops::Range;
use std::path::Path;

/// The largest file of rows that is read, in bytes; that is five million spheres or more.
pub const MAX_ROWS_BYTES: u64 = 256 << 20;

/// What a row of surfaces is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowKind {
    Sphere,
    Cylinder,
}

impl RowKind {
    /// The name of the table.
    pub(super) fn table(self) -> &'static str {
        match self {
            Self::Sphere => "spheres",
            Self::Cylinder => "cylinders",
        }
    }

    /// The columns of its points.
    fn points(self) -> &'static [&'static str] {
        match self {
            Self::Sphere => &["x", "y", "z"],
            Self::Cylinder => &["x1", "y1", "z1", "x2", "y2", "z2"],
        }
    }

    /// Its shape; `c` are the columns of its points.
    fn shape(self, row: &Row, c: &[usize], radius: f64) -> Result<Shape, Fault> {
        let point = |k: usize| row.vector::<Point>([c[k], c[k + 1], c[k + 2]]);
        match self {
            Self::Sphere => Ok(Shape::Sphere {
                center: point(0)?.0,
                radius,
            }),
            Self::Cylinder => {
                let (base, top) = (point(0)?.0, point(3)?.0);
                if base.distance(top) < SMALLEST {
                    let why = format!(
                        "x2, y2, z2 equal x1, y1, z1, but must be at least {SMALLEST:e} away from there"
                    );
                    return Err((c[3], why));
                }
                Ok(Shape::Cylinder { base, top, radius })
            }
        }
    }
}

/// What a `[[spheres]]` or `[[cylinders]]` says of its file. At most one of the keys says how large rows are, and one what they
/// look like.
#[derive(Debug, Clone, Default)]
pub(super) struct Keys {
    /// A material for all rows.
    pub(super) material: Option<String>,
    /// A radius for all rows.
    pub(super) radius: Option<f64>,
    pub(super) species: Option<Vec<(String, Species)>>,
    pub(super) color: Option<ColorMap>,
    /// The frame of an XYZ file.
    pub(super) frame: Option<u32>,
}

impl Keys {
    /// Columns that the file need not have, and the key that says the same.
    fn said(&self) -> Vec<(&str, &str)> {
        let mut said = Vec::new();
        if self.radius.is_some() {
            said.push((RADIUS, "radius"));
        } else if self.has_radii() {
            said.push((RADIUS, "species"));
        }
        let look = match (&self.material, &self.color) {
            (Some(_), _) => Some("material"),
            (None, Some(_)) => Some("color"),
            (None, None) => self.has_looks().then_some("species"),
        };
        let looks = COLOR.into_iter().chain([MATERIAL]);
        said.extend(looks.filter_map(|column| Some((column, look?))));
        said
    }

    /// Whether species say how large atoms are.
    pub(super) fn has_radii(&self) -> bool {
        let all = self.species.iter().flatten();
        all.into_iter().any(|(_, s)| s.radius.is_some())
    }

    /// Whether species say what atoms look like.
    pub(super) fn has_looks(&self) -> bool {
        let all = self.species.iter().flatten();
        all.into_iter().any(|(_, s)| s.look.is_some())
    }
}

/// Columns of a surface of its own colour: the reflectance of a diffuse material. In XYZ files it is one property.
const COLOR: [&str; 3] = ["r", "g", "b"];
const COLOR_PROPERTY: &str = "color";
const MATERIAL: &str = "material";
const RADIUS: &str = "radius";
const SPECIES: &str = "species";
/// Columns of lights: centre, normal, radius, radiance.
const LIGHT: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "radius", "r", "g", "b"];

/// What is wrong with a file of rows: that it can't be read, and why, its content, or, for lack of a name, the table that names it.
pub(super) enum Wrong {
    Unreadable(String),
    Content(Vec<Diagnostic>),
    /// A key of the table, and a message.
    Key(&'static str, String),
}

/// Where the material of a row comes from.
enum Look<'k> {
    Common(usize),
    Named(usize),
    Own([usize; 3]),
    Species,
    Mapped(&'k ColorMap, Range<usize>),
}

/// Where the radius of a row comes from.
enum Size {
    Common(f64),
    Own(usize),
    Species,
}

/// The surfaces in the text of a file, which the scene file names at `place`. `material` finds a material by name or returns an
/// error.
pub(super) fn surfaces(
    path: &Path,
    text: &str,
    place: Place,
    kind: RowKind,
    keys: &Keys,
    material: impl Fn(&str) -> Result<usize, String>,
    palette: &mut Palette,
) -> Result<Vec<Primitive>, Wrong> {
    let is_xyz = is_xyz(path);
    let mut sheet = match is_xyz {
        true => xyz::open(path, text, keys.frame)?,
        false => Sheet::new(path, text, Form::Commas),
    };
    let color: &[&str] = if is_xyz { &[COLOR_PROPERTY] } else { &COLOR };
    let colored = sheet.names_any(color);
    let needs_look = keys.material.is_none() && keys.color.is_none() && !keys.has_looks();
    let needs_radius = keys.radius.is_none() && !keys.has_radii();
    if !is_xyz {
        let mut wanted = kind.points().to_vec();
        wanted.extend(needs_radius.then_some(RADIUS));
        wanted.extend(keys.species.as_ref().map(|_| SPECIES));
        wanted.extend(keys.color.as_ref().map(|c| c.column.as_str()));
        match (needs_look, colored) {
            (true, true) => wanted.extend(color),
            (true, false) => wanted.push(MATERIAL),
            _ => {}
        }
        sheet.header(&wanted, &keys.said())?;
    }
    let one = |name: &str| sheet.find(name).start;
    let points: Vec<usize> = match is_xyz {
        true => sheet.find("pos").collect(),
        false => kind.points().iter().map(|name| one(name)).collect(),
    };
    let lacks = |property: &str, keys: &'static str| {
        let message = format!("the file has no property {property}, and this table no {keys}");
        Err(Wrong::Key("file", message))
    };
    let size = match keys.radius {
        Some(radius) => Size::Common(radius),
        None if keys.has_radii() => Size::Species,
        None if sheet.find(RADIUS).is_empty() => {
            return lacks("radius:R:1", "key radius and no radii by species");
        }
        None => Size::Own(one(RADIUS)),
    };
    let look = match (&keys.material, &keys.color) {
        (Some(name), _) => Look::Common(material(name).map_err(|e| Wrong::Key("material", e))?),
        (None, Some(map)) => {
            let fields = sheet.find(&map.column);
            if fields.is_empty() {
                let names = sheet.names.iter().map(AsRef::as_ref);
                let meant = super::source::suggestion(&map.column, names);
                let column = super::source::quoted(&map.column);
                return Err(Wrong::Key(
                    "color",
                    format!("the file has no property {column}{meant}"),
                ));
            }
            Look::Mapped(map, fields)
        }
        (None, None) if keys.has_looks() => Look::Species,
        (None, None) if is_xyz && !colored => {
            return lacks(
                "color:R:3",
                "key material, no color, and no reflectance by species",
            );
        }
        (None, None) if is_xyz => {
            let first = one(COLOR_PROPERTY);
            Look::Own([first, first + 1, first + 2])
        }
        (None, None) if colored => Look::Own(COLOR.map(one)),
        (None, None) => Look::Named(one(MATERIAL)),
    };
    let species = sheet.find(SPECIES);
    if keys.species.is_some() && species.is_empty() {
        return Err(Wrong::Key(
            "species",
            "the file has no property species:S:1".into(),
        ));
    }
    let kinds = keys.species.as_deref().unwrap_or_default();
    let kinds = Kinds::new(kinds, &material, palette).map_err(|e| Wrong::Key("species", e))?;

    let mut surfaces = Vec::new();
    let mut values = Vec::new();
    sheet.each(|row| {
        let of_species = match keys.species {
            Some(_) => kinds.of(row, species.start)?,
            None => (None, None),
        };
        let missing = || (0, "no radius and no look".to_owned());
        let radius = match size {
            Size::Common(radius) => radius,
            Size::Own(k) => row.number::<Radius>(k)?.0,
            Size::Species => of_species.0.ok_or_else(missing)?,
        };
        let shape = kind.shape(row, &points, radius)?;
        let material = match &look {
            Look::Common(material) => *material,
            Look::Named(k) => material(row.field(*k)).map_err(|e| (*k, e))?,
            Look::Own(color) => palette.material(row.vector::<Share>(*color)?.0),
            Look::Species => of_species.1.ok_or_else(missing)?,
            Look::Mapped(_, fields) => {
                values.push(magnitude(row, fields.clone())?);
                0
            }
        };
        surfaces.push(Primitive {
            shape,
            material,
            line: place.line,
            column: place.column,
        });
        Ok(())
    })?;
    // Only now the range of the values is known.
    if let Look::Mapped(map, _) = look {
        for (surface, material) in surfaces.iter_mut().zip(map.materials(&values, palette)) {
            surface.material = material;
        }
    }
    Ok(surfaces)
}

/// The lights in the text of a file, which is named at `place` of the scene file.
pub(super) fn lights(path: &Path, text: &str, place: Place) -> Result<Vec<Light>, Wrong> {
    let mut sheet = Sheet::new(path, text, Form::Commas);
    sheet.header(&LIGHT, &[])?;
    let c = LIGHT.map(|name| sheet.find(name).start);
    let mut lights = Vec::new();
    sheet.each(|row| {
        lights.push(Light {
            center: row.vector::<Point>([c[0], c[1], c[2]])?.0,
            normal: row.vector::<Direction>([c[3], c[4], c[5]])?.0,
            radius: row.number::<Radius>(c[6])?.0,
            radiance: row.vector::<Radiance>([c[7], c[8], c[9]])?.0,
            line: place.line,
            column: place.column,
        });
        Ok(())
    })?;
    Ok(lights)
}

/// The text of a file of rows, of at most [`MAX_ROWS_BYTES`].
pub(super) fn read(path: &Path) -> Result<String, Wrong> {
    let form = if is_xyz(path) { "an XYZ" } else { "a CSV" };
    let system = |e: std::io::Error| Wrong::Unreadable(reason(&e));
    let wrong = |place: Place, message: String| Wrong::Content(vec![about(path, place, message)]);
    let file = File::open(path).map_err(system)?;
    let mut bytes = Vec::new();
    file.take(MAX_ROWS_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(system)?;
    if bytes.len() as u64 > MAX_ROWS_BYTES {
        let limit = MAX_ROWS_BYTES >> 20;
        let message = format!("the file is too large; {form} file has at most {limit} MiB");
        return Err(wrong(Place::default(), message));
    }
    if let Some(kind) = FileKind::of_no_text(&bytes) {
        let message = format!("not {form} file ({kind})");
        return Err(wrong(Place::default(), message));
    }
    String::from_utf8(bytes).map_err(|e| {
        let (good, bad) = e.as_bytes().split_at(e.utf8_error().valid_up_to());
        let good = String::from_utf8_lossy(good);
        let place = sheet::place(path, &good, good.len());
        let byte = bad.first().copied().unwrap_or_default();
        wrong(
            place,
            format!("byte 0x{byte:02x} is not valid UTF-8; {form} file is UTF-8 text"),
        )
    })
}

fn about(path: &Path, place: Place, message: String) -> Diagnostic {
    Diagnostic {
        path: path.to_owned(),
        line: place.line,
        column: place.column,
        message,
        unreadable: false,
    }
}

#[cfg(test)]
mod tests;
