//! Numbers about pictures.

pub mod denoised;
mod pool;

/// Relative luminance of linear RGB with Rec. 709 primaries.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// A share as a percentage with three digits.
pub fn percent(share: f64) -> String {
    percent_to(share, 3)
}

/// A share as a percentage with so many digits.
pub fn percent_to(share: f64, digits: u32) -> String {
    let p = share * 100.0;
    if p == 0.0 {
        return "0 %".to_owned();
    }
    let places = f64::from(digits) - 1.0 - p.abs().log10().floor();
    format!("{p:.*} %", places.clamp(1.0, 12.0) as usize)
}
