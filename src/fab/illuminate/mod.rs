//! The light of a design as it stands, place by place: how bright, how even, how well it tells normals, and where a colour
//! is missing. `domecast illuminate` writes it.

mod crescents;
mod maps;
mod measure;
mod numbers;
pub mod optimize;
mod page;
mod search_page;
mod tilt;

pub use crescents::Crescent;
pub use maps::Map;
pub use measure::{GRID, POLAR_ANGLES_DEG};
pub use numbers::{DotContrast, IlluminationReport, LightEvenness, LightsSeen, Percentiles, Places, Within};

use domecast_design::{Design, DesignError};
use optimize::Optimization;
pub use tilt::{TiltCurve, TiltPoint, TiltStudy};

/// Numbers and maps of a design's light.
#[derive(Debug, Clone)]
pub struct IlluminationCheck {
    /// The numbers.
    pub report: IlluminationReport,
    /// Maps over the dome and in the image.
    pub maps: Vec<Map>,
    /// What tilt and diffuser would do.
    pub tilt: TiltStudy,
}

impl IlluminationCheck {
    /// Looks at a design under its own lights.
    ///
    /// # Errors
    /// Those of the build's check of the light ([`crate::light::LightCheck::of`]): no light, lights that do not fit the
    /// design, a dome too dark for `track`. And a colour of which there is no light.
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        let (report, light) = measure::measure(design)?;
        let maps = maps::maps(design, &light, &report)?;
        Ok(Self { report, maps, tilt: TiltStudy::of(design)? })
    }

    /// Name and content of each file: `illuminate.json`, `tilt.json`, the maps, the page; those of a search besides.
    pub fn files(&self, searched: Option<&Optimization>) -> Vec<(String, Vec<u8>)> {
        // numbers, strings and lists only: nothing here can fail to be written
        let numbers = serde_json::to_string(&self.report).unwrap_or_default() + "\n";
        let mut files = vec![("illuminate.json".to_owned(), numbers.into_bytes())];
        files.extend(self.maps.iter().map(|map| (format!("{}.png", map.name), map.png.clone())));
        files.push(("tilt.json".into(), self.tilt.to_json().into_bytes()));
        files.extend(searched.into_iter().flat_map(Optimization::files));
        let page = page::page(&self.report, &self.maps, &self.tilt, searched);
        files.push(("index.html".into(), page.into_bytes()));
        files
    }
}
