//! HTTP requests with one deadline, and cameras that answer with a photograph.
//!
//! For ESP32-CAM (`/capture`), ESPHome, IP cameras, mjpg-streamer (`?action=snapshot`) and Home Assistant. Such cameras
//! may answer with buffered frames, so some frames are discarded, and a repeated frame is refused.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::photo::Photo;
use tropism::rig::{Camera, RigError};

use crate::seconds::{Seconds, ten};
use crate::secret::{read_secret, redacted};
use crate::settings::CameraSettings;
use crate::{failed, picture, retry, whole};

/// One request: address, deadline and the largest answer.
pub(crate) struct Request<'a> {
    pub(crate) device: &'a str,
    pub(crate) url: &'a str,
    pub(crate) authorization: Option<&'a str>,
    pub(crate) deadline: Instant,
    pub(crate) max_bytes: u64,
}

impl Request<'_> {
    fn error(&self, problem: String) -> RigError {
        failed(
            format!("{} ({})", self.device, redacted(self.url)),
            problem.replace(self.url, &redacted(self.url)),
        )
    }

    /// Sends a GET, or with `json` a POST, and returns the body of the answer.
    ///
    /// # Errors
    /// [`RigError::Device`] if no complete answer of at most `max_bytes` arrives by the deadline, or its status is not a
    /// success.
    pub(crate) fn send(&self, json: Option<&str>) -> Result<Vec<u8>, RigError> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(self.error("no answer in time".to_owned()));
        }
        let agent = ureq::Agent::config_builder()
            .timeout_global(Some(left))
            // A device of the tent is on the local network, not behind a proxy.
            .proxy(None)
            .max_redirects(3)
            .build()
            .new_agent();
        let authorized = |name: &str| self.authorization.map(|value| (name.to_owned(), value.to_owned()));
        let answer = match json {
            None => {
                let mut request = agent.get(self.url);
                if let Some((name, value)) = authorized("Authorization") {
                    request = request.header(name, value);
                }
                request.call()
            }
            Some(json) => {
                let mut request = agent.post(self.url).header("Content-Type", "application/json");
                if let Some((name, value)) = authorized("Authorization") {
                    request = request.header(name, value);
                }
                request.send(json)
            }
        };
        answer
            .and_then(|answer| answer.into_body().into_with_config().limit(self.max_bytes).read_to_vec())
            .map_err(|error| self.error(in_plain_words(&error.to_string())))
    }
}

/// What a failed request says, without the names of a library's types.
pub(crate) fn in_plain_words(error: &str) -> String {
    let reason = [
        ("UnknownIssuer", "nobody whom this computer trusts has signed it (it may be self-signed)"),
        ("BadSignature", "nobody whom this computer trusts has signed it, but somebody of the same name"),
        ("SelfSigned", "it is self-signed"),
        ("CaUsedAsEndEntity", "it is self-signed"),
        ("Expired", "it has expired, or the clock of this computer is wrong"),
        ("NotValidYet", "it is not valid yet, or the clock of this computer is wrong"),
        ("NotValidForName", "it is for another name than that of the address"),
    ];
    match reason.iter().find(|(name, _)| error.contains(name)) {
        Some((_, reason)) => format!(
            "its certificate is refused: {reason}; wanted a trusted one, or http:// in a network of its own"
        ),
        None => error.to_owned(),
    }
}

/// Checks that `url` is an address that can be asked.
///
/// # Errors
/// What was found, and what was wanted; without the feature `tls`, `https://` is refused.
pub(crate) fn check_url(url: &str) -> Result<(), String> {
    check_url_shown(url, redacted)
}

