//! What a long run says meanwhile.

use crate::program::Bench;

/// One line of progress: samples, per cent, and what stands after them.
fn parse(line: &str) -> Option<(f64, f64, &str)> {
    let (samples, rest) = line.split_once(" samples, ")?;
    let (share, rest) = rest.split_once(" %, ")?;
    Some((samples.parse().ok()?, share.parse().ok()?, rest))
}

#[test]
fn progress_lines_have_samples_error_and_time_left() {
    let bench = Bench::new();
    let done = bench
        .run("render box.toml --backend cpu --progress plain --time 11s --error 0.0001% -o a.png")
        .success();
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    let lines: Vec<_> = said.lines().filter_map(parse).collect();
    assert!(lines.len() >= 2, "{said}");
    let mut before = (0.0, 0.0);
    for (samples, share, rest) in lines {
        assert!(
            samples > before.0 && share > before.1 && share < 100.0,
            "{said}"
        );
        assert!(
            rest.contains(" s left, relative error ") && rest.ends_with(" %"),
            "{said}"
        );
        before = (samples, share);
    }
}
