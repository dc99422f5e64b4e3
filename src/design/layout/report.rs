//! The report of a layout: what is written to `artwork/layout.json`.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::report::LayoutReport;
//! use domecast_design::layout::{Layout, LayoutSpec};
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! let spec = LayoutSpec::of_design(&design)?;
//! let report = LayoutReport::new(&design, &spec, &Layout::new(&spec)?);
//! for line in report.headlines() {
//!     println!("{line}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::Serialize;

use super::coverage::{DomeCoverage, coverage};
use super::evenness::{self, EvennessReport, PinholeComparison};
use super::key::{KeyImage, PatternKey};
use super::tolerances::{self, ToleranceReport};
use super::window::Window;
use super::{DotSize, Layout, LayoutSpec};
use crate::spec::Design;
use crate::suspension::{claims_of, suspension_of};
use domecast_optics::SensorOptics;

/// A layout's report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayoutReport {
    /// Dots laid out.
    pub dots: usize,
    /// Distance of neighbours in the frame of the pattern, px.
    pub pitch_px: f64,
    /// Diameter of the dots in that frame, px; null where they are equal on the dome.
    pub dot_diameter_px: Option<f64>,
    /// Smallest and largest diameter on the dome, mm.
    pub dot_diameter_mm: [f64; 2],
    /// Dots of the pattern that are left out.
    pub lost: Vec<LostRecord>,
    /// The dot left out so that a turned or mirrored picture shows itself; null where there is none.
    pub key: Option<KeyRecord>,
    /// The print passes.
    #[serde(rename = "hits")]
    pub passes: Vec<PassRecord>,
    /// How even the pattern is by design; null where no dot has a neighbour.
    pub evenness: Option<EvennessReport>,
    /// The same pattern laid out without refraction, seen through the real layers.
    pub pinhole_alone: Option<PinholeComparison>,
    /// What the design's tolerances do to it.
    pub tolerances: Option<ToleranceReport>,
    /// What the camera covers, at rest and under each load that the design claims.
    pub coverage: Vec<CoverageRecord>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// A dot that is left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LostRecord {
    /// Its number.
    pub id: u32,
    /// Its centre in the raw image, px, where it has one.
    pub image_px: Option<[f64; 2]>,
    /// Why, by name.
    pub reason: &'static str,
    /// Why, in words.
    pub because: String,
}

/// The dot left out so that a turned or mirrored picture shows itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeyRecord {
    /// Where it would be in the raw image, px.
    pub image_px: [f64; 2],
    /// Where it would be on the dome, degrees from the pole.
    pub polar_deg: f64,
    /// The dots where a turned or mirrored picture would show the gap.
    pub images: Vec<u32>,
    /// Why it is this one, in words.
    pub because: String,
}

impl KeyRecord {
    fn new(layout: &Layout, key: &PatternKey) -> Self {
        let from_key = |image: &KeyImage| {
            layout.dots[image.dot as usize].image_px.distance(key.dot.image_px) / layout.pitch_px
        };
        let nearest = key.images.iter().map(from_key).fold(f64::INFINITY, f64::min);
        let polar_deg = key.dot.polar_rad().to_degrees();
        let because = format!(
            "the pattern maps onto itself by {} turns and mirrorings, so a turned or mirrored picture would pass for a \
             good one; this dot is left out because each of them leads to another dot, {nearest:.1} pitches away or \
             more, and because at {polar_deg:.0} degrees it is seen at rest and under load and prints safely",
            key.images.len(),
        );
        Self {
            image_px: key.dot.image_px.to_array(),
            polar_deg,
            images: key.images.iter().map(|image| image.dot).collect(),
            because,
        }
    }
}

/// A print pass.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PassRecord {
    /// Its film, from 1.
    pub film: usize,
    /// Tilt of the dome under the pad, degrees.
    pub tilt_deg: f64,
    /// Azimuth of the dome that is tilted up, degrees.
    pub azimuth_deg: f64,
    /// Dots that it prints.
    pub dots: usize,
    /// Angle from its stroke to its furthest dot, degrees.
    pub wrap_deg: f64,
}

/// Coverage at one load.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageRecord {
    /// `at rest`, or the name of the claimed load.
    pub load: String,
    /// The coverage; null where the load has no balance or leaves no room for the camera.
    pub coverage: Option<DomeCoverage>,
}

