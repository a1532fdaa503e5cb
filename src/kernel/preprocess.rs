//! `#if NAME`, `#else`, `#endif` on lines of their own: what a scene does not need is not in its kernel. And templates: text with
//! names that begin with a dollar sign.

use super::features::Flag;

/// `text` without directives and without the lines that `flag` leaves out.
///
/// # Panics
/// If directives do not pair, or name no [`Flag`]: the modules are ours, and a test reads them all.
pub(super) fn run(text: &str, flag: impl Fn(Flag) -> bool) -> String {
    let mut out = String::with_capacity(text.len());
    // For every open #if: whether its lines count, and whether the lines around it do.
    let mut open: Vec<(bool, bool)> = Vec::new();
    let mut active = true;
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("#if") => {
                let name = words.next().expect("#if names a flag");
                let known = Flag::named(name).unwrap_or_else(|| panic!("no flag is named {name}"));
                let on = flag(known);
                open.push((on, active));
                active &= on;
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

/// A template's text from its first declaration on, with each `$name` replaced by its value.
///
/// # Panics
/// If a name has no value.
pub(super) fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let declarations = ["struct ", "fn "].map(|word| template.find(&format!("\n{word}")));
    let start = declarations
        .into_iter()
        .flatten()
        .min()
        .map_or(0, |at| at + 1);
    let mut out = String::with_capacity(template.len());
    let mut rest = &template[start..];
    while let Some((before, after)) = rest.split_once('$') {
        out.push_str(before);
        // The longest name that fits: one may begin with another.
        let fitting = values.iter().filter(|(name, _)| after.starts_with(name));
        let (name, value) = fitting
            .max_by_key(|(name, _)| name.len())
            .unwrap_or_else(|| panic!("no value for ${}", after.lines().next().unwrap_or("")));
        out.push_str(value);
        rest = &after[name.len()..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_conditions_and_else() {
        let text = "a\n#if FLAT\nb\n#if ROUND\nc\n#else\nd\n#endif\n#else\ne\n#endif\nf\n";
        let with = |on: &[Flag]| run(text, |f| on.contains(&f)).replace('\n', "");
        assert_eq!(with(&[]), "aef");
        assert_eq!(with(&[Flag::Flat]), "abdf");
        assert_eq!(with(&[Flag::Round]), "aef");
        assert_eq!(with(&[Flag::Flat, Flag::Round]), "abcf");
    }

    #[test]
    #[should_panic(expected = "no flag is named FLATT")]
    fn a_misspelt_flag_is_refused() {
        run("#if FLATT\n#endif\n", |_| false);
    }

    #[test]
    fn every_directive_of_the_shaders_names_a_flag() {
        let mut conditions = 0;
        for module in super::super::modules::ALL {
            run(module.text, |_| true);
            conditions += module
                .text
                .lines()
                .filter(|l| l.trim_start().starts_with("#if"))
                .count();
        }
        assert!(
            (1..=30).contains(&conditions),
            "{conditions} conditions are too many to read"
        );
    }

    #[test]
    fn templates_are_filled() {
        let filled = fill("// About $x.\nfn $x_y($x)", &[("x", "1"), ("x_y", "2")]);
        assert_eq!(filled, "fn 2(1)");
    }

    #[test]
    #[should_panic(expected = "no value for $z")]
    fn a_name_without_a_value_is_refused() {
        fill("fn $z", &[("x", "1")]);
    }
}
