//! Progress on stderr: a bar on a terminal, a line every few seconds elsewhere; as events for programs.

use super::args::{ProgressStyle, Talk};
use super::events;
use super::looks::Looks;
use super::time_left::TimeLeft;
use crate::film::Film;
use crate::film::error::RelativeError;
use crate::log::{Event, Point, Step};
use crate::run::Tally;
use crate::stats::percent;
use console::Term;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle as BarStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Length of the bar. It is never full before the end.
const STEPS: u64 = 1000;

/// Columns that the bar gets at least.
const NARROWEST_BAR: usize = 10;

/// Time until the first line, and from it to the second.
const FIRST_PAUSE: Duration = Duration::from_secs(5);

/// The longest time between two lines.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// Shows progress on stderr.
pub struct Progress {
    shown: Shown,
    looks: Looks,
    began: Instant,
    left: TimeLeft,
    pace: Pace,
}

/// How it is shown.
enum Shown {
    /// Not at all.
    Silent,
    /// A line now and then.
    Lines(Lines),
    /// A bar.
    Bar(ProgressBar),
    /// As events, among which are those of every render.
    Events,
}

/// Lines already printed.
struct Lines {
    count: u32,
    last: Instant,
}

impl Lines {
    /// Whether a line is due, which is then printed.
    fn is_due(&mut self) -> bool {
        let due = self.last.elapsed() >= pause(self.count);
        if due {
            self.count += 1;
            self.last = Instant::now();
        }
        due
    }
}

/// The time from so many lines to the next: the log of a run of hours stays short.
fn pause(lines: u32) -> Duration {
    let factor = 1 << lines.saturating_sub(1).min(10);
    LONGEST_PAUSE.min(FIRST_PAUSE * factor)
}

/// Decides which events are kept. About twenty for each factor of e in time tell all of a curve on a log axis.
#[derive(Default)]
struct Pace {
    /// Seconds from the beginning to the next one.
    next: f64,
}

impl Pace {
    /// Whether one is due `now` seconds after the beginning, which is then kept.
    fn is_due(&mut self, now: f64) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + (0.05 * now).clamp(0.1, LONGEST_PAUSE.as_secs_f64());
        }
        due
    }
}

/// What the tally alone tells.
pub fn point(tally: &Tally) -> Point {
    let paths = tally.counters.paths;
    Point {
        samples: tally.samples,
        seconds: tally.seconds,
        fraction: tally.forecast.map(|f| f.fraction),
        paths,
        paths_per_second: (tally.seconds > 0.0).then(|| paths as f64 / tally.seconds),
        tile: tally.tile.map(|t| [t.x0, t.y0, t.x1, t.y1]),
        ..Point::default()
    }
}

/// Whether the flags and the terminal call for a bar.
pub fn has_bar(talk: &Talk) -> bool {
    !talk.quiet && talk.progress == ProgressStyle::Auto && std::io::stderr().is_terminal()
}

impl Progress {
    /// Progress in the style that the flags select.
    pub fn new(talk: &Talk) -> Self {
        let shown = match talk.progress {
            _ if talk.quiet => Shown::Silent,
            ProgressStyle::None => Shown::Silent,
            ProgressStyle::Json => Shown::Events,
            _ if has_bar(talk) => {
                let style =
                    BarStyle::with_template("{wide_bar} {msg}").unwrap_or(BarStyle::default_bar());
                let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
                Shown::Bar(bar.with_style(style))
            }
            _ => Shown::Lines(Lines {
                count: 0,
                last: Instant::now(),
            }),
        };
        Self {
            shown,
            looks: Looks::default(),
            began: Instant::now(),
            left: TimeLeft::default(),
            pace: Pace::default(),
        }
    }

    /// The same, of a picture that may be black by construction.
    pub fn of_black(mut self, black: bool) -> Self {
        self.looks.black = black;
        self
    }

    /// Shows the progress of a render, after each call to the engine.
    pub fn show(&mut self, film: &Film, tally: &Tally) {
        let now = self.began.elapsed().as_secs_f64();
        let left = self.left.after(now, tally.forecast.map(|f| f.left));
        match &mut self.shown {
            Shown::Silent | Shown::Events => {}
            Shown::Lines(lines) => {
                if lines.is_due() {
                    events::only_stderr(&line(tally, left, self.looks.error(film, tally)));
                }
            }
            Shown::Bar(bar) => {
                let fraction = tally.forecast.map_or(0.0, |f| f.fraction);
                let done = (fraction * STEPS as f64) as u64;
                bar.set_position(done.min(STEPS - 1));
                let error = self.looks.error(film, tally);
                bar.set_message(beside_bar(tally, left, error, columns()));
            }
        }
        if events::are_heard() {
            let kept = self.pace.is_due(now);
            let measured = self.looks.measured(film, tally, kept);
            let point = Point {
                seconds_left: left,
                error: measured,
                ..point(tally)
            };
            events::emit(&Event::Progress(point), kept);
        }
    }

