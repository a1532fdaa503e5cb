//! Runs with an engine that makes hashes instead of light.

mod fake;

use super::*;
use fake::Fake;

fn job(size: [u32; 2], limit: u64, samples: Range<u64>) -> Job {
    Job {
        tiles: tiles(&[Rect::whole(size)], limit),
        samples,
        round: 4,
        time: None,
        error: None,
        black: false,
        call: CALL,
        adaptive: None,
    }
}

fn run(job: &Job, engine: &mut Fake, film: &mut Film) -> StopReason {
    let stop = AtomicBool::new(false);
    let mut run = Run::new(job, engine, film, &stop);
    run.go(|_, _| Ok::<(), EngineError>(())).unwrap()
}

#[test]
fn tiles_hold_each_pixel_once_within_the_limit() {
    let r = |x0, y0, x1, y1| Rect { x0, y0, x1, y1 };
    let regions = [r(0, 0, 50, 40), r(30, 20, 90, 70), r(95, 0, 96, 70)];
    let cut = tiles(&regions, 1000);
    for y in 0..80 {
        for x in 0..100 {
            let wanted = regions.iter().any(|r| r.contains(x, y));
            let found = cut.iter().filter(|t| t.contains(x, y)).count();
            assert_eq!(found, usize::from(wanted), "pixel {x}, {y}");
        }
    }
    assert!(cut.iter().all(|t| t.area() <= 1000));
    // Textures have a limit: no tile is long, neither across nor down.
    for size in [[1, 16384], [1, 65536], [4, 20000], [65536, 1]] {
        let cut = tiles(&[Rect::whole(size)], 1 << 20);
        assert!(
            cut.iter().all(|t| t.width().max(t.height()) <= 4096),
            "{size:?}"
        );
    }
    // Wide pictures are cut into columns, and a row longer than the limit is a tile of its own.
    assert_eq!(tiles(&[r(0, 0, 65536, 2)], 1000).len(), 32);
    assert!(
        tiles(&[r(3, 0, 65535, 300)], u64::MAX)
            .iter()
            .all(|t| t.width() <= 4096)
    );
    assert_eq!(tiles(&[Rect::whole([65536, 65536])], u64::MAX).len(), 4096);
}

#[test]
fn passes_cover_the_job_and_stay_in_their_block() {
    let job = job([7, 5], 14, 0..700);
    let mut film = Film::new([7, 5], Rect::whole([7, 5]), 2);
    let mut engine = Fake::new();
    assert_eq!(run(&job, &mut engine, &mut film), StopReason::Samples);
    assert_eq!(film.coverage.samples(), (700, 700));
    assert_eq!(engine.calls[0][0].samples, 0..1);
    for Part { samples: s, .. } in engine.calls.iter().flatten() {
        assert_eq!(s.start / BLOCK, (s.end - 1) / BLOCK, "{s:?}");
    }
    assert!(
        engine
            .calls
            .iter()
            .flatten()
            .any(|p| p.samples.end - p.samples.start >= 64)
    );
}

/// However a run ends, each pixel has the passes of its samples and no others: what a film holds says all of what it is.
#[test]
fn a_run_that_stops_anywhere_leaves_the_light_paths_of_its_samples() {
    let size = [7, 5];
    let job = job(size, 14, 0..300);
    let lit = || Fake {
        light: true,
        ..Fake::new()
    };
    let new = || Film::new(size, Rect::whole(size), 2);
    let mut whole = new();
    assert_eq!(run(&job, &mut lit(), &mut whole), StopReason::Samples);
    let splats = |film: &Film| film.splats().expect("light paths").clone();
    assert!(splats(&whole).sums().iter().flatten().any(|s| s[0] > 0));
    let mut ends = Vec::new();
    for calls in 1.. {
        let mut film = new();
        let (mut left, stop) = (calls, AtomicBool::new(false));
        let mut engine = lit();
        let end = Run::new(&job, &mut engine, &mut film, &stop).go(|film, _| {
            let own = &film.splats().expect("light paths").coverage;
            for (rect, ranges) in film.coverage.cells() {
                for samples in ranges {
                    assert!(own.missing(rect, samples.clone()).is_empty());
                }
            }
            assert_eq!(own.total(), film.coverage.total());
            left -= 1;
            stop.store(left == 0, Ordering::Relaxed);
            Ok::<(), EngineError>(())
        });
        let end = end.unwrap();
        ends.push(film.coverage.samples().0);
        assert_eq!(run(&job, &mut lit(), &mut film), StopReason::Samples);
        assert!(
            splats(&film).sums() == splats(&whole).sums(),
            "{calls} calls"
        );
        if end == StopReason::Samples {
            break;
        }
    }
    assert!(ends.iter().any(|n| (1..300).contains(n)), "{ends:?}");
}

