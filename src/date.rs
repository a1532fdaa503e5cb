//! Times in UTC, in words.

use std::time::{SystemTime, UNIX_EPOCH};

/// A time to the minute: "2026-02-28 23:59 UTC".
pub fn utc(time: SystemTime) -> String {
    let ([year, month, day], [hour, minute, _]) = date(time);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02} UTC")
}

/// A time to the second, as ISO 8601 has it: "2026-02-28T23:59:59Z".
pub fn iso(time: SystemTime) -> String {
    let ([year, month, day], [hour, minute, second]) = date(time);
    format!("{year}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day, and hour, minute and second, in UTC.
fn date(time: SystemTime) -> ([u64; 3], [u64; 3]) {
    let seconds = time
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
        .as_secs();
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // The Gregorian calendar repeats every 400 years of 146097 days. Its years here start in March, so that a leap day is a year's
    // last, and the first day is 1 March of the year 0.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // March to July have 153 days, and so have the next five months.
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 {
        (year, month + 3)
    } else {
        (year + 1, month - 9)
    };
    let year = 400 * era + year;
    ([year, month, day], [rest / 3600, rest / 60 % 60, rest % 60])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Dates from `date -u -d @SECONDS`.
    #[test]
    fn times_are_in_the_gregorian_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (951_868_800, "2000-03-01 00:00 UTC"),
            (1_735_689_599, "2024-12-31 23:59 UTC"),
            (1_772_323_199, "2026-02-28 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(utc(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
        let time = UNIX_EPOCH + Duration::from_secs(951_782_399);
        assert_eq!(iso(time), "2000-02-28T23:59:59Z");
    }
}
