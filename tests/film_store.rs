//! Films on disk: nothing is lost, NumPy sees the same, and no damage gets past the loader.

mod output_support;

use etendue::files::FileError;
use etendue::film::coverage::Rect;
use etendue::film::splats::SplatSetup;
use etendue::film::{Film, REPLICATES};
use etendue::output::pixels::Pixels;
use etendue::output::store::{load, pixel_bytes, save};
use etendue::provenance::Provenance;
use output_support::{
    Random, described, forge, forge_bytes, negate_first_count, region_film, render,
    seen_from_python, whole_film,
};
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};

fn saved(dir: &Path, film: &Film) -> (PathBuf, Provenance) {
    let path = dir.join("film.npz");
    let provenance = described(film);
    save(&path, film, &provenance).unwrap();
    (path, provenance)
}

/// The error of loading `bytes`, which must be one of content.
fn refused(path: &Path, bytes: &[u8]) -> String {
    fs::write(path, bytes).unwrap();
    let error = load(path).expect_err("a damaged film");
    assert!(error.is_content(), "{error}");
    let text = error.to_string();
    assert!(!text.contains('\n') && text.starts_with(&path.display().to_string()));
    text
}

#[test]
fn a_loaded_film_is_resumed_with_the_same_bits() {
    let dir = tempfile::tempdir().unwrap();
    let mut lacking = whole_film();
    lacking.leave_out(3, 1, [1, 0, 2, 0]);
    lacking.leave_out(0, 2, [0, 1, 0, 0]);
    for film in [whole_film(), region_film(), lacking] {
        let (path, provenance) = saved(dir.path(), &film);
        let (mut back, back_provenance) = load(&path).unwrap();
        assert_eq!(back_provenance, provenance);
        assert_eq!(back, film);
        let mut film = film;
        let rest = Rect {
            x0: 2,
            y0: 2,
            x1: 3,
            y1: 3,
        };
        for f in [&mut back, &mut film] {
            render(f, rest, 512..700);
        }
        assert_eq!(back, film);
    }
}

