//! What every request passes: the `Host`, the session, the check of changes; and the headers of every answer.

use std::net::IpAddr;
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Redirect, Response};

use crate::Studio;
use crate::access::{Right, Session};
use crate::error::Refusal;
use crate::wire::Peer;

/// The header that carries the session's word with each change.
pub(crate) const CSRF: HeaderName = HeaderName::from_static("x-tropism-csrf");

/// Nothing is loaded but what this program serves; no script stands in a page.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
     connect-src 'self'; manifest-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'";

/// What a program reads that has no session, but a token.
const METRICS: &str = "/metrics";

/// The token that a program sends with a request for numbers, and its address.
fn bearer(request: &Request) -> Option<(String, IpAddr)> {
    let Peer(from) = *request.extensions().get::<Peer>()?;
    let value = request.headers().get(header::AUTHORIZATION).filter(|_| request.uri().path() == METRICS)?;
    Some((value.to_str().ok()?.strip_prefix("Bearer ")?.to_owned(), from))
}

/// What may be asked for without a session.
fn is_for_everybody(path: &str) -> bool {
    matches!(path, "/login" | "/api/login" | "/api/session") || path.starts_with("/assets/")
}

/// Lets a request pass, or refuses it.
pub(crate) async fn gate(State(studio): State<Arc<Studio>>, mut request: Request, next: Next) -> Response {
    let path = request.uri().path();
    let is_page = request.method() == Method::GET && !path.starts_with("/api/") && path != METRICS;
    if let Some((token, from)) = bearer(&request)
        && let Some(session) = studio.access.looks(&token, from)
    {
        request.extensions_mut().insert(session);
    }
    let mut response = match check(&studio, &request) {
        Ok(session) => {
            if let Some(session) = session {
                request.extensions_mut().insert(session);
            }
            next.run(request).await
        }
        Err(Refusal(StatusCode::UNAUTHORIZED, _)) if is_page => to_log_in(request.uri()).into_response(),
        Err(refusal) => refusal.into_response(),
    };
    let headers = response.headers_mut();
    let mut set = |name: HeaderName, value: &'static str| {
        headers.entry(name).or_insert(HeaderValue::from_static(value));
    };
    set(header::CONTENT_SECURITY_POLICY, POLICY);
    set(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    set(header::REFERRER_POLICY, "no-referrer");
    set(header::CACHE_CONTROL, "no-store");
    set(HeaderName::from_static("cross-origin-opener-policy"), "same-origin");
    set(HeaderName::from_static("cross-origin-resource-policy"), "same-origin");
    response
}

/// To the page where one logs in, which leads back to `asked`. Relative, so that it also holds behind a proxy with a path of
/// its own.
fn to_log_in(asked: &Uri) -> Redirect {
    let own = asked.path_and_query().map_or("", |own| own.as_str()).trim_start_matches('/');
    if own.is_empty() {
        return Redirect::to("login");
    }
    Redirect::to(&format!("login?to={}", form_encoded(own)))
}