impl LayoutReport {
    /// Reports on a design's layout.
    pub fn new(design: &Design, spec: &LayoutSpec, layout: &Layout) -> Self {
        let diameters = layout.dots.iter().map(|dot| dot.diameter_mm);
        let (low, high) = diameters.fold((f64::INFINITY, 0.0f64), |(l, h), d| (l.min(d), h.max(d)));
        let coverage = coverages(design, spec, layout);
        let mut warnings = layout.warnings.clone();
        warnings.extend(lost_under_load(&coverage));
        Self {
            dots: layout.dots.len(),
            pitch_px: layout.pitch_px,
            dot_diameter_px: match layout.size {
                DotSize::Apparent(px) => Some(px),
                DotSize::OnDome(_) => None,
            },
            dot_diameter_mm: [low, high],
            lost: layout
                .lost
                .iter()
                .map(|dot| LostRecord {
                    id: dot.id,
                    image_px: dot.image_px.map(|px| px.to_array()),
                    reason: dot.reason.as_str(),
                    because: dot.reason.to_string(),
                })
                .collect(),
            key: layout.key.as_ref().map(|key| KeyRecord::new(layout, key)),
            passes: passes(layout),
            evenness: evenness::by_design(layout),
            pinhole_alone: evenness::by_pinhole(spec, layout),
            tolerances: tolerances::under_tolerances(spec, layout, &design.sections().tolerances),
            coverage,
            warnings,
        }
    }
}

impl LayoutReport {
    /// The main figures in words: how even the pattern is, the same pattern without refraction, and the tolerance that
    /// costs most.
    pub fn headlines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let percent = |variation: f64| 100.0 * variation;
        if let Some(own) = &self.evenness {
            lines.push(format!(
                "distances to the nearest dot vary by {:.2} % in the image, {:.1} % on the dome",
                percent(own.image_px.nearest.variation),
                percent(own.dome_mm.nearest.variation)
            ));
        }
        if let Some(pinhole) = &self.pinhole_alone {
            lines.push(format!(
                "laid out without refraction they would vary by {:.1} %, dots {:.2} mm off on average, {:.2} mm at most",
                percent(pinhole.image_px.nearest.variation),
                pinhole.mean_shift_mm,
                pinhole.max_shift_mm
            ));
        }
        if let Some(tolerances) = &self.tolerances
            && let Some(worst) = tolerances.ranking.first()
        {
            lines.push(format!(
                "within the tolerances 19 of 20 sensors vary by less than {:.1} %; {} costs most ({:.1} % alone)",
                percent(tolerances.nearest_variation_p95),
                worst.tolerance,
                percent(worst.added_variation)
            ));
        }
        lines
    }
}

fn passes(layout: &Layout) -> Vec<PassRecord> {
    let record = |(index, pass): (usize, &super::PrintPass)| {
        let dots = || layout.dots.iter().filter(move |dot| dot.pass == index);
        PassRecord {
            film: index + 1,
            tilt_deg: pass.tilt_rad.to_degrees(),
            azimuth_deg: pass.azimuth_rad.to_degrees(),
            dots: dots().count(),
            wrap_deg: dots().map(|dot| dot.wrap_rad).fold(0.0, f64::max).to_degrees(),
        }
    };
    layout.passes.iter().enumerate().map(record).collect()
}

fn coverages(design: &Design, spec: &LayoutSpec, layout: &Layout) -> Vec<CoverageRecord> {
    let mut positions = vec![("at rest".to_owned(), Some(spec.optics.clone()))];
    if let Ok(suspension) = suspension_of(design) {
        for (claim, case) in design.sections().loads.claims.iter().zip(claims_of(design, &suspension)) {
            let pose = case.equilibrium.ok().map(|found| found.displacement.to_pose(suspension.at_mm()));
            positions.push((claim.name.clone(), pose.and_then(|pose| spec.optics.at_pose(&pose).ok())));
        }
    }
    let window = Window::of_design(design, positions.iter().filter_map(|(_, optics)| optics.as_ref()));
    let look = |optics: SensorOptics| coverage(spec, layout, &optics, window.as_ref());
    positions.into_iter().map(|(load, optics)| CoverageRecord { load, coverage: optics.map(look) }).collect()
}

/// Warnings about dots that a load hides.
fn lost_under_load(coverage: &[CoverageRecord]) -> Vec<String> {
    let lost = coverage.iter().filter_map(|record| {
        let unseen = &record.coverage.as_ref()?.unseen_dots;
        let first = unseen.first()?;
        let (count, load) = (unseen.len(), &record.load);
        Some(format!(
            "{count} dots are not fully visible ({load}); the first, dot {}: {}",
            first.id, first.because
        ))
    });
    lost.collect()
}
