//! Layers, and denoised pictures that state their error: on a scene with a closed form, and by the program.
//!
//! What needs Open Image Denoise is left out where it is not found, and says so.

#[path = "../program/mod.rs"]
mod program;

mod closed_form;
mod command;

use etendue::denoise::oidn::Oidn;

/// Open Image Denoise, if it is there. Where ETENDUE_OIDN names it, it must be.
pub fn oidn() -> Option<Oidn> {
    match Oidn::load(None, None) {
        Ok(oidn) => Some(oidn),
        Err(why) if std::env::var_os("ETENDUE_OIDN").is_some() => panic!("{why}"),
        Err(why) => {
            eprintln!("LEFT OUT: {why}");
            None
        }
    }
}
