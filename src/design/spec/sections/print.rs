//! Pad printing: how the plate's picture gets onto the dome.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// How a pad carries the plate's picture to the dome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TransferMapName {
    /// r = R sin(phi): the pad comes straight down.
    #[default]
    Orthographic,
    /// r = R phi: arc length is kept.
    Equidistant,
    /// r = 2 R sin(phi/2): area is kept.
    EqualArea,
}

/// A measured correction to the nominal map, as `domecast calibrate-print` writes it. With s = sin(phi):
/// radially r = r_nominal(phi) + R (c1 s + c3 s^3 + c5 s^5 ..) + R s (a cos 2 theta + b sin 2 theta), sideways
/// R s (c cos 2 theta + d sin 2 theta), then turned by `rotation_deg` and moved by `offset_mm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredTransferSection {
    /// c1, c3, c5, .. (no unit).
    #[schemars(length(min = 1, max = 6))]
    pub radial: Vec<f64>,
    /// a, b of the radial two-fold term (no unit).
    #[serde(default)]
    pub two_fold: [f64; 2],
    /// c, d of the sideways two-fold term (no unit); c = b and d = -a is a pure stretch along one line.
    #[serde(default)]
    pub two_fold_sideways: [f64; 2],
    /// Turn on the plate, degrees, counter-clockwise seen from above.
    #[serde(default)]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub rotation_deg: f64,
    /// Shift on the plate, mm.
    #[serde(default)]
    pub offset_mm: [f64; 2],
    /// The measured points reach to this polar angle; the map holds no further, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 90.0))]
    pub max_polar_deg: f64,
    /// Root mean square of what the fit leaves, per axis, mm (a record; nothing is computed from it).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_rms_mm: Option<f64>,
    /// Scatter from print to print, per axis, mm (a record; `tolerances.print_scatter_mm` is what counts).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scatter_mm: Option<f64>,
    /// Points used (a record).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_used: Option<u32>,
    /// Points rejected as outliers (a record).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_rejected: Option<u32>,
}

/// One print pass, or as many tilted ones as the wrap limit needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PrintPasses {
    /// One pass from straight above; dots beyond the wrap limit cannot be printed.
    #[default]
    Single,
    /// A centre pass, and tilted sector passes where the pattern reaches past the wrap limit.
    Split,
}

/// Pad printing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrintSection {
    /// Nominal map between dome and plate.
    #[serde(default)]
    pub transfer: TransferMapName,
    /// Measured correction to that map; left out until a test print was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredTransferSection>,
    /// Smallest dot that the etched plate carries, mm, shortest diameter of the outline on the plate.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub min_dot_mm: f64,
    /// Smallest gap between two outlines on the plate, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub min_gap_mm: f64,
    /// Surface normal against the pad's stroke beyond which a dot gets a warning, degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 90.0))]
    pub wrap_warn_deg: f64,
    /// .. beyond which it cannot be printed in that pass, degrees; not below wrap_warn_deg.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub wrap_limit_deg: f64,
    /// One print pass or several.
    #[serde(default)]
    pub hits: PrintPasses,
    /// Steepest tilt that the jig can hold, degrees (only for `split`).
    #[serde(default = "default_max_tilt_deg")]
    #[schemars(range(min = 0.0, max = 90.0))]
    pub max_tilt_deg: f64,
    /// Pad's footprint over the picture's diameter; registration crosses lie outside it.
    #[schemars(range(min = 1.0, max = 10.0))]
    pub pad_over_image: f64,
    /// Resolution of the bitmap film, dots per inch.
    #[schemars(range(min = 72, max = 20000))]
    pub dpi: u32,
    /// How far a drawn outline may lie from the exact one, mm; chosen from `accuracy` where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.00001, max = 1.0))]
    pub outline_tolerance_mm: Option<f64>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl PrintSection {
    /// How far a drawn outline may lie from the exact one, mm. A resolved design states it; before that it is as
    /// close as the file could ask.
    pub fn outline_mm(&self) -> f64 {
        self.outline_tolerance_mm.unwrap_or(1e-5)
    }
}

fn default_max_tilt_deg() -> f64 {
    60.0
}
