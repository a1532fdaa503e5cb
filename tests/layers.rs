//! The parts of the crate lie in layers: no two of them lean on each other, in a ring of any length.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Files of Rust below `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            all.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            all.push(path);
        }
    }
    all
}

/// The top-level modules that `text` names as `crate::NAME`, but for its comments and its tests.
fn uses(text: &str) -> BTreeSet<String> {
    let product = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let code = product
        .lines()
        .filter(|l| !l.trim_start().starts_with("//"));
    let names = code.flat_map(|line| line.split("crate::").skip(1));
    names
        .map(|rest| {
            let end = rest.find(|c: char| c != '_' && !c.is_ascii_lowercase());
            rest[..end.unwrap_or(rest.len())].to_owned()
        })
        .filter(|name| !name.is_empty())
        .collect()
}

/// What leans on itself in the end.
fn rings(graph: &BTreeMap<String, BTreeSet<String>>) -> Vec<&str> {
    let leans = |start: &String| {
        let (mut seen, mut todo) = (BTreeSet::new(), vec![start]);
        while let Some(next) = todo.pop().and_then(|m| graph.get(m)) {
            todo.extend(next.iter().filter(|m| seen.insert(*m)));
        }
        seen.contains(start)
    };
    graph
        .keys()
        .filter(|m| leans(m))
        .map(String::as_str)
        .collect()
}

#[test]
fn no_module_leans_on_one_that_leans_on_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in files(&src) {
        let inner = path.strip_prefix(&src).expect("below src");
        let first = inner.iter().next().expect("a name").to_string_lossy();
        let module = first.trim_end_matches(".rs").to_owned();
        if inner.ends_with("tests.rs") || ["lib", "main"].contains(&module.as_str()) {
            continue;
        }
        let mut used = uses(&fs::read_to_string(&path).expect("text"));
        used.remove(&module);
        graph.entry(module).or_default().extend(used);
    }
    assert!(
        graph.len() > 10 && graph["gpu"].contains("kernel"),
        "{graph:?}"
    );
    assert_eq!(rings(&graph), [""; 0], "{graph:#?}");
    // Nothing of the program is needed by the library.
    for (module, used) in &graph {
        let program = ["bench", "cli", "denoise", "export", "log", "plot", "watch"];
        assert!(
            program.contains(&module.as_str()) || program.iter().all(|p| !used.contains(*p)),
            "{module}"
        );
    }
}
