//! The CPU reference held against closed forms, and its two estimators against each other.

mod build;
mod engine;
mod estimators;
mod furnace;
mod glass;
mod lighting;
mod rays;
