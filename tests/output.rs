//! Pictures: our reader and others read back what was written, and damaged files give errors.

mod output_support;

use etendue::files::FileError;
use etendue::film::Film;
use etendue::film::coverage::Rect;
use etendue::output::{ExrChannels, Format, WriteOptions, read_exr, write_exr, write_png};
use output_support::{described, region_film, seen_from_python, whole_film};
use serde_json::json;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What each covered pixel says.
fn estimates(film: &Film) -> BTreeMap<(u32, u32), etendue::film::Estimate> {
    let mut all = BTreeMap::new();
    film.for_each(|x, y, e| {
        all.insert((x, y), e);
    });
    all
}

#[test]
fn an_exr_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    for film in [whole_film(), region_film()] {
        let provenance = described(&film);
        write_exr(&path, &film, &provenance, ExrChannels::All).unwrap();
        let picture = read_exr(&path).unwrap();
        assert_eq!(picture.size, film.size);
        let expected = estimates(&film);
        for (i, rgb) in picture.rgb.iter().enumerate() {
            let at = (i as u32 % 7, i as u32 / 7);
            let e = expected.get(&at).copied().unwrap_or_default();
            assert_eq!(*rgb, e.mean.map(|x| x as f32));
            assert_eq!(
                picture.error.as_ref().unwrap()[i],
                e.error.map(|x| x as f32)
            );
            assert_eq!(u64::from(picture.samples.as_ref().unwrap()[i]), e.samples);
            assert_eq!(picture.alpha[i], f32::from(expected.contains_key(&at)));
        }
        let attribute = |key: &str| picture.attributes[key].as_str();
        assert_eq!(attribute("software"), "etendue 0.1.0");
        assert_eq!(attribute("scene"), "Kästchen – \"one\"");
        assert_eq!(attribute("seed"), "4294967295");
        let samples = attribute("samples").parse::<f32>().unwrap();
        assert_eq!(samples, provenance.samples as f32);
        assert_eq!(attribute("replicates"), "4");
        let error = attribute("relative_error").parse::<f32>().unwrap();
        assert_eq!(error, provenance.relative_error.unwrap() as f32);
    }
}

#[test]
fn viewers_that_know_no_layers_get_r_g_and_b() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let film = region_film();
    for (channels, dtype, round) in [
        (ExrChannels::Rgb, "<f4", (|x| x as f32) as fn(f64) -> f32),
        // Eleven bits of a half, rounded to the nearest.
        (ExrChannels::RgbHalf, "<f2", |x| {
            let unit = 2f64.powi(x.abs().log2().floor() as i32 - 10);
            if x == 0.0 {
                0.0
            } else {
                ((x as f32 as f64 / unit).round_ties_even() * unit) as f32
            }
        }),
    ] {
        write_exr(&path, &film, &described(&film), channels).unwrap();
        let picture = read_exr(&path).unwrap();
        assert!(picture.error.is_none() && picture.samples.is_none());
        let expected = estimates(&film);
        for (i, rgb) in picture.rgb.iter().enumerate() {
            let at = (i as u32 % 7, i as u32 / 7);
            let mean = expected.get(&at).copied().unwrap_or_default().mean;
            assert_eq!(*rgb, mean.map(round), "{at:?}");
        }
        let Some(seen) = seen_from_python(&path) else {
            return;
        };
        let names: Vec<&String> = seen["channels"].as_object().unwrap().keys().collect();
        assert_eq!(names, ["B", "G", "R"]);
        assert_eq!(seen["channels"]["R"]["dtype"], dtype);
        assert_eq!(seen["attributes"]["replicates"], json!(4));
    }
}

#[test]
fn openexr_sees_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    for film in [whole_film(), region_film()] {
        let provenance = described(&film);
        write_exr(&path, &film, &provenance, ExrChannels::All).unwrap();
        let Some(seen) = seen_from_python(&path) else {
            return;
        };
        assert_eq!(seen["size"], json!([7, 5]));
        let channels = seen["channels"].as_object().unwrap();
        let names: Vec<&str> = channels.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "A", "B", "G", "R", "error.B", "error.G", "error.R", "error.Y", "samples"
            ]
        );
        let expected = estimates(&film);
        for y in 0..5u32 {
            for x in 0..7u32 {
                let e = expected.get(&(x, y)).copied().unwrap_or_default();
                let alpha = f64::from(u8::from(expected.contains_key(&(x, y))));
                let [r, g, b] = e.mean;
                let [er, eg, eb, ey] = e.error;
                for (name, value) in [
                    ("R", r),
                    ("G", g),
                    ("B", b),
                    ("A", alpha),
                    ("error.R", er),
                    ("error.G", eg),
                    ("error.B", eb),
                    ("error.Y", ey),
                ] {
                    let channel = &channels[name];
                    assert_eq!(channel["dtype"], "<f4");
                    let got = channel["values"][y as usize][x as usize].as_f64();
                    assert_eq!(got, Some(f64::from(value as f32)), "{name} at {x}, {y}");
                }
                let samples = &channels["samples"];
                assert_eq!(samples["dtype"], "<f4");
                assert_eq!(samples["values"][y as usize][x as usize], e.samples as f64);
            }
        }
        let expected = json!({
            "software": "etendue 0.1.0",
            "scene": "Kästchen – \"one\"",
            "scene_hash": "0123456789abcdef".repeat(4),
            "replicates": 4,
            "seed": "4294967295",
            "strata": 2,
            "max_depth": 64,
            "shadow_rays": 1,
            "light": "emitted,direct,indirect",
            "integrator": "path",
            "adapter": "llvmpipe (LLVM 15)",
            "driver": "Mesa 22.3.6",
            "seconds": 1.5,
        });
        let number = |key: &str| seen["attributes"][key].as_f64();
        let float = |x: f64| Some(f64::from(x as f32));
        assert_eq!(number("samples"), float(provenance.samples));
        assert_eq!(
            number("relative_error"),
            float(provenance.relative_error.unwrap())
        );
        for (key, value) in expected.as_object().unwrap() {
            assert_eq!(seen["attributes"][key], *value, "{key}");
        }
    }
}

