//! Ctrl-C, SIGTERM and SIGHUP as a flag that the render loop reads; a second signal ends the process at once. And the
//! signal that must not end it.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::{fs, io};

/// A write beyond the limit on file sizes (`ulimit -f`) then fails like one to a full disk, with a message, instead of
/// ending the process.
pub fn outlive_size_limits() {
    // Nobody reads the flag. Where there is no handler, the limit is as deadly as it was.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
}

/// The signals' handlers, installed for the rest of the process.
pub struct Signals {
    /// Set by the first signal.
    pub stop: Arc<AtomicBool>,
    /// Its number; 0 before.
    number: Arc<AtomicUsize>,
}

impl Signals {
    /// Installs the handlers.
    pub fn install() -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let number = Arc::new(AtomicUsize::new(0));
        // What a terminal that goes away sends; `nohup` has it ignored, and so it stays then.
        let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hang_up) {
            // Handlers run in this order: the first signal finds `stop` unset and sets it.
            signal_hook::flag::register_conditional_shutdown(
                signal,
                128 + signal,
                Arc::clone(&stop),
            )?;
            signal_hook::flag::register_usize(signal, Arc::clone(&number), signal as usize)?;
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        Ok(Self { stop, number })
    }

    /// The signal that set `stop`.
    pub fn number(&self) -> u8 {
        self.number.load(Ordering::Relaxed) as u8
    }
}

/// Whether the process was started with this signal ignored. Where the system does not tell (Linux does), so that a handler
/// could undo it: as if it were.
fn is_ignored(signal: i32) -> bool {
    let mask = || {
        let status = fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find_map(|l| l.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(line.trim(), 16).ok()
    };
    mask().is_none_or(|ignored| ignored >> (signal - 1) & 1 == 1)
}
