//! What became of a case, and what keeps it from being compared.

use super::{Bless, Case};
use crate::compare::Comparison;
use crate::files::FileError;
use crate::scene::parse::ReadError;

/// Why a case could not be compared.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// The scene or a film can't be used; why.
    Input(String),
    /// The golden can't be used, and another one would mend that; why.
    Golden(String),
    /// The scene was changed since its golden was made; in what.
    Changed(String),
    /// There is no engine, or it failed; why.
    Device(String),
    /// A file can't be read or written; why.
    Access(String),
}

impl Trouble {
    /// The same with what to type, where another golden would help.
    pub(super) fn advised(self, case: &Case) -> Self {
        let command = case.bless_command();
        match self {
            Trouble::Golden(why) => Trouble::Golden(format!("{why}; re-create it: {command}")),
            Trouble::Changed(why) => Trouble::Changed(format!(
                "{why}; if the change is intended, re-create the golden: {command}"
            )),
            other => other,
        }
    }
}

impl From<String> for Trouble {
    fn from(why: String) -> Self {
        Self::Input(why)
    }
}

impl From<FileError> for Trouble {
    fn from(e: FileError) -> Self {
        if e.is_content() {
            Self::Input(e.to_string())
        } else {
            Self::Access(e.to_string())
        }
    }
}

impl From<ReadError> for Trouble {
    fn from(e: ReadError) -> Self {
        match &e {
            ReadError::Io { .. } => Self::Access(e.to_string()),
            ReadError::Invalid(all) if all.iter().all(|d| d.unreadable) => {
                Self::Access(e.to_string())
            }
            ReadError::Invalid(_) => Self::Input(e.to_string()),
        }
    }
}

impl From<Trouble> for Outcome {
    fn from(trouble: Trouble) -> Self {
        match trouble {
            Trouble::Input(why) | Trouble::Golden(why) | Trouble::Changed(why) => {
                Outcome::Unusable(why)
            }
            Trouble::Device(why) => Outcome::NoDevice(why),
            Trouble::Access(why) => Outcome::NoAccess(why),
        }
    }
}

/// The result of a case.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The same up to its noise.
    Passed(Box<Comparison>),
    /// Different.
    Failed {
        /// What differs.
        comparison: Box<Comparison>,
        /// Why the evidence, a film and a page, could not be saved.
        unsaved: Option<String>,
    },
    /// A scene without a golden.
    New,
    /// A golden without a scene.
    Orphaned,
    /// The scene or the golden can't be used; why.
    Unusable(String),
    /// Nothing could be rendered; why.
    NoDevice(String),
    /// A file could not be read or written; why.
    NoAccess(String),
    /// A golden was written.
    Blessed(Bless),
    /// A golden was left as it is, because the scene still passes.
    Kept(Box<Comparison>),
}

impl Outcome {
    /// Its word in lists.
    pub fn word(&self) -> &'static str {
        match self {
            Outcome::Passed(_) => "passed",
            Outcome::Failed { .. } => "FAILED",
            Outcome::New => "new",
            Outcome::Orphaned => "orphaned",
            Outcome::Unusable(_) => "unusable",
            Outcome::NoDevice(_) => "no device",
            Outcome::NoAccess(_) => "no access",
            Outcome::Blessed(_) => "blessed",
            Outcome::Kept(_) => "kept",
        }
    }

    /// Whether all is well.
    pub fn good(&self) -> bool {
        matches!(
            self,
            Outcome::Passed(_) | Outcome::Blessed(_) | Outcome::Kept(_)
        )
    }

    /// The result in one line.
    pub fn detail(&self, case: &Case) -> String {
        match self {
            Outcome::Passed(c) | Outcome::Failed { comparison: c, .. } => c.sentence(),
            Outcome::New => format!(
                "{} does not exist; create it: {}",
                case.golden_path().display(),
                case.bless_command()
            ),
            Outcome::Orphaned => format!(
                "{} does not exist; remove the golden if this is intended",
                case.scene_path().display()
            ),
            Outcome::Unusable(why) | Outcome::NoDevice(why) | Outcome::NoAccess(why) => why.clone(),
            Outcome::Blessed(b) => b.to_string(),
            Outcome::Kept(c) => format!("the golden still passes: {}", c.sentence()),
        }
    }
}
