//! Reads pictures of other programs: Radiance HDR, JPEG, TIFF and WebP.

use super::png_read::decode_srgb;
use crate::files::kind::{self, FileKind};
use crate::files::{FileError, open};
use image::{DynamicImage, ImageError, ImageReader};
use std::io::{BufRead as _, BufReader};
use std::path::Path;

/// A picture, row by row from the top left. It does not state its noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Linear RGB; grey is taken for R = G = B. Every value is finite.
    pub rgb: Vec<[f64; 3]>,
    /// Whether alpha is more than 0.
    pub covered: Vec<bool>,
    /// Whether its numbers are whole, and end at white: it holds no value above 1.
    pub clipped: bool,
}

/// Reads a picture, of the kind that its first bytes tell. Floating-point values count as linear, whole numbers as sRGB. The error is
/// that of a missing or unreadable file, or of one whose content is wrong: damaged, not finite, or of more than 512 MiB.
pub fn read_image(path: &Path) -> Result<Image, FileError> {
    let reading = |e| FileError::reading(path, &e);
    let mut file = BufReader::new(open(path)?);
    let kind =
        FileKind::of(file.fill_buf().map_err(reading)?).filter(|kind| kind.is_other_picture());
    let reader = ImageReader::new(file);
    let reader = reader.with_guessed_format().map_err(reading)?;
    let image = reader.decode().map_err(|e| failure(path, kind, e))?;
    let linear = matches!(
        image,
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
    );
    let image = image.into_rgba32f();
    let (width, height) = image.dimensions();
    let mut rgb = Vec::with_capacity(width as usize * height as usize);
    let mut covered = Vec::with_capacity(rgb.capacity());
    for (x, y, pixel) in image.enumerate_pixels() {
        let [r, g, b, alpha] = pixel.0.map(f64::from);
        if ![r, g, b, alpha].iter().all(|v| v.is_finite()) {
            let why = format!("pixel ({x}, {y}) is not finite");
            return Err(FileError::content(path, why));
        }
        let value = |v: f64| if linear { v } else { decode_srgb(v) };
        rgb.push([r, g, b].map(value));
        covered.push(alpha > 0.0);
    }
    Ok(Image {
        size: [width, height],
        rgb,
        covered,
        clipped: !linear,
    })
}

fn failure(path: &Path, kind: Option<FileKind>, e: ImageError) -> FileError {
    let error = match e {
        ImageError::IoError(e) => FileError::reading(path, &e),
        _ if kind.is_none() => FileError::content(
            path,
            "not a picture (by its first bytes no HDR, JPEG, TIFF or WebP file)",
        ),
        other => FileError::content(path, format!("invalid picture: {other}")),
    };
    kind::explain(error, "a picture that etendue reads", kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, Rgb32FImage, RgbImage};

    /// A picture of two rows of three pixels in a format.
    fn written(format: ImageFormat, name: &str) -> Result<Image, FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let level = |x: u32, y: u32| [(40 * x + 80 * y) as u8, 100, 255];
        let image: DynamicImage = match format {
            ImageFormat::Hdr => Rgb32FImage::from_fn(3, 2, |x, y| {
                image::Rgb(level(x, y).map(|l| f32::from(l) / 64.0))
            })
            .into(),
            _ => RgbImage::from_fn(3, 2, |x, y| image::Rgb(level(x, y))).into(),
        };
        image.save_with_format(&path, format).unwrap();
        read_image(&path)
    }

    #[test]
    fn every_format_is_read_in_linear_values() {
        for (format, name, off) in [
            (ImageFormat::Tiff, "a.tif", 0.0),
            (ImageFormat::WebP, "a.webp", 0.0),
            (ImageFormat::Jpeg, "a.jpg", 0.2),
        ] {
            let read = written(format, name).unwrap();
            assert_eq!((read.size, &read.covered[..]), ([3, 2], &[true; 6][..]));
            // sRGB 120 is 0.187821 (IEC 61966-2-1), 255 is 1.
            let [r, g, b] = read.rgb[4];
            let right = [0.187_821, 0.127_438, 1.0];
            for (found, right) in [r, g, b].into_iter().zip(right) {
                assert!((found - right).abs() <= off + 1e-5, "{name}: {found}");
            }
        }
        let read = written(ImageFormat::Hdr, "a.hdr").unwrap();
        assert_eq!(read.rgb[4], [1.875, 1.5625, 3.984_375]);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        let values = [1.0, 2.0, f32::NAN];
        let image = Rgb32FImage::from_raw(1, 1, values.to_vec()).unwrap();
        image.save_with_format(&path, ImageFormat::Tiff).unwrap();
        let error = read_image(&path).unwrap_err().to_string();
        assert!(error.ends_with("pixel (0, 0) is not finite"), "{error}");
        std::fs::write(&path, b"II*\0 and no more").unwrap();
        let error = read_image(&path).unwrap_err();
        assert!(matches!(&error, FileError::Content { .. }), "{error}");
        std::fs::write(&path, "some text").unwrap();
        let error = read_image(&path).unwrap_err().to_string();
        assert!(
            error.contains("not a picture that etendue reads"),
            "{error}"
        );
        let none = read_image(&folder.path().join("none.tif")).unwrap_err();
        assert!(matches!(none, FileError::Io { .. }), "{none}");
    }
}