#[test]
fn resuming_does_only_what_is_missing() {
    let size = [7, 5];
    let mut film = Film::new(size, Rect::whole(size), 2);
    run(&job(size, 14, 40..50), &mut Fake::new(), &mut film);
    let mut engine = Fake::new();
    run(&job(size, 21, 0..100), &mut engine, &mut film);
    assert_eq!(engine.paths(), 35 * 90);
    assert_eq!(film.coverage.samples(), (100, 100));
    let mut again = Fake::new();
    assert_eq!(
        run(&job(size, 14, 0..100), &mut again, &mut film),
        StopReason::Samples
    );
    assert!(again.calls.is_empty());
}

#[test]
fn the_error_ends_a_run_at_the_same_sample_however_slow_the_machine() {
    let size = [16, 16];
    let mut ends = Vec::new();
    for nap in [0, 30] {
        let mut film = Film::new(size, Rect::whole(size), 2);
        let mut job = job(size, 128, 0..4096);
        job.error = Some(0.06);
        let mut engine = Fake::new();
        engine.nap = Duration::from_millis(nap);
        assert_eq!(run(&job, &mut engine, &mut film), StopReason::Error);
        assert!(film.relative_error().value.unwrap() <= 0.06);
        let (least, most) = film.coverage.samples();
        assert_eq!(least, most);
        assert!(least > 16 && least < 400, "{least}");
        ends.push(least);
    }
    assert_eq!(ends[0], ends[1]);
}

/// The noise of the fake engine is white, so the extrapolation is exact except for random fluctuations.
#[test]
fn forecasts_of_the_error_are_accurate() {
    let size = [32, 32];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let mut job = job(size, 512, 0..1 << 20);
    job.error = Some(0.03);
    let mut engine = Fake::new();
    let stop = AtomicBool::new(false);
    let mut forecasts = Vec::new();
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    let reason = run.go(|_, tally| {
        let f = tally.forecast;
        assert_eq!(f.is_some(), tally.error.is_some(), "at {}", tally.samples);
        forecasts.extend(f.map(|f| tally.samples / f.fraction));
        assert!(f.is_none_or(|f| (0.0..=1.0).contains(&f.fraction) && f.left >= 0.0));
        Ok::<(), EngineError>(())
    });
    assert_eq!(reason.unwrap(), StopReason::Error);
    let end = film.coverage.samples().0 as f64;
    assert!(forecasts.len() > 10 && end > 200.0, "{end}");
    for needed in forecasts {
        // From the first look at 16 samples on: the next or the last check but one.
        let off = needed / end;
        assert!((0.75..=1.3).contains(&off), "{needed} of {end}");
    }
}

/// A driver compiles in the first call.
#[test]
fn a_slow_first_call_is_not_in_the_forecast() {
    let size = [8, 8];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let job = job(size, 64, 0..20_000);
    let mut engine = Fake::new();
    engine.slow_start = Duration::from_millis(300);
    let stop = AtomicBool::new(false);
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    let mut left = Vec::new();
    run.go(|_, tally| {
        left.push(tally.forecast.expect("the end is known").left);
        Ok::<(), EngineError>(())
    })
    .unwrap();
    // 300 ms for each of 20 000 samples, and then what they take.
    assert!(left[0] > 5000.0, "{}", left[0]);
    assert!(left[2] < 60.0, "{}", left[2]);
}

#[test]
fn checks_are_whole_rounds_of_all_replicates() {
    let checks = |round: u64| {
        let after = |count: &u64| Some(next_check(*count, round));
        let counts = std::iter::successors(Some(next_check(0, round)), after);
        counts.take(6).collect::<Vec<_>>()
    };
    assert_eq!(checks(4), [16, 32, 48, 64, 80, 112]);
    assert_eq!(next_check(0, 1), 16);
    assert_eq!(next_check(0, 9), 36);
    // A forecast may pass counts beyond the largest sample count, for every size of a round.
    for round in [1, 4, 9, 1 << 20] {
        assert!(next_check(u64::MAX, round) > u64::from(u32::MAX));
    }
}

