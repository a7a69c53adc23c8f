//! What pages ask for: one function a route.

mod evolutions;
mod jobs;
mod runs;

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Extension, Json, Router, middleware};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tropism_lab::stop::StopPlan;
use tropism_lab::{Monitor, Workflow};

use crate::access::{LogInError, Right, Session};
use crate::error::Refusal;
use crate::found::{Kind, resolve_kind};
use crate::gate::gate;
use crate::items::{Overview, name_of};
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
type Answer = Result<Json<Value>, Refusal>;

/// All routes.
pub(crate) fn router(studio: Arc<Studio>) -> Router {
    let page = |name: &'static str| get(async move |headers: HeaderMap| assets::page(name, &headers));
    Router::new()
        .route("/", page("index.html"))
        .route("/run", get(runs::run_page))
        .route("/evolution", get(evolutions::evolution_page))
        .route("/work", page("work.html"))
        .route("/draw", page("draw.html"))
        .route("/begin", page("begin.html"))
        .route("/devices", page("devices.html"))
        .route("/tune", page("tune.html"))
        .route("/compare", page("compare.html"))
        .route("/login", page("login.html"))
        .route("/assets/{name}", get(assets::asset))
        .route("/api/session", get(session))
        .route("/api/login", post(log_in))
        .route("/api/logout", post(log_out))
        .route("/api/events", get(folder_events))
        .route("/api/stream", get(many_events))
        .route("/api/items", get(folder_items))
        .route("/metrics", get(metrics_text))
        .route("/api/work", get(jobs::work))
        .route("/api/run", get(runs::run_about))
        .route("/api/run/events", get(runs::run_events))
        .route("/api/run/photo", get(runs::photo))
        .route("/api/run/photographs", get(runs::photographs))
        .route("/api/run/stem", get(runs::stem))
        .route("/api/rename", post(jobs::rename))
        .route("/api/delete", post(jobs::delete))
        .route("/api/tags", get(jobs::tags).post(jobs::set_tags))
        .route("/api/run/prediction", get(runs::prediction))
        .route("/api/run/stop", post(runs::stop))
        .route("/api/run/safe-state", post(runs::safe_state))
        .route("/api/run/resume", post(runs::resume))
        .route("/api/evolution", get(evolutions::evolution_about))
        .route("/api/evolution/events", get(evolutions::evolution_events))
        .route("/api/evolution/champion", get(evolutions::champion))
        .route("/api/evolution/pause", post(evolutions::pause))
        .route("/api/evolution/resume", post(evolutions::go_on))
        .route("/api/evolution/extend", post(evolutions::extend))
        .route("/api/reach", get(evolutions::reach))
        .route("/api/models", get(evolutions::models))
        .route("/api/try", get(evolutions::try_out))
        .route("/api/task", get(evolutions::task_text))
        .route("/api/draw/evolve", post(evolutions::draw_evolve))
        .route("/api/draw/save", post(evolutions::draw_save))
        .route("/api/queue/remove", post(jobs::queue_remove))
        .route("/api/queue/cancel", post(jobs::queue_cancel))
        .route("/api/queue/log", get(jobs::queue_log))
        .route("/api/forms", get(jobs::forms))
        .route("/api/begin/command", get(jobs::begin_command))
        .route("/api/begin", post(jobs::begin_work))
        .route("/api/rigs", get(jobs::rigs))
        .route("/api/rig", get(jobs::rig_about).post(jobs::rig_wish))
        .route("/api/rig/photo", get(jobs::rig_photo))
        .route("/api/rig/calibrate", post(jobs::rig_calibrate))
        .route("/api/run/note", post(runs::note))
        .route("/api/file", get(jobs::made_file))
        .route("/api/compare", get(jobs::compared))
        .route("/api/compare/file", get(jobs::compared_file))
        .route("/api/tune", get(jobs::tune_begin))
        .route("/api/tune/look", get(jobs::tune_look))
        .route("/api/tune/write", post(jobs::tune_write))
        .layer(middleware::from_fn_with_state(studio.clone(), gate))
        .with_state(studio)
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

/// The JSON of a body of bounded size that comes in bounded time.
async fn read<T: DeserializeOwned>(body: Body) -> Result<T, Refusal> {
    let too_large = || {
        Refusal(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!("found a body that is too large, wanted {MAX_BODY} bytes at most"),
        )
    };
    let bytes = tokio::time::timeout(BODY_COMES, axum::body::to_bytes(body, MAX_BODY)).await;
    let bytes =
        bytes.map_err(|_| Refusal(StatusCode::REQUEST_TIMEOUT, "the request came too slowly".to_owned()))?;
    let bytes = bytes.map_err(|_| too_large())?;
    serde_json::from_slice(&bytes).map_err(|error| Refusal::bad(error.to_string()))
}

/// What lies at a place below the folder.
#[derive(Deserialize)]
struct At {
    #[serde(default)]
    at: String,
}

async fn session(State(studio): Shared, session: Option<Extension<Session>>) -> Json<Value> {
    let own = session.map(|Extension(session)| {
        json!({ "csrf": session.csrf, "read_only": studio.read_only || session.right == Right::Look })
    });
    Json(json!({
        "session": own,
        "asks_for_token": studio.access.asks_for_token(),
        "folder": own_name(&studio),
        "version": env!("CARGO_PKG_VERSION"),
        "is_demo": studio.is_demo,
        "is_encrypted": studio.is_encrypted,
        "now": crate::unix_s(),
    }))
}

/// The name of the folder; who is not logged in learns no more than the pages show.
fn own_name(studio: &Studio) -> String {
    name_of(&studio.root, "")
}

#[derive(Deserialize)]
struct LogIn {
    token: String,
}

async fn log_in(
    State(studio): Shared,
    Extension(Peer(from)): Extension<Peer>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Refusal> {
    let LogIn { token } = read(body).await?;
    // A proxy says so; whoever else does, only keeps a cookie from an address that is not encrypted.
    let is_behind_tls = headers.get("x-forwarded-proto").is_some_and(|proto| proto == "https");
    let secure = if studio.is_encrypted || is_behind_tls { "; Secure" } else { "" };
    let (access, cookie) = (studio.clone(), studio.cookie.clone());
    let opened = tokio::task::spawn_blocking(move || access.access.log_in(&token, from)).await;
    match opened.map_err(|_| Refusal::bad("the studio made a mistake"))? {
        Ok(word) => {
            let value = format!("{cookie}={word}; HttpOnly; SameSite=Strict; Path=/; Max-Age=43200{secure}");
            let value = HeaderValue::from_str(&value).map_err(|error| Refusal::bad(error.to_string()))?;
            Ok(([(header::SET_COOKIE, value)], Json(json!({}))).into_response())
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
    ([("clear-site-data", "\"cache\"")], Json(json!({}))).into_response()
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
    /// Tells its messages from those of others.
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
async fn folder_items(State(studio): Shared) -> Answer {
    use stream::Listened;

    let state = stream::first(overview(&studio))
        .await
        .ok_or_else(|| Refusal::missing("the folder cannot be read"))?;
    let data = state.since(None).pop().map(|message| message.data).unwrap_or_default();
    Ok(Json(serde_json::from_str(&data).unwrap_or_default()))
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

async fn end(studio: &Arc<Studio>, at: String, kind: Kind) -> Answer {
    // Not one of the turns: a stop waits for nobody.
    let studio = studio.clone();
    let done = tokio::task::spawn_blocking(move || {
        let folder = resolve_kind(&studio.root, &at, kind)?;
        // The monitor gives up before the plan does, and says so by another error.
        let plan = StopPlan { folder, wait_min: 1.0 };
        match plan.execute(&Until(Instant::now() + STOP_WAIT)) {
            Ok(ended) => Ok(Json(json!({ "was_running": ended.was_running, "has_ended": true }))),
            // It was asked to.
            Err(tropism_lab::Error::Cancelled(_)) => {
                Ok(Json(json!({ "was_running": true, "has_ended": false })))
            }
            Err(error) => Err(error.into()),
        }
    });
    done.await.map_err(|_| Refusal::bad("the studio made a mistake"))?
}
