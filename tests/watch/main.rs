//! Who follows a render: JSON lines, logs and their plot, the page with real clients and a real browser, tev.

#[path = "../program/mod.rs"]
mod program;

mod browser;
mod client;
mod clients;
mod films;
mod lines;
mod page;
mod tev;
