//! The platform on its springs: what it is made of and how it stands at rest. The law between pose and wrench is
//! in `law`, its inverse in `balance`.

use glam::DVec3;

use super::load::Wrench;
use super::magnet::MagnetPair;
use super::spec::SpecError;
use super::spring::Spring;
use super::state::Displacement;

/// What a suspension is made of; the sensor frame at rest, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct SuspensionSpec {
    /// The spring; all are alike.
    pub spring: Spring,
    /// Upper end of each spring's axis at rest, mm. The lower end is straight below.
    pub upper_ends_mm: Vec<DVec3>,
    /// The magnets of each spring, if their pull is part of the model.
    pub magnets: Option<MagnetPair>,
    /// Weight of what the springs carry, N, in the rest frame; zero to leave it out.
    pub weight_n: DVec3,
    /// Where the weight acts, sensor frame, mm.
    pub center_of_mass_mm: DVec3,
    /// The point about which stiffness and moments are stated, mm; `None`: the middle of the springs.
    pub at_mm: Option<DVec3>,
}

/// Spring ends that a layout may have.
pub const MAX_SPRINGS: usize = 256;

/// A platform on springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspension {
    pub(super) spec: SuspensionSpec,
    pub(super) at_mm: DVec3,
    pub(super) rest_compression_mm: f64,
    /// What the springs and magnets carry at rest; wrenches are counted from there.
    pub(super) rest_load: Wrench,
}

impl Suspension {
    /// Checks the numbers and finds what weight and magnets press away at rest.
    ///
    /// # Errors
    /// [`SpecError`] for no or too many springs, a place or weight that is not finite, or a weight that the
    /// springs cannot bear.
    pub fn new(spec: SuspensionSpec) -> Result<Self, SpecError> {
        let count = spec.upper_ends_mm.len();
        if count == 0 || count > MAX_SPRINGS {
            let allowed = format!("1 to {MAX_SPRINGS} springs");
            return Err(SpecError { field: "upper_ends_mm", value: count as f64, allowed });
        }
        for (field, v) in spec
            .upper_ends_mm
            .iter()
            .map(|p| ("upper_ends_mm", *p))
            .chain([("weight_n", spec.weight_n), ("center_of_mass_mm", spec.center_of_mass_mm)])
            .chain(spec.at_mm.map(|p| ("at_mm", p)))
        {
            if let Some(value) = v.to_array().into_iter().find(|v| !v.is_finite()) {
                return Err(SpecError { field, value, allowed: "a finite number".into() });
            }
        }
        let middle = spec.upper_ends_mm.iter().sum::<DVec3>() / count as f64
            - DVec3::Z * 0.5 * spec.spring.spec().free_length_mm;
        let mut made = Self {
            at_mm: spec.at_mm.unwrap_or(middle),
            rest_compression_mm: 0.0,
            rest_load: Wrench::default(),
            spec,
        };
        made.rest_compression_mm = made.find_rest_compression()?;
        let beyond = |_| SpecError {
            field: "weight_n",
            value: made.spec.weight_n.z,
            allowed: "a weight that leaves the springs inside their model at rest".into(),
        };
        made.rest_load = made.load_at(&Displacement::default()).map_err(beyond)?;
        Ok(made)
    }

    /// Balance of springs against weight and magnets on the axis: k c = attraction(L0 - c) + weight / count.
    fn find_rest_compression(&self) -> Result<f64, SpecError> {
        let spring = &self.spec.spring;
        let k = spring.axial_n_per_mm();
        let share = -self.spec.weight_n.z / self.spec.upper_ends_mm.len() as f64;
        let mut c = 0.0;
        for _ in 0..60 {
            let [pull, slope] = self
                .spec
                .magnets
                .map_or([0.0, 0.0], |pair| pair.attraction(spring.spec().free_length_mm - c));
            // d/dc of k c - attraction(L0 - c): magnets that attract soften the spring.
            let stiffness = k + slope;
            let step = (pull + share - k * c) / stiffness;
            if !(stiffness > 0.0 && step.is_finite() && (c + step).abs() < spring.spec().free_length_mm) {
                break;
            }
            c += step;
            if step.abs() <= 1e-14 * spring.spec().free_length_mm {
                if c < spring.solid_compression_mm() {
                    return Ok(c);
                }
                break;
            }
        }
        Err(SpecError {
            field: "magnets and weight",
            value: share,
            allowed: "a pull on each spring (N) that it bears at rest without binding".into(),
        })
    }

    /// What it was made from.
    pub fn spec(&self) -> &SuspensionSpec {
        &self.spec
    }

    /// The point about which stiffness and moments are stated, fixed in the rest frame, mm.
    pub fn at_mm(&self) -> DVec3 {
        self.at_mm
    }

    /// How far weight and magnets compress the springs at rest, mm.
    pub fn rest_compression_mm(&self) -> f64 {
        self.rest_compression_mm
    }

    /// The farthest spring from `at_mm`, mm, at least one coil's radius: the lever that turns moments into forces
    /// where the two must be compared.
    pub fn reach_mm(&self) -> f64 {
        let far = |p: &DVec3| (*p - self.at_mm).truncate().length();
        self.spec.upper_ends_mm.iter().map(far).fold(0.5 * self.spec.spring.mean_diameter_mm(), f64::max)
    }
}
