//! Routes of evolutions and drawings.

use std::sync::Arc;

use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;
use serde_json::json;
use tropism_lab::evolve::EvolutionRecord;
use tropism_lab::holder;
use tropism_page::Drawing;

use super::{Answer, At, Shared, end, last_id, open_stream, read, work_on};
use crate::error::Refusal;
use crate::found::{Kind, resolve_kind};
use crate::items::name_of;
use crate::{Studio, assets, draw, evolution, stream};

pub(super) async fn pause(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    end(&studio, at, Kind::Evolution).await
}

pub(super) async fn evolution_about(State(studio): Shared, Query(At { at }): Query<At>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        let mut about = evolution::about(&folder, &at)?;
        about["name"] = name_of(&studio.root, &at).into();
        Ok(Json(about))
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

#[derive(Deserialize)]
pub(super) struct RunAt {
    #[serde(default)]
    at: String,
    run: Option<u32>,
}

pub(super) async fn champion(State(studio): Shared, Query(RunAt { at, run }): Query<RunAt>) -> Answer {
    work_on(&studio, move |studio| {
        let folder = resolve_kind(&studio.root, &at, Kind::Evolution)?;
        Ok(Json(evolution::champion(&folder, run)?))
    })
    .await
}

pub(super) async fn go_on(State(studio): Shared, body: Body) -> Answer {
    let At { at } = read(body).await?;
    evolve_on(&studio, at, None).await
}

/// An evolution and the generations that it is to have.
#[derive(Deserialize)]
pub(super) struct Extend {
    #[serde(default)]
    at: String,
    generations: u32,
}

pub(super) async fn extend(State(studio): Shared, body: Body) -> Answer {
    let Extend { at, generations } = read(body).await?;
    evolve_on(&studio, at, Some(generations)).await
}

/// Puts the rest of an evolution into the queue.
pub(super) async fn evolve_on(studio: &Arc<Studio>, at: String, generations: Option<u32>) -> Answer {
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

pub(super) async fn reach(State(studio): Shared) -> Answer {
    work_on(&studio, |_| Ok(Json(json!(draw::reach())))).await
}

pub(super) async fn models(State(studio): Shared) -> Answer {
    work_on(&studio, |studio| Ok(Json(json!({ "models": draw::models(&studio.root) })))).await
}

pub(super) async fn try_out(State(studio): Shared, Query(plan): Query<draw::TryPlan>) -> Answer {
    work_on(&studio, move |studio| Ok(Json(draw::try_out(studio, &plan)?))).await
}

#[derive(Deserialize)]
pub(super) struct Drawn {
    /// JSON of a [`Drawing`].
    drawing: String,
}

/// The task file of a drawing, and the best fitness that there can be.
pub(super) async fn task_text(Query(Drawn { drawing }): Query<Drawn>) -> Answer {
    let drawing = Drawing::read(&drawing)?;
    Ok(Json(json!({ "task": drawing.to_toml()?, "best": drawing.best()? })))
}

pub(super) async fn draw_evolve(State(studio): Shared, body: Body) -> Answer {
    let request: draw::EvolveRequest = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(draw::evolve(studio, &request)?))).await
}

#[derive(Deserialize)]
pub(super) struct Save {
    name: String,
    drawing: Drawing,
    /// Whether it takes the place of another task of this name.
    #[serde(default)]
    replace: bool,
}

pub(super) async fn draw_save(State(studio): Shared, body: Body) -> Answer {
    let Save { name, drawing, replace } = read(body).await?;
    work_on(&studio, move |studio| Ok(Json(draw::save(studio, &name, &drawing, replace)?))).await
}
