//! What pages ask for: one function a route.

use std::path::{Path, PathBuf};
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
use tropism::geometry::Region;
use tropism::photo::{Image, LazyImage, Photo, PhotoError, jpeg};
use tropism_lab::evolve::EvolutionRecord;
use tropism_lab::safe_state::SafeStatePlan;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::stop::StopPlan;
use tropism_lab::{ControllerSpec, Monitor, RunConfig, Silent, Workflow, files, holder};
use tropism_page::Drawing;

use crate::access::{LogInError, Right, Session};
use crate::error::Refusal;
use crate::found::{Kind, resolve, resolve_kind, resolve_work, search_of};
use crate::gate::{form_encoded, gate};
use crate::items::{Overview, name_of};
use crate::stream::EventStream;
use crate::tail::SHOWN_DIGITS;
use crate::wire::Peer;
use crate::{
    Studio, assets, begin, compare, draw, evolution, housekeeping, items, metrics, run, stream, tune, zip,
};

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
        .route("/run", get(run_page))
        .route("/evolution", get(evolution_page))
        .route("/work", page("work.html"))
        .route("/draw", page("draw.html"))
        .route("/begin", page("begin.html"))
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
        .route("/api/work", get(work))
        .route("/api/run", get(run_about))
        .route("/api/run/events", get(run_events))
        .route("/api/run/photo", get(photo))
        .route("/api/run/photographs", get(photographs))
        .route("/api/run/stem", get(stem))
        .route("/api/rename", post(rename))
        .route("/api/delete", post(delete))
        .route("/api/run/prediction", get(prediction))
        .route("/api/run/stop", post(stop))
        .route("/api/run/safe-state", post(safe_state))
        .route("/api/run/resume", post(resume))
        .route("/api/evolution", get(evolution_about))
        .route("/api/evolution/events", get(evolution_events))
        .route("/api/evolution/champion", get(champion))
        .route("/api/evolution/pause", post(pause))
        .route("/api/evolution/resume", post(go_on))
        .route("/api/evolution/extend", post(extend))
        .route("/api/reach", get(reach))
        .route("/api/models", get(models))
        .route("/api/try", get(try_out))
        .route("/api/task", get(task_text))
        .route("/api/draw/evolve", post(draw_evolve))
        .route("/api/draw/save", post(draw_save))
        .route("/api/queue/remove", post(queue_remove))
        .route("/api/queue/cancel", post(queue_cancel))
        .route("/api/queue/log", get(queue_log))
        .route("/api/forms", get(forms))
        .route("/api/begin/command", get(begin_command))
        .route("/api/begin", post(begin_work))
        .route("/api/file", get(made_file))
        .route("/api/compare", get(compared))
        .route("/api/compare/file", get(compared_file))
        .route("/api/tune", get(tune_begin))
        .route("/api/tune/look", get(tune_look))
        .route("/api/tune/write", post(tune_write))
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
            Topic::Run => followed_run(&studio, &at).map(|run| events.follow(Some(key.clone()), run, last)),
            Topic::Evolution => followed_evolution(&studio, &at)
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

/// The status of any work, as `tropism status --json` prints it.
async fn work(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_work(&studio.root, &at)?;
        let kind = Kind::of(&folder).ok_or_else(|| Refusal::missing(format!("{at}: found no work")))?;
        let status = StatusPlan { folder: folder.clone() }.execute(&Silent)?;
        let is_at_work = match &status {
            StatusResults::Tune(search) => items::is_at_work(search),
            _ => holder(&folder)?.is_some(),
        };
        let word = files::shell_word(Path::new(if at.is_empty() { "." } else { &at }));
        let mut commands = vec![format!("tropism status {word}")];
        let mut drawing = None;
        if kind == Kind::Rule {
            // A rule that is there may be searched for anew.
            let is_over = !search_of(&folder).exists();
            commands.push(match is_over {
                true => format!("tropism run --rig greenhouse --controller {word} --out steered"),
                false => format!("tropism tune --out {word} --resume"),
            });
            let rule = is_over.then(|| ControllerSpec::read(&folder)).transpose()?;
            drawing = rule.and_then(|rule| rule.own_task().map(Drawing::of));
        }
        Ok(Json(json!({
            "kind": kind, "name": name_of(&studio.root, &at), "status": status, "is_at_work": is_at_work,
            "commands": commands, "drawing": drawing,
        })))
    })
    .await
}

