//! Signal handlers. Ctrl-C, SIGTERM and SIGHUP set a flag that the render loop reads, and a second signal ends the process at
//! once. SIGXFSZ must not end the process.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::{fs, io};

/// Handles SIGXFSZ, so that a write beyond the file size limit (`ulimit -f`) fails with a message, like one to a full disk,
/// instead of ending the process.
pub fn outlive_size_limits() {
    // Nobody reads the flag. If the handler can't be installed, the signal still ends the process.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
}

/// Handlers that stay installed for the rest of the process.
pub struct Signals {
    /// Set by the first signal.
    pub stop: Arc<AtomicBool>,
    /// The number of that signal; 0 before it.
    number: Arc<AtomicUsize>,
}

impl Signals {
    /// Installs the handlers.
    pub fn install() -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let number = Arc::new(AtomicUsize::new(0));
        // A terminal sends SIGHUP when it closes. `nohup` makes the process ignore it, and that must stay so.
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

/// Whether the process was started with this signal ignored. Only Linux tells; elsewhere the answer is yes, since a handler
/// would undo it.
fn is_ignored(signal: i32) -> bool {
    let mask = || {
        let status = fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find_map(|l| l.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(line.trim(), 16).ok()
    };
    mask().is_none_or(|ignored| ignored >> (signal - 1) & 1 == 1)
}
