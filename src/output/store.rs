//! Films on disk: an `.npz` archive that `numpy.load` opens.
//!
//! | array | type, shape | holds |
//! |---|---|---|
//! | `provenance` | `\|S`, one item | JSON: format and its version, size, bounds, coverage, [`Provenance`] |
//! | `mean` | f32 (h, w, 3) | mean radiance, linear RGB: what an EXR file has |
//! | `error` | f32 (h, w, 4) | standard errors of the mean of R, G, B, and of the luminance: what an EXR file has |
//! | `counts` | u64 (h, w) | samples of each pixel, without those left out |
//! | `sums` | f64 (h, w, 4 replicates, 4) | R, G, B, and luminance², over finished blocks |
//! | `partial` | f32 (h, w, 4 replicates, 4) | the same over an unfinished block; only there while one is |
//! | `splats` | u64 (h, w, 4 replicates, 4) | light that light paths have brought: R, G, B, and luminance² of each splat, in steps; only there if the header has `splats` |
//! | `left_out` | u64 (n, 2 + 4 replicates) | pixels x, y with samples that were not finite, and how many of each replicate; only there if there are any |
//!
//! h and w are those of `bounds`. `mean` and `error` follow from the others, and are there for readers in other languages: this
//! program does not read them.

mod check;

use check::{check_header, check_pixel, counts, pixel, subtract};

use super::npz::{self, Array, Damage, Reader};
use super::pixels::{Pixels, finite};
use crate::files::atomic;
use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use crate::film::coverage::{Coverage, Rect};
use crate::film::pilot::Pilot;
use crate::film::splats::SplatSetup;
use crate::film::{BLOCK, Film, REPLICATES, Reach, Sums};
use crate::provenance::Provenance;
use crate::scene::LARGEST_STRATA;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Version of the format that this program writes, and the only one that it reads.
pub const FORMAT_VERSION: u32 = 1;

const FORMAT: &str = "etendue film";

/// Pixels per side of a picture: the scene format's limit.
const MAX_SIDE: u32 = 65536;

/// The content of the array `provenance`. Its first two keys are those of [`Kind`].
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    format_version: u32,
    size: [u32; 2],
    bounds: Rect,
    strata: u32,
    replicates: usize,
    block: u64,
    partial: bool,
    /// Whether there are arrays `mean` and `error`.
    #[serde(default)]
    developed: bool,
    /// Rows of the array `left_out`.
    #[serde(default)]
    left_out: u64,
    /// Whether there is an array `reached`.
    #[serde(default)]
    reached: bool,
    /// What the array `splats` is of; only there if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    splats: Option<SplatHeader>,
    /// What steers an adaptive film; only there in one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pilot: Option<Pilot>,
    coverage: Coverage,
    provenance: Provenance,
}

/// Passes of light paths.
#[derive(Serialize, Deserialize)]
struct SplatHeader {
    #[serde(flatten)]
    setup: SplatSetup,
    /// Which pixels have which passes.
    coverage: Coverage,
}

/// As much of [`Header`] as every version has.
#[derive(Deserialize)]
struct Kind {
    format: String,
    format_version: u32,
}

/// Bytes that a pixel of a film may take in a file: mean, error, count, reach, sums of finished and unfinished blocks, and of splats if
/// it has light paths.
pub fn pixel_bytes(light_paths: bool) -> u64 {
    let splats = if light_paths { 128 } else { 0 };
    12 + 16 + 8 + 1 + 128 + 64 + splats
}

