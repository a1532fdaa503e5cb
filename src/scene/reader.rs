//! Reads the tables of a scene file key by key, and reports missing, invalid and unknown keys with their place.

use super::format::{Found, Inner, Need, Table};
use super::isosurface::NoVolume;
use super::source::{Faults, Source, quoted, shorten, suggestion};
use super::value::{Text, Value, without_reason};
use super::{Bsdf, MaterialKind, Place, rows, schema};
use crate::implicit::{AxisOrder, Volume};
use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A table of the file that is being read.
pub(super) struct Reader<'a, 't> {
    pub(super) source: &'a Source<'a>,
    pub(super) faults: &'a mut Faults,
    /// How it is written: `[camera]`, `[[sphere]]`.
    what: &'a str,
    /// Where its header stands; none for the file itself.
    header: Option<Range<usize>>,
    pub(super) table: &'a DeTable<'t>,
    /// The keys it may have: those asked for.
    known: Vec<&'static str>,
}

/// Whether an array holds tables alone.
fn are_tables(all: &[Spanned<DeValue>]) -> bool {
    !all.is_empty() && all.iter().all(|v| v.get_ref().is_table())
}

impl Table for Reader<'_, '_> {
    fn find<T: Value>(&mut self, key: &'static str, need: Need<T>, _: &'static str) -> Found<T> {
        self.known.push(key);
        let Some(found) = self.table.get(key) else {
            if matches!(need, Need::Required) {
                let message = format!(
                    "missing key {key} in {}; it must be {}",
                    self.what,
                    without_reason(&T::rule())
                );
                self.faults.push(self.place(), message);
            }
            return Found::Absent;
        };
        match T::read(found) {
            Ok(value) => Found::Value(value),
            Err(wrong) => {
                let index = wrong.index.map_or_else(String::new, |i| format!("[{i}]"));
                let quote = self.source.quote(wrong.span.clone());
                let value = match found.get_ref() {
                    // `key.x = 1` and `[[table.key]]` have no text of their own that could be quoted.
                    DeValue::Table(_) if !quote.starts_with('{') => "a table".into(),
                    DeValue::Array(all) if are_tables(all) && quote.starts_with("[[") => {
                        "an array of tables".into()
                    }
                    _ => quote,
                };
                let at = match (found.get_ref(), wrong.index) {
                    (DeValue::Array(all), Some(i)) => all.get(i).map(Spanned::get_ref),
                    (other, _) => Some(other),
                };
                let rule = match at {
                    Some(DeValue::Integer(_) | DeValue::Float(_)) => T::rule(),
                    _ => without_reason(&T::rule()),
                };
                let message = format!("{key}{index} is {value}; {key} must be {rule}");
                self.faults.push(Some(wrong.span.start), message);
                Found::Wrong
            }
        }
    }

    fn inner<T: Inner>(&mut self, key: &'static str, _: &'static str) -> Found<T> {
        self.known.push(key);
        match self.table.get(key) {
            Some(found) => self.inner_of(key, found),
            None => Found::Absent,
        }
    }

    fn inner_by_name<T: Inner>(
        &mut self,
        key: &'static str,
        _: &'static str,
    ) -> Found<Vec<(String, T)>> {
        self.known.push(key);
        let Some(found) = self.table.get(key) else {
            return Found::Absent;
        };
        let DeValue::Table(all) = found.get_ref() else {
            return self.no_table(key, found);
        };
        if all.is_empty() {
            let message = format!("{key} is empty; it must have a table for each");
            self.refuse(key, message);
            return Found::Wrong;
        }
        let mut tables = Vec::with_capacity(all.len());
        let mut whole = true;
        for (name, value) in all {
            let what = format!("{key}.{}", shorten(name.get_ref()));
            match self.inner_of(&what, value) {
                Found::Value(table) => tables.push((name.get_ref().to_string(), table)),
                Found::Absent | Found::Wrong => whole = false,
            }
        }
        if whole {
            Found::Value(tables)
        } else {
            Found::Wrong
        }
    }

    fn volume(&mut self, name: &str, order: AxisOrder) -> Option<Arc<Volume>> {
        let path = self.source.beside(name);
        match self.source.volume(name, order) {
            Ok(volume) => Some(volume),
            Err(NoVolume::Unreadable(why)) => {
                let place = self.place_of("file");
                let message = format!("cannot read {}: {why}", path.display());
                self.faults.push_unreadable(place, message);
                None
            }
            Err(NoVolume::Wrong(why)) => {
                self.refuse("file", format!("{}: {why}", path.display()));
                None
            }
        }
    }

    fn refuse(&mut self, key: &str, message: String) {
        let place = self.place_of(key);
        self.faults.push(place, message);
    }
}

