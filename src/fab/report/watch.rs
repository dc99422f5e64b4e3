//! A page that stays fresh while its design is being changed.

/// A page that reloads itself when the folder holds a newer build.
pub fn watched(page: &str) -> String {
    page.replacen("</body>", &format!("<script>\n{}</script>\n</body>", include_str!("fresh.js")), 1)
}

/// What a watched page asks for: the stamp of the newest build.
pub fn stamp(design_sha256: &str) -> String {
    format!("window.domecastBuild({design_sha256:?});\n")
}
