//! The search for a balance: trials of the platform's displacement and of the object's way.
//!
//! Broyden's method (C. G. Broyden, Math. Comp. 19, 1965) from the springs' exact tangent and the half-space stiffness of
//! the contact, or from what the frame before learnt, with shorter steps where the residual grows. A trial's contact is
//! solved only as closely as the balance is found; the last one to its end.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, DVector};

use super::approach::touch_mm;
use super::pressed::{PressStatus, Pressed};
use crate::contact::{Contact, Prepared};
use crate::elastomer::Indenter;
use crate::error::ContactError;
use crate::finite_strain::{Deformed, Tried};
use crate::level::Level;
use crate::linear::Solver;
use crate::state::ContactState;
use domecast_optics::DomeShape;
use domecast_optics::numeric::{Rigid, cross_matrix};
use domecast_springs::{Displacement, MechanicsError, Suspension, Wrench};

/// Contact solves that a balance may take.
const MAX_SOLVES: u32 = 80;
/// The search ends when the residual is below this part of the load; ten times that still counts as
/// balanced.
const TOLERANCE: f64 = 1e-7;
/// The same of a first search whose trials are not yet exact.
const LOOSE: f64 = 1e-2;
/// Loads below this one are balanced as closely as it is, N.
const MIN_SCALE_N: f64 = 0.05;

/// Contact solves without any gain after which a search ends.
const MAX_WITHOUT_GAIN: u32 = 20;

/// How much closer than the balance a trial's contact is solved.
const CLOSER: f64 = 1e-2;
/// Starts that are tried where the models refuse the first.
const MAX_STARTS: u32 = 6;
/// Times that a balance is looked for again after the contact was solved to its end.
const MAX_ENDS: u32 = 4;

/// One trial of the unknowns.
struct Trial {
    state: ContactState,
    platform: Rigid,
    object: Rigid,
    wrench: Wrench,
    /// Springs' wrench less the contact's, moments over the reach; then the force's miss.
    residual: DVector<f64>,
    size: f64,
}

/// Where a search is.
struct Search {
    x: DVector<f64>,
    /// Contact solves so far.
    count: u32,
    jacobian: Option<DMatrix<f64>>,
}

/// What is to be balanced.
pub(super) struct Task<'a> {
    pub contact: &'a Contact,
    pub indenter: &'a Indenter,
    pub suspension: &'a Suspension,
    pub rest_from_object: Rigid,
    pub before: Option<&'a ContactState>,
    /// The way that the object may move, and the force wanted along it.
    pub force: Option<(DVec3, f64)>,
}

/// Contact solves of one balance.
enum Solves<'a> {
    /// The linear level goes on from trial to trial.
    Linear(Box<Solver<'a>>),
    /// The others start anew, the finite-strain level from the last trial.
    Each(Option<Arc<Deformed>>),
}

impl Solves<'_> {
    /// The contact at a pose. `off_n` is what the balance was off by; only the last trial is solved to its end.
    fn solve(
        &mut self,
        task: &Task<'_>,
        sensor_from_object: &Rigid,
        off_n: Option<f64>,
    ) -> Result<ContactState, ContactError> {
        match self {
            Self::Each(tried) => {
                let near = tried.as_deref().map(|deformed| Tried { deformed, shares_way: off_n.is_some() });
                let (object, before) = (sensor_from_object, task.before);
                let state = task.contact.solve_near(task.indenter, object, before, near)?;
                *tried = state.history.body.clone().or(tried.take());
                Ok(state)
            }
            Self::Linear(solver) => task.contact.checked(task.indenter, sensor_from_object, || {
                let elastomer = task.contact.elastomer();
                // Displacements, by the stiffness of a contact of a tenth of the dome.
                let stiffness = 0.2 * elastomer.dome_radius_mm * elastomer.plane_strain_mpa();
                let tolerance_mm = off_n.map_or(0.0, |off_n| CLOSER * off_n / stiffness);
                solver.solve(sensor_from_object, tolerance_mm, off_n.is_none())
            }),
        }
    }
}

