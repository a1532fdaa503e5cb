//! The folder by which any denoiser can be judged: six halves of the replicates with features, and what the denoiser made of them.
//!
//! `half01.pfm` is the mean of the replicates 0 and 1. The denoiser writes `denoised01.pfm` (or `.exr`) beside it, and so on for
//! the six pairs.

use super::Task;
use crate::files::{FileError, atomic, open};
use crate::output::{read_exr, write_exr_rgb};
use crate::provenance::Provenance;
use crate::stats::denoised::{PAIRS, Rgb};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

/// The file that says of which film a folder is.
const NOTE: &str = "film.json";

/// Formats of the pictures in a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Form {
    /// Portable float map, which Open Image Denoise's own program reads.
    #[default]
    Pfm,
    /// OpenEXR.
    Exr,
}

/// What [`NOTE`] holds.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Note {
    /// The scene's title.
    scene: Option<String>,
    scene_hash: String,
    size: [u32; 2],
    samples: f64,
    seed: u32,
    /// SHA-256 of the replicates.
    replicates: String,
}

impl Note {
    fn new(task: &Task, provenance: &Provenance) -> Self {
        let mut hasher = Sha256::new();
        for picture in &task.replicates.means {
            let mut row = Vec::new();
            for value in picture.as_flattened() {
                row.extend(value.to_le_bytes());
            }
            hasher.update(&row);
        }
        let digest = hasher.finalize();
        Self {
            scene: provenance.scene_title.clone(),
            scene_hash: provenance.scene_hash.clone(),
            size: task.replicates.size,
            samples: provenance.samples,
            seed: provenance.settings.seed,
            replicates: digest.iter().map(|b| format!("{b:02x}")).collect(),
        }
    }
}

fn name(what: &str, pair: usize) -> String {
    let [a, b] = PAIRS[pair];
    format!("{what}{a}{b}")
}

/// Writes the six halves and the features to the folder, which is made if it does not exist. `next` hears the name of each file.
pub fn write(
    folder: &Path,
    task: &Task,
    provenance: &Provenance,
    form: Form,
    mut next: impl FnMut(&str),
) -> Result<(), FileError> {
    fs::create_dir_all(folder).map_err(|e| FileError::io(folder, "cannot create", &e))?;
    // They would be taken for what becomes of the new halves.
    if let Some(old) = (0..PAIRS.len()).find_map(|pair| denoised(folder, pair)) {
        let message = "this is there already, from other halves; remove it or name another folder";
        return Err(FileError::content(&old, message));
    }
    let size = task.replicates.size;
    let mut picture = |name: String, rgb: &Rgb| {
        next(&name);
        match form {
            Form::Pfm => write_pfm(&folder.join(name + ".pfm"), size, rgb),
            Form::Exr => write_exr_rgb(&folder.join(name + ".exr"), size, rgb),
        }
    };
    for pair in 0..PAIRS.len() {
        picture(name("half", pair), &task.half(pair))?;
    }
    picture("albedo".into(), &task.features.albedo)?;
    picture("normal".into(), &task.features.normal)?;
    // Last: a folder with this file is complete.
    let note = serde_json::to_vec_pretty(&Note::new(task, provenance)).expect("plain data");
    atomic::replace(&folder.join(NOTE), |file| file.write_all(&note))
}

/// Reads what a denoiser has made of the halves in `folder`, lamps put back. Refuses a folder of another film.
pub fn read(
    folder: &Path,
    task: &Task,
    provenance: &Provenance,
    mut next: impl FnMut(&str),
) -> Result<[Rgb; PAIRS.len()], FileError> {
    let path = folder.join(NOTE);
    let bytes = fs::read(&path).map_err(|e| FileError::io(&path, "cannot read", &e))?;
    let note: Note = serde_json::from_slice(&bytes).map_err(|e| {
        FileError::content(
            &path,
            format!("not written by etendue develop --folds: {e}"),
        )
    })?;
    if note != Note::new(task, provenance) {
        let of = format!(
            "these halves are of another film ({}, {} samples, seed {}); write them again with --folds",
            note.scene.as_deref().unwrap_or("untitled"),
            note.samples,
            note.seed
        );
        return Err(FileError::content(&path, of));
    }
    let mut all: [Rgb; PAIRS.len()] = Default::default();
    for (pair, fold) in all.iter_mut().enumerate() {
        let path = denoised(folder, pair).ok_or_else(|| {
            let path = folder.join(name("denoised", pair) + ".pfm");
            let message = "cannot read: there is no such file, nor one that ends in .exr; a denoiser makes it of the half with the \
                           same number"
                .into();
            FileError::Io { path, message }
        })?;
        next(&path.display().to_string());
        let (size, rgb) = read_picture(&path)?;
        if size != task.replicates.size {
            let [[w, h], [u, v]] = [size, task.replicates.size];
            let what = format!("it has {w}x{h} pixels, but the film has {u}x{v}");
            return Err(FileError::content(&path, what));
        }
        *fold = rgb;
        task.restore(pair, fold);
    }
    Ok(all)
}

