//! Parsers of flag values. Their errors state only the rule, since clap names the flag and the value. These flags accept
//! values that begin with a hyphen, so that -1 gets the rule and is not mistaken for another flag.

use crate::film::coverage::Rect;
use crate::render::MAX_SAMPLES;
use crate::settings::LightParts;
use crate::watch::Address;
use std::ops::Range;
use std::time::Duration;

/// A duration: `90s`, `2m`, `1h30m`, `0.5s`, or plain seconds; more than 0, at most a year.
pub fn duration(text: &str) -> Result<Duration, String> {
    const RULE: &str = "expected a duration such as 90s, 2m, 1h30m, 7d or plain seconds";
    const YEAR: f64 = 366.0 * 86400.0;
    let mut seconds = 0.0;
    let mut rest = text;
    let mut last_unit = f64::INFINITY;
    if rest.is_empty() {
        return Err(RULE.into());
    }
    while !rest.is_empty() {
        let end = rest
            .find(|c: char| !c.is_ascii_digit() && c != '.')
            .unwrap_or(rest.len());
        let number: f64 = rest[..end].parse().map_err(|_| RULE)?;
        rest = &rest[end..];
        let unit_end = rest
            .find(|c: char| c.is_ascii_digit() || c == '.')
            .unwrap_or(rest.len());
        let unit = match &rest[..unit_end] {
            "d" => 86400.0,
            "h" => 3600.0,
            "m" | "min" => 60.0,
            "s" => 1.0,
            "ms" => 1e-3,
            "" if end == text.len() => 1.0,
            _ => return Err(RULE.into()),
        };
        // Larger units must come first: 5s2m is probably a typing error.
        if unit >= last_unit {
            return Err(RULE.into());
        }
        last_unit = unit;
        seconds += number * unit;
        rest = &rest[unit_end..];
    }
    if seconds > 0.0 && seconds <= YEAR {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err("expected a duration of more than 0 and at most a year".into())
    }
}

/// A relative error: `0.02` or `2%`; more than 0, at most 1.
pub fn relative_error(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    let value = number
        .trim()
        .parse::<f64>()
        .map_err(|_| "expected a relative error such as 0.02 or 2%")?
        * scale;
    if value > 0.0 && value <= 1.0 {
        Ok(value)
    } else {
        const RULE: &str = "expected a relative error of more than 0 and at most 1 (100%)";
        Err(RULE.to_owned() + &percent_hint(text))
    }
}

/// What to write, if a number above 1 was meant as percent.
fn percent_hint(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(x) if x > 1.0 && x <= 100.0 => format!("; for {text} percent write {text}%"),
        _ => String::new(),
    }
}

/// A relative change: `0.01` or `1%`; more than 0, at most 1.
pub fn change(text: &str) -> Result<f64, String> {
    const RULE: &str = "expected a change such as 0.01 or 1%, more than 0 and at most 1 (100%)";
    let change = limit(text).map_err(|_| RULE)?;
    if change > 0.0 && change <= 1.0 {
        Ok(change)
    } else {
        Err(RULE.to_owned() + &percent_hint(text))
    }
}

/// A share, 0 to 1: `0.02` or `2%`.
pub fn share(text: &str) -> Result<f64, String> {
    match limit(text) {
        Ok(x) if x <= 1.0 => Ok(x),
        _ => {
            const RULE: &str = "expected a number from 0 to 1, such as 0.02 or 2%";
            Err(RULE.to_owned() + &percent_hint(text))
        }
    }
}

/// A whole number from `low` to `high`.
pub fn whole<T: TryFrom<u64>>(
    low: u64,
    high: u64,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync {
    move |text| {
        let number = text.parse::<u64>().ok();
        number
            .filter(|n| (low..=high).contains(n))
            .and_then(|n| T::try_from(n).ok())
            .ok_or_else(|| format!("expected a whole number from {low} to {high}"))
    }
}

/// A seed, any u32.
pub fn seed() -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync {
    whole(0, u32::MAX.into())
}

/// Part of an adapter's name. Refuses an empty text, which every name contains.
pub fn part_of_name(text: &str) -> Result<String, String> {
    match text.trim() {
        "" => Err("expected part of an adapter's name, see: etendue adapters".into()),
        name => Ok(name.into()),
    }
}

/// A probability: more than 0, less than 1.
pub fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if p > 0.0 && p < 1.0 => Ok(p),
        _ => Err("expected a probability, more than 0 and less than 1".into()),
    }
}

/// A limit on a metric, 0 or more: `0.02` or `2%`.
pub fn limit(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix('%') {
        Some(number) => (number, 0.01),
        None => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(x * scale),
        _ => Err("expected a number such as 0.02 or 2%, 0 or more".into()),
    }
}

/// An address with its port: `127.0.0.1:8080`, `[::1]:8080`, `localhost:8080`.
pub fn address(text: &str) -> Result<Address, String> {
    text.parse()
}

/// A number of samples, 1..=[`MAX_SAMPLES`].
pub fn samples(text: &str) -> Result<u64, String> {
    match text.parse::<u64>() {
        Ok(n) if (1..=MAX_SAMPLES).contains(&n) => Ok(n),
        _ => Err(format!("expected a whole number from 1 to {MAX_SAMPLES}")),
    }
}

