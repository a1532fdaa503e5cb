//! Only one process at a time may render into a film.
//!
//! While a process renders into a film, it locks a file beside it. The operating system releases the lock when the process
//! ends, even if it is killed. The lock file then stays, but is unlocked.

use crate::files::{FileError, resolve};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// The lock on a film, released when dropped.
#[derive(Debug)]
pub struct Lock {
    /// `None` if the film can't be locked.
    held: Option<(PathBuf, File)>,
}

impl Lock {
    /// Locks the film `path`, which need not exist, for this process. An error if another process has locked it. Does nothing
    /// if the file system has no locks, or if `path` is not an ordinary file.
    pub fn new(path: &Path) -> Result<Self, FileError> {
        match fs::metadata(path) {
            Ok(meta) if !meta.is_file() => return Ok(Self { held: None }),
            _ => {}
        }
        // Follow symbolic links: another process may have locked the film under its own name.
        let film = resolve(path);
        let name = film.file_name().unwrap_or_default().to_string_lossy();
        let end = name.floor_char_boundary(200);
        let beside = film.with_file_name(format!(".{}.lock", &name[..end]));
        loop {
            let file = File::options()
                .write(true)
                .create(true)
                .truncate(false)
                .open(&beside)
                .map_err(|e| FileError::io(path, "cannot create the lock file", &e))?;
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
            // The previous owner may have removed the file between opening and locking.
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
            // Remove it while it is still locked, so that no other process can lock the removed file.
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_is_locked_by_one_process_until_released() {
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
