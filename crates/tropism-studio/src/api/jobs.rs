//! Routes of all other work: forms, the queue, files, comparisons, settings of vision, devices, names.

use std::path::Path;
use std::sync::Arc;

use axum::Json;
use axum::extract::{Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::{ControllerSpec, Silent, Workflow, files, holder};
use tropism_page::Drawing;

use super::runs::start_run;
use super::{Answer, At, Done, Sent, Shared, parsed, work_hard_on, work_on};
use crate::error::Refusal;
use crate::found::{Kind, resolve, resolve_work, search_of};
use crate::gate::form_encoded;
use crate::housekeeping::{Deleted, Renamed, Tags};
use crate::items::name_of;
use crate::{Studio, begin, calibrate, compare, devices, housekeeping, items, tune};

/// Any work.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct ShownWork {
    kind: Kind,
    name: String,
    /// As `tropism status --json` prints it.
    status: StatusResults,
    is_at_work: bool,
    /// What a person types to look at it, and to go on with it.
    commands: Vec<String>,
    /// The task of a rule that is not searched for.
    drawing: Option<Drawing>,
}

pub(super) async fn work(State(studio): Shared, Query(At { at }): Query<At>) -> Answer<ShownWork> {
    work_on(&studio, move |studio| {
        let folder = resolve_work(&studio.root, &at)?;
        let kind = Kind::of(&folder).ok_or_else(|| Refusal::missing(format!("{at}: found no work")))?;
        let status = StatusPlan { folder: folder.clone(), model: None }.execute(&Silent)?;
        let is_at_work = match &status {
            StatusResults::Work(search) if search.work == "tune" => items::is_at_work(search),
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
        let name = name_of(&studio.root, &at);
        Ok(Json(ShownWork { kind, name, status, is_at_work, commands, drawing }))
    })
    .await
}

/// Work, and a name: its new one, or its own once more.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Named {
    at: String,
    name: String,
}

pub(super) async fn rename(State(studio): Shared, Sent(Named { at, name }): Sent<Named>) -> Answer<Renamed> {
    work_on(&studio, move |studio| Ok(Json(housekeeping::rename(studio, &at, &name)?))).await
}

/// Work, and the tags that it is to have.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Tagged {
    at: String,
    tags: Vec<String>,
}

pub(super) async fn tags(State(studio): Shared, Query(At { at }): Query<At>) -> Answer<Tags> {
    work_on(&studio, move |studio| Ok(Json(housekeeping::tags(studio, &at)?))).await
}

pub(super) async fn set_tags(State(studio): Shared, Sent(Tagged { at, tags }): Sent<Tagged>) -> Answer<Tags> {
    work_on(&studio, move |studio| Ok(Json(housekeeping::set_tags(studio, &at, &tags)?))).await
}

pub(super) async fn delete(State(studio): Shared, Sent(Named { at, name }): Sent<Named>) -> Answer<Deleted> {
    work_on(&studio, move |studio| Ok(Json(housekeeping::delete(studio, &at, &name)?))).await
}

/// The forms of the page.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Forms {
    forms: Vec<begin::ShownForm>,
}

pub(super) async fn forms(State(studio): Shared) -> Answer<Forms> {
    work_on(&studio, |studio| Ok(Json(Forms { forms: begin::forms(studio) }))).await
}

/// A form in an address.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct FilledIn {
    /// JSON of a [`begin::Filled`].
    form: String,
}

/// The command that a form stands for so far.
pub(super) async fn begin_command(
    State(studio): Shared,
    Query(FilledIn { form }): Query<FilledIn>,
) -> Answer<begin::Preview> {
    let filled: begin::Filled = parsed(&form)?;
    work_on(&studio, move |studio| Ok(Json(begin::preview(studio, &filled)?))).await
}

/// Work that began, or waits in the queue.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct BegunWork {
    /// The place of what it makes.
    at: String,
    command: String,
    /// Number of its job; `None` for a run and a rig file, which wait in no queue.
    job: Option<u64>,
}

