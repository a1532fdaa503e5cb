//! Extended XYZ files: a line with the number of atoms, one with `key=value` pairs, and one for each atom. Of the pairs only
//! `Properties` matters, which names the columns: `species:S:1:pos:R:3:velo:R:3`. Without it they are `species:S:1:pos:R:3`,
//! as in plain XYZ files. A file may hold several such frames.

use super::super::source::{quoted, suggestion};
use super::Wrong;
use super::sheet::{Form, Sheet, column};
use std::borrow::Cow;
use std::path::Path;

/// What plain XYZ files have.
const PLAIN: &str = "species:S:1:pos:R:3";

/// More columns than any program writes.
const MOST_COLUMNS: usize = 1000;

/// Whether a file of this name is an XYZ file.
pub(in crate::scene) fn is_xyz(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    ["xyz", "extxyz"]
        .iter()
        .any(|e| extension.eq_ignore_ascii_case(e))
}

/// The atoms of the frame with this number, from 0; without one, those of the only frame.
pub(super) fn open<'a>(
    path: &'a Path,
    text: &'a str,
    frame: Option<u32>,
) -> Result<Sheet<'a>, Wrong> {
    let mut sheet = Sheet::new(path, text, Form::Blanks { rows: 0, line: 1 });
    for earlier in 0..frame.unwrap_or(0) {
        let (_, rows) = atoms(&mut sheet, earlier, frame)?;
        if sheet.lines.nth(rows).is_none() {
            return Err(too_few(&mut sheet, earlier, frame));
        }
    }
    let (line, rows) = atoms(&mut sheet, frame.unwrap_or(0), frame)?;
    sheet.form = Form::Blanks { rows, line };
    let Some((_, comment)) = sheet.lines.next() else {
        return Err(sheet.stop(
            line,
            1,
            "the file ends before the line of properties".into(),
        ));
    };
    let given = properties(comment);
    match columns(given.unwrap_or(PLAIN)) {
        Ok(names) => sheet.names = names,
        Err((part, message)) => {
            return Err(sheet.stop(line + 1, column(comment, part), message));
        }
    }
    if frame.is_none() {
        only_one(&mut sheet, line, rows)?;
    }
    Ok(sheet)
}

/// The first line of frame `this`: its number, from 1, and the number of atoms. `wanted` is the frame that was asked for.
fn atoms(sheet: &mut Sheet, this: u32, wanted: Option<u32>) -> Result<(usize, usize), Wrong> {
    const RULE: &str = "a frame of an XYZ file begins with the number of its atoms";
    let Some((i, line)) = sheet.lines.next() else {
        if this > 0 {
            return Err(too_few(sheet, this, wanted));
        }
        return Err(sheet.stop(0, 0, format!("the file is empty; {RULE}")));
    };
    // Blank lines at the end are no frame.
    if this > 0 && line.trim().is_empty() {
        return Err(too_few(sheet, this, wanted));
    }
    match line.trim().parse() {
        Ok(rows) => Ok((i + 1, rows)),
        Err(_) => {
            let found = quoted(line.trim());
            Err(sheet.stop(i + 1, 1, format!("found {found}; {RULE}, a whole number")))
        }
    }
}

fn too_few(sheet: &mut Sheet, found: u32, wanted: Option<u32>) -> Wrong {
    let wanted = wanted.unwrap_or_default();
    let (plural, verb) = if found == 1 { ("", "is") } else { ("s", "are") };
    let message =
        format!("frame is {wanted}, but there {verb} {found} whole frame{plural}, numbered from 0");
    sheet.stop(0, 0, message)
}

/// Refuses a file with more than one frame, of `rows` atoms, whose first line has the number `line`.
fn only_one(sheet: &mut Sheet, line: usize, rows: usize) -> Result<(), Wrong> {
    let mut rest = sheet.lines.clone().skip(rows);
    let Some((i, more)) = rest.find(|(_, text)| !text.trim().is_empty()) else {
        return Ok(());
    };
    let message = match more.trim().parse::<usize>() {
        Ok(_) => {
            "another frame begins here; the key frame chooses one: frame = 0 is the first".into()
        }
        Err(_) => format!(
            "line {line} announces {}, but there are more lines",
            count(rows)
        ),
    };
    Err(sheet.stop(i + 1, 1, message))
}

/// `1 atom`, `2 atoms`.
pub(super) fn count(atoms: usize) -> String {
    let s = if atoms == 1 { "" } else { "s" };
    format!("{atoms} atom{s}")
}

