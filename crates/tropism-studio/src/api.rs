//! What pages ask for: one function a route.

mod evolutions;
mod jobs;
mod route;
mod runs;
mod walls;
#[cfg(all(test, feature = "schema"))]
mod types;

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router, middleware};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tropism_lab::stop::StopPlan;
use tropism_lab::{Monitor, Workflow};

use self::route::{Answer, Done, Routes, Sent};
use crate::access::{LogInError, Right, Session};
use crate::error::Refusal;
use crate::found::{Kind, resolve_kind};
use crate::gate::gate;
use crate::items::{ItemsNews, Overview, name_of};
use crate::stream::EventStream;
use crate::wire::Peer;
use crate::{Studio, assets, items, metrics, stream};

/// The largest body of a request.
const MAX_BODY: usize = 64 * 1024;

/// How long a body may take to come.
const BODY_COMES: Duration = Duration::from_secs(10);

/// How long the answer to a stop waits for the end; the step that is under way may take longer.
const STOP_WAIT: Duration = Duration::from_secs(4);

/// Width of a small photograph, in pixels.
const SMALL: usize = 160;

/// Quality of a small photograph.
const SMALL_QUALITY: u8 = 70;

type Shared = State<Arc<Studio>>;

/// All routes, which nothing keeps yet from those who may not ask.
fn routes() -> Routes {
    let page = |name: &'static str| get(async move |headers: HeaderMap| assets::page(name, &headers));
    Routes::default()
        .route("/", page("index.html"))
        .route("/run", get(runs::run_page))
        .route("/evolution", get(evolutions::evolution_page))
        .route("/work", page("work.html"))
        .route("/draw", page("draw.html"))
        .route("/begin", page("begin.html"))
        .route("/devices", page("devices.html"))
        .route("/tune", page("tune.html"))
        .route("/compare", page("compare.html"))
        .route("/wall", page("wall.html"))
        .route("/login", page("login.html"))
        .route("/assets/{name}", get(assets::asset))
        .typed::<(), About>("Gets", "/api/session", get(session))
        .typed::<LogIn, Done>("Posts", "/api/login", post(log_in))
        .typed::<(), Done>("Posts", "/api/logout", post(log_out))
        .route("/api/events", get(folder_events))
        .route("/api/stream", get(many_events))
        .get("/api/items", folder_items)
        .route("/metrics", get(metrics_text))
        .get("/api/work", jobs::work)
        .get("/api/run", runs::run_about)
        .route("/api/run/events", get(runs::run_events))
        .route("/api/run/photo", get(runs::photo))
        .route("/api/run/photographs", get(runs::photographs))
        .get("/api/run/stem", runs::stem)
        .post("/api/rename", jobs::rename)
        .post("/api/delete", jobs::delete)
        .get("/api/tags", jobs::tags)
        .post("/api/tags", jobs::set_tags)
        .get("/api/run/prediction", runs::prediction)
        .post("/api/run/stop", runs::stop)
        .post("/api/run/safe-state", runs::safe_state)
        .post("/api/run/resume", runs::resume)
        .get("/api/evolution", evolutions::evolution_about)
        .route("/api/evolution/events", get(evolutions::evolution_events))
        .get("/api/evolution/champion", evolutions::champion)
        .post("/api/evolution/pause", evolutions::pause)
        .post("/api/evolution/resume", evolutions::go_on)
        .post("/api/evolution/extend", evolutions::extend)
        .get("/api/reach", evolutions::reach)
        .get("/api/models", evolutions::models)
        .get("/api/try", evolutions::try_out)
        .get("/api/task", evolutions::task_text)
        .post("/api/draw/evolve", evolutions::draw_evolve)
        .post("/api/draw/save", evolutions::draw_save)
        .post("/api/queue/remove", jobs::queue_remove)
        .post("/api/queue/cancel", jobs::queue_cancel)
        .get("/api/queue/log", jobs::queue_log)
        .get("/api/forms", jobs::forms)
        .get("/api/begin/command", jobs::begin_command)
        .post("/api/begin", jobs::begin_work)
        .get("/api/rigs", jobs::rigs)
        .get("/api/rig", jobs::rig_about)
        .post("/api/rig", jobs::rig_wish)
        .route("/api/rig/photo", get(jobs::rig_photo))
        .post("/api/rig/calibrate", jobs::rig_calibrate)
        .post("/api/run/note", runs::note)
        .route("/api/file", get(jobs::made_file))
        .get("/api/compare", jobs::compared)
        .route("/api/compare/file", get(jobs::compared_file))
        .get("/api/tune", jobs::tune_begin)
        .get("/api/tune/look", jobs::tune_look)
        .post("/api/tune/write", jobs::tune_write)
        .get("/api/walls", walls::walls)
        .get("/api/wall", walls::drawn)
        .get("/api/wall/try", walls::try_out)
        .get("/api/wall/watched", walls::watched)
        .post("/api/wall/save", walls::save)
}

