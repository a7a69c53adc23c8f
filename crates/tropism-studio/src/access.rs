//! Who may come in: hashed tokens in a file, sessions in memory, and how often a token may be tried.
//!
//! The file `access.json` holds two hashes and is readable by its owner alone: one token may change things, the other may look.
//! Sessions last twelve hours and end with the program.
//!
//! Hashes are SHA-256: tokens are 130 random bits, which nobody guesses. A slow hash is for passwords that people choose.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism_lab::files;

use crate::error::StudioError;

/// How long a session lasts.
const SESSION: Duration = Duration::from_secs(12 * 3600);

/// Sessions at once; the oldest one ends when there are more.
const MAX_SESSIONS: usize = 256;

/// Wrong tokens from one address before a pause.
pub(crate) const TRIES: u32 = 5;

/// The pause after so many.
const PAUSE: Duration = Duration::from_secs(60);

/// Addresses whose wrong tokens are counted; beyond it all addresses wait for one another.
const MAX_ADDRESSES: usize = 4096;

/// What a session may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Right {
    /// Look only.
    Look,
    /// Look and change.
    Change,
}

/// The two tokens, in the clear: they are shown once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tokens {
    /// The token that may change things.
    pub change: String,
    /// The token that may look only.
    pub look: String,
}

/// The file of the hashes.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Hashes {
    schema: String,
    change: String,
    look: String,
}

const SCHEMA: &str = "tropism.studio-access/1";

#[derive(Clone, Debug)]
pub(crate) struct Session {
    pub(crate) right: Right,
    /// What a page must send with each change.
    pub(crate) csrf: String,
    began: Instant,
}

#[derive(Default)]
struct Wrong {
    count: u32,
    until: Option<Instant>,
}

/// Sessions and the hashes that open them.
pub(crate) struct Access {
    /// `None` on loopback: whoever reaches it may change things.
    known: Option<Known>,
    sessions: Mutex<BTreeMap<String, Session>>,
    wrong: Mutex<BTreeMap<IpAddr, Wrong>>,
    open: Session,
}

/// The file of the hashes, and what it said last.
struct Known {
    path: PathBuf,
    latest: Mutex<(String, Hashes)>,
}

/// Why nobody was let in.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum LogInError {
    /// The token is not one of the two; so many tries are left.
    Wrong(u32),
    /// Too many wrong tokens: wait for so many seconds.
    Wait(u64),
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// 26 letters and digits of 130 random bits.
pub(crate) fn random_word() -> Result<String, StudioError> {
    const LETTERS: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
    let mut bytes = [0; 26];
    getrandom::fill(&mut bytes).map_err(|error| StudioError::System(format!("random numbers: {error}")))?;
    Ok(bytes.iter().map(|byte| char::from(LETTERS[usize::from(byte % 32)])).collect())
}

fn hash(token: &str) -> String {
    files::sha256(token.as_bytes())
}

/// The file of the hashes of the studio of `folder`.
pub(crate) fn path(folder: &Path) -> PathBuf {
    folder.join(crate::OWN).join("access.json")
}

/// Makes new tokens for the studio of `folder`: the old ones open nothing any more. They are in no file.
///
/// # Errors
/// [`StudioError`] if the file cannot be written.
pub fn new_tokens(folder: &Path) -> Result<Tokens, StudioError> {
    let tokens = Tokens { change: random_word()?, look: random_word()? };
    let hashes = Hashes { schema: SCHEMA.to_owned(), change: hash(&tokens.change), look: hash(&tokens.look) };
    let path = path(folder);
    files::make_folder(&folder.join(crate::OWN))?;
    let text =
        serde_json::to_string_pretty(&hashes).map_err(|error| StudioError::System(error.to_string()))?;
    files::write_private(&path, text.as_bytes(), true)?;
    Ok(tokens)
}

/// What the file `path` of the hashes says.
fn hashes_of(path: &Path, text: &str) -> Result<Hashes, StudioError> {
    let problem = |problem: String| StudioError::Access { path: path.to_owned(), problem };
    check_private(path).map_err(problem)?;
    let hashes: Hashes = serde_json::from_str(text).map_err(|error| problem(error.to_string()))?;
    for hash in [&hashes.change, &hashes.look] {
        if hash.len() != 64 || !hash.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(problem(format!(
                "found {hash:?}, wanted the 64 digits of a SHA-256; make new tokens by --new-tokens"
            )));
        }
    }
    Ok(hashes)
}

