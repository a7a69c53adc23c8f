//! Which device a driver drives, and the lock that keeps two runs from driving it against each other.

use std::thread;
use std::time::{Duration, Instant};

#[cfg(target_os = "linux")]
use rustix::io::Errno;
#[cfg(target_os = "linux")]
use rustix::net::{self, AddressFamily, SocketAddrUnix, SocketFlags, SocketType};
#[cfg(target_os = "linux")]
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

/// A lock of a device, held until it is dropped or the process ends.
///
/// On Linux it is an abstract Unix socket: the kernel names its owner and frees it with the process, no file can be planted or
/// held in its place, and all users of the computer see it. Elsewhere there is none.
#[derive(Debug)]
pub struct DeviceLock(
    #[cfg(target_os = "linux")]
    #[expect(dead_code, reason = "locked as long as it is open")]
    std::os::fd::OwnedFd,
);

/// Who holds the lock of a device, as the kernel says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owner {
    /// Number of the process.
    pub process: u32,
    /// Number of its user.
    pub user: u32,
}

/// An attempt to lock a device.
#[derive(Debug)]
pub(crate) enum Attempt {
    Locked(DeviceLock),
    /// Another process holds it, as far as the kernel says which.
    InUse(Option<Owner>),
    /// The system has no such locks, which must keep nobody from driving his own lamps.
    Unavailable,
}

/// How long a run waits for a watchdog that switches a device off: chosen, longer than one attempt on any device.
const WATCHDOG_WAIT: Duration = Duration::from_secs(120);

/// Pause between two attempts on a device that a watchdog holds; chosen.
const PAUSE: Duration = Duration::from_millis(50);

/// Locks the devices of `identities`, each with the name that errors have for it. Devices that are named twice are locked
/// once. A watchdog that switches one of them off is waited for.
///
/// # Errors
/// [`RigError::Device`] if another run drives one of them.
pub(crate) fn lock_all(identities: Vec<(String, String)>) -> Result<Vec<DeviceLock>, RigError> {
    let mut locked: Vec<String> = Vec::new();
    let mut locks = Vec::new();
    for (device, identity) in identities {
        if !locked.contains(&identity) {
            locks.extend(lock(&device, &identity)?);
            locked.push(identity);
        }
    }
    Ok(locks)
}

fn lock(device: &str, identity: &str) -> Result<Option<DeviceLock>, RigError> {
    let deadline = Instant::now() + WATCHDOG_WAIT;
    loop {
        match DeviceLock::of(identity) {
            Attempt::Locked(lock) => return Ok(Some(lock)),
            Attempt::Unavailable => return Ok(None),
            Attempt::InUse(_) if DeviceLock::is_watchdogs(identity) && Instant::now() < deadline => {
                thread::sleep(PAUSE);
            }
            Attempt::InUse(owner) => {
                let by = owner.map_or_else(String::new, |Owner { process, user }| {
                    format!(" (process {process} of user {user})")
                });
                return Err(failed(device, format!("it is driven by another run{by}; end that run first")));
            }
        }
    }
}

#[cfg(target_os = "linux")]
impl DeviceLock {
    /// Locks the device `identity` for a run.
    pub(crate) fn of(identity: &str) -> Attempt {
        Self::named(&name(identity))
    }

    /// Locks the device `identity` for a watchdog, which runs wait for: both locks are held.
    pub(crate) fn of_watchdog(identity: &str) -> (Attempt, Attempt) {
        (Self::named(&watchdog_name(identity)), Self::of(identity))
    }

    /// Whether the holder of the lock is a watchdog.
    fn is_watchdogs(identity: &str) -> bool {
        matches!(Self::named(&watchdog_name(identity)), Attempt::InUse(_))
    }

    fn named(name: &str) -> Attempt {
        let socket = || {
            let address = SocketAddrUnix::new_abstract_name(name.as_bytes())?;
            let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
            Ok((net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?, address))
        };
        let bound = socket().and_then(|(socket, address)| {
            net::bind(&socket, &address)?;
            // Whoever asks for its owner stays in the queue.
            net::listen(&socket, QUEUE)?;
            Ok(socket)
        });
        // The kernel answers with the owner of the socket to which it connects.
        let owner = || {
            let (socket, address) = socket().ok()?;
            net::connect(&socket, &address).ok()?;
            let owner = net::sockopt::socket_peercred(&socket).ok()?;
            Some(Owner { process: owner.pid.as_raw_pid().unsigned_abs(), user: owner.uid.as_raw() })
        };
        match bound {
            Ok(socket) => Attempt::Locked(Self(socket)),
            Err(Errno::ADDRINUSE) => Attempt::InUse(owner()),
            Err(_) => Attempt::Unavailable,
        }
    }
}

/// How many processes may ask for an owner before it is no longer said: the kernel's own default limit.
#[cfg(target_os = "linux")]
const QUEUE: i32 = 4096;

#[cfg(target_os = "linux")]
fn name(identity: &str) -> String {
    let digest = Sha256::digest(identity.as_bytes());
    let digest: String = digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    format!("tropism/{digest}")
}

#[cfg(target_os = "linux")]
fn watchdog_name(identity: &str) -> String {
    format!("{}/watchdog", name(identity))
}

#[cfg(not(target_os = "linux"))]
impl DeviceLock {
    pub(crate) const fn of(_identity: &str) -> Attempt {
        Attempt::Unavailable
    }

    pub(crate) const fn of_watchdog(_identity: &str) -> (Attempt, Attempt) {
        (Attempt::Unavailable, Attempt::Unavailable)
    }

    const fn is_watchdogs(_identity: &str) -> bool {
        false
    }
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

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_that_another_run_drives_is_refused_until_it_is_free() {
        let here = format!("test {:?}", Instant::now());
        let devices =
            || vec![("left lamp".to_owned(), here.clone()), ("right lamp".to_owned(), here.clone())];
        let held = lock_all(devices()).unwrap();
        for _ in 0..3 {
            let error = lock_all(devices()).unwrap_err().to_string();
            let wanted =
                format!("left lamp: it is driven by another run (process {} of user", std::process::id());
            assert!(error.contains(&wanted), "{error}");
        }
        drop(held);
        lock_all(devices()).unwrap();
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_watchdog_is_waited_for() {
        let here = format!("test {:?}", Instant::now());
        let watchdog = DeviceLock::of_watchdog(&here);
        assert!(matches!(watchdog, (Attempt::Locked(_), Attempt::Locked(_))), "{watchdog:?}");
        thread::scope(|scope| {
            let run = scope.spawn(|| lock("left lamp", &here));
            thread::sleep(3 * PAUSE);
            assert!(!run.is_finished());
            drop(watchdog);
            assert!(run.join().unwrap().unwrap().is_some());
        });
    }
}
