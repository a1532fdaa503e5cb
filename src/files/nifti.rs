//! Volumes in NIfTI-1 files (`.nii`, `.nii.gz`), which medical images are kept in.

use super::npy::{Array, Numbers};
use flate2::read::MultiGzDecoder;
use nifti::{DataElement, InMemNiftiVolume, NiftiHeader, NiftiType};
use std::io::{Read, copy, sink};

/// Bytes of a header.
const HEADER: u64 = 348;

/// The types of numbers that are read.
const READ: [NiftiType; 8] = [
    NiftiType::Uint8,
    NiftiType::Uint16,
    NiftiType::Float32,
    NiftiType::Float64,
    NiftiType::Int8,
    NiftiType::Int16,
    NiftiType::Int32,
    NiftiType::Uint32,
];

fn unread(kind: NiftiType) -> String {
    format!(
        "the NIfTI file has numbers of type {kind:?}, but must have whole ones of 8 to 32 bits, float32 or float64"
    )
}

/// Whether a file of this name is one: `Some(true)` if it is compressed, too.
pub fn is_named(name: &str) -> Option<bool> {
    let name = name.to_ascii_lowercase();
    match (name.ends_with(".nii"), name.ends_with(".nii.gz")) {
        (true, _) => Some(false),
        (_, true) => Some(true),
        _ => None,
    }
}

/// Reads a volume of at most `most` numbers. The array has the indices z, y and x. Whole numbers that are scaled by the header become float64;
/// other signed ones float32 or float64, whichever holds them.
///
/// # Errors
/// What is wrong with it, or what the system said.
pub fn read(from: impl Read, compressed: bool, most: u64) -> Result<Array, String> {
    if compressed {
        read_plain(MultiGzDecoder::new(from), most)
    } else {
        read_plain(from, most)
    }
}

fn read_plain(mut from: impl Read, most: u64) -> Result<Array, String> {
    let wrong = |e: nifti::NiftiError| format!("not a NIfTI file: {e}");
    let header = NiftiHeader::from_reader(&mut from).map_err(wrong)?;
    if &header.magic != b"n+1\0" {
        return Err(
            "the NIfTI header has its volume in another file; only .nii and .nii.gz are read"
                .into(),
        );
    }
    let size = header.dim().map_err(wrong)?;
    let [x, y, z] = match size {
        [x, y, z, more @ ..] if more.iter().all(|n| *n == 1) => [*x, *y, *z].map(usize::from),
        _ => {
            let sizes: Vec<String> = size.iter().map(u16::to_string).collect();
            return Err(format!(
                "the NIfTI file has {} numbers, but must have three dimensions",
                sizes.join(" x ")
            ));
        }
    };
    let count = x as u64 * y as u64 * z as u64;
    if count > most {
        return Err(format!(
            "the NIfTI file has {count} numbers, but at most {most} are read"
        ));
    }
    let kind = header.data_type().map_err(wrong)?;
    if !READ.contains(&kind) {
        return Err(unread(kind));
    }
    let skipped = f64::from(header.vox_offset) - HEADER as f64;
    if !(0.0..1e9).contains(&skipped) {
        return Err(format!(
            "the NIfTI file has its numbers at byte {}",
            header.vox_offset
        ));
    }
    let skipped = skipped as u64;
    let passed =
        copy(&mut from.by_ref().take(skipped), &mut sink()).map_err(|e| super::reason(&e))?;
    if passed < skipped {
        return Err("the NIfTI file ends before its numbers".into());
    }
    let mut bytes = Vec::new();
    let expected = count * kind.size_of() as u64;
    let found = from.take(expected).read_to_end(&mut bytes);
    if found.map_err(|e| super::reason(&e))? as u64 != expected {
        return Err(format!(
            "the NIfTI file ends after {} of {expected} bytes of numbers",
            bytes.len()
        ));
    }
    let (slope, shift) = (header.scl_slope, header.scl_inter);
    let volume =
        InMemNiftiVolume::from_raw_fields(header.dim, kind, slope, shift, bytes, header.endianness);
    let numbers = numbers(volume.map_err(wrong)?, kind)?;
    let (slope, shift) = (f64::from(slope), f64::from(shift));
    Ok(Array {
        shape: vec![z, y, x],
        first_fastest: false,
        // A slope of 0 means that there is no scale.
        numbers: if slope == 0.0 || (slope, shift) == (1.0, 0.0) {
            numbers
        } else {
            Numbers::F64(scaled(&numbers, slope, shift))
        },
    })
}

fn numbers(volume: InMemNiftiVolume, kind: NiftiType) -> Result<Numbers, String> {
    fn typed<T: DataElement>(volume: InMemNiftiVolume) -> Result<Vec<T>, String> {
        volume
            .into_nifti_typed_data()
            .map_err(|e| format!("not a NIfTI file: {e}"))
    }
    fn wider<T: DataElement, U: From<T>>(volume: InMemNiftiVolume) -> Result<Vec<U>, String> {
        Ok(typed::<T>(volume)?.into_iter().map(U::from).collect())
    }
    Ok(match kind {
        NiftiType::Uint8 => Numbers::U8(typed(volume)?),
        NiftiType::Uint16 => Numbers::U16(typed(volume)?),
        NiftiType::Float32 => Numbers::F32(typed(volume)?),
        NiftiType::Float64 => Numbers::F64(typed(volume)?),
        NiftiType::Int8 => Numbers::F32(wider::<i8, f32>(volume)?),
        NiftiType::Int16 => Numbers::F32(wider::<i16, f32>(volume)?),
        NiftiType::Int32 => Numbers::F64(wider::<i32, f64>(volume)?),
        NiftiType::Uint32 => Numbers::F64(wider::<u32, f64>(volume)?),
        _ => return Err(unread(kind)),
    })
}

