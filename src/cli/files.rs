//! The files that a command reads and writes. No output may overwrite an input or another output.

use super::failure::Failure;
use crate::files::{atomic, resolve};
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Extensions of files that are not films.
const NOT_FILMS: [&str; 7] = ["exr", "png", "toml", "csv", "json", "html", "svg"];

/// The files that a command reads and writes. Each new file is checked against the ones added before, in any order, so that
/// a clash is found before any work is done.
#[derive(Default)]
pub struct Files {
    known: Vec<Known>,
}

struct Known {
    /// The file's role, for messages: `the scene`, `--report`.
    what: String,
    /// The path as given.
    path: PathBuf,
    /// The path with links resolved.
    real: PathBuf,
    written: bool,
}

impl Files {
    /// Adds an input. No output may be the same file.
    pub fn reads(&mut self, what: &str, path: &Path) -> Result<(), Failure> {
        self.add(what, path, false)
    }

    /// Adds an output. Also refused if it could not be written now.
    pub fn writes(&mut self, what: &str, path: &Path) -> Result<(), Failure> {
        if is_stdout(path) {
            return Err(Failure::Input(format!(
                "{what} can't be written to stdout (only --report, --dump-wgsl, --junit and --json can); name a file"
            )));
        }
        self.add(what, path, true)?;
        Ok(atomic::check_writable(path)?)
    }

    /// Adds a text output, which goes to stdout if its name is `-`.
    pub fn writes_text(&mut self, what: &str, path: &Path) -> Result<(), Failure> {
        if is_stdout(path) {
            return self.add(what, path, true);
        }
        self.writes(what, path)
    }

    /// Adds a film that is resumed, or created if it does not exist.
    pub fn writes_film(&mut self, what: &str, path: &Path) -> Result<(), Failure> {
        self.writes(what, path)?;
        match path.exists() {
            true => Ok(()),
            false => check_film_name(what, path),
        }
    }

    fn add(&mut self, what: &str, path: &Path, written: bool) -> Result<(), Failure> {
        // Devices and pipes hold no data that could be overwritten.
        if fs::metadata(path).is_ok_and(|meta| !meta.is_file()) {
            return Ok(());
        }
        let new = Known {
            what: what.into(),
            path: path.into(),
            real: if is_stdout(path) && written {
                path.into()
            } else {
                resolve(path)
            },
            written,
        };
        let same = |k: &&Known| k.real == new.real && (k.written || written);
        let clash = self.known.iter().find(same).map(|old| clash(old, &new));
        self.known.push(new);
        match clash {
            Some(message) => Err(Failure::Input(message)),
            None => Ok(()),
        }
    }
}

/// The error message for two uses of one file, at least one of which writes it.
fn clash(a: &Known, b: &Known) -> String {
    let named = |k: &Known| format!("{} {}", k.what, k.path.display());
    match (a.written, b.written) {
        (true, true) => format!(
            "{} and {} are the same file; name two different files",
            named(a),
            named(b)
        ),
        (true, false) => lost(a, b),
        _ => lost(b, a),
    }
}

fn lost(output: &Known, input: &Known) -> String {
    format!(
        "{} {} would overwrite {}{}; name another file",
        output.what,
        output.path.display(),
        input.what,
        if input.path == output.path {
            String::new()
        } else {
            format!(" {}", input.path.display())
        }
    )
}

