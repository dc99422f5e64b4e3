//! From a measured print to a better map: which mark stands where on the plate, and the fit.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::LayoutSpec;
//! use domecast_design::layout::calibrate::{Printed, calibrate};
//! use domecast_design::layout::target::print_target;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! // a print of the test target that landed where the design expects it
//! let spec = LayoutSpec::of_design(&design)?;
//! let mut table = "id,x_mm,y_mm\n".to_owned();
//! for mark in print_target(&spec.transfer()?, &spec.print) {
//!     table += &format!("{},{},{}\n", mark.id, mark.surface_mm.x, mark.surface_mm.y);
//! }
//! let calibration = calibrate(&design, &table, Some(Printed::Target))?;
//! assert!(calibration.error_after_mm < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DVec2, DVec3};

use super::target::print_target;
use super::{Layout, LayoutError, LayoutSpec};
use crate::spec::Design;
use crate::spec::sections::{MeasuredTransferSection, TransferMapName};
use crate::transfer::fit;
use crate::transfer::fit::{FitError, Sample, TransferFit};
use crate::transfer::measured_csv;
use crate::transfer::measured_csv::{MeasuredTable, PrintTableError};
use crate::transfer::{Nominal, TransferMap};

/// Which artwork was printed and measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Printed {
    /// The test target.
    Target,
    /// The design's own dots.
    Dots,
}

/// A measured map with its report.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Which artwork the marks belong to.
    pub printed: Printed,
    /// The fit.
    pub fit: TransferFit,
    /// The table that was read.
    pub table: MeasuredTable,
    /// The nominal map for the design's `print.transfer`.
    pub transfer: TransferMapName,
    /// The design's `print.measured`.
    pub measured: MeasuredTransferSection,
    /// Mean distance between where a mark should have landed by the design's present map and where it was
    /// found, outliers left out, mm.
    pub error_before_mm: f64,
    /// The same by the fitted map: what is left to scatter.
    pub error_after_mm: f64,
}

/// Why a measurement gives no map.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrateError {
    /// The table is at fault.
    Table(PrintTableError),
    /// The design's own layout failed.
    Layout(LayoutError),
    /// No map fits.
    Fit {
        /// What the fit says.
        error: FitError,
        /// The lines that it speaks of.
        lines: Vec<usize>,
    },
}

impl std::fmt::Display for CalibrateError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Table(error) => error.fmt(f),
            Self::Layout(error) => error.fmt(f),
            Self::Fit { error, lines } if lines.is_empty() => error.fmt(f),
            Self::Fit { error, lines } => {
                let listed: Vec<String> = lines.iter().take(20).map(usize::to_string).collect();
                let more = if lines.len() > 20 { ", .." } else { "" };
                write!(f, "{error} (lines {}{more})", listed.join(", "))
            }
        }
    }
}

impl std::error::Error for CalibrateError {}

impl From<PrintTableError> for CalibrateError {
    fn from(error: PrintTableError) -> Self {
        Self::Table(error)
    }
}

impl From<LayoutError> for CalibrateError {
    fn from(error: LayoutError) -> Self {
        Self::Layout(error)
    }
}

/// Where each mark of an artwork stands: on the plate, and on the dome by the present map.
struct KnownMarks {
    printed: Printed,
    /// By id: place on the plate, and the turn into the frame of its print pass.
    places: Vec<Option<(DVec2, glam::DMat3)>>,
}

