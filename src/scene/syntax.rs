//! The syntax of scene files: TOML, with errors in the words of someone who writes a scene.

use super::source::{Faults, Source, quoted, shorten};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error};

/// Texts up to this many bytes have all their syntax errors reported, longer ones the first: a
/// large file of something else can have one error a byte.
const MAX_RECOVERED_BYTES: usize = 1 << 16;

/// The file as tables; none if it is not valid TOML.
pub(super) fn tables<'a>(source: &Source<'a>, faults: &mut Faults) -> Option<DeTable<'a>> {
    let text = source.text();
    if let Some(at) = text.find('\0') {
        let message = "found a NUL character; a scene file is TOML text".into();
        faults.push(Some(at), message);
        return None;
    }
    let (root, mut errors) = if text.len() <= MAX_RECOVERED_BYTES {
        DeTable::parse_recoverable(text)
    } else {
        match DeTable::parse(text) {
            Ok(root) => (root, Vec::new()),
            Err(error) => (Spanned::new(0..0, DeTable::new()), vec![error]),
        }
    };
    let root = root.into_inner();
    let span = |error: &Error| error.span().unwrap_or(0..0);
    errors.sort_by_key(|error| span(error).start);
    // Where the keys of a repeated table end, and the line of the last syntax error: one mistake is one error.
    let (mut repeated, mut line) = (0, 0);
    for error in &errors {
        let span = span(error);
        if error.message() == "duplicate key" {
            if span.start >= repeated {
                faults.push(Some(span.start), duplicate(source, &root, &span));
                if header(text, &span).is_some() {
                    repeated = end_of_table(text, span.end);
                }
            }
            continue;
        }
        if let Some(at) = unclosed(text, error.message(), &span) {
            // What follows is taken for a part of the list: its errors are none.
            let bracket = source.quote(at..at + 1);
            faults.push(
                Some(at),
                format!("not TOML: this `{bracket}` is not closed"),
            );
            break;
        }
        let this = source.table_place(span.start).line;
        if this != line {
            let (at, message) = syntax(source, error.message(), span);
            faults.push(Some(at), message);
        }
        line = this;
    }
    errors.is_empty().then_some(root)
}

/// A syntax error: its place, and what is wrong.
fn syntax(source: &Source, message: &str, span: Range<usize>) -> (usize, String) {
    if let Some(at) = missing_comma(source.text(), message, &span) {
        let rest = &source.text()[at..];
        let value = |c: char| !c.is_whitespace() && !",]}=".contains(c);
        let end = rest.find(|c| !value(c)).unwrap_or(rest.len());
        let next = source.quote(at..at + end);
        return (at, format!("not TOML: expected a comma before `{next}`"));
    }
    let found = source.quote(span.clone());
    let message = match message {
        // The parser treats anything that is not another value as a string.
        _ if found.is_empty() && is_unquoted(message) => "not TOML: a value is missing".into(),
        _ if found.is_empty() => {
            format!("not TOML: {message}{}", hint(source.text(), message, &span))
        }
        // A number was meant as often as a text.
        _ if is_unquoted(message) => format!(
            "not TOML: expected a number, a list, or a text in quotes; found `{found}`{}",
            hint(source.text(), message, &span)
        ),
        _ => format!(
            "not TOML: {message}; found `{found}`{}",
            hint(source.text(), message, &span)
        ),
    };
    (span.start, message)
}

/// Where the bracket stands that a list or an inline table lacks the other of, if that is the error: the parser takes the next line for
/// another value.
fn unclosed(text: &str, message: &str, span: &Range<usize>) -> Option<usize> {
    let missing = message.starts_with("missing comma") || message.starts_with("unclosed");
    let ends = missing || is_unquoted(message);
    let at = open_bracket(&text[..span.start]).filter(|_| ends)?;
    let line = text[span.start..].lines().next().unwrap_or_default();
    let before = text[at..span.start].rsplit_once('\n');
    let is_new = before.is_some_and(|(_, blank)| blank.trim().is_empty());
    let is_next = line.trim_start().starts_with('[') || line.contains('=');
    let is_end = text[span.start..].trim().is_empty();
    (is_end || (is_new && is_next)).then_some(at)
}

/// The last bracket that is open at the end of `text`, outside of texts and comments.
fn open_bracket(text: &str) -> Option<usize> {
    let mut open = Vec::new();
    let mut within: Option<char> = None;
    for (at, c) in text.char_indices() {
        match within {
            Some('#') if c == '\n' => within = None,
            Some(quote) if quote != '#' && (c == quote || c == '\n') => within = None,
            Some(_) => {}
            None if matches!(c, '#' | '"' | '\'') => within = Some(c),
            None if matches!(c, '[' | '{') => open.push(at),
            None if matches!(c, ']' | '}') => {
                open.pop();
            }
            None => {}
        }
    }
    open.pop()
}

