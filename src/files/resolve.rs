//! Where a path leads.

use std::fs;
use std::path::{Path, PathBuf};

/// Most symbolic links that are followed. Linux has the same limit.
const MAX_LINKS: usize = 40;

/// The path with all links resolved, also that of a file that does not exist yet: a link to a missing file leads to where the
/// file would be. Where a link leads in a circle, the last path that was reached.
pub fn resolve(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        if let Ok(real) = fs::canonicalize(&path) {
            return real;
        }
        let folder = match path.parent() {
            Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
            _ => ".".into(),
        };
        if let Ok(to) = fs::read_link(&path) {
            path = folder.join(to);
            continue;
        }
        let folder = fs::canonicalize(&folder).unwrap_or(folder);
        return folder.join(path.file_name().unwrap_or_default());
    }
    path
}
