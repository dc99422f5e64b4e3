//! What accuracy costs in time, measured for one design on one machine.
//!
//! For each solver that has a dial a [`Ladder`] goes from crude to far beyond need: the error of every rung against a
//! reference that is far better, and the median of its time. [`Budget`]s say what the errors mean for the position of
//! a dot and for a force, beside what printing and building add. The settings that a build takes are not chosen from
//! these measurements but from bounds ([`domecast_design::settings`]); the ladders show that the bounds hold.

pub mod budget;
mod chance;
pub mod chart;
pub mod clock;
mod contact;
mod files;
mod frames;
pub mod ladder;
mod lens;
mod light;
mod meshes;
mod outline;
mod page;
mod placement;
mod pose;
mod supersampling;
#[cfg(test)]
mod tests;
mod touch_scene;
mod tracking;

use std::fmt;

use serde::Serialize;

pub use budget::{Budget, Share};
pub use clock::{Patience, Timing};
pub use files::AccuracyFile;
pub use ladder::{Ladder, Law, Rung};

use domecast_design::layout::report::LayoutReport;
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_design::parts;
use domecast_design::parts::PartError;
use domecast_design::{Design, DesignError};
use domecast_design::{claims_of, suspension_of};
use domecast_fab::constants;
use domecast_fab::numbers::significant as sparse;
use domecast_sim::Scene;

/// What the measurement was made on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Machine {
    /// The processor's own name, where the system tells it.
    pub processor: String,
    /// Threads that run at once.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
}

impl Machine {
    fn here() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name =
            info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|p| p.1));
        Self {
            processor: name.unwrap_or("unknown").trim().to_owned(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }
}

/// One setting of the design, and why it is what it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingRecord {
    /// Its field.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Whether it was chosen from the design's `accuracy`.
    pub chosen: bool,
    /// Why.
    pub because: String,
}

/// Everything that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Accuracy {
    /// Name of the design.
    pub design: String,
    /// Version of domecast.
    pub version: &'static str,
    /// Where it was measured.
    pub machine: Machine,
    /// A first look: fewer runs, and no rungs that take long.
    pub quick: bool,
    /// The settings in use.
    pub settings: Vec<SettingRecord>,
    /// The dials.
    pub ladders: Vec<Ladder>,
    /// What the errors come to.
    pub budgets: Vec<Budget>,
    /// Frames that have to be averaged for the design's `accuracy.force_n`, where it gives one: at rest and under every
    /// claimed load, twice over.
    pub frames_to_average: Option<u32>,
    /// Dials that this design does not have, with the reason.
    pub left_out: Vec<String>,
}

/// Why nothing could be measured.
#[derive(Debug, Clone, PartialEq)]
pub enum AccuracyError {
    /// The design is at fault.
    Design(Box<DesignError>),
    /// A part of the design cannot be made.
    Part(PartError),
}

impl From<DesignError> for AccuracyError {
    fn from(error: DesignError) -> Self {
        Self::Design(Box::new(error))
    }
}

impl From<PartError> for AccuracyError {
    fn from(error: PartError) -> Self {
        Self::Part(error)
    }
}

