//! Shows on a terminal what happens before the first sample, which takes seconds for a scene with a million objects.

use super::args::Talk;
use super::progress::{clock, has_bar};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::JoinHandle;
use std::time::Duration;

/// A shorter stage is not shown.
const PATIENCE: Duration = Duration::from_millis(300);

/// Time between two frames of the spinner.
const TURN: Duration = Duration::from_millis(100);

/// The stages of a command, one at a time. Shows those that take long.
pub struct Stages {
    shown: bool,
    now: Option<Stage>,
}

impl Stages {
    /// Shows stages where progress is a bar.
    pub fn new(talk: &Talk) -> Self {
        Self {
            shown: has_bar(talk),
            now: None,
        }
    }

    /// Ends the current stage and begins another.
    pub fn begin(&mut self, name: impl Into<String>) {
        self.end();
        self.now = self.shown.then(|| Stage::new(name.into()));
    }

    /// Ends the current stage, so that other lines can be printed.
    pub fn end(&mut self) {
        self.now = None;
    }
}

/// The current stage, which ends when it is dropped.
struct Stage {
    bar: ProgressBar,
    /// Dropped when the stage ends, which wakes the waiting thread.
    ended: Option<Sender<()>>,
    waiting: Option<JoinHandle<()>>,
}

impl Stage {
    fn new(name: String) -> Self {
        let style = ProgressStyle::with_template("{spinner} {msg}, {clock}")
            .unwrap_or(ProgressStyle::default_spinner())
            .with_key("clock", |state: &ProgressState, to: &mut dyn Write| {
                let _ = to.write_str(&clock(state.elapsed().as_secs_f64()));
            });
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr())
            .with_style(style)
            .with_message(name);
        let (ended, end) = mpsc::channel();
        let spinner = bar.clone();
        let waiting = std::thread::spawn(move || {
            if end.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                spinner.enable_steady_tick(TURN);
            }
        });
        Self {
            bar,
            ended: Some(ended),
            waiting: Some(waiting),
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.ended = None;
        if let Some(waiting) = self.waiting.take() {
            let _ = waiting.join();
        }
        self.bar.finish_and_clear();
    }
}
