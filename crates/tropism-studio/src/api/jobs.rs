//! Routes of all other work: forms, the queue, files, comparisons, settings of vision, devices, names.

use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::{ControllerSpec, Silent, Workflow, files, holder};
use tropism_page::Drawing;

use super::runs::start_run;
use super::{Answer, At, Shared, parsed, read, work_hard_on, work_on};
use crate::error::Refusal;
use crate::found::{Kind, resolve, resolve_work, search_of};
use crate::gate::form_encoded;
use crate::items::name_of;
use crate::{Studio, begin, calibrate, compare, devices, housekeeping, items, tune};

/// The status of any work, as `tropism status --json` prints it.
pub(super) async fn work(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
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

/// Work, and a name: its new one, or its own once more.
#[derive(Deserialize)]
pub(super) struct Named {
    at: String,
    name: String,
}

pub(super) async fn rename(State(studio): Shared, body: Body) -> Answer {
    let Named { at, name } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(housekeeping::rename(studio, &at, &name)?))).await
}

#[derive(Deserialize)]
pub(super) struct Tagged {
    at: String,
    tags: Vec<String>,
}

pub(super) async fn tags(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| Ok(Json(housekeeping::tags(studio, &at)?))).await
}

pub(super) async fn set_tags(State(studio): Shared, body: Body) -> Answer {
    let Tagged { at, tags } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(housekeeping::set_tags(studio, &at, &tags)?))).await
}

pub(super) async fn delete(State(studio): Shared, body: Body) -> Answer {
    let Named { at, name } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(housekeeping::delete(studio, &at, &name)?))).await
}

pub(super) async fn forms(State(studio): Shared) -> Answer {
    work_on(&studio, |studio| Ok(Json(json!({ "forms": begin::forms(studio) })))).await
}

#[derive(Deserialize)]
pub(super) struct FilledIn {
    /// JSON of a [`begin::Filled`].
    form: String,
}

/// The command that a form stands for so far.
pub(super) async fn begin_command(
    State(studio): Shared,
    Query(FilledIn { form }): Query<FilledIn>,
) -> Answer {
    let filled: begin::Filled = parsed(&form)?;
    work_on(&studio, move |studio| Ok(Json(begin::preview(studio, &filled)?))).await
}

pub(super) async fn begin_work(State(studio): Shared, body: Body) -> Answer {
    let filled: begin::Filled = read(body).await?;
    work_on(&studio, move |studio| {
        let begin::Begun { words, at, is_run } = filled.command(studio)?;
        let command = crate::jobs::line(&words);
        if let Some(plan) = filled.rig(studio.root.join(&at)) {
            plan.execute(&Silent)?;
            return Ok(Json(json!({ "at": at, "command": command, "job": null })));
        }
        if is_run {
            start_run(studio, &studio.root.join(&at), &words)?;
            return Ok(Json(json!({ "at": at, "command": command, "job": null })));
        }
        if words[0] == "check" {
            studio.devices.close();
        }
        let job = studio.queue.add(&at, vec![words]).map_err(|error| Refusal::bad(error.to_string()))?;
        Ok(Json(json!({ "at": at, "command": command, "job": job })))
    })
    .await
}

pub(super) async fn rigs(State(studio): Shared) -> Answer {
    work_on(&studio, |studio| Ok(Json(devices::rigs(studio)))).await
}

/// Does what waits for devices, which takes none of the turns: *off* waits for nobody.
pub(super) async fn with_devices(
    studio: &Arc<Studio>,
    work: impl FnOnce(&Studio) -> Result<Value, Refusal> + Send + 'static,
) -> Answer {
    let studio = studio.clone();
    let done = tokio::task::spawn_blocking(move || work(&studio)).await;
    done.map_err(|_| Refusal::bad("the studio made a mistake"))?.map(Json)
}

pub(super) async fn rig_about(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    with_devices(&studio, move |studio| devices::about(studio, &at)).await
}

pub(super) async fn rig_wish(State(studio): Shared, body: Body) -> Answer {
    let wish: devices::Wish = read(body).await?;
    with_devices(&studio, move |studio| devices::grant(studio, wish)).await
}

pub(super) async fn rig_calibrate(State(studio): Shared, body: Body) -> Answer {
    let clicked: calibrate::Clicked = read(body).await?;
    work_hard_on(&studio, move |studio| Ok(Json(calibrate::calibrate(studio, &clicked)?))).await
}

/// The latest photograph that was taken by hand.
pub(super) async fn rig_photo(
    State(studio): Shared,
    Query(JobNumber { number }): Query<JobNumber>,
) -> Result<Response, Refusal> {
    let photo = studio.devices.photograph(number)?;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], photo).into_response())
}

/// A file that work has made, to save.
pub(super) async fn made_file(
    State(studio): Shared,
    Query(At { at }): Query<At>,
) -> Result<Response, Refusal> {
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

#[derive(Deserialize)]
pub(super) struct JobNumber {
    number: u64,
}

pub(super) async fn queue_remove(State(studio): Shared, body: Body) -> Answer {
    let JobNumber { number } = read(body).await?;
    work_on(&studio, move |studio| {
        let is_removed = studio.queue.remove(number).map_err(|error| Refusal::bad(error.to_string()))?;
        if is_removed { Ok(Json(json!({}))) } else { Err(Refusal::missing("found no such job that waits")) }
    })
    .await
}

pub(super) async fn queue_cancel(State(studio): Shared, body: Body) -> Answer {
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

pub(super) async fn queue_log(
    State(studio): Shared,
    Query(JobNumber { number }): Query<JobNumber>,
) -> Answer {
    work_on(&studio, move |studio| {
        let said = studio.queue.said(number).ok_or_else(|| Refusal::missing("found no such job"))?;
        Ok(Json(json!({ "log": said })))
    })
    .await
}

#[derive(Deserialize)]
pub(super) struct ManyAt {
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

pub(super) async fn compared(State(studio): Shared, Query(many): Query<ManyAt>) -> Answer {
    work_on(&studio, move |studio| Ok(Json(compare::compare(studio, &many.list())?))).await
}

pub(super) async fn compared_file(
    State(studio): Shared,
    Query(many): Query<ManyAt>,
) -> Result<Response, Refusal> {
    work_on(&studio, move |studio| {
        let (bytes, kind) = compare::file(studio, &many.list(), &many.name)?;
        // A drawing alone may have its own styles, but nothing that acts.
        let policy = "default-src 'none'; style-src 'unsafe-inline'; sandbox";
        Ok(([(header::CONTENT_TYPE, kind), (header::CONTENT_SECURITY_POLICY, policy)], bytes).into_response())
    })
    .await
}

pub(super) async fn tune_begin(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_hard_on(&studio, move |studio| Ok(Json(tune::begin(&studio.root, &at)?))).await
}

#[derive(Deserialize)]
pub(super) struct LookAt {
    /// JSON of a [`tune::TuneRequest`].
    plan: String,
}

pub(super) async fn tune_look(State(studio): Shared, Query(LookAt { plan }): Query<LookAt>) -> Answer {
    let request: tune::TuneRequest = parsed(&plan)?;
    work_hard_on(&studio, move |studio| Ok(Json(tune::look(&studio.root, &request)?))).await
}

pub(super) async fn tune_write(State(studio): Shared, body: Body) -> Answer {
    let request: tune::TuneRequest = read(body).await?;
    work_hard_on(&studio, move |studio| Ok(Json(tune::write(studio, &request)?))).await
}