/// All routes.
pub(crate) fn router(studio: Arc<Studio>) -> Router {
    routes().router.layer(middleware::from_fn_with_state(studio.clone(), gate)).with_state(studio)
}

/// Does what reads the disk or computes, away from the threads that serve.
async fn work_on<T: Send + 'static>(
    studio: &Arc<Studio>,
    work: impl FnOnce(&Studio) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let _turn = studio.turns.acquire().await.map_err(|_| Refusal::bad("the studio ends"))?;
    let studio = studio.clone();
    let done = tokio::task::spawn_blocking(move || work(&studio)).await;
    done.map_err(|_| Refusal(StatusCode::INTERNAL_SERVER_ERROR, "the studio made a mistake".to_owned()))?
}

/// [`work_on`] for what takes many seconds of a processor: one at a time, so that the others are served meanwhile.
async fn work_hard_on<T: Send + 'static>(
    studio: &Arc<Studio>,
    work: impl FnOnce(&Studio) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let _alone = studio.heavy.acquire().await.map_err(|_| Refusal::bad("the studio ends"))?;
    work_on(studio, work).await
}

/// The value that JSON in the address of a request stands for.
fn parsed<T: DeserializeOwned>(json: &str) -> Result<T, Refusal> {
    serde_json::from_str(json).map_err(|error| Refusal::bad(error.to_string()))
}

/// What lies at a place below the folder.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct At {
    #[serde(default)]
    at: String,
}

/// The studio, and who asks.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct About {
    /// `None` for who is not logged in.
    session: Option<OwnSession>,
    /// Whether one logs in.
    asks_for_token: bool,
    /// The name of the folder.
    folder: String,
    version: &'static str,
    is_demo: bool,
    is_encrypted: bool,
    /// Seconds since 1970.
    now: f64,
}

/// The session of who asks.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct OwnSession {
    /// The word that changes carry.
    csrf: String,
    /// Whether nothing may be changed.
    read_only: bool,
}

async fn session(State(studio): Shared, session: Option<Extension<Session>>) -> Json<About> {
    let own = session.map(|Extension(session)| OwnSession {
        csrf: session.csrf,
        read_only: studio.read_only || session.right == Right::Look,
    });
    Json(About {
        session: own,
        asks_for_token: studio.access.asks_for_token(),
        folder: own_name(&studio),
        version: env!("CARGO_PKG_VERSION"),
        is_demo: studio.is_demo,
        is_encrypted: studio.is_encrypted,
        now: crate::unix_s(),
    })
}

/// The name of the folder; who is not logged in learns no more than the pages show.
fn own_name(studio: &Studio) -> String {
    name_of(&studio.root, "")
}

/// What one logs in with.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct LogIn {
    token: String,
}

async fn log_in(
    State(studio): Shared,
    Extension(Peer(from)): Extension<Peer>,
    headers: HeaderMap,
    Sent(LogIn { token }): Sent<LogIn>,
) -> Result<Response, Refusal> {
    // A proxy says so; whoever else does, only keeps a cookie from an address that is not encrypted.
    let is_behind_tls = headers.get("x-forwarded-proto").is_some_and(|proto| proto == "https");
    let secure = if studio.is_encrypted || is_behind_tls { "; Secure" } else { "" };
    match studio.access.log_in(&token, from) {
        Ok(word) => {
            let cookie = &studio.cookie;
            let value = format!("{cookie}={word}; HttpOnly; SameSite=Strict; Path=/; Max-Age=43200{secure}");
            let value = HeaderValue::from_str(&value).map_err(|error| Refusal::bad(error.to_string()))?;
            Ok(([(header::SET_COOKIE, value)], Json(Done {})).into_response())
        }
        Err(LogInError::Wrong(left)) => {
            let tries = if left == 1 { "1 try is left" } else { &format!("{left} tries are left") };
            Err(Refusal::forbidden(format!("That was not it. {tries} before a pause.")))
        }
        Err(LogInError::Wait(seconds)) => {
            let refusal =
                Refusal(StatusCode::TOO_MANY_REQUESTS, format!("Too many tries. Try again in {seconds} s."));
            let mut response = refusal.into_response();
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
            Ok(response)
        }
    }
}

async fn log_out(State(studio): Shared, headers: HeaderMap) -> Response {
    if let Some(cookie) = crate::gate::cookie(&headers, &studio.cookie) {
        studio.access.log_out(cookie);
    }
    // Browsers heed it under TLS and on loopback; photographs ask for their session in any case.
    ([("clear-site-data", "\"cache\"")], Json(Done {})).into_response()
}