    /// Shows that `done` of `of` steps are done, and the name of the next.
    pub fn step(&mut self, done: usize, of: usize, next: &str) {
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Events => self.tell_step(done as f64 / of.max(1) as f64, next),
            Shown::Lines(lines) => {
                if lines.is_due() {
                    events::only_stderr(&format!("{done} of {of} done, next: {next}"));
                }
            }
            Shown::Bar(bar) => {
                bar.set_position(STEPS * done as u64 / of.max(1) as u64);
                bar.set_message(cut(next, room(columns())));
            }
        }
    }

    /// Shows the fraction of the work that is done, and what is being done.
    pub fn share(&mut self, fraction: f64, text: &str) {
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Events => self.tell_step(fraction, text),
            Shown::Lines(lines) => {
                if lines.is_due() {
                    events::only_stderr(&format!("{text}, {}", done(fraction)));
                }
            }
            Shown::Bar(bar) => {
                bar.set_position(((fraction * STEPS as f64) as u64).min(STEPS - 1));
                bar.set_message(cut(text, room(columns())));
            }
        }
    }

    fn tell_step(&mut self, fraction: f64, doing: &str) {
        if self.pace.is_due(self.began.elapsed().as_secs_f64()) {
            let doing = doing.into();
            events::emit(&Event::Step(Step { fraction, doing }), true);
        }
    }

    /// Calls `f`, which may write to the terminal, with the bar hidden.
    pub fn aside<T>(&self, f: impl FnOnce() -> T) -> T {
        match &self.shown {
            Shown::Bar(bar) => bar.suspend(f),
            _ => f(),
        }
    }

    /// Prints a line with the bar hidden, unless progress is not shown.
    pub fn news(&self, text: &str) {
        if !matches!(self.shown, Shown::Silent) {
            self.say(text);
        }
    }

    /// Prints a line with the bar hidden.
    pub fn say(&self, text: &str) {
        self.aside(|| super::say!("{text}"));
    }

    /// Clears the bar before the command's last lines.
    pub fn finish(&mut self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }
}

/// Clears the bar if the command fails.
impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// A relative error as text, with its uncertainty; `None` while nothing is known.
pub fn describe(error: &RelativeError) -> Option<String> {
    match (error.value, error.doubt) {
        (None, None) => None,
        (None, Some(doubt)) => Some(doubt.to_string()),
        (Some(_), _) => Some(format!("relative error {error}")),
    }
}

/// One line: samples, percentage, time left, error. Never says 100 %.
fn line(tally: &Tally, left: Option<f64>, error: Option<RelativeError>) -> String {
    let samples = format!("{} samples", samples(tally));
    let error = error.and_then(|e| describe(&e));
    join([Some(samples), share(tally), time(left), error])
}

/// The same in few words, and without the least important ones where they don't fit beside a bar on a terminal of so many
/// columns.
fn beside_bar(
    tally: &Tally,
    left: Option<f64>,
    error: Option<RelativeError>,
    columns: usize,
) -> String {
    let samples = || Some(format!("{} spp", samples(tally)));
    let full = error.map(|e| format!("error {e}"));
    let value = error.and_then(|e| Some(format!("error {}", percent(e.value?))));
    let [share, left] = [share(tally), time(left)];
    let choices = [
        join([samples(), share.clone(), left.clone(), full]),
        join([samples(), share.clone(), left.clone(), value]),
        join([samples(), share.clone(), left, None]),
    ];
    let room = room(columns);
    let fits = |text: &String| text.chars().count() <= room;
    let shortest = || cut(&join([samples(), share, None, None]), room);
    choices.into_iter().find(fits).unwrap_or_else(shortest)
}

/// Samples per pixel.
fn samples(tally: &Tally) -> String {
    if tally.samples < 10.0 {
        format!("{:.1}", (tally.samples * 10.0).floor() / 10.0)
    } else {
        format!("{:.0}", tally.samples.floor())
    }
}

fn share(tally: &Tally) -> Option<String> {
    tally.forecast.map(|f| done(f.fraction))
}

/// A fraction as a percentage that is not 100 before the end.
fn done(fraction: f64) -> String {
    format!("{:.0} %", (fraction * 100.0).floor().min(99.0))
}

fn time(left: Option<f64>) -> Option<String> {
    left.map(|seconds| format!("{} left", clock(seconds)))
}

