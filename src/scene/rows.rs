//! Reads many spheres, cylinders or lights from a CSV file: `[[spheres]]`, `[[cylinders]]` and `[[lights]]`.
//!
//! The first row names the columns, in any order. Every other row is one object. Fields are numbers and names of materials,
//! so there are no quotes.

use super::source::{Source, quoted, suggestion};
use super::value::{Direction, FromNumber, FromVector, Point, Radiance, Radius, SMALLEST, Share};
use super::{Diagnostic, Light, Place, Primitive, Shape};
use crate::files::kind::FileKind;
use crate::files::reason;
use glam::DVec3;
use std::collections::HashMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The largest file of rows that is read, in bytes; that is five million spheres or more.
pub const MAX_ROWS_BYTES: u64 = 256 << 20;

/// The most errors reported for one file.
const MAX_ERRORS: usize = 20;

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

    /// Its columns, without those of its material.
    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Sphere => &["x", "y", "z", "radius"],
            Self::Cylinder => &["x1", "y1", "z1", "x2", "y2", "z2", "radius"],
        }
    }

    fn shape(self, row: Row, c: &[usize]) -> Result<Shape, (usize, String)> {
        let point = |k: usize| row.vector::<Point>([c[k], c[k + 1], c[k + 2]]);
        match self {
            Self::Sphere => Ok(Shape::Sphere {
                center: point(0)?.0,
                radius: row.number::<Radius>(c[3])?.0,
            }),
            Self::Cylinder => {
                let (base, top) = (point(0)?.0, point(3)?.0);
                if base.distance(top) < SMALLEST {
                    let why = format!(
                        "x2, y2, z2 equal x1, y1, z1, but must be at least {SMALLEST:e} away from there"
                    );
                    return Err((c[3], why));
                }
                let radius = row.number::<Radius>(c[6])?.0;
                Ok(Shape::Cylinder { base, top, radius })
            }
        }
    }
}

/// Columns of a surface of its own colour: the reflectance of a diffuse material.
const COLOR: [&str; 3] = ["r", "g", "b"];
const MATERIAL: &str = "material";
/// Columns of lights: centre, normal, radius, radiance.
const LIGHT: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "radius", "r", "g", "b"];

/// What is wrong with a file of rows: that it can't be read, and why, or its content.
pub(super) enum Wrong {
    Unreadable(String),
    Content(Vec<Diagnostic>),
}

/// The colours of rows, each of which is a diffuse material.
pub(super) struct Palette {
    /// Materials that there are without them.
    pub(super) first: usize,
    pub(super) colors: Vec<DVec3>,
    index: HashMap<[u64; 3], usize>,
}

impl Palette {
    pub(super) fn new(first: usize) -> Self {
        Self {
            first,
            colors: Vec::new(),
            index: HashMap::new(),
        }
    }

    /// The number of the material of this reflectance.
    fn material(&mut self, color: DVec3) -> usize {
        // Adding 0 turns -0 into 0.
        let key = color.to_array().map(|x| (x + 0.0).to_bits());
        *self.index.entry(key).or_insert_with(|| {
            self.colors.push(color);
            self.first + self.colors.len() - 1
        })
    }
}

/// The surfaces in the text of a CSV file, which the scene file names at `place`. `material` finds a material by name or returns
/// an error. `common` is the material of all if the file has neither such a column nor colours.
pub(super) fn surfaces(
    path: &Path,
    text: &str,
    place: Place,
    kind: RowKind,
    common: Option<usize>,
    material: impl Fn(&str) -> Result<usize, String>,
    palette: &mut Palette,
) -> Result<Vec<Primitive>, Wrong> {
    let mut rows = Rows::new(path, text);
    let always = kind.columns();
    let colored = common.is_none() && rows.names_any(&COLOR);
    let besides: &[&str] = match common {
        Some(_) => &[],
        None if colored => &COLOR,
        None => &[MATERIAL],
    };
    let columns = rows.header(always, besides)?;
    let last = always.len();
    let mut surfaces = Vec::new();
    rows.each(columns.len(), |row| {
        let shape = kind.shape(row, &columns)?;
        let material = match common {
            Some(material) => material,
            None if colored => {
                let color = [columns[last], columns[last + 1], columns[last + 2]];
                palette.material(row.vector::<Share>(color)?.0)
            }
            None => material(row.field(columns[last])).map_err(|e| (columns[last], e))?,
        };
        surfaces.push(Primitive {
            shape,
            material,
            line: place.line,
            column: place.column,
        });
        Ok(())
    })?;
    Ok(surfaces)
}

