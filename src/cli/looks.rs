//! The picture's error during a render, which takes long to compute for a large picture.

use crate::film::Film;
use crate::film::error::RelativeError;
use crate::log::Measured;
use crate::run::Tally;
use std::time::{Duration, Instant};

/// Computing the error takes at most 1/50 of the time: for large pictures it is computed less often.
const LOOK_SHARE: u32 = 50;

/// The picture's relative error when it was last computed.
#[derive(Default)]
pub struct Looks {
    /// Whether the picture is black by construction.
    pub black: bool,
    last: Option<Look>,
}

struct Look {
    /// Samples per pixel at that time.
    samples: f64,
    /// Seconds in the engine until then.
    seconds: f64,
    error: RelativeError,
    /// When the computation was done, and how long it took.
    done: Instant,
    took: Duration,
}

impl Looks {
    /// Computes the error if that is due. `None` while some pixels have no samples.
    fn look(&mut self, film: &Film, tally: &Tally) -> Option<&Look> {
        if !tally.complete {
            return None;
        }
        let due = |l: &Look| l.done.elapsed() >= l.took * LOOK_SHARE;
        if self.last.as_ref().is_none_or(due) {
            let begun = Instant::now();
            let error = film.relative_error().of_black(self.black);
            self.last = Some(Look {
                samples: tally.samples,
                seconds: tally.seconds,
                error,
                done: Instant::now(),
                took: begun.elapsed(),
            });
        }
        self.last.as_ref()
    }

    /// The picture's relative error: computed if that is due, else extrapolated from the last computation. `None` while some
    /// pixels have no samples.
    pub fn error(&mut self, film: &Film, tally: &Tally) -> Option<RelativeError> {
        let look = self.look(film, tally)?;
        // The error falls with the square root of the number of samples.
        let since = (look.samples / tally.samples).sqrt().min(1.0);
        let scaled = |x: f64| x * since;
        Some(RelativeError {
            value: look.error.value.map(scaled),
            uncertainty: look.error.uncertainty.map(scaled),
            ..look.error
        })
    }

    /// The error as it was last computed; with `now`, it is computed if that is due.
    pub fn measured(&mut self, film: &Film, tally: &Tally, now: bool) -> Measured {
        if now {
            self.look(film, tally);
        }
        let last = self.last.as_ref();
        last.map_or(Measured::default(), |look| {
            measured(&look.error, look.samples, look.seconds)
        })
    }
}

/// An error that was computed at so many samples, after so many seconds.
pub fn measured(error: &RelativeError, samples: f64, seconds: f64) -> Measured {
    Measured {
        relative_error: error.value.filter(|e| e.is_finite()),
        uncertainty: error.uncertainty.filter(|e| e.is_finite()),
        doubt: error.doubt.map(Into::into),
        samples: Some(samples),
        seconds: Some(seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::progress::describe;
    use crate::film::coverage::Rect;

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
                seconds: 1.0,
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
        let between = looked(hour).error(&film, &tally).and_then(|e| describe(&e));
        assert_eq!(
            between.as_deref(),
            Some("relative error 10.0 % \u{b1} 1.0 %")
        );
        // What is told to programs is not extrapolated.
        let measured = looked(hour).measured(&film, &tally, true);
        assert_eq!(
            (measured.relative_error, measured.samples),
            (Some(0.2), Some(64.0))
        );
        for mut looks in [looked(Duration::ZERO), Looks::default()] {
            let error = looks.error(&film, &tally).and_then(|e| describe(&e));
            assert_eq!(error.as_deref(), Some("relative error 0 %"));
            let measured = looks.measured(&film, &tally, true);
            assert_eq!(
                (measured.relative_error, measured.samples),
                (Some(0.0), Some(256.0))
            );
        }
    }
}
