//! A page on which pictures grow, served by this process.
//!
//! ```text
//! the run, or a file that is watched  ->  Board (numbers, messages, snapshots of films)  ->  Server (HTTP, one thread)
//! ```
//!
//! Who renders only writes to the [`Board`], under a lock that nobody holds for long, and copies its film only while someone looks at
//! it. All else is done by the server's threads. Nothing that a client does, or does not do, makes the renderer wait.

mod address;
mod answer;
mod board;
mod connection;
mod download;
mod files;
mod layers;
mod query;
mod requests;
mod server;
mod snapshot;
mod tev;

pub use address::Address;
pub use board::{About, Board, Run};
pub use files::{Files, MOST_FILMS};
pub use server::{Server, Stopped};
pub use snapshot::{Picture, Snapshot};
pub use tev::Tev;
