//! Films that another process writes.

use super::board::{About, Board, Run};
use super::snapshot::{Picture, SavedFilm, Shelf};
use crate::film::coverage::Rect;
use crate::log::{self, Level, Log, Measured, Message, Point, Target};
use crate::output::store::{self, Outline};
use std::collections::BTreeSet;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Films on a page at most.
pub const MOST_FILMS: usize = 1000;

/// The files that are watched.
#[derive(Debug)]
pub struct Files {
    /// As they were named, and whether each is a folder. A folder that goes does not become a film.
    paths: Vec<(PathBuf, bool)>,
    /// The relative error to forecast, where a film's log does not say.
    error: Option<f64>,
    films: Vec<WatchedFilm>,
    known: BTreeSet<PathBuf>,
    shelf: Arc<Shelf>,
}

/// A version of a file: when it was written, and its length.
type Stamp = Option<(SystemTime, u64)>;

#[derive(Debug)]
struct WatchedFilm {
    path: PathBuf,
    run: Arc<Run>,
    /// The versions of film and log that are on the board.
    seen: [Stamp; 2],
    outline: Option<Outline>,
    /// Why the film can't be read as it is now.
    problem: Option<String>,
    log: Option<Log>,
    /// Seconds, samples, relative error and its uncertainty, whenever the film was saved.
    curve: Vec<[f64; 4]>,
}

impl Files {
    /// Films and folders of films. `error`: see [`Files::error`].
    pub fn new(paths: Vec<PathBuf>, error: Option<f64>) -> Self {
        Self {
            paths: paths
                .into_iter()
                .map(|path| {
                    let is_folder = path.is_dir();
                    (path, is_folder)
                })
                .collect(),
            error,
            films: Vec::new(),
            known: BTreeSet::new(),
            shelf: Arc::default(),
        }
    }

    /// Puts on the board what has changed. Only the beginnings of files are read.
    pub fn poll(&mut self, board: &Board) {
        for (path, is_folder) in self.paths.clone() {
            if is_folder {
                films_in(&path).into_iter().for_each(|p| self.add(p, board));
            } else {
                self.add(path, board);
            }
        }
        for film in &mut self.films {
            film.poll(self.error, &self.shelf);
        }
    }

    fn add(&mut self, path: PathBuf, board: &Board) {
        if self.films.len() >= MOST_FILMS || !self.known.insert(path.clone()) {
            return;
        }
        let name = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned());
        let file = name(path.file_name()).unwrap_or_default();
        let about = About {
            title: file.clone(),
            file,
            ..About::default()
        };
        let run = board.add(&name(path.file_stem()).unwrap_or_default(), about);
        self.films.push(WatchedFilm {
            path,
            run,
            seen: [None, None],
            outline: None,
            problem: None,
            log: None,
            curve: Vec::new(),
        });
    }
}

/// The films of a folder by name. What can't be read is empty: it may come back.
fn films_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_film = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        !name.starts_with('.') && name.to_lowercase().ends_with(".npz")
    };
    let mut films: Vec<PathBuf> = entries.map(|e| e.path()).filter(is_film).collect();
    films.sort();
    films
}

fn stamp(path: &Path) -> Stamp {
    let meta = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
    Some((meta.modified().ok()?, meta.len()))
}

impl WatchedFilm {
    fn poll(&mut self, error: Option<f64>, shelf: &Arc<Shelf>) {
        let log = self.path.with_extension("jsonl");
        let now = [stamp(&self.path), stamp(&log)];
        // A film that was never there is not news.
        if now == self.seen && (now[0].is_some() || self.problem.is_some()) {
            return;
        }
        let [film_is_new, log_is_new] = [0, 1].map(|i| now[i] != self.seen[i]);
        self.seen = now;
        if log_is_new {
            // Something else may have this name.
            self.log = now[1].and_then(|_| log::read(&log).ok());
        }
        match now[0] {
            None => self.problem = Some(self.missing().into()),
            Some((modified, _)) if film_is_new => match store::outline(&self.path) {
                Ok(outline) => {
                    self.problem = None;
                    self.take(outline, modified, shelf);
                }
                Err(e) => self.problem = Some(e.message().into()),
            },
            Some(_) => {}
        }
        self.show(error);
        // A log that goes on does not mend its film.
        if self.problem.is_some() {
            self.run.problem(self.problem.clone());
        }
    }

