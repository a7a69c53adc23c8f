//! Which files of a folder are photographs, what becomes of the others, and what films and files of several pages hold.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use tropism::photo;
use tropism::text::plural;

use super::{FileError, disk, film, pages};

/// Extensions of the photographs that are read.
const PHOTOGRAPHS: [&str; 5] = ["jpg", "jpeg", "png", "tif", "tiff"];

/// Extensions of films, which ffmpeg reads picture by picture.
const FILMS: [&str; 12] =
    ["mp4", "mov", "avi", "mkv", "webm", "m4v", "mpg", "mpeg", "mts", "gif", "mjpeg", "mjpg"];

/// Folders inside folders that are searched; chosen by hand.
const MAX_DEPTH: usize = 8;

/// Files of one kind that are named in a note.
const NAMED: usize = 3;

/// Photographs, and what was found beside them.
#[derive(Debug, Default)]
pub struct PhotographList {
    /// The photographs, in natural order in each folder. A page of a file is the file's path with `#` and its number.
    pub files: Vec<PathBuf>,
    /// Sentences on what was left out, and how to convert it, and on folders inside folders, films and pages.
    pub notes: Vec<String>,
    /// Folders of the pictures of films, which go with the list.
    films: Vec<tempfile::TempDir>,
}

/// Lists the photographs that `paths` name: files as they are, and of a folder all JPEG, PNG and TIFF files in it, in natural
/// order: `frame9.jpg` stands before `frame10.jpg`. A folder without photographs of its own stands for the folders in it.
///
/// The pages of a TIFF file are photographs, and so are the pictures of a film, if it is named or nothing else is in its folder.
/// Files whose names begin with a dot are passed over in silence.
///
/// # Errors
/// [`FileError`] if a path does not exist, a folder holds no photograph, or a film cannot be read; it says how to convert what
/// is there.
pub fn list_photographs(paths: &[PathBuf]) -> Result<PhotographList, FileError> {
    let mut list = list_files(paths)?;
    for file in std::mem::take(&mut list.files) {
        let extension = extension_of(&file);
        if FILMS.contains(&extension.as_str()) {
            let (folder, pictures) = film::pictures(&file)?;
            list.notes.push(format!(
                "{}: a film, read with ffmpeg picture by picture: {}",
                file.display(),
                plural(pictures.len(), "picture")
            ));
            list.films.push(folder);
            list.files.extend(pictures);
            continue;
        }
        // A damaged file is one photograph, and its error comes when it is decoded.
        let count = if extension.starts_with("tif") { pages::count(&file).unwrap_or(1) } else { 1 };
        if count > 1 {
            list.notes.push(format!("{}: {count} pages, each a photograph", file.display()));
            list.files.extend((0..count).map(|page| pages::path(&file, page)));
        } else {
            list.files.push(file);
        }
    }
    Ok(list)
}

/// Lists the files that hold photographs: pages and pictures of films are not counted.
pub(super) fn list_files(paths: &[PathBuf]) -> Result<PhotographList, FileError> {
    let mut list = PhotographList::default();
    for path in paths {
        if !path.is_dir() {
            fs::metadata(path).map_err(disk("read", path))?;
            list.files.push(path.clone());
            continue;
        }
        let mut found = Folder::read(path, MAX_DEPTH)?;
        if found.photographs.is_empty() {
            let films = FILMS.iter().filter_map(|film| found.others.remove(*film)).flatten();
            found.photographs = films.map(|name| path.join(name)).collect();
            sort(&mut found.photographs);
        }
        let notes = found.notes();
        if found.photographs.is_empty() {
            let beside = if notes.is_empty() { String::new() } else { format!("; {}", notes.join("; ")) };
            return Err(FileError::content(
                path,
                format!("no photographs here: no .jpg, .jpeg, .png, .tif or .tiff file{beside}"),
            ));
        }
        list.notes.extend(notes.into_iter().map(|note| format!("{}: {note}", path.display())));
        list.files.extend(found.photographs);
    }
    Ok(list)
}

