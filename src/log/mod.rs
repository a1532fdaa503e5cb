//! What a run says of itself, as events: JSON lines for programs, a log for [`plot`](crate::plot), a page for people.

mod file;
mod read;

pub use file::LogFile;
pub use read::{Log, read};

use crate::engine::DeviceInfo;
use serde::{Deserialize, Serialize};

/// One line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Event {
    /// A render is ready to begin.
    Start(Box<Start>),
    /// How far it has come.
    Progress(Point),
    /// What a person would read on stderr.
    Message(Message),
    /// How far another command has come.
    Step(Step),
    /// A render has ended.
    End(End),
}

/// What is rendered, with what, and until when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Version of the program.
    pub version: String,
    /// The scene file's name, without its folder.
    pub scene: String,
    /// The scene's title.
    pub title: Option<String>,
    /// Hash of scene and settings.
    pub scene_hash: String,
    /// Width and height of the whole picture.
    pub resolution: [u32; 2],
    /// Pixel rectangles x0, y0, x1, y1 that are rendered; empty for the whole picture.
    pub regions: Vec<[u32; 4]>,
    /// Seed.
    pub seed: u32,
    /// What renders.
    pub adapter: DeviceInfo,
    /// The film's name, without its folder.
    pub film: Option<String>,
    /// The stop conditions.
    pub target: Target,
    /// What the film held before.
    pub held: Held,
}

/// The stop conditions; the first one met ends the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Target {
    /// Samples of a pixel.
    pub samples: Option<u64>,
    /// Seconds of rendering by this run.
    pub seconds: Option<f64>,
    /// Relative error.
    pub relative_error: Option<f64>,
}

/// What earlier runs have left in the film.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Held {
    /// Samples of a pixel, on average.
    pub samples: f64,
    /// Seconds of rendering.
    pub seconds: f64,
}

/// The state of a render.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point {
    /// Samples of a pixel on average, those held before included.
    pub samples: f64,
    /// Seconds of rendering by this run.
    pub seconds: f64,
    /// The part of the samples that is done, 0 to 1, by the stop condition that looks nearest.
    pub fraction: Option<f64>,
    /// Seconds left, likewise.
    pub seconds_left: Option<f64>,
    /// Camera paths of this run.
    pub paths: u64,
    /// Over the rendering time.
    pub paths_per_second: Option<f64>,
    /// The tile that has got samples last: x0, y0, x1, y1.
    #[serde(default)]
    pub tile: Option<[u32; 4]>,
    /// The picture's error when it was last computed.
    #[serde(flatten)]
    pub error: Measured,
}

/// An error, and when it was computed. It is not computed for every line: that may take long for a large picture.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Measured {
    /// The relative error; null while it is not known.
    pub relative_error: Option<f64>,
    /// Its standard error.
    #[serde(rename = "relative_error_uncertainty")]
    pub uncertainty: Option<f64>,
    /// Why the true error may be far larger.
    #[serde(rename = "relative_error_doubt")]
    pub doubt: Option<Doubt>,
    /// Samples of a pixel at that time.
    #[serde(rename = "relative_error_samples")]
    pub samples: Option<f64>,
    /// Seconds of rendering by this run until then.
    #[serde(rename = "relative_error_seconds")]
    pub seconds: Option<f64>,
}

/// [`Doubt`](crate::film::error::Doubt) without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Doubt {
    /// No path has found any light.
    NoLight,
    /// A part of the picture has found no light.
    Unlit,
    /// Light that mirrors and glass show in a part of the picture was found too rarely.
    Hidden,
    /// The error rests on few samples.
    Uncertain,
}

impl From<crate::film::error::Doubt> for Doubt {
    fn from(doubt: crate::film::error::Doubt) -> Self {
        use crate::film::error::Doubt as Of;
        match doubt {
            Of::NoLight => Self::NoLight,
            Of::Unlit(_) => Self::Unlit,
            Of::Hidden(_) => Self::Hidden,
            Of::Uncertain => Self::Uncertain,
        }
    }
}

/// A line of text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Message {
    /// What kind of line.
    pub level: Level,
    /// The line without the word for its level.
    pub text: String,
}

/// How serious a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Something to know.
    Info,
    /// Something that may be wrong.
    Warning,
    /// Why the command fails.
    Error,
}

impl Message {
    /// From a line as people read it: `warning: …`, `error: …`, anything else.
    pub fn of(line: &str) -> Self {
        let (level, text) = if let Some(text) = line.strip_prefix("warning: ") {
            (Level::Warning, text)
        } else if let Some(text) = line.strip_prefix("error: ") {
            (Level::Error, text)
        } else {
            (Level::Info, line.strip_prefix("note: ").unwrap_or(line))
        };
        Self {
            level,
            text: text.into(),
        }
    }
}

/// The state of a command that is no render.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The part that is done, 0 to 1.
    pub fraction: f64,
    /// What is being done.
    pub doing: String,
}

/// How a render has ended. The numbers are those of its report.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// Which condition ended it: the report's word.
    pub stop_reason: String,
    /// Where it stood then.
    #[serde(flatten)]
    pub point: Point,
}

impl Event {
    /// One line of JSON, with its line break. Numbers that are not finite are null.
    pub fn line(&self) -> String {
        // This can't fail: an event has only strings, numbers, lists and fixed keys.
        let mut json = serde_json::to_string(self).expect("an event is plain data");
        json.push('\n');
        json
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn lines_have_the_documented_keys() {
        let point = Point {
            samples: 12.0,
            seconds: 3.5,
            paths: 96,
            ..Point::default()
        };
        let line = Event::Progress(point).line();
        assert!(line.ends_with("}\n") && line.matches('\n').count() == 1);
        let value: serde_json::Value = serde_json::from_str(&line).unwrap();
        let expected = json!({
            "event": "progress", "samples": 12.0, "seconds": 3.5, "fraction": null, "seconds_left": null,
            "paths": 96, "paths_per_second": null, "tile": null, "relative_error": null, "relative_error_uncertainty": null,
            "relative_error_doubt": null, "relative_error_samples": null, "relative_error_seconds": null,
        });
        assert_eq!(value, expected);
        assert_eq!(
            serde_json::from_str::<Event>(&line).unwrap(),
            Event::Progress(point)
        );
    }

    #[test]
    fn levels_are_told_by_the_first_word() {
        for (line, level, text) in [
            ("warning: a: b", Level::Warning, "a: b"),
            ("error: no", Level::Error, "no"),
            ("note: so", Level::Info, "so"),
            ("wrote a.png", Level::Info, "wrote a.png"),
        ] {
            let text = text.to_owned();
            assert_eq!(Message::of(line), Message { level, text });
        }
    }
}
