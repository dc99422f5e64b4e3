//! What a compression spring is made of, and why numbers make none.

/// How the ends of a compression spring are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndType {
    /// Cut and left as it is.
    Open,
    /// Cut and ground flat.
    OpenGround,
    /// The last coil closed on its neighbour.
    Closed,
    /// The last coil closed and ground flat.
    ClosedGround,
}

impl EndType {
    /// Coils at the two ends together that do not deform (Shigley, *Mechanical Engineering Design*,
    /// table of compression-spring ends).
    pub fn dead_coils(self) -> f64 {
        match self {
            Self::Open => 0.0,
            Self::OpenGround => 1.0,
            Self::Closed | Self::ClosedGround => 2.0,
        }
    }

    /// Whether the ends are ground flat; an end that is not adds a wire's thickness to the solid height.
    pub fn is_ground(self) -> bool {
        matches!(self, Self::OpenGround | Self::ClosedGround)
    }
}

/// The shape and the wire of a compression spring; lengths mm, moduli and stress MPa (N/mm^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringSpec {
    /// Wire diameter d, mm.
    pub wire_diameter_mm: f64,
    /// Outer diameter of the coil, mm.
    pub outer_diameter_mm: f64,
    /// Length without load, mm.
    pub free_length_mm: f64,
    /// Coils n that deform.
    pub active_coils: f64,
    /// How the ends are made.
    pub ends: EndType,
    /// Shear modulus G, MPa.
    pub shear_modulus_mpa: f64,
    /// Young's modulus E, MPa.
    pub elastic_modulus_mpa: f64,
    /// Corrected shear stress that the wire bears without setting, MPa.
    pub allowable_shear_mpa: f64,
}

/// Why numbers do not make a spring, or a platform on springs.
#[derive(Debug, Clone, PartialEq)]
pub struct SpecError {
    /// The quantity at fault.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed, in words.
    pub allowed: String,
}

impl std::fmt::Display for SpecError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} is {}; allowed: {}", self.field, self.value, self.allowed)
    }
}

impl std::error::Error for SpecError {}