/// The denoised picture of a pair, if it is there.
fn denoised(folder: &Path, pair: usize) -> Option<PathBuf> {
    let name = name("denoised", pair);
    let named = |extension: &str| folder.join(format!("{name}.{extension}"));
    ["exr", "pfm"].map(named).into_iter().find(|f| f.exists())
}

fn read_picture(path: &Path) -> Result<([u32; 2], Rgb), FileError> {
    if path.extension().is_some_and(|e| e == "exr") {
        let picture = read_exr(path)?;
        return Ok((picture.size, picture.rgb));
    }
    read_pfm(path)
}

/// Rows of a PFM go from the bottom to the top. A negative scale means little-endian floats.
fn write_pfm(path: &Path, size: [u32; 2], rgb: &Rgb) -> Result<(), FileError> {
    let [width, height] = size;
    atomic::replace(path, |file| {
        write!(file, "PF\n{width} {height}\n-1.0\n")?;
        for row in rgb.chunks(width as usize).rev() {
            let bytes: Vec<u8> = row
                .as_flattened()
                .iter()
                .flat_map(|v| v.to_le_bytes())
                .collect();
            file.write_all(&bytes)?;
        }
        Ok(())
    })
}

/// Size and pixels. Values must be finite.
fn read_pfm(path: &Path) -> Result<([u32; 2], Rgb), FileError> {
    /// Pixels a side.
    const MOST: u32 = 65536;
    let wrong =
        |what: &str| FileError::content(path, format!("not a PFM picture of R, G and B: {what}"));
    let mut file = BufReader::new(open(path)?);
    let mut words = Vec::new();
    for _ in 0..4 {
        let word = word(&mut file).map_err(|e| FileError::reading(path, &e))?;
        words.push(word);
    }
    if words[0] != "PF" {
        return Err(wrong("it does not begin with PF"));
    }
    let side = |word: &str| word.parse().ok().filter(|n| (1..=MOST).contains(n));
    let (Some(width), Some(height)) = (side(&words[1]), side(&words[2])) else {
        return Err(wrong("its size is none"));
    };
    let scale = words[3]
        .parse::<f32>()
        .ok()
        .filter(|s| *s != 0.0 && s.is_finite());
    let Some(scale) = scale else {
        return Err(wrong("its scale is no number"));
    };
    let count = width as usize * height as usize;
    let mut bytes = Vec::new();
    file.take(12 * count as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| FileError::reading(path, &e))?;
    if bytes.len() != 12 * count {
        return Err(wrong("it is too short or too long for its size"));
    }
    let float = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        if scale < 0.0 {
            f32::from_le_bytes(b)
        } else {
            f32::from_be_bytes(b)
        }
    };
    let rows = bytes.chunks(12 * width as usize).rev();
    let pixels = rows.flat_map(|row| row.chunks(12));
    let rgb: Rgb = pixels
        .map(|p| [float(p), float(&p[4..]), float(&p[8..])])
        .collect();
    match rgb.as_flattened().iter().position(|v| !v.is_finite()) {
        Some(at) => {
            let (x, y) = (at / 3 % width as usize, at / 3 / width as usize);
            let what = format!("a value of pixel ({x}, {y}) is not finite");
            Err(FileError::content(path, what))
        }
        None => Ok(([width, height], rgb)),
    }
}

/// The next word of a header; exactly one white space ends it.
fn word(file: &mut impl Read) -> std::io::Result<String> {
    /// Longer ones are no header's.
    const MOST: usize = 32;
    let mut word = String::new();
    let mut byte = [0];
    while word.len() < MOST {
        file.read_exact(&mut byte)?;
        if byte[0].is_ascii_whitespace() {
            if !word.is_empty() {
                break;
            }
        } else {
            word.push(byte[0].into());
        }
    }
    Ok(word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pfm_pictures_come_back_and_damaged_ones_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.pfm");
        let rgb: Rgb = (0..6).map(|i| [i as f32, -0.5 * i as f32, 1e9]).collect();
        write_pfm(&path, [3, 2], &rgb).unwrap();
        assert_eq!(read_pfm(&path).unwrap(), ([3, 2], rgb.clone()));
        let good = fs::read(&path).unwrap();
        assert!(good.starts_with(b"PF\n3 2\n-1.0\n") && good[12..16] == 3f32.to_le_bytes());

        // Big-endian, as others write it.
        let mut other = b"PF 3 2 1.0\n".to_vec();
        other.extend(good[12..].chunks(4).flat_map(|b| [b[3], b[2], b[1], b[0]]));
        fs::write(&path, other).unwrap();
        assert_eq!(read_pfm(&path).unwrap().1, rgb);

        let mut nan = good.clone();
        nan[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
        for (bytes, expected) in [
            (&b"Pf\n3 2\n-1.0\n"[..], "does not begin with PF"),
            (b"PF\n0 2\n-1.0\n", "its size is none"),
            (b"PF\n3 2\nx\n", "its scale is no number"),
            (&good[..50], "too short or too long"),
            (&good[..5], "end"),
            (&nan, "pixel (0, 1) is not finite"),
        ] {
            fs::write(&path, bytes).unwrap();
            let error = read_pfm(&path).unwrap_err();
            assert!(error.is_content(), "{error}");
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