async fn run_about(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        let mut about = run::about(&folder, &at)?;
        about["name"] = name_of(&studio.root, &at).into();
        Ok(Json(about))
    })
    .await
}

/// The run that lies `at` below the folder, kept up to date from now on.
fn followed_run(studio: &Studio, at: &str) -> Result<stream::Latest<run::RunView>, Refusal> {
    let mut reader = run::RunReader::new(resolve_kind(&studio.root, at, Kind::Run)?);
    Ok(studio.runs.listen(at, run::PAUSE, move |before| reader.read(before)))
}

/// The page of a run, which is read while the browser loads scripts and styles.
async fn run_page(State(studio): Shared, Query(At { at }): Query<At>, headers: HeaderMap) -> Response {
    // What is wrong with the run is sent to the page when it asks.
    let _ = followed_run(&studio, &at);
    let link = work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        let photo = run::latest_photo(&folder).ok_or_else(|| Refusal::missing("no photograph yet"))?;
        let digest = files::sha256(&files::read(&folder.join("photographs").join(&photo))?);
        let v = &digest[..SHOWN_DIGITS];
        let query = format!("at={}&name={}&v={v}", form_encoded(&at), form_encoded(&photo));
        HeaderValue::from_str(&format!("<api/run/photo?{query}>; rel=preload; as=image"))
            .map_err(|error| Refusal::bad(error.to_string()))
    });
    let link = link.await.map(|link| [(header::LINK, link)]).ok();
    (link, assets::page("run.html", &headers)).into_response()
}

async fn run_events(
    State(studio): Shared,
    Query(At { at }): Query<At>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let run = followed_run(&studio, &at)?;
    let (events, response) = open_stream(&studio, &headers);
    events.follow(None, run, last_id(&headers));
    Ok(response)
}

#[derive(Deserialize)]
struct PhotoAt {
    #[serde(default)]
    at: String,
    name: String,
    /// Begin of its SHA-256: another photograph of this name has another address.
    v: Option<String>,
    #[serde(default)]
    small: bool,
}

/// A photograph of a run or of a folder.
///
/// A browser keeps one whose digest is in the address: for good where nobody logs in, else until the session ends, because it
/// asks each time.
async fn photo(
    State(studio): Shared,
    Query(PhotoAt { at, name, v, small }): Query<PhotoAt>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let is_open = !studio.access.asks_for_token();
    let tag = v.as_ref().map(|v| format!("\"{v}{}\"", if small { "-small" } else { "" }));
    let keep = if is_open { "private, max-age=31536000, immutable" } else { "private, no-cache" };
    if let Some(tag) = tag.as_ref().filter(|tag| {
        headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes())
    }) {
        let own = [(header::ETAG, tag.as_str()), (header::CACHE_CONTROL, keep)];
        return Ok((StatusCode::NOT_MODIFIED, own).into_response());
    }
    work_on(&studio, move |studio| {
        if !files::is_plain_name(&name) {
            return Err(Refusal::missing(format!("found no photograph {name:?}")));
        }
        let folder = resolve(&studio.root, &at)?;
        let is_run = Kind::of(&folder) == Some(Kind::Run);
        let within = |name: &str| if at.is_empty() { name.to_owned() } else { format!("{at}/{name}") };
        let place = if is_run { format!("photographs/{name}") } else { name.clone() };
        let path = resolve(&studio.root, &within(&place))?;
        let kind = match name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).as_deref() {
            Some("jpg" | "jpeg") => "image/jpeg",
            Some("png") => "image/png",
            _ => return Err(Refusal::missing(format!("{name}: wanted a JPEG or PNG file"))),
        };
        let photo = files::read_photo(&path, 0.0)?;
        let tag =
            tag.filter(|_| v.is_some_and(|v| !v.is_empty() && files::sha256(&photo.bytes).starts_with(&v)));
        let unreadable = |error: PhotoError| Refusal::bad(error.to_string());
        let (kind, bytes) = if small {
            let image = shrunk(&photo).map_err(unreadable)?;
            ("image/jpeg", tropism_report::scaled(&image, SMALL).to_jpeg(SMALL_QUALITY).map_err(unreadable)?)
        } else {
            (kind, photo.bytes)
        };
        let kept = tag.map(|tag| [(header::ETAG, tag), (header::CACHE_CONTROL, keep.to_owned())]);
        // The gate says `no-store` of all else.
        Ok((kept, [(header::CONTENT_TYPE, kind)], bytes).into_response())
    })
    .await
}

