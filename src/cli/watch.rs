//! `etendue watch`: a page on which films grow that other processes write.

use super::args::WatchArgs;
use super::audience::{bind, serve};
use super::failure::Failure;
use super::say;
use super::signals::Signals;
use crate::files::atomic;
use crate::output::store;
use crate::watch::{Board, Files, MOST_FILMS};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two looks at the files.
const PAUSE: Duration = Duration::from_secs(1);

/// A signal is obeyed within this time.
const TURN: Duration = Duration::from_millis(50);

/// Looking at files takes at most 1/10 of the time: folders on a slow disk are looked at less often.
const SHARE: u32 = 10;

/// Serves the page until a signal comes.
pub fn watch(args: &WatchArgs) -> Result<(), Failure> {
    // A film that isn't there yet will come, to a folder that is there. One that can't be read is a mistake now, and a matter for the page
    // later.
    for path in args.paths.iter().filter(|p| !p.is_dir()) {
        if path.exists() {
            store::outline(path)?;
            continue;
        }
        atomic::check_folder(path)?;
        if !args.quiet {
            let path = path.display();
            say!("note: {path} does not exist yet; waiting for a film of this name");
        }
    }
    let signals =
        Signals::install().map_err(|e| Failure::Device(format!("cannot handle signals: {e}")))?;
    let server = bind(&args.listen, args.quiet)?;
    let board = Arc::<Board>::default();
    let mut files = Files::new(args.paths.clone(), args.error);
    files.poll(&board);
    if board.runs().len() >= MOST_FILMS {
        say!("warning: only the first {MOST_FILMS} films are on the page");
    }
    let server = serve(server, &board, &args.host, &args.listen)?;
    let mut pause = PAUSE;
    let mut looked = Instant::now();
    while !signals.stop.load(Ordering::Relaxed) {
        sleep(TURN);
        if looked.elapsed() >= pause {
            let begun = Instant::now();
            files.poll(&board);
            looked = Instant::now();
            pause = PAUSE.max(begun.elapsed() * SHARE);
        }
    }
    drop(server);
    Err(Failure::Interrupted {
        signal: signals.number(),
    })
}
