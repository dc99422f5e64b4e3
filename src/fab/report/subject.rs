//! What the page is made from.

use crate::constants::ForceReport;
use crate::html::{Html, picture};
use domecast_design::Design;
use domecast_design::layout::Layout;
use domecast_design::layout::report::LayoutReport;
use domecast_design::parts::{Assembly, Part, PoseSight};
use domecast_runtime::constants::Constants;

/// What the page is made from.
#[derive(Clone, Copy)]
pub struct ReportSubject<'a> {
    /// The design.
    pub design: &'a Design,
    /// Its dots.
    pub layout: &'a Layout,
    /// What the layout came to.
    pub judged: &'a LayoutReport,
    /// The constants.
    pub constants: &'a Constants,
    /// Loads and resolution.
    pub forces: &'a ForceReport,
    /// The parts.
    pub parts: &'a [Part],
    /// The parts and stand-ins, put together.
    pub assembly: &'a Assembly,
    /// The traced rays of the image, by position of the platform.
    pub sight: &'a [PoseSight],
    /// Positions of the platform at which the assembly was checked, by name.
    pub poses: &'a [String],
    /// Field and message of each warning.
    pub warnings: &'a [(String, String)],
    /// SHA-256 of the design file.
    pub hash: &'a str,
    /// The files of the build so far, by path.
    pub files: &'a [(&'a str, &'a [u8])],
}

impl ReportSubject<'_> {
    /// A file of the build.
    pub(super) fn file(&self, path: &str) -> Option<&[u8]> {
        self.files.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
    }

    /// A picture of the build, in the page.
    pub(super) fn shown(&self, path: &str, alt: &str) -> Html {
        let mime = if path.ends_with(".svg") { "image/svg+xml" } else { "image/png" };
        self.file(path).map_or_else(Html::default, |bytes| picture(mime, bytes, alt))
    }
}
