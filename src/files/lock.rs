//! One process at a time goes on with a film.
//!
//! While a render holds a film, a file beside it is locked. The lock is the system's and ends with the process, however that
//! ends: what is left of a killed one is a file that nobody holds.

use crate::files::FileError;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// A film held; let go when dropped.
#[derive(Debug)]
pub struct Lock {
    /// `None` where there is nothing to be locked.
    held: Option<(PathBuf, File)>,
}

impl Lock {
    /// Holds the film `path`, there or not, for this process. An error if another has it. Where the file system has no
    /// locks, and for what is no ordinary file, nothing is held and nothing refused.
    pub fn new(path: &Path) -> Result<Self, FileError> {
        match fs::metadata(path) {
            Ok(meta) if !meta.is_file() => return Ok(Self { held: None }),
            _ => {}
        }
        // Through a symbolic link: the film that is meant may be held by its own name.
        let film = fs::canonicalize(path).unwrap_or_else(|_| path.into());
        let name = film.file_name().unwrap_or_default().to_string_lossy();
        let end = name.floor_char_boundary(200);
        let beside = film.with_file_name(format!(".{}.lock", &name[..end]));
        loop {
            let file = File::options()
                .write(true)
                .create(true)
                .truncate(false)
                .open(&beside)
                .map_err(|e| FileError::io(path, "cannot write a lock beside it", &e))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let message = "another process is rendering into this film".into();
                    return Err(FileError::Io {
                        path: path.into(),
                        message,
                    });
                }
                Err(TryLockError::Error(_)) => {
                    let _ = fs::remove_file(&beside);
                    return Ok(Self { held: None });
                }
            }
            // Whoever had it before may have removed it between opening and locking.
            if is_still(&file, &beside).unwrap_or(false) {
                let held = Some((beside, file));
                return Ok(Self { held });
            }
        }
    }
}

/// Whether an open file is the one of this name.
fn is_still(file: &File, path: &Path) -> io::Result<bool> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let [a, b] = [file.metadata()?, fs::metadata(path)?];
        Ok((a.dev(), a.ino()) == (b.dev(), b.ino()))
    }
    #[cfg(not(unix))]
    {
        file.metadata()?;
        Ok(path.exists())
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Some((path, _file)) = &self.held {
            // Still locked: nobody else can take what is removed for theirs.
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_is_held_once_until_it_is_let_go() {
        let dir = tempfile::tempdir().unwrap();
        let film = dir.path().join("f.npz");
        let other = dir.path().join("other.npz");
        let first = Lock::new(&film).unwrap();
        let refused = Lock::new(&film).unwrap_err();
        assert!(!refused.is_content());
        assert!(
            refused
                .to_string()
                .ends_with("f.npz: another process is rendering into this film")
        );
        drop(Lock::new(&other).unwrap());
        // What a killed process leaves.
        drop(first);
        fs::write(dir.path().join(".f.npz.lock"), "").unwrap();
        drop(Lock::new(&film).unwrap());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        drop(Lock::new(Path::new("/dev/null")).unwrap());
    }
}
