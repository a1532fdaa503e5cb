//! Reads scene files: TOML with spans, then [`format`]'s rules, then what holds
//! between tables. Every independent error is reported, with its place.

use super::format::{self, ShapeKind, Table};
use super::reader::Reader;
use super::rows::{Palette, RowKind};
use super::source::{Faults, Source, one_line, quoted, suggestion};
use super::value::Text;
use super::{
    Bsdf, Diagnostic, Light, Material, Place, Primitive, RenderHints, RowFile, Scene, Shape,
};
use super::{rows, schema, syntax};
use crate::files::kind::FileKind;
use crate::files::reason;
use crate::implicit::Volume;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

/// The largest scene file that is read, in bytes; that is half a million spheres or more.
pub const MAX_FILE_BYTES: u64 = 64 << 20;

/// The most formulas of a scene.
pub const MAX_FORMULAS: usize = 64;

/// The most isosurfaces of a scene: each takes two of the 16 textures that every device allows.
pub const MAX_VOLUMES: usize = 8;

/// Why a scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is missing, a directory, or can't be read.
    #[error("{}: cannot read: {}", one_line(&path.display().to_string()), reason(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The content is wrong; never empty.
    #[error("{}", one_a_line(.0))]
    Invalid(Vec<Diagnostic>),
}

pub(super) fn one_a_line(diagnostics: &[Diagnostic]) -> String {
    let lines: Vec<String> = diagnostics.iter().map(Diagnostic::to_string).collect();
    lines.join("\n")
}

/// The scene in the file at `path`, of at most [`MAX_FILE_BYTES`].
pub fn read(path: &Path) -> Result<Scene, ReadError> {
    let text = read_text(path)?;
    parse_str(path, &text).map_err(ReadError::Invalid)
}

/// The text of the file at `path`, of at most [`MAX_FILE_BYTES`], for [`parse_str`].
pub fn read_text(path: &Path) -> Result<String, ReadError> {
    let io = |source| ReadError::Io {
        path: path.to_owned(),
        source,
    };
    let invalid = |message| {
        let whole_file = Source::new(path, "").diagnostic(None, message);
        ReadError::Invalid(vec![whole_file])
    };

    let file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(io(io::ErrorKind::IsADirectory.into()));
    }
    // The size is checked before reading, and again by reading no more than that: devices and
    // pipes have no size.
    let mut bytes = Vec::new();
    if metadata.len() <= MAX_FILE_BYTES {
        let mut some = file.take(MAX_FILE_BYTES + 1);
        some.read_to_end(&mut bytes).map_err(io)?;
    }
    let length = metadata.len().max(bytes.len() as u64);
    if length > MAX_FILE_BYTES {
        let limit = MAX_FILE_BYTES >> 20;
        return Err(invalid(format!(
            "the file has {length} bytes or more; a scene file has at most {limit} MiB"
        )));
    }

    if let Some(kind) = FileKind::of_no_text(&bytes) {
        return Err(invalid(format!("not a scene ({kind})")));
    }
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) if is_binary(error.as_bytes()) => {
            Err(invalid("not a scene (binary data)".into()))
        }
        Err(error) => {
            let (good, bad) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
            let good = String::from_utf8_lossy(good);
            let message = format!(
                "byte 0x{:02x} is not valid UTF-8; a scene file is UTF-8 text",
                bad.first().copied().unwrap_or_default()
            );
            let good = good.strip_prefix('\u{feff}').unwrap_or(&good);
            let place = Source::new(path, good).diagnostic(Some(good.len()), message);
            Err(ReadError::Invalid(vec![place]))
        }
    }
}

/// Whether bytes that are not UTF-8 are no text of another encoding either, by git's rule: there is a NUL among the first 8000.
/// UTF-16, which its first two bytes tell, has them too.
fn is_binary(bytes: &[u8]) -> bool {
    let is_utf16 = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
    !is_utf16 && bytes.iter().take(8000).any(|b| *b == 0)
}

/// The scene in `text`; `path` names it in messages. There is at least one message in an error.
pub fn parse_str(path: &Path, text: &str) -> Result<Scene, Vec<Diagnostic>> {
    parse(Source::new(
        path,
        text.strip_prefix('\u{feff}').unwrap_or(text),
    ))
}

/// The same where the one file of rows that `text` names is in memory too.
pub(super) fn parse_with_rows(
    path: &Path,
    text: &str,
    rows: Option<&str>,
) -> Result<Scene, Vec<Diagnostic>> {
    parse(Source::new(path, text).with_rows(rows))
}

/// The same with volumes that are in memory, by the names that `text` has for them.
pub(super) fn parse_with_volumes(
    text: &str,
    volumes: &[(String, Arc<Volume>)],
) -> Result<Scene, Vec<Diagnostic>> {
    parse(Source::new(Path::new(""), text).with_volumes(volumes))
}

