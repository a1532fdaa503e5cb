//! What the page shows: written by who renders, read by the server.

use super::snapshot::Picture;
use crate::log::{Level, Message, Point, Start, Target};
use crate::provenance::Provenance;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// Messages that are kept; older ones are forgotten.
const MOST_MESSAGES: usize = 100;

/// A picture counts as looked at for so long after it was asked for.
const LOOKED_AT: Duration = Duration::from_secs(10);

/// All runs on the page.
#[derive(Debug)]
pub struct Board {
    runs: Mutex<Vec<Arc<Run>>>,
    /// Counts changes, and wakes who waits for the next.
    changes: watch::Sender<u64>,
    pace: watch::Sender<Pace>,
}

/// How soon clients hear of changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Now and then.
    Calm,
    /// At once: the end is near.
    Hurried,
    /// For the last time.
    Last,
}

impl Default for Board {
    fn default() -> Self {
        Self {
            runs: Mutex::default(),
            changes: watch::Sender::new(0),
            pace: watch::Sender::new(Pace::Calm),
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|p| p.into_inner())
}

impl Board {
    /// Adds a run. `name` is what its downloads are called, without extension; `film` is whether there is a film to show.
    pub fn add(&self, name: &str, about: About) -> Arc<Run> {
        let mut runs = locked(&self.runs);
        let run = Arc::new(Run {
            id: runs.len(),
            name: name.into(),
            changes: self.changes.clone(),
            wanted: AtomicBool::new(false),
            spent: AtomicU64::new(0),
            state: Mutex::new(State::new(about)),
        });
        runs.push(run.clone());
        drop(runs);
        run.change(|_| ());
        run
    }

    /// All runs, in the order in which they came.
    pub fn runs(&self) -> Vec<Arc<Run>> {
        locked(&self.runs).clone()
    }

    /// The run with this number.
    pub fn run(&self, id: usize) -> Option<Arc<Run>> {
        locked(&self.runs).get(id).cloned()
    }

    /// Wakes at every change.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// How soon a client is to hear of changes. Who holds this is a client of the events.
    pub fn pace(&self) -> watch::Receiver<Pace> {
        self.pace.subscribe()
    }

    /// Sets the pace of all clients, and wakes them.
    pub fn set_pace(&self, pace: Pace) {
        self.pace.send_replace(pace);
    }

    /// Clients of the events.
    pub fn clients(&self) -> usize {
        self.pace.receiver_count()
    }
}

/// One picture on the page.
#[derive(Debug)]
pub struct Run {
    /// Its number.
    pub id: usize,
    /// What its downloads are called, without extension.
    pub name: String,
    changes: watch::Sender<u64>,
    /// Whether someone waits for a newer snapshot.
    wanted: AtomicBool,
    /// Microseconds that the server has spent on pictures.
    spent: AtomicU64,
    state: Mutex<State>,
}

/// What does not change while a run goes on.
#[derive(Debug, Clone, Default, Serialize)]
pub struct About {
    /// The scene's title, else its file's name.
    pub title: String,
    /// The file's name, without its folder.
    pub file: String,
    /// Width and height of the whole picture.
    pub size: [u32; 2],
    /// The parts that are rendered, x0, y0, x1, y1; empty for the whole picture.
    pub regions: Vec<[u32; 4]>,
    /// What renders, in few words.
    pub adapter: String,
    /// The stop conditions.
    pub target: Target,
    /// Seconds of rendering before this run.
    pub seconds_before: f64,
    /// Whether this process renders it; else it is a file that another one writes.
    pub live: bool,
    /// Provenance, for the page's last part.
    #[serde(skip)]
    pub provenance: Option<Arc<Provenance>>,
}

impl About {
    /// Of a run that begins so.
    pub fn of(start: &Start, live: bool, provenance: Option<Arc<Provenance>>) -> Self {
        Self {
            title: start.title.clone().unwrap_or_else(|| start.scene.clone()),
            file: start.film.clone().unwrap_or_else(|| start.scene.clone()),
            size: start.resolution,
            regions: start.regions.clone(),
            adapter: start.adapter.brief(),
            target: start.target,
            seconds_before: start.held.seconds,
            live,
            provenance,
        }
    }
}

/// A change since a [`Cursor`], as the page gets it.
#[derive(Debug, Serialize)]
pub struct Update {
    id: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    about: Option<About>,
    now: Option<Point>,
    /// Seconds over all runs, samples, relative error, its uncertainty: the points since the last update, or all with `about`.
    curve: Vec<[f64; 4]>,
    messages: Vec<Message>,
    ended: Option<String>,
    problem: Option<String>,
    /// The number of the latest snapshot; 0 while there is none.
    picture: u64,
    /// When the file was saved, in seconds since 1970.
    saved: Option<f64>,
}

/// How far a client has read a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cursor {
    revision: u64,
    epoch: u64,
    curve: usize,
    messages: usize,
}