/// The value of `Properties` in the second line of a frame. Values in quotes or braces may hold blanks, and pairs that are none.
fn properties(comment: &str) -> Option<&str> {
    let mut rest = comment;
    loop {
        rest = rest.trim_start();
        let end = rest.find(|c: char| c == '=' || c.is_whitespace())?;
        let key = &rest[..end];
        rest = rest[end..].trim_start();
        let Some(value) = rest.strip_prefix('=') else {
            continue;
        };
        let value = value.trim_start();
        let closing = match value.chars().next() {
            Some('"') => Some('"'),
            Some('{') => Some('}'),
            _ => None,
        };
        let (value, after) = match closing {
            Some(mark) => value[1..].split_once(mark).unwrap_or((&value[1..], "")),
            None => value.split_at(value.find(char::is_whitespace).unwrap_or(value.len())),
        };
        if key == "Properties" {
            return Some(value);
        }
        rest = after;
    }
}

/// The name of each column, or the part that is wrong and why.
fn columns(properties: &str) -> Result<Vec<Cow<'_, str>>, (&str, String)> {
    /// Name, type, number of columns of what has a meaning here.
    const KNOWN: [(&str, &str, usize); 4] = [
        ("species", "S", 1),
        ("pos", "R", 3),
        ("radius", "R", 1),
        ("color", "R", 3),
    ];
    let parts: Vec<&str> = properties.split(':').collect();
    let mut names: Vec<Cow<str>> = Vec::new();
    for triple in parts.chunks(3) {
        let &[name, kind, count] = triple else {
            let message = "Properties must be names, types and numbers of columns, such as species:S:1:pos:R:3".into();
            return Err((triple[0], message));
        };
        if name.is_empty() || names.iter().any(|n| n == name) {
            return Err((
                name,
                format!("property {} must have a name, and stand once", quoted(name)),
            ));
        }
        if !["S", "I", "R", "L"].contains(&kind) {
            let message = format!(
                "property {} is of type {}; types are S, I, R, L",
                quoted(name),
                quoted(kind)
            );
            return Err((kind, message));
        }
        let counted = count
            .parse()
            .ok()
            .filter(|n| (1..=MOST_COLUMNS).contains(n));
        let Some(number) = counted else {
            let (name, count) = (quoted(name), quoted(count));
            let message = format!(
                "property {name} has {count} columns; it must be a whole number from 1 to {MOST_COLUMNS}"
            );
            return Err((triple[2], message));
        };
        if let Some((_, wanted, columns)) = KNOWN.iter().find(|k| k.0 == name)
            && (kind, number) != (wanted, *columns)
        {
            let message = format!(
                "property {} is {kind}:{number}, but must be {wanted}:{columns}",
                quoted(name)
            );
            return Err((name, message));
        }
        names.extend(std::iter::repeat_n(Cow::Borrowed(name), number));
    }
    if names.iter().any(|n| n == "pos") {
        Ok(names)
    } else {
        let meant = suggestion("pos", names.iter().map(AsRef::as_ref));
        Err((
            properties,
            format!("Properties have no pos:R:3, the places of the atoms{meant}"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn properties_are_found_among_pairs() {
        for (comment, found) in [
            (
                "Properties=species:S:1:pos:R:3",
                Some("species:S:1:pos:R:3"),
            ),
            (
                "Lattice=\"5 0 0 0 5 0 0 0 5\" Properties=pos:R:3 Time=1.5",
                Some("pos:R:3"),
            ),
            (
                "note=\"Properties=no\" pbc={T T T} Properties = \"pos:R:3\"",
                Some("pos:R:3"),
            ),
            ("water, minimised Properties=pos:R:3", Some("pos:R:3")),
            ("a comment, and E = 3", None),
            ("open=\"no end Properties=pos:R:3", None),
            ("", None),
            ("\u{fc}=\u{fc} Properties", None),
        ] {
            assert_eq!(properties(comment), found, "{comment}");
        }
    }

    #[test]
    fn columns_have_the_names_of_their_properties() {
        let names = columns("id:I:1:pos:R:3:velo:R:2").unwrap();
        assert_eq!(names, ["id", "pos", "pos", "pos", "velo", "velo"]);
        for (wrong, why) in [
            ("pos:R", "such as species:S:1"),
            ("pos:R:3:id:X:1", "types are S, I, R, L"),
            ("pos:R:3:id:I:0", "from 1 to 1000"),
            ("pos:R:2", "\"pos\" is R:2, but must be R:3"),
            ("species:S:1", "no pos:R:3"),
            ("pos:R:3:pos:R:3", "stand once"),
        ] {
            let message = columns(wrong).unwrap_err().1;
            assert!(message.contains(why), "{wrong}: {message}");
        }
    }
}
