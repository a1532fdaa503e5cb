//! `[[implicit]]`: its keys, the kinds of value that no other table has, and its text.

use super::Shape;
use super::build::UNIT;
use super::format::Table;
use super::value::{
    Direction, FromNumber as _, Level, Point, Radius, Text, Truth, Value, Wrong, array, number,
    wrong,
};
use crate::implicit::{Clip, Implicit};
use glam::{DMat3, DVec3};
use serde_json::{Value as Json, json};
use std::fmt::Write as _;
use std::sync::Arc;
use toml::Spanned;
use toml::de::DeValue;

/// How far the rows of a rotation may be from unit vectors at right angles.
const SQUARE: f64 = 1e-6;

/// Where a surface is looked for.
#[derive(Debug, Clone, Copy)]
struct Bounds(Clip);

/// A rotation: an axis and an angle, or a matrix.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rotation(pub(super) DMat3);

/// Names and numbers.
#[derive(Debug, Clone)]
struct Parameters(Vec<(String, f64)>);

/// The value of a key of a table that is a value.
fn part<T: Value>(found: &Spanned<DeValue>, key: &str) -> Result<Option<T>, Wrong> {
    let value = found.get_ref().as_table().and_then(|t| t.get(key));
    value.map(T::read).transpose()
}

/// Whether `found` is a table with these keys and no others.
fn has(found: &Spanned<DeValue>, keys: &[&str]) -> bool {
    let table = found.get_ref().as_table();
    table.is_some_and(|t| t.len() == keys.len() && keys.iter().all(|k| t.contains_key(*k)))
}

impl Value for Bounds {
    fn rule() -> String {
        "{ min = [x, y, z], max = [x, y, z] } with each min below max, or { radius = r }, r > 0"
            .into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        if has(found, &["radius"]) {
            let radius = part::<Radius>(found, "radius")?;
            let ball = radius.map(|r| Self(Clip::Ball { radius: r.0 }));
            return ball.ok_or_else(|| wrong(found));
        }
        if !has(found, &["min", "max"]) {
            return Err(wrong(found));
        }
        let (min, max) = (part::<Point>(found, "min")?, part::<Point>(found, "max")?);
        let (min, max) = min.zip(max).ok_or_else(|| wrong(found))?;
        let clip = Clip::Box {
            min: min.0,
            max: max.0,
        };
        // Narrower boxes are none in f32.
        let (_, half) = clip.extent();
        let least = 1e-6 * min.0.abs().max(max.0.abs()).max_element();
        let wide = half.min_element() > least;
        wide.then_some(Self(clip)).ok_or_else(|| wrong(found))
    }

    fn schema() -> Json {
        let table = |properties: Json, required: &[&str]| json!({"type": "object", "properties": properties, "required": required, "additionalProperties": false});
        let corners = json!({"min": Point::schema(), "max": Point::schema()});
        let ball = json!({"radius": Radius::schema()});
        json!({"oneOf": [table(corners, &["min", "max"]), table(ball, &["radius"])]})
    }

    fn to_json(&self) -> Json {
        match self.0 {
            Clip::Box { min, max } => json!({"min": min.to_array(), "max": max.to_array()}),
            Clip::Ball { radius } => json!({"radius": radius}),
        }
    }
}

impl Value for Rotation {
    fn rule() -> String {
        "{ axis = [x, y, z], angle = degrees }, or the three rows of a rotation matrix".into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        if has(found, &["axis", "angle"]) {
            let axis = part::<Direction>(found, "axis")?;
            let angle = found.get_ref().as_table().and_then(|t| t.get("angle"));
            let angle = angle.and_then(|a| number(a.get_ref()));
            let turned = axis.zip(angle.filter(|a| a.is_finite()));
            let (axis, angle) = turned.ok_or_else(|| wrong(found))?;
            let turn = DMat3::from_axis_angle(axis.0, angle.to_radians());
            return Ok(Self(orthonormal(turn)));
        }
        let [a, b, c] = array(found, |row| array(row, |x| number(x.get_ref())).ok())?;
        let rows = DMat3::from_cols(DVec3::from(a), DVec3::from(b), DVec3::from(c));
        let product = rows.transpose() * rows;
        let difference = (product - DMat3::IDENTITY).to_cols_array();
        let square = difference.iter().all(|x| x.abs() <= SQUARE);
        if !(square && rows.determinant() > 0.0) {
            return Err(wrong(found));
        }
        Ok(Self(orthonormal(rows).transpose()))
    }

    fn schema() -> Json {
        let properties = json!({"axis": Direction::schema(), "angle": {"type": "number"}});
        let turn = json!({
            "type": "object", "properties": properties, "required": ["axis", "angle"], "additionalProperties": false
        });
        let row =
            json!({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3});
        json!({"oneOf": [turn, {"type": "array", "items": row, "minItems": 3, "maxItems": 3}]})
    }

    fn to_json(&self) -> Json {
        let rows = self.0.transpose();
        json!([rows.x_axis, rows.y_axis, rows.z_axis].map(|r| r.to_array()))
    }
}

/// Whether the columns of `m` are unit vectors at right angles, to some forty roundings: whatever one
/// step of Gram and Schmidt, or a well-made rotation, leaves.
pub(super) fn is_orthonormal(m: DMat3) -> bool {
    let product = m.transpose() * m - DMat3::IDENTITY;
    product.to_cols_array().iter().all(|x| x.abs() <= UNIT)
}

/// The columns of `m` as unit vectors at right angles. Columns that are so already keep their bits, so
/// that a rotation read again is the same.
fn orthonormal(m: DMat3) -> DMat3 {
    if is_orthonormal(m) {
        return m;
    }
    let x = m.x_axis.normalize();
    let y = (m.y_axis - x * x.dot(m.y_axis)).normalize();
    DMat3::from_cols(x, y, x.cross(y))
}

