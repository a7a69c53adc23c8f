//! What a studio refuses, asked as an attacker asks: by bytes on a connection.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use tropism_lab::evolve::EvolvePlan;
use tropism_lab::fit::FitPlan;
use tropism_lab::grow::GrowPlan;
use tropism_lab::{RunConfig, RunPlan, Silent, Workflow};
use tropism_studio::{StudioPlan, Welcome};

/// A studio that is served until the test ends.
struct Served {
    address: SocketAddr,
    welcome: Welcome,
    folder: tempfile::TempDir,
}

fn served(change: impl FnOnce(&mut StudioPlan, &Path)) -> Served {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = StudioPlan {
        folder: Some(folder.path().to_owned()),
        listen: "127.0.0.1:0".parse().unwrap(),
        hosts: vec!["beans.example.org".to_owned()],
        ask_token: false,
        read_only: false,
        demo: false,
        #[cfg(feature = "tls")]
        tls: None,
        program: PathBuf::from("/bin/false"),
    };
    change(&mut plan, folder.path());
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        let printed = tropism_studio::serve(&plan, |welcome| sender.send(Ok(welcome.clone())).unwrap());
        if let Err(error) = printed {
            let _ = sender.send(Err(error.to_string()));
        }
    });
    let welcome = receiver.recv_timeout(Duration::from_secs(20)).unwrap().unwrap();
    let address = welcome.address.trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
    Served { address, welcome, folder }
}

impl Served {
    /// Status, head and body of the answer to `head`, whose lines end as HTTP asks for, and `body`.
    fn ask(&self, head: &str, body: &str) -> (u16, String, String) {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let head = head.trim().replace('\n', "\r\n");
        write!(stream, "{head}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}", body.len())
            .unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.split(' ').nth(1).and_then(|word| word.parse().ok()).unwrap_or(0);
        let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
        (status, head.to_ascii_lowercase(), body.to_owned())
    }

    fn get(&self, path: &str) -> (u16, String, String) {
        self.ask(&format!("GET {path} HTTP/1.1\nHost: {}", self.address), "")
    }

    fn post(&self, path: &str, more: &str, body: &str) -> (u16, String, String) {
        self.ask(&format!("POST {path} HTTP/1.1\nHost: {}\n{more}", self.address), body)
    }

    /// The word that a page sends with each change.
    fn csrf(&self, cookie: &str) -> String {
        let head = format!("GET /api/session HTTP/1.1\nHost: {}\nCookie: {cookie}", self.address);
        let (_, _, body) = self.ask(&head, "");
        body.split("\"csrf\":\"").nth(1).unwrap_or_default().split('"').next().unwrap_or_default().to_owned()
    }

    fn log_in(&self, token: &str) -> (u16, String) {
        let (status, head, _) = self.post("/api/login", "", &format!("{{\"token\":\"{token}\"}}"));
        let cookie = head.split("set-cookie: ").nth(1).unwrap_or_default();
        (status, cookie.split(';').next().unwrap_or_default().to_owned())
    }
}

/// A run of a few steps, and an evolution of a few generations, in the folder.
fn with_work(_: &mut StudioPlan, folder: &Path) {
    let mut config = RunConfig::default();
    config.task.max_steps = 3;
    // Small photographs are quick.
    let scene = &mut config.rig.greenhouse.as_mut().unwrap().scene;
    (scene.width, scene.height) = (324, 243);
    RunPlan { out: folder.join("bean"), config, ..RunPlan::default() }.execute(&Silent).unwrap();
    let tracks = folder.join("tracks");
    GrowPlan { plants: 2, out: tracks.clone(), ..GrowPlan::default() }.execute(&Silent).unwrap();
    let model = folder.join("model.json");
    FitPlan { tracks: vec![tracks], out: model.clone(), ..FitPlan::default() }.execute(&Silent).unwrap();
    let mut plan =
        EvolvePlan { model, out: folder.join("evolution"), trial_plants: 2, ..EvolvePlan::default() };
    (plan.evolution.runs, plan.evolution.generations) = (2, 3);
    plan.evolution.neat.population = 10;
    plan.execute(&Silent).unwrap();
}

