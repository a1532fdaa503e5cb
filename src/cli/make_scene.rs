//! `etendue make-scene`.

use super::args::{MakeSceneArgs, SceneKind};
use super::failure::Failure;
use super::say;
use crate::output::atomic;
use crate::scene::generate;
use std::io::Write as _;

/// Writes a scene with many objects, and the CSV file beside it if it needs one.
pub fn make_scene(args: &MakeSceneArgs) -> Result<(), Failure> {
    let (default, make) = match args.kind {
        SceneKind::Spheres => (
            "spheres.toml",
            generate::spheres as fn(usize, u32, &str) -> _,
        ),
        SceneKind::Lights => ("lights.toml", generate::lights as fn(usize, u32, &str) -> _),
    };
    let scene = args.output.clone().unwrap_or(default.into());
    // The CSV file has the same stem: with the ending .csv the scene itself would be overwritten.
    if !scene
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        let scene = scene.display();
        return Err(Failure::Input(format!(
            "--output {scene}: the name of a scene must end in .toml"
        )));
    }
    let rows = scene.with_extension("csv");
    let name = rows.file_name().unwrap_or_default().to_string_lossy();
    let made: generate::Generated = make(args.count as usize, args.seed, &name);
    let mut written = vec![scene.display().to_string()];
    if let Some(text) = &made.rows {
        atomic::replace(&rows, |f| f.write_all(text.as_bytes()))?;
        written.push(rows.display().to_string());
    }
    atomic::replace(&scene, |f| f.write_all(made.scene.as_bytes()))?;
    say!("wrote {}", written.join(", "));
    Ok(())
}
