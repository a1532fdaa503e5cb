//! Films and the program, seen from outside.

mod adaptive;
mod cost;
mod damage;
#[cfg(target_os = "linux")]
mod kill;
mod lock;
mod merge;
mod progress;
mod resume;

#[path = "../output_support/mod.rs"]
mod output_support;
#[path = "../program/mod.rs"]
mod program;
