//! All who follow a render from outside: a log, the page, tev. None of them makes it wait.

use super::args::RenderArgs;
use super::events::{self, Listener};
use super::failure::Failure;
use super::files::Files;
use super::progress::Progress;
use super::say;
use crate::engine::{Counters, DeviceInfo};
use crate::film::Film;
use crate::log::{Event, LogFile, Message, Start};
use crate::provenance::Provenance;
use crate::run::Tally;
use crate::watch::{About, Address, Board, Picture, Run, Server, Snapshot, Stopped, Tev};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Shortest time between two copies of the film.
const PAUSE: Duration = Duration::from_secs(1);

/// Copies, and what the server makes of them, take at most 1/50 of the time: large pictures are shown less often. While nobody looks,
/// nothing is copied.
const SHARE: u32 = 50;

/// Who follows.
pub struct Audience {
    page: Option<Page>,
    tev: Option<Tev>,
    /// When the film was last copied, and the time that has taken so far.
    copied: Option<Instant>,
    cost: Duration,
    source: Option<(Arc<Provenance>, DeviceInfo)>,
}

struct Page {
    run: Arc<Run>,
    server: Stopped,
}

/// What messages of the server's start share.
fn cannot_listen(address: &Address, e: &std::io::Error) -> Failure {
    let reason = crate::files::reason(e);
    Failure::Address(format!("--listen {address}: {reason}"))
}

/// Takes the address of a page, and says where it is.
pub fn bind(address: &Address, quiet: bool) -> Result<Server, Failure> {
    let server = Server::bind(address).map_err(|e| cannot_listen(address, &e))?;
    if server.is_public() {
        say!(
            "warning: --listen {address}: everyone who can reach this address can see the page, with the picture and the scene; \
             127.0.0.1 is for this machine alone"
        );
    }
    // Nobody else knows which port was free.
    if !quiet || address.port == 0 {
        say!("the page is at {}", server.url());
    }
    Ok(server)
}

/// Serves a board.
pub fn serve(
    server: Server,
    board: &Arc<Board>,
    hosts: &[String],
    address: &Address,
) -> Result<Stopped, Failure> {
    let served = server.serve(board.clone(), hosts.to_vec());
    served.map_err(|e| cannot_listen(address, &e))
}

/// A file's name without its folder.
pub fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

impl Audience {
    /// Takes the page's address and finds tev, before anything is rendered.
    pub fn gather(args: &RenderArgs) -> Result<Self, Failure> {
        let page = match &args.listen {
            Some(address) => Some(Page::open(args, address)?),
            None => None,
        };
        let tev = match &args.tev {
            Some(address) => {
                let connected = Tev::connect(address, &name_of(&args.scene));
                Some(connected.map_err(|e| {
                    let reason = crate::files::reason(&e);
                    Failure::Address(format!(
                        "--tev {address}: {reason}; start tev first, which listens at 127.0.0.1:14158"
                    ))
                })?)
            }
            None => None,
        };
        Ok(Self {
            page,
            tev,
            copied: None,
            cost: Duration::ZERO,
            source: None,
        })
    }

    /// Opens the log. With `go_on` it keeps its lines.
    pub fn open_log(&self, path: Option<&Path>, go_on: bool) -> Result<(), Failure> {
        if let Some(path) = path {
            let file = LogFile::open(path, go_on)?;
            events::listen(Box::new(Log { file: Some(file) }));
        }
        Ok(())
    }

    /// The run begins, of a film that comes from `before`.
    pub fn start(&mut self, start: Start, before: &Provenance, device: &DeviceInfo) {
        if let Some(page) = &self.page {
            let mut with_device = before.clone();
            with_device.add_work(device, Counters::default(), 0.0);
            page.run
                .begin(About::of(&start, true, Some(Arc::new(with_device))));
        }
        self.source = Some((Arc::new(before.clone()), device.clone()));
        events::emit(&Event::Start(Box::new(start)), true);
    }

    /// Shows the film to those who look at it, if that is due.
    pub fn meanwhile(&mut self, film: &Film, tally: &Tally, progress: &Progress) {
        let asks = self.page.as_ref().is_some_and(|p| p.run.is_wanted());
        let tev_asks = self.tev.as_ref().is_some_and(Tev::is_ready);
        if asks || tev_asks {
            self.cost += self.page.as_ref().map_or(Duration::ZERO, |p| p.run.spent());
            let pause = PAUSE.max(self.cost * SHARE);
            if self.copied.is_none_or(|at| at.elapsed() >= pause) {
                self.show(film, tally);
            }
        }
        if let Some(problem) = self.tev.as_ref().and_then(Tev::problem) {
            progress.aside(|| say!("warning: {problem}"));
        }
    }