/// Whether the session of a request still lasts.
fn session_lasts(studio: &Arc<Studio>, headers: &HeaderMap) -> impl Fn() -> bool + Send + Sync + use<> {
    let studio = Arc::downgrade(studio);
    let cookie = |name: &str| crate::gate::cookie(headers, name).map(str::to_owned);
    let cookie = studio.upgrade().and_then(|studio| cookie(&studio.cookie));
    move || studio.upgrade().is_some_and(|studio| studio.access.session(cookie.as_deref()).is_some())
}

/// The id of the last event that a page that comes back has.
fn last_id(headers: &HeaderMap) -> Option<String> {
    headers.get(HeaderName::from_static("last-event-id"))?.to_str().ok().map(str::to_owned)
}

fn overview(studio: &Arc<Studio>) -> stream::Latest<Overview> {
    let own = Arc::downgrade(studio);
    studio.overviews.listen("", items::PAUSE, move |before| own.upgrade()?.overview(before.is_some()))
}

/// A stream for the session of a request.
fn open_stream(studio: &Arc<Studio>, headers: &HeaderMap) -> (EventStream, Response) {
    EventStream::open(headers, session_lasts(studio, headers))
}

async fn folder_events(State(studio): Shared, headers: HeaderMap) -> Response {
    let (events, response) = open_stream(&studio, &headers);
    events.follow(None, overview(&studio), last_id(&headers));
    response
}

/// States that one stream may carry.
const MOST_LISTENED: usize = 100;

/// What all pages of a browser listen to.
#[derive(Deserialize)]
struct Listen {
    /// JSON of several [`Listener`]s.
    to: String,
}

/// What one page listens to.
#[derive(Deserialize)]
struct Listener {
    /// Distinguishes its messages from those of others.
    key: String,
    topic: Topic,
    #[serde(default)]
    at: String,
    /// Id of the last message that it has.
    last: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Topic {
    Items,
    Run,
    Evolution,
}

/// The events of all pages of a browser in one stream: browsers open six connections to one address, whatever the number of
/// pages.
async fn many_events(
    State(studio): Shared,
    Query(Listen { to }): Query<Listen>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let all: Vec<Listener> =
        serde_json::from_str(&to).map_err(|error| Refusal::bad(format!("to: {error}")))?;
    if all.is_empty() || all.len() > MOST_LISTENED {
        return Err(Refusal::bad(format!("found {} listeners, wanted 1 to {MOST_LISTENED}", all.len())));
    }
    let (events, response) = open_stream(&studio, &headers);
    for Listener { key, topic, at, last } in all {
        let refused = match topic {
            Topic::Items => {
                events.follow(Some(key.clone()), overview(&studio), last);
                continue;
            }
            Topic::Run => {
                runs::followed_run(&studio, &at).map(|run| events.follow(Some(key.clone()), run, last))
            }
            Topic::Evolution => evolutions::followed_evolution(&studio, &at)
                .map(|evolution| events.follow(Some(key.clone()), evolution, last)),
        };
        if let Err(refusal) = refused {
            events.refuse(&key, &refusal);
        }
    }
    Ok(response)
}

/// The overview at once, for a page that has none yet.
async fn folder_items(State(studio): Shared) -> Answer<ItemsNews> {
    let state = stream::first(overview(&studio))
        .await
        .ok_or_else(|| Refusal::missing("the folder cannot be read"))?;
    Ok(Json(state.news(0)))
}

/// Numbers of all runs for Prometheus.
async fn metrics_text(State(studio): Shared) -> Result<Response, Refusal> {
    let state = stream::first(overview(&studio)).await;
    let state = state.ok_or_else(|| Refusal::missing("the folder cannot be read"))?;
    Ok(([(header::CONTENT_TYPE, metrics::KIND)], metrics::text(&state)).into_response())
}

/// A monitor that waits no longer than until then.
struct Until(Instant);

impl Monitor for Until {
    fn may_go_on(&self) -> bool {
        Instant::now() < self.0
    }
}

/// Whether work has ended that was asked to.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Ended {
    was_running: bool,
    /// `false` if it goes on until its step is over.
    has_ended: bool,
}

async fn end(studio: &Arc<Studio>, at: String, kind: Kind) -> Answer<Ended> {
    // Not one of the turns: a stop waits for nobody.
    let studio = studio.clone();
    let done = tokio::task::spawn_blocking(move || {
        let folder = resolve_kind(&studio.root, &at, kind)?;
        // The monitor gives up before the plan does, and says so by another error.
        let plan = StopPlan { folder, wait_min: 1.0 };
        match plan.execute(&Until(Instant::now() + STOP_WAIT)) {
            Ok(ended) => Ok(Json(Ended { was_running: ended.was_running, has_ended: true })),
            // It was asked to.
            Err(tropism_lab::Error::Cancelled(_)) => Ok(Json(Ended { was_running: true, has_ended: false })),
            Err(error) => Err(error.into()),
        }
    });
    done.await.map_err(|_| Refusal::bad("the studio made a mistake"))?
}
