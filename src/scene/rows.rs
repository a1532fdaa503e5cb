//! Reads many spheres or lights from a CSV file: `[[spheres]]` and `[[lights]]`.
//!
//! The first row names the columns, in any order. Every other row is one object. Fields are numbers and names of materials,
//! so there are no quotes.

use super::source::{Source, quoted, suggestion};
use super::value::{Direction, FromNumber, FromVector, Point, Radiance, Radius};
use super::{Diagnostic, Light, Place, Primitive, Shape};
use crate::files::kind::FileKind;
use crate::files::reason;
use glam::DVec3;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The largest file of rows that is read, in bytes; that is five million spheres or more.
pub const MAX_ROWS_BYTES: u64 = 256 << 20;

/// The most errors reported for one file.
const MAX_ERRORS: usize = 20;

/// Columns of spheres, without that of their materials.
const SPHERE: [&str; 4] = ["x", "y", "z", "radius"];
const MATERIAL: &str = "material";
/// Columns of lights: centre, normal, radius, radiance.
const LIGHT: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "radius", "r", "g", "b"];

/// What is wrong with a file of rows: that it can't be read, and why, or its content.
pub(super) enum Wrong {
    Unreadable(String),
    Content(Vec<Diagnostic>),
}

/// The spheres in the text of a CSV file, which the scene file names at `place`. `material` finds a material by name or returns
/// an error. `common` is the material of all spheres if there is no such column.
pub(super) fn spheres(
    path: &Path,
    text: &str,
    place: Place,
    common: Option<usize>,
    material: impl Fn(&str) -> Result<usize, String>,
) -> Result<Vec<Primitive>, Wrong> {
    let mut rows = Rows::new(path, text);
    let optional: &[&str] = if common.is_some() { &[] } else { &[MATERIAL] };
    let columns = rows.header(&SPHERE, optional)?;
    let mut spheres = Vec::new();
    rows.each(columns.len(), |row| {
        let [x, y, z, radius] = [0, 1, 2, 3].map(|k| columns[k]);
        let center = row.vector::<Point>([x, y, z])?.0;
        let radius = row.number::<Radius>(radius)?.0;
        let material = match common {
            Some(material) => material,
            None => material(row.field(columns[4])).map_err(|e| (columns[4], e))?,
        };
        spheres.push(Primitive {
            shape: Shape::Sphere { center, radius },
            material,
            line: place.line,
            column: place.column,
        });
        Ok(())
    })?;
    Ok(spheres)
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

    fn faults(text: &str) -> Vec<String> {
        let named = |name: &str| {
            if name == "red" {
                Ok(7)
            } else {
                Err(format!("no {name}"))
            }
        };
        match spheres("x.csv".as_ref(), text, PLACE, None, named) {
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
        let all = spheres("x.csv".as_ref(), text, PLACE, None, |_| Ok(7))
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