    fn show(&mut self, film: &Film, tally: &Tally) {
        let Some((before, device)) = &self.source else {
            return;
        };
        let begun = Instant::now();
        let snapshot = Arc::new(Snapshot::of_run(film, before, device, tally));
        if let Some(page) = &self.page {
            page.run.publish(Picture::Held(snapshot.clone()), None);
        }
        if let Some(tev) = self.tev.as_ref().filter(|t| t.is_ready()) {
            tev.send(snapshot);
        }
        self.copied = Some(Instant::now());
        self.cost = begun.elapsed();
    }

    /// Shows the film as it is at the end.
    pub fn show_end(&mut self, film: &Film, tally: &Tally) {
        if film.coverage.is_empty() {
            return;
        }
        let Some((before, device)) = &self.source else {
            return;
        };
        let looked_at = self.page.as_ref().filter(|p| p.run.is_looked_at());
        if looked_at.is_none() && self.tev.is_none() {
            return;
        }
        let snapshot = Arc::new(Snapshot::of_run(film, before, device, tally));
        if let Some(page) = looked_at {
            page.run.publish(Picture::Held(snapshot.clone()), None);
        }
        if let Some(tev) = &self.tev {
            tev.send(snapshot);
        }
    }

    /// The command ends: those who look get the last picture, but do not hold it up for long.
    pub fn leave(self) {
        if let Some(tev) = self.tev
            && let Some(problem) = tev.finish()
        {
            say!("warning: {problem}");
        }
        if let Some(page) = self.page {
            page.server.after_last_look();
        }
    }
}

impl Page {
    fn open(args: &RenderArgs, address: &Address) -> Result<Self, Failure> {
        let server = bind(address, args.talk.quiet)?;
        let board = Arc::<Board>::default();
        let scene = name_of(&args.scene);
        let stem = args.scene.file_stem().unwrap_or_default();
        let about = About {
            title: scene.clone(),
            file: scene,
            live: true,
            ..About::default()
        };
        let run = board.add(&stem.to_string_lossy(), about);
        let server = serve(server, &board, &args.host, address)?;
        events::listen(Box::new(OnPage(run.clone())));
        Ok(Self { run, server })
    }
}

/// Puts events on the page.
struct OnPage(Arc<Run>);

impl Listener for OnPage {
    fn hear(&mut self, event: &Event, kept: bool) {
        match event {
            Event::Progress(point) => self.0.point(*point, kept),
            Event::End(end) => {
                self.0.point(end.point, true);
                self.0.end(Some(end.stop_reason.clone()));
            }
            Event::Message(message) => self.0.message(public(message)),
            Event::Start(_) | Event::Step(_) => {}
        }
    }
}

/// A message as anyone may read it: files are called by their names alone, without folders.
fn public(message: &Message) -> Message {
    let words = message.text.split(' ').map(|word| {
        let path = word.trim_end_matches([',', ':', ';']);
        let is_path = path.contains('/') && !path.contains("://");
        match Path::new(path).file_name().filter(|_| is_path) {
            Some(name) => format!("{}{}", name.to_string_lossy(), &word[path.len()..]),
            None => word.to_owned(),
        }
    });
    Message {
        level: message.level,
        text: words.collect::<Vec<_>>().join(" "),
    }
}

/// Keeps events in a file.
struct Log {
    file: Option<LogFile>,
}

impl Listener for Log {
    fn hear(&mut self, event: &Event, kept: bool) {
        if let Some(file) = self.file.as_mut().filter(|_| kept)
            && let Err(e) = file.add(event)
        {
            // A full disk ends the log, not the render.
            self.file = None;
            events::only_stderr(&format!("warning: {e}; the log ends here"));
        }
    }
}

/// Refuses what can't be written, or would overwrite another file.
pub fn check_files(args: &RenderArgs, files: &mut Files) -> Result<(), Failure> {
    match &args.log {
        Some(path) => files.writes("--log", path),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_folder_is_on_the_page() {
        for (line, shown) in [
            ("wrote /home/me/night/a.exr, b.png", "wrote a.exr, b.png"),
            (
                "warning: ../x/a.npz: cannot write: disk full",
                "a.npz: cannot write: disk full",
            ),
            (
                "the page is at http://127.0.0.1:80/",
                "the page is at http://127.0.0.1:80/",
            ),
            ("box: 24x16, 1 spp", "box: 24x16, 1 spp"),
            ("16 / 2 samples", "16 / 2 samples"),
        ] {
            assert_eq!(public(&Message::of(line)).text, shown);
        }
    }
}
