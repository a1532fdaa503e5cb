//! `[[isosurface]]`: its keys, the kinds of value that no other table has, and its text.

use super::Shape;
use super::format::Table;
use super::implicit::{Rotation, number_text, rotation_text, vector_text};
use super::value::{Finite, LARGEST, Lengths, Point, Text, Truth, Value, Wrong, wrong};
use crate::files::{nifti, npy, reason};
use crate::implicit::volume::{AxisOrder, MOST_VALUES, Volume};
use crate::implicit::{Grid, Implicit};
use glam::DMat3;
use serde_json::{Value as Json, json};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeValue;

/// A kind of value that is one of a few names.
trait Named: Copy + PartialEq + 'static {
    const NAMES: &'static [(&'static str, Self)];

    fn name(self) -> &'static str {
        let named = Self::NAMES.iter().find(|(_, value)| *value == self);
        named.expect("every value has a name").0
    }
}

impl<T: Named> Value for T {
    fn rule() -> String {
        let names: Vec<String> = T::NAMES.iter().map(|(n, _)| format!("\"{n}\"")).collect();
        names.join(" or ")
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let name = found.get_ref().as_str();
        let one = T::NAMES.iter().find(|(n, _)| Some(*n) == name);
        one.map(|(_, value)| *value).ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        json!({"enum": T::NAMES.iter().map(|(n, _)| n).collect::<Vec<_>>()})
    }

    fn to_json(&self) -> Json {
        json!(self.name())
    }
}

/// Which side of the level is the inside.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Inside {
    above: bool,
}

impl Named for Inside {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("above", Self { above: true }),
        ("below", Self { above: false }),
    ];
}

/// The normals about which light is scattered.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Normals {
    smooth: bool,
}

impl Named for Normals {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("cell", Self { smooth: false }),
        ("smooth", Self { smooth: true }),
    ];
}

impl Named for AxisOrder {
    const NAMES: &'static [(&'static str, Self)] = &[("zyx", Self::Zyx), ("xyz", Self::Xyz)];
}

/// `[[isosurface]]`, but for its material.
pub(super) fn read(t: &mut impl Table) -> Option<Shape> {
    let file = t.required::<Text>(
        "file",
        "NumPy file (.npy) with an array of three indices: uint8, uint16, float32 or float64; or a NIfTI file (.nii, .nii.gz) of three dimensions. Its path is relative to the scene file.",
    );
    let order = t.defaulted(
        "order",
        AxisOrder::Zyx,
        "Which index of the array is which axis: a[z, y, x] or a[x, y, z].",
    );
    let level = t.required::<Finite>(
        "level",
        "The surface is where the trilinear function between the numbers has this value.",
    );
    let inside = t.defaulted(
        "inside",
        Inside { above: true },
        "Whether the solid is where the function has more than the level, or less.",
    );
    let origin = t.required::<Point>("origin", "Where the first number lies.");
    let spacing = t.required::<Lengths>(
        "spacing",
        "The distance from one number to the next along x, y and z.",
    );
    let rotation = t.defaulted(
        "rotation",
        Rotation(DMat3::IDENTITY),
        "How the volume's axes are turned about the origin: axis and angle in degrees, or the rows of a matrix.",
    );
    let closed = t.defaulted(
        "closed",
        Truth(true),
        "Whether it bounds a solid, closed where the volume ends. Otherwise it is a two-sided surface, open there.",
    );
    let normals = t.defaulted(
        "normals",
        Normals { smooth: false },
        "Whether light is scattered about the normals of the cells, or about smooth ones.",
    );
    let file = file?.0;
    let volume = t.volume(&file, order?)?;
    let grid = Grid {
        volume,
        file,
        order: order?,
        spacing: spacing?.0,
        above: inside?.above,
        smooth: normals?.smooth,
    };
    if grid.extent().max_element() > LARGEST {
        let message = format!("the volume reaches over more than {LARGEST:e}");
        t.refuse("spacing", message);
        return None;
    }
    let mut implicit = Implicit::of_volume(grid, level?.0);
    implicit.center = origin?.0;
    implicit.rotation = rotation?.0;
    implicit.closed = closed?.0;
    Some(Shape::Implicit(Arc::new(implicit)))
}

/// Why there is no volume.
pub(super) enum NoVolume {
    /// The file can't be read.
    Unreadable(String),
    /// Its content is wrong.
    Wrong(String),
}

/// The volume in the file at `path`.
pub(super) fn load(path: &Path, order: AxisOrder) -> Result<Volume, NoVolume> {
    let system = |e: std::io::Error| NoVolume::Unreadable(reason(&e));
    let file = File::open(path).map_err(system)?;
    if file.metadata().map_err(system)?.is_dir() {
        return Err(system(std::io::ErrorKind::IsADirectory.into()));
    }
    let file = BufReader::new(file);
    let array = match nifti::is_named(&path.to_string_lossy()) {
        Some(compressed) => {
            if order != AxisOrder::Zyx {
                let message =
                    "a NIfTI file says itself which axis is which, so `order` must be left out";
                return Err(NoVolume::Wrong(message.into()));
            }
            nifti::read(file, compressed, MOST_VALUES)
        }
        None => npy::read(file, 3, MOST_VALUES),
    };
    Volume::of_array(array.map_err(NoVolume::Wrong)?, order).map_err(NoVolume::Wrong)
}

/// The keys of an isosurface, as they stand in a file. `string` writes a string.
pub(super) fn text(implicit: &Implicit, grid: &Grid, string: impl Fn(&str) -> String) -> String {
    let [level, origin, spacing] = [
        number_text(implicit.level),
        vector_text(implicit.center),
        vector_text(grid.spacing),
    ];
    let rotation = rotation_text(implicit.rotation);
    let order = grid.order.name();
    format!(
        "file = {}\norder = \"{order}\"\nlevel = {level}\ninside = \"{}\"\norigin = {origin}\nspacing = {spacing}\nrotation = {rotation}\nclosed = {}\nnormals = \"{}\"\n",
        string(&grid.file),
        if grid.above { "above" } else { "below" },
        implicit.closed,
        if grid.smooth { "smooth" } else { "cell" },
    )
}
