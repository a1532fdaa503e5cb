//! Reads logs.

use super::{Event, Level, Message, Point, Start};
use crate::files::kind;
use crate::files::{FileError, open};
use std::io::{BufReader, Read};
use std::path::Path;

/// A longer line is not a line of a log.
const LONGEST: u64 = 1 << 20;

/// What a log tells: all runs of one film, or one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// The last run's beginning.
    pub start: Option<Start>,
    /// Errors in the order of time: seconds of rendering over all runs, relative error, its uncertainty. Each was computed; none is
    /// extrapolated.
    pub errors: Vec<[f64; 3]>,
    /// Warnings and errors of the last run.
    pub warnings: Vec<Message>,
    /// Where the last run stood in its last line.
    pub last: Option<Point>,
    /// What ended the last run; `None` while it goes on, and where it was killed.
    pub ended: Option<String>,
}

impl Log {
    fn take(&mut self, event: Event) {
        match event {
            Event::Start(start) => {
                // The same film, resumed, or a new picture.
                let resumed = self
                    .start
                    .as_ref()
                    .is_some_and(|old| old.scene_hash == start.scene_hash)
                    && start.held.seconds > 0.0;
                let errors = std::mem::take(&mut self.errors);
                *self = Self {
                    errors: if resumed { errors } else { Vec::new() },
                    start: Some(*start),
                    ..Self::default()
                };
            }
            Event::Progress(point) => self.point(point),
            Event::End(end) => {
                self.point(end.point);
                self.ended = Some(end.stop_reason);
            }
            Event::Message(message) if message.level != Level::Info => self.warnings.push(message),
            Event::Message(_) | Event::Step(_) => {}
        }
    }

    fn point(&mut self, point: Point) {
        let e = point.error;
        let before = self.start.as_ref().map_or(0.0, |s| s.held.seconds);
        if let (Some(error), Some(seconds)) = (e.relative_error, e.seconds) {
            let seconds = before + seconds;
            // What was computed earlier is repeated until the next computation.
            let new = self.errors.last().is_none_or(|last| last[0] < seconds);
            if new && error > 0.0 && seconds > 0.0 {
                let uncertainty = e.uncertainty.unwrap_or(0.0);
                self.errors.push([seconds, error, uncertainty]);
            }
        }
        self.last = Some(point);
    }
}

/// Reads a log. A last line without an end is left out: the process is writing it, or was killed.
pub fn read(path: &Path) -> Result<Log, FileError> {
    let mut log = Log::default();
    let mut reader = BufReader::new(open(path)?);
    let mut line = Vec::new();
    let mut number = 0;
    loop {
        line.clear();
        let mut limited = (&mut reader).take(LONGEST);
        std::io::BufRead::read_until(&mut limited, b'\n', &mut line)
            .map_err(|e| FileError::reading(path, &e))?;
        number += 1;
        let wrong = |why: &str| {
            if number == 1
                && !line.starts_with(b"{")
                && let Some(kind) = kind::of_file(path)
            {
                return Err(FileError::content(path, format!("not a log ({kind})")));
            }
            let start = String::from_utf8_lossy(&line);
            let start: String = start.trim_end().chars().take(40).collect();
            let message =
                format!("line {number}: {start:?} is not an event of a log (see --log): {why}");
            Err(FileError::content(path, message))
        };
        if line.last() != Some(&b'\n') {
            // The first line of another kind of file may have no end either.
            if line.len() as u64 >= LONGEST || (number == 1 && !line.is_empty()) {
                return wrong("expected one JSON object in each line");
            }
            return Ok(log);
        }
        match serde_json::from_slice::<Event>(&line) {
            Ok(event) => log.take(event),
            Err(e) => {
                // Its line and column are those of the one line.
                let why = e.to_string();
                let why = why.split(" at line ").next().unwrap_or("not JSON");
                return wrong(why);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::DeviceInfo;
    use crate::log::{End, Held, Measured, Target};

    fn start(hash: &str, held: f64) -> Event {
        Event::Start(Box::new(Start {
            version: "0".into(),
            scene: "a.toml".into(),
            title: None,
            scene_hash: hash.into(),
            resolution: [2, 1],
            regions: Vec::new(),
            seed: 0,
            adapter: DeviceInfo {
                name: "a".into(),
                driver: "b".into(),
                backend: "cpu".into(),
                software: true,
            },
            film: None,
            target: Target::default(),
            held: Held {
                samples: held,
                seconds: held,
            },
        }))
    }

    fn point(seconds: f64, computed: f64, error: Option<f64>) -> Point {
        Point {
            seconds,
            error: Measured {
                relative_error: error,
                uncertainty: Some(0.01),
                seconds: Some(computed),
                ..Measured::default()
            },
            ..Point::default()
        }
    }

    fn write(lines: &[Event], rest: &str) -> Result<Log, FileError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.jsonl");
        let text: String = lines.iter().map(Event::line).collect();
        std::fs::write(&path, text + rest).unwrap();
        read(&path)
    }

    #[test]
    fn errors_are_those_computed_and_go_on_in_a_resumed_run() {
        let lines = [
            start("h", 0.0),
            Event::Progress(point(1.0, 1.0, None)),
            Event::Progress(point(2.0, 2.0, Some(0.5))),
            Event::Progress(point(3.0, 2.0, Some(0.5))),
            Event::Message(Message::of("warning: w")),
            start("h", 4.0),
            Event::Progress(point(1.0, 1.0, Some(0.4))),
            Event::End(End {
                stop_reason: "spp".into(),
                point: point(2.0, 2.0, Some(0.3)),
            }),
        ];
        let log = write(&lines, "{\"event\":\"half").unwrap();
        assert_eq!(
            log.errors,
            [[2.0, 0.5, 0.01], [5.0, 0.4, 0.01], [6.0, 0.3, 0.01]]
        );
        assert_eq!(log.ended.as_deref(), Some("spp"));
        assert!(log.warnings.is_empty(), "those of the run before");
        // Another picture starts with nothing.
        let log = write(&[&lines[..], &[start("other", 0.0)]].concat(), "").unwrap();
        assert!(log.errors.is_empty() && log.ended.is_none());
        assert_eq!(write(&[], "").unwrap(), Log::default());
    }

    #[test]
    fn what_is_no_log_is_named_by_its_line() {
        for (before, rest, said) in [
            (&[][..], "no\n", "line 1: \"no\""),
            (&[start("h", 0.0)][..], "{}\n", "line 2: \"{}\""),
            (&[], "\u{7f}ELF", "line 1"),
            (
                &[],
                "\n[camera]\n",
                "not a log (text, such as a scene file)",
            ),
            (
                &[],
                "PK\u{3}\u{4}",
                "not a log (a ZIP archive, such as a film)",
            ),
            (&[], "{\"event\":\"dance\"}\n", "dance"),
        ] {
            let error = write(before, rest).unwrap_err();
            assert!(error.is_content());
            assert!(error.to_string().contains(said), "{error}");
        }
    }
}
