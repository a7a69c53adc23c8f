//! The pages, scripts and styles, as they are committed.

use std::borrow::Cow;
use std::io::Write;
use std::sync::LazyLock;

use axum::extract::Path;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;

/// A file that is served.
struct Asset {
    name: &'static str,
    kind: &'static str,
    bytes: &'static [u8],
}

macro_rules! assets {
    ($($name:literal: $kind:expr),* $(,)?) => {
        &[$(Asset { name: $name, kind: $kind, bytes: include_bytes!(concat!("../assets/", $name)) }),*]
    };
}

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

const ASSETS: &[Asset] = assets! {
    "index.html": HTML,
    "run.html": HTML,
    "evolution.html": HTML,
    "work.html": HTML,
    "draw.html": HTML,
    "tune.html": HTML,
    "compare.html": HTML,
    "wall.html": HTML,
    "begin.html": HTML,
    "devices.html": HTML,
    "login.html": HTML,
    "style.css": "text/css; charset=utf-8",
    "icon.svg": "image/svg+xml",
    "icon-180.png": "image/png",
    "icon-512.png": "image/png",
    "manifest.json": "application/manifest+json",
    "early.js": SCRIPT,
    "dom.js": SCRIPT,
    "time.js": SCRIPT,
    "hub.js": SCRIPT,
    "ask.js": SCRIPT,
    "studio.js": SCRIPT,
    "figure.js": SCRIPT,
    "obstacle.js": SCRIPT,
    "photo.js": SCRIPT,
    "index.js": SCRIPT,
    "run.js": SCRIPT,
    "record.js": SCRIPT,
    "photograph.js": SCRIPT,
    "path.js": SCRIPT,
    "targets.js": SCRIPT,
    "curves.js": SCRIPT,
    "facts.js": SCRIPT,
    "health.js": SCRIPT,
    "control.js": SCRIPT,
    "evolution.js": SCRIPT,
    "work.js": SCRIPT,
    "draw.js": SCRIPT,
    "drawing.js": SCRIPT,
    "plane.js": SCRIPT,
    "editor.js": SCRIPT,
    "trial.js": SCRIPT,
    "tune.js": SCRIPT,
    "compare.js": SCRIPT,
    "wall.js": SCRIPT,
    "walls.js": SCRIPT,
    "begin.js": SCRIPT,
    "devices.js": SCRIPT,
    "calibrate.js": SCRIPT,
    "keep.js": SCRIPT,
    "login.js": SCRIPT,
};

macro_rules! styles {
    ($($name:literal),* $(,)?) => { &[$(($name, include_bytes!(concat!("../assets/", $name)))),*] };
}

/// What `style.css` is made of.
const STYLES: &[(&str, &[u8])] = styles! {
    "style/base.css",
    "style/frame.css",
    "style/controls.css",
    "style/lists.css",
    "style/figure.css",
    "style/photo.css",
    "style/run.css",
    "style/overview.css",
    "style/draw.css",
    "style/tune.css",
    "style/wall.css",
    "style/media.css",
};

/// A style sheet with each file that it imports in place of the line: one request for all of them.
fn with_imports<'a>(sheet: &'a [u8], file: impl Fn(&str) -> Option<Cow<'a, [u8]>>) -> Vec<u8> {
    let imported = |line: &'a [u8]| {
        let name =
            std::str::from_utf8(line).ok()?.strip_prefix("@import \"")?.trim_end().strip_suffix("\";")?;
        file(name)
    };
    let lines = sheet.split_inclusive(|byte| *byte == b'\n');
    lines.map(|line| imported(line).unwrap_or(Cow::Borrowed(line))).collect::<Vec<_>>().concat()
}

/// An asset as it is sent, compressed, and what identifies it.
struct Ready {
    asset: &'static Asset,
    bytes: Vec<u8>,
    gzip: Vec<u8>,
    tag: String,
}

static READY: LazyLock<Vec<Ready>> = LazyLock::new(|| {
    let style =
        |name: &str| STYLES.iter().find(|(own, _)| *own == name).map(|(_, bytes)| Cow::Borrowed(*bytes));
    ASSETS.iter().map(|asset| Ready::of(asset, style)).collect()
});

impl Ready {
    /// `style` reads the files of the style sheet.
    fn of(asset: &'static Asset, style: impl Fn(&str) -> Option<Cow<'static, [u8]>>) -> Self {
        let bytes = with_imports(asset.bytes, style);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        // A vector takes every byte.
        let _ = encoder.write_all(&bytes);
        let gzip = encoder.finish().unwrap_or_default();
        let tag = format!("\"{}\"", &tropism_lab::files::sha256(&bytes)[..16]);
        Self { asset, bytes, gzip, tag }
    }

