//! Progress for programs: JSON objects, one a line.

use serde::Serialize;
use std::time::{Duration, Instant};

/// Time between two lines.
const PAUSE: Duration = Duration::from_millis(250);

/// One line. Keys that are not known yet, or mean nothing to the command, are left out.
#[derive(Default, Serialize)]
pub struct Line<'a> {
    /// How much of the work is done, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fraction: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds_left: Option<f64>,
    /// Samples per pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_error: Option<f64>,
    /// What is being done.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub what: Option<&'a str>,
}

/// Lines already printed.
pub struct Lines {
    last: Instant,
}

impl Lines {
    pub fn new() -> Self {
        Self {
            last: Instant::now(),
        }
    }

    /// Prints a line if one is due.
    pub fn say<'a>(&mut self, line: impl FnOnce() -> Line<'a>) {
        if self.last.elapsed() >= PAUSE {
            self.last = Instant::now();
            let json = serde_json::to_string(&line()).expect("progress is plain data");
            crate::cli::say!("{json}");
        }
    }
}