/// An error that no run reaches is no reason not to end.
#[test]
fn unreachable_errors_do_not_disable_other_conditions() {
    let size = [8, 8];
    for error in [1e-8, 1e-20, 1e-100, 1e-320] {
        let mut film = Film::new(size, Rect::whole(size), 2);
        let mut job = job(size, 16, 0..u64::from(u32::MAX));
        (job.error, job.time) = (Some(error), Some(Duration::from_millis(50)));
        assert_eq!(run(&job, &mut Fake::new(), &mut film), StopReason::Time);
    }
}

/// What progress shows is of the whole picture.
#[test]
fn a_tally_is_complete_once_every_pixel_has_a_sample() {
    let size = [8, 8];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let job = job(size, 16, 3..40);
    let stop = AtomicBool::new(false);
    let mut engine = Fake::new();
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    run.go(|film, tally| {
        let covered: u64 = film.coverage.cells().map(|(r, _)| r.area()).sum();
        assert_eq!(tally.complete, covered == 64);
        Ok::<(), EngineError>(())
    })
    .unwrap();
    assert!(run.tally.complete);
    assert!(Run::new(&job, &mut engine, &mut film, &stop).tally.complete);
    let mut later = job.clone();
    later.samples = 40..50;
    assert!(
        !Run::new(&later, &mut engine, &mut film, &stop)
            .tally
            .complete
    );
}

#[test]
fn time_ends_a_run_but_leaves_no_holes() {
    let size = [8, 8];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let mut job = job(size, 16, 0..1_000_000);
    job.time = Some(Duration::from_millis(60));
    let mut engine = Fake::new();
    engine.nap = Duration::from_millis(40);
    let begun = Instant::now();
    assert_eq!(run(&job, &mut engine, &mut film), StopReason::Time);
    assert!(begun.elapsed() < Duration::from_secs(2));
    let pixels: u64 = film.coverage.cells().map(|(r, _)| r.area()).sum();
    assert_eq!((pixels, film.coverage.samples().0), (64, 1));
}

#[test]
fn a_failing_device_leaves_what_was_done() {
    let size = [8, 8];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let job = job(size, 64, 0..64);
    let mut engine = Fake::new();
    engine.fail_at = Some(1);
    let stop = AtomicBool::new(false);
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    let e = run.go(|_, _| Ok::<(), EngineError>(())).unwrap_err();
    assert_eq!(e, EngineError::Device("lost".into()));
    assert!(film.coverage.samples().0 > 0);
}

#[test]
fn the_stop_flag_is_checked_between_calls() {
    let size = [8, 8];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let job = job(size, 64, 0..1_000_000);
    let mut engine = Fake::new();
    let stop = AtomicBool::new(false);
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    let reason = run.go(|_, tally| {
        stop.store(tally.samples >= 100.0, Ordering::Relaxed);
        Ok::<(), EngineError>(())
    });
    assert_eq!(reason.unwrap(), StopReason::Interrupted);
    assert!(film.coverage.samples().0 >= 100);
}

