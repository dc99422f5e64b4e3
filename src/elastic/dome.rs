//! The elastic body.

use domecast_optics::DomeShape;
use glam::DVec3;

/// The dome as a linear elastic body, bonded to the rigid sheet by its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticDome {
    /// Its outer face.
    pub dome: DomeShape,
    /// Young's modulus, MPa; positive.
    pub young_mpa: f64,
    /// Poisson's ratio, 0 to 0.4999: beyond, the displacement alone no longer says the pressure.
    pub poisson: f64,
}

impl ElasticDome {
    /// Shear modulus, MPa.
    pub fn shear_mpa(&self) -> f64 {
        0.5 * self.young_mpa / (1.0 + self.poisson)
    }
}

/// Where the dome moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Direction from the centre of the dome's sphere to the middle of the touched region.
    pub direction: DVec3,
    /// Half angle of a cap about it, rad.
    pub angle_rad: f64,
    /// No point outside the cap moves by more than this, mm.
    pub beyond_mm: f64,
}

/// The stiffness matrix has no factors: the body's constants make it singular.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FactorError(pub String);

impl std::fmt::Display for FactorError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the dome's stiffness has no factors: {}", self.0)
    }
}

impl std::error::Error for FactorError {}
