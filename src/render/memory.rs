//! Whether a picture fits into memory, asked before anything is allocated.

use super::Error;
use crate::engine::MAX_TILE_PIXELS;
use std::fs;

/// Bytes that a pixel of the film takes: four replicates of four f64 sums, and of four f32 sums of the block
/// in progress.
const FILM_BYTES: u64 = 128 + 64;

/// Bytes that a pixel takes while pictures are written: nine f32 channels and a count.
const OUTPUT_BYTES: u64 = 40;

/// Bytes that a pixel of the tile in work takes on top, on a software adapter too: two textures, the buffer that is
/// read back, counters, and their copies.
const TILE_BYTES: u64 = 384;

fn needed(pixels: u64) -> u64 {
    let film = pixels.saturating_mul(FILM_BYTES + OUTPUT_BYTES);
    film.saturating_add(pixels.min(MAX_TILE_PIXELS) * TILE_BYTES)
}

/// Refuses a picture part of `pixels` pixels that memory cannot hold, with the numbers.
pub fn check(pixels: u64) -> Result<(), Error> {
    match available() {
        Some(have) if needed(pixels) > have => Err(Error::Input(format!(
            "a film of {:.1} million pixels takes {:.1} GB and {:.1} GB are free: render a smaller --size, or \
                 a --region at a time",
            pixels as f64 / 1e6,
            needed(pixels) as f64 / 1e9,
            have as f64 / 1e9,
        ))),
        _ => Ok(()),
    }
}

/// Bytes that this process may still take, as far as the system tells (Linux).
fn available() -> Option<u64> {
    let system = mem_available(&fs::read_to_string("/proc/meminfo").ok()?)?;
    let number = |path| fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    // In a container the limit of its control group can lie below what the machine has.
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map_or(u64::MAX, |(most, now)| most.saturating_sub(now));
    Some(system.min(group).min(address_space()))
}

/// What `ulimit -v` leaves this process.
fn address_space() -> u64 {
    let left = || {
        let limits = fs::read_to_string("/proc/self/limits").ok()?;
        let line = limits
            .lines()
            .find(|l| l.starts_with("Max address space"))?;
        let limit: u64 = line.split_whitespace().nth(3)?.parse().ok()?;
        let status = fs::read_to_string("/proc/self/status").ok()?;
        Some(limit.saturating_sub(kib(&status, "VmSize:")?))
    };
    left().unwrap_or(u64::MAX)
}

/// `MemAvailable` of `/proc/meminfo`, in bytes.
fn mem_available(meminfo: &str) -> Option<u64> {
    kib(meminfo, "MemAvailable:")
}

/// The number of kibibytes on the line that begins with `name`, in bytes.
fn kib(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find(|l| l.starts_with(name))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_picture_is_refused_with_numbers_and_a_small_one_is_not() {
        check(512 * 384).unwrap();
        if available().is_some() {
            let message = check(1 << 40).unwrap_err().to_string();
            assert!(message.contains("255087.1 GB"), "{message}");
        }
    }

    #[test]
    fn meminfo_is_read() {
        let text = "MemTotal:  16 kB\nMemFree: 1 kB\nMemAvailable:   12 kB\n";
        assert_eq!(mem_available(text), Some(12 * 1024));
        assert_eq!(mem_available("nothing"), None);
    }
}
