//! Checks that a picture fits into memory before anything is allocated.

use super::Error;
use crate::engine::MAX_TILE_PIXELS;
use crate::run::waiting_bytes;
use std::fs;

/// Bytes per pixel of the film: four replicates, each of four f64 sums and four f32 sums of the unfinished block.
const FILM_BYTES: u64 = 128 + 64;

/// The same for light paths: four replicates, each of four sums of splats and a count of passes.
const SPLAT_BYTES: u64 = 144;

/// Bytes per pixel while pictures are written: nine f32 channels and a count.
const OUTPUT_BYTES: u64 = 40;

/// Additional bytes per pixel of the current tile, whose textures a software adapter keeps in the same memory: two textures,
/// the buffer that is read back, counters, and their copies.
const TILE_BYTES: u64 = 384;

/// Bytes per pixel of the values that a page or tev gets: mean, errors and samples, as f32.
const SHOWN_BYTES: u64 = 32;

/// Copies of the film at the same time while someone looks at it: the last one, and the next.
const COPIES: u64 = 2;

/// What a render needs memory for.
#[derive(Debug, Clone, Copy)]
pub struct Need {
    /// Pixels of its film.
    pub pixels: u64,
    /// Whether the film has room for light paths.
    pub light_paths: bool,
    /// Whether the film is still to be made, and not in memory already.
    pub film: bool,
    /// Whether it may be looked at while it grows: on a page, or in tev.
    pub shown: bool,
}

impl Need {
    /// Of a new film.
    fn film(pixels: u64, light_paths: bool) -> Self {
        Self {
            pixels,
            light_paths,
            film: true,
            shown: false,
        }
    }

    /// Bytes.
    fn bytes(self) -> u64 {
        let splats = if self.light_paths { SPLAT_BYTES } else { 0 };
        let waiting = if self.light_paths {
            waiting_bytes(self.pixels)
        } else {
            0
        };
        let film = FILM_BYTES + splats;
        let mut of_pixel = OUTPUT_BYTES;
        if self.film {
            of_pixel += film;
        }
        if self.shown {
            of_pixel += COPIES * (film + SHOWN_BYTES);
        }
        let tile = self.pixels.min(MAX_TILE_PIXELS) * TILE_BYTES;
        let film = self.pixels.saturating_mul(of_pixel);
        film.saturating_add(tile).saturating_add(waiting)
    }
}

/// Refuses a film of `pixels` pixels that does not fit into memory, with room for light paths or without.
pub fn check(pixels: u64, light_paths: bool) -> Result<(), Error> {
    check_need(Need::film(pixels, light_paths))
}

/// Refuses what does not fit into memory.
pub fn check_need(need: Need) -> Result<(), Error> {
    let Some(have) = available() else {
        return Ok(());
    };
    if need.bytes() <= have {
        return Ok(());
    }
    let what = if need.film {
        "a film"
    } else {
        "to show a film"
    };
    let shown = match need.shown {
        true if need.film => ", of which two thirds are for those who look at it while it grows",
        _ => "",
    };
    Err(Error::Input(format!(
        "{what} of {:.1} million pixels needs {:.1} GB of memory{shown}, but only {:.1} GB are free; use a smaller size, or render \
         one region at a time",
        need.pixels as f64 / 1e6,
        need.bytes() as f64 / 1e9,
        have as f64 / 1e9,
    )))
}

/// Bytes that this process can still allocate. Known on Linux only.
fn available() -> Option<u64> {
    let system = mem_available(&fs::read_to_string("/proc/meminfo").ok()?)?;
    let number = |path| fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    // In a container the control group's limit can be below the machine's memory.
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map_or(u64::MAX, |(most, now)| most.saturating_sub(now));
    Some(system.min(group).min(address_space()))
}

/// Bytes that `ulimit -v` still allows this process.
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
    fn pictures_too_large_for_memory_are_refused() {
        let small = Need::film(512 * 384, true);
        check_need(Need {
            shown: true,
            ..small
        })
        .unwrap();
        if available().is_some() {
            let message = check(1 << 40, false).unwrap_err().to_string();
            assert!(message.contains("255087.1 GB"), "{message}");
            let message = check(1 << 40, true).unwrap_err().to_string();
            assert!(message.contains("413418.9 GB"), "{message}");
        }
    }

    #[test]
    fn copies_for_those_who_look_count() {
        let film = Need::film(1 << 20, false);
        let shown = Need {
            shown: true,
            ..film
        };
        let held = Need {
            film: false,
            ..shown
        };
        let pixel = |need: Need| need.bytes() >> 20;
        assert_eq!(pixel(film), 128 + 64 + 40 + 384);
        assert_eq!(pixel(shown) - pixel(film), 2 * (128 + 64 + 32));
        assert_eq!(pixel(shown) - pixel(held), 128 + 64);
    }

    #[test]
    fn meminfo_is_read() {
        let text = "MemTotal:  16 kB\nMemFree: 1 kB\nMemAvailable:   12 kB\n";
        assert_eq!(mem_available(text), Some(12 * 1024));
        assert_eq!(mem_available("nothing"), None);
    }
}
