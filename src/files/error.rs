//! File errors, in the two kinds that have different exit statuses.

use std::io;
use std::path::{Path, PathBuf};

/// A file that can't be read or written (exit status 4), or whose content is invalid (exit status 2).
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// Missing, a directory, not readable or writable, disk full.
    #[error("{}: {message}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What failed, and the system's reason.
        message: String,
    },
    /// There, but not what it should be: another format, damaged, inconsistent.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
}

impl FileError {
    /// `action` on `path` failed with `error`: "cannot read", "cannot write".
    pub fn io(path: &Path, action: &str, error: &io::Error) -> Self {
        Self::Io {
            path: path.into(),
            message: format!("{action}: {}", reason(error)),
        }
    }

    /// The content of `path` is wrong.
    pub fn content(path: &Path, message: impl Into<String>) -> Self {
        Self::Content {
            path: path.into(),
            message: message.into(),
        }
    }

    /// A failure while decoding `path`: of the system if the system gave it a number, else of the content.
    pub fn reading(path: &Path, error: &io::Error) -> Self {
        if error.raw_os_error().is_some() {
            Self::io(path, "cannot read", error)
        } else if error.kind() == io::ErrorKind::UnexpectedEof {
            Self::content(path, "truncated: it ends too early")
        } else {
            Self::content(path, format!("damaged: {error}"))
        }
    }

    /// What is wrong, without the file's name.
    pub fn message(&self) -> &str {
        match self {
            Self::Io { message, .. } | Self::Content { message, .. } => message,
        }
    }

    /// Whether the content is at fault, not access to it.
    pub fn is_content(&self) -> bool {
        matches!(self, Self::Content { .. })
    }
}

/// The system's words, without its error number.
pub(crate) fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or(&text);
    let mut chars = text.chars();
    match chars.next() {
        Some(first) => first.to_lowercase().chain(chars).collect(),
        None => text.into(),
    }
}

/// Opens a file to read it; a missing one and a directory are named as such.
pub fn open(path: &Path) -> Result<std::fs::File, FileError> {
    let file = std::fs::File::open(path).map_err(|e| FileError::io(path, "cannot read", &e))?;
    let meta = file
        .metadata()
        .map_err(|e| FileError::io(path, "cannot read", &e))?;
    if meta.is_dir() {
        let e = io::Error::from(io::ErrorKind::IsADirectory);
        return Err(FileError::io(path, "cannot read", &e));
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_files_and_directories_are_io() {
        let dir = tempfile::tempdir().unwrap();
        let missing = open(&dir.path().join("none.exr")).unwrap_err();
        assert!(!missing.is_content());
        assert!(
            missing
                .to_string()
                .ends_with("none.exr: cannot read: no such file or directory"),
            "{missing}"
        );
        let folder = open(dir.path()).unwrap_err();
        assert!(!folder.is_content());
        assert!(folder.to_string().contains("is a directory"), "{folder}");
    }

    #[test]
    fn decoder_errors_are_content_and_system_errors_are_not() {
        let path = Path::new("x");
        let decoder = io::Error::new(io::ErrorKind::InvalidData, "bad block");
        assert!(FileError::reading(path, &decoder).is_content());
        assert!(FileError::reading(path, &io::ErrorKind::UnexpectedEof.into()).is_content());
        assert!(!FileError::reading(path, &io::Error::from_raw_os_error(5)).is_content());
    }
}