/// Every route that reads.
const READS: [&str; 39] = [
    "/",
    "/run",
    "/evolution",
    "/work",
    "/draw",
    "/tune",
    "/compare",
    "/login",
    "/assets/studio.js",
    "/assets/style.css",
    "/api/session",
    "/api/items",
    "/api/events",
    "/api/work?at=bean",
    "/api/tags?at=bean",
    "/api/run?at=bean",
    "/api/run/events?at=bean",
    "/api/run/photo?at=bean&name=000000.jpg",
    "/api/run/stem?at=bean&step=0",
    "/api/run/prediction?at=bean",
    "/api/evolution?at=evolution",
    "/api/evolution/events?at=evolution",
    "/api/evolution/champion?at=evolution",
    "/api/models",
    "/api/task?drawing={%22targets%22:[[0,6]]}",
    "/api/compare?at=evolution",
    "/api/tune?at=bean",
    "/nothing",
    "/api/reach",
    "/begin",
    "/metrics",
    "/api/run/photographs?at=bean",
    "/api/forms",
    "/api/rigs",
    "/api/rig?at=greenhouse",
    "/api/begin/command?form={%22form%22:%22run%22,%22values%22:{%22controller%22:%22greedy%22,%22rig%22:%22greenhouse%22,%22out%22:%22a%22}}",
    "/api/queue/log?number=1",
    "/api/file?at=model.json",
    "/api/stream?to=[{%22key%22:%22a%22,%22topic%22:%22items%22}]",
];

fn is_stream(path: &str) -> bool {
    path.contains("events") || path.contains("stream")
}

/// Every route that changes.
const CHANGES: [&str; 19] = [
    "/api/evolution/extend",
    "/api/run/stop",
    "/api/run/safe-state",
    "/api/run/resume",
    "/api/evolution/pause",
    "/api/evolution/resume",
    "/api/draw/evolve",
    "/api/draw/save",
    "/api/queue/remove",
    "/api/queue/cancel",
    "/api/begin",
    "/api/rig",
    "/api/rig/calibrate",
    "/api/run/note",
    "/api/rename",
    "/api/delete",
    "/api/tags",
    "/api/tune/write",
    "/api/logout",
];

#[test]
fn a_foreign_host_is_refused_on_every_route() {
    let studio = served(|_, _| {});
    for host in ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example:8217", "[::1", ""] {
        for path in READS {
            let (status, ..) = studio.ask(&format!("GET {path} HTTP/1.1\nHost: {host}"), "");
            assert!(matches!(status, 400 | 421), "{path} of {host:?}: {status}");
        }
        for path in CHANGES {
            let (status, ..) = studio.ask(&format!("POST {path} HTTP/1.1\nHost: {host}"), "{}");
            assert!(matches!(status, 400 | 421), "{path} of {host:?}: {status}");
        }
    }
    for host in ["localhost:1", "beans.example.org", "greenhouse.local", "192.168.0.7:8217"] {
        assert_eq!(studio.ask(&format!("GET / HTTP/1.1\nHost: {host}"), "").0, 200, "{host}");
    }
    let two = format!("GET / HTTP/1.1\nHost: {}\nHost: evil.example", studio.address);
    assert_eq!(studio.ask(&two, "").0, 400);
}

#[test]
fn a_post_of_another_site_is_refused_on_every_route() {
    let studio = served(|_, _| {});
    let csrf = studio.csrf("");
    assert!(csrf.len() > 20);
    let own = format!("X-Tropism-Csrf: {csrf}");
    for path in CHANGES {
        for headers in [
            String::new(),
            "X-Tropism-Csrf: guess".to_owned(),
            format!("{own}\nOrigin: http://evil.example"),
            format!("{own}\nOrigin: null"),
            format!("{own}\nSec-Fetch-Site: cross-site"),
            format!("{own}\nSec-Fetch-Site: same-site"),
        ] {
            let (status, _, body) = studio.post(path, &headers, "{}");
            assert_eq!(status, 403, "{path} with {headers:?}: {body}");
        }
    }
    let good = format!("{own}\nOrigin: http://{}\nSec-Fetch-Site: same-origin", studio.address);
    let (status, _, body) =
        studio.post("/api/draw/save", &good, "{\"name\":\"t\",\"drawing\":{\"targets\":[[1,6]]}}");
    assert_eq!(status, 200, "{body}");
    assert!(studio.folder.path().join("t.toml").exists());
    let (_, head, _) = studio.get("/api/session");
    assert!(!head.contains("access-control-allow"), "{head}");
}