/// The extension of a file in lower case.
fn extension_of(path: &Path) -> String {
    path.extension().map_or_else(String::new, |found| found.to_string_lossy().to_lowercase())
}

/// The files below a folder.
#[derive(Default)]
struct Folder {
    photographs: Vec<PathBuf>,
    /// The names of all other files, by their extensions in lower case.
    others: BTreeMap<String, Vec<String>>,
    /// Folders whose photographs are taken in.
    taken: Vec<String>,
    /// Folders with photographs that are left out, and how many.
    left: Vec<(String, usize)>,
}

impl Folder {
    fn read(path: &Path, depth: usize) -> Result<Self, FileError> {
        let mut folder = Self::default();
        let mut inside = Vec::new();
        for entry in fs::read_dir(path).map_err(disk("read", path))? {
            let entry = entry.map_err(disk("read", path))?.path();
            let name = name_of(&entry);
            if name.starts_with('.') {
                continue;
            }
            let extension = extension_of(&entry);
            if entry.is_dir() {
                // A link to a folder that it lies in leads to photographs that are listed already.
                let is_above =
                    || Ok::<_, std::io::Error>(path.canonicalize()?.starts_with(entry.canonicalize()?));
                if !entry.is_symlink() || !is_above().map_err(disk("read", &entry))? {
                    inside.push(entry);
                }
            } else if PHOTOGRAPHS.contains(&extension.as_str()) {
                folder.photographs.push(entry);
            } else {
                folder.others.entry(extension).or_default().push(name);
            }
        }
        sort(&mut folder.photographs);
        sort(&mut inside);
        let is_empty = folder.photographs.is_empty();
        for path in inside.iter().filter(|_| depth > 0) {
            let below = Self::read(path, depth - 1)?;
            let name = name_of(path);
            if !is_empty {
                let count =
                    below.photographs.len() + below.left.iter().map(|(_, count)| count).sum::<usize>();
                folder.left.extend((count > 0).then_some((name, count)));
                continue;
            }
            if !below.photographs.is_empty() && below.taken.is_empty() {
                folder.taken.push(name.clone());
            }
            let within = |inner: &String| format!("{name}/{inner}");
            folder.taken.extend(below.taken.iter().map(within));
            folder.left.extend(below.left.iter().map(|(inner, count)| (within(inner), *count)));
            for (extension, names) in below.others {
                folder.others.entry(extension).or_default().extend(names.iter().map(within));
            }
            folder.photographs.extend(below.photographs);
        }
        Ok(folder)
    }

    /// What was left out and taken in, a sentence each.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.taken.is_empty() {
            notes.push(format!(
                "took the photographs of the folders inside, in this order: {}",
                shortened(&self.taken)
            ));
        }
        for (name, count) in &self.left {
            notes.push(format!("left out the folder {name} with {}", plural(*count, "photograph")));
        }
        for (extension, names) in &self.others {
            let what = match extension.as_str() {
                "" => plural(names.len(), "file"),
                _ => format!("{} .{extension}", names.len()),
            };
            let advice = conversion(extension).map_or_else(String::new, |advice| format!(": {advice}"));
            notes.push(format!("left out {what} ({}){advice}", shortened(names)));
        }
        notes
    }
}

/// How to turn files with this extension into photographs; `None` where they show no plant.
fn conversion(extension: &str) -> Option<String> {
    let extension = extension.to_owned();
    match extension.as_str() {
        "heic" | "heif" | "avif" | "webp" | "bmp" | "jp2" => {
            Some(format!("`magick mogrify -format jpg *.{extension}` converts them (ImageMagick)"))
        }
        film if FILMS.contains(&film) => Some(
            "a film: name it in place of the folder, and it is read picture by picture (with ffmpeg)"
                .to_owned(),
        ),
        "cr2" | "cr3" | "nef" | "arw" | "dng" | "raf" | "orf" | "rw2" => Some(format!(
            "raw files: `for f in *.{extension}; do darktable-cli \"$f\" \"${{f%.*}}.jpg\"; done` converts them"
        )),
        _ => None,
    }
}

