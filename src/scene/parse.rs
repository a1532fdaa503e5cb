//! Parse
