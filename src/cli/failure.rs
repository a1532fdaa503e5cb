//! Failures of a command, and their exit statuses.

use crate::engine::EngineError;
use crate::files::FileError;
use crate::render::Error;
use crate::scene::Diagnostic;
use crate::scene::parse::ReadError;

/// Why a command ended without success. Only [`Failure::status`] maps it to an exit status, and only
/// [`Failure::print`] prints it.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A bad command line, or inputs that don't fit together.
    #[error("{0}")]
    Input(String),
    /// A scene file is invalid, or files that it names can't be read; one message for each place.
    #[error("the scene has {} errors", .0.len())]
    Scene(Vec<Diagnostic>),
    /// No usable adapter, or the device failed.
    #[error("{0}")]
    Device(String),
    /// A file can't be read or written, or its content is invalid.
    #[error(transparent)]
    File(#[from] FileError),
    /// A signal came, and the results so far have been saved.
    #[error("interrupted")]
    Interrupted {
        /// SIGHUP is 1, SIGINT 2, SIGTERM 15.
        signal: u8,
    },
    /// An address can't be listened at, or reached.
    #[error("{0}")]
    Address(String),
    /// The messages have been printed already; only the exit status is left.
    #[error("failed")]
    Said(u8),
}

impl Failure {
    /// The exit status.
    pub fn status(&self) -> u8 {
        match self {
            Failure::Scene(all) if all.iter().all(|d| d.unreadable) => 4,
            Failure::Input(_) | Failure::Scene(_) => 2,
            Failure::Device(_) => 3,
            Failure::File(e) if e.is_content() => 2,
            Failure::File(_) | Failure::Address(_) => 4,
            Failure::Interrupted { signal } => 128 + signal,
            Failure::Said(status) => *status,
        }
    }

    /// Prints it on stderr: `error: `, the message, and the chain of causes.
    pub fn print(&self) {
        match self {
            Failure::Scene(diagnostics) => {
                for d in diagnostics {
                    super::say!("error: {d}");
                }
            }
            // The command's last lines have reported these.
            Failure::Interrupted { .. } | Failure::Said(_) => {}
            _ => {
                let mut text = format!("error: {self}");
                let mut cause = std::error::Error::source(self);
                while let Some(c) = cause {
                    text += &format!(": {c}");
                    cause = c.source();
                }
                super::say!("{text}");
            }
        }
    }
}

impl From<EngineError> for Failure {
    fn from(e: EngineError) -> Self {
        Failure::Device(e.to_string())
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        match e {
            Error::Scene(diagnostics) => Failure::Scene(diagnostics),
            Error::Input(why) => Failure::Input(why),
            Error::Device(why) => Failure::Device(why),
            Error::File(e) => e.into(),
            Error::Stopped => Failure::Said(130),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(e: ReadError) -> Self {
        Error::from(e).into()
    }
}
