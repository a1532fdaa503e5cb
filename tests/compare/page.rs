//! The page of `--html` in a real browser.

use super::*;

/// What Chromium makes of a page: its elements after the scripts have run, and a screenshot.
struct Browser(String);

impl Browser {
    /// Without a browser this fails, unless ETENDUE_SKIP_BROWSER=1 asks for the check to be left out.
    fn find() -> Option<Self> {
        if std::env::var_os("ETENDUE_SKIP_BROWSER").is_some_and(|v| v == "1") {
            eprintln!("ETENDUE_SKIP_BROWSER=1: not looked at in a browser");
            return None;
        }
        Some(Self(
            std::env::var("ETENDUE_BROWSER").unwrap_or("chromium".into()),
        ))
    }

    fn run(&self, flags: &[&str], url: &str) -> Vec<u8> {
        let profile = tempfile::tempdir().expect("a temporary folder");
        let output = std::process::Command::new(&self.0)
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .args(flags)
            .arg(url)
            .output();
        let output = output.unwrap_or_else(|e| {
            panic!(
                "{}: {e}; set ETENDUE_BROWSER, or ETENDUE_SKIP_BROWSER=1",
                self.0
            )
        });
        assert!(output.status.success(), "{output:?}");
        output.stdout
    }

    fn elements(&self, url: &str) -> String {
        String::from_utf8(self.run(&["--dump-dom"], url)).expect("text")
    }

    fn screenshot(&self, url: &str, flags: &[&str]) -> image::RgbImage {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("shot.png");
        let shot = format!("--screenshot={}", path.display());
        self.run(&[&[shot.as_str()], flags].concat(), url);
        image::open(&path).expect("a screenshot").to_rgb8()
    }
}

/// The part of the page's text from `from` to the next `to`.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let start = text.find(from).unwrap_or_else(|| panic!("no {from}")) + from.len();
    let end = text[start..].find(to).unwrap_or_else(|| panic!("no {to}"));
    &text[start..start + end]
}

#[test]
fn the_page_is_self_contained_and_works_in_a_browser() {
    let p = Pictures::new();
    let a = p.put("a.exr", &whole(1, |_, _| 0.4));
    let b = p.put("b<i>.exr", &whole(3, |x, y| 0.4 * patch(x, y)));
    let page = p.path("report.html");
    let name = page.to_str().expect("UTF-8");
    run(&a, &b, &["--html", name]).code(1);
    let text = std::fs::read_to_string(&page).expect("written");
    for outside in ["http:", "https:", "<link", "@import", "url("] {
        assert!(!text.contains(outside), "{outside} in the page");
    }
    assert!(!text.contains("b<i>") && !text.contains("{{"));
    for told in [
        "pixels at (16, 8)",
        "scene_hash",
        "llvmpipe",
        "mean FLIP",
        "<rect x=\"16\" y=\"8\"",
    ] {
        assert!(text.contains(told), "no {told} in the page");
    }

    let Some(browser) = Browser::find() else {
        return;
    };
    let url = format!("file://{name}");
    // The script shows what the fragment names, under its own legend.
    for (view, shown) in [
        ("slide", "Picture A"),
        ("b", "Picture B"),
        ("difference", "Difference B - A"),
        ("score", "Difference over its noise"),
        ("flip", "FLIP map"),
    ] {
        let elements = browser.elements(&format!("{url}#{view}"));
        let under = between(&elements, "<img id=\"under\"", ">");
        assert!(
            under.contains(&format!("alt=\"{shown}\"")),
            "{view} shows {under}"
        );
        let legend = between(&elements, &format!("<div data-for=\"{view}\""), ">");
        assert!(!legend.contains("hidden"), "the legend of {view} is hidden");
    }
    // Light paper, dark paper; and on a phone nothing hangs over the right edge: its last column is paper.
    let phone = "--window-size=500,900";
    let dark = "--blink-settings=preferredColorScheme=0";
    let light = browser.screenshot(&url, &[phone]);
    let night = browser.screenshot(&url, &[phone, dark]);
    let brightness = |i: &image::RgbImage| i.get_pixel(2, 2).0.map(u32::from).iter().sum::<u32>();
    assert!(brightness(&light) > 700, "{}", brightness(&light));
    assert!(brightness(&night) < 120, "{}", brightness(&night));
    for shot in [&light, &night] {
        let paper = shot.get_pixel(2, 2);
        let last = shot.width() - 1;
        assert!((0..shot.height()).all(|y| shot.get_pixel(last, y) == paper));
        let colours: std::collections::BTreeSet<_> = shot.pixels().map(|p| p.0).collect();
        assert!(colours.len() > 200, "a blank page");
    }
}