fn parse(source: Source) -> Result<Scene, Vec<Diagnostic>> {
    let mut faults = Faults::new();
    let scene =
        syntax::tables(&source, &mut faults).and_then(|root| scene(&source, &root, &mut faults));
    match scene {
        Some(scene) if faults.is_empty() => Ok(scene),
        _ => Err(faults.into_diagnostics(&source)),
    }
}

/// The whole scene; none when anything is wrong, which has been reported.
fn scene(source: &Source, root: &DeTable, faults: &mut Faults) -> Option<Scene> {
    if root.is_empty() {
        let message = "is empty; a scene needs [camera], a [[light]], and a \
                       [[sphere]], [[plane]], [[disk]], [[cylinder]], [[implicit]] or [[isosurface]]";
        faults.push(None, message.into());
        return None;
    }
    let mut file = Reader::new(source, faults, "the scene", None, root);

    let title = file.optional::<Text>("title", None, schema::TITLE);
    let camera = match file.table("camera", "[camera]") {
        Some(mut t) => t.read_all(format::camera),
        None => {
            if !root.contains_key("camera") {
                file.faults
                    .push(None, "no [camera]; a scene needs one".into());
            }
            None
        }
    };
    let render = match file.table("render", "[render]") {
        Some(mut t) => t.read_all(|t| Some(format::render(t))),
        None => Some(RenderHints::default()),
    };
    let materials = materials(&mut file);
    let mut palette = Palette::new(materials.len());
    let primitives = primitives(&mut file, &materials, &mut palette);
    let mut lights: Vec<Option<Light>> = file.each("light", |t, place| format::light(t, place));
    for more in file.each("lights", |t, place| {
        let name = format::lights(t)?;
        t.rows(&name, |path, text| rows::lights(path, text, place))
    }) {
        match more {
            Some(more) => lights.extend(more.into_iter().map(Some)),
            None => lights.push(None),
        }
    }
    if lights.is_empty() && !file.is_wrong("light") {
        let empty = file.faults.empty_row_files();
        let message = format!("no [[light]]; a scene needs at least one{empty}");
        file.faults.push(None, message);
    }
    file.refuse_unknown_keys();

    let complete = |m: Named| {
        let Named { name, bsdf, place } = m;
        let bsdf = bsdf?;
        Some(Material { name, bsdf, place })
    };
    let named = materials.into_iter().map(complete);
    let colors = palette.colors.into_iter().map(|reflectance| {
        Some(Material {
            name: format!("rgb {} {} {}", reflectance.x, reflectance.y, reflectance.z),
            bsdf: Bsdf::Diffuse { reflectance },
            place: Place::default(),
        })
    });
    let materials: Option<Vec<Material>> = named.chain(colors).collect();
    let mut row_files = file.faults.take_row_files();
    row_files.extend(volumes(source, root));
    Some(Scene {
        path: source.path().to_owned(),
        row_files,
        title: title.map(|t| t.0),
        camera: camera?,
        render: render?,
        materials: materials?,
        primitives: primitives.into_iter().collect::<Option<_>>()?,
        lights: lights.into_iter().collect::<Option<_>>()?,
    })
}

/// The volumes that the scene names.
fn volumes(source: &Source, root: &DeTable) -> impl Iterator<Item = RowFile> {
    let all = root.get("isosurface").and_then(|v| v.get_ref().as_array());
    let tables = all.into_iter().flatten();
    let names = tables.filter_map(|t| t.get_ref().as_table()?.get("file"));
    names.filter_map(|name| {
        Some(RowFile {
            path: source.beside(name.get_ref().as_str()?),
            rows: 1,
            place: source.place(name.span().start),
        })
    })
}

/// A material as far as it is known.
struct Named {
    name: String,
    /// None when it is wrong.
    bsdf: Option<Bsdf>,
    place: Place,
}

/// All materials in the order of their names.
fn materials(file: &mut Reader) -> Vec<Named> {
    let Some(all) = file.table("material", "[material.NAME]") else {
        return Vec::new();
    };
    let mut materials = Vec::new();
    for (name, value) in all.table {
        let what = format!("[material.{}]", source_name(name.get_ref()));
        let bsdf = match value.get_ref() {
            DeValue::Table(table) => {
                Reader::new(all.source, all.faults, &what, Some(value.span()), table).material()
            }
            _ => {
                let found = all.source.quote(value.span());
                let message = format!("{what} is {found}, but must be a table");
                all.faults.push(Some(value.span().start), message);
                None
            }
        };
        materials.push(Named {
            name: name.get_ref().to_string(),
            bsdf,
            place: all.source.table_place(value.span().start),
        });
    }
    materials.sort_by(|a, b| a.name.cmp(&b.name));
    materials
}

