//! The program from outside: exit statuses, what is written where, and the promises about bits.
//!
//! Everything runs on the CPU reference, so that these tests need no adapter.

#[path = "../program/mod.rs"]
mod program;

mod bench;
mod bits;
mod files;
mod said;
mod selftest;
mod status;
mod stops;
