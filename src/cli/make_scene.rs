//! `etendue make-scene`.

use super::args::{MakeSceneArgs, SceneKind};
use super::failure::Failure;
use super::say;
use crate::files::{FileError, atomic};
use crate::scene::generate;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Writes a scene with many objects, or of a volume, and the file of rows or of the volume beside it if it needs one.
pub fn make_scene(args: &MakeSceneArgs) -> Result<(), Failure> {
    type Make = fn(usize, u32, &str) -> generate::Generated;
    let (default, extension, make): (&str, &str, Make) = match args.kind {
        SceneKind::Spheres => ("spheres.toml", "csv", generate::spheres),
        SceneKind::Cloud => ("cloud.toml", "csv", generate::cloud),
        SceneKind::Particles => ("particles.toml", "xyz", generate::particles),
        SceneKind::Lights => ("lights.toml", "csv", generate::lights),
        SceneKind::Volume => ("volume.toml", "npy", generate::volume),
    };
    let scene = args.output.clone().unwrap_or(default.into());
    let [least, most] = generate::SIDES;
    if args.kind == SceneKind::Volume && !(least..=most).contains(&(args.count as usize)) {
        return Err(Failure::Input(format!(
            "--count {}: a volume has from {least} to {most} points along each side",
            args.count
        )));
    }
    // The file of rows has the same stem: with its ending the scene itself would be overwritten.
    if !scene
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        let scene = scene.display();
        return Err(Failure::Input(format!(
            "--output {scene}: the name of a scene must end in .toml"
        )));
    }
    let rows = scene.with_extension(extension);
    let name = rows.file_name().unwrap_or_default().to_string_lossy();
    let made = make(args.count as usize, args.seed, &name);
    let beside = made.rows.as_ref().map(String::as_bytes);
    let beside = beside.or(made.volume.as_deref());
    let beside = beside.map(|bytes| (&rows, bytes));
    let scene = (&scene, made.scene.as_bytes());
    let files: Vec<(&PathBuf, &[u8])> = beside.into_iter().chain([scene]).collect();
    if !args.force {
        for (path, bytes) in &files {
            check_not_lost(path, bytes)?;
        }
    }
    for (path, bytes) in &files {
        atomic::replace(path, |f| f.write_all(bytes))?;
    }
    let names: Vec<String> = files
        .iter()
        .rev()
        .map(|f| f.0.display().to_string())
        .collect();
    if !args.quiet {
        say!("wrote {}", names.join(", "));
    }
    Ok(())
}

/// Refuses to replace a file that someone may have edited: one with other contents.
fn check_not_lost(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    match fs::read(path) {
        Ok(old) if old != bytes => {
            let message = "the file exists, and may hold your own work; --force replaces it".into();
            let path = path.into();
            Err(FileError::Io { path, message }.into())
        }
        _ => Ok(()),
    }
}
