//! Walls of nodes.

use axum::Json;
use axum::extract::{Query, State};
use tropism_page::{GrownBeforeWall, ShownWall};

use super::route::{Answer, Sent};
use super::{At, Shared, work_on};
use crate::wall;

pub(super) async fn walls(State(studio): Shared) -> Answer<wall::Walls> {
    work_on(&studio, |studio| Ok(Json(wall::walls(&studio.root)))).await
}

pub(super) async fn drawn(State(studio): Shared, Query(plan): Query<wall::DrawnWall>) -> Answer<ShownWall> {
    work_on(&studio, move |studio| Ok(Json(wall::drawn(studio, &plan)?))).await
}

pub(super) async fn try_out(
    State(studio): Shared,
    Query(plan): Query<wall::TryWall>,
) -> Answer<GrownBeforeWall> {
    work_on(&studio, move |studio| Ok(Json(wall::try_out(studio, plan)?))).await
}

pub(super) async fn watched(State(studio): Shared, Query(At { at }): Query<At>) -> Answer<wall::WatchedWall> {
    work_on(&studio, move |studio| Ok(Json(wall::watched(studio, &at)?))).await
}

pub(super) async fn save(State(studio): Shared, Sent(plan): Sent<wall::SaveWall>) -> Answer<wall::SavedWall> {
    work_on(&studio, move |studio| Ok(Json(wall::save(studio, plan)?))).await
}
