//! Numbers about pictures.

pub mod tail;

/// Relative luminance of linear RGB with Rec. 709 primaries.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}