/// The lights in the text of a file, which is named at `place` of the scene file.
pub(super) fn lights(path: &Path, text: &str, place: Place) -> Result<Vec<Light>, Wrong> {
    let mut rows = Rows::new(path, text);
    let c = rows.header(&LIGHT, &[])?;
    let mut lights = Vec::new();
    rows.each(c.len(), |row| {
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
    let system = |e: std::io::Error| Wrong::Unreadable(reason(&e));
    let wrong = |place: Place, message: String| Wrong::Content(vec![about(path, place, message)]);
    let file = File::open(path).map_err(system)?;
    let mut bytes = Vec::new();
    file.take(MAX_ROWS_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(system)?;
    if bytes.len() as u64 > MAX_ROWS_BYTES {
        let limit = MAX_ROWS_BYTES >> 20;
        let message = format!("the file is too large; a CSV file has at most {limit} MiB");
        return Err(wrong(Place::default(), message));
    }
    if let Some(kind) = FileKind::of_no_text(&bytes) {
        let message = format!("not a CSV file ({kind})");
        return Err(wrong(Place::default(), message));
    }
    String::from_utf8(bytes).map_err(|e| {
        let (good, bad) = e.as_bytes().split_at(e.utf8_error().valid_up_to());
        let good = String::from_utf8_lossy(good);
        let place = Source::new(path, &good).place(good.len());
        let byte = bad.first().copied().unwrap_or_default();
        wrong(
            place,
            format!("byte 0x{byte:02x} is not valid UTF-8; a CSV file is UTF-8 text"),
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

/// A file, row by row.
struct Rows<'a> {
    path: &'a Path,
    /// The first row.
    header: &'a str,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    errors: Vec<Diagnostic>,
}

impl<'a> Rows<'a> {
    fn new(path: &'a Path, text: &'a str) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self {
            path,
            header: "",
            lines: text.lines().enumerate(),
            errors: Vec::new(),
        }
    }

    fn wrong(&mut self, line: usize, column: usize, message: String) {
        let place = Place { line, column };
        self.errors.push(about(self.path, place, message));
    }

    /// Whether the first row names one of these columns.
    fn names_any(&self, names: &[&str]) -> bool {
        let header = self.lines.clone().next().map_or("", |(_, line)| line);
        header.split(',').any(|name| names.contains(&name.trim()))
    }

    /// Where the columns `wanted`, all of them, stand.
    fn header(&mut self, always: &[&str], besides: &[&str]) -> Result<Vec<usize>, Wrong> {
        let wanted = || always.iter().chain(besides).copied();
        let rule = format!(
            "the first row must name the columns {}",
            wanted().collect::<Vec<_>>().join(", ")
        );
        let Some((_, header)) = self.lines.next() else {
            self.wrong(0, 0, format!("the file is empty; {rule}"));
            return Err(Wrong::Content(std::mem::take(&mut self.errors)));
        };
        let row = Row {
            header,
            line: header,
        };
        self.header = header;
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        for (k, name) in names.iter().enumerate() {
            let message = if !wanted().any(|w| w == *name) {
                let meant = suggestion(name, wanted());
                format!("unknown column {}; {rule}{meant}", quoted(name))
            } else if names[..k].contains(name) {
                format!("duplicate column {}; {rule}, each once", quoted(name))
            } else {
                continue;
            };
            self.wrong(1, row.place(k), message);
        }
        let mut columns = Vec::new();
        for name in wanted() {
            match names.iter().position(|n| n == &name) {
                Some(k) => columns.push(k),
                None => self.wrong(1, 0, format!("no column {name}; {rule}")),
            }
        }
        if self.errors.is_empty() {
            Ok(columns)
        } else {
            Err(Wrong::Content(std::mem::take(&mut self.errors)))
        }
    }

    /// Calls `read` for every row with just `count` fields; its error is a column and a message.
    fn each(
        mut self,
        count: usize,
        mut read: impl FnMut(Row<'a>) -> Result<(), (usize, String)>,
    ) -> Result<(), Wrong> {
        while let Some((i, line)) = self.lines.next() {
            if line.trim().is_empty() {
                continue;
            }
            let fields = line.split(',').count();
            let header = self.header;
            let row = Row { header, line };
            if fields != count {
                self.wrong(
                    i + 1,
                    0,
                    format!("found {fields} fields, but the first row names {count} columns"),
                );
            } else if let Err((column, message)) = read(row) {
                self.wrong(i + 1, row.place(column), message);
            }
            if self.errors.len() == MAX_ERRORS {
                break;
            }
        }
        if self.errors.is_empty() {
            Ok(())
        } else {
            Err(Wrong::Content(self.errors))
        }
    }
}

#[derive(Clone, Copy)]
struct Row<'a> {
    header: &'a str,
    line: &'a str,
}

impl<'a> Row<'a> {
    fn field(self, k: usize) -> &'a str {
        self.line.split(',').nth(k).unwrap_or_default().trim()
    }

    /// Column in characters, from 1, of field `k`.
    fn place(self, k: usize) -> usize {
        let before: usize = self
            .line
            .split(',')
            .take(k)
            .map(|f| f.chars().count() + 1)
            .sum();
        let field = self.line.split(',').nth(k).unwrap_or_default();
        1 + before + (field.chars().count() - field.trim_start().chars().count())
    }

    fn float(self, k: usize) -> Option<f64> {
        self.field(k).parse().ok()
    }

    fn number<T: FromNumber>(self, k: usize) -> Result<T, (usize, String)> {
        let value = self.float(k).and_then(T::from_number);
        value.ok_or_else(|| (k, self.message(k, &T::rule())))
    }

    fn vector<T: FromVector>(self, columns: [usize; 3]) -> Result<T, (usize, String)> {
        let parts = columns.map(|k| self.float(k));
        if let [Some(x), Some(y), Some(z)] = parts
            && let Some(value) = T::from_vector(DVec3::new(x, y, z))
        {
            return Ok(value);
        }
        // Beside numbers that are right for any kind of vector, so that a 0 in a direction is none.
        let alone = |x: f64| T::from_vector(DVec3::new(x, 1.0, 1.0)).is_some();
        let wrong = columns
            .iter()
            .copied()
            .find(|&k| !self.float(k).is_some_and(alone));
        match wrong {
            Some(k) => Err((k, self.message(k, &T::rule_of_one()))),
            None => {
                let names = columns.map(|k| self.name(k)).join(", ");
                let values = columns.map(|k| self.field(k)).join(", ");
                let rule = T::rule();
                Err((
                    columns[0],
                    format!("{names} are {values}; they must be {rule}"),
                ))
            }
        }
    }

    /// What the first row calls field `k`.
    fn name(self, k: usize) -> &'a str {
        self.header.split(',').nth(k).unwrap_or_default().trim()
    }

    fn message(self, k: usize, rule: &str) -> String {
        let (name, found) = (self.name(k), quoted(self.field(k)));
        format!("{name} is {found}; {name} must be {rule}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACE: Place = Place { line: 3, column: 1 };

    fn read_as(
        kind: RowKind,
        text: &str,
        named: impl Fn(&str) -> Result<usize, String>,
    ) -> Result<Vec<Primitive>, Wrong> {
        let palette = &mut Palette::new(9);
        surfaces("x.csv".as_ref(), text, PLACE, kind, None, named, palette)
    }

    fn faults(text: &str) -> Vec<String> {
        let named = |name: &str| {
            if name == "red" {
                Ok(7)
            } else {
                Err(format!("no {name}"))
            }
        };
        match read_as(RowKind::Sphere, text, named) {
            Ok(_) => Vec::new(),
            Err(Wrong::Unreadable(message)) => vec![message],
            Err(Wrong::Content(all)) => all
                .iter()
                .map(|d| format!("{}:{}: {}", d.line, d.column, d.message))
                .collect(),
        }
    }

    #[test]
    fn columns_may_stand_in_any_order() {
        let text = "radius, z,y,x ,material\n 2,3,4,5, red \n\n1e-3,0,-1,+2.5,red\r\n";
        let all = read_as(RowKind::Sphere, text, |_| Ok(7))
            .ok()
            .expect("spheres");
        let center = DVec3::new(5.0, 4.0, 3.0);
        assert_eq!(
            all[0].shape,
            Shape::Sphere {
                center,
                radius: 2.0
            }
        );
        assert_eq!((all.len(), all[1].material, all[1].line), (2, 7, 3));
        let text = "x,y,z,nx,ny,nz,radius,r,g,b\n1,2,3,0,-2,0,0.5,9,8,7\n";
        let all = lights("x.csv".as_ref(), text, PLACE).ok().expect("lights");
        assert_eq!(
            (all[0].normal, all[0].radiance),
            (DVec3::NEG_Y, DVec3::new(9.0, 8.0, 7.0))
        );
    }

    #[test]
    fn rows_may_have_colors_and_be_cylinders() {
        let text = "x1,y1,z1,x2,y2,z2,radius,r,g,b\n0,0,0,0,1,0,0.1,1,0,0.5\n1,0,0,1,1,0,0.2,0,1,0\n2,0,0,2,1,0,0.3,1,0,0.5\n";
        let mut palette = Palette::new(9);
        let unnamed =
            |_: &str| -> Result<usize, String> { unreachable!("there is no such column") };
        let kind = RowKind::Cylinder;
        let all = surfaces(
            "x.csv".as_ref(),
            text,
            PLACE,
            kind,
            None,
            unnamed,
            &mut palette,
        );
        let all = all.ok().expect("cylinders");
        let materials: Vec<usize> = all.iter().map(|p| p.material).collect();
        assert_eq!(materials, [9, 10, 9]);
        assert_eq!(palette.colors, [DVec3::new(1.0, 0.0, 0.5), DVec3::Y]);
        let (base, top) = (DVec3::X, DVec3::new(1.0, 1.0, 0.0));
        let radius = 0.2;
        assert_eq!(all[1].shape, Shape::Cylinder { base, top, radius });
        assert_eq!(
            faults("x,y,z,radius,r,g,b\n0,0,0,1,1,1.5,0\n"),
            ["2:11: g is \"1.5\"; g must be a number from 0 to 1"]
        );
        assert_eq!(
            faults("x,y,z,radius,r,g\n"),
            ["1:0: no column b; the first row must name the columns x, y, z, radius, r, g, b"]
        );
        let Err(Wrong::Content(flat)) = read_as(
            RowKind::Cylinder,
            "x1,y1,z1,x2,y2,z2,radius,material\n1,2,3,1,2,3,1,red\n",
            |_| Ok(7),
        ) else {
            panic!("no cylinder");
        };
        assert_eq!((flat[0].line, flat[0].column), (2, 7));
        assert!(flat[0].message.starts_with("x2, y2, z2 equal x1, y1, z1"));
    }

    #[test]
    fn errors_have_their_places() {
        assert_eq!(
            faults("x,y,z,radius,material\n1,2,3,1,red\n1,two,3,1,red\n1,2,3,-1,blue\n"),
            [
                "3:3: y is \"two\"; y must be a number from -1e15 to 1e15 (limits of f32 kernels)",
                "4:7: radius is \"-1\"; radius must be a number from 1e-15 to 1e15 (limits of f32 kernels)"
            ]
        );
        assert_eq!(
            faults("x,y,z,radius,material\n0,0,0,1, blue\n"),
            ["2:10: no blue"]
        );
        let short = faults("x,y,z,radius,material\n0,0,0,1\n");
        assert_eq!(
            short,
            ["2:0: found 4 fields, but the first row names 5 columns"]
        );
        let rule = "the first row must name the columns x, y, z, radius, material";
        assert_eq!(
            faults("x,y,z,radios,material\n"),
            [
                format!("1:7: unknown column \"radios\"; {rule}; did you mean \"radius\"?"),
                format!("1:0: no column radius; {rule}")
            ]
        );
        assert_eq!(
            faults("x,y,z,radius,material,radius\n"),
            [format!(
                "1:23: duplicate column \"radius\"; {rule}, each once"
            )]
        );
        assert_eq!(faults(""), [format!("0:0: the file is empty; {rule}")]);
        assert_eq!(faults("x,y,z,radius,material\n0,0,0,nan,red\n").len(), 1);
        let dark = "x,y,z,nx,ny,nz,radius,r,g,b\n1,2,3,0,0,0,0.5,9,8,7\n1,2,3,0,inf,1,1,1,1,1\n";
        let Err(Wrong::Content(all)) = lights("x.csv".as_ref(), dark, PLACE) else {
            panic!("no direction");
        };
        let all: Vec<_> = all.iter().map(|d| d.message.as_str()).collect();
        assert_eq!(
            all,
            [
                "nx, ny, nz are 0, 0, 0; they must be three finite numbers, not all 0",
                "ny is \"inf\"; ny must be a finite number"
            ]
        );
    }

    #[test]
    fn invalid_utf8_has_its_place() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), b"x,y,z,radius,material\n0,0,\xe9,1,red\n").expect("written");
        let Err(Wrong::Content(all)) = read(file.path()) else {
            panic!("no text");
        };
        assert_eq!((all[0].line, all[0].column), (2, 5));
        assert!(all[0].message.starts_with("byte 0xe9 is not valid UTF-8"));
    }
}