/// [`check_url()`] whose error shows the address as `shown` does.
pub(crate) fn check_url_shown(url: &str, shown: impl Fn(&str) -> String) -> Result<(), String> {
    let found = || format!("found url = {:?}", shown(url));
    if !cfg!(feature = "tls") && url.starts_with("https://") {
        return Err(format!("{}, wanted http://: https addresses need the feature `tls`", found()));
    }
    let host = url.strip_prefix("http://").or_else(|| url.strip_prefix("https://"));
    if url.contains(|letter: char| letter.is_whitespace() || letter.is_control()) {
        return Err(format!("{}, wanted it without blanks and controls", found()));
    }
    let Some(host) = host.and_then(|rest| rest.split(['/', '?', '#']).next()) else {
        return Err(format!("{}, wanted http:// or https:// and a host", found()));
    };
    let host = host.rsplit_once('@').map_or(host, |(_, host)| host);
    // Brackets hold the colons of an address.
    let (name, port) = match host.split_once(']') {
        Some((address, port)) => {
            (address.trim_start_matches('['), port.strip_prefix(':').or((!port.is_empty()).then_some("")))
        }
        None => host.split_once(':').map_or((host, None), |(name, port)| (name, Some(port))),
    };
    if name.is_empty() {
        return Err(format!("{}, wanted http:// or https:// and a host", found()));
    }
    match port {
        Some(port) if port.parse::<u16>().is_ok_and(|port| port > 0) => Ok(()),
        None => Ok(()),
        Some(_) => {
            Err(format!("{}, wanted a port from 1 to 65535, and an address with colons in brackets", found()))
        }
    }
}

/// A camera that answers a GET with a photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HttpCamera {
    /// Address of the snapshot.
    pub url: String,
    /// A file whose first line is the header `Authorization`, such as `Bearer …`, so that it stays out of run folders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub authorization_file: Option<PathBuf>,
    /// Frames that are discarded before each photograph. An ESP32-CAM buffers two.
    #[serde(default = "retry::two", deserialize_with = "whole::frames")]
    pub discard_frames: u32,
    /// Time limit of one attempt, discarded frames included.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
    /// The largest photograph, in bytes.
    #[serde(default = "twenty_million")]
    pub max_bytes: u64,
    /// Further attempts after a failure.
    #[serde(default = "retry::two", deserialize_with = "whole::retries")]
    pub retries: u32,
}

const fn twenty_million() -> u64 {
    20_000_000
}

impl CameraSettings for HttpCamera {
    fn check(&self) -> Result<(), String> {
        if self.max_bytes == 0 || self.max_bytes > 100_000_000 {
            return Err(format!("found max_bytes = {}, wanted 1 to 100000000", self.max_bytes));
        }
        check_url(&self.url)
    }

    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        let authorization = self.authorization_file.as_deref().map(read_secret).transpose()?;
        Ok(Box::new(OpenHttpCamera { settings: self.clone(), authorization, last: Vec::new() }))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }

    fn retries(&mut self) -> Option<&mut u32> {
        Some(&mut self.retries)
    }

    fn discards_frames(&self) -> bool {
        true
    }
}

/// An open camera.
struct OpenHttpCamera {
    settings: HttpCamera,
    authorization: Option<String>,
    /// The latest photograph, which the next one must not repeat.
    last: Vec<u8>,
}

impl OpenHttpCamera {
    fn attempt(&mut self) -> Result<Photo, RigError> {
        let settings = &self.settings;
        let request = Request {
            device: "camera",
            url: &settings.url,
            authorization: self.authorization.as_deref(),
            deadline: Instant::now() + settings.timeout_s.duration(),
            max_bytes: settings.max_bytes,
        };
        let mut discarded = Vec::new();
        for _ in 0..settings.discard_frames {
            discarded = request.send(None)?;
        }
        let bytes = request.send(None)?;
        picture::check(&bytes).map_err(|problem| request.error(problem))?;
        // Sensor noise makes two fresh frames differ.
        if bytes == self.last || bytes == discarded {
            return Err(request.error("it gave the same frame again".to_owned()));
        }
        self.last.clone_from(&bytes);
        Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
    }
}

