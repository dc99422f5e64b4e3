//! From a pose with its covariance to displacement and wrench with their deviations.
//!
//! What is off by chance is another thing in each frame: the centroids' noise. What is off for good stays: camera, layers
//! and markers that are not where the constants say, springs that are not as stiff. Both are in the deviation; who averages
//! or filters frames needs the share of the first.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix6, Vector6};

use super::optics_errors::OpticsErrors;
use super::spring_errors::SpringErrors;
use super::springs::Springs;
use crate::constants::{Constants, MovingMass};
use crate::track::error::TrackError;
use crate::track::pose::{MarkerSighting, PoseEstimate};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::displacement_from_motion;
use domecast_springs::{Displacement, Wrench};

/// Displacement and wrench of one frame, about the springs' reference point, or the origin without springs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::track) struct WrenchEstimate {
    /// Standard deviations of the displacement, mm and rad: all, and the share that changes from frame to frame.
    pub displacement_sd: Option<Displacement>,
    pub displacement_sd_random: Option<Displacement>,
    /// What the world puts on dome and platform, N and N*mm.
    pub wrench: Option<Wrench>,
    /// Whether the pose is one that the springs cannot have.
    pub is_beyond_springs: bool,
}

/// How far a frame's wrench may be off.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::track) struct WrenchErrors {
    /// By each independent number of deviation one that stays the same from frame to frame.
    pub lasting: Vec<Vector6<f64>>,
    /// Covariance of what this frame's picture is off by: noise, and marks that do not look like marks.
    pub picture: Matrix6<f64>,
    /// The share of that which changes from frame to frame.
    pub random: Matrix6<f64>,
}

impl WrenchErrors {
    /// Standard deviations of both together; `None` where one is not finite.
    pub fn sd(&self) -> Option<Wrench> {
        let lasting = self.lasting.iter().fold(Matrix6::zeros(), |sum, c| sum + c * c.transpose());
        deviations(&(lasting + self.picture)).map(Wrench::from_array)
    }

    /// Adds another frame's: for a mean over frames.
    pub fn add(&mut self, other: &Self) {
        self.lasting.resize(self.lasting.len().max(other.lasting.len()), Vector6::zeros());
        self.lasting.iter_mut().zip(&other.lasting).for_each(|(to, from)| *to += from);
        self.picture += other.picture;
        self.random += other.random;
    }

    /// Standard deviations of this frame's wrench less the mean of others, whose errors were added up; what is off for
    /// good in both is taken off.
    pub fn sd_less_mean(&self, sum: &Self, frames: f64) -> Option<Wrench> {
        let mut covariance = self.picture + sum.picture / (frames * frames);
        for (k, own) in self.lasting.iter().enumerate() {
            let left = own - sum.lasting.get(k).copied().unwrap_or_default() / frames;
            covariance += left * left.transpose();
        }
        deviations(&covariance).map(Wrench::from_array)
    }

    /// Standard deviations of what changes from frame to frame.
    pub fn sd_random(&self) -> Option<Wrench> {
        deviations(&self.random).map(Wrench::from_array)
    }
}

/// Makes wrenches of poses; keeps its buffers.
#[derive(Debug, Clone)]
pub(in crate::track) struct WrenchEstimator {
    springs: Option<Springs>,
    optics_errors: Option<OpticsErrors>,
    spring_errors: SpringErrors,
    /// By what the temperature multiplies the stiffness, and the deviation of that.
    warmth: [f64; 2],
    /// What the optics do at rest, where the stiffness was measured through them.
    optics_at_rest: Option<Vec<Vector6<f64>>>,
    carried: Option<Carried>,
    errors: WrenchErrors,
    are_errors_known: bool,
}

/// The weight on the springs, where it is known.
#[derive(Debug, Clone)]
struct Carried {
    moving: MovingMass,
    /// The weight that the springs' law has already, N.
    of_law_n: DVec3,
    /// Gravity less the sensor's own acceleration, rest frame, m/s^2; `None` where nobody says it.
    acceleration_mps2: Option<DVec3>,
}

impl Carried {
    fn of(constants: &Constants) -> Result<Option<Self>, TrackError> {
        let Some(springs) = &constants.springs else { return Ok(None) };
        let Some(moving) = springs.moving.clone() else { return Ok(None) };
        let numbers = [moving.mass_g, moving.mass_sd_g].into_iter().chain(moving.center_of_mass_mm);
        if !(numbers.into_iter().all(f64::is_finite) && moving.mass_g > 0.0 && moving.mass_sd_g >= 0.0) {
            return Err(TrackError::at("springs.moving", "has a number that is no mass or no place"));
        }
        let of_law_n = springs.law.as_ref().map_or(DVec3::ZERO, |law| DVec3::from_array(law.weight_n));
        Ok(Some(Self { moving, of_law_n, acceleration_mps2: None }))
    }

