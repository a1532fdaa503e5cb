//! Reads scene files: TOML with spans, then [`format`](super::format)'s rules, then what holds
//! between tables. Every independent error is reported, with its place.

use super::format::{self, Found, MaterialKind, Need, ShapeKind, Table};
use super::rows;
use super::schema;
use super::source::{Faults, Source, quoted, suggestion};
use super::value::{Text, Value};
use super::{Bsdf, Diagnostic, Light, Material, Primitive, RenderHints, Scene};
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The largest scene file that is read, in bytes; that is half a million spheres or more.
pub const MAX_FILE_BYTES: u64 = 64 << 20;

/// Texts up to this many bytes have all their syntax errors reported, longer ones the first: a
/// large file of something else can have one error a byte.
const MAX_RECOVERED_BYTES: usize = 1 << 16;

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is missing, a directory, or can't be read.
    #[error("{}: {source}", path.display())]
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

fn one_a_line(diagnostics: &[Diagnostic]) -> String {
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
            "is {length} bytes long or longer; a scene file has at most {limit} MiB"
        )));
    }

    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) => {
            let (good, bad) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
            let good = String::from_utf8_lossy(good);
            let message = format!(
                "byte 0x{:02x} is not UTF-8, but a scene file is UTF-8 text",
                bad.first().copied().unwrap_or_default()
            );
            let good = good.strip_prefix('\u{feff}').unwrap_or(&good);
            let place = Source::new(path, good).diagnostic(Some(good.len()), message);
            Err(ReadError::Invalid(vec![place]))
        }
    }
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

fn parse(source: Source) -> Result<Scene, Vec<Diagnostic>> {
    let mut faults = Faults::new();
    let scene = syntax(&source, &mut faults).and_then(|root| scene(&source, &root, &mut faults));
    match scene {
        Some(scene) if faults.is_empty() => Ok(scene),
        _ => Err(faults.into_diagnostics(&source)),
    }
}

/// The file as tables; none when it is no TOML.
fn syntax<'a>(source: &Source<'a>, faults: &mut Faults) -> Option<DeTable<'a>> {
    let text = source.text();
    if let Some(at) = text.find('\0') {
        let message = "a NUL character, but a scene file is TOML text".into();
        faults.push(Some(at), message);
        return None;
    }
    let (root, errors) = if text.len() <= MAX_RECOVERED_BYTES {
        DeTable::parse_recoverable(text)
    } else {
        match DeTable::parse(text) {
            Ok(root) => (root, Vec::new()),
            Err(error) => (Spanned::new(0..0, DeTable::new()), vec![error]),
        }
    };
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        let found = source.quote(span.clone());
        let message = match error.message() {
            "duplicate key" => format!(
                "duplicate {}: a key or [table] stands once; only [[tables]] repeat",
                quoted(&found)
            ),
            message if found.is_empty() => format!("not TOML: {message}"),
            message => format!("not TOML: {message}; found `{found}`"),
        };
        faults.push(Some(span.start), message);
    }
    errors.is_empty().then(|| root.into_inner())
}

/// The whole scene; none when anything is wrong, which has been reported.
fn scene(source: &Source, root: &DeTable, faults: &mut Faults) -> Option<Scene> {
    if root.is_empty() {
        let message = "is empty; a scene has [camera], a [[light]], and a \
                       [[sphere]], [[plane]], [[disk]] or [[cylinder]]";
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
                    .push(None, "no [camera]: a scene has one".into());
            }
            None
        }
    };
    let render = match file.table("render", "[render]") {
        Some(mut t) => t.read_all(|t| Some(format::render(t))),
        None => Some(RenderHints::default()),
    };
    let materials = materials(&mut file);
    let primitives = primitives(&mut file, &materials);
    let mut lights: Vec<Option<Light>> = file.each("light", |t, line| format::light(t, line));
    for more in file.each("lights", |t, line| {
        let name = format::lights(t)?;
        t.rows(&name, |path, text| rows::lights(path, text, line))
    }) {
        match more {
            Some(more) => lights.extend(more.into_iter().map(Some)),
            None => lights.push(None),
        }
    }
    if lights.is_empty() && !file.is_wrong("light") {
        file.faults.push(
            None,
            "no [[light]]: a scene has at least one, or it is black".into(),
        );
    }
    file.refuse_unknown_keys();

    let materials: Option<Vec<Material>> = materials
        .into_iter()
        .map(|(name, bsdf)| Some(Material { name, bsdf: bsdf? }))
        .collect();
    Some(Scene {
        path: source.path().to_owned(),
        title: title.map(|t| t.0),
        camera: camera?,
        render: render?,
        materials: materials?,
        primitives: primitives.into_iter().collect::<Option<_>>()?,
        lights: lights.into_iter().collect::<Option<_>>()?,
    })
}