#[test]
fn a_failed_save_leaves_the_old_film() {
    let dir = tempfile::tempdir().unwrap();
    let (path, _) = saved(dir.path(), &region_film());
    let film = whole_film();
    saved(dir.path(), &film);
    assert_eq!(load(&path).unwrap().0, film);
    let nowhere = dir.path().join("none/film.npz");
    let error = save(&nowhere, &film, &described(&film)).unwrap_err();
    assert!(!error.is_content(), "{error}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn numpy_sees_the_same() {
    let dir = tempfile::tempdir().unwrap();
    for (film, unfinished) in [(whole_film(), true), (region_film(), false)] {
        let (path, provenance) = saved(dir.path(), &film);
        let Some(seen) = seen_from_python(&path) else {
            return;
        };
        let [w, h] = [film.bounds.width(), film.bounds.height()];
        assert_eq!(seen["compressed"], json!(false));
        let arrays = seen["arrays"].as_object().unwrap();
        assert_eq!(arrays.contains_key("partial"), unfinished);
        let told = &seen["provenance"];
        assert_eq!(told["size"], json!([7, 5]));
        assert_eq!(
            told["provenance"],
            serde_json::to_value(&provenance).unwrap()
        );
        assert_eq!(arrays["counts"]["dtype"], "<u8");
        assert_eq!(arrays["sums"]["dtype"], "<f8");
        assert_eq!(arrays["sums"]["shape"], json!([h, w, REPLICATES, 4]));
        // Mean and error need no recipe: they are those of the picture.
        let pixels = Pixels::new(&film);
        for y in 0..h {
            for x in 0..w {
                let (px, py) = (film.bounds.x0 + x, film.bounds.y0 + y);
                let e = pixels.at(px, py).unwrap_or_default();
                let at = |array: &str| &arrays[array]["values"][y as usize][x as usize];
                let floats = |x: &[f64]| json!(x.iter().map(|v| *v as f32).collect::<Vec<_>>());
                assert_eq!(*at("mean"), floats(&e.mean), "{px}, {py}");
                assert_eq!(*at("error"), floats(&e.error), "{px}, {py}");
            }
        }
        for y in 0..h {
            for x in 0..w {
                let i = film.index(film.bounds.x0 + x, film.bounds.y0 + y);
                let at = |array: &str| &arrays[array]["values"][y as usize][x as usize];
                assert_eq!(*at("sums"), json!(film.sums()[i]));
                if unfinished {
                    let expected = film.partial()[i].map(|s| s.map(f64::from));
                    assert_eq!(*at("partial"), json!(expected));
                    assert_eq!(*at("counts"), json!(300));
                }
            }
        }
        if !unfinished {
            assert_eq!(
                arrays["counts"]["values"],
                json!([
                    [256, 256, 256, 0, 0],
                    [512, 512, 512, 256, 256],
                    [512, 512, 512, 256, 256]
                ])
            );
        }
    }
}

/// What a disk is asked for before a run is what its film takes there.
#[test]
fn a_film_takes_no_more_room_than_is_foreseen() {
    let dir = tempfile::tempdir().unwrap();
    for light_paths in [false, true] {
        let (size, rect) = ([64, 48], Rect::whole([64, 48]));
        let mut film = Film::new(size, rect, 2);
        if light_paths {
            let (paths, scale) = (1, 1.0);
            film.begin_splats(SplatSetup { paths, scale });
        }
        render(&mut film, rect, 0..300);
        let (path, _) = saved(dir.path(), &film);
        let bytes = fs::metadata(path).unwrap().len();
        let foreseen = pixel_bytes(light_paths) * rect.area();
        assert!(bytes < foreseen + 10_000, "{bytes} of {foreseen}");
        assert!(bytes > foreseen / 2, "{bytes} of {foreseen}");
    }
}

#[test]
fn every_flipped_bit_is_detected() {
    let dir = tempfile::tempdir().unwrap();
    let (path, _) = saved(dir.path(), &whole_film());
    let good = fs::read(&path).unwrap();
    let mut random = Random(1);
    for _ in 0..1000 {
        let mut bytes = good.clone();
        let bit = random.below(8 * good.len() as u64);
        bytes[(bit / 8) as usize] ^= 1 << (bit % 8);
        refused(&path, &bytes);
    }
    // The parts that hold sizes and places more thoroughly.
    let directory = good.len() - 400;
    for bit in (0..8 * 200).chain(8 * directory..8 * good.len()).step_by(3) {
        let mut bytes = good.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        refused(&path, &bytes);
    }
}

#[test]
fn every_truncation_is_detected() {
    let dir = tempfile::tempdir().unwrap();
    let (path, _) = saved(dir.path(), &region_film());
    let good = fs::read(&path).unwrap();
    let mut random = Random(2);
    let ends = (1..100).chain(good.len() - 50..good.len());
    for end in ends.chain((0..50).map(|_| random.below(good.len() as u64) as usize)) {
        let text = refused(&path, &good[..end]);
        assert!(text.contains("truncated"), "{text}");
    }
    let text = refused(&path, &[&good[..], b"x"].concat());
    assert!(text.contains("extra bytes at the end"), "{text}");
    let text = refused(&path, b"");
    assert!(text.contains("not a film (an empty file)"), "{text}");
}

#[test]
fn other_kinds_of_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("film.npz");
    let zip = b"PK\x03\x04\x14\0\0\0\x08\0".repeat(50);
    let png = b"\x89PNG\r\n\x1a\n".repeat(50);
    for (bytes, what) in [
        (vec![0; 5000], ": it is not a NumPy archive (.npz)"),
        (
            b"title = \"x\"\n".repeat(100),
            " (text, such as a scene file)",
        ),
        (png, " (a PNG picture)"),
        (
            zip,
            ": it is a ZIP archive, but its first array is not \"provenance\"",
        ),
    ] {
        let text = refused(&path, &bytes);
        assert!(
            text.ends_with(&format!("film.npz: not a film{what}")),
            "{text}"
        );
    }
    for missing in [dir.path().join("none.npz"), dir.path().into()] {
        let error = load(&missing).unwrap_err();
        assert!(matches!(error, FileError::Io { .. }), "{error}");
    }
}

