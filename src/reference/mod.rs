//! The CPU reference: the same light transport in f64, written to be read.