/// What someone may have meant who wrote this where a value stands.
fn hint(text: &str, message: &str, span: &Range<usize>) -> &'static str {
    let found = text.get(span.clone()).unwrap_or_default().trim();
    let line = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
    let rest = text[span.start..].trim_start_matches([' ', '\t']);
    let is_comment = ["//", "/*", ";"].iter().any(|mark| found.starts_with(mark));
    if is_comment || rest.starts_with("//") || (is_unquoted(message) && found.contains("//")) {
        return "; comments begin with #";
    }
    if rest.starts_with(':') && !text[line..span.start].contains('=') {
        return "; keys and values have = between them: eye = [0, 1, 4]";
    }
    if message.starts_with("invalid mantissa") || message.starts_with("invalid fraction") {
        return "; numbers have digits on both sides of the point: 0.5, 1.0";
    }
    if message.starts_with("invalid float") || message.starts_with("invalid integer") {
        return "; numbers have no letters or units behind them";
    }
    if text[span.start..].starts_with(',') {
        return "; decimals have a point, and only lists have commas";
    }
    if !is_unquoted(message) {
        return "";
    }
    if found.starts_with('(') {
        "; lists stand in brackets: [1.0, 2.0]"
    } else if is_sum(found) {
        "; nothing is calculated here: write the result"
    } else if found.ends_with(';') {
        "; lines end without a semicolon"
    } else if found.starts_with(['\u{201c}', '\u{201d}', '\u{2018}', '\u{2019}']) {
        "; texts have straight quotes"
    } else {
        ""
    }
}

/// Whether it is a formula: numbers with signs between them, such as `90/2` or `2 * pi`.
fn is_sum(found: &str) -> bool {
    let of_formulas = |c: char| c.is_ascii_alphanumeric() || "+-*/^(). ".contains(c);
    found.starts_with(|c: char| c.is_ascii_digit() || "+-.(".contains(c) || c.is_ascii_lowercase())
        && found.chars().all(of_formulas)
        && found.contains(|c: char| c.is_ascii_digit())
        && found[1..].contains(['+', '*', '/', '^'])
}

fn is_unquoted(message: &str) -> bool {
    message.starts_with("string values must be quoted")
}

/// Where the value stands that lacks a comma before it, if that is the error: the parser takes `1.0 0` for a single string.
fn missing_comma(text: &str, message: &str, span: &Range<usize>) -> Option<usize> {
    if message.starts_with("missing comma") {
        return Some(span.start);
    }
    let found = text.get(span.clone()).filter(|_| is_unquoted(message))?;
    let first = found.split_whitespace().next()?;
    let is_value = first.parse::<f64>().is_ok() || ["true", "false"].contains(&first);
    let next = found.len() - found.strip_prefix(first)?.trim_start().len();
    let before = text[..span.start].trim_end();
    let in_array = before.ends_with(['[', ',']);
    let in_table = before.ends_with('=') && text[span.end..].trim_start().starts_with('=');
    (is_value && next < found.len() && (in_array || in_table)).then_some(span.start + next)
}

/// The error about a key or table that is there already, with the line of the first one.
fn duplicate(source: &Source, root: &DeTable, span: &Range<usize>) -> String {
    let text = source.text();
    let key = text.get(span.clone()).unwrap_or_default();
    let earlier = || nearest(root, key.trim_matches(['"', '\'']), span.start);
    let (what, first) = match header(text, span) {
        Some(names) => {
            let first = first_header(text, &names, span.start).or_else(earlier);
            (format!("[{}]", shorten(&names.join("."))), first)
        }
        None => (quoted(&source.quote(span.clone())), earlier()),
    };
    let first = first.map_or_else(String::new, |at| {
        format!(", first at line {}", source.table_place(at).line)
    });
    format!("duplicate {what}{first}: keys and [tables] must be unique; only [[tables]] can repeat")
}

/// The names in the header of a table, if the last one stands at `span`.
fn header<'a>(text: &'a str, span: &Range<usize>) -> Option<Vec<&'a str>> {
    let start = text[..span.start].rfind('\n').map_or(0, |at| at + 1);
    names(text.get(start..span.end)?)
}

/// The names in a line that begins as a header does.
fn names(line: &str) -> Option<Vec<&str>> {
    let names = line.trim_start().strip_prefix('[')?;
    let names = names.trim_start_matches('[').split(']').next()?;
    let bare = names
        .split('.')
        .map(|name| name.trim().trim_matches(['"', '\'']));
    Some(bare.collect())
}

/// The offset at which the next table begins.
fn end_of_table(text: &str, from: usize) -> usize {
    let mut lines = text[from..].split_inclusive('\n');
    let mut at = from + lines.next().map_or(0, str::len);
    for line in lines {
        if line.trim_start().starts_with('[') {
            break;
        }
        at += line.len();
    }
    at
}

/// Where the first header with these names stands before `end`.
fn first_header(text: &str, wanted: &[&str], end: usize) -> Option<usize> {
    let mut at = 0;
    for line in text[..end].split_inclusive('\n') {
        if names(line).is_some_and(|names| names == wanted) && at + line.len() < end {
            return Some(at);
        }
        at += line.len();
    }
    None
}

/// Where the last key of this name before `end` stands. A key stands after its like with no other table between.
fn nearest(table: &DeTable, name: &str, end: usize) -> Option<usize> {
    let mut last = None;
    for (key, value) in table {
        let own = (key.get_ref() == name).then_some(key.span().start);
        let tables = match value.get_ref() {
            DeValue::Table(inner) => vec![inner],
            DeValue::Array(all) => all.iter().filter_map(|v| v.get_ref().as_table()).collect(),
            _ => Vec::new(),
        };
        let inner = tables.into_iter().filter_map(|t| nearest(t, name, end));
        last = last.max(own.into_iter().chain(inner).filter(|at| *at < end).max());
    }
    last
}
