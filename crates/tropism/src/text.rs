//! Text for people: counts with their nouns; and text from outside (devices, programs, file names), shown and written
//! without what would act on its reader.

use std::borrow::Cow;
use std::fmt::Display;

/// A count with its noun, in the plural unless it is one: `1 run`, `2 runs`, `0 entries`.
#[must_use]
pub fn plural<N: Display + From<u8> + PartialEq>(count: N, noun: &str) -> String {
    let is_one = count == N::from(1);
    match noun.strip_suffix('y').filter(|stem| !stem.ends_with(['a', 'e', 'o', 'u'])) {
        _ if is_one => format!("{count} {noun}"),
        Some(stem) => format!("{count} {stem}ies"),
        None => format!("{count} {noun}s"),
    }
}

/// Whether a terminal acts on `letter` instead of showing it, or it changes the order in which others are shown: C0 and
/// C1 controls, line separators, and the bidirectional controls of Unicode (UAX #9, table 4).
fn acts(letter: char) -> bool {
    letter.is_control()
        || matches!(letter, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// `text` in one line of letters that only show: controls are escaped, such as `\u{1b}` and `\n`.
#[must_use]
pub fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, acts)
}

/// [`plain()`] for text of several lines: line feeds and tabs stay.
#[must_use]
pub fn plain_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |letter| acts(letter) && !matches!(letter, '\n' | '\t'))
}

/// JSON with the controls that its strings may hold as they are, such as `\u009b`, escaped as JSON does: it says the same.
#[must_use]
pub fn plain_json(json: &str) -> Cow<'_, str> {
    let is_in_string = |letter: char| acts(letter) && !letter.is_ascii_whitespace();
    if !json.contains(is_in_string) {
        return Cow::Borrowed(json);
    }
    let mut shown = String::with_capacity(json.len() + 8);
    for letter in json.chars() {
        if is_in_string(letter) {
            shown += &format!("\\u{:04x}", u32::from(letter));
        } else {
            shown.push(letter);
        }
    }
    Cow::Owned(shown)
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for letter in text.chars() {
        if is_escaped(letter) {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    Cow::Owned(shown)
}

/// Whether a spreadsheet would take a cell of this text for a formula, or would if one apostrophe fewer stood before it.
fn is_like_formula(text: &str) -> bool {
    let is_number = || text.parse().is_ok_and(f64::is_finite);
    text.trim_start_matches('\'').starts_with(['=', '+', '-', '@', '\t', '\r']) && !is_number()
}

/// `text` as a cell of CSV: an apostrophe stands before what a spreadsheet would execute. Numbers stay as they are.
///
/// # References
/// OWASP, "CSV Injection": <https://owasp.org/www-community/attacks/CSV_Injection>.
#[must_use]
pub fn csv_cell(text: &str) -> Cow<'_, str> {
    if is_like_formula(text) { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

/// The text of a cell that [`csv_cell`] wrote.
#[must_use]
pub fn of_csv_cell(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|text| is_like_formula(text)).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noun_is_in_the_plural_unless_it_is_one() {
        assert_eq!([0_u32, 1, 2].map(|count| plural(count, "run")), ["0 runs", "1 run", "2 runs"]);
        assert_eq!([1_usize, 3].map(|count| plural(count, "entry")), ["1 entry", "3 entries"]);
        assert_eq!(plural(2_u64, "day"), "2 days");
    }
    use proptest::prelude::*;

    #[test]
    fn controls_are_escaped_and_all_else_stays() {
        assert_eq!(plain("bean é \\n 5 °C"), "bean é \\n 5 °C");
        assert_eq!(
            plain("\x1b[2Ja\r\nb\x07\t\u{9b}c\u{202e}d"),
            "\\u{1b}[2Ja\\r\\nb\\u{7}\\t\\u{9b}c\\u{202e}d"
        );
        assert_eq!(plain_lines("a\n\tb\r\x1b"), "a\n\tb\\r\\u{1b}");
        assert_eq!(plain(&plain("\x1b")), plain("\x1b"));
    }

    #[test]
    fn json_says_the_same_without_controls() {
        assert_eq!(plain_json("{\"a\":\"\u{9b}\u{202e}é\"}"), "{\"a\":\"\\u009b\\u202eé\"}");
        assert_eq!(plain_json("{\n  \"a\": 1\n}"), "{\n  \"a\": 1\n}");
    }

    #[test]
    fn formulas_are_quoted_and_numbers_are_not() {
        for text in ["=1+2", "+a", "-a", "@SUM(A1)", "\t=1", "\r=1", "'=1", "''-x"] {
            assert_eq!(csv_cell(text), format!("'{text}"));
        }
        for text in ["", "-1.5", "+2", "000001.jpg", "a=b", "'quoted'"] {
            assert_eq!(csv_cell(text), text);
        }
    }

    proptest! {
        #[test]
        fn a_cell_comes_back(
            text in prop::collection::vec(prop::sample::select(&['\'', '=', '+', '@', 'a', '1', '-', '\t'][..]), 0..=6)
        ) {
            let text = String::from_iter(text);
            let cell = csv_cell(&text);
            prop_assert_eq!(of_csv_cell(&cell), text.as_str());
            prop_assert!(!cell.starts_with(['=', '@', '\t']), "{}", cell);
        }
    }
}
