//! The hash chain of a journal: each entry carries a digest of itself and of all entries before it.
//!
//! An entry that was changed, moved, or taken from another run does not fit its digest, and two histories are the same up
//! to an entry if its digests in both agree. The digest is for accidents, not for forgers: the first 64 bits of SHA-256.
//!
//! # References
//! S. Haber, W. S. Stornetta, "How to time-stamp a digital document", J. Cryptology 3 (1991), DOI 10.1007/BF00196791.

use std::collections::HashMap;

use rusqlite::types::Value;
use serde_json::Value as Json;

use crate::files::sha256;

/// Hexadecimal digits of a digest.
const DIGITS: usize = 16;

/// An entry: its name, and its values in the order of the statement that writes it.
pub(super) type Entry = (String, Vec<Value>);

/// The text of an entry and its digest.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Link {
    /// A JSON list: the name, then the values.
    pub(super) text: String,
    /// Digest of the text and of the digest before it; empty before the first one.
    pub(super) digest: String,
}

impl Link {
    /// The link of an entry after the one whose digest is `previous`.
    pub(super) fn after(previous: &str, name: &str, values: &[Value]) -> Self {
        let json = |value: &Value| match value {
            Value::Integer(whole) => Json::from(*whole),
            Value::Real(number) => Json::from(*number),
            Value::Text(text) => Json::from(text.as_str()),
            Value::Null | Value::Blob(_) => Json::Null,
        };
        let words: Vec<Json> = std::iter::once(Json::from(name)).chain(values.iter().map(json)).collect();
        let text = Json::from(words).to_string();
        Self { digest: digest(previous, &text), text }
    }

    /// A line of the copy: the digest first in the list.
    pub(super) fn to_line(&self) -> String {
        format!("[\"{}\",{}\n", self.digest, &self.text[1..])
    }

    /// The link of a line without its end; `None` if the line is cut short or damaged.
    pub(super) fn from_line(line: &str) -> Option<Self> {
        let (digest, rest) = line.strip_prefix("[\"")?.split_at_checked(DIGITS)?;
        let rest = rest.strip_prefix("\",")?;
        Some(Self { text: format!("[{rest}"), digest: digest.to_owned() })
    }

    /// Whether it follows the link whose digest is `previous`, as it was written.
    fn fits(&self, previous: &str) -> bool {
        digest(previous, &self.text) == self.digest
    }

    /// The entry; `None` if the text is none.
    pub(super) fn entry(&self) -> Option<Entry> {
        let words: Vec<Json> = serde_json::from_str(&self.text).ok()?;
        let (Json::String(name), values) = words.split_first()? else { return None };
        let value = |json: &Json| {
            Some(match json {
                Json::Null => Value::Null,
                Json::String(text) => Value::Text(text.clone()),
                Json::Number(number) => match number.as_i64() {
                    Some(whole) => Value::Integer(whole),
                    None => Value::Real(number.as_f64()?),
                },
                _ => return None,
            })
        };
        Some((name.clone(), values.iter().map(value).collect::<Option<_>>()?))
    }
}

fn digest(previous: &str, text: &str) -> String {
    let mut digest = sha256(format!("{previous}{text}").as_bytes());
    digest.truncate(DIGITS);
    digest
}

/// The longest history that fits, from what two sources hold. `None` stands for a link that cannot be read. After a damaged
/// link in one source the history goes on in the other, and back.
///
/// # Errors
/// The two links that fit at one place, if they differ: the sources are of two histories.
pub(super) fn longest_history(sources: [&[Option<Link>]; 2]) -> Result<Vec<Link>, Box<[Link; 2]>> {
    let place_after = sources.map(|links| {
        let place = |(at, link): (usize, &Option<Link>)| Some((link.as_ref()?.digest.clone(), at + 1));
        links.iter().enumerate().filter_map(place).collect::<HashMap<String, usize>>()
    });
    let mut history: Vec<Link> = Vec::new();
    loop {
        let previous = last_digest(&history);
        // A damaged digest leaves the number of the entry to go by.
        let fitting = |source: usize| {
            let places = [place_after[source].get(previous).copied(), Some(history.len())];
            let links = places.into_iter().flatten().filter_map(|place| sources[source].get(place)?.as_ref());
            links.into_iter().find(|link| link.fits(previous))
        };
        match (fitting(0), fitting(1)) {
            (Some(one), Some(other)) if one != other => return Err(Box::new([one.clone(), other.clone()])),
            (Some(link), _) | (None, Some(link)) => history.push(link.clone()),
            (None, None) => return Ok(history),
        }
    }
}