/// A photograph in some size above [`SMALL`], or its own: of a JPEG no more is decoded than that takes.
fn shrunk(photo: &Photo) -> Result<Image, PhotoError> {
    let factor = |width: usize| [8, 4, 2].into_iter().find(|factor| width / factor >= SMALL);
    Ok(match photo.open()? {
        LazyImage::Jpeg(jpeg) if let Some(factor) = factor(jpeg.width) => {
            let whole = Region { x: 0, y: 0, width: jpeg.width, height: jpeg.height };
            jpeg::decode_scaled(&jpeg, whole, factor)
        }
        other => other.into_image(),
    })
}

/// All photographs of a run as a ZIP archive, written while it is sent.
async fn photographs(State(studio): Shared, Query(At { at }): Query<At>) -> Result<Response, Refusal> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?.join("photographs");
        let entries = std::fs::read_dir(&folder).map_err(|_| Refusal::missing("no photograph yet"))?;
        let mut paths: Vec<(String, u64)> = entries
            .flatten()
            .filter_map(|entry| Some((entry.file_name().into_string().ok()?, entry.metadata().ok()?.len())))
            .filter(|(name, _)| name.ends_with(".jpg") && !name.starts_with('.'))
            .collect();
        paths.sort_unstable();
        let bytes: u64 = paths.iter().map(|(_, bytes)| bytes).sum();
        if paths.len() > zip::MOST_FILES || bytes > zip::MOST_BYTES {
            return Err(Refusal::bad(
                "These photographs are too many for one ZIP file; export the run instead.",
            ));
        }
        let name = form_encoded(&name_of(&studio.root, &at).replace('/', "-"));
        let within = name.clone();
        let body = stream::written(move |send| {
            let mut archive = zip::Archive::default();
            for (photo, _) in paths {
                // One that is gone meanwhile is left out.
                let Ok(content) = files::read(&folder.join(&photo)) else { continue };
                if !send(archive.file(&format!("{within}/{photo}"), &content)) {
                    return;
                }
            }
            send(archive.end());
        });
        let saved = format!("attachment; filename=\"{name}-photographs.zip\"");
        Ok(([(header::CONTENT_DISPOSITION, saved)], [(header::CONTENT_TYPE, "application/zip")], body)
            .into_response())
    })
    .await
}

/// Work, and a name: its new one, or its own once more.
#[derive(Deserialize)]
struct Named {
    at: String,
    name: String,
}

async fn rename(State(studio): Shared, body: Body) -> Answer {
    let Named { at, name } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(housekeeping::rename(studio, &at, &name)?))).await
}

async fn delete(State(studio): Shared, body: Body) -> Answer {
    let Named { at, name } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(housekeeping::delete(studio, &at, &name)?))).await
}

#[derive(Deserialize)]
struct StepAt {
    #[serde(default)]
    at: String,
    step: u32,
}

async fn stem(State(studio): Shared, Query(StepAt { at, step }): Query<StepAt>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(run::stem(&folder, step)?))
    })
    .await
}

/// What is expected of a run, on the model that its controller was made for.
async fn prediction(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(studio.predictions.of(&at, || predicted(studio, &folder))?))
    })
    .await
}

