//! Films that are resumed: with which settings, and why not.

use super::args::{Backend, RenderArgs};
use super::failure::Failure;
use crate::files::FileError;
use crate::film::Film;
use crate::output::store;
use crate::provenance::Provenance;
use crate::scene::{Scene, parse};
use crate::settings::{Changed, Settings};
use std::path::Path;

/// The film to resume, if there is one.
pub(super) fn film(args: &RenderArgs) -> Result<Option<(Film, Provenance)>, Failure> {
    match &args.film {
        Some(path) if path.exists() => Ok(Some(store::load(path)?)),
        _ => Ok(None),
    }
}

/// The settings of a film that is resumed, but for what flags say, and for what the scene file has got since.
pub(super) fn settings(args: &RenderArgs, scene: &Scene, held: &Provenance) -> Settings {
    let before = parse::parse_str(&args.scene, &held.scene_text);
    let changed = before.map_or(Changed::default(), |old| Changed::between(&old, scene));
    let flags = args.overrides().or_held(&held.settings, &changed);
    let settings = Settings::resolve(scene, &flags);
    Settings {
        max_depth_is_default: held.settings.max_depth_is_default && args.max_depth.is_none(),
        ..settings
    }
}

/// Refuses a film whose samples differ from those of this command, and says why and what to type.
pub(super) fn check_same_samples(
    args: &RenderArgs,
    path: &Path,
    held: &Provenance,
    new: &Provenance,
) -> Result<(), Failure> {
    held.same_samples(new).map_err(|differ| {
        let flags = args.overrides();
        let leave_out = flags.against(&held.settings);
        let add = flags.to_add(&held.settings, &new.settings);
        let mut advice = Vec::new();
        if !leave_out.is_empty() {
            advice.push(format!("leave out {}", leave_out.join(" and ")));
        }
        if !add.is_empty() {
            advice.push(format!("add {}", add.join(" ")));
        }
        // Where flags do not help, the scene differs.
        let mut line = String::new();
        if advice.is_empty() {
            advice.push("give the scene of the film".into());
            let first = first_difference(&held.scene_text, &new.scene_text);
            line = first.map_or(line, |first| format!("; {first}"));
        }
        let advice = format!("{}, or name another film", advice.join(" and "));
        let message =
            format!("this film can't be resumed; film and command line: {differ}{line}; {advice}");
        FileError::content(path, message).into()
    })
}

/// A film that has light paths cannot be resumed without, and the other way round: samples leave out what light paths bring.
pub(super) fn other_light_paths(args: &RenderArgs, film: &Film) -> Failure {
    let advice = match (film.splats(), args.backend) {
        (Some(_), Backend::Gpu) => "it is not of this scene's light paths",
        (Some(_), _) => {
            "it has light paths, which the CPU reference does not trace; resume it with --backend gpu"
        }
        (None, _) => "it has no light paths; resume it with --light-paths off",
    };
    let path = args.film.clone().unwrap_or_default();
    FileError::content(&path, format!("this film can't be resumed here: {advice}")).into()
}

/// The first line of a scene file that another has not, and what that one has there. Comments and blanks do not count. `None` where there
/// is no such line: a file of rows has changed.
fn first_difference(film: &str, file: &str) -> Option<String> {
    fn lines(text: &str) -> impl Iterator<Item = (usize, String)> {
        let said = text.lines().map(|line| {
            let is_comment = |at: &usize| !line[..*at].contains(['"', '\'']);
            let end = line.find('#').filter(is_comment).unwrap_or(line.len());
            let words: Vec<&str> = line[..end].split_whitespace().collect();
            words.join(" ")
        });
        let all = said.enumerate().map(|(i, line)| (i + 1, line));
        all.filter(|(_, line)| !line.is_empty())
    }
    let (mut film, mut file) = (lines(film), lines(file));
    loop {
        let (was, is) = match (film.next(), file.next()) {
            (None, None) => return None,
            (Some(was), Some(is)) if was.1 == is.1 => continue,
            differ => differ,
        };
        let told = |line: Option<(usize, String)>| match line {
            Some((number, text)) => format!("`{}` at line {number}", short(&text)),
            None => "no more lines".to_owned(),
        };
        return Some(format!(
            "the film's scene has {}, and the file has {}",
            told(was),
            told(is)
        ));
    }
}

/// The beginning of a line.
fn short(line: &str) -> String {
    const MOST: usize = 60;
    match line.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &line[..end]),
        None => line.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::first_difference;

    #[test]
    fn the_first_line_that_differs_is_told() {
        let film = "# a room\nradius = 1\n\nmaterial = \"#1\"\n";
        let told = |file: &str| first_difference(film, file);
        assert_eq!(
            told("radius=1").as_deref(),
            Some(
                "the film's scene has `radius = 1` at line 2, and the file has `radius=1` at line 1"
            )
        );
        assert_eq!(told("radius  = 1 # m\nmaterial = \"#1\""), None);
        assert_eq!(
            told("radius = 1\n").as_deref(),
            Some(
                "the film's scene has `material = \"#1\"` at line 4, and the file has no more lines"
            )
        );
        let long = format!("radius = 1\nmaterial = {}", "x".repeat(99));
        assert!(told(&long).is_some_and(|text| text.ends_with("x…` at line 2")));
    }
}
