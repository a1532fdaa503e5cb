//! Rows of fields under named columns, as CSV and XYZ files have them, and what is wrong in one.

use super::super::source::{Source, quoted, suggestion};
use super::super::value::{FromNumber, FromVector, without_reason};
use super::super::{Diagnostic, Place};
use super::xyz::count;
use super::{Wrong, about};
use glam::DVec3;
use std::borrow::Cow;
use std::iter::Enumerate;
use std::ops::Range;
use std::path::Path;
use std::str::Lines;

/// The most errors reported for one file.
const MAX_ERRORS: usize = 20;

/// A column, a message: what is wrong in a row.
pub(super) type Fault = (usize, String);

/// The rows of a file that are still to be read.
pub(super) struct Sheet<'a> {
    pub(super) path: &'a Path,
    /// What each field of a row is called. Several fields may have one name: those of a vector.
    pub(super) names: Vec<Cow<'a, str>>,
    pub(super) form: Form,
    pub(super) lines: Enumerate<Lines<'a>>,
    errors: Vec<Diagnostic>,
}

/// How rows are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Fields between commas; empty lines are no rows.
    Commas,
    /// Fields between blanks, and just so many rows, which the line of this number says.
    Blanks { rows: usize, line: usize },
}

impl<'a> Sheet<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str, form: Form) -> Self {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        Self {
            path,
            names: Vec::new(),
            form,
            lines: text.lines().enumerate(),
            errors: Vec::new(),
        }
    }

    pub(super) fn wrong(&mut self, line: usize, column: usize, message: String) {
        let place = Place { line, column };
        self.errors.push(about(self.path, place, message));
    }

    /// All that is wrong so far, of which there is something.
    pub(super) fn fail(&mut self) -> Wrong {
        Wrong::Content(std::mem::take(&mut self.errors))
    }

    /// A single thing that is wrong.
    pub(super) fn stop(&mut self, line: usize, column: usize, message: String) -> Wrong {
        self.wrong(line, column, message);
        self.fail()
    }

    /// Whether the first row of a CSV file, or the properties of an XYZ file, name one of these columns.
    pub(super) fn names_any(&self, names: &[&str]) -> bool {
        let has = |name: &str| names.contains(&name.trim());
        match self.form {
            Form::Commas => {
                let header = self.lines.clone().next().map_or("", |(_, line)| line);
                header.split(',').any(has)
            }
            Form::Blanks { .. } => self.names.iter().any(|n| has(n)),
        }
    }

    /// Reads the first row of a CSV file, which must name the columns `wanted`, all of them and no others. `said` are other columns, and
    /// the key of the scene's table that says the same.
    pub(super) fn header(&mut self, wanted: &[&str], said: &[(&str, &str)]) -> Result<(), Wrong> {
        let rule = format!("the first row must name the columns {}", wanted.join(", "));
        let Some((_, header)) = self.lines.next() else {
            return Err(self.stop(0, 0, format!("the file is empty; {rule}")));
        };
        if !header.contains(',')
            && let Some((c, used)) = [(';', "semicolons"), ('\t', "tabs")]
                .into_iter()
                .find(|(c, _)| header.trim().contains(*c))
        {
            let at = 1 + header.chars().take_while(|other| *other != c).count();
            let message = format!("columns are separated by {used} here; separate them by commas");
            return Err(self.stop(1, at, message));
        }
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        for (k, name) in names.iter().enumerate() {
            let key = said.iter().find(|(column, _)| column == name);
            let message = if wanted.contains(name) && !names[..k].contains(name) {
                continue;
            } else if let Some((_, key)) = key.filter(|_| !wanted.contains(name)) {
                format!(
                    "column {} and the key {key} of the scene's table say the same; leave out one of them",
                    quoted(name)
                )
            } else if !wanted.contains(name) {
                let meant = suggestion(name, wanted.iter().copied());
                format!("unknown column {}; {rule}{meant}", quoted(name))
            } else {
                format!("duplicate column {}; {rule}, each once", quoted(name))
            };
            self.wrong(1, column(header, name), message);
        }
        for name in wanted.iter().filter(|w| !names.contains(w)) {
            self.wrong(1, 0, format!("no column {name}; {rule}"));
        }
        self.names = names.into_iter().map(Cow::Borrowed).collect();
        if self.errors.is_empty() {
            Ok(())
        } else {
            Err(self.fail())
        }
    }

    /// Where the fields of this name stand; empty if there are none.
    pub(super) fn find(&self, name: &str) -> Range<usize> {
        let first = self.names.iter().position(|n| n == name);
        let from = first.unwrap_or(0);
        let count = self.names[from..].iter().take_while(|n| *n == name);
        from..from + first.map_or(0, |_| count.count())
    }

    /// Calls `read` for every row that has all its fields.
    pub(super) fn each(
        mut self,
        mut read: impl FnMut(&Row<'a, '_>) -> Result<(), Fault>,
    ) -> Result<(), Wrong> {
        let names = std::mem::take(&mut self.names);
        let counted = match self.form {
            Form::Commas => format!("the first row names {} columns", names.len()),
            Form::Blanks { line, .. } => {
                format!(
                    "line {} has properties of {} columns",
                    line + 1,
                    names.len()
                )
            }
        };
        let mut fields: Vec<&str> = Vec::with_capacity(names.len());
        let mut done = 0;
        loop {
            if let Form::Blanks { rows, .. } = self.form
                && done == rows
            {
                break;
            }
            let Some((i, line)) = self.lines.next() else {
                break;
            };
            fields.clear();
            match self.form {
                Form::Commas if line.trim().is_empty() => continue,
                Form::Commas => fields.extend(line.split(',').map(str::trim)),
                Form::Blanks { .. } => fields.extend(line.split_ascii_whitespace()),
            }
            done += 1;
            if fields.len() != names.len() {
                let found = fields.len();
                self.wrong(i + 1, 0, format!("found {found} fields, but {counted}"));
            } else {
                let row = Row {
                    names: &names,
                    fields: &fields,
                };
                if let Err((k, message)) = read(&row) {
                    self.wrong(i + 1, column(line, fields[k]), message);
                }
            }
            if self.errors.len() == MAX_ERRORS {
                break;
            }
        }
        if let Form::Blanks { rows, line } = self.form
            && self.errors.is_empty()
            && done < rows
        {
            let message = format!(
                "this line announces {}, but the file ends after {done}",
                count(rows)
            );
            self.wrong(line, 1, message);
        }
        if self.errors.is_empty() {
            Ok(())
        } else {
            Err(self.fail())
        }
    }
}

