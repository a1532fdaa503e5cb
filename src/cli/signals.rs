//! Ctrl-C and SIGTERM as a flag that the render loop reads; a second signal ends the process at once. And the
//! signal that must not end it.

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A write beyond the limit on file sizes (`ulimit -f`) then fails like one to a full disk, with a message, instead of
/// ending the process.
pub fn outlive_size_limits() {
    // Nobody reads the flag. Where there is no handler, the limit is as deadly as it was.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
}

/// The two signals' handlers, installed for the rest of the process.
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
        for signal in [SIGINT, SIGTERM] {
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