impl Task<'_> {
    fn unknowns(&self) -> usize {
        6 + usize::from(self.force.is_some())
    }

    /// One trial; `off_n` is what the last one was off by, `None` for one solved to its end.
    fn try_at(
        &self,
        solves: &mut Solves<'_>,
        x: &DVector<f64>,
        off_n: Option<f64>,
    ) -> Result<Trial, ContactError> {
        let reach = self.suspension.reach_mm();
        let displacement = Displacement::from_array(std::array::from_fn(|i| x[i]));
        let platform = displacement.to_pose(self.suspension.at_mm());
        let mut object = self.rest_from_object;
        if let Some((way, _)) = self.force {
            object.translation_mm += way * x[6];
        }
        let sensor_from_object = platform.inverse().compose(&object);
        let state = solves.solve(self, &sensor_from_object, off_n)?;
        let wrench = Wrench::of_load(
            platform.vector(state.wrench.force_n),
            platform.vector(state.wrench.moment_nmm),
            platform.translation_mm,
            self.suspension.at_mm(),
        );
        let springs = self.suspension.wrench_at(&displacement)?.to_array();
        let mut residual = DVector::zeros(self.unknowns());
        for (i, (spring, contact)) in springs.into_iter().zip(wrench.to_array()).enumerate() {
            residual[i] = (spring - contact) / if i < 3 { 1.0 } else { reach };
        }
        if let Some((way, force_n)) = self.force {
            residual[6] = wrench.force_n.dot(way) - force_n;
        }
        let size = residual.norm();
        Ok(Trial { state, platform, object, wrench, residual, size })
    }

    /// Derivative of the residual: the springs' exactly, the contact's as a half-space's.
    fn jacobian(&self, x: &DVector<f64>, trial: &Trial) -> Result<DMatrix<f64>, MechanicsError> {
        let reach = self.suspension.reach_mm();
        let displacement = Displacement::from_array(std::array::from_fn(|i| x[i]));
        let mut tangent = self.suspension.tangent_at(&displacement)?;
        let n = self.unknowns();
        let mut jacobian = DMatrix::zeros(n, n);
        let mut stiffness = DMat3::ZERO;
        let mut arm = DVec3::ZERO;
        let elastomer = self.contact.elastomer();
        if let Some((at, normal)) = middle(&trial.state, elastomer.dome()) {
            let sharing = 1.0 + self.indenter.yield_ratio(elastomer);
            let a = trial.state.contact_radius_mm;
            let axial = 2.0 * a * elastomer.plane_strain_mpa() / sharing;
            let lateral = if self.before.is_some() && elastomer.friction > 0.0 {
                8.0 * a * elastomer.shear_mpa() / (sharing * (2.0 - elastomer.poisson))
            } else {
                0.0
            };
            let normal = trial.platform.vector(normal);
            let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
            stiffness = outer * axial + (DMat3::IDENTITY - outer) * lateral;
            arm = trial.platform.point(at) - self.suspension.at_mm();
            // Displacement of the touched place: t + w x arm.
            let turn = -cross_matrix(arm);
            let by_turn = stiffness * turn;
            let moment = cross_matrix(arm);
            let (mt, mr) = (moment * stiffness, moment * by_turn);
            for row in 0..3 {
                for column in 0..3 {
                    tangent[(row, column)] += stiffness.col(column)[row];
                    tangent[(row, column + 3)] += by_turn.col(column)[row];
                    tangent[(row + 3, column)] += mt.col(column)[row];
                    tangent[(row + 3, column + 3)] += mr.col(column)[row];
                }
            }
        }
        for row in 0..6 {
            for column in 0..6 {
                jacobian[(row, column)] = tangent[(row, column)] / if row < 3 { 1.0 } else { reach };
            }
        }
        if let Some((way, _)) = self.force {
            let force = stiffness * way;
            let moment = arm.cross(force) / reach;
            for i in 0..3 {
                jacobian[(i, 6)] = -force[i];
                jacobian[(i + 3, 6)] = -moment[i];
                // The contact's force falls when the platform gives way.
                jacobian[(6, i)] = -force[i];
                jacobian[(6, i + 3)] = -arm.cross(force)[i];
            }
            jacobian[(6, 6)] = way.dot(force).max(1e-3);
        }
        Ok(jacobian)
    }

    /// Looks for the balance from a start, with what the frame before learnt.
    pub fn run(&self, start: DVector<f64>, learnt: Option<&DMatrix<f64>>) -> Result<Pressed, ContactError> {
        let mut solves = match &self.contact.prepared {
            Prepared::Compliance(compliance) => Solves::Linear(Box::new(Solver::new(
                self.contact.elastomer(),
                compliance,
                self.indenter,
                self.before,
            ))),
            _ => Solves::Each(None),
        };
        let mut search = Search { x: start, count: 1, jacobian: None };
        let first_off = Some(self.scale(0.0));
        let mut trial = loop {
            match self.try_at(&mut solves, &search.x, first_off) {
                Ok(trial) => break trial,
                Err(error) if search.count >= MAX_STARTS => return Err(error),
                // A start that the models refuse is no answer to the task: from rest, then, and the object back to where
                // it hardly touches.
                Err(_) => {
                    search.x.rows_mut(0, 6).fill(0.0);
                    if let Some((way, _)) = self.force {
                        let rest = Rigid::identity();
                        let touch_mm = touch_mm(
                            self.contact.elastomer().dome(),
                            self.indenter,
                            &rest,
                            &self.rest_from_object,
                            way,
                        )?;
                        search.x[6] = touch_mm + (search.x[6] - touch_mm) * 0.3;
                    }
                    search.count += 1;
                }
            }
        };
        // What the frame before learnt of the stiffness serves this one.
        search.jacobian =
            learnt.filter(|j| j.nrows() == self.unknowns() && !trial.state.nodes.is_empty()).cloned();
        // At finite strain trials share the way of the first, until it is walked anew to where they have led.
        let is_walked = matches!(self.contact.level(), Level::FiniteStrain { .. });
        let mut tolerance = if is_walked { LOOSE } else { TOLERANCE };
        for _ in 0..MAX_ENDS {
            trial = self.search(&mut solves, &mut search, trial, tolerance)?;
            if matches!(solves, Solves::Each(_)) && tolerance == TOLERANCE {
                break;
            }
            tolerance = TOLERANCE;
            // The contact to its end; the balance may not notice.
            search.count += 1;
            let last = self.try_at(&mut solves, &search.x, None);
            trial = last?;
            if trial.size <= TOLERANCE * self.scale(trial.wrench.force_n.length())
                || search.count >= MAX_SOLVES
            {
                break;
            }
        }
        self.finish(trial, search)
    }

    /// The load that residuals are measured by, N.
    fn scale(&self, force_n: f64) -> f64 {
        force_n.max(self.force.map_or(0.0, |f| f.1.abs())).max(MIN_SCALE_N)
    }

    /// Broyden's method from a trial on, until it balances or nothing helps.
    fn search(
        &self,
        solves: &mut Solves<'_>,
        search: &mut Search,
        mut trial: Trial,
        tolerance: f64,
    ) -> Result<Trial, ContactError> {
        let mut fresh = search.jacobian.is_none();
        let mut jacobian = match search.jacobian.take() {
            Some(jacobian) => jacobian,
            None => self.jacobian(&search.x, &trial)?,
        };
        let (mut best_size, mut best_count) = (trial.size, search.count);
        // A contact whose forces have steps has no balance to be found.
        while search.count < MAX_SOLVES.min(best_count + MAX_WITHOUT_GAIN) {
            if trial.size <= 0.3 * tolerance * self.scale(trial.wrench.force_n.length()) {
                break;
            }
            let Some(step) = jacobian.clone().lu().solve(&-&trial.residual) else { break };
            let mut part = self.step_part(&step);
            let mut next = None;
            while part > 1e-4 && search.count < MAX_SOLVES {
                search.count += 1;
                let there = &search.x + &step * part;
                if let Ok(found) = self.try_at(solves, &there, Some(trial.size))
                    && found.size < 1.5 * best_size.max(0.3 * trial.size)
                {
                    next = Some((there, found));
                    break;
                }
                if !fresh {
                    break;
                }
                part *= 0.4;
            }
            let Some((there, found)) = next else {
                if fresh {
                    break;
                }
                jacobian = self.jacobian(&search.x, &trial)?;
                fresh = true;
                continue;
            };
            let moved = &there - &search.x;
            let miss = &found.residual - &trial.residual - &jacobian * &moved;
            jacobian += &miss * moved.transpose() / moved.norm_squared().max(f64::MIN_POSITIVE);
            fresh = false;
            if found.size < best_size {
                (best_size, best_count) = (found.size, search.count);
            }
            (search.x, trial) = (there, found);
        }
        search.jacobian = Some(jacobian);
        Ok(trial)
    }

    /// Long steps are cut: no more than a tenth of the dome, or of a radian, at once.
    fn step_part(&self, step: &DVector<f64>) -> f64 {
        let radius = self.contact.elastomer().dome_radius_mm;
        let shift = step.rows(0, 3).norm().max(step.get(6).map_or(0.0, |s| s.abs()));
        let turn = step.rows(3, 3).norm();
        (0.15 * radius / shift.max(f64::MIN_POSITIVE)).min(0.15 / turn.max(f64::MIN_POSITIVE)).min(1.0)
    }

    fn finish(&self, trial: Trial, search: Search) -> Result<Pressed, ContactError> {
        let (x, iterations) = (&search.x, search.count);
        let scale = trial.wrench.force_n.length().max(MIN_SCALE_N);
        let displacement = Displacement::from_array(std::array::from_fn(|i| x[i]));
        let solid = self.suspension.spec().spring.solid_compression_mm();
        let bound = self.suspension.springs_at(&displacement).ok().and_then(|springs| {
            springs
                .iter()
                .enumerate()
                .filter(|(_, spring)| spring.compression_mm > solid)
                .max_by(|a, b| a.1.compression_mm.total_cmp(&b.1.compression_mm))
                .map(|(number, _)| number)
        });
        let status = if trial.size > 10.0 * TOLERANCE * scale {
            PressStatus::NotBalanced { residual_n: trial.size }
        } else {
            bound.map_or(PressStatus::Balanced, |spring| PressStatus::SpringsBind { spring })
        };
        Ok(Pressed {
            rest_from_platform: trial.platform,
            rest_from_object: trial.object,
            wrench: trial.wrench,
            residual_n: trial.size,
            iterations,
            status,
            state: trial.state,
            learnt: search.jacobian,
        })
    }
}

/// Middle of the pressure and the dome's normal there, sensor frame.
fn middle(state: &ContactState, dome: DomeShape) -> Option<(DVec3, DVec3)> {
    let weight: f64 = state.nodes.iter().map(|n| n.pressure_mpa * n.area_mm2).sum();
    let at = state.nodes.iter().map(|n| n.at_mm * (n.pressure_mpa * n.area_mm2)).sum::<DVec3>() / weight;
    (weight > 0.0 && at.is_finite()).then(|| (at, dome.outward_mm(at).normalize_or(DVec3::Z)))
}
