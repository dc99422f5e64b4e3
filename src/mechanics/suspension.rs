//! The platform on its springs: wrench from pose, pose from wrench, stiffness.
//!
//! Every spring stores the energy of its compression, its twist, its magnets' pull and of Haringx' column at
//! that compression; the wrench is the exact derivative of the sum, and the stiffness the exact derivative
//! of the wrench. So the law is conservative, holds at large tilts, and a 6x6 is its tangent, not its rival.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix6, Vector6};

use super::column::EndStiffness;
use super::dual::{Dual, DualVec, jacobian};
use super::load::Wrench;
use super::magnet::MagnetPair;
use super::spring::{SpecError, Spring};
use crate::numeric::{Rigid, rotation_from_vector, vector_from_rotation};

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
pub const MOST_SPRINGS: usize = 256;

/// A platform on springs.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspension {
    spec: SuspensionSpec,
    at_mm: DVec3,
    rest_compression_mm: f64,
    /// What the springs and magnets carry at rest; wrenches are counted from there.
    rest_load: Wrench,
}

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
    pub least_stiffness_n_per_mm: f64,
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

const MOST_NEWTON_STEPS: u32 = 40;
/// The load is applied in halves, quarters, .. down to this part when Newton fails from further away.
const SMALLEST_LOAD_STEP: f64 = 1.0 / 1024.0;