/// A value of an address as browsers write it (`application/x-www-form-urlencoded`): else they would not know the photograph
/// that they have for the one that the page asks for.
pub(crate) fn form_encoded(text: &str) -> String {
    let letter = |byte: u8| match byte {
        b' ' => "+".to_owned(),
        byte if byte.is_ascii_alphanumeric() || b"*-._".contains(&byte) => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    text.bytes().map(letter).collect()
}

fn check(studio: &Studio, request: &Request) -> Result<Option<Session>, Refusal> {
    let headers = request.headers();
    let host = host_of(request).ok_or_else(|| Refusal::bad("the request names no host"))?;
    if !is_allowed(&host, &studio.hosts) {
        return Err(Refusal(
            StatusCode::MISDIRECTED_REQUEST,
            format!(
                "found the host {host:?}, wanted a number, localhost, a name that ends in .local, or one of --host"
            ),
        ));
    }
    let path = request.uri().path();
    let session = studio.access.session(cookie(headers, &studio.cookie));
    let session = session.or_else(|| request.extensions().get::<Session>().cloned());
    let is_change = !matches!(*request.method(), Method::GET | Method::HEAD);
    if is_change {
        check_same_site(headers, &host)?;
    } else if path.starts_with("/api/") {
        check_not_embedded(headers)?;
    }
    if path == "/api/login" || (!is_change && is_for_everybody(path)) {
        return Ok(session);
    }
    let Some(session) = session else {
        return Err(Refusal(StatusCode::UNAUTHORIZED, "log in first".to_owned()));
    };
    if is_change {
        let word = headers.get(CSRF).map_or(&b""[..], HeaderValue::as_bytes);
        if !is_same(word, session.csrf.as_bytes()) {
            return Err(Refusal::forbidden(
                "found a change that does not come from a page of this studio; load the page again",
            ));
        }
        let may_change = !studio.read_only && session.right == Right::Change;
        if !may_change && path != "/api/logout" {
            return Err(Refusal::forbidden("this studio is for looking only"));
        }
    }
    Ok(Some(session))
}

/// Compares in a time that does not depend on what is found.
fn is_same(one: &[u8], other: &[u8]) -> bool {
    one.len() == other.len() && one.iter().zip(other).fold(0, |sum, (a, b)| sum | (a ^ b)) == 0
}

/// Refuses what the page of another site loads, as a picture for example: it would start work here.
fn check_not_embedded(headers: &HeaderMap) -> Result<(), Refusal> {
    match headers.get("sec-fetch-site") {
        Some(site) if site != "same-origin" && site != "none" => {
            Err(Refusal::forbidden("the request comes from another site, not from a page of this studio"))
        }
        _ => Ok(()),
    }
}

/// Refuses what another site sends: browsers name the origin of each change.
fn check_same_site(headers: &HeaderMap, host: &str) -> Result<(), Refusal> {
    let foreign = || Refusal::forbidden("the change comes from another site, not from a page of this studio");
    if let Some(site) = headers.get("sec-fetch-site")
        && site != "same-origin"
    {
        return Err(foreign());
    }
    if let Some(origin) = headers.get(header::ORIGIN) {
        let origin = origin.to_str().map_err(|_| foreign())?;
        let (_, authority) = origin.split_once("://").ok_or_else(foreign)?;
        // Without the ports: a proxy may pass on the name alone. The word of the session is checked as well.
        if without_port(authority) != Some(without_port(host).unwrap_or(host)) {
            return Err(foreign());
        }
    }
    Ok(())
}

fn host_of(request: &Request) -> Option<String> {
    let mut named = request.headers().get_all(header::HOST).iter();
    let (first, second) = (named.next(), named.next());
    // Two hosts are none.
    let host = match (first, second, request.uri().authority()) {
        (Some(host), None, None) => host.to_str().ok()?.to_owned(),
        (None, None, Some(authority)) => authority.to_string(),
        (Some(host), None, Some(authority)) if host.to_str().ok()? == authority.as_str() => {
            authority.to_string()
        }
        _ => return None,
    };
    Some(host.to_ascii_lowercase())
}

/// The name or number of `NAME:PORT` or `[NUMBER]:PORT`; `None` if it is neither.
fn without_port(host: &str) -> Option<&str> {
    let (name, port) = match host.strip_prefix('[') {
        Some(rest) => {
            let (number, after) = rest.split_once(']')?;
            (number, if after.is_empty() { None } else { Some(after.strip_prefix(':')?) })
        }
        None => host.split_once(':').map_or((host, None), |(name, port)| (name, Some(port))),
    };
    port.is_none_or(|port| port.parse::<u16>().is_ok()).then_some(name)
}

/// Whether a `Host` is one that nobody else can point to this computer: a number, `localhost`, a name of the local network,
/// or one that the user named.
fn is_allowed(host: &str, named: &[String]) -> bool {
    let Some(name) = without_port(host) else { return false };
    let name = name.strip_suffix('.').unwrap_or(name);
    let is_plain = |name: &str| {
        !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._".contains(&byte))
    };
    name.parse::<IpAddr>().is_ok()
        || name == "localhost"
        || (is_plain(name) && name.len() > ".local".len() && name.ends_with(".local"))
        || named.iter().any(|one| one.eq_ignore_ascii_case(name))
}

/// The value of the cookie `name`.
pub(crate) fn cookie<'h>(headers: &'h HeaderMap, name: &str) -> Option<&'h str> {
    let all = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    all.flat_map(|value| value.split(';')).find_map(|pair| pair.trim().strip_prefix(name)?.strip_prefix('='))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_that_others_can_point_here_are_refused() {
        let named = ["beans.example.org".to_owned()];
        for host in [
            "127.0.0.1:8217",
            "127.0.0.1",
            "[::1]:8217",
            "[::1]",
            "localhost:1",
            "localhost.",
            "greenhouse.local:8217",
            "192.168.1.20",
            "beans.example.org:443",
        ] {
            assert!(is_allowed(host, &named), "{host}");
        }
        for host in [
            "",
            "example.org",
            "localhost.example.org",
            "127.0.0.1.example.org",
            "example.org:8217",
            ".local",
            "a b.local",
            "local",
            "127.0.0.1:x",
            "[::1",
            "127.0.0.1@example.org",
            "localhost:99999",
        ] {
            assert!(!is_allowed(host, &named), "{host}");
        }
    }

    #[test]
    fn values_are_encoded_as_browsers_do() {
        assert_eq!(form_encoded("a b/ä&=~*-._9"), "a+b%2F%C3%A4%26%3D%7E*-._9");
    }

    #[test]
    fn a_cookie_is_found_among_others() {
        let mut headers = HeaderMap::new();
        headers.insert(header::COOKIE, HeaderValue::from_static("a=1; studio=word; studiox=2"));
        assert_eq!(cookie(&headers, "studio"), Some("word"));
        assert_eq!(cookie(&headers, "tudio"), None);
    }
}
