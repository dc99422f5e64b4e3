//! What a browser asks for, and whether it may.

/// Bytes at most of a request's head.
pub(super) const MAX_HEAD_BYTES: usize = 8192;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Route {
    Page,
    Script,
    Style,
    Events,
}

/// Why an answer is refused: code and phrase of the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Refusal(pub u16, pub &'static str);

const BAD: Refusal = Refusal(400, "Bad Request");
const FORBIDDEN: Refusal = Refusal(403, "Forbidden");

/// Reads the head of a request (all before the empty line) to the server at a port of this machine.
///
/// A page of another site may send requests here too, from a browser of this machine: it names itself in `Origin` or
/// `Sec-Fetch-Site`, and is refused. One that had its own name lead to 127.0.0.1 (DNS rebinding) names that in `Host`.
pub(super) fn route(head: &[u8], port: u16) -> Result<Route, Refusal> {
    let head = std::str::from_utf8(head).map_err(|_| BAD)?;
    let mut lines = head.split("\r\n");
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (Some(method), Some(target), Some(version), None) =
        (words.next(), words.next(), words.next(), words.next())
    else {
        return Err(BAD);
    };
    if !version.starts_with("HTTP/1.") {
        return Err(BAD);
    }
    let names = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_ours = |host: &str| names.iter().any(|name| name.eq_ignore_ascii_case(host));
    let (mut hosts, mut is_same_site) = (0, true);
    for line in lines.filter(|line| !line.is_empty()) {
        let Some((name, value)) = line.split_once(':') else { return Err(BAD) };
        let value = value.trim_matches([' ', '\t']);
        if name.eq_ignore_ascii_case("host") {
            hosts += 1;
            if !is_ours(value) {
                return Err(FORBIDDEN);
            }
        } else if name.eq_ignore_ascii_case("origin") {
            if !value.strip_prefix("http://").is_some_and(is_ours) {
                return Err(FORBIDDEN);
            }
        } else if name.eq_ignore_ascii_case("sec-fetch-site") {
            is_same_site = matches!(value, "same-origin" | "none");
        }
    }
    if hosts != 1 {
        return Err(BAD);
    }
    if method != "GET" {
        return Err(Refusal(405, "Method Not Allowed"));
    }
    let route = match target {
        "/" => Route::Page,
        "/live.js" => Route::Script,
        "/live.css" => Route::Style,
        "/events" => Route::Events,
        _ => return Err(Refusal(404, "Not Found")),
    };
    // a link to the page may stand anywhere; what the page loads is loaded by the page alone
    if is_same_site || route == Route::Page { Ok(route) } else { Err(FORBIDDEN) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(lines: &[&str]) -> Result<Route, Refusal> {
        route(lines.join("\r\n").as_bytes(), 8000)
    }

    #[test]
    fn only_this_machine_by_its_own_names_is_answered() {
        for host in ["127.0.0.1:8000", "localhost:8000", "LocalHost:8000"] {
            assert_eq!(ask(&["GET / HTTP/1.1", &format!("Host: {host}")]), Ok(Route::Page));
            let origin = format!("Origin: http://{host}");
            assert_eq!(ask(&["GET /events HTTP/1.1", &format!("host:{host}"), &origin]), Ok(Route::Events));
        }
        let evil = [
            "evil.example:8000",
            "evil.example",
            "127.0.0.1",
            "127.0.0.1:8001",
            "127.0.0.1:8000.evil.example",
            "localhost.evil.example:8000",
            "[::1]:8000",
            "0.0.0.0:8000",
            "",
        ];
        for host in evil {
            for target in ["/", "/events", "/live.js", "/nothing"] {
                let line = format!("GET {target} HTTP/1.1");
                assert_eq!(ask(&[&line, &format!("Host: {host}")]), Err(FORBIDDEN), "{host}");
                let origin = format!("Origin: http://{host}");
                assert_eq!(ask(&[&line, "Host: localhost:8000", &origin]), Err(FORBIDDEN), "{host}");
            }
        }
        let host = "Host: localhost:8000";
        for origin in ["null", "https://localhost:8000", "file://", "http://localhost:8000/"] {
            assert_eq!(ask(&["GET / HTTP/1.1", host, &format!("Origin: {origin}")]), Err(FORBIDDEN));
        }
        assert_eq!(ask(&["GET /events HTTP/1.1", host, "Sec-Fetch-Site: cross-site"]), Err(FORBIDDEN));
        assert_eq!(ask(&["GET / HTTP/1.1", host, "Sec-Fetch-Site: cross-site"]), Ok(Route::Page));
        assert_eq!(ask(&["GET /events HTTP/1.1", host, "Sec-Fetch-Site: same-origin"]), Ok(Route::Events));
    }

    #[test]
    fn what_is_no_request_is_refused() {
        let host = "Host: localhost:8000";
        assert_eq!(ask(&["GET / HTTP/1.1"]), Err(BAD));
        assert_eq!(ask(&["GET / HTTP/1.1", host, host]), Err(BAD));
        assert_eq!(ask(&["GET / HTTP/2", host]), Err(BAD));
        assert_eq!(ask(&["GET  / HTTP/1.1", host]), Err(BAD));
        assert_eq!(ask(&["GET / HTTP/1.1", host, "nonsense"]), Err(BAD));
        assert_eq!(ask(&["POST / HTTP/1.1", host]), Err(Refusal(405, "Method Not Allowed")));
        assert_eq!(ask(&["GET /../x HTTP/1.1", host]), Err(Refusal(404, "Not Found")));
        assert_eq!(route(b"\xff\xfe", 8000), Err(BAD));
    }
}