    fn response(&'static self, headers: &HeaderMap) -> Response {
        let asks = |name: header::HeaderName, word: &str| {
            headers.get(name).and_then(|value| value.to_str().ok()).is_some_and(|value| value.contains(word))
        };
        let own = [
            (header::ETAG, self.tag.as_str()),
            (header::CACHE_CONTROL, "no-cache"),
            (header::VARY, "accept-encoding"),
        ];
        if asks(header::IF_NONE_MATCH, &self.tag) {
            return (StatusCode::NOT_MODIFIED, own).into_response();
        }
        let kind = [(header::CONTENT_TYPE, self.asset.kind)];
        if asks(header::ACCEPT_ENCODING, "gzip") {
            return (own, kind, [(header::CONTENT_ENCODING, "gzip")], self.gzip.clone()).into_response();
        }
        (own, kind, self.bytes.as_slice()).into_response()
    }
}

/// Compresses all of them, before a page asks for one.
pub(crate) fn prepare() {
    LazyLock::force(&READY);
}

fn find(name: &str) -> Option<&'static Ready> {
    let ready = READY.iter().find(|ready| ready.asset.name == name)?;
    #[cfg(debug_assertions)]
    if let Some(folder) = std::env::var_os(ASSETS_FOLDER) {
        return read_anew(ready.asset, std::path::Path::new(&folder)).or(Some(ready));
    }
    Some(ready)
}

/// While one works on the pages: where a debug build reads them, instead of those that it holds.
#[cfg(debug_assertions)]
const ASSETS_FOLDER: &str = "TROPISM_STUDIO_ASSETS";

/// The asset as it is in `folder` now. It leaks, as little as one who works on a page asks for.
#[cfg(debug_assertions)]
fn read_anew(asset: &Asset, folder: &std::path::Path) -> Option<&'static Ready> {
    let bytes = Box::leak(std::fs::read(folder.join(asset.name)).ok()?.into_boxed_slice());
    let asset = Box::leak(Box::new(Asset { bytes, ..*asset }));
    let style = |name: &str| std::fs::read(folder.join(name)).ok().map(Cow::Owned);
    Some(Box::leak(Box::new(Ready::of(asset, style))))
}

/// `GET assets/NAME`.
pub(crate) async fn asset(Path(name): Path<String>, headers: HeaderMap) -> Response {
    let found = find(&name).filter(|ready| ready.asset.kind != HTML);
    found.map_or_else(|| StatusCode::NOT_FOUND.into_response(), |ready| ready.response(&headers))
}

/// The page `NAME.html`.
pub(crate) fn page(name: &str, headers: &HeaderMap) -> Response {
    find(name).map_or_else(|| StatusCode::NOT_FOUND.into_response(), |ready| ready.response(headers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_pages_together_are_small() {
        let size: usize = READY.iter().map(|ready| ready.gzip.len()).sum();
        assert!(size < 200_000, "{size} bytes compressed");
        assert!(READY.iter().all(|ready| !ready.gzip.is_empty()));
    }

    fn text(asset: &Asset) -> &'static str {
        std::str::from_utf8(asset.bytes).unwrap_or_default()
    }

    #[test]
    fn the_log_in_leads_back_to_every_page() {
        let script = find("login.js").map(|ready| text(ready.asset)).unwrap_or_default();
        let (_, pages) = script.split_once("/^(").unwrap();
        let pages: Vec<&str> = pages.split_once(')').unwrap().0.split('|').collect();
        for Ready { asset, .. } in READY.iter().filter(|ready| ready.asset.kind == HTML) {
            let page = asset.name.trim_end_matches(".html");
            assert!(matches!(page, "index" | "login") || pages.contains(&page), "{page}");
        }
    }

    #[test]
    fn the_style_sheet_is_one_file() {
        let style = find("style.css").map(|ready| String::from_utf8_lossy(&ready.bytes)).unwrap_or_default();
        assert!(style.contains("color-scheme") && !style.contains("@import"));
    }

    #[test]
    fn pages_hold_no_scripts_and_no_styles_of_their_own() {
        for Ready { asset, .. } in READY.iter().filter(|ready| ready.asset.kind == HTML) {
            for tag in text(asset).split('<').filter(|tag| tag.starts_with("script")) {
                let is_loaded = tag.contains(" src=\"assets/") && tag.trim_end().ends_with('>');
                assert!(is_loaded || tag.starts_with("/script"), "{}: <{tag}", asset.name);
            }
            for refused in [" style=\"", "<style", " onclick=", "javascript:", "http://", "https://"] {
                assert!(!text(asset).contains(refused), "{}: {refused}", asset.name);
            }
        }
    }

    #[test]
    fn scripts_load_only_what_is_there() {
        for Ready { asset, .. } in READY.iter() {
            let named = text(asset)
                .split(['"', '\''])
                .filter_map(|word| word.strip_prefix("assets/").or_else(|| word.strip_prefix("./")));
            // Types are for those who write scripts: no browser loads them.
            let is_loaded =
                |name: &&str| name.contains('.') && !name.contains(' ') && !name.ends_with(".d.ts");
            for name in named.filter(is_loaded) {
                assert!(find(name).is_some(), "{} loads {name}", asset.name);
            }
        }
    }
}
