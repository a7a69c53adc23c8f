//! Addresses without what they keep secret: users, passwords and tokens are shown as `***`.
//!
//! A camera's address may be `http://user:password@camera/shot?token=abc`. Errors, events, alerts and exports show
//! `http://***@camera/shot?token=***`.

use std::borrow::Cow;
use std::path::Path;

use tropism::rig::RigError;
use tropism::text::plain;

use crate::failed;

/// What stands for a secret.
const HIDDEN: &str = "***";

/// Where an address ends in a text: at a blank, or at what an address cannot hold. An apostrophe may be part of a password.
const fn ends_url(letter: char) -> bool {
    letter.is_whitespace() || matches!(letter, '"' | '`' | '<' | '>')
}

/// The first line of a file that holds a secret.
pub(crate) fn read_secret(path: &Path) -> Result<String, RigError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| failed(path.display().to_string(), format!("cannot be read: {error}")))?;
    Ok(text.lines().next().unwrap_or_default().trim().to_owned())
}

/// The parts of an address.
pub(crate) struct Parts<'a> {
    /// With its `://`; empty if there is none.
    pub(crate) scheme: &'a str,
    user: Option<&'a str>,
    /// With its port.
    pub(crate) host: &'a str,
    /// From its `/` on.
    pub(crate) path: &'a str,
    /// Without its `?`.
    query: Option<&'a str>,
    /// Without its `#`.
    fragment: Option<&'a str>,
}

impl<'a> Parts<'a> {
    pub(crate) fn of(url: &'a str) -> Self {
        let (scheme, rest) = url.split_at(url.find("://").map_or(0, |at| at + 3));
        // A password may hold any letter if its user forgot to encode it: all up to the last @ may be the password, where
        // the host has an @ before it, or its port is no number.
        let end = rest.find(['/', '?', '#']).unwrap_or(rest.len());
        let is_number = |port: &str| !port.is_empty() && port.chars().all(|digit| digit.is_ascii_digit());
        let is_port =
            rest[..end].rsplit_once(':').is_none_or(|(_, port)| is_number(port) || port.ends_with(']'));
        let at = rest.rfind('@').filter(|_| rest[..end].contains('@') || !is_port);
        let (user, rest) = match at {
            Some(at) => (Some(&rest[..at]), &rest[at + 1..]),
            None if is_port => (None, rest),
            // The address was cut off within the password.
            None => (Some(&rest[..end]), &rest[end..]),
        };
        let (rest, fragment) = cut(rest, '#');
        let (rest, query) = cut(rest, '?');
        let (host, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
        Self { scheme, user, host, path, query, fragment }
    }

    fn has_secret(&self) -> bool {
        self.user.is_some_and(|user| user != HIDDEN) || self.query.is_some_and(|query| hidden(query) != query)
    }
}

/// `text` up to the first `mark`, and what follows it.
fn cut(text: &str, mark: char) -> (&str, Option<&str>) {
    text.split_once(mark).map_or((text, None), |(before, after)| (before, Some(after)))
}

/// A query with `***` in place of each value, and of each word without a value.
fn hidden(query: &str) -> String {
    let of_part = |part: &str| match part.split_once('=') {
        Some((key, _)) => format!("{key}={HIDDEN}"),
        None if part.is_empty() => String::new(),
        None => HIDDEN.to_owned(),
    };
    query.split('&').map(of_part).collect::<Vec<_>>().join("&")
}

/// An address with `***` in place of its user and password, of the values of its query and of its fragment.
#[must_use]
pub fn redacted(url: &str) -> String {
    let Parts { scheme, user, host, path, query, fragment } = Parts::of(url);
    let user = user.map_or_else(String::new, |_| format!("{HIDDEN}@"));
    let query = query.map_or_else(String::new, |query| format!("?{}", hidden(query)));
    let fragment = fragment.map_or_else(String::new, |_| format!("#{HIDDEN}"));
    format!("{scheme}{user}{host}{path}{query}{fragment}")
}

/// The scheme and host of an address. The path of an alert's address is its secret: who knows the topic reads along.
#[must_use]
pub fn host_alone(url: &str) -> String {
    let Parts { scheme, host, path, query, .. } = Parts::of(url);
    let more = if path.len() > 1 || query.is_some() { "/***" } else { "" };
    format!("{scheme}{host}{more}")
}

/// Where the addresses in a text stand: all words with `://` in them.
fn urls(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for (at, _) in text.match_indices("://") {
        if found.last().is_some_and(|last| at < last.end) {
            continue;
        }
        let is_scheme = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '+' | '-' | '.');
        let scheme = text[..at].rfind(|letter| !is_scheme(letter));
        let start = scheme.map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
        let end = text[at..].find(ends_url).map_or(text.len(), |length| at + length);
        // Brackets and marks of the sentence belong to the text.
        let end = at + text[at..end].trim_end_matches([')', ',', ';', ':', '.', ']', '}', '\'']).len();
        found.push(start..end);
    }
    found
}

/// `text` with each address in it as `shown` shows it.
fn with_urls<'t>(text: &'t str, shown: impl Fn(&str) -> String) -> Cow<'t, str> {
    if !text.contains("://") {
        return Cow::Borrowed(text);
    }
    let (mut result, mut done) = (String::with_capacity(text.len()), 0);
    for place in urls(text) {
        result += &text[done..place.start];
        result += &shown(&text[place.clone()]);
        done = place.end;
    }
    result += &text[done..];
    Cow::Owned(result)
}

/// `text` with each address in it [`redacted()`].
#[must_use]
pub fn redacted_text(text: &str) -> Cow<'_, str> {
    with_urls(text, redacted)
}