/// Mean light of 100 adaptive pictures, one in a thousand of whose samples holds all of it, and its standard error. Their
/// tiles lie apart, so that each is steered by itself.
fn mean_of_adaptive_pictures(deaf: bool) -> (f64, f64) {
    let size = [128, 128];
    let mut job = job(size, 256, 0..64);
    let tile = |k: u32| {
        let (x0, y0) = (k % 4 * 32, k / 4 * 32);
        let (x1, y1) = (x0 + 16, y0 + 16);
        Rect { x0, y0, x1, y1 }
    };
    job.tiles = (0..16).map(tile).collect();
    let mut means = Vec::new();
    for seed in 0..100 {
        job.adaptive = Some(seed);
        let mut engine = Fake::new();
        (engine.seed, engine.deaf) = (seed, deaf);
        engine.value = |h| if (h >> 32) % 1000 == 0 { 1000.0 } else { 0.0 };
        let mut film = Film::new(size, Rect::whole(size), 2);
        run(&job, &mut engine, &mut film);
        assert!((film.coverage.mean() - 64.0).abs() < 1.0);
        let (least, most) = film.coverage.samples();
        assert!(least < most, "nothing was steered");
        means.push(film.mean_luminance());
    }
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn adaptive_pictures_are_unbiased_because_of_separate_pilots() {
    let (mean, error) = mean_of_adaptive_pictures(false);
    assert!((mean - 1.0).abs() < 3.0 * error, "{mean} ± {error}");
    // With the picture's own first samples for a pilot, tiles that had luck get more samples, and it counts for less.
    let (biased, error) = mean_of_adaptive_pictures(true);
    assert!(biased < 1.0 - 3.0 * error, "{biased} ± {error}");
    println!("unbiased {mean}, steered by itself {biased}, each ± {error}");
}

/// The picture's bits do not depend on how a run is cut into calls, or where it is interrupted and resumed.
#[test]
fn an_adaptive_film_does_not_depend_on_how_it_was_made() {
    let size = [80, 48];
    let picture = |ends: &[u64], call: Duration| {
        let mut film = Film::new(size, Rect::whole(size), 2);
        for &end in ends {
            let mut job = job(size, 2000, 0..end);
            (job.adaptive, job.call) = (Some(5), call);
            let mut engine = Fake::new();
            engine.seed = 5;
            assert_eq!(run(&job, &mut engine, &mut film), StopReason::Samples);
        }
        assert!((film.coverage.mean() - 150.0).abs() < 1.0);
        film
    };
    let once = picture(&[150], CALL);
    for (ends, call) in [
        (&[150][..], Duration::from_nanos(1)),
        (&[7, 33, 50, 64, 149, 150], CALL),
    ] {
        let film = picture(ends, call);
        assert!(
            film.sums() == once.sums() && film.pilot == once.pilot,
            "{ends:?}"
        );
    }
}

#[test]
fn an_adaptive_forecast_grows_to_its_end() {
    let size = [64, 64];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let mut job = job(size, 4096, 0..100);
    job.adaptive = Some(0);
    let mut engine = Fake::new();
    let stop = AtomicBool::new(false);
    let mut run = Run::new(&job, &mut engine, &mut film, &stop);
    let mut fractions = Vec::new();
    run.go(|_, tally| {
        let f = tally.forecast.expect("the end is known");
        assert!(f.left >= 0.0);
        fractions.push(f.fraction);
        Ok::<(), EngineError>(())
    })
    .unwrap();
    assert!(fractions.windows(2).all(|f| f[0] <= f[1]));
    let last = fractions.pop().unwrap();
    assert!(last > 0.99 && fractions[0] < 0.1, "{last}");
}

/// One call covers all tiles, each with the samples that it needs.
#[test]
fn an_adaptive_wave_is_a_few_large_calls() {
    let size = [80, 48];
    let mut film = Film::new(size, Rect::whole(size), 2);
    let mut job = job(size, 2000, 0..150);
    job.adaptive = Some(5);
    let mut engine = Fake::new();
    // No two tiles find the same.
    engine.value = |h| if (h >> 32) % 1000 == 0 { 1000.0 } else { 0.0 };
    assert_eq!(run(&job, &mut engine, &mut film), StopReason::Samples);
    // Two bands, and for each: the first samples, the others before the pilot, the pilot, two waves and a second block.
    assert!(engine.calls.len() <= 14, "{} calls", engine.calls.len());
    let differ = |parts: &Vec<Part>| parts.iter().any(|p| p.samples != parts[0].samples);
    assert!(engine.calls.iter().any(differ));
}

/// A lamp that no path has found yet ends no run. A scene without light does.
#[test]
fn a_black_picture_never_reaches_an_error_unless_it_must_be_black() {
    let size = [16, 16];
    for (black, reason) in [(false, StopReason::Samples), (true, StopReason::Error)] {
        let mut job = job(size, 256, 0..600);
        job.error = Some(0.5);
        job.black = black;
        let mut engine = Fake::new();
        engine.value = |_| 0.0;
        let mut film = Film::new(size, Rect::whole(size), 2);
        assert_eq!(run(&job, &mut engine, &mut film), reason);
        assert_eq!(film.coverage.samples().0, if black { 16 } else { 600 });
    }
}