fn predicted(studio: &Studio, folder: &Path) -> Result<Value, Refusal> {
    let config = RunConfig::follow(folder)?;
    if let Some(reason) = run::reason_not_to_predict(&config) {
        return Err(Refusal::missing(reason));
    }
    let wanted = config.controller.own_model_sha256();
    let models: Vec<PathBuf> = draw::models(&studio.root).iter().map(|at| studio.root.join(at)).collect();
    let digest = |path: &PathBuf| files::read(path).ok().map(|bytes| files::sha256(&bytes));
    let is_fit = |path: &&PathBuf| !config.task.is_about_stem() || draw::knows_stem(path);
    let is_own = |path: &&PathBuf| wanted.is_some() && digest(path).as_deref() == wanted;
    let any = models.iter().find(is_fit).filter(|_| wanted.is_none() && config.is_virtual());
    let model = models.iter().find(is_own).or(any).ok_or_else(|| {
        Refusal::missing(match wanted {
            Some(_) => "the model of its controller is not in this folder",
            None if !config.is_virtual() => "its controller was made without a model",
            None if config.task.is_about_stem() => "this folder has no model of the whole stem",
            None => "this folder has no model of a plant",
        })
    })?;
    if !is_fit(&model) {
        return Err(Refusal::missing(
            "the model of its controller knows the tip alone, and this task is about the stem",
        ));
    }
    let mut printed = run::prediction(folder, &config, model)?;
    printed["model"] = model.strip_prefix(&studio.root).unwrap_or(model).display().to_string().into();
    Ok(printed)
}

async fn stop(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    end(&studio, at, Kind::Run).await
}

async fn pause(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    end(&studio, at, Kind::Evolution).await
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

async fn safe_state(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    let done = tokio::task::spawn_blocking(move || {
        let rig = resolve_kind(&studio.root, &at, Kind::Run)?;
        let results = SafeStatePlan { rig, dark: true }.execute(&Silent)?;
        Ok(Json(serde_json::to_value(results).unwrap_or_default()))
    });
    done.await.map_err(|_| Refusal::bad("the studio made a mistake"))?
}

async fn resume(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        if holder(&folder)?.is_some() {
            return Err(Refusal::bad("the run goes on already"));
        }
        start_run(studio, &folder, &run::resume_words(&folder, &at))?;
        Ok(Json(json!({})))
    })
    .await
}

/// Starts the run in `folder` by the command `words`: a process of its own, which waits in no queue. Returns when it is at
/// work.
fn start_run(studio: &Studio, folder: &Path, words: &[String]) -> Result<(), Refusal> {
    let log = studio.root.join(crate::OWN).join("resume.log");
    let child = crate::jobs::spawn(&studio.program, &studio.root, words, &log);
    let mut child = child.map_err(|error| Refusal::bad(format!("tropism run: {error}")))?;
    // Until it has the lock, or says why not.
    for _ in 0..100 {
        std::thread::sleep(Duration::from_millis(50));
        if let Ok(Some(_)) = child.try_wait() {
            let text = files::read_text(&log).unwrap_or_default();
            let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it ended at once");
            return if holder(folder)?.is_none() && !folder.join("track.csv").exists() {
                Err(Refusal::bad(crate::words::clean(last)))
            } else {
                Ok(())
            };
        }
        if folder.is_dir() && holder(folder)?.is_some() {
            break;
        }
    }
    // Its end is waited for, so that the system forgets it.
    std::thread::spawn(move || child.wait());
    Ok(())
}

async fn forms(State(studio): Shared) -> Answer {
    work_on(&studio, |studio| Ok(Json(json!({ "forms": begin::forms(studio) })))).await
}

#[derive(Deserialize)]
struct FilledIn {
    /// JSON of a [`begin::Filled`].
    form: String,
}

/// The command that a form stands for so far.
async fn begin_command(State(studio): Shared, Query(FilledIn { form }): Query<FilledIn>) -> Answer {
    let filled: begin::Filled = parsed(&form)?;
    work_on(&studio, move |studio| Ok(Json(begin::preview(studio, &filled)?))).await
}

async fn begin_work(State(studio): Shared, body: Body) -> Answer {
    let filled: begin::Filled = read(body).await?;
    work_on(&studio, move |studio| {
        let begin::Begun { words, at, is_run } = filled.command(studio)?;
        let command = crate::jobs::line(&words);
        if is_run {
            start_run(studio, &studio.root.join(&at), &words)?;
            return Ok(Json(json!({ "at": at, "command": command, "job": null })));
        }
        let job = studio.queue.add(&at, vec![words]).map_err(|error| Refusal::bad(error.to_string()))?;
        Ok(Json(json!({ "at": at, "command": command, "job": job })))
    })
    .await
}

