//! Writes files atomically: to a temporary file beside the target, which is synced and renamed.
//!
//! A killed process leaves its temporary file behind. A running process holds a lock on its file,
//! so the next process that writes the same name can recognise leftovers, and removes them.

use super::{FileError, resolve};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Ending of temporary names: `.NAME.RANDOM.partial`.
const SUFFIX: &str = ".partial";

/// Replaces `path` by what `write` writes. On any error the file that was there is untouched and
/// nothing else is left in its folder.
///
/// Follows symbolic links, also to a file that does not exist yet. Writes the complete data into a device (`/dev/null`) or an
/// open pipe of this process (`/dev/stdout`) instead of replacing it. Refuses named pipes: opening one waits for a reader, and
/// [`check_writable`] would send the reader away. Permissions are those of an ordinary new file.
pub fn replace<F>(path: &Path, write: F) -> Result<(), FileError>
where
    F: FnOnce(&mut BufWriter<File>) -> io::Result<()>,
{
    replace_with(path, write).map_err(|e| FileError::io(path, "cannot write", &e))
}

/// Checks that `path` can be replaced. Call it before hours of rendering.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    let attempt = || match target(path)? {
        Target::File(file) => {
            check_not_protected(&file)?;
            temporary(&file).map(drop)
        }
        Target::Special => fs::OpenOptions::new().write(true).open(path).map(drop),
    };
    attempt().map_err(|e| FileError::io(path, "cannot write", &e))
}

/// Refuses the path of a file that can't come to be there: its folder is not there either, or it names a folder.
pub fn check_folder(path: &Path) -> Result<(), FileError> {
    let found = target(path).map(drop);
    found.map_err(|e| FileError::io(path, "cannot read", &e))
}

/// Refuses a file that its owner has made read-only: renaming a new file over it would not ask.
fn check_not_protected(path: &Path) -> io::Result<()> {
    let Ok(meta) = fs::metadata(path) else {
        return Ok(());
    };
    if meta.permissions().readonly() || fs::OpenOptions::new().write(true).open(path).is_err() {
        return Err(io::Error::other("it is read-only"));
    }
    Ok(())
}

enum Target {
    /// An ordinary file, there or not, links followed.
    File(PathBuf),
    /// A device or a pipe.
    Special,
}

fn target(path: &Path) -> io::Result<Target> {
    match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(meta) if meta.is_file() => Ok(Target::File(fs::canonicalize(path)?)),
        Ok(meta) if is_named_pipe(path, &meta) => {
            Err(io::Error::other("it is a pipe; name a file"))
        }
        Ok(_) => Ok(Target::Special),
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            if path.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
                return Err(io::Error::other("the path names a folder, not a file"));
            }
            let file = resolve(path);
            let folder = folder_of(&file);
            if !folder.exists() {
                let text = format!("no such folder \"{}\"", folder.display());
                return Err(io::Error::other(text));
            }
            Ok(Target::File(file))
        }
        Err(e) => Err(e),
    }
}

/// Whether this is a pipe or a socket with a name of its own. Those that a shell opens for this process have none
/// (`/dev/stdout`, `/dev/fd/63`).
fn is_named_pipe(path: &Path, meta: &fs::Metadata) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = meta.file_type();
        (kind.is_fifo() || kind.is_socket()) && fs::canonicalize(path).is_ok()
    }
    #[cfg(not(unix))]
    {
        let _ = (path, meta);
        false
    }
}

/// The folder of a file; "." for a bare name.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    }
}

fn prefix_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    // Room for the random part and the suffix within the 255 bytes a name may have.
    let end = name.floor_char_boundary(200);
    format!(".{}.", &name[..end])
}

fn replace_with<F>(path: &Path, write: F) -> io::Result<()>
where
    F: FnOnce(&mut BufWriter<File>) -> io::Result<()>,
{
    let fill = |file: File| -> io::Result<File> {
        let mut writer = BufWriter::with_capacity(1 << 18, file);
        write(&mut writer)?;
        writer.into_inner().map_err(|e| e.into_error())
    };
    match target(path)? {
        Target::File(path) => {
            remove_leftovers(&path);
            let temporary = temporary(&path)?;
            fill(temporary.as_file().try_clone()?)?.sync_all()?;
            temporary.persist(&path).map_err(|e| e.error)?;
            // Makes the new name survive a power failure. Some file systems refuse. The file is complete either way, so
            // this is not an error.
            let _ = File::open(folder_of(&path)).and_then(|folder| folder.sync_all());
            Ok(())
        }
        Target::Special => {
            let mut whole = fill(tempfile::tempfile()?)?;
            whole.seek(SeekFrom::Start(0))?;
            let mut to = fs::OpenOptions::new().write(true).open(path)?;
            io::copy(&mut whole, &mut to)?;
            to.flush()
        }
    }
}

