//! The time left as progress shows it: from when it is known, and without jumps.

/// Calls to the engine before a forecast counts: the first ones compile, and learn how many samples a call may have.
const FIRST_CALLS: u32 = 4;

/// Seconds before a forecast counts.
const FIRST_SECONDS: f64 = 2.0;

/// Seconds after which it counts although it is not stable.
const PATIENCE: f64 = 15.0;

/// A forecast is stable if the end that it expects is that of an earlier one, but for this share of the time left.
const STABLE: f64 = 0.1;

/// Factor between the times of these two forecasts. Compared with the one just before, a forecast that falls slowly would be stable.
const LATER: f64 = 1.5;

/// Seconds over which forecasts are averaged.
const AVERAGED: f64 = 3.0;

/// What has been forecast so far.
#[derive(Debug, Default)]
pub struct TimeLeft {
    calls: u32,
    /// Seconds since the start, at the last forecast.
    now: f64,
    /// When the run is expected to end, in seconds since the start.
    end: Option<f64>,
    /// The time of an earlier forecast, and the end that it expected.
    earlier: Option<(f64, f64)>,
    /// Whether it has been shown: from then on it is always shown.
    known: bool,
}

impl TimeLeft {
    /// The time left to be shown `now` seconds after the start, where the run itself expects another `left` seconds. Call it
    /// after every call to the engine.
    pub fn after(&mut self, now: f64, left: Option<f64>) -> Option<f64> {
        self.calls += 1;
        let expected = now + left?;
        let end = match self.end.filter(|_| self.known) {
            Some(end) => expected + (end - expected) * ((self.now - now) / AVERAGED).exp(),
            // Until it is shown, the latest forecast is the best.
            None => expected,
        };
        if self.earlier.is_none_or(|(then, _)| now >= LATER * then) {
            let moved = self
                .earlier
                .map_or(f64::INFINITY, |(_, end)| (expected - end).abs());
            let stable = moved <= STABLE * (1.0 + expected - now);
            let enough = self.calls >= FIRST_CALLS && now >= FIRST_SECONDS;
            self.known |= enough && (stable || now >= PATIENCE);
            self.earlier = Some((now, expected));
        }
        (self.now, self.end) = (now, Some(end));
        self.known.then_some((end - now).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The times, and what is shown, of a run of 3000 samples at 100 a second: `before` seconds pass in the first call, of a
    /// single sample, and then calls get as long as they may. `rest` is how much of the first call a forecast counts.
    fn run(before: f64, rest: f64) -> Vec<(f64, Option<f64>)> {
        let (mut now, mut done, mut call) = (before, 1.0, 5.0);
        let mut left = TimeLeft::default();
        let mut shown = Vec::new();
        // The picture's tiles are not alike.
        let unlike = [1.1, 0.9, 1.05, 0.95];
        while done < 3000.0 {
            let pace = (now - (1.0 - rest) * before) / (done - (1.0 - rest));
            let expected = (done > 1.0 || rest > 0.0).then_some(pace * (3000.0 - done));
            shown.push((now, left.after(now, expected)));
            now += call / 100.0 * unlike[shown.len() % 4];
            done += call;
            call = (2.0 * call).min(40.0);
        }
        shown
    }

    #[test]
    fn a_slow_start_shows_no_time_that_jumps() {
        for before in [0.01, 0.5, 4.0] {
            let shown = run(before, 0.0);
            let known = |s: &&(f64, Option<f64>)| s.1.is_some();
            let first = shown.iter().find(known).expect("it is shown");
            let soon = FIRST_SECONDS..2.0 * before + 4.0;
            assert!(soon.contains(&first.0), "{first:?}");
            let end = shown.last().unwrap().0;
            for (now, left) in &shown[shown.len() - shown.iter().filter(known).count()..] {
                let left = left.expect("from then on always");
                assert!((now + left - end).abs() < 0.1 * end, "{now} {left} {end}");
            }
        }
    }

    /// Where the first call counts in full, the forecast falls from hours.
    #[test]
    fn a_forecast_that_falls_is_not_shown_until_it_is_stable() {
        let shown = run(4.0, 1.0);
        let first = shown.iter().find_map(|s| s.1).expect("it is shown");
        assert!(first < 25.0, "{first}");
    }

    #[test]
    fn a_new_forecast_comes_in_gradually() {
        let mut left = TimeLeft::default();
        for second in 0..6 {
            let shown = left.after(second.into(), Some(f64::from(100 - second)));
            assert_eq!(shown.is_some(), second >= 3, "{second}");
        }
        // From 94 s to 44 s.
        let first = left.after(6.0, Some(44.0)).expect("known");
        assert!((70.0..94.0).contains(&first), "{first}");
        let mut last = first;
        for second in 7..20 {
            last = left
                .after(second.into(), Some(f64::from(50 - second)))
                .expect("known");
        }
        assert!((31.0..32.0).contains(&last), "{last}");
        // What is not known any more is not shown.
        assert_eq!(left.after(20.0, None), None);
    }
}
