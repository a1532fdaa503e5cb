//! How much a disk can still take.

use std::path::Path;

/// Free bytes where `path` is or will be; `None` where that is not known.
pub fn free(path: &Path) -> Option<u64> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let at = rustix::fs::statvfs(folder.unwrap_or(Path::new("."))).ok()?;
    at.f_bavail.checked_mul(at.f_frsize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_some_room_and_a_missing_one_is_not_known() {
        assert!(free(Path::new("x.npz")).is_some_and(|bytes| bytes > 0));
        assert_eq!(free(Path::new("/no/such/folder/x.npz")), None);
    }
}
