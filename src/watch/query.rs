//! What requests say.

use super::layers::View;
use crate::film::coverage::Rect;
use std::net::IpAddr;

/// Pixels of a view at most; a larger one is answered with fewer.
const MOST_PIXELS: u64 = 2 << 20;

/// A query of numbers.
#[derive(Clone, Copy)]
pub struct Query<'a>(pub &'a str);

impl Query<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        let pairs = self.0.split('&').filter_map(|pair| pair.split_once('='));
        pairs.filter(|(k, _)| *k == key).map(|(_, v)| v).next()
    }

    /// A whole number.
    pub fn whole(&self, key: &str) -> Option<u32> {
        self.get(key)?.parse().ok()
    }

    /// An exposure in powers of two, from -100 to 100; 0 if nothing is said, and `None` if it is something else.
    pub fn exposure(&self) -> Option<f64> {
        let Some(text) = self.get("exposure") else {
            return Some(0.0);
        };
        let stops: f64 = text.parse().ok()?;
        (stops.abs() <= 100.0).then_some(stops)
    }

    /// The whole picture if nothing is said; `k` as large as it takes. `None` if it is not within the picture.
    pub fn view(&self, size: [u32; 2]) -> Option<View> {
        let side = |key, default| match self.get(key) {
            Some(_) => self.whole(key),
            None => Some(default),
        };
        let rect = Rect {
            x0: side("x0", 0)?,
            y0: side("y0", 0)?,
            x1: side("x1", size[0])?,
            y1: side("y1", size[1])?,
        };
        let within =
            rect.x0 < rect.x1 && rect.x1 <= size[0] && rect.y0 < rect.y1 && rect.y1 <= size[1];
        let k = side("k", 1)?.max(1);
        let area = |k: u32| {
            View { rect, k }
                .size()
                .map(u64::from)
                .iter()
                .product::<u64>()
        };
        let k = (k..=k.max(1 << 16)).find(|k| area(*k) <= MOST_PIXELS);
        within.then_some(View { rect, k: k? })
    }
}

/// Whether a request may call this server so. A page of someone else, whose name was made to lead here, would be read by its own
/// script; so names must be known. A number is no name, and leads where it says.
pub fn is_known_host(host: &str, names: &[String]) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split_once(']').map(|(inside, _)| inside),
        None => host.split(':').next(),
    };
    let Some(name) = name else {
        return false;
    };
    let same =
        |known: &String| known.eq_ignore_ascii_case(name) || known.eq_ignore_ascii_case(host);
    name.parse::<IpAddr>().is_ok()
        || name.eq_ignore_ascii_case("localhost")
        || names.iter().any(same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_names_are_answered() {
        let names = ["render.example.org".to_owned()];
        for known in [
            "localhost",
            "localhost:8080",
            "LocalHost:1",
            "127.0.0.1:8080",
            "10.1.2.3",
            "[::1]:8080",
            "[::1]",
            "render.example.org",
            "Render.Example.org:443",
        ] {
            assert!(is_known_host(known, &names), "{known}");
        }
        for unknown in [
            "evil.example",
            "localhost.evil.example:8080",
            "127.0.0.1.evil.example",
            "",
            ":8080",
            "[evil]:80",
            "[::1",
            "example.org",
            "127.0.0.256",
        ] {
            assert!(!is_known_host(unknown, &names), "{unknown}");
        }
    }

    #[test]
    fn views_lie_within_the_picture_and_are_not_too_large() {
        let view = |query: &str, size| Query(query).view(size);
        let whole = view("", [512, 384]).unwrap();
        assert_eq!((whole.rect, whole.k), (Rect::whole([512, 384]), 1));
        let part = view("x0=1&y0=2&x1=3&y1=4&k=0", [512, 384]).unwrap();
        assert_eq!((part.size(), part.k), ([2, 2], 1));
        let large = view("k=2", [65536, 65536]).unwrap();
        assert!(large.k >= 46 && large.size()[0] < 1450, "{large:?}");
        for bad in [
            "x0=-1",
            "x1=513",
            "x0=5&x1=5",
            "y0=one",
            "k=x",
            "x1=99999999999",
        ] {
            assert_eq!(view(bad, [512, 384]), None, "{bad}");
        }
    }
}