#[test]
fn a_get_of_another_site_starts_no_work() {
    let studio = served(|_, _| {});
    for path in READS.iter().filter(|path| path.starts_with("/api/") && !is_stream(path)) {
        for site in ["cross-site", "same-site"] {
            let head = format!("GET {path} HTTP/1.1\nHost: {}\nSec-Fetch-Site: {site}", studio.address);
            assert_eq!(studio.ask(&head, "").0, 403, "{path} from {site}");
        }
        let head = format!("GET {path} HTTP/1.1\nHost: {}\nSec-Fetch-Site: same-origin", studio.address);
        assert_ne!(studio.ask(&head, "").0, 403, "{path}");
    }
}

#[test]
fn a_stream_ends_with_its_session() {
    let studio = served(|plan, _| plan.ask_token = true);
    let tokens = studio.welcome.tokens.clone().unwrap();
    let (_, cookie) = studio.log_in(&tokens.look);
    let mut stream = TcpStream::connect(studio.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    write!(stream, "GET /api/events HTTP/1.1\r\nHost: {}\r\nCookie: {cookie}\r\n\r\n", studio.address)
        .unwrap();
    let mut byte = [0];
    stream.read_exact(&mut byte).unwrap();
    let csrf = studio.csrf(&cookie);
    let (status, ..) = studio.post("/api/logout", &format!("Cookie: {cookie}\nX-Tropism-Csrf: {csrf}"), "");
    assert_eq!(status, 200);
    let mut rest = Vec::new();
    let began = std::time::Instant::now();
    // The body ends; the connection may stay.
    while !String::from_utf8_lossy(&rest).contains("0\r\n\r\n") {
        let mut part = [0; 1024];
        match stream.read(&mut part) {
            Ok(count @ 1..) => rest.extend_from_slice(&part[..count]),
            _ => break,
        }
        assert!(began.elapsed() < Duration::from_secs(60), "the stream goes on");
    }
}

#[test]
fn no_path_leads_out_of_the_folder() {
    let studio = served(with_work);
    let secret = studio.folder.path().parent().unwrap().join("secret-beside-the-folder.jpg");
    std::fs::write(&secret, b"\xff\xd8secret").unwrap();
    std::fs::create_dir_all(studio.folder.path().join(".tropism-studio")).unwrap();
    std::fs::write(studio.folder.path().join(".tropism-studio/access.json"), "secret").unwrap();
    let out = [
        "../",
        "..%2f",
        "%2e%2e%2f",
        "..%5c",
        "bean/../../",
        "/",
        "%2f",
        "//",
        "bean%00",
        ".tropism-studio/",
        "%2etropism-studio",
    ];
    for at in out {
        for path in [
            "work",
            "run",
            "run/events",
            "run/prediction",
            "evolution",
            "evolution/champion",
            "tune",
            "compare",
        ] {
            let (status, _, body) = studio.get(&format!("/api/{path}?at={at}etc"));
            assert!(
                (400..500).contains(&status) && !body.contains("secret"),
                "{path}?at={at}: {status} {body}"
            );
        }
        let name = "secret-beside-the-folder.jpg";
        for address in [
            format!("/api/run/photo?at={at}&name={name}"),
            format!("/api/run/photo?at=bean&name={at}{name}"),
            format!("/api/run/photo?at={at}&name=access.json"),
            format!("/api/compare/file?at=evolution&name={at}{name}"),
            format!("/assets/{at}{name}"),
        ] {
            let (status, _, body) = studio.get(&address);
            assert!(status >= 400 && !body.contains("secret\""), "{address}: {status}");
            assert!(!body.starts_with("\u{fffd}\u{fffd}secret"), "{address}");
        }
    }
    std::fs::remove_file(secret).unwrap();
    let (status, head, _) = studio.get("/api/run/photo?at=bean&name=000000.jpg");
    assert!(status == 200 && head.contains("content-type: image/jpeg"), "{head}");
}

#[test]
fn scripts_in_names_are_text() {
    let name = "<img src=x onerror=alert(1)>";
    let studio = served(|plan, folder| {
        with_work(plan, folder);
        std::fs::rename(folder.join("bean"), folder.join(name)).unwrap();
    });
    let (status, head, body) = studio.get("/api/items");
    assert!(status == 200 && body.contains(name), "{body}");
    // JSON is never taken for a page, and a page runs no script of its own text.
    assert!(
        head.contains("content-type: application/json") && head.contains("x-content-type-options: nosniff"),
        "{head}"
    );
    for path in READS.iter().filter(|path| !is_stream(path)) {
        let (_, head, _) = studio.get(path);
        for wanted in [
            "x-content-type-options: nosniff",
            "content-security-policy: default-src 'none'",
            "referrer-policy: no-referrer",
        ] {
            assert!(head.contains(wanted), "{path}: {head}");
        }
        assert!(!head.contains("script-src 'unsafe"), "{path}: {head}");
    }
    let csrf = format!("X-Tropism-Csrf: {}", studio.csrf(""));
    let body = "{\"name\":\"<b>\",\"drawing\":{\"targets\":[[1,6]]}}";
    assert_eq!(studio.post("/api/draw/save", &csrf, body).0, 400);
}

#[test]
fn large_and_slow_bodies_are_refused() {
    let studio = served(|_, _| {});
    let csrf = studio.csrf("");
    let mut stream = TcpStream::connect(studio.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let size = 1_u64 << 30;
    let head = format!(
        "POST /api/draw/save HTTP/1.1\r\nHost: {}\r\nX-Tropism-Csrf: {csrf}\r\nContent-Length: {size}\r\n\r\n",
        studio.address
    );
    stream.write_all(head.as_bytes()).unwrap();
    let piece = vec![b' '; 1 << 16];
    let mut sent = 0;
    while sent < size {
        match stream.write(&piece) {
            Ok(count) => sent += count as u64,
            Err(_) => break,
        }
        if sent > 64 << 20 {
            break;
        }
    }
    assert!(sent < 64 << 20, "{sent} bytes of a body were taken");
    let mut answer = [0; 12];
    if stream.read_exact(&mut answer).is_ok() {
        assert_eq!(&answer, b"HTTP/1.1 413");
    }
    assert_eq!(studio.get("/").0, 200);
}

#[test]
fn silent_connections_keep_nobody_out() {
    let studio = served(|_, _| {});
    let mut silent = Vec::new();
    // Ten thousand in all; no more at a time than this process may have open.
    for number in 0..10_000 {
        match TcpStream::connect(studio.address) {
            Ok(mut stream) => {
                let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost: 127");
                silent.push(stream);
            }
            Err(error) => assert_ne!(error.kind(), ErrorKind::ConnectionRefused, "after {number}"),
        }
        if silent.len() > 450 {
            silent.remove(0);
        }
        if number % 2_500 == 2_499 {
            let began = Instant::now();
            assert_eq!(studio.get("/").0, 200, "after {number} silent connections");
            assert!(began.elapsed() < Duration::from_secs(10));
        }
    }
}

#[test]
fn nothing_is_shown_without_a_token() {
    let studio = served(|plan, folder| {
        plan.ask_token = true;
        tropism_studio::new_tokens(folder).unwrap();
    });
    for path in READS.iter().filter(|path| path.starts_with("/api/") && **path != "/api/session") {
        assert_eq!(studio.get(path).0, 401, "{path}");
    }
    for path in CHANGES {
        assert_eq!(studio.post(path, "", "{}").0, 401, "{path}");
    }
    let (status, head, _) = studio.get("/run");
    assert!(status == 303 && head.contains("location: login?to=run"), "{head}");
    let (_, _, body) = studio.get("/api/session");
    assert!(body.contains("\"session\":null"), "{body}");
    for cookie in ["x", "", "../..", "aaaaaaaaaaaaaaaaaaaaaaaaaa"] {
        let head = format!(
            "GET /api/items HTTP/1.1\nHost: {0}\nCookie: tropism-studio-{1}={cookie}",
            studio.address,
            studio.address.port()
        );
        assert_eq!(studio.ask(&head, "").0, 401);
    }
}

#[test]
fn tokens_open_what_they_may_and_guessing_is_slow() {
    let studio = served(|plan, _| plan.listen = "0.0.0.0:0".parse().unwrap());
    // Another address than loopback made tokens by itself; the test asks by loopback all the same.
    let address: SocketAddr = format!("127.0.0.1:{}", studio.address.port()).parse().unwrap();
    let studio = Served { address, ..studio };
    let tokens = studio.welcome.tokens.clone().unwrap();
    assert!(studio.welcome.asks_for_token && studio.welcome.qr().unwrap().lines().count() > 10);
    assert!(studio.welcome.link().ends_with(&format!("/login#{}", tokens.change)));
    let (status, cookie) = studio.log_in(&tokens.look);
    assert_eq!(status, 200);
    let (_, head, _) = studio.post("/api/login", "", &format!("{{\"token\":\"{}\"}}", tokens.change));
    assert!(head.contains("httponly; samesite=strict; path=/"), "{head}");
    let change = |cookie: &str| {
        let headers = format!("Cookie: {cookie}\nX-Tropism-Csrf: {}", studio.csrf(cookie));
        studio.post("/api/draw/save", &headers, "{\"name\":\"t\",\"drawing\":{\"targets\":[[1,6]]}}").0
    };
    assert_eq!(change(&cookie), 403, "who may look only changes nothing");
    let (_, cookie) = studio.log_in(&tokens.change);
    assert_eq!(change(&cookie), 200);
    let (_, other) = studio.log_in(&tokens.change);
    let stolen = format!("Cookie: {cookie}\nX-Tropism-Csrf: {}", studio.csrf(&other));
    assert_eq!(studio.post("/api/draw/save", &stolen, "{}").0, 403, "the word of another session");
    let statuses: Vec<u16> = (0..8).map(|_| studio.log_in("guess").0).collect();
    assert_eq!(statuses[..4], [403; 4], "{statuses:?}");
    assert!(statuses[4..].iter().all(|&status| status == 429), "{statuses:?}");
    assert_eq!(studio.log_in(&tokens.change).0, 429);
    // Who is in stays in.
    assert_eq!(change(&cookie), 200);
}

#[test]
fn work_is_renamed_and_put_away() {
    let studio = served(with_work);
    let own = format!("X-Tropism-Csrf: {}", studio.csrf(""));
    let ask = |path: &str, at: &str, name: &str| {
        studio.post(path, &own, &format!("{{\"at\":\"{at}\",\"name\":\"{name}\"}}"))
    };
    for (at, name) in [("", "a"), ("../x", "a"), ("bean", "evolution"), ("bean", "../a"), ("tracks", "a")] {
        assert!((400..500).contains(&ask("/api/rename", at, name).0), "{at} to {name}");
    }
    assert_eq!(ask("/api/rename", "bean", "sprout").0, 200);
    assert!(studio.folder.path().join("sprout/run.toml").exists());
    let tag = |at: &str, tags: &str| {
        studio.post("/api/tags", &own, &format!("{{\"at\":\"{at}\",\"tags\":[{tags}]}}"))
    };
    let (status, _, body) = tag("sprout", "\"first\",\"batch-2\"");
    assert!(status == 200 && body.contains("[\"batch-2\",\"first\"]"), "{body}");
    assert!(studio.get("/api/tags?at=sprout").2.contains("\"batch-2\",\"first\""));
    for (at, tags) in [("sprout", "\"two words\""), ("tracks", "\"a\""), ("../x", "\"a\"")] {
        assert!((400..500).contains(&tag(at, tags).0), "{at} {tags}");
    }
    assert_eq!(ask("/api/delete", "sprout", "bean").0, 400, "the name is asked for again");
    assert!(studio.folder.path().join("sprout/run.toml").exists());
    // All its photographs first, as an archive that begins and ends as one.
    let (status, head, body) = studio.get("/api/run/photographs?at=sprout");
    assert!(status == 200 && head.contains("sprout-photographs.zip"), "{head}");
    assert!(body.contains("PK\u{3}\u{4}") && body.contains("sprout/000003.jpg"), "{}", body.len());
    let (status, _, body) = ask("/api/delete", "sprout", "sprout");
    assert!(status == 200 && body.contains(".tropism-studio/deleted/sprout-"), "{body}");
    let kept = body.split('"').find(|part| part.starts_with(".tropism-studio/")).unwrap();
    assert!(studio.folder.path().join(kept).join("run.toml").exists());
    assert!(!studio.get("/api/items").2.contains("sprout"));
}

#[test]
fn a_program_reads_numbers_with_its_token() {
    let studio = served(|plan, folder| {
        with_work(plan, folder);
        plan.ask_token = true;
    });
    let tokens = studio.welcome.tokens.clone().unwrap();
    let ask = |token: &str, path: &str| {
        let head = format!("GET {path} HTTP/1.1\nHost: {}\nAuthorization: Bearer {token}", studio.address);
        studio.ask(&head, "")
    };
    assert_eq!(studio.get("/metrics").0, 401);
    assert_eq!(ask("guess", "/metrics").0, 401);
    let (status, head, body) = ask(&tokens.look, "/metrics");
    assert!(status == 200 && head.contains("content-type: text/plain; version=0.0.4"), "{head}");
    assert!(
        body.contains("# TYPE tropism_run_tip_height_cm gauge\ntropism_run_tip_height_cm{run=\"bean\"} "),
        "{body}"
    );
    assert!(body.contains("tropism_run_lamp_lit{run=\"bean\",lamp=\"left\"} 0"), "{body}");
    // For nothing else, and for no change.
    assert_eq!(ask(&tokens.look, "/api/items").0, 401);
    let head =
        format!("POST /metrics HTTP/1.1\nHost: {}\nAuthorization: Bearer {}", studio.address, tokens.change);
    assert_eq!(studio.ask(&head, "{}").0, 403);
}

#[test]
fn a_studio_for_looking_changes_nothing() {
    let studio = served(|plan, _| plan.read_only = true);
    let csrf = format!("X-Tropism-Csrf: {}", studio.csrf(""));
    for path in CHANGES.iter().filter(|path| **path != "/api/logout") {
        assert_eq!(studio.post(path, &csrf, "{}").0, 403, "{path}");
    }
}

#[test]
fn pages_answer_what_they_are_asked() {
    let studio = served(with_work);
    for path in READS.iter().filter(|path| !is_stream(path)) {
        let (status, _, body) = studio.get(path);
        let wanted = match *path {
            "/nothing" | "/api/run/prediction?at=bean" | "/api/queue/log?number=1" => 400..500,
            _ => 200..201,
        };
        assert!(wanted.contains(&status), "{path}: {status} {body}");
    }
    let (_, _, champion) = studio.get("/api/evolution/champion?at=evolution");
    assert!(champion.contains("<svg") && champion.contains("\"paths\":[{"), "{champion}");
    for (values, wanted) in [
        ("{\"controller\":\"evolution/champion.json\",\"rig\":\"greenhouse\",\"out\":\"a\"}", 200),
        ("{\"controller\":\"--studio\",\"rig\":\"greenhouse\",\"out\":\"a\"}", 400),
        ("{\"controller\":\"../x.json\",\"rig\":\"greenhouse\",\"out\":\"a\"}", 404),
        ("{\"controller\":\"greedy\",\"rig\":\"greenhouse\",\"out\":\"../a\"}", 400),
        ("{\"controller\":\"greedy\",\"rig\":\"greenhouse\",\"out\":\"bean\"}", 400),
        ("{\"controller\":\"greedy\",\"rig\":\"greenhouse\"}", 400),
    ] {
        let form = format!("{{\"form\":\"run\",\"values\":{values}}}").replace('"', "%22");
        let (status, _, body) = studio.get(&format!("/api/begin/command?form={form}"));
        assert_eq!(status, wanted, "{values}: {body}");
    }
    for bad in [
        "/api/try?who=you&drawing=x&seed=1",
        "/api/try?who=you&drawing={%22targets%22:[[0,6]]}&seed=1&lights=lx",
        "/api/task?drawing={%22targets%22:[]}",
    ] {
        assert_eq!(studio.get(bad).0, 400, "{bad}");
    }
    let (status, _, body) =
        studio.get("/api/try?who=you&drawing={%22targets%22:[[0,6]]}&seed=1&lights=llrr&from=2");
    assert!(status == 200 && body.contains("\"from\":2") && body.matches("\"stem\"").count() == 3, "{body}");
}
