//! Places in the text of a scene file: converts byte offsets to lines, columns and short quotes.

use super::isosurface::{self, NoVolume};
use super::{Diagnostic, Place, RowFile};
use crate::implicit::{AxisOrder, Volume};
use std::cell::RefCell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The most errors reported for one file; the rest are counted.
const MAX_ERRORS: usize = 50;
/// The most characters of the file quoted in a message.
const MAX_QUOTE: usize = 40;

/// A volume by the name of its file, and the order of axes in which it was read. What was in memory before stands for any.
type Known = (String, Option<AxisOrder>, Arc<Volume>);

/// The text of a file.
pub(super) struct Source<'a> {
    path: &'a Path,
    text: &'a str,
    /// Byte offset of the start of every line.
    lines: Vec<usize>,
    /// The text of the CSV file that the scene names, if it is in memory.
    rows: Option<&'a str>,
    /// Volumes that are in memory, by the names of their files: those that were there before, and those that have been read.
    volumes: RefCell<Vec<Known>>,
}

impl<'a> Source<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Self {
        let starts = text.bytes().enumerate().filter(|&(_, b)| b == b'\n');
        Self {
            path,
            text,
            lines: std::iter::once(0)
                .chain(starts.map(|(i, _)| i + 1))
                .collect(),
            rows: None,
            volumes: RefCell::default(),
        }
    }

    /// The same with the file of rows that it names, of which there is one.
    pub(super) fn with_rows(self, rows: Option<&'a str>) -> Self {
        Self { rows, ..self }
    }

    /// The text of the file of rows, if it is in memory.
    pub(super) fn rows(&self) -> Option<&'a str> {
        self.rows
    }

    /// The same with volumes that are in memory, by the names that the text has for them.
    pub(super) fn with_volumes(self, volumes: &[(String, Arc<Volume>)]) -> Self {
        let known = volumes.iter();
        let known = known.map(|(name, v)| (name.clone(), None, v.clone()));
        let volumes = RefCell::new(known.collect());
        Self { volumes, ..self }
    }

    /// The volume in the file that the text calls `name`. It is read once.
    pub(super) fn volume(&self, name: &str, order: AxisOrder) -> Result<Arc<Volume>, NoVolume> {
        let known =
            |(n, o, v): &Known| (n == name && o.is_none_or(|o| o == order)).then(|| v.clone());
        if let Some(volume) = self.volumes.borrow().iter().find_map(known) {
            return Ok(volume);
        }
        let volume = Arc::new(isosurface::load(&self.beside(name), order)?);
        let entry = (name.to_owned(), Some(order), volume.clone());
        self.volumes.borrow_mut().push(entry);
        Ok(volume)
    }

    pub(super) fn path(&self) -> &'a Path {
        self.path
    }

    pub(super) fn text(&self) -> &'a str {
        self.text
    }

    /// The place of a byte offset.
    pub(super) fn place(&self, offset: usize) -> Place {
        let line = self.lines.partition_point(|&start| start <= offset);
        let start = self.lines[line - 1];
        let before = self.text.get(start..offset.min(self.text.len()));
        let column = 1 + before.map_or(0, |s| s.chars().count());
        Place { line, column }
    }

    /// The same for one of many, without the column where counting up to it would take long: a file may be one line.
    pub(super) fn table_place(&self, offset: usize) -> Place {
        /// Bytes of a line, at most.
        const COUNTED: usize = 1 << 12;
        let line = self.lines.partition_point(|&start| start <= offset);
        if offset - self.lines[line - 1] > COUNTED {
            return Place { line, column: 0 };
        }
        self.place(offset)
    }

    /// The path of a file that the text names: beside its own file, or where `name` leads from there.
    pub(super) fn beside(&self, name: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(name)
    }

    /// A message about the character at `offset`, or about the file.
    pub(super) fn diagnostic(&self, offset: Option<usize>, message: String) -> Diagnostic {
        let place = offset.map_or(Place::default(), |offset| self.place(offset));
        Diagnostic {
            path: self.path.to_owned(),
            line: place.line,
            column: place.column,
            message,
            unreadable: false,
        }
    }

    /// The text at `span`, on one line and shortened.
    pub(super) fn quote(&self, span: Range<usize>) -> String {
        let text = self.text.get(span).unwrap_or_default();
        // Enough for the quote: the text may be as long as the file.
        let start: String = text.chars().take(8 * MAX_QUOTE).collect();
        let one_line = start.split_whitespace().collect::<Vec<_>>().join(" ");
        shorten(&one_line)
    }
}

