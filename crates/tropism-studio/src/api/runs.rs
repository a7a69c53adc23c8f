//! Routes of a run: what it is, its photographs, and what changes it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use axum::Json;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use tropism::geometry::Region;
use tropism::photo::{Image, LazyImage, Photo, PhotoError, jpeg};
use tropism_lab::note::NotePlan;
use tropism_lab::safe_state::{SafeStatePlan, SafeStateResults};
use tropism_lab::{RunConfig, Silent, Workflow, files, holder};

use super::{
    Answer, At, Done, Ended, SMALL, SMALL_QUALITY, Sent, Shared, end, last_id, open_stream, work_on,
};
use crate::error::Refusal;
use crate::found::{Kind, resolve, resolve_kind};
use crate::gate::form_encoded;
use crate::items::name_of;
use crate::run::Prediction;
use crate::tail::SHOWN_DIGITS;
use crate::{Studio, assets, draw, run, stream, zip};

pub(super) async fn run_about(State(studio): Shared, Query(At { at }): Query<At>) -> Answer<run::AboutRun> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(run::about(&folder, &at, name_of(&studio.root, &at))?))
    })
    .await
}

/// The run that lies `at` below the folder, kept up to date from now on.
pub(super) fn followed_run(studio: &Studio, at: &str) -> Result<stream::Latest<run::RunView>, Refusal> {
    let mut reader = run::RunReader::new(resolve_kind(&studio.root, at, Kind::Run)?);
    Ok(studio.runs.listen(at, run::PAUSE, move |before| reader.read(before)))
}

/// The page of a run, which is read while the browser loads scripts and styles.
pub(super) async fn run_page(
    State(studio): Shared,
    Query(At { at }): Query<At>,
    headers: HeaderMap,
) -> Response {
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

pub(super) async fn run_events(
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
pub(super) struct PhotoAt {
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
pub(super) async fn photo(
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
pub(super) fn shrunk(photo: &Photo) -> Result<Image, PhotoError> {
    let factor = |width: usize| [8, 4, 2].into_iter().find(|factor| width / factor >= SMALL);
    Ok(match photo.open()? {
        LazyImage::Jpeg(jpeg) if let Some(factor) = factor(jpeg.width) => {
            let whole = Region { x: 0, y: 0, width: jpeg.width, height: jpeg.height };
            jpeg::decode_scaled(&jpeg, whole, factor)
        }
        other => other.into_image(),
    })
}

/// Whether a file in the folder of photographs is one; files of the system are not.
fn is_photograph(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    !name.starts_with('.') && matches!(ending.as_deref(), Some("jpg" | "jpeg" | "png" | "tif" | "tiff"))
}

/// All photographs of a run as a ZIP archive, written while it is sent.
pub(super) async fn photographs(
    State(studio): Shared,
    Query(At { at }): Query<At>,
) -> Result<Response, Refusal> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?.join("photographs");
        let entries = std::fs::read_dir(&folder).map_err(|_| Refusal::missing("no photograph yet"))?;
        // A link may lead out of the folder of the studio.
        let is_file = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_file());
        let mut paths: Vec<(String, u64)> = entries
            .flatten()
            .filter(is_file)
            .filter_map(|entry| Some((entry.file_name().into_string().ok()?, entry.metadata().ok()?.len())))
            .filter(|(name, _)| is_photograph(name))
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

/// A step of a run.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct StepAt {
    #[serde(default)]
    at: String,
    step: u32,
}

pub(super) async fn stem(
    State(studio): Shared,
    Query(StepAt { at, step }): Query<StepAt>,
) -> Answer<run::StemSeen> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(run::stem(&folder, step)?))
    })
    .await
}

/// What is expected of a run, on the model that its controller was made for.
pub(super) async fn prediction(State(studio): Shared, Query(At { at }): Query<At>) -> Answer<Prediction> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(studio.predictions.of(&at, || predicted(studio, &folder))?))
    })
    .await
}

pub(super) fn predicted(studio: &Studio, folder: &Path) -> Result<Prediction, Refusal> {
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
    let shown = model.strip_prefix(&studio.root).unwrap_or(model).display().to_string();
    run::prediction(folder, &config, model, &shown)
}

pub(super) async fn stop(State(studio): Shared, Sent(At { at }): Sent<At>) -> Answer<Ended> {
    end(&studio, at, Kind::Run).await
}

pub(super) async fn safe_state(State(studio): Shared, Sent(At { at }): Sent<At>) -> Answer<SafeStateResults> {
    let done = tokio::task::spawn_blocking(move || {
        let rig = resolve_kind(&studio.root, &at, Kind::Run)?;
        Ok(Json(SafeStatePlan { rig, dark: true }.execute(&Silent)?))
    });
    done.await.map_err(|_| Refusal::bad("the studio made a mistake"))?
}

pub(super) async fn resume(State(studio): Shared, Sent(At { at }): Sent<At>) -> Answer<Done> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Run)?;
        if holder(&folder)?.is_some() {
            return Err(Refusal::bad("the run goes on already"));
        }
        start_run(studio, &folder, &run::resume_words(&folder, &at))?;
        Ok(Json(Done {}))
    })
    .await
}

/// Starts the run in `folder` by the command `words`: a process of its own, which waits in no queue. Returns when it is at
/// work.
pub(super) fn start_run(studio: &Studio, folder: &Path, words: &[String]) -> Result<(), Refusal> {
    // It may be the rig that a page has open.
    studio.devices.close();
    let log = studio.root.join(crate::OWN).join("resume.log");
    let child = crate::jobs::spawn(&studio.program, &studio.root, words, &log);
    let mut child = child.map_err(|error| Refusal::bad(format!("tropism run: {error}")))?;
    // Until it has the lock, or says why not.
    for _ in 0..100 {
        std::thread::sleep(Duration::from_millis(50));
        if let Ok(Some(_)) = child.try_wait() {
            return if holder(folder)?.is_none() && !folder.join("track.csv").exists() {
                Err(Refusal::bad(crate::jobs::last_words(&log)))
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

/// A note about a run.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Noted {
    at: String,
    text: String,
    step: Option<u32>,
}

/// A note that was written, or that the run writes at its next step.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Written {
    step: Option<u32>,
    is_waiting: bool,
}

pub(super) async fn note(
    State(studio): Shared,
    Sent(Noted { at, text, step }): Sent<Noted>,
) -> Answer<Written> {
    work_on(&studio, move |studio| {
        let run = resolve_kind(&studio.root, &at, Kind::Run)?;
        let step = NotePlan { run, text, step }.execute(&Silent)?.step;
        Ok(Json(Written { step, is_waiting: step.is_none() }))
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photographs_of_every_format_are_saved() {
        let names =
            ["000001.jpg", "a.JPEG", "b.png", "c.tif", "d.Tiff", ".e.jpg", "f.txt", "Thumbs.db", "jpg"];
        assert_eq!(names.map(is_photograph), [true, true, true, true, true, false, false, false, false]);
    }
}
