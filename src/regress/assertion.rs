//! The verdict as an assertion, for tests.

use super::golden;
use crate::compare::{Limits, Side, compare, html};
use crate::files::atomic;
use crate::film::Film;
use crate::output::Extra;
use crate::provenance::Provenance;
use std::io::Write;
use std::path::Path;

/// The environment variable that makes [`assert_golden`] write its golden instead.
pub const BLESS: &str = "ETENDUE_BLESS";

/// Panics unless `film` equals the picture at `path` up to the noise of both. The panic message says
/// what differs, where and by how much, names the report (`NAME.report.html` beside the golden), and explains
/// how to bless. If [`BLESS`] is set, writes the film as the golden instead.
///
/// The film should have as many samples as the golden, and another seed; [`Settings::seed`] may come from the
/// clock. Also panics if the golden is missing, damaged, without error layers, of another size or of another scene.
///
/// [`Settings::seed`]: crate::Settings::seed
///
/// ```
/// use etendue::{Backend, Options, Picture, Scene, regress::assert_golden};
///
/// let render = |seed| -> Result<Picture, etendue::Error> {
///     let scene = Scene::builder()
///         .camera([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], 40.0, [16, 12])
///         .diffuse("white", [0.8; 3])
///         .sphere([0.0, 0.5, 0.0], 0.5, "white")
///         .light([0.0, 3.0, 1.0], [0.0, -1.0, 0.0], 0.5, [20.0; 3])
///         .build()?;
///     let backend = Backend::Cpu;
///     etendue::render(&scene, &Options { spp: Some(64), seed: Some(seed), backend, ..Options::default() })
/// };
/// # let folder = tempfile::tempdir().unwrap();
/// # let golden = folder.path().join("ball.exr");
/// # render(1)?.save(&golden)?;
/// // let golden = Path::new("tests/golden/ball.exr");
/// let picture = render(2)?;
/// assert_golden(&golden, picture.film(), picture.provenance());
/// # Ok::<(), etendue::Error>(())
/// ```
#[track_caller]
pub fn assert_golden(path: &Path, film: &Film, provenance: &Provenance) {
    let mut provenance = provenance.clone();
    provenance.describe(film);
    if std::env::var_os(BLESS).is_some() {
        if let Err(e) = golden::write(path, film, &provenance, Extra::default()) {
            panic!("{e}");
        }
        return;
    }
    if let Err(why) = check(path, film, &provenance) {
        panic!(
            "{why}\nif the change is intended, run the same test with {BLESS}=1 to re-create {}",
            path.display()
        );
    }
}

fn check(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), String> {
    let golden = Side::read(path).map_err(|e| e.to_string())?;
    if golden.origin("scene_hash") != Some(&provenance.scene_hash) {
        return Err(format!(
            "{}: this golden is of another scene or has other settings (its hash differs)",
            path.display()
        ));
    }
    let actual = Side::from_film("the film".into(), film, provenance)?;
    let comparison = compare(&golden, &actual, &Limits::default()).map_err(|e| e.to_string())?;
    if comparison.same() {
        return Ok(());
    }
    let report = path.with_extension("report.html");
    let page = html::page(&golden, &actual, super::LABELS, &comparison);
    let written = atomic::replace(&report, |f| f.write_all(page.as_bytes()));
    let place = match written {
        Ok(()) => format!("report: {}", report.display()),
        Err(e) => format!("the report could not be written: {e}"),
    };
    Err(format!(
        "{} and the film: {}\n{place}",
        path.display(),
        comparison.report()
    ))
}