impl Suspension {
    /// Checks the numbers and finds what weight and magnets press away at rest.
    ///
    /// # Errors
    /// [`SpecError`] for no or too many springs, a place or weight that is not finite, or a weight that the
    /// springs cannot bear.
    pub fn new(spec: SuspensionSpec) -> Result<Self, SpecError> {
        let count = spec.upper_ends_mm.len();
        if count == 0 || count > MOST_SPRINGS {
            let allowed = format!("1 to {MOST_SPRINGS} springs");
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

    /// The wrench that holds the platform at a pose, about [`Suspension::at_mm`], N and N*mm; zero at rest.
    ///
    /// # Errors
    /// [`MechanicsError`] for a pose that is not finite or that takes a spring beyond its model. Coils that
    /// bind are not an error here: see [`Suspension::springs_at`].
    pub fn wrench_at(&self, displacement: &Displacement) -> Result<Wrench, MechanicsError> {
        let load = self.load_at(displacement)?;
        Ok(Wrench {
            force_n: load.force_n - self.rest_load.force_n,
            moment_nmm: load.moment_nmm - self.rest_load.moment_nmm,
        })
    }

    fn load_at(&self, displacement: &Displacement) -> Result<Wrench, MechanicsError> {
        let (force, moment) = self.derive(displacement)?;
        Ok(Wrench { force_n: force.value(), moment_nmm: moment.value() })
    }

    /// Derivative of [`Suspension::wrench_at`] by the displacement: the tangent stiffness there, N/mm, N, N*mm.
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn tangent_at(&self, displacement: &Displacement) -> Result<Matrix6<f64>, MechanicsError> {
        let (force, moment) = self.derive(displacement)?;
        Ok(jacobian(force, moment))
    }

    /// The 6x6 at rest: the tangent of the whole law.
    pub fn stiffness(&self) -> Result<Matrix6<f64>, MechanicsError> {
        self.tangent_at(&Displacement::default())
    }

    /// The 6x6 that takes a displacement to its wrench when the platform is pressed down by `compression_mm`
    /// from rest: the tangent there, except that its column for tz is the wrench of the compression itself over
    /// it (a secant), so that `stiffness * displacement` is exact on the axis and right to first order beside it.
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn stiffness_at(&self, compression_mm: f64) -> Result<Matrix6<f64>, MechanicsError> {
        let down =
            Displacement { translation_mm: DVec3::new(0.0, 0.0, -compression_mm), ..Default::default() };
        let mut stiffness = self.tangent_at(&down)?;
        if compression_mm.abs() > 1e-6 * self.spec.spring.spec().free_length_mm {
            let column = self.wrench_at(&down)?.to_vector() / -compression_mm;
            stiffness.set_column(2, &column);
        }
        Ok(stiffness)
    }

    /// Force and moment with their gradients.
    fn derive(&self, displacement: &Displacement) -> Result<(DualVec, DualVec), MechanicsError> {
        let values = displacement.to_array();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(MechanicsError::NotFinite);
        }
        let [tx, ty, tz, rx, ry, rz]: [Dual; 6] = std::array::from_fn(|i| Dual::variable(values[i], i));
        let shift = DualVec([tx, ty, tz]);
        let turn = DualVec([rx, ry, rz]);
        let column = self.spec.spring.column();
        let k_axial = self.spec.spring.axial_n_per_mm();
        let k_twist = self.spec.spring.torsion_nmm_per_rad();
        let free = self.spec.spring.spec().free_length_mm;
        let zero = DualVec::constant(DVec3::ZERO);
        let (mut force, mut moment, mut gradient) = (zero, zero, zero);
        for (number, end) in self.spec.upper_ends_mm.iter().enumerate() {
            let arm = *end - self.at_mm;
            // The upper end's place from `at`, and its shift from rest.
            let place = turn.rotate(DualVec::constant(arm)) + shift;
            let [dx, dy, dz] = (place - DualVec::constant(arm)).0;
            let compression = Dual::constant(self.rest_compression_mm) - dz;
            let beyond = MechanicsError::SpringBeyondModel { spring: number, compression_mm: compression.v };
            let Some(EndStiffness { shear, coupling, tilt }) = column.stiffness(compression.v) else {
                return Err(beyond);
            };
            let at = |jet: super::dual::Jet| compression.chain(jet.v, jet.d);
            let slope = |jet: super::dual::Jet| compression.chain(jet.d, jet.dd);
            // Tilt of the end in the planes xz and yz: +ry leans it to +x, -rx to +y.
            let (lean_x, lean_y) = (ry, -rx);
            let side_x = at(shear) * dx + at(coupling) * lean_x;
            let side_y = at(shear) * dy + at(coupling) * lean_y;
            let bend_x = at(coupling) * dx + at(tilt) * lean_x;
            let bend_y = at(coupling) * dy + at(tilt) * lean_y;
            // The column's energy falls as it is compressed: it pulls at the axial force by -dU/dc.
            let by_compression = slope(shear) * (dx * dx + dy * dy) * 0.5
                + slope(coupling) * (dx * lean_x + dy * lean_y)
                + slope(tilt) * (lean_x * lean_x + lean_y * lean_y) * 0.5;
            let mut axial = compression * k_axial + by_compression;
            if let Some(pair) = self.spec.magnets {
                let [pull, rate] = pair.attraction(free - compression.v);
                axial = axial - compression.chain(pull, -rate);
            }
            let push = DualVec([side_x, side_y, -axial]);
            force = force + push;
            moment = moment + place.cross(push);
            gradient = gradient + DualVec([-bend_y, bend_x, rz * k_twist]);
        }
        moment = moment + turn.moment_of_gradient(gradient);
        if self.spec.weight_n != DVec3::ZERO {
            let lever = turn.rotate(DualVec::constant(self.spec.center_of_mass_mm - self.at_mm)) + shift;
            let weight = DualVec::constant(self.spec.weight_n);
            force = force - weight;
            moment = moment - lever.cross(weight);
        }
        let finite = |v: &DualVec| v.0.iter().all(|c| c.v.is_finite() && c.d.iter().all(|d| d.is_finite()));
        if finite(&force) && finite(&moment) { Ok((force, moment)) } else { Err(MechanicsError::NotFinite) }
    }

    /// What each spring bears at a pose, in the order of the layout.
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn springs_at(&self, displacement: &Displacement) -> Result<Vec<SpringState>, MechanicsError> {
        if displacement.to_array().iter().any(|v| !v.is_finite()) {
            return Err(MechanicsError::NotFinite);
        }
        let pose = displacement.to_pose(self.at_mm);
        let spring = &self.spec.spring;
        let column = spring.column();
        let lean = DVec3::new(displacement.rotation_rad.y, -displacement.rotation_rad.x, 0.0);
        let state = |(number, end): (usize, &DVec3)| {
            let moved = pose.point(*end) - *end;
            let compression_mm = self.rest_compression_mm - moved.z;
            let beyond = MechanicsError::SpringBeyondModel { spring: number, compression_mm };
            let k = column.stiffness(compression_mm).ok_or(beyond.clone())?;
            let shift = DVec3::new(moved.x, moved.y, 0.0);
            let ends = |s: f64, t: f64| column.end_moments(compression_mm, s, t).ok_or(beyond.clone());
            let (in_x, in_y) = (ends(shift.x, lean.x)?, ends(shift.y, lean.y)?);
            let bending_nmm = in_x[0].hypot(in_y[0]).max(in_x[1].hypot(in_y[1]));
            let axial_n = spring.axial_n_per_mm() * compression_mm;
            let twist_nmm = spring.torsion_nmm_per_rad() * displacement.rotation_rad.z;
            Ok(SpringState {
                compression_mm,
                axial_n,
                lateral_n: (shift * k.shear.v + lean * k.coupling.v).length(),
                bending_nmm,
                twist_nmm,
                stress_mpa: spring.shear_stress_mpa(axial_n, bending_nmm, twist_nmm),
                pull_n: bending_nmm / (0.5 * spring.mean_diameter_mm()) - axial_n,
                buckling_ratio: column.buckling_ratio(compression_mm),
            })
        };
        self.spec.upper_ends_mm.iter().enumerate().map(state).collect()
    }

    /// The pose at which the springs balance a wrench (about [`Suspension::at_mm`]).
    ///
    /// Newton's method on the exact tangent, the load put on at once where that converges and in smaller steps
    /// where not; every step keeps each spring inside its model. Bounded by 40 Newton steps a load step and 1024
    /// load steps.
    ///
    /// # Errors
    /// [`MechanicsError::NotFinite`], or [`MechanicsError::NotCarried`] with the part of the load that was carried.
    pub fn equilibrium(&self, wrench: &Wrench) -> Result<Equilibrium, MechanicsError> {
        if !wrench.is_finite() {
            return Err(MechanicsError::NotFinite);
        }
        let (mut carried, mut step) = (0.0, 1.0);
        let (mut x, mut iterations, mut residual_n) = (Vector6::zeros(), 0, 0.0);
        while carried < 1.0 {
            let part = f64::min(carried + step, 1.0);
            let (next, used, left, done) = self.newton(x, &wrench.scaled(part).to_vector());
            iterations += used;
            if done {
                (x, carried, residual_n) = (next, part, left);
                step *= 2.0;
            } else {
                step *= 0.5;
                if step < SMALLEST_LOAD_STEP {
                    return Err(MechanicsError::NotCarried { carried, residual_n: left });
                }
            }
        }
        let displacement = Displacement::from_array(x.into());
        Ok(Equilibrium {
            pose: displacement.to_pose(self.at_mm),
            displacement,
            residual_n,
            iterations,
            least_stiffness_n_per_mm: self.least_stiffness(&self.tangent_at(&displacement)?),
        })
    }

    fn newton(&self, start: Vector6<f64>, target: &Vector6<f64>) -> (Vector6<f64>, u32, f64, bool) {
        let reach = self.reach_mm();
        let size = |v: &Vector6<f64>| v.fixed_rows::<3>(0).norm().hypot(v.fixed_rows::<3>(3).norm() / reach);
        let residual = |x: &Vector6<f64>| -> Option<(Vector6<f64>, Matrix6<f64>)> {
            let (force, moment) = self.derive(&Displacement::from_array((*x).into())).ok()?;
            let load = Wrench { force_n: force.value(), moment_nmm: moment.value() };
            let balance = target + self.rest_load.to_vector() - load.to_vector();
            Some((balance, jacobian(force, moment)))
        };
        let (mut x, mut used) = (start, 0);
        let Some((mut balance, mut tangent)) = residual(&x) else {
            return (x, used, f64::INFINITY, false);
        };
        // Rounding of sums of this size; below it a step cannot improve.
        let floor =
            1e-13 * (size(target) + size(&self.rest_load.to_vector()) + self.spec.spring.axial_n_per_mm());
        while used < MOST_NEWTON_STEPS {
            let left = size(&balance);
            if left <= floor {
                return (x, used, left, true);
            }
            used += 1;
            let Some(full) = tangent.lu().solve(&balance) else { break };
            let mut factor = 1.0;
            let mut moved = false;
            while factor > 1e-3 {
                let next = x + full * factor;
                if let Some((b, t)) = residual(&next)
                    && size(&b) < left
                {
                    (x, balance, tangent, moved) = (next, b, t, true);
                    break;
                }
                factor *= 0.5;
            }
            if !moved {
                // Rounding keeps the balance from falling further: accept what is at its floor.
                return (x, used, left, left <= 100.0 * floor);
            }
        }
        let left = size(&balance);
        (x, used, left, left <= floor)
    }

    /// Least eigenvalue of the symmetric tangent stiffness at a pose; see [`Equilibrium`].
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn least_stiffness_at(&self, displacement: &Displacement) -> Result<f64, MechanicsError> {
        Ok(self.least_stiffness(&self.tangent_at(displacement)?))
    }

    fn least_stiffness(&self, tangent: &Matrix6<f64>) -> f64 {
        let reach = self.reach_mm();
        let scale = |i: usize| if i < 3 { 1.0 } else { 1.0 / reach };
        let symmetric =
            Matrix6::from_fn(|i, j| 0.5 * (tangent[(i, j)] + tangent[(j, i)]) * scale(i) * scale(j));
        symmetric.symmetric_eigenvalues().min()
    }
}