impl Access {
    /// Without tokens, for the computer alone.
    pub(crate) fn open() -> Result<Self, StudioError> {
        let open = Session { right: Right::Change, csrf: random_word()?, began: Instant::now() };
        Ok(Self { known: None, sessions: Mutex::default(), wrong: Mutex::default(), open })
    }

    /// With the tokens whose hashes are in the folder of the studio.
    pub(crate) fn with_tokens(folder: &Path) -> Result<Self, StudioError> {
        let path = path(folder);
        let text = files::read_text(&path)?;
        let hashes = hashes_of(&path, &text)?;
        let known = Known { path, latest: Mutex::new((text, hashes)) };
        Ok(Self { known: Some(known), ..Self::open()? })
    }

    pub(crate) const fn asks_for_token(&self) -> bool {
        self.known.is_some()
    }

    /// The hashes as the file says now. Where new tokens were made, all sessions of the old ones end.
    fn hashes(&self) -> Option<Hashes> {
        let known = self.known.as_ref()?;
        let text = files::read_text(&known.path).ok()?;
        let mut latest = locked(&known.latest);
        if latest.0 != text {
            locked(&self.sessions).clear();
            let hashes = hashes_of(&known.path, &text).ok()?;
            *latest = (text, hashes);
        }
        Some(latest.1.clone())
    }

    /// The session that a cookie names; that of everybody where no token is asked for.
    pub(crate) fn session(&self, cookie: Option<&str>) -> Option<Session> {
        if !self.asks_for_token() {
            return Some(self.open.clone());
        }
        self.hashes()?;
        let sessions = locked(&self.sessions);
        sessions.get(cookie?).filter(|session| session.began.elapsed() < SESSION).cloned()
    }

    /// Opens a session: its cookie.
    pub(crate) fn log_in(&self, token: &str, from: IpAddr) -> Result<String, LogInError> {
        let right = self.right_of(token, from)?;
        self.begin(right).ok_or(LogInError::Wait(1))
    }

    /// The right to look that a program has by the token that it sends with each request. It changes nothing: changes need
    /// the word of a session.
    pub(crate) fn looks(&self, token: &str, from: IpAddr) -> Option<Session> {
        self.right_of(token, from).ok()?;
        Some(Session { right: Right::Look, ..self.open.clone() })
    }

    pub(crate) fn log_out(&self, cookie: &str) {
        locked(&self.sessions).remove(cookie);
    }

    /// The right of a token; a wrong one is counted.
    fn right_of(&self, token: &str, from: IpAddr) -> Result<Right, LogInError> {
        // Of many tries at once each one sees the count of those before it.
        let mut wrong = locked(&self.wrong);
        if let Some(seconds) = wait_s(&wrong, from) {
            return Err(LogInError::Wait(seconds));
        }
        let hash = hash(token);
        let right = self.hashes().and_then(|hashes| {
            let rights = [(&hashes.change, Right::Change), (&hashes.look, Right::Look)];
            rights.into_iter().find(|(of, _)| **of == hash).map(|(_, right)| right)
        });
        match right {
            Some(right) => {
                wrong.remove(&counted(from));
                Ok(right)
            }
            None => Err(count_wrong(&mut wrong, from)),
        }
    }

    fn begin(&self, right: Right) -> Option<String> {
        let (cookie, csrf) = (random_word().ok()?, random_word().ok()?);
        let mut sessions = locked(&self.sessions);
        sessions.retain(|_, session| session.began.elapsed() < SESSION);
        if sessions.len() >= MAX_SESSIONS {
            let oldest = sessions.iter().min_by_key(|(_, session)| session.began).map(|(key, _)| key.clone());
            oldest.and_then(|key| sessions.remove(&key));
        }
        sessions.insert(cookie.clone(), Session { right, csrf, began: Instant::now() });
        Some(cookie)
    }
}

/// The address under which wrong tokens are counted: one network of IPv6 is one address.
fn counted(from: IpAddr) -> IpAddr {
    match from {
        IpAddr::V6(address) if address.to_ipv4_mapped().is_none() => {
            let [a, b, c, d, ..] = address.segments();
            IpAddr::V6([a, b, c, d, 0, 0, 0, 0].into())
        }
        other => other.to_canonical(),
    }
}

