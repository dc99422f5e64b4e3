//! What the law speaks of: displacements, balances, the state of a spring, and why there is none.

use glam::{DMat3, DVec3};

use domecast_optics::numeric::{Rigid, rotation_from_vector, vector_from_rotation};

/// The displacement of the platform: translation (mm) of its point at `at_mm`, rotation vector (rad), rest frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Displacement {
    /// Translation of the platform's point that is at `at_mm` at rest, mm.
    pub translation_mm: DVec3,
    /// Rotation vector, rad.
    pub rotation_rad: DVec3,
}

impl Displacement {
    /// From (tx, ty, tz, rx, ry, rz), mm and rad.
    pub fn from_array(v: [f64; 6]) -> Self {
        Self { translation_mm: DVec3::new(v[0], v[1], v[2]), rotation_rad: DVec3::new(v[3], v[4], v[5]) }
    }

    /// (tx, ty, tz, rx, ry, rz), mm and rad.
    pub fn to_array(self) -> [f64; 6] {
        let (t, r) = (self.translation_mm, self.rotation_rad);
        [t.x, t.y, t.z, r.x, r.y, r.z]
    }

    /// The displacement of a pose, about `at_mm`.
    pub fn of_pose(rest_from_platform: &Rigid, at_mm: DVec3) -> Self {
        Self {
            translation_mm: rest_from_platform.point(at_mm) - at_mm,
            rotation_rad: vector_from_rotation(&rest_from_platform.rotation),
        }
    }

    /// The pose `rest_from_platform` of a displacement about `at_mm`.
    pub fn to_pose(self, at_mm: DVec3) -> Rigid {
        let rotation: DMat3 = rotation_from_vector(self.rotation_rad);
        Rigid::new(rotation, at_mm + self.translation_mm - rotation * at_mm)
    }
}

/// Why the force law has no value, or a load no pose.
#[derive(Debug, Clone, PartialEq)]
pub enum MechanicsError {
    /// An input is NaN or infinite.
    NotFinite,
    /// A spring, by its number, is pressed, pulled or bent beyond what a spring is.
    SpringBeyondModel {
        /// Number of the spring, from 0.
        spring: usize,
        /// Its compression from the free length, mm.
        compression_mm: f64,
    },
    /// The platform gives way before the whole load is on.
    NotCarried {
        /// The part of the load, 0 to 1, that still had an equilibrium.
        carried: f64,
        /// Residual of the last try, N (moments counted over the springs' reach).
        residual_n: f64,
    },
}

impl std::fmt::Display for MechanicsError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a pose or load is not finite"),
            Self::SpringBeyondModel { spring, compression_mm } => {
                write!(
                    f,
                    "spring {spring} at {compression_mm:.3} mm of compression is beyond the spring model"
                )
            }
            Self::NotCarried { carried, residual_n } => write!(
                f,
                "the springs give way at {:.1} % of the load (residual {residual_n:.3e} N)",
                100.0 * carried
            ),
        }
    }
}

impl std::error::Error for MechanicsError {}

/// A pose in balance with a load.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// The pose `rest_from_platform`.
    pub pose: Rigid,
    /// The same as a displacement about `at_mm`.
    pub displacement: Displacement,
    /// What is left of the balance, N (moments counted over the springs' reach).
    pub residual_n: f64,
    /// Newton steps taken, over all load steps.
    pub iterations: u32,
    /// Least eigenvalue of the symmetric tangent stiffness, forces and moments scaled by the springs' reach,
    /// N/mm: where it is not above 0 the platform would tip over.
    pub min_stiffness_n_per_mm: f64,
}

/// What one spring bears at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringState {
    /// Compression from the free length, mm.
    pub compression_mm: f64,
    /// Axial force, N, positive when pressed.
    pub axial_n: f64,
    /// Sideways force on the upper end, N.
    pub lateral_n: f64,
    /// The larger of the two moments that bend the ends, N*mm.
    pub bending_nmm: f64,
    /// Twist about the axis, N*mm.
    pub twist_nmm: f64,
    /// Corrected shear stress in the wire, MPa.
    pub stress_mpa: f64,
    /// Pull that its magnets must hold, N: the spring's tension plus the end's moment over the coil's mean
    /// radius (the end tips about its edge); negative while compression presses it on.
    pub pull_n: f64,
    /// (qL)^2 over that of buckling; at 1 the spring bows out between parallel ends.
    pub buckling_ratio: f64,
}