#[derive(Debug)]
struct State {
    about: About,
    /// Counts all changes.
    revision: u64,
    /// Counts new beginnings: another `about`, another curve.
    epoch: u64,
    now: Option<Point>,
    curve: Vec<[f64; 4]>,
    messages: Vec<Message>,
    ended: Option<String>,
    problem: Option<String>,
    saved: Option<f64>,
    picture: Option<Picture>,
    /// Counts snapshots.
    version: u64,
    /// When a picture was last asked for, and the newest version that was given.
    looked: Option<Instant>,
    given: u64,
}

impl State {
    fn new(about: About) -> Self {
        Self {
            about,
            revision: 0,
            epoch: 1,
            now: None,
            curve: Vec::new(),
            messages: Vec::new(),
            ended: None,
            problem: None,
            saved: None,
            picture: None,
            version: 0,
            looked: None,
            given: 0,
        }
    }
}

impl Run {
    fn change(&self, how: impl FnOnce(&mut State)) {
        {
            let mut state = locked(&self.state);
            how(&mut state);
            state.revision += 1;
        }
        self.changes.send_modify(|n| *n += 1);
    }

    /// Starts over: other facts, and an empty curve.
    pub fn begin(&self, about: About) {
        self.change(|s| {
            s.about = about;
            s.epoch += 1;
            s.curve.clear();
            s.now = None;
            s.ended = None;
        });
    }

    /// Where it stands now; a `kept` point is one of its curve.
    pub fn point(&self, point: Point, kept: bool) {
        self.change(|s| {
            s.now = Some(point);
            let e = point.error;
            if let (true, Some(error), Some(seconds)) = (kept, e.relative_error, e.seconds) {
                let seconds = s.about.seconds_before + seconds;
                if s.curve.last().is_none_or(|last| last[0] < seconds) {
                    let [samples, uncertainty] =
                        [e.samples, e.uncertainty].map(Option::unwrap_or_default);
                    s.curve.push([seconds, samples, error, uncertainty]);
                }
            }
        });
    }

    /// All of it, as a file tells it. The curve has seconds over all runs, samples, relative error and its uncertainty.
    pub fn set(
        &self,
        about: About,
        now: Point,
        curve: Vec<[f64; 4]>,
        messages: Vec<Message>,
        ended: Option<String>,
    ) {
        self.change(|s| {
            s.epoch += 1;
            s.about = about;
            s.now = Some(now);
            s.curve = curve;
            s.messages = messages;
            s.messages.truncate(MOST_MESSAGES);
            s.ended = ended;
            s.problem = None;
        });
    }

    /// A line of text.
    pub fn message(&self, message: Message) {
        self.change(|s| {
            if s.messages.len() == MOST_MESSAGES {
                // Warnings are worth more than what a person reads once.
                let less = s.messages.iter().position(|m| m.level == Level::Info);
                s.messages.remove(less.unwrap_or(0));
                s.epoch += 1;
            }
            s.messages.push(message);
        });
    }

    /// It has ended, for this reason.
    pub fn end(&self, reason: Option<String>) {
        self.change(|s| s.ended = reason);
    }

    /// Why its file can't be read; the last picture stays.
    pub fn problem(&self, problem: Option<String>) {
        // It is said again and again, and is news only once.
        if locked(&self.state).problem != problem {
            self.change(|s| s.problem = problem);
        }
    }

    /// Another picture. `saved` is when its file was saved.
    pub fn publish(&self, picture: Picture, saved: Option<f64>) {
        self.wanted.store(false, Ordering::Relaxed);
        let mut old = None;
        self.change(|s| {
            old = s.picture.replace(picture);
            s.version += 1;
            s.saved = saved;
        });
        // Freeing a large film takes time, which the lock need not be held for.
        drop(old);
    }

    /// Whether someone waits for a newer snapshot than there is.
    pub fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Counts time that the server has spent on pictures of this run.
    pub fn spend(&self, time: Duration) {
        let micros = u64::try_from(time.as_micros()).unwrap_or(u64::MAX);
        self.spent.fetch_add(micros, Ordering::Relaxed);
    }

    /// The time that the server has spent since this was last asked.
    pub fn spent(&self) -> Duration {
        Duration::from_micros(self.spent.swap(0, Ordering::Relaxed))
    }