/// A key as written in a file: without quotes if possible.
fn source_name(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        super::source::shorten(name)
    } else {
        quoted(name)
    }
}

/// The primitives in the order of [`Scene::primitives`].
fn primitives(
    file: &mut Reader,
    materials: &[Named],
    palette: &mut Palette,
) -> Vec<Option<Primitive>> {
    let mut primitives = Vec::new();
    let misnamed = materials.is_empty() && file.table.contains_key("materials");
    for kind in ShapeKind::ALL {
        primitives.extend(file.each(kind.name(), |t, place| {
            let (shape, name) = format::primitive(t, kind)?;
            let material = match find(&name, materials) {
                Ok(material) => material,
                // That there are none is one error, of the table that has another name.
                Err(_) if misnamed => return None,
                Err(message) => {
                    t.refuse("material", message);
                    return None;
                }
            };
            let not_solid = match &shape {
                Shape::Disk { .. } => Some("a disk"),
                Shape::Implicit(implicit) if !implicit.closed => Some("an open surface"),
                _ => None,
            };
            if let Some(what) =
                not_solid.filter(|_| materials[material].bsdf.is_some_and(|b| b.is_dielectric()))
            {
                let message = format!(
                    "material {} is dielectric, but {what} is not solid; \
                     dielectrics are allowed on spheres, cylinders, planes and closed implicit surfaces and isosurfaces",
                    quoted(&name)
                );
                t.refuse("material", message);
                return None;
            }
            Some(Primitive {
                shape,
                material,
                line: place.line,
                column: place.column,
            })
        }));
        let rows = match kind {
            ShapeKind::Sphere => RowKind::Sphere,
            ShapeKind::Cylinder => RowKind::Cylinder,
            ShapeKind::Plane | ShapeKind::Disk | ShapeKind::Implicit | ShapeKind::Isosurface => {
                continue;
            }
        };
        for more in file.each(rows.table(), |t, place| {
            surfaces(t, place, rows, materials, palette)
        }) {
            match more {
                Some(more) => primitives.extend(more.into_iter().map(Some)),
                None => primitives.push(None),
            }
        }
    }
    let mut at_most = |kind: ShapeKind, most: usize, why: &str| {
        let name = kind.name();
        let all = file.table.get(name).and_then(|v| v.get_ref().as_array());
        if let Some(beyond) = all.and_then(|all| all.get(most)) {
            let message = format!("more than {most} [[{name}]]; {why}");
            file.faults.push(Some(beyond.span().start), message);
        }
    };
    at_most(
        ShapeKind::Implicit,
        MAX_FORMULAS,
        "each becomes code of its own, so a scene has at most so many. One formula may describe several solids: min(f, g)",
    );
    at_most(
        ShapeKind::Isosurface,
        MAX_VOLUMES,
        "each is a texture of its own, of which devices allow so many",
    );
    let wrong = ShapeKind::ALL.iter().any(|kind| file.is_wrong(kind.name()));
    if primitives.is_empty() && !wrong {
        let empty = file.faults.empty_row_files();
        let message = format!(
            "no primitive; a scene needs at least one [[sphere]], [[plane]], [[disk]], [[cylinder]], [[implicit]] or [[isosurface]]{empty}"
        );
        file.faults.push(None, message);
    }
    primitives
}

/// The index of the material with this name; an error lists the names that exist.
fn find(name: &str, materials: &[Named]) -> Result<usize, String> {
    let found = materials.binary_search_by(|m| m.name.as_str().cmp(name));
    found.map_err(|_| unknown_material(name, materials))
}

fn unknown_material(name: &str, materials: &[Named]) -> String {
    /// More names would hide the message.
    const LISTED: usize = 12;
    let names = || materials.iter().map(|m| m.name.as_str());
    let mut defined: Vec<String> = names().take(LISTED).map(source_name).collect();
    if materials.len() > LISTED {
        defined.push(format!("and {} more", materials.len() - LISTED));
    }
    let defined = if defined.is_empty() {
        "none; write a [material.NAME] table".into()
    } else {
        defined.join(", ")
    };
    format!(
        "unknown material {}; defined here: {defined}{}",
        quoted(name),
        suggestion(name, names())
    )
}

/// The surfaces of a `[[spheres]]` or `[[cylinders]]`.
fn surfaces(
    t: &mut Reader,
    place: Place,
    kind: RowKind,
    materials: &[Named],
    palette: &mut Palette,
) -> Option<Vec<Primitive>> {
    let (name, keys) = format::surfaces(t, kind)?;
    let find = |name: &str| find(name, materials);
    t.rows(&name, |path, text| {
        rows::surfaces(path, text, place, kind, &keys, find, palette)
    })
}