/// All names, in order, and what was wrong with none of them.
fn materials(file: &mut Reader) -> Vec<(String, Option<Bsdf>)> {
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
        materials.push((name.get_ref().to_string(), bsdf));
    }
    materials.sort_by(|a, b| a.0.cmp(&b.0));
    materials
}

/// A key as it stands in a file: bare where it can be.
fn source_name(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        super::source::shorten(name)
    } else {
        quoted(name)
    }
}

/// The primitives in the order of [`Scene::primitives`].
fn primitives(file: &mut Reader, materials: &[(String, Option<Bsdf>)]) -> Vec<Option<Primitive>> {
    let mut primitives = Vec::new();
    for kind in ShapeKind::ALL {
        primitives.extend(file.each(kind.name(), |t, line| {
            let (shape, name) = format::primitive(t, kind)?;
            let found = materials.binary_search_by(|m| m.0.as_str().cmp(&name));
            let Ok(material) = found else {
                t.refuse("material", unknown_material(&name, materials));
                return None;
            };
            if kind == ShapeKind::Disk
                && matches!(materials[material].1, Some(Bsdf::Dielectric { .. }))
            {
                let message = format!(
                    "material {} is dielectric, but a disk bounds no solid; \
                     dielectrics may be on spheres, cylinders and planes",
                    quoted(&name)
                );
                t.refuse("material", message);
                return None;
            }
            Some(Primitive {
                shape,
                material,
                line,
            })
        }));
        if kind == ShapeKind::Sphere {
            for more in file.each("spheres", |t, line| spheres(t, line, materials)) {
                match more {
                    Some(more) => primitives.extend(more.into_iter().map(Some)),
                    None => primitives.push(None),
                }
            }
        }
    }
    let wrong = ShapeKind::ALL.iter().any(|kind| file.is_wrong(kind.name()));
    if primitives.is_empty() && !wrong {
        let message = "no primitive: a scene has at least one \
                       [[sphere]], [[plane]], [[disk]] or [[cylinder]]";
        file.faults.push(None, message.into());
    }
    primitives
}