fn scaled(numbers: &Numbers, slope: f64, shift: f64) -> Vec<f64> {
    fn all<T: Copy + Into<f64>>(numbers: &[T], slope: f64, shift: f64) -> Vec<f64> {
        numbers.iter().map(|&n| n.into() * slope + shift).collect()
    }
    match numbers {
        Numbers::U8(n) => all(n, slope, shift),
        Numbers::U16(n) => all(n, slope, shift),
        Numbers::F32(n) => all(n, slope, shift),
        Numbers::F64(n) => all(n, slope, shift),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write as _;

    /// A file with these dimensions, type, scale and numbers; in another order of bytes if they are `swapped`.
    fn file(dim: &[u16], kind: i16, scale: [f32; 2], numbers: &[u8], swapped: bool) -> Vec<u8> {
        let mut bytes = vec![0; 352];
        let mut put = |at: usize, value: &[u8]| {
            let mut value = value.to_vec();
            if swapped {
                value.reverse();
            }
            bytes[at..at + value.len()].copy_from_slice(&value);
        };
        put(0, &348i32.to_le_bytes());
        put(40, &(dim.len() as u16).to_le_bytes());
        for (k, n) in dim.iter().enumerate() {
            put(42 + 2 * k, &n.to_le_bytes());
        }
        put(70, &kind.to_le_bytes());
        put(108, &352f32.to_le_bytes());
        put(112, &scale[0].to_le_bytes());
        put(116, &scale[1].to_le_bytes());
        bytes[344..348].copy_from_slice(b"n+1\0");
        bytes.extend(numbers);
        bytes
    }

    const DIM: [u16; 3] = [3, 2, 2];

    #[test]
    fn numbers_are_read_as_they_are() {
        let all: Vec<u8> = (0..12).collect();
        let array =
            read(&file(&DIM, 2, [0.0, 0.0], &all, false)[..], false, 100).expect("a volume");
        assert_eq!((array.shape, array.first_fastest), (vec![2, 2, 3], false));
        assert_eq!(array.numbers, Numbers::U8(all));

        let words: Vec<i16> = (0..12).map(|k| 100 - 700 * k).collect();
        let bytes = |big: bool| -> Vec<u8> {
            let all = words.iter().map(|w| {
                if big {
                    w.to_be_bytes()
                } else {
                    w.to_le_bytes()
                }
            });
            all.flatten().collect()
        };
        let expected = Numbers::F32(words.iter().map(|w| f32::from(*w)).collect());
        for swapped in [false, true] {
            let plain = file(&[3, 2, 2, 1], 4, [1.0, 0.0], &bytes(swapped), swapped);
            assert_eq!(
                read(&plain[..], false, 100).expect("a volume").numbers,
                expected
            );
            let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
            packed.write_all(&plain).expect("written");
            let packed = packed.finish().expect("written");
            assert_eq!(
                read(&packed[..], true, 100).expect("a volume").numbers,
                expected
            );
        }
    }

    #[test]
    fn scales_are_applied() {
        let all: Vec<u8> = (0..12).collect();
        let array =
            read(&file(&DIM, 2, [0.5, -1.0], &all, false)[..], false, 100).expect("a volume");
        let expected = (0..12).map(|k| 0.5 * f64::from(k) - 1.0).collect();
        assert_eq!(array.numbers, Numbers::F64(expected));
    }

    #[test]
    fn damaged_headers_do_not_panic() {
        let all: Vec<u8> = (0..12).collect();
        for at in 0..352 {
            for value in [0, 1, 8, 127, 128, 255] {
                let mut bytes = file(&DIM, 2, [0.5, -1.0], &all, false);
                bytes[at] = value;
                if let Ok(array) = read(&bytes[..], false, 100) {
                    let count: usize = array.shape.iter().product();
                    assert!(count <= 100, "{at} {value}");
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let all: Vec<u8> = (0..12).collect();
        let says = |bytes: &[u8], part: &str| {
            let message = read(bytes, false, 100).expect_err(part);
            assert!(message.contains(part), "{message}");
        };
        says(b"", "not a NIfTI file");
        says(&[7; 400], "not a NIfTI file");
        says(
            &file(&DIM, 2, [0.0; 2], &all[..11], false),
            "after 11 of 12 bytes",
        );
        says(&file(&[3, 4], 2, [0.0; 2], &all, false), "3 x 4 numbers");
        says(
            &file(&[3, 2, 1, 2], 2, [0.0; 2], &all, false),
            "3 x 2 x 1 x 2 numbers",
        );
        says(
            &file(&[30, 20, 20], 2, [0.0; 2], &all, false),
            "12000 numbers, but at most 100",
        );
        says(&file(&DIM, 32, [0.0; 2], &all, false), "type Complex64");
        let mut elsewhere = file(&DIM, 2, [0.0; 2], &all, false);
        elsewhere[344..348].copy_from_slice(b"ni1\0");
        says(&elsewhere, "in another file");
        let mut before = file(&DIM, 2, [0.0; 2], &all, false);
        before[108..112].copy_from_slice(&20f32.to_le_bytes());
        says(&before, "at byte 20");
        before[108..112].copy_from_slice(&500f32.to_le_bytes());
        says(&before, "ends before its numbers");
    }
}
