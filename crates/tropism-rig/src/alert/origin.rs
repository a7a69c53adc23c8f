//! Where alerts come from: a run, and its page in a studio.

use std::path::Path;

use crate::secret::redacted;

/// The folder of a studio's own files, in the folder that it serves.
pub const OF_STUDIO: &str = ".tropism-studio";

/// The run that alerts are of.
#[derive(Clone, Debug)]
pub(crate) struct Origin {
    /// Its name.
    pub(crate) run: String,
    /// Address of its page; `None` where the rig file names no page.
    pub(crate) url: Option<String>,
}

impl Origin {
    /// The run `run`; `page` is the address of the studio. Without a `folder` it is not of one run.
    pub(crate) fn new(run: &str, page: Option<&str>, folder: Option<&Path>) -> Self {
        let url = |page: &str| {
            let page = page.trim_end_matches('/');
            let at = folder.and_then(place_of);
            at.map_or_else(|| format!("{page}/"), |at| format!("{page}/run?at={}", encoded(&at)))
        };
        Self { run: run.to_owned(), url: page.map(url) }
    }
}

/// The place of the run in `folder` below the folder that a studio serves: the nearest above that has files of a studio, or
/// the run's own. `None` if there is none.
fn place_of(folder: &Path) -> Option<String> {
    let folder = folder.canonicalize().ok()?;
    let is_root = |path: &&Path| path.join(OF_STUDIO).is_dir();
    let root = folder.ancestors().skip(1).find(is_root).or_else(|| Some(&*folder).filter(is_root))?;
    let names = folder.strip_prefix(root).ok()?.iter().map(|name| name.to_str());
    Some(names.collect::<Option<Vec<_>>>()?.join("/"))
}

/// A value of an address, with slashes as they are.
fn encoded(text: &str) -> String {
    let letter = |byte: u8| match byte {
        byte if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    text.bytes().map(letter).collect()
}

/// Checks the address of a studio. Everybody who gets an alert reads it.
pub(crate) fn check_page(page: &str) -> Result<(), String> {
    let found = || format!("found page = {:?}", redacted(page));
    if page.contains(|letter: char| !letter.is_ascii_graphic() || "?#@".contains(letter)) {
        return Err(format!(
            "{}, wanted the address of the studio alone, without user, token and blanks",
            found()
        ));
    }
    let host = page.strip_prefix("http://").or_else(|| page.strip_prefix("https://"));
    match host {
        Some(host) if !host.is_empty() && !host.starts_with('/') => Ok(()),
        _ => Err(format!("{}, wanted http:// or https:// and a host", found())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_knows_its_page() {
        let top = tempfile::tempdir().unwrap();
        let run = top.path().join("beans/lab 1/bean&co");
        std::fs::create_dir_all(&run).unwrap();
        let url = |folder: Option<&Path>| {
            Origin::new("bean", Some("http://greenhouse.local:8734/"), folder).url.unwrap()
        };
        // Nothing says in which folder the studio is.
        assert_eq!(url(Some(&run)), "http://greenhouse.local:8734/");
        std::fs::create_dir(run.join(OF_STUDIO)).unwrap();
        assert_eq!(url(Some(&run)), "http://greenhouse.local:8734/run?at=");
        std::fs::create_dir(top.path().join("beans").join(OF_STUDIO)).unwrap();
        assert_eq!(url(Some(&run)), "http://greenhouse.local:8734/run?at=lab%201/bean%26co");
        assert_eq!(url(None), "http://greenhouse.local:8734/");
        assert!(Origin::new("bean", None, Some(&run)).url.is_none());
    }

    #[test]
    fn a_page_is_an_address_without_secrets() {
        assert_eq!(check_page("https://plants.example.org/green/house"), Ok(()));
        for page in
            ["greenhouse.local:8734", "http://", "http://x/login#tok3n", "http://u:pass@x/", "http://x/ y"]
        {
            let error = check_page(page).unwrap_err();
            assert!(error.contains("wanted") && !error.contains("pass@"), "{error}");
        }
    }
}
