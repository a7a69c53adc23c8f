//! Files of several pages: a page is named by the file's path, `#` and its number, as in `stack.tif#0007`.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use tropism::photo::TiffPages;

use super::{FileError, disk, name_text};

/// A file whose tags are read: the pages of a series are read one after the other.
struct OpenFile {
    path: PathBuf,
    /// Length and time of change, by which another file of the same name is recognised.
    state: (u64, Option<SystemTime>),
    pages: TiffPages<BufReader<File>>,
}

/// The file that was read last.
static LAST: Mutex<Option<OpenFile>> = Mutex::new(None);

/// The path of a page.
pub(super) fn path(file: &Path, page: usize) -> PathBuf {
    let name = name_text(file.file_name().unwrap_or_default());
    file.with_file_name(format!("{name}#{page:04}"))
}

/// File and page that a path names; `None` for a plain file.
pub(super) fn page_of(path: &Path) -> Option<(PathBuf, usize)> {
    let (file, page) = path.file_name()?.to_str()?.rsplit_once('#')?;
    let page = page.parse().ok()?;
    let file = path.with_file_name(file);
    (!path.exists() && file.is_file()).then_some((file, page))
}

/// How many photographs a TIFF file holds.
pub(super) fn count(file: &Path) -> Result<usize, FileError> {
    with_pages(file, |pages| Ok(pages.count()))
}

/// The bytes of a file with one page alone.
pub(super) fn read(file: &Path, page: usize) -> Result<Vec<u8>, FileError> {
    with_pages(file, |pages| {
        let found = pages.page(page).map_err(|error| FileError::content(file, error.to_string()))?;
        found.ok_or_else(|| FileError::content(file, format!("there is no page {page}")))
    })
}

fn with_pages<T>(
    path: &Path,
    act: impl FnOnce(&mut TiffPages<BufReader<File>>) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let file = File::open(path).map_err(disk("read", path))?;
    let about = file.metadata().map_err(disk("read", path))?;
    let state = (about.len(), about.modified().ok());
    // A panic while the tags are read leaves nothing half done.
    let mut last = LAST.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(open) = last.as_mut().filter(|open| open.path == path && open.state == state) {
        return act(&mut open.pages);
    }
    let pages = TiffPages::read(BufReader::new(file));
    let pages = pages.map_err(|error| FileError::content(path, error.to_string()))?;
    act(&mut last.insert(OpenFile { path: path.to_owned(), state, pages }).pages)
}
