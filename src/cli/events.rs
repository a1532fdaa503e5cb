//! What the command says: lines on stderr for people or for programs, and the same for all who listen to this process.

use super::args::{ProgressStyle, Talk};
use crate::log::{Event, Message};
use std::io::Write;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, MutexGuard};

/// Writes a line to stderr, and tells it to all who listen. Unlike `eprintln!`, it does not panic if stderr is closed.
macro_rules! say {
    ($($text:tt)*) => { $crate::cli::events::say_line(&format!($($text)*)) };
}
pub(crate) use say;

/// Hears every event. It must not wait for anything, and not say anything itself.
pub trait Listener: Send {
    /// `kept` events belong into a log. The others say only where the run stands now, and come about once a second.
    fn hear(&mut self, event: &Event, kept: bool);
}

/// Lines for people.
const TEXT: u8 = 0;
/// JSON lines.
const JSON: u8 = 1;
/// JSON lines, but only of messages.
const JSON_MESSAGES: u8 = 2;

/// What stderr gets. There is one stderr, so there is one of these.
static STDERR: AtomicU8 = AtomicU8::new(TEXT);

static LISTENERS: Mutex<Vec<Box<dyn Listener>>> = Mutex::new(Vec::new());

fn listeners() -> MutexGuard<'static, Vec<Box<dyn Listener>>> {
    LISTENERS.lock().unwrap_or_else(|p| p.into_inner())
}

/// Sets what stderr gets from now on.
pub fn set_style(talk: &Talk) {
    let style = match (talk.progress, talk.quiet) {
        (ProgressStyle::Json, false) => JSON,
        (ProgressStyle::Json, true) => JSON_MESSAGES,
        _ => TEXT,
    };
    STDERR.store(style, Ordering::Relaxed);
}

/// From now on `listener` hears everything.
pub fn listen(listener: Box<dyn Listener>) {
    listeners().push(listener);
}

/// Whether anyone hears more than lines for people.
pub fn are_heard() -> bool {
    STDERR.load(Ordering::Relaxed) == JSON || !listeners().is_empty()
}

/// A line for people: see [`say!`].
pub fn say_line(text: &str) {
    only_stderr(text);
    tell(&Event::Message(Message::of(text)), true);
}

/// A line that no listener hears.
pub fn only_stderr(text: &str) {
    let mut stderr = std::io::stderr();
    let _ = match STDERR.load(Ordering::Relaxed) {
        TEXT => writeln!(stderr, "{text}"),
        _ => stderr.write_all(Event::Message(Message::of(text)).line().as_bytes()),
    };
}

/// Any other event.
pub fn emit(event: &Event, kept: bool) {
    if kept && STDERR.load(Ordering::Relaxed) == JSON {
        let _ = std::io::stderr().write_all(event.line().as_bytes());
    }
    tell(event, kept);
}

fn tell(event: &Event, kept: bool) {
    for listener in listeners().iter_mut() {
        listener.hear(event, kept);
    }
}