impl Camera for OpenHttpCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        retry::retry(self.settings.retries, || {
            // The camera may still be busy with the failed frame.
            self.attempt().inspect_err(|_| std::thread::sleep(Duration::from_millis(100)))
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::{BufRead, BufReader, Read, Write};
    use std::net::{TcpListener, TcpStream};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;

    use super::*;
    use crate::picture::tests::jpeg;

    /// A request as a device sees it: method and path, headers, body.
    pub(crate) struct Asked {
        pub(crate) line: String,
        pub(crate) headers: String,
        pub(crate) body: String,
    }

    /// A device that answers each request by `answer`, which gets the number of the request and the socket.
    /// Lives as long as the test process.
    pub(crate) fn device(answer: impl Fn(usize, &Asked, &mut TcpStream) + Send + Sync + 'static) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let (count, answer) = (Arc::new(AtomicUsize::new(0)), Arc::new(answer));
        thread::spawn(move || {
            for socket in listener.incoming() {
                let mut socket = socket.unwrap();
                let (count, answer) = (Arc::clone(&count), Arc::clone(&answer));
                thread::spawn(move || {
                    if let Some(asked) = read(&socket) {
                        answer(count.fetch_add(1, Ordering::SeqCst), &asked, &mut socket);
                    }
                });
            }
        });
        url
    }

    fn read(socket: &TcpStream) -> Option<Asked> {
        let mut reader = BufReader::new(socket);
        let mut asked = Asked { line: String::new(), headers: String::new(), body: String::new() };
        reader.read_line(&mut asked.line).ok()?;
        // A client of a broker that had this port before, in another test, may try to come back.
        asked.line.trim_end().ends_with(" HTTP/1.1").then_some(())?;
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line).ok()? <= 2 {
                break;
            }
            asked.headers += &line;
        }
        let length = asked.headers.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            name.eq_ignore_ascii_case("content-length").then(|| value.trim().parse().ok())?
        });
        let mut body = vec![0; length.unwrap_or(0)];
        reader.read_exact(&mut body).ok()?;
        asked.body = String::from_utf8(body).ok()?;
        Some(asked)
    }

    /// Answers with `body` and closes the connection.
    pub(crate) fn reply(socket: &mut TcpStream, body: &[u8]) {
        let head = format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
        // The client may have closed the connection.
        let _ = socket.write_all(&[head.as_bytes(), body].concat());
    }

    fn camera(url: &str, more: &str) -> Box<dyn Camera> {
        let settings: HttpCamera = toml::from_str(&format!("url = {url:?}\nretries = 0\n{more}")).unwrap();
        settings.check().unwrap();
        settings.open().unwrap()
    }

    fn fails(more: &str, answer: impl Fn(usize, &Asked, &mut TcpStream) + Send + Sync + 'static) -> String {
        let url = device(answer);
        let error = camera(&url, more).photograph().unwrap_err().to_string();
        assert!(error.starts_with(&format!("camera ({url}")), "{error}");
        error
    }

    #[test]
    fn throws_away_the_frames_that_the_camera_kept() {
        let url = device(|number, _, socket| reply(socket, &jpeg(number)));
        let mut camera = camera(&format!("{url}/capture"), "discard_frames = 2");
        assert_eq!(camera.photograph().unwrap().bytes, jpeg(2));
        assert_eq!(camera.photograph().unwrap().bytes, jpeg(5));
    }

    #[test]
    fn a_camera_that_repeats_itself_is_refused() {
        let error = fails("discard_frames = 1", |_, _, socket| reply(socket, &jpeg(7)));
        assert!(error.contains("the same frame again"), "{error}");
        let url = device(|_, _, socket| reply(socket, &jpeg(7)));
        let mut camera = camera(&url, "discard_frames = 0");
        camera.photograph().unwrap();
        assert!(camera.photograph().unwrap_err().to_string().contains("the same frame again"));
    }

    #[test]
    fn what_is_not_a_whole_photograph_is_refused() {
        let page = b"<html><body>Please log in</body></html>";
        let error = fails("discard_frames = 0", |_, _, socket| reply(socket, page));
        assert!(error.contains("<html><body>Please"), "{error}");
        // Half of the promised bytes, then the line is cut.
        let error = fails("discard_frames = 0", |_, _, socket| {
            let head = format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n", jpeg(1).len());
            let _ = socket.write_all(&[head.as_bytes(), &jpeg(1)[..300]].concat());
        });
        assert!(!error.contains("wanted a JPEG"), "{error}");
        // Half a file as if it were whole.
        let error = fails("discard_frames = 0", |_, _, socket| reply(socket, &jpeg(1)[..300]));
        assert!(error.contains("picture is damaged"), "{error}");
        // With an end marker put back, as some bridges do; the next picture is whole.
        let url = device(|number, _, socket| {
            let whole = jpeg(number);
            let half = [&whole[..whole.len() * 3 / 4], &[0xff, 0xd9]].concat();
            reply(socket, if number == 0 { &half } else { &whole });
        });
        let text = format!("url = {url:?}\ndiscard_frames = 0\nretries = 1\n");
        let settings: HttpCamera = toml::from_str(&text).unwrap();
        assert_eq!(settings.open().unwrap().photograph().unwrap().bytes, jpeg(1));
        let error = fails("discard_frames = 0", |_, _, socket| {
            let _ = socket.write_all(b"HTTP/1.1 500 Internal Server Error\r\nContent-Length: 0\r\n\r\n");
        });
        assert!(error.contains("500"), "{error}");
    }

    #[test]
    fn a_camera_that_hangs_drips_or_never_ends_is_given_up() {
        let quick = "discard_frames = 0\ntimeout_s = 0.3\n";
        fails(quick, |_, _, _| thread::sleep(Duration::from_secs(60)));
        // A byte at a time, so that no single read is late.
        fails(quick, |_, _, socket| {
            let _ = socket.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n");
            while socket.write_all(b"x").is_ok() {
                thread::sleep(Duration::from_millis(20));
            }
        });
        // A stream of frames instead of one.
        let error = fails("discard_frames = 0\nmax_bytes = 100000", |_, _, socket| {
            let _ = socket.write_all(b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n");
            while socket.write_all(&jpeg(1)).is_ok() {}
        });
        assert!(error.contains("limit"), "{error}");
    }

    #[test]
    fn a_camera_that_fails_once_is_asked_again_and_secrets_are_sent_but_not_shown() {
        let folder = tempfile::tempdir().unwrap();
        let secret = folder.path().join("secret");
        std::fs::write(&secret, "Bearer abc\n").unwrap();
        let url = device(|number, asked, socket| {
            if number > 0 && asked.headers.to_lowercase().contains("authorization: bearer abc") {
                reply(socket, &jpeg(number));
            }
        });
        let text = format!("url = {url:?}\ndiscard_frames = 0\nauthorization_file = {secret:?}\n");
        let settings: HttpCamera = toml::from_str(&text).unwrap();
        assert_eq!(settings.open().unwrap().photograph().unwrap().bytes, jpeg(1));
        assert!(!toml::to_string(&settings).unwrap().contains("abc"));
    }

    #[test]
    fn no_error_of_a_camera_shows_the_secrets_of_its_address() {
        let url = device(|_, _, socket| reply(socket, b"no picture \x1b[2J"));
        let secret = url.replace("http://", "http://admin:s3cret@") + "/shot?token=abc123";
        let shown = url.replace("http://", "http://***@") + "/shot?token=***";
        let error = camera(&secret, "discard_frames = 0").photograph().unwrap_err().to_string();
        assert!(error.starts_with(&format!("camera ({shown})")), "{error}");
        assert!(!error.contains("s3cret") && !error.contains("abc123") && !error.contains('\x1b'), "{error}");
        // Addresses that cannot be asked, and one where nothing answers.
        for url in
            ["ftp://admin:s3cret@c/", "admin:s3cret@c/?t=abc123", "http:///?t=abc123", "http://a:s3 cret@c/"]
        {
            let error = check_url(url).unwrap_err();
            assert!(!error.contains("cret") && !error.contains("abc123"), "{error}");
        }
        let url = "http://admin:s3cret@127.0.0.1:1/?t=abc123";
        let error = camera(url, "discard_frames = 0").photograph().unwrap_err().to_string();
        assert!(!error.contains("s3cret") && !error.contains("abc123"), "{error}");
    }

    #[test]
    fn addresses_are_checked() {
        for url in ["", "192.168.1.7/capture", "ftp://camera", "http://", "http:///capture"] {
            assert!(check_url(url).is_err(), "{url}");
        }
        assert_eq!(check_url("http://camera.local/x"), Ok(()));
        let https = check_url("https://camera.local/x");
        if cfg!(feature = "tls") {
            assert_eq!(https, Ok(()));
        } else {
            assert!(https.unwrap_err().contains("need the feature `tls`"));
        }
    }
}
