//! Which parts of geometry, ink and exposure take part.

use crate::effect_name::EffectName;

/// Which geometric effects take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Geometry {
    /// The lens as it is; else a pinhole of the same camera matrix.
    pub lens_distortion: bool,
    /// The pupil moves with the field angle.
    pub pupil_shift: bool,
    /// Layers bend rays; else rays are straight.
    pub refraction: bool,
    /// Each colour has its index; else all have that of green.
    pub dispersion: bool,
    /// The platform moves; else it stays at rest.
    pub sheet_motion: bool,
    /// The bend is solved in each frame; else the apparent points at rest move with the platform.
    pub gap_change: bool,
}

impl Geometry {
    /// The geometric effects among those that are used.
    pub fn of(uses: &dyn Fn(EffectName) -> bool) -> Self {
        Self {
            lens_distortion: uses(EffectName::LensDistortion),
            pupil_shift: uses(EffectName::PupilShift),
            refraction: uses(EffectName::Refraction),
            dispersion: uses(EffectName::Dispersion),
            sheet_motion: uses(EffectName::SheetMotion),
            gap_change: uses(EffectName::GapChange),
        }
    }

    /// Whether each frame solves the bend of its rays; else apparent points at rest move with the platform.
    pub fn solves(self) -> bool {
        self.gap_change || !self.refraction || !self.sheet_motion
    }
}

/// How dots are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ink {
    /// Whether dots are drawn.
    pub dots: bool,
    /// Whether they fade out at the edge.
    pub soft_edge: bool,
    /// Whether each has its own diameter and ink.
    pub uneven: bool,
}

/// When the rows gather light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Timing {
    /// Exposure of each row, in `samples` equal parts whose pictures are averaged; `None`: an instant.
    pub exposure: Option<Exposure>,
    /// Rows exposed one after the other; `None`: all rows at the frame's time.
    pub rolling: Option<Rolling>,
}

/// A finite exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// How long, s, centred on the row's time.
    pub exposure_s: f64,
    /// Pictures that are averaged, at the middles of as many equal parts.
    pub samples: u32,
}

/// Rows one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// From the first row to the last, s; the middle of the picture is at the frame's time.
    pub readout_s: f64,
    /// Slices of rows: the sensor is computed at the time of each one's middle row.
    pub slices: u32,
}
