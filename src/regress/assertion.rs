//! The verdict as an assertion, for tests.

use crate::compare::{Limits, Picture, compare, html};
use crate::film::Film;
use crate::output::{atomic, write_exr};
use crate::provenance::Provenance;
use std::io::Write;
use std::path::Path;

/// The environment variable that makes [`assert_golden`] write its golden instead.
pub const BLESS: &str = "ETENDUE_BLESS";

/// Panics unless `film` equals the picture in `golden` up to the noise of both. The panic message says
/// what differs, where and by how much, names the report (`NAME.report.html` beside the golden), and explains
/// how to bless. If [`BLESS`] is set, writes the film as the golden instead.
///
/// The film should have as many samples as the golden, and another seed; [`Settings::seed`] may come from the
/// clock. Also panics if the golden is missing, damaged, without error layers, of another size or of another scene.
///
/// [`Settings::seed`]: crate::settings::Settings::seed
///
/// ```
/// use etendue::film::{Film, coverage::Rect};
/// use etendue::provenance::Provenance;
/// use etendue::reference::{CpuEngine, Estimator};
/// use etendue::scene::parse::parse_str;
/// use etendue::settings::{Overrides, Settings};
/// use etendue::{engine::Engine, regress::assert_golden, world::World};
/// use std::path::Path;
///
/// let text = r#"
///     [camera]
///     eye = [0.0, 1.0, 4.0]
///     look_at = [0.0, 0.5, 0.0]
///     vfov = 40.0
///     resolution = [16, 12]
///     [material.white]
///     type = "diffuse"
///     reflectance = [0.8, 0.8, 0.8]
///     [[sphere]]
///     center = [0.0, 0.5, 0.0]
///     radius = 0.5
///     material = "white"
///     [[light]]
///     center = [0.0, 3.0, 1.0]
///     normal = [0.0, -1.0, 0.0]
///     radius = 0.5
///     radiance = [20.0, 20.0, 20.0]
/// "#;
/// let render = |seed| {
///     let scene = parse_str(Path::new("ball.toml"), text).unwrap();
///     let overrides = Overrides { seed: Some(seed), ..Overrides::default() };
///     let settings = Settings::resolve(&scene, &overrides);
///     let world = World::new(&scene, settings.size);
///     let mut engine = CpuEngine::new(world, settings.clone(), Estimator::LightSampling);
///     let rect = Rect::whole(settings.size);
///     let mut film = Film::new(settings.size, rect, settings.strata);
///     engine.render(&mut film, rect, 0..64, &Default::default()).unwrap();
///     (film, Provenance::new(&scene, text, &settings))
/// };
/// # let folder = tempfile::tempdir().unwrap();
/// # let golden = folder.path().join("ball.exr");
/// # let (film, provenance) = render(1);
/// # let mut described = provenance.clone();
/// # described.describe(&film);
/// # etendue::output::write_exr(&golden, &film, &described).unwrap();
/// // let golden = Path::new("tests/golden/ball.exr");
/// let (film, provenance) = render(2);
/// assert_golden(&golden, &film, &provenance);
/// ```
#[track_caller]
pub fn assert_golden(golden: &Path, film: &Film, provenance: &Provenance) {
    let mut provenance = provenance.clone();
    provenance.describe(film);
    if std::env::var_os(BLESS).is_some() {
        if let Err(e) = write_exr(golden, film, &provenance) {
            panic!("{e}");
        }
        return;
    }
    if let Err(why) = check(golden, film, &provenance) {
        panic!(
            "{why}\nif the change is intended, run the same test with {BLESS}=1 to re-create {}",
            golden.display()
        );
    }
}

fn check(path: &Path, film: &Film, provenance: &Provenance) -> Result<(), String> {
    let golden = Picture::read(path).map_err(|e| e.to_string())?;
    if golden.origin("scene_hash") != Some(&provenance.scene_hash) {
        return Err(format!(
            "{}: this golden is of another scene or has other settings (its hash differs)",
            path.display()
        ));
    }
    let actual = Picture::from_film("the film".into(), film, provenance)?;
    let comparison = compare(&golden, &actual, &Limits::default()).map_err(|e| e.to_string())?;
    if comparison.same() {
        return Ok(());
    }
    let report = path.with_extension("report.html");
    let page = html::page(&golden, &actual, &comparison);
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
