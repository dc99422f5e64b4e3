//! What is known of the forces on the skin in a frame.

use glam::DVec3;

/// How the search for the forces on the skin ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TractionStatus {
    /// Solved.
    #[default]
    Ok,
    /// The platform's pose or too many dots are not known: nothing is said.
    NoMotion,
    /// The dots are not where those of these constants are: the reading is another sensor's. Nothing is said.
    ForeignReading,
    /// A bound on steps or loaded nodes was reached: the numbers are the last ones.
    NotConverged,
}

impl TractionStatus {
    /// Its name in the JSON line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NoMotion => "no_motion",
            Self::ForeignReading => "foreign_reading",
            Self::NotConverged => "not_converged",
        }
    }
}

/// What bears on the skin at a dot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DotTraction {
    /// The dot's number in the constants.
    pub id: u32,
    /// Where the dot is on the deformed skin, sensor frame, mm: on the ray on which it is seen, as deep along that as the elastic
    /// model has it.
    pub surface_mm: DVec3,
    /// Standard deviation of that depth, mm.
    pub depth_sd_mm: f64,
    /// Force on the skin over its area as it is now, sensor frame, N/mm2; pressure points inwards.
    pub traction_n_mm2: DVec3,
    /// Standard deviation of its normal part by the noise of the dots, N/mm2: what nodes and dots are too coarse to tell is not in it.
    /// Where nothing is found to touch, how much pressure over a correlation
    /// length could have stayed unseen.
    pub noise_sd_n_mm2: f64,
    /// Standard deviation of its normal part with what nodes and dots are too coarse to tell: of the pressure within half a node's
    /// distance, by the nodes beside it.
    pub sd_n_mm2: f64,
}

/// The touched part of the skin as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEstimate {
    /// Area of an ellipse whose half ellipsoid of pressure has the second moments of the one found (exact for Hertz' contact), mm2.
    pub area_mm2: f64,
    /// Centre of pressure, on the deformed skin, sensor frame, mm.
    pub point_mm: DVec3,
    /// Its standard deviation along the skin by the noise of the dots, on each of two axes, mm.
    pub point_noise_sd_mm: f64,
    /// The same with all that is known to be unsure, mm: noise of the dots, and what the skin's shape or, without it, dots
    /// that do not show motion along their rays leave open.
    pub point_sd_mm: f64,
    /// Mean outward normal by pressure, sensor frame.
    pub normal: DVec3,
    /// Sum of the tractions: the force on the dome, sensor frame, N.
    pub force_n: DVec3,
    /// Its standard deviations, N: those of the springs' wrench where there are springs.
    pub force_sd_n: DVec3,
    /// Share of the load where the shear is at the limit of friction, within a twentieth.
    pub slip_share: f64,
}

/// The forces on the skin in a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LocalForces {
    /// How the search ended.
    pub status: TractionStatus,
    /// The dots, in the order of the constants; empty where nothing is known.
    pub dots: Vec<DotTraction>,
    /// What touches; `None` where the force is below three of its deviations.
    pub contact: Option<ContactEstimate>,
    /// Root mean square of what the forces leave unexplained of the dots' motion, px.
    pub rms_px: f64,
    /// How much softer than the constants say the dome shows itself where springs say the force; 1 on a rigid mount.
    pub compliance_factor: f64,
}