pub(super) async fn begin_work(
    State(studio): Shared,
    Sent(filled): Sent<begin::Filled>,
) -> Answer<BegunWork> {
    work_on(&studio, move |studio| {
        let begin::Begun { words, at, is_run } = filled.command(studio)?;
        let command = crate::jobs::line(&words);
        if let Some(plan) = filled.rig(studio.root.join(&at)) {
            plan.execute(&Silent)?;
            return Ok(Json(BegunWork { at, command, job: None }));
        }
        if is_run {
            start_run(studio, &studio.root.join(&at), &words)?;
            return Ok(Json(BegunWork { at, command, job: None }));
        }
        if words[0] == "check" {
            studio.devices.close();
        }
        let job = studio.queue.add(&at, vec![words]).map_err(|error| Refusal::bad(error.to_string()))?;
        Ok(Json(BegunWork { at, command, job: Some(job) }))
    })
    .await
}

pub(super) async fn rigs(State(studio): Shared) -> Answer<devices::Rigs> {
    work_on(&studio, |studio| Ok(Json(devices::rigs(studio)))).await
}

/// Does what waits for devices, which takes none of the turns: *off* waits for nobody.
pub(super) async fn with_devices<T: Send + 'static>(
    studio: &Arc<Studio>,
    work: impl FnOnce(&Studio) -> Result<T, Refusal> + Send + 'static,
) -> Answer<T> {
    let studio = studio.clone();
    let done = tokio::task::spawn_blocking(move || work(&studio)).await;
    done.map_err(|_| Refusal::bad("the studio made a mistake"))?.map(Json)
}

pub(super) async fn rig_about(
    State(studio): Shared,
    Query(At { at }): Query<At>,
) -> Answer<devices::AboutRig> {
    with_devices(&studio, move |studio| devices::about(studio, &at)).await
}

pub(super) async fn rig_wish(
    State(studio): Shared,
    Sent(wish): Sent<devices::Wish>,
) -> Answer<devices::RigState> {
    with_devices(&studio, move |studio| devices::grant(studio, wish)).await
}

pub(super) async fn rig_calibrate(
    State(studio): Shared,
    Sent(clicked): Sent<calibrate::Clicked>,
) -> Answer<calibrate::Calibrated> {
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

/// A number of a job, or of a photograph.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct JobNumber {
    number: u64,
}

pub(super) async fn queue_remove(
    State(studio): Shared,
    Sent(JobNumber { number }): Sent<JobNumber>,
) -> Answer<Done> {
    work_on(&studio, move |studio| {
        let is_removed = studio.queue.remove(number).map_err(|error| Refusal::bad(error.to_string()))?;
        if is_removed { Ok(Json(Done {})) } else { Err(Refusal::missing("found no such job that waits")) }
    })
    .await
}

pub(super) async fn queue_cancel(
    State(studio): Shared,
    Sent(JobNumber { number }): Sent<JobNumber>,
) -> Answer<Done> {
    work_on(&studio, move |studio| {
        if studio.queue.cancel(number)? {
            Ok(Json(Done {}))
        } else {
            Err(Refusal::missing("found no such job that runs"))
        }
    })
    .await
}

/// What a job has said.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct JobLog {
    log: String,
}

pub(super) async fn queue_log(
    State(studio): Shared,
    Query(JobNumber { number }): Query<JobNumber>,
) -> Answer<JobLog> {
    work_on(&studio, move |studio| {
        let log = studio.queue.said(number).ok_or_else(|| Refusal::missing("found no such job"))?;
        Ok(Json(JobLog { log }))
    })
    .await
}

/// Several pieces of work.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

pub(super) async fn compared(State(studio): Shared, Query(many): Query<ManyAt>) -> Answer<compare::Compared> {
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

pub(super) async fn tune_begin(
    State(studio): Shared,
    Query(At { at }): Query<At>,
) -> Answer<tune::TuneBegin> {
    work_hard_on(&studio, move |studio| Ok(Json(tune::begin(&studio.root, &at)?))).await
}

/// Settings of vision in an address.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct LookAt {
    /// JSON of a [`tune::TuneRequest`].
    plan: String,
}

pub(super) async fn tune_look(
    State(studio): Shared,
    Query(LookAt { plan }): Query<LookAt>,
) -> Answer<tune::TuneLook> {
    let request: tune::TuneRequest = parsed(&plan)?;
    work_hard_on(&studio, move |studio| Ok(Json(tune::look(&studio.root, &request)?))).await
}

pub(super) async fn tune_write(
    State(studio): Shared,
    Sent(request): Sent<tune::TuneRequest>,
) -> Answer<tune::TuneFile> {
    work_hard_on(&studio, move |studio| Ok(Json(tune::write(studio, &request)?))).await
}
