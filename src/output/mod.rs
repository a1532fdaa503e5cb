//! Pictures, reports and stored films.
