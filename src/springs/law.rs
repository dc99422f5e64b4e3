//! The law of the springs: wrench from pose, and its derivatives.
//!
//! Every spring stores the energy of its compression, its twist, its magnets' pull and of Haringx' column at
//! that compression; the wrench is the exact derivative of the sum, and the stiffness the exact derivative
//! of the wrench. So the law is conservative, holds at large tilts, and a 6x6 is its tangent, not its rival.

use glam::DVec3;
use nalgebra::Matrix6;

use super::column::EndStiffness;
use super::dual::{Dual, DualVec, Turn, jacobian};
use super::load::Wrench;
use super::state::{Displacement, MechanicsError, SpringState};
use super::suspension::Suspension;

impl Suspension {
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

    pub(super) fn load_at(&self, displacement: &Displacement) -> Result<Wrench, MechanicsError> {
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

    /// [`Suspension::wrench_at`] and [`Suspension::tangent_at`] at the cost of one.
    ///
    /// # Errors
    /// As [`Suspension::wrench_at`].
    pub fn wrench_and_tangent_at(
        &self,
        displacement: &Displacement,
    ) -> Result<(Wrench, Matrix6<f64>), MechanicsError> {
        let (force, moment) = self.derive(displacement)?;
        let wrench = Wrench {
            force_n: force.value() - self.rest_load.force_n,
            moment_nmm: moment.value() - self.rest_load.moment_nmm,
        };
        Ok((wrench, jacobian(force, moment)))
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
    pub(super) fn derive(&self, displacement: &Displacement) -> Result<(DualVec, DualVec), MechanicsError> {
        let values = displacement.to_array();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(MechanicsError::NotFinite);
        }
        let [tx, ty, tz, rx, ry, rz]: [Dual; 6] = std::array::from_fn(|i| Dual::variable(values[i], i));
        let shift = DualVec([tx, ty, tz]);
        let turn = Turn::new(DualVec([rx, ry, rz]));
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
}
