//! Progress on stderr: a bar on a terminal, a line every few seconds elsewhere.

use super::args::{ProgressStyle, Talk};
use crate::film::Film;
use crate::film::error::RelativeError;
use crate::run::Tally;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle as BarStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Length of the bar. It is never full before the end.
const STEPS: u64 = 1000;

/// Time between two lines.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Computing the error takes at most 1/50 of the time: for large pictures it is computed less often.
const LOOK_SHARE: u32 = 50;

/// Shows progress on stderr.
pub struct Progress {
    shown: Shown,
    looks: Looks,
}

/// How it is shown.
enum Shown {
    /// Not at all.
    Silent,
    /// A line every few seconds, the last one at this time.
    Lines(Instant),
    /// A bar.
    Bar(ProgressBar),
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
            _ if has_bar(talk) => {
                let style =
                    BarStyle::with_template("{bar:32} {msg}").unwrap_or(BarStyle::default_bar());
                let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
                Shown::Bar(bar.with_style(style))
            }
            _ => Shown::Lines(Instant::now()),
        };
        let looks = Looks::default();
        Self { shown, looks }
    }

    /// The same, of a picture that may be black by construction.
    pub fn of_black(mut self, black: bool) -> Self {
        self.looks.black = black;
        self
    }

    /// Shows the progress of a render.
    pub fn show(&mut self, film: &Film, tally: &Tally) {
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Lines(last) if last.elapsed() < LINE_EVERY => {}
            Shown::Lines(last) => {
                *last = Instant::now();
                super::say!("{}", line(tally, self.looks.error(film, tally)));
            }
            Shown::Bar(bar) => {
                let fraction = tally.forecast.map_or(0.0, |f| f.fraction);
                let done = (fraction * STEPS as f64) as u64;
                bar.set_position(done.min(STEPS - 1));
                bar.set_message(line(tally, self.looks.error(film, tally)));
            }
        }
    }

    /// Shows that `done` of `of` steps are done, and the name of the next.
    pub fn step(&mut self, done: usize, of: usize, next: &str) {
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Lines(last) if last.elapsed() < LINE_EVERY => {}
            Shown::Lines(last) => {
                *last = Instant::now();
                super::say!("{done} of {of} done, next: {next}");
            }
            Shown::Bar(bar) => {
                bar.set_position(STEPS * done as u64 / of.max(1) as u64);
                bar.set_message(next.to_owned());
            }
        }
    }

    /// Shows the fraction of the work that is done, and what is being done.
    pub fn share(&mut self, fraction: f64, text: &str) {
        match &mut self.shown {
            Shown::Silent => {}
            Shown::Lines(last) if last.elapsed() < LINE_EVERY => {}
            Shown::Lines(last) => {
                *last = Instant::now();
                super::say!("{text}, {:.0} %", (fraction * 100.0).floor().min(99.0));
            }
            Shown::Bar(bar) => {
                bar.set_position(((fraction * STEPS as f64) as u64).min(STEPS - 1));
                bar.set_message(text.to_owned());
            }
        }
    }

    /// Calls `f`, which may write to the terminal, with the bar hidden.
    pub fn aside<T>(&self, f: impl FnOnce() -> T) -> T {
        match &self.shown {
            Shown::Bar(bar) => bar.suspend(f),
            _ => f(),
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

/// The picture's relative error when it was last computed.
#[derive(Default)]
struct Looks {
    black: bool,
    last: Option<Look>,
}

struct Look {
    /// Samples per pixel at that time.
    samples: f64,
    error: RelativeError,
    /// When the computation was done, and how long it took.
    done: Instant,
    took: Duration,
}

impl Looks {
    /// The picture's relative error as text: computed if that is due, else extrapolated from the last computation. `None`
    /// while some pixels have no samples.
    fn error(&mut self, film: &Film, tally: &Tally) -> Option<String> {
        if !tally.complete {
            return None;
        }
        let due = |l: &Look| l.done.elapsed() >= l.took * LOOK_SHARE;
        if self.last.as_ref().is_none_or(due) {
            let begun = Instant::now();
            let error = film.relative_error().of_black(self.black);
            self.last = Some(Look {
                samples: tally.samples,
                error,
                done: Instant::now(),
                took: begun.elapsed(),
            });
        }
        let look = self.last.as_ref()?;
        // The error falls with the square root of the number of samples.
        let since = (look.samples / tally.samples).sqrt().min(1.0);
        let scaled = |x: f64| x * since;
        describe(&RelativeError {
            value: look.error.value.map(scaled),
            uncertainty: look.error.uncertainty.map(scaled),
            ..look.error
        })
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
fn line(tally: &Tally, error: Option<String>) -> String {
    let mut text = if tally.samples < 10.0 {
        format!("{:.1} samples", (tally.samples * 10.0).floor() / 10.0)
    } else {
        format!("{:.0} samples", tally.samples.floor())
    };
    if let Some(f) = tally.forecast {
        text += &format!(", {:.0} %", (f.fraction * 100.0).floor().min(99.0));
        text += &format!(", {} left", clock(f.left));
    }
    if let Some(error) = error {
        text += &format!(", {error}");
    }
    text
}

/// A duration as text: 4.2 s, 42 s, 3 min 20 s, 2 h 5 min.
pub fn clock(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..=9 => format!("{seconds:.1} s"),
        10..=119 => format!("{whole} s"),
        120..=7199 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::coverage::Rect;
    use crate::run::Forecast;
    use crate::stats::percent;

    #[test]
    fn a_progress_line_never_says_100_percent() {
        let tally = Tally {
            samples: 255.9,
            forecast: Some(Forecast {
                fraction: 1.0,
                left: 0.04,
            }),
            ..Tally::default()
        };
        assert_eq!(
            line(&tally, Some("relative error 1.23 %".into())),
            "255 samples, 99 %, 0.0 s left, relative error 1.23 %"
        );
        assert_eq!(line(&Tally::default(), None), "0.0 samples");
    }

    /// The error is extrapolated while computing it is expensive, and computed again as soon as it is cheap.
    #[test]
    fn the_shown_error_is_never_out_of_date() {
        let rect = Rect::whole([1, 1]);
        let mut film = Film::new([1, 1], rect, 1);
        film.put_samples(rect, 0..4, vec![[[0.5, 0.5, 0.5, 0.25]; 4]]);
        let mut tally = Tally {
            samples: 256.0,
            ..Tally::default()
        };
        let looked = |took| Looks {
            black: false,
            last: Some(Look {
                samples: 64.0,
                error: RelativeError {
                    value: Some(0.2),
                    uncertainty: Some(0.02),
                    doubt: None,
                },
                done: Instant::now(),
                took,
            }),
        };
        let hour = Duration::from_secs(3600);
        assert_eq!(
            looked(hour).error(&film, &tally),
            None,
            "some pixels have no samples"
        );
        tally.complete = true;
        let between = looked(hour).error(&film, &tally);
        assert_eq!(
            between.as_deref(),
            Some("relative error 10.0 % \u{b1} 1.0 %")
        );
        for mut looks in [looked(Duration::ZERO), Looks::default()] {
            let error = looks.error(&film, &tally);
            assert_eq!(error.as_deref(), Some("relative error 0 %"));
        }
    }

    #[test]
    fn durations_and_percentages_as_text() {
        for (seconds, text) in [
            (0.04, "0.0 s"),
            (9.4, "9.4 s"),
            (9.6, "10 s"),
            (119.0, "119 s"),
            (200.0, "3 min 20 s"),
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