/// Names are sorted as a person reads them; names that are read alike still have an order.
fn sort(paths: &mut [PathBuf]) {
    paths.sort_by_cached_key(|path| {
        let name = path.file_name().unwrap_or_default();
        (photo::natural_order(&name.to_string_lossy()), name.to_owned())
    });
}

fn name_of(path: &Path) -> String {
    super::name_text(path.file_name().unwrap_or_default())
}

/// The first names, and how many there are more.
fn shortened(names: &[String]) -> String {
    let shown = names[..names.len().min(NAMED)].join(", ");
    if names.len() > NAMED { format!("{shown} and {} more", names.len() - NAMED) } else { shown }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, b"").unwrap();
        }
        folder
    }

    fn list(files: &[&str]) -> Result<(Vec<String>, String), String> {
        let folder = folder(files);
        let root = folder.path().to_owned();
        let list = list_photographs(std::slice::from_ref(&root)).map_err(|error| error.to_string())?;
        let within = |path: &PathBuf| path.strip_prefix(&root).unwrap().to_string_lossy().into_owned();
        Ok((list.files.iter().map(within).collect(), list.notes.join("\n")))
    }

    #[test]
    fn nothing_in_a_mixed_folder_vanishes_unmentioned() {
        let files = [
            "9.jpg",
            "10.JPG",
            "b.tif",
            "c.heic",
            "d.MP4",
            "notes.txt",
            "Makefile",
            ".DS_Store",
            "old/1.jpg",
        ];
        let (found, notes) = list(&files).unwrap();
        assert_eq!(found, ["9.jpg", "10.JPG", "b.tif"]);
        for wanted in [
            "1 .heic (c.heic): `magick mogrify -format jpg *.heic`",
            "1 .mp4 (d.MP4): a film: name it",
            "1 .txt (notes.txt)",
            "1 file (Makefile)",
            "left out the folder old with 1 photograph",
        ] {
            assert!(notes.contains(wanted), "{wanted}: {notes}");
        }
        assert!(!notes.contains("DS_Store"), "{notes}");
    }

    #[test]
    fn folders_inside_are_read_in_order() {
        let (found, notes) = list(&["day10/1.jpg", "day9/2.jpg", "day9/10.jpg", "day9/x.cr2"]).unwrap();
        assert_eq!(found, ["day9/2.jpg", "day9/10.jpg", "day10/1.jpg"]);
        assert!(notes.contains("in this order: day9, day10") && notes.contains("day9/x.cr2"), "{notes}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_up_is_not_followed() {
        let folder = folder(&["day1/1.jpg", "day2/2.jpg"]);
        std::os::unix::fs::symlink(folder.path(), folder.path().join("day1/all")).unwrap();
        std::os::unix::fs::symlink(folder.path().join("day2"), folder.path().join("day3")).unwrap();
        let found = list_photographs(&[folder.path().to_owned()]).unwrap().files;
        let within =
            |path: &PathBuf| path.strip_prefix(folder.path()).unwrap().to_string_lossy().into_owned();
        assert_eq!(found.iter().map(within).collect::<Vec<_>>(), ["day1/1.jpg", "day2/2.jpg", "day3/2.jpg"]);
    }

    #[test]
    fn a_folder_without_photographs_says_how_to_get_them() {
        let error = list(&["a.webp", "b.webp"]).unwrap_err();
        assert!(
            error.contains("no photographs here") && error.contains("2 .webp") && error.contains("magick"),
            "{error}"
        );
        // Read with ffmpeg, or refused with where to find it.
        let error = list(&["a.mov", "b.mov"]).unwrap_err();
        assert!(error.contains("a.mov") && error.contains("ffmpeg"), "{error}");
        assert!(list(&[]).unwrap_err().ends_with(".tiff file"));
    }
}
