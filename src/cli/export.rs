//! `etendue export`.

use super::args::{ExportArgs, ExportTarget};
use super::failure::Failure;
use super::files::{Files, is_stdout, write_text};
use super::say;
use crate::export::{Target, export as export_scene};
use crate::scene::parse;
use std::path::Path;

/// Writes the scene for another renderer, and says what differs.
pub fn export(args: &ExportArgs) -> Result<(), Failure> {
    let mut files = Files::default();
    files.reads("the scene", &args.scene)?;
    files.writes_text("--output", &args.output)?;
    let scene = parse::read(&args.scene)?;
    for file in &scene.row_files {
        files.reads("a table of the scene", &file.path)?;
    }
    let target = match args.to {
        ExportTarget::Mitsuba => Target::Mitsuba,
        ExportTarget::Pbrt => Target::Pbrt,
    };
    let named = if is_stdout(&args.output) {
        &args.scene
    } else {
        &args.output
    };
    let stem = named.file_stem().unwrap_or_default().to_string_lossy();
    let exported = export_scene(&scene, target, args.size, args.spp, &format!("{stem}.exr"))
        .map_err(|e| parse::ReadError::Invalid(vec![e]))?;
    for warning in &exported.warnings {
        say!("warning: {warning}");
    }
    write_text(&args.output, &exported.text)?;
    if !args.quiet && !is_stdout(&args.output) {
        say!("wrote {}", Path::display(&args.output));
    }
    Ok(())
}