/// Refuses a new film whose extension belongs to another kind of file.
fn check_film_name(what: &str, path: &Path) -> Result<(), Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension {
        Some(e) if NOT_FILMS.contains(&e.as_str()) => Err(Failure::Input(format!(
            "{what} {}: a film is a NumPy archive, so its name ends in .npz, not .{e}",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// Whether this name means stdout.
pub fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Writes text to a file, or to stdout if its name is `-`.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    if is_stdout(path) {
        return super::write_stdout(text);
    }
    Ok(atomic::replace(path, |f| f.write_all(text.as_bytes()))?)
}

/// What a command has written at its end, and what it could not write. An output that can't be written takes no other with it.
#[derive(Default)]
pub struct Written {
    paths: Vec<String>,
    failures: Vec<Failure>,
}

impl Written {
    /// Notes how writing `path` went.
    pub fn note<E: Into<Failure>>(&mut self, path: &Path, result: Result<(), E>) {
        match result {
            Ok(()) => self.paths.push(path.display().to_string()),
            Err(e) => self.failures.push(e.into()),
        }
    }

    /// The files that were written, for a message; `None` if there are none.
    pub fn list(&self) -> Option<String> {
        (!self.paths.is_empty()).then(|| self.paths.join(", "))
    }

    /// Prints every failure. The exit status is that of the first.
    pub fn end(self) -> Result<(), Failure> {
        self.failures.iter().for_each(Failure::print);
        match self.failures.first() {
            Some(first) => Err(Failure::Said(first.status())),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(result: Result<(), Failure>) -> String {
        result.expect_err("a clash").to_string()
    }

    #[test]
    fn outputs_overwrite_no_other_file() {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir(dir.path().join("sub")).unwrap();
        let file = |name: &str| dir.path().join(name);
        fs::write(file("s.toml"), "").unwrap();
        let mut files = Files::default();
        files.reads("the scene", &file("s.toml")).unwrap();
        files.reads("the scene again", &file("s.toml")).unwrap();
        files.writes("-o", &file("a.png")).unwrap();
        let text = message(files.writes_text("--report", &file("sub/../s.toml")));
        assert!(
            text.starts_with("--report ") && text.contains("s.toml would overwrite the scene ")
        );
        let text = message(files.writes("--watch", &file("./a.png")));
        assert!(
            text.ends_with("a.png are the same file; name two different files"),
            "{text}"
        );
        // In the other order too.
        let text = message(files.reads("the rows", &file("a.png")));
        assert!(text.starts_with("-o ") && text.contains("a.png would overwrite the rows"));
        assert!(text.ends_with("; name another file"));
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            2,
            "nothing was written"
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_devices_are_not_files() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        fs::write(file("s.toml"), "").unwrap();
        symlink("s.toml", file("link.json")).unwrap();
        symlink("new.png", file("dangling.png")).unwrap();
        symlink("loop", file("loop")).unwrap();
        let mut files = Files::default();
        files.reads("the scene", &file("s.toml")).unwrap();
        message(files.writes("--report", &file("link.json")));
        files.writes("-o", &file("dangling.png")).unwrap();
        message(files.writes("-o", &file("new.png")));
        files.reads("a loop", &file("loop")).unwrap();
        for _ in 0..2 {
            files.writes("--report", Path::new("/dev/null")).unwrap();
        }
    }

    #[test]
    fn standard_output_is_for_one_text() {
        let mut files = Files::default();
        let dash = Path::new("-");
        files.writes_text("--report", dash).unwrap();
        let text = message(files.writes_text("--dump-wgsl", dash));
        assert!(
            text.starts_with("--report - and --dump-wgsl - are the same file"),
            "{text}"
        );
        let text = message(files.writes("--html", dash));
        assert!(
            text.starts_with("--html can't be written to stdout"),
            "{text}"
        );
    }

    #[test]
    fn films_have_no_other_extension_and_read_only_ones_stay() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        for name in ["f", "f.npz", "f.NPZ", "f.film"] {
            Files::default().writes_film("--film", &file(name)).unwrap();
        }
        for name in ["f.png", "f.EXR", "f.toml"] {
            let text = message(Files::default().writes_film("--film", &file(name)));
            assert!(text.contains("its name ends in .npz"), "{text}");
        }
        fs::write(file("f.npz"), "").unwrap();
        let mut permissions = fs::metadata(file("f.npz")).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(file("f.npz"), permissions).unwrap();
        let refused = Files::default().writes_film("--film", &file("f.npz"));
        assert_eq!(refused.expect_err("protected").status(), 4);
    }
}
