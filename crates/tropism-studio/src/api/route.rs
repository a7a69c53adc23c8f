//! Routes that speak JSON: what each is asked and answers is in the types of its function.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{FromRequest, Query, Request};
use axum::handler::Handler;
use axum::http::StatusCode;
use axum::routing::{MethodRouter, get, post};
use axum::{Json, Router};
use serde::de::DeserializeOwned;

#[cfg(all(test, feature = "schema"))]
use super::types::Types;
use super::{BODY_COMES, MAX_BODY, Shared};
use crate::Studio;
use crate::error::Refusal;

/// What a page is sent: an answer, or a sentence that says why there is none.
pub(super) type Answer<T> = Result<Json<T>, Refusal>;

/// The answer to what has nothing to tell.
#[derive(serde::Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Done {}

/// The JSON of a body of bounded size that comes in bounded time.
pub(super) struct Sent<T>(pub(super) T);

impl<T: DeserializeOwned, S: Sync> FromRequest<S> for Sent<T> {
    type Rejection = Refusal;

    async fn from_request(request: Request, _: &S) -> Result<Self, Refusal> {
        read(request.into_body()).await.map(Self)
    }
}

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

/// A type whose schema can be made, where schemas are made.
#[cfg(feature = "schema")]
pub(crate) use schemars::JsonSchema as Typed;

/// Any type.
#[cfg(not(feature = "schema"))]
pub(crate) trait Typed {}

#[cfg(not(feature = "schema"))]
impl<T> Typed for T {}

/// A function that answers a request of the arguments `Args`: what it is asked, and what it answers.
pub(super) trait Endpoint<Args> {
    type Asked: Typed;
    type Answer: Typed;
}

/// An argument of such a function: what it says of the request.
pub(super) trait Argument {
    type Asked: Typed;
}

impl Argument for Shared {
    type Asked = ();
}

impl<Q: Typed> Argument for Query<Q> {
    type Asked = Q;
}

impl<B: Typed> Argument for Sent<B> {
    type Asked = B;
}

impl<F, R, X, A> Endpoint<(X,)> for F
where
    F: Fn(X) -> R,
    R: Future<Output = Answer<A>>,
    X: Argument,
    A: Typed,
{
    type Asked = X::Asked;
    type Answer = A;
}

impl<F, R, X, A> Endpoint<(Shared, X)> for F
where
    F: Fn(Shared, X) -> R,
    R: Future<Output = Answer<A>>,
    X: Argument,
    A: Typed,
{
    type Asked = X::Asked;
    type Answer = A;
}

/// Where types are not written, nobody keeps them.
#[cfg(not(all(test, feature = "schema")))]
#[derive(Default)]
pub(super) struct Types;

#[cfg(not(all(test, feature = "schema")))]
impl Types {
    fn add<Asked, Answer>(&mut self, _: &str, _: &str) {}
}

/// The routes, with the types of those that speak JSON.
#[derive(Default)]
pub(super) struct Routes {
    pub(super) router: Router<Arc<Studio>>,
    pub(super) types: Types,
}

impl Routes {
    /// A route whose types are no scripts' business.
    pub(super) fn route(mut self, path: &str, method: MethodRouter<Arc<Studio>>) -> Self {
        self.router = self.router.route(path, method);
        self
    }

    pub(super) fn get<H, M, Args>(self, path: &str, handler: H) -> Self
    where
        H: Handler<M, Arc<Studio>> + Endpoint<Args>,
        M: 'static,
    {
        self.typed::<H::Asked, H::Answer>("Gets", path, get(handler))
    }

    pub(super) fn post<H, M, Args>(self, path: &str, handler: H) -> Self
    where
        H: Handler<M, Arc<Studio>> + Endpoint<Args>,
        M: 'static,
    {
        self.typed::<H::Asked, H::Answer>("Posts", path, post(handler))
    }

    /// A route of the list `Gets` or `Posts` whose answer has more to it than JSON.
    pub(super) fn typed<Asked: Typed, A: Typed>(
        mut self,
        list: &'static str,
        path: &str,
        method: MethodRouter<Arc<Studio>>,
    ) -> Self {
        self.types.add::<Asked, A>(list, path);
        self.route(path, method)
    }
}