    /// What of a wrench is the weight, beyond what the law knows; and how far that may be off.
    fn weight(&self, pose: &Rigid, at_mm: DVec3) -> Option<(Wrench, Vector6<f64>)> {
        let moving = &self.moving;
        let weight_n = moving.weight_n(self.acceleration_mps2?);
        let place_mm = pose.point(DVec3::from_array(moving.center_of_mass_mm));
        let of = |force_n: DVec3| Wrench::of_load(force_n, DVec3::ZERO, place_mm, at_mm);
        let error = of(weight_n).to_vector() * (moving.mass_sd_g / moving.mass_g);
        Some((of(weight_n - self.of_law_n), error))
    }
}

impl WrenchEstimator {
    /// For the sensor of the constants; `rest`: its optics at rest; `temperature_c`: of its springs, where it is known.
    ///
    /// # Errors
    /// [`TrackError`] names the first field that makes no springs or no deviations.
    pub fn new(
        constants: &Constants,
        rest: &SensorOptics,
        temperature_c: Option<f64>,
    ) -> Result<Self, TrackError> {
        let springs = constants.springs.as_ref().map(Springs::new).transpose()?;
        let mut optics_errors = OpticsErrors::new(constants, rest)?;
        let open = constants.springs.as_ref().and_then(|springs| springs.uncertainty.as_ref());
        let mut optics_at_rest = None;
        if open.is_some_and(|open| open.through_optics)
            && let Some(errors) = optics_errors.as_mut()
        {
            let markers = constants.markers().into_iter();
            let seen: Vec<MarkerSighting> =
                markers.map(|marker| MarkerSighting::new(marker, DVec2::ZERO, [0.0; 2])).collect();
            optics_at_rest = errors.at_pose(rest, &Rigid::identity(), &seen).map(<[_]>::to_vec);
        }
        let spring_errors = SpringErrors::new(constants)?;
        let warmth = warmth_of(constants, temperature_c)?;
        let carried = Carried::of(constants)?;
        let mut errors = WrenchErrors::default();
        errors.lasting.reserve(MAX_COLUMNS);
        let are_errors_known = false;
        Ok(Self {
            springs,
            optics_errors,
            spring_errors,
            warmth,
            optics_at_rest,
            carried,
            errors,
            are_errors_known,
        })
    }

    /// Takes the weight of what the springs carry off the wrenches from now on, under this acceleration (m/s^2, rest frame); `None` leaves
    /// it in them.
    ///
    /// # Errors
    /// [`TrackError`] where the constants do not say what the springs carry, and for an acceleration that is none.
    pub fn set_gravity(&mut self, acceleration_mps2: Option<DVec3>) -> Result<(), TrackError> {
        if acceleration_mps2.is_some_and(|a| !(a.is_finite() && a.length() <= MAX_ACCELERATION_MPS2)) {
            let problem =
                format!("needs three numbers of m/s^2, no more than {MAX_ACCELERATION_MPS2} together");
            return Err(TrackError::at("gravity", problem));
        }
        match &mut self.carried {
            Some(carried) => carried.acceleration_mps2 = acceleration_mps2,
            None if acceleration_mps2.is_none() => {}
            None => {
                let problem = "is not there: what the springs carry is not known; build the design anew";
                return Err(TrackError::at("springs.moving", problem));
            }
        }
        Ok(())
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        if let Some(carried) = &mut self.carried {
            carried.acceleration_mps2 = None;
        }
    }

    /// The springs' law, where the constants have one.
    pub fn springs(&self) -> Option<&Springs> {
        self.springs.as_ref()
    }

    /// How far the last wrench may be off; `None` where that is not known.
    pub fn errors(&self) -> Option<&WrenchErrors> {
        self.are_errors_known.then_some(&self.errors)
    }