impl Value for Parameters {
    fn rule() -> String {
        "a table of names (letters, digits and _, and no word of formulas) and numbers from -1e15 to 1e15".into()
    }

    fn read(found: &Spanned<DeValue>) -> Result<Self, Wrong> {
        let table = found.get_ref().as_table().ok_or_else(|| wrong(found))?;
        let mut all = Vec::with_capacity(table.len());
        for (name, value) in table {
            let level = number(value.get_ref()).and_then(Level::from_number);
            let name = name.get_ref().to_string();
            match level.filter(|_| Implicit::may_name(&name)) {
                Some(level) => all.push((name, level.0)),
                None => return Err(wrong(value)),
            }
        }
        all.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(Self(all))
    }

    fn schema() -> Json {
        json!({"type": "object", "additionalProperties": Level::schema()})
    }

    fn to_json(&self) -> Json {
        self.0
            .iter()
            .map(|(name, x)| (name.clone(), json!(x)))
            .collect()
    }
}

/// `[[implicit]]`, but for its material.
pub(super) fn read(t: &mut impl Table) -> Option<Shape> {
    let f = t.required::<Text>(
        "f",
        "Formula of x, y and z: + - * / ^, sqrt, abs, min, max, sin, cos, tan, exp, log, pi, and the names of parameters.",
    );
    let parameters = t.optional::<Parameters>(
        "parameters",
        None,
        "Names that the formula may use, and their values.",
    );
    let level = t.defaulted(
        "level",
        Level(0.0),
        "The surface is where f has this value. The solid is where f has less.",
    );
    let center = t.defaulted(
        "center",
        Point(DVec3::ZERO),
        "Where the formula's origin lies.",
    );
    let scale = t.defaulted("scale", Radius(1.0), "The length of the formula's unit.");
    let rotation = t.defaulted(
        "rotation",
        Rotation(DMat3::IDENTITY),
        "How the formula's axes are turned: axis and angle in degrees, or the rows of a matrix.",
    );
    let bounds = t.required::<Bounds>(
        "bounds",
        "Where the surface is looked for, in the formula's coordinates: the corners of a box, or the radius of a ball around the origin.",
    );
    let closed = t.defaulted(
        "closed",
        Truth(true),
        "Whether it bounds a solid, closed where the bounds cut it. Otherwise it is a two-sided surface, open there.",
    );

    let parameters = parameters.map(|p| p.0).unwrap_or_default();
    let mut implicit = match Implicit::of(f?.0, parameters) {
        Ok(implicit) => implicit,
        Err(fault) => {
            t.refuse("f", format!("f is wrong at {fault}"));
            return None;
        }
    };
    implicit.level = level?.0;
    implicit.center = center?.0;
    implicit.scale = scale?.0;
    implicit.rotation = rotation?.0;
    implicit.clip = bounds?.0;
    implicit.closed = closed?.0;
    Some(Shape::Implicit(Arc::new(implicit)))
}

/// A number that reads back to the same bits.
pub(super) fn number_text(x: f64) -> String {
    if x.is_nan() {
        "nan".into()
    } else {
        format!("{x:?}")
    }
}

pub(super) fn vector_text(v: DVec3) -> String {
    let [x, y, z] = v.to_array().map(number_text);
    format!("[{x}, {y}, {z}]")
}

pub(super) fn rotation_text(rotation: DMat3) -> String {
    let rows = rotation.transpose();
    let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(vector_text);
    format!("[{}]", rows.join(", "))
}

/// The keys of an implicit surface, as they stand in a file. `string` writes a string.
pub(super) fn text(implicit: &Implicit, string: impl Fn(&str) -> String) -> String {
    let mut s = format!("f = {}\n", string(implicit.text()));
    if !implicit.parameters().is_empty() {
        let all = implicit.parameters().iter();
        let all: Vec<String> = all
            .map(|(name, x)| format!("{} = {}", string(name), number_text(*x)))
            .collect();
        let _ = writeln!(s, "parameters = {{ {} }}", all.join(", "));
    }
    let bounds = match implicit.clip {
        Clip::Box { min, max } => format!(
            "{{ min = {}, max = {} }}",
            vector_text(min),
            vector_text(max)
        ),
        Clip::Ball { radius } => format!("{{ radius = {} }}", number_text(radius)),
    };
    let _ = write!(
        s,
        "level = {}\ncenter = {}\nscale = {}\nrotation = {}\nbounds = {bounds}\nclosed = {}\n",
        number_text(implicit.level),
        vector_text(implicit.center),
        number_text(implicit.scale),
        rotation_text(implicit.rotation),
        implicit.closed
    );
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::array::uniform9;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rotations_read_again_keep_their_bits(
            axis in uniform3(), angle in -7.0..7.0f64, off in uniform9(-SQUARE / 4.0..SQUARE / 4.0),
        ) {
            let turn = DMat3::from_axis_angle(axis, angle);
            prop_assert_eq!(orthonormal(turn), turn);
            let read = orthonormal(turn + DMat3::from_cols_array(&off));
            prop_assert!(is_orthonormal(read), "{}", read);
            prop_assert!(!is_orthonormal(turn * (1.0 + 3.0 * UNIT)));
        }
    }

    fn uniform3() -> impl Strategy<Value = DVec3> {
        [-1.0..1.0f64, -1.0..1.0, -1.0..1.0]
            .prop_map(DVec3::from)
            .prop_filter_map("a direction", DVec3::try_normalize)
    }
}