/// Sample numbers `A..B`, half-open, with A < B.
pub fn sample_range(text: &str) -> Result<Range<u64>, String> {
    let (a, b) = text
        .split_once("..")
        .ok_or("expected A..B for samples A to B-1, such as 0..256")?;
    let number = |s: &str| {
        s.parse::<u64>()
            .ok()
            .filter(|&n| n <= MAX_SAMPLES)
            .ok_or_else(|| format!("\"{s}\" is not a whole number from 0 to {MAX_SAMPLES}"))
    };
    let range = number(a)?..number(b)?;
    if range.start < range.end {
        Ok(range)
    } else {
        Err("in A..B, A must be less than B".into())
    }
}

/// A picture size `WxH`, each 1..=65536.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text
        .split_once(['x', 'X'])
        .ok_or("expected WIDTHxHEIGHT in pixels, such as 512x384")?;
    let side = |s: &str| match s.parse::<u32>() {
        Ok(n) if (1..=65536).contains(&n) => Ok(n),
        _ => Err(format!(
            "\"{s}\" is not a whole number of pixels from 1 to 65536"
        )),
    };
    Ok([side(w)?, side(h)?])
}

/// A half-open pixel rectangle `X0,Y0,X1,Y1` with X0 < X1 and Y0 < Y1.
pub fn rect(text: &str) -> Result<Rect, String> {
    let numbers: Vec<u32> = text
        .split(',')
        .map(|s| s.trim().parse::<u32>())
        .collect::<Result<_, _>>()
        .map_err(|_| "expected X0,Y0,X1,Y1 in pixels, such as 0,0,256,192")?;
    let [x0, y0, x1, y1] = numbers[..] else {
        return Err(format!(
            "expected four numbers X0,Y0,X1,Y1, found {}",
            numbers.len()
        ));
    };
    if x0 < x1 && y0 < y1 {
        Ok(Rect { x0, y0, x1, y1 })
    } else {
        Err("X0 must be less than X1, and Y0 less than Y1 (X1 and Y1 are exclusive)".into())
    }
}

/// A list of `emitted`, `direct`, `indirect`, separated by commas.
pub fn light(text: &str) -> Result<LightParts, String> {
    let mut parts = LightParts {
        emitted: false,
        direct: false,
        indirect: false,
    };
    for word in text.split(',') {
        let part = match word.trim() {
            "emitted" => &mut parts.emitted,
            "direct" => &mut parts.direct,
            "indirect" => &mut parts.indirect,
            other => {
                return Err(format!(
                    "\"{other}\" is none of emitted, direct, indirect (separate several by commas)"
                ));
            }
        };
        *part = true;
    }
    Ok(parts)
}

/// A finite number of stops, -100..=100. Beyond that every 8-bit picture is black or white.
pub fn exposure(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ev) if ev.abs() <= 100.0 => Ok(ev),
        _ => Err("expected a number of stops from -100 to 100".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations() {
        let seconds = |s: &str| duration(s).map(|d| d.as_secs_f64());
        for (text, value) in [
            ("90s", 90.0),
            ("2m", 120.0),
            ("1h30m", 5400.0),
            ("1h0m5s", 3605.0),
            ("0.5", 0.5),
            ("250ms", 0.25),
            ("90", 90.0),
        ] {
            assert_eq!(seconds(text), Ok(value), "{text}");
        }
        for bad in [
            "", "s", "-1", "0", "1x", "1h30", "5s2m", "1..2s", "1e99", "nan", "inf", "9999999h",
        ] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn relative_errors() {
        assert_eq!(relative_error("0.02"), Ok(0.02));
        assert_eq!(relative_error("2%"), Ok(0.02));
        for bad in ["", "%", "0", "-1%", "101%", "2", "nan", "inf%", "two"] {
            assert!(relative_error(bad).is_err(), "{bad}");
        }
        for of in [relative_error, change, share] {
            let told = of("5").unwrap_err();
            assert!(told.ends_with("; for 5 percent write 5%"), "{told}");
            assert!(!of("101").unwrap_err().contains("percent write"));
        }
    }

    #[test]
    fn counts_and_ranges() {
        assert_eq!(samples("4294967295"), Ok(MAX_SAMPLES));
        assert_eq!(sample_range("256..512"), Ok(256..512));
        for bad in ["5", "..", "5..5", "6..5", "a..3", "0..4294967296", "-1..3"] {
            assert!(sample_range(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-1", "1.5", "4294967296", ""] {
            assert!(samples(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_and_rectangles() {
        assert_eq!(size("512x384"), Ok([512, 384]));
        for bad in ["512", "0x3", "3x0", "65537x1", "x", "1x2x3", "-1x2"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(
            rect("1,2,3,4"),
            Ok(Rect {
                x0: 1,
                y0: 2,
                x1: 3,
                y1: 4
            })
        );
        for bad in [
            "1,2,3",
            "1,2,3,4,5",
            "3,2,3,4",
            "1,4,3,4",
            "a,b,c,d",
            "-1,0,3,4",
            "",
        ] {
            assert!(rect(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lights_and_exposures() {
        let parts = light("direct,emitted").unwrap();
        assert!(parts.direct && parts.emitted && !parts.indirect);
        assert!(light("").is_err() && light("direct,dirct").is_err());
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        assert!(exposure("nan").is_err() && exposure("inf").is_err());
    }
}