/// A file that work has made, to save.
async fn made_file(State(studio): Shared, Query(At { at }): Query<At>) -> Result<Response, Refusal> {
    work_on(&studio, move |studio| {
        let path = resolve(&studio.root, &at)?;
        let kind = match at.rsplit_once('.').map(|(_, ending)| ending) {
            Some("gif") => "image/gif",
            Some("mp4") => "video/mp4",
            Some("csv") => "text/csv; charset=utf-8",
            Some("tar") => "application/x-tar",
            Some("json") => "application/json",
            // No TOML: rig files hold passwords.
            Some("html") => "text/html; charset=utf-8",
            Some("jpg") => "image/jpeg",
            _ => return Err(Refusal::missing(format!("{at}: found no file that is given out"))),
        };
        let name = at.rsplit_once('/').map_or(&*at, |(_, name)| name);
        // Saved, not shown: a page of the folder would act in the name of this one.
        let saved = format!("attachment; filename=\"{}\"", form_encoded(name));
        let policy = [(header::CONTENT_SECURITY_POLICY, "default-src 'none'; sandbox")];
        Ok((
            policy,
            [(header::CONTENT_DISPOSITION, saved)],
            [(header::CONTENT_TYPE, kind)],
            files::read(&path)?,
        )
            .into_response())
    })
    .await
}

async fn evolution_about(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        let mut about = evolution::about(&folder, &at)?;
        about["name"] = name_of(&studio.root, &at).into();
        Ok(Json(about))
    })
    .await
}

/// The evolution that lies `at` below the folder, kept up to date from now on.
fn followed_evolution(
    studio: &Studio,
    at: &str,
) -> Result<stream::Latest<evolution::EvolutionView>, Refusal> {
    let mut reader = evolution::EvolutionReader::new(resolve_kind(&studio.root, at, Kind::Evolution)?);
    Ok(studio.evolutions.listen(at, evolution::PAUSE, move |before| reader.read(before)))
}

/// The page of an evolution, which is read while the browser loads scripts and styles.
async fn evolution_page(State(studio): Shared, Query(At { at }): Query<At>, headers: HeaderMap) -> Response {
    let _ = followed_evolution(&studio, &at);
    assets::page("evolution.html", &headers)
}

async fn evolution_events(
    State(studio): Shared,
    Query(At { at }): Query<At>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let evolution = followed_evolution(&studio, &at)?;
    let (events, response) = open_stream(&studio, &headers);
    events.follow(None, evolution, last_id(&headers));
    Ok(response)
}

#[derive(Deserialize)]
struct RunAt {
    #[serde(default)]
    at: String,
    run: Option<u32>,
}

async fn champion(State(studio): Shared, Query(RunAt { at, run }): Query<RunAt>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        Ok(Json(evolution::champion(&folder, run)?))
    })
    .await
}

async fn go_on(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    evolve_on(&studio, at, None).await
}

/// An evolution and the generations that it is to have.
#[derive(Deserialize)]
struct Extend {
    #[serde(default)]
    at: String,
    generations: u32,
}

async fn extend(State(studio): Shared, body: Body) -> Answer {
    let Extend { at, generations } = read(body).await?;
    evolve_on(&studio, at, Some(generations)).await
}

/// Puts the rest of an evolution into the queue.
async fn evolve_on(studio: &Arc<Studio>, at: String, generations: Option<u32>) -> Answer {
    work_on(studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        if holder(&folder)?.is_some() || studio.queue.has(&at) {
            return Err(Refusal::bad("the evolution goes on already, or waits in the queue"));
        }
        let out = if at.is_empty() { "." } else { &at };
        let mut words = ["evolve", "--out", out, "--resume", "--checkpoint", "1"].map(str::to_owned).to_vec();
        if let Some(generations) = generations {
            let known = EvolutionRecord::read(&folder)?.evolution.generations;
            if generations <= known || generations > draw::MOST_GENERATIONS {
                let most = draw::MOST_GENERATIONS;
                return Err(Refusal::bad(format!(
                    "found {generations} generations, wanted {} to {most}",
                    known + 1
                )));
            }
            words.extend(["--generations".to_owned(), generations.to_string()]);
        }
        let added = studio.queue.add(&at, vec![words]);
        Ok(Json(json!({ "job": added.map_err(|error| Refusal::bad(error.to_string()))? })))
    })
    .await
}

async fn reach(State(studio): Shared) -> Answer {
    work_on(&studio, |_| Ok(Json(json!(draw::reach())))).await
}