fn wait_s(wrong: &BTreeMap<IpAddr, Wrong>, from: IpAddr) -> Option<u64> {
    let until = wrong.get(&counted(from))?.until?;
    let left = until.saturating_duration_since(Instant::now());
    (!left.is_zero()).then(|| left.as_secs() + 1)
}

fn count_wrong(wrong: &mut BTreeMap<IpAddr, Wrong>, from: IpAddr) -> LogInError {
    if wrong.len() >= MAX_ADDRESSES {
        wrong.retain(|_, of| of.until.is_some_and(|until| until > Instant::now()));
    }
    let of = wrong.entry(counted(from)).or_default();
    if of.until.is_some_and(|until| until <= Instant::now()) {
        *of = Wrong::default();
    }
    of.count += 1;
    if of.count < TRIES {
        return LogInError::Wrong(TRIES - of.count);
    }
    of.until = Some(Instant::now() + PAUSE);
    LogInError::Wait(PAUSE.as_secs())
}

#[cfg(unix)]
fn check_private(path: &Path) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt;

    let mode = path.metadata().map_err(|error| error.to_string())?.permissions().mode() & 0o777;
    if mode & 0o077 == 0 {
        return Ok(());
    }
    Err(format!(
        "found mode {mode:o}, wanted 600: others can read the hashes; chmod 600, or make new tokens by --new-tokens"
    ))
}

#[cfg(not(unix))]
fn check_private(_path: &Path) -> Result<(), String> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    #[test]
    fn each_token_opens_what_it_may() {
        let folder = tempfile::tempdir().unwrap();
        let tokens = new_tokens(folder.path()).unwrap();
        let access = Access::with_tokens(folder.path()).unwrap();
        assert!(access.session(None).is_none() && access.session(Some("x")).is_none());
        for (token, right) in [(&tokens.change, Right::Change), (&tokens.look, Right::Look)] {
            let cookie = access.log_in(token, HERE).unwrap();
            assert_eq!(access.session(Some(&cookie)).unwrap().right, right);
            access.log_out(&cookie);
            assert!(access.session(Some(&cookie)).is_none());
        }
        let text = std::fs::read_to_string(path(folder.path())).unwrap();
        assert!(!text.contains(&tokens.change) && !text.contains(&tokens.look));
    }

    #[test]
    fn new_tokens_end_what_the_old_ones_opened() {
        let folder = tempfile::tempdir().unwrap();
        let old = new_tokens(folder.path()).unwrap();
        let access = Access::with_tokens(folder.path()).unwrap();
        let cookie = access.log_in(&old.change, HERE).unwrap();
        let new = new_tokens(folder.path()).unwrap();
        assert!(access.session(Some(&cookie)).is_none());
        assert!(access.log_in(&old.change, HERE).is_err() && access.looks(&old.look, HERE).is_none());
        let cookie = access.log_in(&new.change, HERE).unwrap();
        assert_eq!(access.session(Some(&cookie)).unwrap().right, Right::Change);
        std::fs::remove_file(path(folder.path())).unwrap();
        assert!(access.session(Some(&cookie)).is_none(), "without the file nobody is let in");
    }

    #[test]
    fn wrong_tokens_are_followed_by_a_pause() {
        let folder = tempfile::tempdir().unwrap();
        let tokens = new_tokens(folder.path()).unwrap();
        let access = Access::with_tokens(folder.path()).unwrap();
        for left in (1..TRIES).rev() {
            assert_eq!(access.log_in("guess", HERE), Err(LogInError::Wrong(left)));
        }
        assert_eq!(access.log_in("guess", HERE), Err(LogInError::Wait(60)));
        // The right one does not help now; it does from elsewhere.
        assert!(matches!(access.log_in(&tokens.change, HERE), Err(LogInError::Wait(_))));
        assert!(access.log_in(&tokens.change, "192.0.2.1".parse().unwrap()).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn hashes_that_others_can_read_are_refused() {
        use std::os::unix::fs::PermissionsExt;

        let folder = tempfile::tempdir().unwrap();
        new_tokens(folder.path()).unwrap();
        let path = path(folder.path());
        assert_eq!(path.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        let error = Access::with_tokens(folder.path()).err().unwrap().to_string();
        assert!(error.contains("found mode 644, wanted 600"), "{error}");
    }
}