#[test]
fn pillow_sees_the_png() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.png");
    for (film, mode, stops) in [(whole_film(), "RGB", 0.0), (region_film(), "RGBA", 1.0)] {
        write_png(&path, &film, &described(&film), stops).unwrap();
        let Some(seen) = seen_from_python(&path) else {
            return;
        };
        assert_eq!(seen["mode"], mode);
        assert_eq!(seen["size"], json!([7, 5]));
        // Relative colorimetric.
        assert_eq!(seen["srgb"], 1);
        assert_eq!(seen["text"]["Software"], "etendue 0.1.0");
        assert_eq!(seen["text"]["Title"], "Kästchen – \"one\"");
        assert_eq!(seen["text"]["seed"], "4294967295");
        assert_eq!(seen["text"]["adapter"], "llvmpipe (LLVM 15)");
        assert_eq!(seen["text"]["scene_hash"], "0123456789abcdef".repeat(4));
        let expected = estimates(&film);
        for y in 0..5u32 {
            for x in 0..7u32 {
                let mut level = vec![0.0; if mode == "RGB" { 3 } else { 4 }];
                if let Some(e) = expected.get(&(x, y)) {
                    level.fill(255.0);
                    for (level, mean) in level.iter_mut().zip(e.mean) {
                        let v = (mean * 2f64.powf(stops)).min(1.0);
                        *level = (255.0 * (1.055 * v.powf(1.0 / 2.4) - 0.055)).round();
                    }
                }
                let got: Vec<f64> = serde_json::from_value(
                    seen["pixels"]["values"][y as usize][x as usize].clone(),
                )
                .unwrap();
                assert_eq!(got, level, "{x}, {y}");
            }
        }
    }
}

#[test]
fn overflow_saturates_in_every_channel() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let rect = Rect::whole([2, 1]);
    let mut film = Film::new([2, 1], rect, 1);
    let bright = [[1e300, 1e39, 1.0, f64::INFINITY]; 4];
    film.put_samples(rect, 0..4, vec![bright; 2]);
    write_exr(&path, &film, &described(&film), ExrChannels::All).unwrap();
    let picture = read_exr(&path).unwrap();
    assert_eq!(picture.rgb[1], [f32::MAX, f32::MAX, 1.0]);
    // One sample: its own second moment is all that is known of the error.
    let mut film = Film::new([2, 1], rect, 1);
    film.put_samples(rect, 0..1, vec![bright; 2]);
    write_exr(&path, &film, &described(&film), ExrChannels::All).unwrap();
    assert_eq!(read_exr(&path).unwrap().error.unwrap()[0][3], f32::MAX);
    write_png(&path.with_extension("png"), &film, &described(&film), 0.0).unwrap();
}

#[test]
fn a_truncated_exr_is_an_error_of_content() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.exr");
    let film = whole_film();
    write_exr(&path, &film, &described(&film), ExrChannels::All).unwrap();
    let good = fs::read(&path).unwrap();
    for end in (0..good.len()).step_by(37) {
        fs::write(&path, &good[..end]).unwrap();
        let error = read_exr(&path).expect_err("a truncated picture");
        let text = error.to_string();
        assert!(error.is_content() && !text.contains('\n'), "{text}");
    }
}

#[test]
fn other_kinds_of_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let film = whole_film();
    let png = dir.path().join("a.png");
    write_png(&png, &film, &described(&film), 0.0).unwrap();
    let error = read_exr(&png).unwrap_err();
    assert!(error.is_content(), "{error}");
    for missing in [dir.path().join("none.exr"), dir.path().into()] {
        let error = read_exr(&missing).unwrap_err();
        assert!(matches!(error, FileError::Io { .. }), "{error}");
    }
    let nowhere = dir.path().join("none/a.exr");
    for format in [Format::Exr, Format::Png] {
        let error = format
            .write(&nowhere, &film, &described(&film), &WriteOptions::default())
            .unwrap_err();
        assert!(error.to_string().contains("no such folder"), "{error}");
    }
}

#[test]
fn a_full_disk_leaves_the_old_picture() {
    // /dev/full takes no bytes at all; a picture of some size reaches it through every buffer.
    let film = whole_film();
    for format in [Format::Exr, Format::Png] {
        let error = format
            .write(
                Path::new("/dev/full"),
                &film,
                &described(&film),
                &WriteOptions::default(),
            )
            .unwrap_err();
        assert!(!error.is_content());
        assert!(error.to_string().contains("no space left"), "{error}");
    }
}

/// Equal pictures are equal files, whatever order a hash table has.
#[test]
fn equal_pictures_are_equal_files() {
    let dir = tempfile::tempdir().unwrap();
    let film = whole_film();
    let provenance = described(&film);
    let written = |name: &str| {
        let path = dir.path().join(name);
        write_exr(&path, &film, &provenance, ExrChannels::All).unwrap();
        fs::read(path).unwrap()
    };
    let first = written("a.exr");
    for k in 0..8 {
        assert!(written(&format!("{k}.exr")) == first);
    }
}