/// A text in which devices, programs and names of files have a say, as it is shown and stored: in one line, without the
/// secrets of addresses and the [controls](plain) of terminals.
#[must_use]
pub fn shown(text: &str) -> String {
    plain(&redacted_text(text)).into_owned()
}

/// `text` with the [`host_alone()`] of each address in it.
#[must_use]
pub fn hosts_alone(text: &str) -> Cow<'_, str> {
    with_urls(text, host_alone)
}

/// Whether an address in `text` holds a user, a password or a query.
#[must_use]
pub fn holds_secret(text: &str) -> bool {
    urls(text).into_iter().any(|place| Parts::of(&text[place]).has_secret())
}

/// Names of keys in queries that hold secrets in the interfaces of cameras: chosen from ESPHome, Home Assistant, Hikvision,
/// Reolink, Foscam and Axis.
const SECRET_KEYS: [&str; 12] =
    ["token", "key", "pass", "pwd", "secret", "auth", "sig", "user", "usr", "login", "account", "credential"];

/// Whether an address in `text` holds a user, a password, or a query with a key that is named like a secret. Less than
/// [`holds_secret()`]: `?action=snapshot` is a query, but no secret.
#[must_use]
pub fn shows_secret(text: &str) -> bool {
    urls(text).into_iter().any(|place| {
        let Parts { user, query, .. } = Parts::of(&text[place]);
        let is_secret = |part: &str| {
            let (key, value) = part.split_once('=').unwrap_or((part, part));
            let key = key.to_ascii_lowercase();
            value != HIDDEN && SECRET_KEYS.iter().any(|secret| key.contains(secret))
        };
        user.is_some_and(|user| user != HIDDEN) || query.is_some_and(|query| query.split('&').any(is_secret))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn users_and_queries_are_hidden() {
        for (url, shown) in [
            ("http://camera.local/shot", "http://camera.local/shot"),
            ("http://admin:s3cret@camera:8080/shot", "http://***@camera:8080/shot"),
            ("https://camera/shot?token=abc&size=2", "https://camera/shot?token=***&size=***"),
            ("https://camera?abc#def", "https://camera?***#***"),
            ("mqtt://user:pass@broker:1883", "mqtt://***@broker:1883"),
            // Not encoded as they should be.
            ("http://admin:p/a@ss@camera/shot", "http://***@camera/shot"),
            ("http://admin:p@ss@camera/shot", "http://***@camera/shot"),
            ("http://admin:a?b#c@camera/shot", "http://***@camera/shot"),
            ("admin:pass@camera/shot", "***@camera/shot"),
            ("http://admin:pas", "http://***@"),
            ("http://camera:80/a@2x.jpg", "http://camera:80/a@2x.jpg"),
            ("http://[::1]:80/a", "http://[::1]:80/a"),
        ] {
            assert_eq!(redacted(url), shown);
            assert_eq!(redacted(shown), shown);
        }
        assert_eq!(host_alone("https://u:p@ntfy.sh/my-topic?auth=x"), "https://ntfy.sh/***");
        assert_eq!(host_alone("https://ntfy.sh/"), "https://ntfy.sh");
    }

    #[test]
    fn addresses_in_a_text_are_found() {
        let text = "camera (http://u:p@c/x?k=v): found \"rtsp://a:b@d/1\", see https://e/f.";
        let shown = "camera (http://***@c/x?k=***): found \"rtsp://***@d/1\", see https://e/f.";
        assert_eq!(redacted_text(text), shown);
        assert!(holds_secret(text) && !holds_secret(shown));
        assert_eq!(
            hosts_alone("cannot reach https://ntfy.sh/topic: refused"),
            "cannot reach https://ntfy.sh/***: refused"
        );
        assert!(holds_secret("url = \"http://c/?action=snapshot\""));
        assert!(!shows_secret("url = \"http://c/?action=snapshot\""));
        assert!(
            shows_secret("http://c/?api_key=1")
                && shows_secret("http://u:p@c/")
                && shows_secret("http://c/?token")
        );
        assert!(holds_secret("url = \"http://u:p\\\"w@c/\""));
        assert!(!shows_secret(shown) && !holds_secret("no address: //"));
    }

    /// Any text in which the parts of addresses are frequent.
    fn any_text() -> impl Strategy<Value = String> {
        let part = prop::sample::select(&["://", "@", "?", "#", "="][..]).prop_map(str::to_owned);
        let piece = prop_oneof![4 => any::<char>().prop_map(String::from), 1 => part];
        prop::collection::vec(piece, 0..60).prop_map(|pieces| pieces.concat())
    }

    /// So many of these letters.
    fn of_letters(letters: &str, count: core::ops::RangeInclusive<usize>) -> impl Strategy<Value = String> {
        let letters: Vec<char> = letters.chars().collect();
        prop::collection::vec(prop::sample::select(letters), count).prop_map(String::from_iter)
    }

    proptest! {
        #[test]
        fn any_text_is_redacted_once(text in any_text()) {
            let shown = redacted_text(&text).into_owned();
            prop_assert_eq!(redacted_text(&shown), shown.as_str());
        }

        #[test]
        fn no_password_is_left(
            user in of_letters("abcxyz", 1..=5),
            password in of_letters("ABCXYZ0189/?#:@%&=", 6..=12),
        ) {
            // What reads like a port, a path and an @ in it is taken for that.
            let start = password.split(['/', '?', '#']).next().unwrap_or_default();
            let port = start.rsplit(':').next().unwrap_or_default();
            prop_assume!(port.is_empty() || !port.chars().all(|letter| letter.is_ascii_digit()));
            let shown = redacted_text(&format!("at http://{user}:{password}@camera/x")).into_owned();
            prop_assert!(!shown.contains(&password), "{}", shown);
        }
    }
}
