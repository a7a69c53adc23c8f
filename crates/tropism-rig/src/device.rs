//! Which device a driver drives, and the lock that keeps two runs from driving it against each other.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use tropism::rig::RigError;

use crate::failed;
use crate::secret::Parts;

/// Host, port and path of a URL, in one spelling: `HTTP://LocalHost/` and `http://127.0.0.1:80` are the same.
pub(crate) fn address(url: &str) -> String {
    let Parts { scheme, host: place, path, .. } = Parts::of(url);
    let default = if scheme.eq_ignore_ascii_case("https://") { 443 } else { 80 };
    // An IPv6 address stands in brackets and has colons of its own.
    let (host, port) = match place.rsplit_once(':') {
        Some((host, port)) if !port.contains(']') => (host, port.parse().unwrap_or(default)),
        _ => (place, default),
    };
    format!("{}:{port}/{}", self::host(host), path.trim_matches('/'))
}

/// A host in one spelling.
pub(crate) fn host(host: &str) -> String {
    let host = host.trim_end_matches('.').to_ascii_lowercase();
    let is_here = ["localhost", "[::1]", "::1"].contains(&host.as_str()) || host.starts_with("127.");
    if is_here { "localhost".to_owned() } else { host }
}

/// The device behind the words of a program. Words may name files of the current folder, so it is a part of it.
pub(crate) fn command(words: &[String]) -> String {
    let folder = std::env::current_dir().unwrap_or_default();
    format!("command {words:?} in {}", folder.display())
}

/// Locks of devices, held until they are dropped or the process ends.
#[derive(Debug)]
pub struct DeviceLocks(#[expect(dead_code, reason = "locked as long as it is open")] Vec<File>);

/// Locks the devices of `identities`, each with the name that errors have for it. Devices that are named twice are locked
/// once.
///
/// # Errors
/// [`RigError::Device`] if another run drives one of them.
pub(crate) fn lock_all(identities: Vec<(String, String)>) -> Result<DeviceLocks, RigError> {
    let mut locked: Vec<String> = Vec::new();
    let mut locks = Vec::new();
    for (device, identity) in identities {
        if !locked.contains(&identity) {
            locks.extend(lock(&device, &identity)?);
            locked.push(identity);
        }
    }
    Ok(DeviceLocks(locks))
}

/// Locks one device; `None` where no lock file can be made, which must keep nobody from driving his own lamps.
fn lock(device: &str, identity: &str) -> Result<Option<File>, RigError> {
    let digest: String =
        Sha256::digest(identity.as_bytes()).iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let name = format!("tropism-{digest}.lock");
    let Some(mut file) = folders().iter().find_map(|folder| open(&folder.join(&name))) else {
        return Ok(None);
    };
    match file.try_lock() {
        Ok(()) => {
            // For the error of the next one; a file of another user cannot be written, and need not.
            let _ =
                file.set_len(0).and_then(|()| writeln!(file, "process {}: {identity}", std::process::id()));
            Ok(Some(file))
        }
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            let _ = file.rewind().and_then(|()| file.read_to_string(&mut holder));
            let problem = format!("found it driven by another run ({}), wanted it free", holder.trim());
            Err(failed(device, problem))
        }
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Where lock files are: the system's folder for them, as all users share it, or the one for temporary files.
fn folders() -> [PathBuf; 2] {
    [PathBuf::from("/run/lock"), std::env::temp_dir()]
}

fn open(path: &Path) -> Option<File> {
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    // A lock needs no right to write.
    file.or_else(|_| File::open(path)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_an_address_are_one() {
        for url in [
            "http://localhost",
            "HTTP://LocalHost/",
            "http://127.0.0.1:80/",
            "http://u:p@[::1]:80",
            "http://localhost./",
        ] {
            assert_eq!(address(url), "localhost:80/", "{url}");
        }
        assert_eq!(address("https://Wled.local/json/"), "wled.local:443/json");
        assert_eq!(address("http://[fe80::1]/"), "[fe80::1]:80/");
        assert_ne!(address("http://wled-left"), address("http://wled-right"));
        assert_ne!(address("http://wled:8080"), address("http://wled"));
    }

    #[test]
    fn a_device_that_another_run_drives_is_refused_until_it_is_free() {
        let here = format!("test {:?}", std::time::Instant::now());
        let devices =
            || vec![("left lamp".to_owned(), here.clone()), ("right lamp".to_owned(), here.clone())];
        let held = lock_all(devices()).unwrap();
        let error = lock_all(devices()).unwrap_err().to_string();
        let wanted =
            format!("left lamp: found it driven by another run (process {}: {here})", std::process::id());
        assert!(error.contains(&wanted), "{error}");
        drop(held);
        lock_all(devices()).unwrap();
    }
}