fn unknown_material(name: &str, materials: &[(String, Option<Bsdf>)]) -> String {
    /// More names would hide the message.
    const LISTED: usize = 12;
    let names = || materials.iter().map(|m| m.0.as_str());
    let mut defined: Vec<String> = names().take(LISTED).map(super::source::shorten).collect();
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

/// The spheres of a `[[spheres]]`.
fn spheres(
    t: &mut Reader,
    line: usize,
    materials: &[(String, Option<Bsdf>)],
) -> Option<Vec<Primitive>> {
    let (name, material) = format::spheres(t)?;
    let find = |name: &str| {
        let found = materials.binary_search_by(|m| m.0.as_str().cmp(name));
        found.map_err(|_| unknown_material(name, materials))
    };
    let common = match material.as_deref().map(find) {
        Some(Err(message)) => {
            t.refuse("material", message);
            return None;
        }
        Some(Ok(material)) => Some(material),
        None => None,
    };
    t.rows(&name, |path, text| {
        rows::spheres(path, text, line, common, find)
    })
}

/// A table of the file that is being read.
struct Reader<'a, 't> {
    source: &'a Source<'a>,
    faults: &'a mut Faults,
    /// How it is written: `[camera]`, `[[sphere]]`.
    what: &'a str,
    /// Where its header stands; none for the file itself.
    header: Option<Range<usize>>,
    table: &'a DeTable<'t>,
    /// The keys it may have: those asked for.
    known: Vec<&'static str>,
}

impl Table for Reader<'_, '_> {
    fn find<T: Value>(&mut self, key: &'static str, need: Need<T>, _: &'static str) -> Found<T> {
        self.known.push(key);
        let Some(found) = self.table.get(key) else {
            if matches!(need, Need::Required) {
                let message = format!("{} lacks {key}, which must be {}", self.what, T::rule());
                self.faults.push(self.place(), message);
            }
            return Found::Absent;
        };
        match T::read(found) {
            Ok(value) => Found::Value(value),
            Err(wrong) => {
                let index = wrong.index.map_or_else(String::new, |i| format!("[{i}]"));
                let value = self.source.quote(wrong.span.clone());
                let message = format!("{key}{index} is {value}; {key} must be {}", T::rule());
                self.faults.push(Some(wrong.span.start), message);
                Found::Wrong
            }
        }
    }

    fn refuse(&mut self, key: &str, message: String) {
        let place = match self.table.get(key) {
            Some(value) => Some(value.span().start),
            None => self.place(),
        };
        self.faults.push(place, message);
    }
}

impl<'a, 't> Reader<'a, 't> {
    fn new(
        source: &'a Source<'a>,
        faults: &'a mut Faults,
        what: &'a str,
        header: Option<Range<usize>>,
        table: &'a DeTable<'t>,
    ) -> Self {
        Self {
            source,
            faults,
            what,
            header,
            table,
            known: Vec::new(),
        }
    }

    /// What `read` makes of the file of rows `name`, which lies beside the scene file or where `name` leads from there.
    fn rows<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&Path, &str) -> Result<Vec<T>, rows::Wrong>,
    ) -> Option<Vec<T>> {
        let path = self
            .source
            .path()
            .parent()
            .unwrap_or(Path::new(""))
            .join(name);
        let text = match self.source.rows() {
            Some(text) => Ok(Cow::Borrowed(text)),
            None => rows::read(&path).map(Cow::Owned),
        };
        match text.and_then(|text| read(&path, &text)) {
            Ok(rows) => Some(rows),
            Err(rows::Wrong::File(message)) => {
                self.refuse("file", format!("cannot read {}: {message}", path.display()));
                None
            }
            Err(rows::Wrong::Content(errors)) => {
                self.faults.push_elsewhere(errors);
                None
            }
        }
    }

    fn place(&self) -> Option<usize> {
        self.header.as_ref().map(|h| h.start)
    }

    /// Whether `key` is there, but no array of tables.
    fn is_wrong(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|v| !v.get_ref().is_array())
    }

    /// What `read` finds, and errors for all that it did not ask for.
    fn read_all<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let value = read(self);
        self.refuse_unknown_keys();
        value
    }

    /// The one table `key`, written `what`, if it is there.
    fn table(&mut self, key: &'static str, what: &'static str) -> Option<Reader<'_, 't>> {
        self.known.push(key);
        let value = self.table.get(key)?;
        match value.get_ref() {
            DeValue::Table(table) => Some(Reader::new(
                self.source,
                self.faults,
                what,
                Some(value.span()),
                table,
            )),
            _ => {
                let found = self.source.quote(value.span());
                let message = format!("{key} is {found}, but must be one table, {what}");
                self.faults.push(Some(value.span().start), message);
                None
            }
        }
    }

    /// What `read` makes of each of the tables `[[key]]` and its line, in file order; none where
    /// something was wrong.
    fn each<T>(
        &mut self,
        key: &'static str,
        mut read: impl FnMut(&mut Reader<'_, 't>, usize) -> Option<T>,
    ) -> Vec<Option<T>> {
        self.known.push(key);
        let Some(value) = self.table.get(key) else {
            return Vec::new();
        };
        let what = format!("[[{key}]]");
        let DeValue::Array(items) = value.get_ref() else {
            let message = format!("{key} must be an array of tables: write {what} for each");
            self.faults.push(Some(value.span().start), message);
            return Vec::new();
        };
        let mut values = Vec::with_capacity(items.len());
        for item in items.iter() {
            let at = item.span().start;
            let DeValue::Table(table) = item.get_ref() else {
                let found = self.source.quote(item.span());
                let message = format!("{what} is {found}, but must be a table");
                self.faults.push(Some(at), message);
                values.push(None);
                continue;
            };
            let line = self.source.line(at);
            let header = Some(item.span());
            let mut t = Reader::new(self.source, self.faults, &what, header, table);
            values.push(t.read_all(|t| read(t, line)));
        }
        values
    }

    /// This table as a `[material.NAME]`.
    fn material(mut self) -> Option<Bsdf> {
        let name = self.required::<Text>("type", "")?.0;
        let names = || MaterialKind::ALL.iter().map(|k| k.name());
        let Some(&kind) = MaterialKind::ALL.iter().find(|k| k.name() == name) else {
            let message = format!(
                "unknown material type {}; allowed: {}{}",
                quoted(&name),
                names().collect::<Vec<_>>().join(", "),
                suggestion(&name, names())
            );
            self.refuse("type", message);
            return None;
        };
        self.read_all(|t| format::material(t, kind))
    }

    fn refuse_unknown_keys(&mut self) {
        for key in self
            .table
            .keys()
            .filter(|k| !self.known.contains(&k.get_ref().as_ref()))
        {
            let word = key.get_ref().as_ref();
            let message = format!(
                "unknown key {} in {}; allowed: {}{}{}",
                quoted(word),
                self.what,
                self.known.join(", "),
                suggestion(word, self.known.iter().copied()),
                self.owners(word)
            );
            self.faults.push(Some(key.span().start), message);
        }
    }

    /// Which material types have `key`, when this is a material of another.
    fn owners(&self, key: &str) -> String {
        if !self.known.contains(&"type") {
            return String::new();
        }
        let owners: Vec<&str> = MaterialKind::ALL
            .into_iter()
            .filter(|&kind| schema::material_keys(kind).iter().any(|k| k == key))
            .map(MaterialKind::name)
            .collect();
        if owners.is_empty() {
            return String::new();
        }
        format!("; it belongs to {}", owners.join(" and "))
    }
}