/// The error of loading a film whose JSON says `to` where it said `from`.
fn forged(dir: &Path, film: &Film, from: &str, to: &str) -> String {
    let (path, _) = saved(dir, film);
    let mut bytes = fs::read(&path).unwrap();
    forge(&mut bytes, from, to);
    refused(&path, &bytes)
}

#[test]
fn inconsistent_films_are_refused_saying_why() {
    let dir = tempfile::tempdir().unwrap();
    let film = region_film();
    for (from, to, expected) in [
        (
            "etendue film",
            "etendue tape",
            "its format is \"etendue tape\"",
        ),
        (
            "\"format_version\":1",
            "\"format_version\":2",
            "its format version is 2; this program reads version 1",
        ),
        (
            "\"size\":[7,5]",
            "\"size\":[0,5]",
            "its size is 0x5, but each side must have 1 to 65536",
        ),
        (
            "\"size\":[7,5]",
            "\"size\":[5,5]",
            "its region 1,1,6,4 exceeds the picture of 5x5 pixels",
        ),
        (
            "\"size\":[7,5]",
            "\"size\":[7,6]",
            "contradict its provenance",
        ),
        ("\"strata\":2", "\"strata\":3", "contradict its provenance"),
        ("\"block\":256", "\"block\":128", "blocks of 128 samples"),
        ("\"replicates\":4", "\"replicates\":8", "8 replicates"),
        ("\"x1\":6", "\"x1\":5", "exceeds the film's region"),
        (
            "\"start\":0,\"end\":256",
            "\"start\":0,\"end\":255",
            "has a count of 256 samples",
        ),
        (
            "\"start\":0,\"end\":256",
            "\"start\":9,\"end\":9",
            "sample ranges [9..9]",
        ),
        (
            "\"start\":0,\"end\":256",
            "\"start\":-1,\"end\":25",
            "provenance is invalid",
        ),
        ("\"coverage\":", "\"coverbge\":", "missing field `coverage`"),
    ] {
        let text = forged(dir.path(), &film, from, to);
        assert!(text.contains(expected), "{from} -> {to}: {text}");
    }
}

#[test]
fn bad_numbers_are_refused_with_their_pixel() {
    let dir = tempfile::tempdir().unwrap();
    let mut film = whole_film();
    let with = |i: usize, c: usize, x: f64| {
        let mut sums = film.sums().to_vec();
        sums[i][1][c] = x;
        let parts = (film.coverage.clone(), film.partial().to_vec());
        Film::from_parts(film.size, film.bounds, 2, parts.0, sums, parts.1)
    };
    for (film, expected) in [
        (with(8, 0, f64::NAN), "pixel (1, 1): \"sums\" holds NaN"),
        (
            with(0, 2, f64::INFINITY),
            "pixel (0, 0): \"sums\" holds inf",
        ),
        (
            with(34, 3, -1.0),
            "pixel (6, 4): \"sums\" holds -1.0, a negative",
        ),
        // Not with three hundred digits.
        (with(8, 3, -1e300), "holds -1e300, a negative sum"),
    ] {
        let (path, _) = saved(dir.path(), &film);
        let text = refused(&path, &fs::read(&path).unwrap());
        assert!(text.contains(expected), "{text}");
    }
    // Light where no sample is counted: a corner of the bounds that no region reaches.
    let regions = region_film();
    let mut sums = regions.sums().to_vec();
    let uncovered = regions.index(5, 1);
    assert_eq!(sums[uncovered], [[0.0; 4]; REPLICATES]);
    sums[uncovered][0][0] = 1.0;
    let coverage = regions.coverage.clone();
    let dark = Film::from_parts(regions.size, regions.bounds, 2, coverage, sums, vec![]);
    let (path, _) = saved(dir.path(), &dark);
    let text = refused(&path, &fs::read(&path).unwrap());
    assert!(
        text.contains("pixel (5, 1): \"sums\" holds light"),
        "{text}"
    );

    let rect = Rect::whole(film.size);
    film.put_block(rect, 300..301, |x, _| {
        [[if x == 6 { f32::NAN } else { 1.0 }; 4]; REPLICATES]
    });
    let (path, _) = saved(dir.path(), &film);
    let text = refused(&path, &fs::read(&path).unwrap());
    assert!(
        text.contains("pixel (6, 0): \"partial\" holds NaN"),
        "{text}"
    );

    // A negative count: the first pixel's made -1 in place.
    let (path, _) = saved(dir.path(), &whole_film());
    let mut bytes = fs::read(&path).unwrap();
    negate_first_count(&mut bytes, 300);
    let text = refused(&path, &bytes);
    let count =
        "pixel (0, 0) has a count of 18446744073709551615 samples, but its coverage has 300";
    assert!(text.contains(count), "{text}");
}