    fn missing(&self) -> &'static str {
        match self.outline {
            Some(_) => "the file is gone",
            None => "there is no such file yet",
        }
    }

    /// The file has another content.
    fn take(&mut self, outline: Outline, modified: SystemTime, shelf: &Arc<Shelf>) {
        let old = self.outline.as_ref().map(|o| &o.provenance);
        let p = &outline.provenance;
        let goes_on = |old: &crate::provenance::Provenance| {
            old.scene_hash == p.scene_hash
                && old.settings.size == p.settings.size
                && old.seconds <= p.seconds
        };
        if !old.is_some_and(goes_on) {
            self.curve.clear();
        }
        if let Some(error) = p.relative_error.filter(|e| *e > 0.0 && p.seconds > 0.0)
            && self.curve.last().is_none_or(|last| last[0] < p.seconds)
        {
            let uncertainty = p.relative_error_uncertainty.unwrap_or(0.0);
            self.curve.push([p.seconds, p.samples, error, uncertainty]);
        }
        self.outline = Some(outline);
        let saved = modified.duration_since(UNIX_EPOCH);
        let film = SavedFilm::new(self.path.clone(), shelf.clone());
        let picture = Picture::Saved(Arc::new(film));
        self.run
            .publish(picture, saved.ok().map(|d| d.as_secs_f64()));
    }

    /// Puts everything on the board.
    fn show(&self, error: Option<f64>) {
        let Some(Outline {
            bounds, provenance, ..
        }) = &self.outline
        else {
            return;
        };
        let start = self.log.as_ref().and_then(|log| log.start.as_ref());
        let same = start.filter(|s| s.scene_hash == provenance.scene_hash);
        let log = self.log.as_ref().filter(|_| same.is_some());
        let kept = Some(Arc::new(provenance.clone()));
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        let mut about = match same {
            Some(start) => About::of(start, false, kept),
            None => About {
                title: provenance
                    .scene_title
                    .clone()
                    .unwrap_or_else(|| file.to_string()),
                size: provenance.settings.size,
                regions: match *bounds {
                    b if b == Rect::whole(provenance.settings.size) => Vec::new(),
                    b => vec![[b.x0, b.y0, b.x1, b.y1]],
                },
                adapter: provenance
                    .devices
                    .last()
                    .map_or(String::new(), |d| d.device.brief()),
                target: Target::default(),
                provenance: kept,
                ..About::default()
            },
        };
        about.file = file.into();
        about.target.relative_error = about.target.relative_error.or(error);
        let point = match log.and_then(|log| log.last) {
            Some(point) => point,
            None => self.point(),
        };
        let doubt = provenance.relative_error_doubt.iter();
        let mut messages: Vec<Message> = log.map_or(Vec::new(), |l| l.warnings.clone());
        messages.extend(doubt.map(|text| Message {
            level: Level::Warning,
            text: text.clone(),
        }));
        let curve = match log.map(|log| &log.errors) {
            Some(errors) => errors.iter().map(|&[t, e, u]| [t, 0.0, e, u]).collect(),
            None => self.curve.clone(),
        };
        let ended = log.and_then(|log| log.ended.clone());
        self.run.set(about, point, curve, messages, ended);
    }

    /// The state of the film as it was saved.
    fn point(&self) -> Point {
        let Some(Outline { provenance: p, .. }) = &self.outline else {
            return Point::default();
        };
        let known = p.relative_error.filter(|e| e.is_finite());
        Point {
            samples: p.samples,
            seconds: p.seconds,
            paths: p.counters.paths,
            paths_per_second: (p.seconds > 0.0).then(|| p.counters.paths as f64 / p.seconds),
            error: Measured {
                relative_error: known,
                uncertainty: p.relative_error_uncertainty,
                doubt: None,
                samples: known.map(|_| p.samples),
                seconds: known.map(|_| p.seconds),
            },
            ..Point::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;
    use crate::provenance::tests::example;
    use crate::watch::board::Cursor;
    use std::fs;

    /// What the page says is wrong with each film, by its file's name.
    fn problems(board: &Board) -> Vec<(String, String)> {
        let of = |run: &Arc<Run>| {
            let update = run.update(&mut Cursor::default()).expect("all is new");
            let json = serde_json::to_value(update).unwrap();
            let text = json["problem"].as_str().unwrap_or_default().to_owned();
            (run.about().file, text)
        };
        board.runs().iter().map(of).collect()
    }

    #[test]
    fn a_problem_stays_until_its_film_is_mended() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("night");
        fs::create_dir(&folder).unwrap();
        let (path, log) = (folder.join("a.npz"), folder.join("a.jsonl"));
        let bounds = Rect::whole([2, 2]);
        let mut film = Film::new([2, 2], bounds, 2);
        film.put_samples(bounds, 0..16, vec![[[0.5, 0.5, 0.5, 0.25]; 4]; 4]);
        store::save(&path, &film, &example([2, 2])).unwrap();
        let board = Board::default();
        let mut files = Files::new(vec![folder.clone()], None);
        let mut now = || {
            files.poll(&board);
            problems(&board)
        };
        let said = |text: &str| vec![("a.npz".to_owned(), text.to_owned())];
        assert_eq!(now(), said(""));

        // Damaged; and its log goes on meanwhile.
        let good = fs::read(&path).unwrap();
        fs::write(&path, &good[..100]).unwrap();
        let damaged = now();
        assert!(damaged[0].1.contains("truncated"), "{damaged:?}");
        fs::write(
            &log,
            "{\"event\":\"message\",\"level\":\"info\",\"text\":\"a\"}\n",
        )
        .unwrap();
        assert_eq!(now(), damaged);
        assert_eq!(now(), damaged);
        fs::write(&path, &good).unwrap();
        assert_eq!(now(), said(""));

        // Gone, with its log and then with its folder, which is no film.
        fs::remove_file(&path).unwrap();
        assert_eq!(now(), said("the file is gone"));
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(now(), said("the file is gone"));
        assert_eq!(now(), said("the file is gone"));
    }
}
