//! What the springs are made of, as the constants carry it: enough for the whole law of `mechanics`.
//!
//! A 6x6 by compression is right to first order beside the axis. What tilt does to a twist, or a shift to the height,
//! needs the places of the springs' upper ends and the springs themselves; with them a runtime has the exact law.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use domecast_springs::{EndType, MagnetPair, SpecError, Spring, SpringSpec, Suspension, SuspensionSpec};

/// Springs, magnets and weight of the platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpringLaw {
    /// Upper end of each spring's axis at rest, in the rest frame; the lower ends are straight below.
    pub upper_ends_mm: Vec<[f64; 3]>,
    /// Wire of the springs, which are all alike.
    pub wire_diameter_mm: f64,
    /// Outside of the coil.
    pub outer_diameter_mm: f64,
    /// Length without load.
    pub free_length_mm: f64,
    /// Coils that deform.
    pub active_coils: f64,
    /// How the ends are made.
    pub ends: SpringLawEnds,
    /// Shear modulus of the wire, MPa.
    pub shear_modulus_mpa: f64,
    /// Young's modulus of the wire, MPa.
    pub elastic_modulus_mpa: f64,
    /// Corrected shear stress that the wire bears, MPa.
    pub allowable_shear_mpa: f64,
    /// Pull at which a spring leaves its magnets, N, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip_force_n: Option<f64>,
    /// The magnets of each spring, where their pull counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub magnets: Option<MagnetLaw>,
    /// Weight of what the springs carry, in the rest frame, N; zero where it is left out.
    pub weight_n: [f64; 3],
    /// Where it acts, in the sensor frame.
    pub center_of_mass_mm: [f64; 3],
}

/// How the ends of the springs are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SpringLawEnds {
    /// Cut and left as it is.
    Open,
    /// Cut and ground flat.
    OpenGround,
    /// The last coil closed on its neighbour.
    Closed,
    /// The last coil closed and ground flat.
    ClosedGround,
}

/// A pair of equal disc magnets, one at each end of a spring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MagnetLaw {
    /// Diameter of a disc.
    pub diameter_mm: f64,
    /// Thickness of a disc.
    pub thickness_mm: f64,
    /// Remanence, T.
    pub remanence_t: f64,
    /// Whether unlike poles face.
    pub attract: bool,
}

impl SpringLaw {
    /// What a suspension is made of, and the pull that its magnets hold.
    pub fn of(suspension: &Suspension, grip_force_n: Option<f64>) -> Self {
        let spec = suspension.spec();
        let spring = spec.spring.spec();
        Self {
            upper_ends_mm: spec.upper_ends_mm.iter().map(|p| p.to_array()).collect(),
            wire_diameter_mm: spring.wire_diameter_mm,
            outer_diameter_mm: spring.outer_diameter_mm,
            free_length_mm: spring.free_length_mm,
            active_coils: spring.active_coils,
            ends: match spring.ends {
                EndType::Open => SpringLawEnds::Open,
                EndType::OpenGround => SpringLawEnds::OpenGround,
                EndType::Closed => SpringLawEnds::Closed,
                EndType::ClosedGround => SpringLawEnds::ClosedGround,
            },
            shear_modulus_mpa: spring.shear_modulus_mpa,
            elastic_modulus_mpa: spring.elastic_modulus_mpa,
            allowable_shear_mpa: spring.allowable_shear_mpa,
            grip_force_n,
            magnets: spec.magnets.map(|pair| MagnetLaw {
                diameter_mm: pair.diameter_mm(),
                thickness_mm: pair.thickness_mm(),
                remanence_t: pair.remanence_t(),
                attract: pair.is_attracting(),
            }),
            weight_n: spec.weight_n.to_array(),
            center_of_mass_mm: spec.center_of_mass_mm.to_array(),
        }
    }

    /// The suspension with displacements and moments stated about `at_mm`.
    ///
    /// # Errors
    /// [`SpecError`] names the number that makes no spring, magnet or platform at rest.
    pub fn suspension(&self, at_mm: [f64; 3]) -> Result<Suspension, SpecError> {
        let spring = Spring::new(SpringSpec {
            wire_diameter_mm: self.wire_diameter_mm,
            outer_diameter_mm: self.outer_diameter_mm,
            free_length_mm: self.free_length_mm,
            active_coils: self.active_coils,
            ends: match self.ends {
                SpringLawEnds::Open => EndType::Open,
                SpringLawEnds::OpenGround => EndType::OpenGround,
                SpringLawEnds::Closed => EndType::Closed,
                SpringLawEnds::ClosedGround => EndType::ClosedGround,
            },
            shear_modulus_mpa: self.shear_modulus_mpa,
            elastic_modulus_mpa: self.elastic_modulus_mpa,
            allowable_shear_mpa: self.allowable_shear_mpa,
        })?;
        let pair = |m: &MagnetLaw| MagnetPair::new(m.diameter_mm, m.thickness_mm, m.remanence_t, m.attract);
        Suspension::new(SuspensionSpec {
            spring,
            upper_ends_mm: self.upper_ends_mm.iter().map(|p| DVec3::from_array(*p)).collect(),
            magnets: self.magnets.as_ref().map(pair).transpose()?,
            weight_n: DVec3::from_array(self.weight_n),
            center_of_mass_mm: DVec3::from_array(self.center_of_mass_mm),
            at_mm: Some(DVec3::from_array(at_mm)),
        })
    }
}
