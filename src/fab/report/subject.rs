//! What the page is made from.

use tiny_skia::Pixmap;

use crate::constants::ForceReport;
use crate::html::{Html, html, picture};
use crate::led_board::Lights;
use crate::light::LightReport;
use domecast_design::Design;
use domecast_design::layout::Layout;
use domecast_design::layout::report::LayoutReport;
use domecast_design::parts::{Assembly, Part, PoseSight};
use domecast_runtime::constants::Constants;

/// Pictures in the page are at most this wide, px: twice what a column of it shows.
const MAX_SHOWN_WIDTH: u32 = 1000;

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
    /// The lit frame at rest in numbers.
    pub light: &'a LightReport,
    /// The lights' circuits and their board.
    pub lights: &'a Lights,
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
    /// What no file could be written for, and why.
    pub formats_left_out: &'a [String],
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
        self.picture(path, alt, "")
    }

    /// A picture on white, which a dark page may turn.
    pub(super) fn drawn(&self, path: &str, alt: &str) -> Html {
        self.picture(path, alt, "paper")
    }

    fn picture(&self, path: &str, alt: &str, class: &str) -> Html {
        let Some(bytes) = self.file(path) else { return Html::default() };
        if path.ends_with(".svg") {
            return picture("image/svg+xml", bytes, alt, class);
        }
        match smaller(bytes) {
            Some(small) => {
                html!("<a href=\"../{}\">{}</a>", path, picture("image/png", &small, alt, class))
            }
            None => picture("image/png", bytes, alt, class),
        }
    }
}

/// A PNG that is wider than the page shows it, with means of its pixels; `None` where it is no wider, or no PNG.
fn smaller(png: &[u8]) -> Option<Vec<u8>> {
    // width and height stand at fixed places of a PNG's header
    let width = u32::from_be_bytes(png.get(16..20)?.try_into().ok()?);
    let step = width.div_ceil(MAX_SHOWN_WIDTH);
    if step < 2 {
        return None;
    }
    let whole = Pixmap::decode_png(png).ok()?;
    let (wide, tall) = (whole.width() / step, whole.height() / step);
    let mut small = Pixmap::new(wide, tall)?;
    for (index, pixel) in small.data_mut().chunks_exact_mut(4).enumerate() {
        let (x, y) = (index as u32 % wide * step, index as u32 / wide * step);
        for (channel, value) in pixel.iter_mut().enumerate() {
            let under = (0..step * step).map(|k| (x + k % step, y + k / step));
            let sum: u32 = under
                .map(|(x, y)| u32::from(whole.data()[4 * (y * whole.width() + x) as usize + channel]))
                .sum();
            *value = (sum / (step * step)) as u8;
        }
    }
    small.encode_png().ok()
}
