//! Tags of a piece of work: words by which people find it again.
//!
//! They stand one a line in the file `tags.txt` of its folder, those of a rule in a file beside it. No result depends on them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::files::{self, FileError};

/// The longest tag, in letters: chosen, a word or three.
const MOST_LETTERS: usize = 30;

/// Tags of one piece of work; chosen.
const MOST: usize = 20;

const FILE: &str = "tags.txt";

/// The file of the tags of the work at `work`: a folder, or the file of a rule.
#[must_use]
pub fn file(work: &Path) -> PathBuf {
    if work.is_dir() { work.join(FILE) } else { work.with_extension(FILE) }
}

/// The tags of the work at `work`, in the order of letters; none if there is no file. Lines that are no tags are left out.
#[must_use]
pub fn read(work: &Path) -> Vec<String> {
    let text = files::read_text(&file(work)).unwrap_or_default();
    let tags: BTreeSet<&str> = text.lines().map(str::trim).filter(|line| is_tag(line)).collect();
    tags.into_iter().take(MOST).map(str::to_owned).collect()
}

/// Gives the work at `work` these tags in place of those that it has.
///
/// # Errors
/// [`FileError`] if one is no word of letters, digits, `-`, `_` and `.` of at most 30 letters, if there are more than 20, or if
/// the file cannot be written.
pub fn write(work: &Path, tags: &[String]) -> Result<(), FileError> {
    let file = file(work);
    if let Some(wrong) = tags.iter().find(|tag| !is_tag(tag)) {
        let wanted = format!("wanted at most {MOST_LETTERS} letters, digits, `-`, `_` and `.`");
        return Err(FileError::content(&file, format!("found the tag {wrong:?}, {wanted}")));
    }
    let tags: BTreeSet<&str> = tags.iter().map(String::as_str).collect();
    if tags.len() > MOST {
        return Err(FileError::content(&file, format!("found {} tags, wanted {MOST} at most", tags.len())));
    }
    let text: String = tags.iter().flat_map(|tag| [tag, "\n"]).collect();
    files::write(&file, text.as_bytes())
}

fn is_tag(word: &str) -> bool {
    let is_letter = |letter: char| letter.is_alphanumeric() || matches!(letter, '-' | '_' | '.');
    (1..=MOST_LETTERS).contains(&word.chars().count()) && word.chars().all(is_letter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_are_words_each_once_and_others_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        assert_eq!(read(folder.path()), Vec::<String>::new());
        write(folder.path(), &words(&["weiß", "batch-2", "batch-2"])).unwrap();
        assert_eq!(read(folder.path()), ["batch-2", "weiß"]);
        for wrong in ["", "two words", "a\nb", "../x/y", &"a".repeat(31)] {
            let problem = write(folder.path(), &words(&[wrong])).unwrap_err().to_string();
            assert!(
                problem.contains("tags.txt") && problem.contains("wanted at most 30 letters"),
                "{problem}"
            );
        }
        let many: Vec<String> = (0..21).map(|number| number.to_string()).collect();
        assert!(write(folder.path(), &many).unwrap_err().to_string().contains("found 21 tags"));
        assert_eq!(read(folder.path()), ["batch-2", "weiß"]);
        // By hand, with what is no tag.
        std::fs::write(file(folder.path()), " b \n\nnot a tag\na\n").unwrap();
        assert_eq!(read(folder.path()), ["a", "b"]);
        assert_eq!(file(&folder.path().join("rule.json")), folder.path().join("rule.tags.txt"));
    }
}
