//! Routes of evolutions and drawings.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Query, State};
use axum::http::HeaderMap;
use axum::response::Response;
use serde::{Deserialize, Serialize};
use tropism_lab::evolve::EvolutionRecord;
use tropism_lab::holder;
use tropism_page::{Drawing, ShownChampion, TriedBean};

use super::{Answer, At, Ended, Sent, Shared, end, last_id, open_stream, work_on};
use crate::error::Refusal;
use crate::evolution::AboutEvolution;
use crate::found::{Kind, resolve_kind};
use crate::items::name_of;
use crate::{Studio, assets, draw, evolution, stream};

pub(super) async fn pause(State(studio): Shared, Sent(At { at }): Sent<At>) -> Answer<Ended> {
    end(&studio, at, Kind::Evolution).await
}

pub(super) async fn evolution_about(
    State(studio): Shared,
    Query(At { at }): Query<At>,
) -> Answer<AboutEvolution> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        Ok(Json(evolution::about(&folder, &at, name_of(&studio.root, &at))?))
    })
    .await
}

/// The evolution that lies `at` below the folder, kept up to date from now on.
pub(super) fn followed_evolution(
    studio: &Studio,
    at: &str,
) -> Result<stream::Latest<evolution::EvolutionView>, Refusal> {
    let mut reader = evolution::EvolutionReader::new(resolve_kind(&studio.root, at, Kind::Evolution)?);
    Ok(studio.evolutions.listen(at, evolution::PAUSE, move |before| reader.read(before)))
}

/// The page of an evolution, which is read while the browser loads scripts and styles.
pub(super) async fn evolution_page(
    State(studio): Shared,
    Query(At { at }): Query<At>,
    headers: HeaderMap,
) -> Response {
    let _ = followed_evolution(&studio, &at);
    assets::page("evolution.html", &headers)
}

pub(super) async fn evolution_events(
    State(studio): Shared,
    Query(At { at }): Query<At>,
    headers: HeaderMap,
) -> Result<Response, Refusal> {
    let evolution = followed_evolution(&studio, &at)?;
    let (events, response) = open_stream(&studio, &headers);
    events.follow(None, evolution, last_id(&headers));
    Ok(response)
}

/// A run of an evolution; the champion of all by default.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct RunAt {
    #[serde(default)]
    at: String,
    run: Option<u32>,
}

pub(super) async fn champion(
    State(studio): Shared,
    Query(RunAt { at, run }): Query<RunAt>,
) -> Answer<ShownChampion> {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        Ok(Json(evolution::champion(&folder, run)?))
    })
    .await
}

pub(super) async fn go_on(State(studio): Shared, Sent(At { at }): Sent<At>) -> Answer<Queued> {
    evolve_on(&studio, at, None).await
}

/// An evolution and the generations that it is to have.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Extend {
    #[serde(default)]
    at: String,
    generations: u32,
}

pub(super) async fn extend(
    State(studio): Shared,
    Sent(Extend { at, generations }): Sent<Extend>,
) -> Answer<Queued> {
    evolve_on(&studio, at, Some(generations)).await
}

/// Work that waits in the queue.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Queued {
    /// Number of its job.
    job: u64,
}

/// Puts the rest of an evolution into the queue.
pub(super) async fn evolve_on(studio: &Arc<Studio>, at: String, generations: Option<u32>) -> Answer<Queued> {
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
        let job = studio.queue.add(&at, vec![words]).map_err(|error| Refusal::bad(error.to_string()))?;
        Ok(Json(Queued { job }))
    })
    .await
}

pub(super) async fn reach(State(studio): Shared) -> Answer<draw::ToldReach> {
    work_on(&studio, |_| Ok(Json(draw::reach()))).await
}

/// Files of models in the folder.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Models {
    models: Vec<String>,
}

pub(super) async fn models(State(studio): Shared) -> Answer<Models> {
    work_on(&studio, |studio| Ok(Json(Models { models: draw::models(&studio.root) }))).await
}

pub(super) async fn try_out(State(studio): Shared, Query(plan): Query<draw::TryPlan>) -> Answer<TriedBean> {
    work_on(&studio, move |studio| Ok(Json(draw::try_out(studio, &plan)?))).await
}

/// A drawing in an address.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Drawn {
    /// JSON of a [`Drawing`].
    drawing: String,
}

/// The task file of a drawing, and the best fitness that there can be.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct DrawnTask {
    task: String,
    best: Option<f64>,
}

pub(super) async fn task_text(Query(Drawn { drawing }): Query<Drawn>) -> Answer<DrawnTask> {
    let drawing = Drawing::read(&drawing)?;
    Ok(Json(DrawnTask { task: drawing.to_toml()?, best: drawing.best()? }))
}

pub(super) async fn draw_evolve(
    State(studio): Shared,
    Sent(request): Sent<draw::EvolveRequest>,
) -> Answer<draw::Evolving> {
    work_on(&studio, move |studio| Ok(Json(draw::evolve(studio, &request)?))).await
}

/// A drawing that is to be a task file.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Save {
    name: String,
    drawing: Drawing,
    /// Whether it takes the place of another task of this name.
    #[serde(default)]
    replace: bool,
}

pub(super) async fn draw_save(
    State(studio): Shared,
    Sent(Save { name, drawing, replace }): Sent<Save>,
) -> Answer<draw::SavedTask> {
    work_on(&studio, move |studio| Ok(Json(draw::save(studio, &name, &drawing, replace)?))).await
}