/// Digest of the last of `links`.
pub(super) fn last_digest(links: &[Link]) -> &str {
    links.last().map_or("", |link| &link.digest)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn links(count: i64) -> Vec<Link> {
        let mut links: Vec<Link> = Vec::new();
        for number in 0..count {
            let values =
                [number.into(), (0.1 * number as f64).into(), Value::Null, "ä \"b\"\n".to_owned().into()];
            links.push(Link::after(last_digest(&links), "saw", &values));
        }
        links
    }

    #[test]
    fn a_link_comes_back_from_its_line() {
        for link in links(5) {
            let line = link.to_line();
            assert_eq!(Link::from_line(line.trim_end()), Some(link));
        }
    }

    #[test]
    fn an_entry_comes_back_to_the_bit() {
        let values = vec![
            Value::Integer(7),
            Value::Real(0.1 + 0.2),
            Value::Null,
            Value::Text("\"\\\n\u{1b}".to_owned()),
        ];
        assert_eq!(Link::after("", "event", &values).entry(), Some(("event".to_owned(), values)));
    }

    /// The history of one source.
    fn of(links: &[Link]) -> Vec<Link> {
        let stored: Vec<Option<Link>> = links.iter().cloned().map(Some).collect();
        longest_history([&stored, &[]]).unwrap()
    }

    #[test]
    fn links_that_are_missing_moved_or_foreign_end_the_history() {
        let whole = links(6);
        assert_eq!(of(&whole), whole);
        assert_eq!(of(&[&whole[..2], &whole[3..]].concat()), whole[..2]);
        let mut swapped = whole.clone();
        swapped.swap(3, 4);
        assert_eq!(of(&swapped), whole[..3]);
        let foreign = Link::after(last_digest(&whole[..2]), "saw", &[9.into()]);
        assert_eq!(of(&[&whole[..2], std::slice::from_ref(&foreign)].concat()).len(), 3);
        let whole: Vec<Option<Link>> = whole.into_iter().map(Some).collect();
        let other = [&whole[..2], &[Some(foreign)]].concat();
        assert!(longest_history([&whole, &other]).is_err());
        assert_eq!(longest_history([&whole, &whole[..4]]).unwrap().len(), 6);
        assert_eq!(longest_history([&whole[..4], &whole]).unwrap().len(), 6);
    }

    #[test]
    fn each_source_stands_in_for_what_is_damaged_in_the_other() {
        let whole: Vec<Option<Link>> = links(9).into_iter().map(Some).collect();
        let (mut one, mut other) = (whole.clone(), whole.clone());
        // Two that cannot be read, one that is missing, and one whose text has changed.
        one[1] = None;
        other[2] = None;
        other.remove(4);
        other[6].as_mut().unwrap().text.push(' ');
        let history = longest_history([&one, &other]).unwrap();
        assert_eq!(history.into_iter().map(Some).collect::<Vec<_>>(), whole);
        one[4] = None;
        assert_eq!(longest_history([&one, &other]).unwrap().len(), 4);
    }

    proptest! {
        #[test]
        fn a_changed_byte_ends_the_history_there(line in 0..8_usize, place in 0..500_usize, by in 1..=255_u8) {
            let whole = links(8);
            let mut lines: Vec<Vec<u8>> = whole.iter().map(|link| link.to_line().into_bytes()).collect();
            let place = place % (lines[line].len() - 1);
            lines[line][place] ^= by;
            let read: Vec<Option<Link>> = lines
                .iter()
                .map(|bytes| Link::from_line(std::str::from_utf8(bytes).ok()?.trim_end()))
                .collect();
            let history = longest_history([&read, &[]]).unwrap();
            prop_assert_eq!(history.as_slice(), &whole[..line]);
        }
    }
}