    /// Whether this process still renders it.
    pub fn is_growing(&self) -> bool {
        let state = locked(&self.state);
        state.about.live && state.ended.is_none()
    }

    /// Wakes at every change of any run.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Whether a picture was asked for not long ago.
    pub fn is_looked_at(&self) -> bool {
        let looked = locked(&self.state).looked;
        looked.is_some_and(|at| at.elapsed() < LOOKED_AT)
    }

    /// Whether someone has got the latest snapshot.
    pub fn is_seen(&self) -> bool {
        let state = locked(&self.state);
        state.given == state.version
    }

    /// The latest picture and its number, to be looked at: who renders will then make another.
    pub fn look(&self) -> Option<(u64, Picture)> {
        self.wanted.store(true, Ordering::Relaxed);
        let mut state = locked(&self.state);
        state.looked = Some(Instant::now());
        let picture = state.picture.clone()?;
        state.given = state.version;
        Some((state.version, picture))
    }

    /// The latest picture.
    pub fn latest(&self) -> Option<Picture> {
        locked(&self.state).picture.clone()
    }

    /// What is known besides.
    pub fn about(&self) -> About {
        locked(&self.state).about.clone()
    }

    /// What has changed since `cursor`, which is moved to now; `None` if nothing has.
    pub fn update(&self, cursor: &mut Cursor) -> Option<Update> {
        let s = locked(&self.state);
        if cursor.revision == s.revision {
            return None;
        }
        let starts_over = cursor.epoch != s.epoch;
        let (curve, messages) = if starts_over {
            (0, 0)
        } else {
            (cursor.curve, cursor.messages)
        };
        *cursor = Cursor {
            revision: s.revision,
            epoch: s.epoch,
            curve: s.curve.len(),
            messages: s.messages.len(),
        };
        Some(Update {
            id: self.id,
            about: starts_over.then(|| s.about.clone()),
            now: s.now,
            curve: s.curve[curve..].to_vec(),
            messages: s.messages[messages..].to_vec(),
            ended: s.ended.clone(),
            problem: s.problem.clone(),
            picture: s.version,
            saved: s.saved,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Measured;
    use crate::watch::snapshot::SavedFilm;

    fn point(seconds: f64, error: Option<f64>) -> Point {
        Point {
            seconds,
            error: Measured {
                relative_error: error,
                seconds: Some(seconds),
                ..Measured::default()
            },
            ..Point::default()
        }
    }

    #[test]
    fn a_client_gets_what_is_new_to_it() {
        let board = Board::default();
        let run = board.add("a", About::default());
        let mut cursor = Cursor::default();
        run.point(point(1.0, Some(0.5)), true);
        let first = run.update(&mut cursor).expect("all is new");
        assert!(first.about.is_some() && first.curve.len() == 1);
        assert!(run.update(&mut cursor).is_none());

        run.point(point(2.0, Some(0.4)), true);
        run.point(point(3.0, Some(0.4)), false);
        run.message(Message::of("warning: w"));
        let next = run.update(&mut cursor).expect("news");
        assert!(next.about.is_none());
        assert_eq!(next.curve, [[2.0, 0.0, 0.4, 0.0]]);
        assert_eq!((next.messages.len(), next.now.unwrap().seconds), (1, 3.0));

        // Another picture under the same name.
        run.begin(About::default());
        let starts_over = run.update(&mut cursor).expect("news");
        assert!(starts_over.about.is_some());
        assert!(starts_over.curve.is_empty() && starts_over.messages.len() == 1);
    }

    #[test]
    fn messages_are_bounded_and_warnings_stay() {
        let board = Board::default();
        let run = board.add("a", About::default());
        run.message(Message::of("warning: first"));
        for n in 0..3 * MOST_MESSAGES {
            run.message(Message::of(&format!("line {n}")));
        }
        let update = run.update(&mut Cursor::default()).unwrap();
        assert_eq!(update.messages.len(), MOST_MESSAGES);
        assert_eq!(update.messages[0].text, "first");
    }

    #[test]
    fn a_snapshot_is_wanted_once_someone_looks() {
        let board = Board::default();
        let run = board.add("a", About::default());
        assert!(!run.is_wanted() && !run.is_looked_at());
        assert!(run.look().is_none());
        assert!(run.is_wanted() && run.is_looked_at());
        let saved = SavedFilm::new("a.npz".into(), Arc::default());
        run.publish(Picture::Saved(Arc::new(saved)), None);
        assert!(!run.is_wanted() && !run.is_seen());
        assert!(run.look().is_some() && run.is_wanted() && run.is_seen());
    }
}