/// Fits a measured map to a table for a design.
///
/// The ids may be those of the test target or those of the design's dots. Where `printed` does not say which,
/// the artwork is taken whose marks lie closer to where they were found: the two are far apart.
///
/// # Errors
/// See [`CalibrateError`].
pub fn calibrate(
    design: &Design,
    text: &str,
    printed: Option<Printed>,
) -> Result<Calibration, CalibrateError> {
    let spec = LayoutSpec::of_design(design)?;
    let transfer = spec.transfer()?;
    let table = measured_csv::read(text, transfer.dome_radius_mm())?;
    let mut known = Vec::new();
    if printed != Some(Printed::Dots) {
        known.push(target_marks(&spec, &transfer));
    }
    if printed != Some(Printed::Target) {
        match Layout::new(&spec) {
            Ok(layout) => known.push(dot_marks(&layout)),
            Err(error) if printed == Some(Printed::Dots) => return Err(error.into()),
            // The target can be measured before the pattern itself can be printed.
            Err(_) => {}
        }
    }
    let marks = choose(&known, &table, &transfer)?;
    let samples: Vec<Sample> = table
        .rows
        .iter()
        .filter_map(|row| {
            let (plate_mm, pass_from_sensor) = (*marks.places.get(row.id as usize)?)?;
            Some(Sample { plate_mm, landed: pass_from_sensor * row.landed, mark: row.id, print: row.print })
        })
        .collect();
    let radius_mm = transfer.dome_radius_mm();
    let fit = fit::fit(radius_mm, &samples, table.measured_in, spec.print.wrap_limit_deg.to_radians())
        .map_err(|error| {
            let lines = match &error {
                FitError::TooManyOutliers { samples, .. } => samples.clone(),
                FitError::NotFinite { sample } => vec![*sample],
                _ => Vec::new(),
            };
            let lines = lines.iter().filter_map(|i| table.rows.get(*i)).map(|row| row.line).collect();
            CalibrateError::Fit { error, lines }
        })?;
    let fitted = TransferMap::new(radius_mm, fit.nominal, Some(fit.correction.clone()))
        .map_err(|error| CalibrateError::Fit { error: FitError::Folds(error), lines: Vec::new() })?;
    let error_mm = |map: &TransferMap| {
        let kept = samples.iter().enumerate().filter(|(i, _)| fit.rejected.binary_search(i).is_err());
        let misses: Vec<f64> = kept
            .filter_map(|(_, sample)| Some((map.dome_from_plate(sample.plate_mm).ok()?, sample.landed)))
            .map(|(wanted, landed)| wanted.distance(landed.normalize() * radius_mm))
            .collect();
        misses.iter().sum::<f64>() / misses.len().max(1) as f64
    };
    let correction = &fit.correction;
    let measured = MeasuredTransferSection {
        radial: correction.radial.clone(),
        two_fold: correction.two_fold,
        two_fold_sideways: correction.two_fold_sideways,
        rotation_deg: correction.rotation_rad.to_degrees(),
        offset_mm: correction.offset_mm.to_array(),
        max_polar_deg: correction.max_polar_rad.to_degrees(),
        residual_rms_mm: Some(fit.residual_rms_mm),
        scatter_mm: fit.scatter_mm,
        points_used: u32::try_from(samples.len() - fit.rejected.len()).ok(),
        points_rejected: u32::try_from(fit.rejected.len()).ok(),
    };
    let name = match fit.nominal {
        Nominal::Orthographic => TransferMapName::Orthographic,
        Nominal::Equidistant => TransferMapName::Equidistant,
        Nominal::EqualArea => TransferMapName::EqualArea,
    };
    Ok(Calibration {
        printed: marks.printed,
        error_before_mm: error_mm(&transfer),
        error_after_mm: error_mm(&fitted),
        fit,
        table,
        transfer: name,
        measured,
    })
}

fn target_marks(spec: &LayoutSpec, transfer: &TransferMap) -> KnownMarks {
    let mut places = Vec::new();
    for mark in print_target(transfer, &spec.print) {
        let index = mark.id as usize;
        places.resize(places.len().max(index + 1), None);
        places[index] = Some((mark.plate_mm, glam::DMat3::IDENTITY));
    }
    KnownMarks { printed: Printed::Target, places }
}

fn dot_marks(layout: &Layout) -> KnownMarks {
    let place = |dot: &super::Dot| Some((dot.plate_mm, layout.passes[dot.pass].pass_from_sensor));
    KnownMarks { printed: Printed::Dots, places: layout.dots.iter().map(place).collect() }
}

/// The artwork to which the table belongs.
fn choose<'a>(
    known: &'a [KnownMarks],
    table: &MeasuredTable,
    transfer: &TransferMap,
) -> Result<&'a KnownMarks, PrintTableError> {
    let mut best: Option<(f64, &KnownMarks)> = None;
    let mut unknown = None;
    for marks in known {
        let mut misses = Vec::with_capacity(table.rows.len());
        let mut missing = None;
        for row in &table.rows {
            match marks.places.get(row.id as usize).copied().flatten() {
                Some((plate_mm, pass_from_sensor)) => {
                    let landed: DVec3 = pass_from_sensor * row.landed * transfer.dome_radius_mm();
                    // By the orthographic map, which has an answer for every point: only the size matters.
                    misses.push(landed.truncate().distance(plate_mm));
                }
                None => missing = missing.or(Some(row)),
            }
        }
        if let Some(row) = missing {
            unknown.get_or_insert((row, marks));
            continue;
        }
        misses.sort_by(f64::total_cmp);
        let middle = misses.get(misses.len() / 2).copied().unwrap_or(0.0);
        if best.as_ref().is_none_or(|(lowest, _)| middle < *lowest) {
            best = Some((middle, marks));
        }
    }
    best.map(|(_, marks)| marks).ok_or_else(|| {
        let (line, id, last) =
            unknown.map_or((1, 0, 0), |(row, marks)| (row.line, row.id, marks.places.len()));
        PrintTableError {
            line,
            column: "id".into(),
            value: id.to_string(),
            problem: "no mark of the design's test target, nor of its dots, has this number".into(),
            allowed: format!("a mark of the test target, 0 to {}", last.saturating_sub(1)),
        }
    })
}
