//! `etendue info`: what a film or a picture says of itself.

use super::args::InfoArgs;
use super::failure::Failure;
use crate::film::coverage::Rect;
use crate::output::{
    Kind, NUMBERS, entries, read_exr, read_exr_header, read_image, read_png, read_png_header, store,
};
use crate::stats::percent;
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// What a file says of itself.
#[derive(Serialize)]
struct Info {
    file: String,
    /// `film`, `EXR picture`, `PNG picture` or `picture of another program`.
    kind: &'static str,
    /// Width and height of the whole picture in pixels.
    size: [u32; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<FilmInfo>,
    /// Names and types of the channels of a picture.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    channels: Vec<String>,
    /// The entries of its header.
    #[serde(serialize_with = "as_map")]
    entries: Vec<(String, String)>,
}

/// What only a film says.
#[derive(Serialize)]
struct FilmInfo {
    /// The part of the picture that it holds.
    region: Rect,
    /// Rectangles of pixels, and the sample numbers that each has, such as `0..256`.
    coverage: Vec<(String, String)>,
    /// Share of the region's pixels that have samples.
    covered: f64,
    /// Whether `--adaptive` chose the numbers of samples.
    adaptive: bool,
    /// The text of the scene file.
    scene_text: String,
}

/// Numbers are numbers, also where a header has them as text.
fn as_map<S: serde::Serializer>(entries: &[(String, String)], to: S) -> Result<S::Ok, S::Error> {
    let value = |key: &str, text: &str| {
        let number = NUMBERS
            .contains(&key)
            .then(|| serde_json::from_str(text).ok());
        number.flatten().unwrap_or_else(|| Value::from(text))
    };
    to.collect_map(entries.iter().map(|(k, v)| (k, value(k, v))))
}

/// Prints what the file says, as lines or as JSON.
pub fn info(args: &InfoArgs) -> Result<(), Failure> {
    let info = match Kind::of(&args.file)? {
        Kind::Film => of_film(&args.file)?,
        Kind::Exr => of_exr(&args.file)?,
        Kind::Png => of_png(&args.file)?,
        Kind::Other => of_image(&args.file)?,
    };
    let text = if args.json {
        let json = serde_json::to_string_pretty(&info);
        json.map_err(|e| Failure::Input(e.to_string()))? + "\n"
    } else {
        info.lines()
    };
    super::write_stdout(&text)
}

fn of_film(path: &Path) -> Result<Info, Failure> {
    let (film, mut provenance) = store::load(path)?;
    provenance.describe(&film);
    let ranges = |ranges: &[std::ops::Range<u64>]| {
        let each = ranges.iter().map(|r| format!("{}..{}", r.start, r.end));
        each.collect::<Vec<_>>().join(", ")
    };
    let cells = film.coverage.cells();
    let area: u64 = film.coverage.cells().map(|(r, _)| r.area()).sum();
    let entries = entries(&provenance).into_iter();
    Ok(Info {
        file: path.display().to_string(),
        kind: "film",
        size: film.size,
        film: Some(FilmInfo {
            region: film.bounds,
            coverage: cells.map(|(r, s)| (r.to_string(), ranges(s))).collect(),
            covered: area as f64 / film.bounds.area() as f64,
            adaptive: film.pilot.is_some(),
            scene_text: provenance.scene_text.clone(),
        }),
        channels: Vec::new(),
        entries: entries
            .map(|(k, v)| (k.to_owned(), v.to_string()))
            .collect(),
    })
}

fn of_exr(path: &Path) -> Result<Info, Failure> {
    let header = read_exr_header(path)?;
    // What has colours is read whole, so that damage is found.
    let has = |name: &str| header.channels.iter().any(|c| c.starts_with(name));
    if ["R (", "G (", "B ("].into_iter().all(has) {
        read_exr(path)?;
    }
    Ok(Info {
        file: path.display().to_string(),
        kind: "EXR picture",
        size: header.size,
        film: None,
        channels: header.channels,
        entries: header.attributes.into_iter().collect(),
    })
}

fn of_png(path: &Path) -> Result<Info, Failure> {
    let header = read_png_header(path)?;
    read_png(path)?;
    Ok(Info {
        file: path.display().to_string(),
        kind: "PNG picture",
        size: header.size,
        film: None,
        channels: vec![header.channels],
        entries: header.texts,
    })
}

fn of_image(path: &Path) -> Result<Info, Failure> {
    Ok(Info {
        file: path.display().to_string(),
        kind: "picture of another program",
        size: read_image(path)?.size,
        film: None,
        channels: Vec::new(),
        entries: Vec::new(),
    })
}

/// Most rectangles of a film that are listed: adaptive films have hundreds.
const LISTED: usize = 8;

impl Info {
    fn lines(&self) -> String {
        let [width, height] = self.size;
        let mut text = format!("{}: {}, {width}x{height}\n", self.file, self.kind);
        let mut line = |key: &str, value: &str| text += &format!("  {key:<27} {value}\n");
        if let Some(film) = &self.film {
            if film.region != Rect::whole(self.size) {
                line("region", &film.region.to_string());
            }
            match &film.coverage[..] {
                [] => line("sample numbers", "none"),
                [(_, only)] => line("sample numbers", only),
                several if several.iter().all(|(_, ranges)| *ranges == several[0].1) => {
                    line("sample numbers", &several[0].1);
                }
                several => {
                    for (rect, ranges) in several.iter().take(LISTED) {
                        line("sample numbers", &format!("{ranges} in {rect}"));
                    }
                    if several.len() > LISTED {
                        let more = several.len() - LISTED;
                        line(
                            "",
                            &format!("and {more} more rectangles (--json lists them)"),
                        );
                    }
                }
            }
            if film.covered < 1.0 {
                line("pixels with samples", &percent(film.covered));
            }
            if film.adaptive {
                line("adaptive", "yes");
            }
        }
        if !self.channels.is_empty() {
            line("channels", &self.channels.join(", "));
        }
        for (key, value) in &self.entries {
            // What is computed has sixteen digits, of which a reader wants four.
            match value.parse::<f64>() {
                _ if key == "scene_text" => {
                    let lines = value.lines().count();
                    line(key, &format!("{lines} lines (--json has them)"));
                }
                Ok(x) if x.fract() != 0.0 => line(key, &four_digits(x)),
                _ => line(key, value),
            }
        }
        text
    }
}

/// A number to four significant digits.
fn four_digits(x: f64) -> String {
    let places = 3 - x.abs().log10().floor() as i32;
    format!("{x:.*}", places.clamp(0, 12) as usize)
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_are_short() {
        let short =
            [0.089_196_232_2, 5.271_887, 220.666_666, 12_345.678, 1.5e-9].map(super::four_digits);
        assert_eq!(
            short,
            ["0.08920", "5.272", "220.7", "12346", "0.000000001500"]
        );
    }
}