impl fmt::Display for AccuracyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Design(error) => error.fmt(f),
            Self::Part(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for AccuracyError {}

/// Steps of [`measure`], for a progress bar.
pub const STEPS: u32 = 12;

/// Measures a design, and frames and runtime on a scene of it: the one that is given, or a ball pressed onto it;
/// `step` is told how many of [`STEPS`] are done and what comes next.
///
/// # Errors
/// What a build of the design would say.
pub fn measure(
    design: &Design,
    scene: Option<&Scene>,
    quick: bool,
    step: &mut dyn FnMut(u32, &str),
) -> Result<Accuracy, AccuracyError> {
    let patience = if quick { Patience::QUICK } else { Patience::FULL };
    let asked = design.sections().accuracy.as_ref();
    let settings = design.settings();
    step(0, "laying out and making the parts");
    let as_design = |error: domecast_design::layout::LayoutError| DesignError::from(error);
    let spec = LayoutSpec::of_design(design).map_err(as_design)?;
    let layout = Layout::new(&spec).map_err(as_design)?;
    let judged = LayoutReport::new(design, &spec, &layout);
    let constants = constants::of(design, &layout)?;
    let parts = parts::build(&parts::Measures::of(design)?, &layout.hits)?;

    let (mut ladders, mut left_out) = (Vec::new(), Vec::new());
    let mut keep = |ladder: Option<Ladder>, otherwise: &str| match ladder {
        Some(ladder) => ladders.push(ladder),
        None => left_out.push(otherwise.to_owned()),
    };
    let image_px = asked.map(|asked| asked.image_px);
    step(1, "the lens's inverse");
    keep(
        lens::ladder(design.optics().lens(), &layout, image_px, patience),
        "the lens's inverse: a pinhole has no distortion to invert",
    );
    step(2, "dots on the dome");
    let placement_mm = asked.map(|asked| asked.dot_placement_mm);
    keep(
        placement::ladder(design.optics(), &layout, placement_mm, patience),
        "dots on the dome: the optics have no model without refraction",
    );
    step(3, "outlines");
    let in_use_mm = settings.outline_tolerance_mm.value;
    keep(outline::ladder(&spec, &layout, in_use_mm, placement_mm, patience), "outlines: no dot is printed");
    step(4, "meshes");
    let mesh = meshes::ladder(
        &parts,
        settings.chord_tolerance_mm.value,
        asked.map(|asked| asked.mesh_mm),
        patience,
        quick,
    );
    keep(Some(mesh.map_err(|error| PartError::Mesh { part: "ladder".into(), error })?), "");
    step(5, "poses");
    let force_n = asked.map(|asked| asked.force_n);
    keep(pose::ladder(&constants, force_n, patience), "poses: the white markers cannot be followed");
    step(6, "drawn sensors");
    keep(
        chance::ladder(
            &spec,
            &layout,
            &design.sections().tolerances,
            settings.samples.value,
            image_px,
            patience,
            quick,
        ),
        "drawn sensors: too few of them see all dots",
    );
    step(7, "a touch");
    let px_per_mm = budget::scales(design.optics(), &layout).map(|(px_per_mm, _)| px_per_mm);
    let touch_mm = image_px.zip(px_per_mm).map(|(px, px_per_mm)| px / px_per_mm);
    match contact::ladder(design, &layout, touch_mm, patience, quick) {
        Ok(ladder) => keep(Some(ladder), ""),
        Err(error) => keep(None, &format!("a touch: {error}")),
    }
    step(8, "light");
    let own;
    let scene = match scene {
        Some(scene) => Ok(scene),
        None => {
            own = touch_scene::of(design);
            own.as_ref().map_err(ToString::to_string)
        }
    };
    match scene.clone().and_then(|scene| light::ladders(scene, patience, quick).map_err(|e| e.to_string())) {
        Ok(found) if found.is_empty() => keep(None, "light: the scene has none of the design's lights"),
        Ok(found) => found.into_iter().for_each(|ladder| keep(Some(ladder), "")),
        Err(error) => keep(None, &format!("light: {error}")),
    }
    step(9, "frames");
    let grey = scene.as_ref().ok().map(|scene| scene.file().tolerance.grey);
    let image = design.optics().lens().spec();
    keep(
        supersampling::ladder(&layout, (image.width as usize, image.height as usize), grey, patience, quick),
        "edges of dots: the pattern has none",
    );
    match scene.and_then(|scene| frames::ladder(scene, quick).map_err(|error| error.to_string())) {
        Ok((ladder, sequence)) => {
            keep(Some(ladder), "");
            step(10, "the runtime");
            let tracker = tracking::ladder(&constants, &sequence, patience);
            keep(tracker, "the runtime: the scene draws no frames, or the constants fit no tracker");
        }
        Err(error) => keep(None, &format!("frames and the runtime: {error}")),
    }
    step(11, "what it comes to");
    let budgets: Vec<Budget> =
        [budget::of_dots(design, &layout, &judged, &ladders), budget::of_force(design, &constants, &ladders)]
            .into_iter()
            .flatten()
            .collect();
    let frames_to_average = suspension_of(design).ok().and_then(|suspension| {
        let held = claims_of(design, &suspension);
        let poses: Vec<_> =
            held.iter().filter_map(|case| Some(case.equilibrium.as_ref().ok()?.pose)).collect();
        constants::frames_to_average(design, &suspension, &poses)
    });
    let mm = |s: &domecast_design::settings::Setting<f64>| SettingRecord {
        field: s.field,
        value: s.value,
        chosen: s.chosen,
        because: s.because.clone(),
    };
    let samples = &settings.samples;
    Ok(Accuracy {
        design: design.name().to_owned(),
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::here(),
        quick,
        settings: vec![
            mm(&settings.outline_tolerance_mm),
            mm(&settings.chord_tolerance_mm),
            mm(&settings.optical_chord_tolerance_mm),
            SettingRecord {
                field: samples.field,
                value: f64::from(samples.value),
                chosen: samples.chosen,
                because: samples.because.clone(),
            },
        ],
        ladders,
        budgets,
        frames_to_average,
        left_out,
    })
}