async fn models(State(studio): Shared) -> Answer {
    work_on(&studio, |studio| Ok(Json(json!({ "models": draw::models(&studio.root) })))).await
}

async fn try_out(State(studio): Shared, Query(plan): Query<draw::TryPlan>) -> Answer {
    work_on(&studio, move |studio| Ok(Json(draw::try_out(studio, &plan)?))).await
}

#[derive(Deserialize)]
struct Drawn {
    /// JSON of a [`Drawing`].
    drawing: String,
}

/// The task file of a drawing, and the best fitness that there can be.
async fn task_text(Query(Drawn { drawing }): Query<Drawn>) -> Answer {
    let drawing = Drawing::read(&drawing)?;
    Ok(Json(json!({ "task": drawing.to_toml()?, "best": drawing.best()? })))
}

async fn draw_evolve(State(studio): Shared, body: Body) -> Answer {
    let request: draw::EvolveRequest = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(draw::evolve(studio, &request)?))).await
}

#[derive(Deserialize)]
struct Save {
    name: String,
    drawing: Drawing,
}

async fn draw_save(State(studio): Shared, body: Body) -> Answer {
    let Save { name, drawing } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(draw::save(studio, &name, &drawing)?))).await
}

#[derive(Deserialize)]
struct JobNumber {
    number: u64,
}

async fn queue_remove(State(studio): Shared, body: Body) -> Answer {
    let JobNumber { number } = read(body).await?;
    work_on(&studio, move |studio| {
        let is_removed = studio.queue.remove(number).map_err(|error| Refusal::bad(error.to_string()))?;
        if is_removed { Ok(Json(json!({}))) } else { Err(Refusal::missing("found no such job that waits")) }
    })
    .await
}

async fn queue_cancel(State(studio): Shared, body: Body) -> Answer {
    let JobNumber { number } = read(body).await?;
    work_on(&studio, move |studio| {
        if studio.queue.cancel(number)? {
            Ok(Json(json!({})))
        } else {
            Err(Refusal::missing("found no such job that runs"))
        }
    })
    .await
}

async fn queue_log(State(studio): Shared, Query(JobNumber { number }): Query<JobNumber>) -> Answer {
    work_on(&studio, move |studio| {
        let said = studio.queue.said(number).ok_or_else(|| Refusal::missing("found no such job"))?;
        Ok(Json(json!({ "log": said })))
    })
    .await
}

#[derive(Deserialize)]
struct ManyAt {
    /// Places below the folder, each in a line of its own.
    at: String,
    #[serde(default)]
    name: String,
}

impl ManyAt {
    fn list(&self) -> Vec<String> {
        self.at.lines().map(str::to_owned).collect()
    }
}

async fn compared(State(studio): Shared, Query(many): Query<ManyAt>) -> Answer {
    work_on(&studio, move |studio| Ok(Json(compare::compare(studio, &many.list())?))).await
}

async fn compared_file(State(studio): Shared, Query(many): Query<ManyAt>) -> Result<Response, Refusal> {
    work_on(&studio, move |studio| {
        let (bytes, kind) = compare::file(studio, &many.list(), &many.name)?;
        // A drawing alone may have its own styles, but nothing that acts.
        let policy = "default-src 'none'; style-src 'unsafe-inline'; sandbox";
        Ok(([(header::CONTENT_TYPE, kind), (header::CONTENT_SECURITY_POLICY, policy)], bytes).into_response())
    })
    .await
}

async fn tune_begin(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_hard_on(&studio, move |studio| Ok(Json(tune::begin(&studio.root, &at)?))).await
}

#[derive(Deserialize)]
struct LookAt {
    /// JSON of a [`tune::TuneRequest`].
    plan: String,
}

async fn tune_look(State(studio): Shared, Query(LookAt { plan }): Query<LookAt>) -> Answer {
    let request: tune::TuneRequest = parsed(&plan)?;
    work_hard_on(&studio, move |studio| Ok(Json(tune::look(&studio.root, &request)?))).await
}

async fn tune_write(State(studio): Shared, body: Body) -> Answer {
    let request: tune::TuneRequest = read(body).await?;
    work_hard_on(&studio, move |studio| Ok(Json(tune::write(studio, &request)?))).await
}
