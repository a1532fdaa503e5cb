//! JSON Schema of scene files, for completion, hover texts and error checking in editors.

use super::format::{self, Found, Inner, Need, ShapeKind, Table};
use super::rows::RowKind;
use super::value::{Text, Value};
use super::{MaterialKind, Place};
use crate::implicit::{AxisOrder, Volume};
use serde_json::{Map, Value as Json, json};
use std::sync::Arc;

/// The description of `title`.
pub(super) const TITLE: &str = "Title of the picture.";

/// The schema, draft 7, which TOML editors (Even Better TOML, taplo) understand.
///
/// It covers rules about single keys. Only [`parse`](super::parse) checks rules between keys (a camera looking along `up`,
/// diffuse + specular above 1, names of materials).
pub fn schema() -> Json {
    let mut properties = Map::new();
    let mut title = Text::schema();
    title["description"] = json!(TITLE);
    properties.insert("title".into(), title);
    let camera = describe("The pinhole camera.", format::camera);
    properties.insert("camera".into(), camera);
    let about = "Render settings. Command-line flags override them.";
    let render = describe(about, format::render);
    properties.insert("render".into(), render);
    properties.insert(
        "material".into(),
        json!({
            "description": "Materials by name: [material.NAME].",
            "type": "object",
            "additionalProperties": {"oneOf": MaterialKind::ALL.map(material)},
        }),
    );
    for kind in ShapeKind::ALL {
        let table = describe(kind.about(), |t| format::primitive(t, kind));
        properties.insert(kind.name().into(), json!({"type": "array", "items": table}));
    }
    for (kind, about) in [
        (RowKind::Sphere, "Spheres from a CSV or XYZ file."),
        (RowKind::Cylinder, "Cylinders from a CSV file."),
    ] {
        let table = describe(about, |t| format::surfaces(t, kind));
        properties.insert(
            kind.table().into(),
            json!({"type": "array", "items": table}),
        );
    }
    let about = "Lights from a CSV file.";
    let table = describe(about, format::lights);
    properties.insert("lights".into(), json!({"type": "array", "items": table}));
    let about = "A disk light. It reflects nothing.";
    let light = describe(about, |t| format::light(t, Place::default()));
    properties.insert(
        "light".into(),
        json!({"type": "array", "items": light, "minItems": 1}),
    );

    let some = |name: &str| json!({"required": [name], "properties": {name: {"minItems": 1}}});
    let mut some_primitive: Vec<Json> = ShapeKind::ALL.map(|kind| some(kind.name())).into();
    some_primitive.extend([some("spheres"), some("cylinders")]);
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "etendue scene",
        "description": "A scene for the path tracer etendue. All lengths have the same arbitrary unit, \
                        angles are in degrees, colours and radiances are linear RGB (Rec. 709).",
        "type": "object",
        "properties": properties,
        "required": ["camera"],
        "allOf": [
            {"anyOf": some_primitive},
            {"anyOf": [some("light"), some("lights")]},
        ],
        "additionalProperties": false,
    })
}

/// The keys of a material of `kind` besides `type`.
pub(super) fn material_keys(kind: MaterialKind) -> Vec<String> {
    let mut description = Description::default();
    kind.read(&mut description);
    description.properties.into_iter().map(|p| p.0).collect()
}

fn material(kind: MaterialKind) -> Json {
    let mut table = describe(kind.about(), |t| kind.read(t));
    table["title"] = json!(kind.name());
    table["properties"]["type"] = json!({"const": kind.name(), "description": kind.about()});
    if let Some(required) = table["required"].as_array_mut() {
        required.push(json!("type"));
    }
    table
}

/// The table that `read` reads, as a schema.
fn describe<T>(about: &str, read: impl FnOnce(&mut Description) -> T) -> Json {
    let mut description = Description::default();
    read(&mut description);
    json!({
        "description": about,
        "type": "object",
        "properties": description.properties,
        "required": description.required,
        "additionalProperties": false,
    })
}

/// Writes down the keys that are asked for, and has none of them.
#[derive(Default)]
struct Description {
    properties: Map<String, Json>,
    required: Vec<&'static str>,
}

impl Table for Description {
    fn find<T: Value>(
        &mut self,
        key: &'static str,
        need: Need<T>,
        about: &'static str,
    ) -> Found<T> {
        let mut schema = T::schema();
        schema["description"] = json!(about);
        match need {
            Need::Required => self.required.push(key),
            Need::Optional(Some(default)) => schema["default"] = default.to_json(),
            Need::Optional(None) => {}
        }
        self.properties.insert(key.into(), schema);
        Found::Absent
    }

    fn inner<T: Inner>(&mut self, key: &'static str, about: &'static str) -> Found<T> {
        self.properties.insert(key.into(), describe(about, T::read));
        Found::Absent
    }

    fn inner_by_name<T: Inner>(
        &mut self,
        key: &'static str,
        about: &'static str,
    ) -> Found<Vec<(String, T)>> {
        let each = describe(T::ABOUT, T::read);
        let all = json!({"description": about, "type": "object", "additionalProperties": each, "minProperties": 1});
        self.properties.insert(key.into(), all);
        Found::Absent
    }

    fn volume(&mut self, _: &str, _: AxisOrder) -> Option<Arc<Volume>> {
        None
    }

    fn refuse(&mut self, _: &str, _: String) {}
}