    /// At a frame's pose; `optics` stand at it.
    pub fn at_pose(&mut self, pose: &PoseEstimate<'_>, optics: &SensorOptics) -> Option<WrenchEstimate> {
        let refined = pose.refined?;
        self.are_errors_known = false;
        let at_mm = self.springs.as_ref().map_or(DVec3::ZERO, Springs::at_mm);
        let transfer = displacement_from_motion(&refined.pose, at_mm);
        let [picture, random] = [refined.covariance, refined.random]
            .map(|covariance| transfer * covariance * transfer.transpose() * pose.variance_factor);
        self.errors.lasting.clear();
        let mut are_known = true;
        let (mut spread, mut sees) = (picture, Some(()));
        if let Some(errors) = self.optics_errors.as_mut() {
            match errors.at_pose(optics, &refined.pose, pose.seen) {
                Some(columns) => {
                    let all = columns.iter().map(|c| transfer * c);
                    spread += all.fold(Matrix6::zeros(), |sum, c| sum + c * c.transpose());
                    let columns = self.optics_at_rest.as_deref().unwrap_or(columns);
                    self.errors.lasting.extend(columns.iter().map(|c| transfer * c));
                }
                None => sees = None,
            }
        }
        are_known &= sees.is_some();
        let mut estimate = WrenchEstimate {
            displacement_sd: sees.and_then(|()| deviations(&spread)).map(Displacement::from_array),
            displacement_sd_random: deviations(&random).map(Displacement::from_array),
            ..WrenchEstimate::default()
        };
        let Some(springs) = &self.springs else { return Some(estimate) };
        estimate.is_beyond_springs = !springs.can_stand(&refined.pose, &spread);
        let displacement = Displacement::of_pose(&refined.pose, at_mm);
        let Some((cold, tangent)) = springs.wrench(&displacement) else {
            estimate.is_beyond_springs = true;
            return Some(estimate);
        };
        let [factor, factor_sd] = self.warmth;
        let (wrench, tangent) = (cold.scaled(factor), tangent * factor);
        let carried = self.carried.as_ref().and_then(|carried| carried.weight(&refined.pose, at_mm));
        estimate.wrench = Some(carried.map_or(wrench, |(weight, _)| wrench - weight));
        self.errors.lasting.iter_mut().for_each(|column| *column = tangent * *column);
        are_known &= self.spring_errors.append(&displacement, &mut self.errors.lasting).is_some();
        self.errors.lasting.push(cold.to_vector() * factor_sd);
        self.errors.lasting.extend(carried.map(|(_, error)| error));
        self.errors.picture = tangent * picture * tangent.transpose();
        self.errors.random = tangent * random * tangent.transpose();
        self.are_errors_known = are_known;
        Some(estimate)
    }
}

/// Factor of the stiffness at a temperature, and its standard deviation.
fn warmth_of(constants: &Constants, temperature_c: Option<f64>) -> Result<[f64; 2], TrackError> {
    let Some((springs, at_c)) = constants.springs.as_ref().zip(temperature_c) else { return Ok([1.0, 0.0]) };
    let Some(own) = &springs.temperature else {
        let problem = "is not there: a temperature tells nothing of these springs; state springs.wire.temperature in the design";
        return Err(TrackError::at("springs.temperature", problem));
    };
    let warmer_k = at_c - own.at_c;
    let found = [1.0 + own.modulus_per_k * warmer_k, (own.modulus_per_k_sd * warmer_k).abs()];
    let usable = found.iter().all(|v| v.is_finite()) && found[0] > 0.0;
    usable.then_some(found).ok_or_else(|| {
        TrackError::at("springs.temperature", format!("leaves no stiffness at {at_c} degrees C"))
    })
}

/// What a sensor is shaken by at most, m/s^2: a hundred times gravity.
const MAX_ACCELERATION_MPS2: f64 = 1000.0;

/// Columns that are kept room for: all numbers of optics and springs of a usual sensor.
const MAX_COLUMNS: usize = 256;

/// Square roots of the diagonal; `None` where a variance is not finite.
fn deviations(covariance: &Matrix6<f64>) -> Option<[f64; 6]> {
    let variances = covariance.diagonal();
    // Rounding may leave a variance of zero below it.
    let sd = |i: usize| variances[i].max(0.0).sqrt();
    variances.iter().all(|v| v.is_finite()).then(|| std::array::from_fn(sd))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(lasting: f64, random: f64) -> WrenchErrors {
        WrenchErrors {
            lasting: vec![Vector6::repeat(lasting), Vector6::repeat(2.0 * lasting)],
            picture: Matrix6::identity() * random * random,
            random: Matrix6::identity() * random * random,
        }
    }

    #[test]
    fn both_kinds_add_up_and_a_reference_takes_off_what_stays() {
        let one = errors(0.3, 0.1);
        assert!((one.sd().unwrap().force_n.z - (0.45_f64 + 0.01).sqrt()).abs() < 1e-12);
        assert!((one.sd_random().unwrap().moment_nmm.x - 0.1).abs() < 1e-12);
        let mut sum = WrenchErrors::default();
        for _ in 0..4 {
            sum.add(&one);
        }
        // The frame's own noise, and a quarter of its variance for the mean's.
        let left = one.sd_less_mean(&sum, 4.0).unwrap();
        assert!((left.force_n.x - (0.01_f64 * 1.25).sqrt()).abs() < 1e-12, "{left:?}");
        assert_eq!(errors(f64::INFINITY, 0.1).sd(), None);
    }
}
