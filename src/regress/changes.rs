//! What has changed in the text of a scene.

/// Most lines of each text that are told.
const TOLD: usize = 3;

/// What differs, from the first line that does to the last, in lines such as `- radius = 1`. `old` is `None` where the golden does not
/// keep its text.
pub(super) fn of_text(old: Option<&str>, new: &str) -> Vec<String> {
    let Some(old) = old else {
        return vec![
            "the golden does not keep the text of its scene, so what changed there is not known"
                .into(),
        ];
    };
    let [old, new] = [old, new].map(|text| text.lines().collect::<Vec<_>>());
    let first = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
    let (old, new) = (&old[first..], &new[first..]);
    if old.is_empty() && new.is_empty() {
        return vec![
            "the text of the scene is the same; what changed is in the files that it names, or in how the program reads it".into(),
        ];
    }
    let after = old.iter().rev().zip(new.iter().rev());
    let after = after.take_while(|(a, b)| a == b).count();
    let mut told = vec![format!(
        "the text of the scene differs from line {} on:",
        first + 1
    )];
    for (mark, lines) in [("-", old), ("+", new)] {
        let lines = &lines[..lines.len() - after];
        told.extend(lines.iter().take(TOLD).map(|line| format!("{mark} {line}")));
        if lines.len() > TOLD {
            told.push(format!("{mark} and {} more lines", lines.len() - TOLD));
        }
    }
    told
}

#[cfg(test)]
mod tests {
    use super::of_text;

    #[test]
    fn the_first_lines_that_differ_are_told() {
        let told = of_text(Some("a\nb\nc\nd\n"), "a\nx\ny\nd\n");
        let head = "the text of the scene differs from line 2 on:";
        assert_eq!(told, [head, "- b", "- c", "+ x", "+ y"]);
        let told = of_text(Some("a\n"), "a\n1\n2\n3\n4\n5");
        assert_eq!(told[1..], ["+ 1", "+ 2", "+ 3", "+ and 2 more lines"]);
        // A line twice, where both ends of the texts would take it.
        assert_eq!(of_text(Some("a\na"), "a")[1..], ["- a"]);
        assert!(of_text(Some("a"), "a")[0].contains("is the same"));
        assert!(of_text(None, "a")[0].contains("does not keep"));
    }
}
