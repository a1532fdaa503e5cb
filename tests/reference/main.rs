//! Compares the CPU reference with closed forms, and its two estimators with each other.

mod build;
mod engine;
mod estimators;
mod furnace;
mod glass;
mod lighting;
mod rays;