/// Saves a film: the file is whole or as it was.
pub fn save(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), FileError> {
    let unfinished = film.partial().iter().flatten().flatten().any(|&x| x != 0.0);
    let left_out = film.left_out().rows();
    let header = Header {
        format: FORMAT.into(),
        format_version: FORMAT_VERSION,
        size: film.size,
        bounds: film.bounds,
        strata: film.strata,
        replicates: REPLICATES,
        block: BLOCK,
        partial: unfinished,
        developed: true,
        left_out: left_out.len() as u64,
        reached: !film.reached().is_empty(),
        splats: film.splats().map(|s| SplatHeader {
            setup: s.setup,
            coverage: s.coverage.clone(),
        }),
        pilot: film.pilot.clone(),
        coverage: film.coverage.clone(),
        provenance: provenance.clone(),
    };
    let json = serde_json::to_vec(&header).map_err(|e| {
        FileError::content(
            path,
            format!("its provenance can't be written as JSON: {e}"),
        )
    })?;
    let counts = counts(&film.coverage, film.bounds)
        .and_then(|mut counts| {
            subtract(&mut counts, film.bounds, &left_out)?;
            Ok(counts)
        })
        .map_err(|e| FileError::content(path, format!("inconsistent film: {e}")))?;
    let [mean, error] = develop(film);
    let [height, width] = [film.bounds.height(), film.bounds.width()].map(u64::from);
    let per_replicate = vec![height, width, REPLICATES as u64, 4];
    let mut arrays = vec![
        Array {
            name: "provenance",
            descr: format!("|S{}", json.len()),
            shape: vec![],
            data: &json,
        },
        Array {
            name: "mean",
            descr: "<f4".into(),
            shape: vec![height, width, 3],
            data: bytemuck::cast_slice(&mean),
        },
        Array {
            name: "error",
            descr: "<f4".into(),
            shape: vec![height, width, 4],
            data: bytemuck::cast_slice(&error),
        },
        Array {
            name: "counts",
            descr: "<u8".into(),
            shape: vec![height, width],
            data: bytemuck::cast_slice(&counts),
        },
        Array {
            name: "sums",
            descr: "<f8".into(),
            shape: per_replicate.clone(),
            data: bytemuck::cast_slice(film.sums()),
        },
    ];
    if unfinished {
        arrays.push(Array {
            name: "partial",
            descr: "<f4".into(),
            shape: per_replicate.clone(),
            data: bytemuck::cast_slice(film.partial()),
        });
    }
    if let Some(splats) = film.splats() {
        arrays.push(Array {
            name: "splats",
            descr: "<u8".into(),
            shape: per_replicate,
            data: bytemuck::cast_slice(splats.sums()),
        });
    }
    if !left_out.is_empty() {
        arrays.push(Array {
            name: "left_out",
            descr: "<u8".into(),
            shape: vec![left_out.len() as u64, 2 + REPLICATES as u64],
            data: bytemuck::cast_slice(&left_out),
        });
    }
    if !film.reached().is_empty() {
        arrays.push(Array {
            name: "reached",
            descr: "|u1".into(),
            shape: vec![height, width],
            data: film.reached(),
        });
    }
    atomic::replace(path, |file| npz::write(file, &arrays))
}

/// Means and errors of all pixels of the film, row by row, as an EXR file has them; 0 where there are no samples.
fn develop(film: &Film) -> [Vec<f32>; 2] {
    let pixels = Pixels::new(film);
    let of_row = |y| {
        let estimates = (film.bounds.x0..film.bounds.x1).map(|x| pixels.at(x, y));
        estimates.map(Option::unwrap_or_default).collect::<Vec<_>>()
    };
    let rows: Vec<_> = (film.bounds.y0..film.bounds.y1)
        .into_par_iter()
        .map(of_row)
        .collect();
    let all = || rows.iter().flatten();
    [
        all().flat_map(|e| e.mean.map(finite)).collect(),
        all().flat_map(|e| e.error.map(finite)).collect(),
    ]
}

/// The part of a film's file before its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Whether it was rendered with `--adaptive`.
    pub adaptive: bool,
    /// The part of the picture that it holds.
    pub bounds: Rect,
    /// Which pixels have had which samples.
    pub coverage: Coverage,
    /// Which pixels have had which passes of light paths, in a film that has any.
    pub passes: Option<Coverage>,
    /// Where it comes from.
    pub provenance: Provenance,
}

/// Reads only the part before the numbers. The numbers are not checked and may be damaged.
pub fn outline(path: &Path) -> Result<Outline, FileError> {
    let header = reading(path, |mut reader| read_header(&mut reader))?;
    Ok(Outline {
        adaptive: header.pilot.is_some(),
        bounds: header.bounds,
        coverage: header.coverage,
        passes: header.splats.map(|s| s.coverage),
        provenance: header.provenance,
    })
}

/// Loads a film, and checks all its contents.
pub fn load(path: &Path) -> Result<(Film, Provenance), FileError> {
    reading(path, read)
}

/// Opens a film's file for `read`, and tells the kinds of its failures apart.
fn reading<T>(
    path: &Path,
    read: impl FnOnce(Reader<BufReader<File>>) -> Result<T, Damage>,
) -> Result<T, FileError> {
    let file = open(path)?;
    let length = file
        .metadata()
        .map_err(|e| FileError::io(path, "cannot read", &e))?
        .len();
    let reader = Reader::new(BufReader::with_capacity(1 << 18, file), length);
    let result = read(reader).map_err(|damage| match damage {
        Damage::Io(e) if e.kind() == std::io::ErrorKind::OutOfMemory => FileError::Io {
            path: path.into(),
            message: format!("cannot read: not enough memory for a film of {length} bytes"),
        },
        Damage::Io(e) => FileError::reading(path, &e),
        Damage::Wrong(what) => FileError::content(path, format!("invalid film: {what}")),
        Damage::Alien(what) => FileError::content(path, format!("not a film: {what}")),
    });
    result.map_err(|e| kind::explain(e, "a film", Some(FileKind::Zip)))
}