/// `text` with escapes in place of what ends a line, or does something to a terminal. All that a file says may hold such characters: keys,
/// names of files, headers of arrays.
pub(super) fn one_line(text: &str) -> String {
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    line
}

/// `text` on one line, cut at [`MAX_QUOTE`] characters.
pub(super) fn shorten(text: &str) -> String {
    let mut rest = text.chars();
    let short: String = rest.by_ref().take(MAX_QUOTE).collect();
    one_line(&short) + if rest.next().is_some() { "…" } else { "" }
}

/// `name` in double quotes, shortened.
pub(super) fn quoted(name: &str) -> String {
    format!("\"{}\"", shorten(name))
}

/// The errors of one file.
pub(super) struct Faults {
    /// Byte offset, none for the whole file, message, and [`Diagnostic::unreadable`].
    found: Vec<(Option<usize>, String, bool)>,
    uncounted: usize,
    /// Those in files that the scene names.
    elsewhere: Vec<Diagnostic>,
    /// Files of rows in which nothing is wrong.
    row_files: Vec<RowFile>,
}

impl Faults {
    pub(super) fn new() -> Self {
        Self {
            found: Vec::new(),
            uncounted: 0,
            elsewhere: Vec::new(),
            row_files: Vec::new(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.found.is_empty() && self.elsewhere.is_empty()
    }

    /// Errors in another file.
    pub(super) fn push_elsewhere(&mut self, errors: Vec<Diagnostic>) {
        self.elsewhere.extend(errors);
    }

    /// A file of rows in which nothing is wrong, but that there may be none.
    pub(super) fn row_file(&mut self, path: PathBuf, rows: usize, place: Place) {
        self.row_files.push(RowFile { path, rows, place });
    }

    /// All of them, in the order in which they were read.
    pub(super) fn take_row_files(&mut self) -> Vec<RowFile> {
        std::mem::take(&mut self.row_files)
    }

    /// The files that have no rows, to follow a message that there is nothing of a kind.
    pub(super) fn empty_row_files(&self) -> String {
        let empty = self.row_files.iter().filter(|f| f.rows == 0);
        empty
            .map(|f| format!("; {} has no rows", f.path.display()))
            .collect()
    }

    pub(super) fn push(&mut self, offset: Option<usize>, message: String) {
        self.push_one(offset, message, false);
    }

    /// What is named at `offset` can't be read.
    pub(super) fn push_unreadable(&mut self, offset: Option<usize>, message: String) {
        self.push_one(offset, message, true);
    }

    fn push_one(&mut self, offset: Option<usize>, message: String, unreadable: bool) {
        if self.found.len() < MAX_ERRORS {
            self.found.push((offset, message, unreadable));
        } else {
            self.uncounted += 1;
        }
    }

    /// In file order, what concerns the whole file last.
    pub(super) fn into_diagnostics(mut self, source: &Source) -> Vec<Diagnostic> {
        self.found.sort_by_key(|f| f.0.unwrap_or(usize::MAX));
        self.found.dedup();
        let mut diagnostics: Vec<Diagnostic> = self
            .found
            .into_iter()
            .map(|(offset, message, unreadable)| Diagnostic {
                unreadable,
                ..source.diagnostic(offset, message)
            })
            .collect();
        diagnostics.extend(self.elsewhere);
        if self.uncounted > 0 {
            diagnostics.push(source.diagnostic(None, format!("{} more errors", self.uncounted)));
        }
        diagnostics
    }
}

/// What other programs, and the literature, call things.
const SYNONYMS: [(&str, &str); 22] = [
    ("color", "reflectance"),
    ("colour", "reflectance"),
    ("albedo", "reflectance"),
    ("position", "center"),
    ("origin", "eye"),
    ("diameter", "radius"),
    ("emission", "radiance"),
    ("intensity", "radiance"),
    ("shininess", "exponent"),
    ("n", "exponent"),
    ("kd", "diffuse"),
    ("ks", "specular"),
    ("eta", "ior"),
    ("fov", "vfov"),
    ("target", "look_at"),
    ("size", "resolution"),
    ("glass", "dielectric"),
    ("lambert", "diffuse"),
    ("lambertian", "diffuse"),
    ("matte", "diffuse"),
    ("glossy", "phong"),
    ("tube", "cylinder"),
];

/// `; did you mean "…"?` for a synonym of `word`, or for the candidate most like it, if any is.
pub(super) fn suggestion<'c>(word: &str, candidates: impl IntoIterator<Item = &'c str>) -> String {
    /// Share of letters that must agree: 0.6 takes one slip in three letters, two in five.
    const ALIKE: f64 = 0.6;
    // Longer words are no slips, and the distance is quadratic in length.
    if word.len() > 100 {
        return String::new();
    }
    let word = word.to_lowercase();
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let synonym = SYNONYMS
        .into_iter()
        .find(|(other, meant)| *other == word && candidates.contains(meant));
    if let Some((_, meant)) = synonym {
        return format!("; did you mean {}?", quoted(meant));
    }
    // Of the letters that were written: two that are missing after three are no slip.
    let letters = word.chars().count() as f64;
    candidates
        .into_iter()
        .filter(|c| c.len() <= 100)
        .map(|c| {
            let slips = strsim::damerau_levenshtein(&word, &c.to_lowercase());
            (1.0 - slips as f64 / letters, c)
        })
        .filter(|(alike, _)| *alike >= ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, c)| {
            format!("; did you mean {}?", quoted(c))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_crlf_ends_lines() {
        let source = Source::new(Path::new("x.toml"), "a\r\nöäü b\n");
        let at = source.text().find('b');
        let d = source.diagnostic(at, "m".into());
        assert_eq!(d.to_string(), "x.toml:2:5: m");
        let end = source.diagnostic(Some(source.text().len()), "m".into());
        assert_eq!((end.line, end.column), (3, 1));
    }

    #[test]
    fn quotes_are_short_and_on_one_line() {
        let text = format!("[1,\n   2, \u{7}{}]", "3".repeat(100));
        let quote = Source::new(Path::new(""), &text).quote(0..text.len());
        assert!(quote.starts_with("[1, 2, \\u{7}333"), "{quote}");
        assert!(quote.chars().count() < 50);
    }

    #[test]
    fn suggestions_are_near_misses_only() {
        let keys = ["center", "radius", "material"];
        assert_eq!(suggestion("Centre", keys), "; did you mean \"center\"?");
        assert_eq!(suggestion("radios", keys), "; did you mean \"radius\"?");
        assert_eq!(suggestion("radiance", keys), "");
        assert_eq!(suggestion("ior", keys), "");
        assert_eq!(suggestion("foo", ["floor"]), "");
        assert_eq!(suggestion("discs", ["disk"]), "; did you mean \"disk\"?");
        assert_eq!(suggestion("", keys), "");
        assert_eq!(suggestion("Position", keys), "; did you mean \"center\"?");
        assert_eq!(suggestion("color", keys), "");
        assert_eq!(suggestion(&"radius".repeat(50), keys), "");
    }
}
