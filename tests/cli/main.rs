//! Runs the program: exit statuses, output files, and bit-identical results.
//!
//! Everything runs on the CPU reference, so that these tests need no adapter.

#[path = "../program/mod.rs"]
mod program;

mod bench;
mod bits;
mod doubts;
mod files;
mod info;
mod kinds;
mod said;
mod selftest;
mod shell;
mod status;
mod stops;