fn read_header<R: Read>(reader: &mut Reader<R>) -> Result<Header, Damage> {
    let wrong = |what: String| Err(Damage::Wrong(what));
    let json = reader.string("provenance")?;
    let not_json = |e: serde_json::Error| Damage::Wrong(format!("its provenance is invalid: {e}"));
    let kind: Kind = serde_json::from_slice(&json).map_err(not_json)?;
    if kind.format != FORMAT {
        return wrong(format!("its format is {:?}, not {FORMAT:?}", kind.format));
    }
    if kind.format_version != FORMAT_VERSION {
        return wrong(format!(
            "its format version is {}; this program reads version {FORMAT_VERSION}",
            kind.format_version
        ));
    }
    let header: Header = serde_json::from_slice(&json).map_err(not_json)?;
    check_header(&header).map_err(Damage::Wrong)?;
    Ok(header)
}

fn read<R: Read>(mut reader: Reader<R>) -> Result<(Film, Provenance), Damage> {
    let header = read_header(&mut reader)?;
    let pixels = header.bounds.area();
    let [height, width] = [header.bounds.height(), header.bounds.width()].map(u64::from);
    let per_replicate = [height, width, REPLICATES as u64, 4];
    if header.developed {
        reader.array::<[f32; 3]>("mean", "<f4", &[height, width, 3], pixels)?;
        reader.array::<[f32; 4]>("error", "<f4", &[height, width, 4], pixels)?;
    }
    let stored: Vec<u64> = reader.array("counts", "<u8", &[height, width], pixels)?;
    let sums: Vec<[Sums<f64>; REPLICATES]> = reader.array("sums", "<f8", &per_replicate, pixels)?;
    let partial: Vec<[Sums<f32>; REPLICATES]> = if header.partial {
        reader.array("partial", "<f4", &per_replicate, pixels)?
    } else {
        Vec::new()
    };
    let splats: Option<Vec<[[u64; 4]; REPLICATES]>> = match &header.splats {
        Some(_) => Some(reader.array("splats", "<u8", &per_replicate, pixels)?),
        None => None,
    };
    let left_out: Vec<[u64; 2 + REPLICATES]> = if header.left_out > 0 {
        let shape = [header.left_out, 2 + REPLICATES as u64];
        reader.array("left_out", "<u8", &shape, header.left_out)?
    } else {
        Vec::new()
    };
    let reached = if header.reached {
        let reached: Vec<u8> = reader.array("reached", "|u1", &[height, width], pixels)?;
        if reached.iter().any(|r| *r > Reach::Found as u8) {
            return Err(Damage::Wrong("\"reached\" holds more than 0 to 4".into()));
        }
        reached
    } else {
        Vec::new()
    };
    reader.finish()?;

    // Only now is it certain that the file is as large as its bounds require.
    let mut counts = counts(&header.coverage, header.bounds).map_err(Damage::Wrong)?;
    subtract(&mut counts, header.bounds, &left_out).map_err(Damage::Wrong)?;
    if let Some(i) = (0..counts.len()).find(|&i| counts[i] != stored[i]) {
        return Err(Damage::Wrong(format!(
            "pixel {} has a count of {} samples, but its coverage has {}",
            pixel(header.bounds, i),
            stored[i],
            counts[i]
        )));
    }
    for (i, (sum, &count)) in sums.iter().zip(&counts).enumerate() {
        check_pixel("sums", sum, count)
            .map_err(|e| Damage::Wrong(format!("pixel {}: {e}", pixel(header.bounds, i))))?;
    }
    for (i, (sum, &count)) in partial.iter().zip(&counts).enumerate() {
        check_pixel("partial", &sum.map(|s| s.map(f64::from)), count)
            .map_err(|e| Damage::Wrong(format!("pixel {}: {e}", pixel(header.bounds, i))))?;
    }
    let mut film = Film::from_parts(
        header.size,
        header.bounds,
        header.strata,
        header.coverage,
        sums,
        partial,
    );
    film.pilot = header.pilot;
    film.set_reached(reached);
    if let Some((SplatHeader { setup, coverage }, sums)) = header.splats.zip(splats) {
        film.set_splats(setup, coverage, sums);
    }
    for [x, y, samples @ ..] in left_out {
        film.leave_out(x as u32, y as u32, samples);
    }
    Ok((film, header.provenance))
}