/// A film that NumPy has rewritten has other headers. The message says that, not that an array is missing.
#[test]
fn films_saved_by_another_program_are_recognised() {
    if std::env::var("ETENDUE_SKIP_PYTHON").is_ok_and(|v| v == "1") {
        eprintln!("ETENDUE_SKIP_PYTHON=1: not saved again by NumPy");
        return;
    }
    let python = std::env::var("ETENDUE_PYTHON").unwrap_or("python3".into());
    let dir = tempfile::tempdir().unwrap();
    let (path, _) = saved(dir.path(), &whole_film());
    for save in ["savez", "savez_compressed"] {
        let again = dir.path().join(save).with_extension("npz");
        let script = "import numpy, sys; getattr(numpy, sys.argv[3])(sys.argv[2], **numpy.load(sys.argv[1]))";
        let done = std::process::Command::new(&python)
            .args(["-c", script])
            .args([&path, &again])
            .arg(save)
            .status();
        assert!(done.expect("Python").success());
        let text = load(&again).unwrap_err().to_string();
        assert!(
            text.contains(
                "was not written by etendue: the film is damaged, or another program has rewritten it"
            ),
            "{text}"
        );
    }
}

#[test]
fn a_small_file_that_claims_to_be_huge_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    // 65536 x 65536 pixels would take 550 GB.
    let film = region_film();
    let mut provenance = described(&film);
    provenance.settings.size = [65536, 65536];
    let huge = Film::from_parts(
        [65536, 65536],
        film.bounds,
        2,
        film.coverage.clone(),
        film.sums().to_vec(),
        vec![],
    );
    let path = dir.path().join("film.npz");
    save(&path, &huge, &provenance).unwrap();
    assert_eq!(load(&path).unwrap().0, huge);
    let mut bytes = fs::read(&path).unwrap();
    forge(&mut bytes, "\"x1\":6,\"y1\":4", "\"x1\":7,\"y1\":4");
    let text = refused(&path, &bytes);
    let sizes =
        "array \"mean\" has 180 bytes of numbers, but 3 x 6 x 3 numbers of type f32 need 216";
    assert!(text.contains(sizes), "{text}");
}

#[test]
fn samples_left_out_must_fit_the_film() {
    let dir = tempfile::tempdir().unwrap();
    let mut film = whole_film();
    film.leave_out(3, 1, [1, 0, 2, 0]);
    let (path, _) = saved(dir.path(), &film);
    let good = fs::read(&path).unwrap();
    // The last row of the last array is x = 3, y = 1, and its counts; a few bytes of the directory follow it.
    let row: Vec<u8> = [3u64, 1, 1, 0, 2, 0]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    for (changed, says) in [
        ([300u64, 1, 1, 0, 2, 0], "lists pixel (300, 1) out of order"),
        ([3, 1, u64::MAX, 0, 2, 0], "with too many samples"),
        (
            [3, 1, 1 << 40, 0, 2, 0],
            "pixel (3, 1) leaves out more samples than it has",
        ),
        ([3, 1, 0, 0, 2, 0], "pixel (3, 1) has a count of"),
    ] {
        let mut bytes = good.clone();
        let new: Vec<u8> = changed.iter().flat_map(|n| n.to_le_bytes()).collect();
        forge_bytes(&mut bytes, &row, &new);
        let text = refused(&path, &bytes);
        assert!(text.contains(says), "{text}");
    }
}
