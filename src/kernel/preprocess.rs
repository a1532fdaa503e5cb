//! `#if NAME`, `#else`, `#endif` on lines of their own: what a scene does not need is not in its kernel.

use std::collections::BTreeSet;

/// `text` without directives and without the lines that `features` leaves out.
///
/// # Panics
/// If directives do not pair: the modules are ours, and a test reads them all.
pub(super) fn run(text: &str, features: &BTreeSet<&str>) -> String {
    let mut out = String::with_capacity(text.len());
    // For every open #if: whether its lines count, and whether the lines around it do.
    let mut open: Vec<(bool, bool)> = Vec::new();
    let mut active = true;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("#if") => {
                let name = words.next().expect("#if names a feature");
                open.push((features.contains(name), active));
                active &= features.contains(name);
            }
            Some("#else") => {
                let (on, outer) = open.last().expect("#else follows #if");
                active = *outer && !on;
            }
            Some("#endif") => active = open.pop().expect("#endif follows #if").1,
            _ if active => {
                out.push_str(line);
                out.push('\n');
            }
            _ => {}
        }
    }
    assert!(open.is_empty(), "#if without #endif");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_conditions_and_else() {
        let text = "a\n#if X\nb\n#if Y\nc\n#else\nd\n#endif\n#else\ne\n#endif\nf\n";
        let with =
            |names: &[&'static str]| run(text, &names.iter().copied().collect()).replace('\n', "");
        assert_eq!(with(&[]), "aef");
        assert_eq!(with(&["X"]), "abdf");
        assert_eq!(with(&["Y"]), "aef");
        assert_eq!(with(&["X", "Y"]), "abcf");
    }
}