/// A new, locked file beside `path`, removed when dropped.
fn temporary(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = prefix_of(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX);
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::PermissionsExt;
        // What the umask leaves of it is what any new file gets; tempfile's own default is 0600.
        builder.permissions(fs::Permissions::from_mode(0o666))
    };
    loop {
        let file = builder.tempfile_in(folder_of(path))?;
        // Where locks don't work, leftovers are not removed; nothing else depends on them.
        let _ = file.as_file().lock();
        // Another process may have taken it for a leftover before the lock was there.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes temporary files of `path` that no living process holds. What can't be removed stays: it
/// is in nobody's way.
fn remove_leftovers(path: &Path) {
    let prefix = prefix_of(path);
    let Ok(entries) = fs::read_dir(folder_of(path)) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let ours = name.starts_with(&prefix) && name.ends_with(SUFFIX);
        // Other files may have the same prefix: our names have exactly six letters between prefix and suffix.
        if !ours || name.len() != prefix.len() + 6 + SUFFIX.len() {
            continue;
        }
        if let Ok(file) = File::open(entry.path()) {
            match file.try_lock() {
                Ok(()) => {
                    let _ = fs::remove_file(entry.path());
                }
                Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(dir)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_whole_files_and_leaves_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        for text in ["first", "second"] {
            replace(&path, |f| f.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let error = replace(&path, |f| {
            f.write_all(b"half of the n")?;
            f.flush()?;
            Err(io::ErrorKind::StorageFull.into())
        })
        .unwrap_err();
        assert!(!error.is_content());
        assert!(error.to_string().contains("a.txt: cannot write: "));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn unwritable_places_are_named() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("file"), "").unwrap();
        for (path, expected) in [
            ("none/a.txt", "no such folder"),
            ("", "is a directory"),
            ("file/a.txt", "not a directory"),
        ] {
            let path = dir.path().join(path);
            for error in [
                replace(&path, |_| Ok(())).unwrap_err(),
                check_writable(&path).unwrap_err(),
            ] {
                assert!(!error.is_content());
                let text = error.to_string();
                assert!(
                    text.contains("cannot write") && text.contains(expected),
                    "{text}"
                );
            }
        }
        assert_eq!(names(dir.path()), ["file"]);
        check_writable(&dir.path().join("new")).unwrap();
        assert_eq!(names(dir.path()), ["file"]);
    }

    #[test]
    fn leftovers_of_killed_processes_are_removed_and_files_in_use_stay() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let dead = temporary(&path).unwrap();
        let (file, dead_path) = dead.keep().unwrap();
        drop(file);
        let alive = temporary(&path).unwrap();
        let other = dir.path().join(".a.npz.notes.partial.partial");
        fs::write(&other, "").unwrap();
        replace(&path, |f| f.write_all(b"x")).unwrap();
        assert!(!dead_path.exists());
        assert!(alive.path().exists() && other.exists());
    }

    #[cfg(unix)]
    #[test]
    fn permissions_links_and_devices() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let dir = tempfile::tempdir().unwrap();
        let plain = dir.path().join("plain");
        File::create(&plain).unwrap();
        let path = dir.path().join("a.txt");
        replace(&path, |f| f.write_all(b"x")).unwrap();
        let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&plain));

        let link = dir.path().join("link");
        symlink("a.txt", &link).unwrap();
        replace(&link, |f| f.write_all(b"through")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&path).unwrap(), "through");

        // A link to a file that does not exist yet, by way of another.
        fs::create_dir(dir.path().join("far")).unwrap();
        symlink("far/new", dir.path().join("dangling")).unwrap();
        symlink("dangling", dir.path().join("twice")).unwrap();
        replace(&dir.path().join("twice"), |f| f.write_all(b"far")).unwrap();
        assert!(dir.path().join("twice").is_symlink());
        let far = dir.path().join("far/new");
        assert_eq!(fs::read_to_string(far).unwrap(), "far");
        symlink("nowhere/new", dir.path().join("broken")).unwrap();
        let error = check_writable(&dir.path().join("broken")).unwrap_err();
        assert!(error.to_string().contains("no such folder"), "{error}");

        // A pipe: opening it would wait for a reader.
        let pipe = dir.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        for error in [
            check_writable(&pipe).unwrap_err(),
            replace(&pipe, |_| Ok(())).unwrap_err(),
        ] {
            assert!(error.to_string().ends_with("it is a pipe; name a file"));
        }

        replace(Path::new("/dev/null"), |f| f.write_all(b"x")).unwrap();
        let null = fs::metadata("/dev/null").unwrap();
        assert!(null.file_type().is_char_device());
        assert!(replace(Path::new("/dev/full"), |f| f.write_all(b"x")).is_err());
    }
}