impl<'a, 't> Reader<'a, 't> {
    pub(super) fn new(
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

    /// The table `found`, which is `name` within this one.
    fn inner_of<T: Inner>(&mut self, name: &str, found: &Spanned<DeValue<'t>>) -> Found<T> {
        let DeValue::Table(table) = found.get_ref() else {
            return self.no_table(name, found);
        };
        let what = format!("{name} of {}", self.what);
        let mut inner = Reader::new(self.source, self.faults, &what, Some(found.span()), table);
        inner.read_all(T::read).map_or(Found::Wrong, Found::Value)
    }

    fn no_table<T>(&mut self, name: &str, found: &Spanned<DeValue>) -> Found<T> {
        let value = self.source.quote(found.span());
        let message = format!("{name} is {value}, but must be a table");
        self.faults.push(Some(found.span().start), message);
        Found::Wrong
    }

    /// The result of `read` for the file of rows `name`, a path relative to the scene file.
    pub(super) fn rows<T>(
        &mut self,
        name: &str,
        read: impl FnOnce(&Path, &str) -> Result<Vec<T>, rows::Wrong>,
    ) -> Option<Vec<T>> {
        let path = self.source.beside(name);
        let text = match self.source.rows() {
            Some(text) => Ok(Cow::Borrowed(text)),
            None => rows::read(&path).map(Cow::Owned),
        };
        match text.and_then(|text| read(&path, &text)) {
            Ok(rows) => {
                let place = self.place_of("file");
                let place = place.map_or(Place::default(), |at| self.source.place(at));
                let count = rows.len();
                self.faults.row_file(path, count, place);
                Some(rows)
            }
            Err(rows::Wrong::Unreadable(why)) => {
                let place = self.place_of("file");
                let message = format!("cannot read {}: {why}", path.display());
                self.faults.push_unreadable(place, message);
                None
            }
            Err(rows::Wrong::Content(errors)) => {
                self.faults.push_elsewhere(errors);
                None
            }
            Err(rows::Wrong::Key(key, message)) => {
                self.refuse(key, message);
                None
            }
        }
    }

    fn place(&self) -> Option<usize> {
        self.header.as_ref().map(|h| h.start)
    }

    /// The place of the value of `key`, or of the table if it has no such key.
    fn place_of(&self, key: &str) -> Option<usize> {
        match self.table.get(key) {
            Some(value) => Some(value.span().start),
            None => self.place(),
        }
    }

    /// Whether `key` is there, but no array of tables.
    pub(super) fn is_wrong(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(|v| !v.get_ref().is_array())
    }

    /// The result of `read`, and errors for all keys that it did not read.
    pub(super) fn read_all<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let value = read(self);
        self.refuse_unknown_keys();
        value
    }

    /// The one table `key`, written `what`, if it is there.
    pub(super) fn table(
        &mut self,
        key: &'static str,
        what: &'static str,
    ) -> Option<Reader<'_, 't>> {
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
                let message = format!("{key} is {found}, but must be a single table {what}");
                self.faults.push(Some(value.span().start), message);
                None
            }
        }
    }

    /// What `read` makes of each of the tables `[[key]]` and its place, in file order; none where
    /// something was wrong.
    pub(super) fn each<T>(
        &mut self,
        key: &'static str,
        mut read: impl FnMut(&mut Reader<'_, 't>, Place) -> Option<T>,
    ) -> Vec<Option<T>> {
        self.known.push(key);
        let Some(value) = self.table.get(key) else {
            return Vec::new();
        };
        let what = format!("[[{key}]]");
        let DeValue::Array(items) = value.get_ref() else {
            let message = format!("{key} must be an array of tables; write {what} for each one");
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
            let place = self.source.table_place(at);
            let header = Some(item.span());
            let mut t = Reader::new(self.source, self.faults, &what, header, table);
            values.push(t.read_all(|t| read(t, place)));
        }
        values
    }

    /// This table as a `[material.NAME]`.
    pub(super) fn material(mut self) -> Option<Bsdf> {
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
        self.read_all(|t| kind.read(t))
    }

    pub(super) fn refuse_unknown_keys(&mut self) {
        for (key, value) in self.table {
            let word = key.get_ref().as_ref();
            if self.known.contains(&word) {
                continue;
            }
            let meant = self.meant(word, value.get_ref());
            let message = format!(
                "unknown key {} in {}; allowed: {}{}{}{meant}",
                quoted(word),
                self.what,
                self.known.join(", "),
                suggestion(word, self.known.iter().copied()),
                self.owners(word)
            );
            self.faults.push(Some(key.span().start), message);
        }
    }

    /// What is written otherwise than by a key of this name here, if that is known.
    fn meant(&self, word: &str, value: &DeValue) -> String {
        /// What other formats have, and programs for drawing.
        const SHAPES: [&str; 12] = [
            "box",
            "cube",
            "mesh",
            "triangle",
            "triangles",
            "quad",
            "rectangle",
            "rect",
            "torus",
            "cone",
            "ellipsoid",
            "model",
        ];
        /// Flags of `etendue render` that are no keys of `[render]`.
        const FLAGS: [(&str, &str); 9] = [
            ("spp", "--spp"),
            ("samples", "--spp"),
            ("rays", "--rays"),
            ("time", "--time"),
            ("error", "--error"),
            ("integrator", "--integrator"),
            ("shadow_rays", "--shadow-rays"),
            ("exposure", "--exposure"),
            ("adaptive", "--adaptive"),
        ];
        let in_scene = self.known.contains(&"camera");
        let has_type = |table: &DeTable| table.contains_key("type");
        if word == "title" {
            "; a title stands at the top of the file, before the first [table]".into()
        } else if in_scene && value.as_table().is_some_and(has_type) {
            let name = shorten(word);
            format!("; a material is written [material.{name}]")
        } else if in_scene && SHAPES.contains(&word) {
            "; there are spheres, planes, disks, cylinders, isosurfaces and implicit surfaces, among which are boxes, tori and cones; no meshes".into()
        } else if let ("[render]", Some((_, flag))) =
            (self.what, FLAGS.iter().find(|(name, _)| *name == word))
        {
            format!("; that is the flag {flag} of etendue render")
        } else if self.what == "[[light]]" && word == "type" {
            "; every light is a disk that shines on one side; a small radius makes it nearly a point".into()
        } else {
            String::new()
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
        let [first @ .., last] = &owners[..] else {
            return String::new();
        };
        let first = first.join(", ");
        let and = if first.is_empty() { "" } else { " and " };
        format!("; it belongs to {first}{and}{last}")
    }
}