/// Column in characters, from 1, of `field`, which is a part of `line`.
pub(super) fn column(line: &str, field: &str) -> usize {
    let offset = field.as_ptr() as usize - line.as_ptr() as usize;
    1 + line
        .get(..offset)
        .map_or(0, |before| before.chars().count())
}

/// A row, all of whose fields are there.
pub(super) struct Row<'a, 'r> {
    names: &'r [Cow<'a, str>],
    fields: &'r [&'a str],
}

impl<'a> Row<'a, '_> {
    pub(super) fn field(&self, k: usize) -> &'a str {
        self.fields[k]
    }

    fn float(&self, k: usize) -> Option<f64> {
        self.fields[k].parse().ok()
    }

    pub(super) fn number<T: FromNumber>(&self, k: usize) -> Result<T, Fault> {
        let value = self.float(k).and_then(T::from_number);
        value.ok_or_else(|| (k, self.message(k, &T::rule())))
    }

    pub(super) fn vector<T: FromVector>(&self, columns: [usize; 3]) -> Result<T, Fault> {
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
                let names = columns.map(|k| self.names[k].as_ref()).join(", ");
                let values = columns.map(|k| self.fields[k]).join(", ");
                let rule = T::rule();
                Err((
                    columns[0],
                    format!("{names} are {values}; they must be {rule}"),
                ))
            }
        }
    }

    /// What is wrong with field `k`, which `rule` follows.
    fn message(&self, k: usize, rule: &str) -> String {
        let rule = match self.float(k) {
            Some(_) => rule.to_owned(),
            None => without_reason(rule),
        };
        let (name, found) = (&self.names[k], quoted(self.fields[k]));
        format!("{name} is {found}; {name} must be {rule}")
    }
}

/// The place of byte `offset` of a text.
pub(super) fn place(path: &Path, text: &str, offset: usize) -> Place {
    Source::new(path, text).place(offset)
}