fn join(parts: [Option<String>; 4]) -> String {
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Columns of the terminal.
fn columns() -> usize {
    Term::stderr().size().1.into()
}

/// Columns beside the bar.
fn room(columns: usize) -> usize {
    columns.saturating_sub(NARROWEST_BAR + 1)
}

/// `text` in at most so many columns.
fn cut(text: &str, columns: usize) -> String {
    console::truncate_str(text, columns, "\u{2026}").into_owned()
}

/// A duration as text: 4.2 s, 42 s, 3 min 20 s, 10 min, 2 h 5 min.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..=9 => format!("{seconds:.1} s"),
        10..=119 => format!("{whole} s"),
        120..=7199 if whole.is_multiple_of(60) => format!("{} min", whole / 60),
        120..=7199 => format!("{} min {} s", whole / 60, whole % 60),
        _ if whole % 3600 < 60 => format!("{} h", whole / 3600),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::error::Doubt;
    use crate::run::Forecast;

    fn tally(samples: f64, fraction: f64) -> Tally {
        let left = 0.04;
        Tally {
            samples,
            forecast: Some(Forecast { fraction, left }),
            ..Tally::default()
        }
    }

    fn error(value: f64, uncertainty: f64, doubt: Option<Doubt>) -> Option<RelativeError> {
        Some(RelativeError {
            value: Some(value),
            uncertainty: Some(uncertainty),
            doubt,
        })
    }

    #[test]
    fn a_progress_line_never_says_100_percent() {
        let near_end = tally(255.9, 1.0);
        assert_eq!(
            line(&near_end, Some(0.04), error(0.0123, 0.0, None)),
            "255 samples, 99 %, 0.0 s left, relative error 1.23 %"
        );
        assert_eq!(line(&Tally::default(), None, None), "0.0 samples");
        // Before the time is known.
        assert_eq!(line(&near_end, None, None), "255 samples, 99 %");
    }

    #[test]
    fn lines_come_less_and_less_often() {
        let seconds: Vec<u64> = (0..8).map(|n| pause(n).as_secs()).collect();
        assert_eq!(seconds, [5, 5, 10, 20, 40, 60, 60, 60]);
        assert_eq!(pause(u32::MAX), LONGEST_PAUSE);
        let mut lines = Lines {
            count: 0,
            last: Instant::now(),
        };
        assert!(!lines.is_due());
        lines.last -= FIRST_PAUSE;
        assert!(lines.is_due() && !lines.is_due());
    }

    #[test]
    fn kept_events_are_evenly_spread_over_the_logarithm_of_time() {
        let mut pace = Pace::default();
        let calls = (0..36_000).map(|n| f64::from(n) * 0.1);
        let kept: Vec<f64> = calls.filter(|now| pace.is_due(*now)).collect();
        assert!((140..220).contains(&kept.len()), "{}", kept.len());
        let longest = kept.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        assert!((59.0..61.0).contains(&longest), "{longest}");
    }

    #[test]
    fn a_bar_fits_its_terminal() {
        let early = (tally(12.0, 0.05), Some(28.0), error(0.123, 0.0123, None));
        let long = (
            tally(1_234_567.0, 0.5),
            Some(7500.0),
            error(1.234e-5, 1.2e-6, Some(Doubt::Unlit(0.02))),
        );
        for (columns, (tally, left, error), text) in [
            (
                120,
                &early,
                "12 spp, 5 %, 28 s left, error 12.3 % \u{b1} 1.2 %",
            ),
            (
                60,
                &early,
                "12 spp, 5 %, 28 s left, error 12.3 % \u{b1} 1.2 %",
            ),
            (50, &early, "12 spp, 5 %, 28 s left, error 12.3 %"),
            (40, &early, "12 spp, 5 %, 28 s left"),
            (30, &early, "12 spp, 5 %"),
            (15, &early, "12 \u{2026}"),
            (
                120,
                &long,
                "1234567 spp, 50 %, 2 h 5 min left, error 0.00123 % \u{b1} 0.00012 % (no light found yet in 2 % of the picture)",
            ),
            (
                110,
                &long,
                "1234567 spp, 50 %, 2 h 5 min left, error 0.00123 %",
            ),
            (60, &long, "1234567 spp, 50 %, 2 h 5 min left"),
        ] {
            let said = beside_bar(tally, *left, *error, columns);
            assert_eq!(said, text, "{columns}");
            assert!(said.chars().count() + 1 + NARROWEST_BAR <= columns.max(11));
        }
    }

    #[test]
    fn names_are_cut_to_fit() {
        let name = "a/long/path/to/some/scene/with/a/long/name/three_materials.toml";
        assert_eq!(cut(name, room(120)), name);
        let short = cut(name, room(60));
        assert_eq!(short.chars().count(), 49);
        assert!(short.ends_with('\u{2026}'));
    }

    #[test]
    fn durations_and_percentages_as_text() {
        for (seconds, text) in [
            (0.04, "0.0 s"),
            (9.4, "9.4 s"),
            (9.6, "10 s"),
            (119.0, "119 s"),
            (200.0, "3 min 20 s"),
            (600.0, "10 min"),
            (7200.0, "2 h"),
            (7500.0, "2 h 5 min"),
        ] {
            assert_eq!(clock(seconds), text);
        }
        for (error, text) in [
            (0.0, "0 %"),
            (0.5, "50.0 %"),
            (0.02, "2.00 %"),
            (0.0012, "0.120 %"),
            (3.81e-6, "0.000381 %"),
        ] {
            assert_eq!(percent(error), text);
        }
    }
}
