//! Least squares on raw, distorted, refracted pixels.

use glam::{DVec2, DVec3};
use nalgebra::Vector6;

use super::disc::Marker;
use super::error::PoseError;
use super::estimate::{PoseEstimate, PoseOptions, Sighting};
use super::refine::{PixelResiduals, RefinedPose, TangentResiduals, refine};
use super::sheet::SheetView;
use super::start::{planar_poses, widest_four};
use crate::numeric::{Rigid, vector_from_rotation};
use crate::refraction::{RayLimit, SensorOptics};

/// Finds the platform's pose from its white markers; needs only what the constants hold.
#[derive(Debug, Clone)]
pub struct PoseSolver {
    optics: SensorOptics,
    markers: Vec<Marker>,
    options: PoseOptions,
    /// Apparent lift of the sheet's top by refraction, near the axis, mm.
    apparent_lift_mm: f64,
    /// The fast projection, where it holds: a central lens and markers on the sheet's top.
    sheet: Option<SheetView>,
    /// How far each disc's centroid is from its centre's image at rest, px; zero where it is not seen there.
    offsets_at_rest: Vec<DVec2>,
}

/// Most markers of one sensor.
pub const MAX_MARKERS: usize = 64;
/// Two sightings closer than this are one blob, px.
const ONE_BLOB_PX: f64 = 0.5;

impl PoseSolver {
    /// A solver for a sensor at rest.
    ///
    /// # Errors
    /// [`PoseError`] for fewer than four markers, two in one place or with one number, all on a line, or a
    /// position that is not finite.
    pub fn new(optics: &SensorOptics, markers: &[Marker], options: PoseOptions) -> Result<Self, PoseError> {
        if markers.len() < 4 || markers.len() > MAX_MARKERS {
            return Err(PoseError::Missing { ids: Vec::new() });
        }
        for (i, a) in markers.iter().enumerate() {
            if !(a.position_mm.is_finite() && a.diameter_mm.is_finite() && a.diameter_mm >= 0.0) {
                return Err(PoseError::NotFinite { id: a.id });
            }
            for b in &markers[..i] {
                if a.id == b.id || a.position_mm.distance(b.position_mm) <= 1e-9 * a.position_mm.length() {
                    return Err(PoseError::Duplicate { ids: [b.id, a.id] });
                }
            }
        }
        let flat: Vec<DVec2> = markers.iter().map(|m| m.position_mm.truncate()).collect();
        let four = widest_four(&flat).ok_or(PoseError::Collinear)?;
        if !spans_plane(&four.map(|i| flat[i])) {
            return Err(PoseError::Collinear);
        }
        let lift = |layer: &crate::refraction::FlatLayer| {
            let index = layer.index_for(optics.channel());
            layer.thickness_mm.map_or(0.0, |thickness| thickness * (1.0 - 1.0 / index))
        };
        let apparent_lift_mm = optics.layers().iter().map(lift).sum();
        // The fast projection holds for points on the sheet's top only.
        let flat = markers.iter().all(|m| m.position_mm.z == 0.0);
        let sheet = if flat { SheetView::new(optics) } else { None };
        let at_rest =
            |m: &Marker| m.image(optics).map_or(DVec2::ZERO, |image| image.centroid_px - image.center_px);
        let offsets_at_rest = markers.iter().map(at_rest).collect();
        Ok(Self {
            optics: optics.clone(),
            markers: markers.to_vec(),
            options,
            apparent_lift_mm,
            sheet,
            offsets_at_rest,
        })
    }

    /// The markers.
    pub fn markers(&self) -> &[Marker] {
        &self.markers
    }

    /// The optics at rest.
    pub fn optics(&self) -> &SensorOptics {
        &self.optics
    }

    /// The pose of the platform from its markers' centroids, in any order.
    ///
    /// A homography gives one or two starts; Levenberg-Marquardt refines each on raw pixels with the analytic
    /// Jacobian, discs included; at most 40 steps.
    ///
    /// # Errors
    /// See [`PoseError`]; a pose is only given when its residual is what noise leaves.
    pub fn solve(&self, sightings: &[Sighting]) -> Result<PoseEstimate, PoseError> {
        let seen = self.matched(sightings)?;
        match self.solve_matched(&seen) {
            Err(
                error @ (PoseError::DoesNotFit { .. }
                | PoseError::NoViewFits { .. }
                | PoseError::OutOfReach { .. }
                | PoseError::NotConverged { .. }),
            ) => Err(self.swap_that_fits(&seen).map_or(error, |ids| PoseError::Swapped { ids })),
            other => other,
        }
    }

    /// The closed-form pose that refinement starts from: a homography of four markers, with the layers' refraction
    /// taken as near the axis. Of the two that a plane allows, the nearer to rest.
    ///
    /// # Errors
    /// [`PoseError`] for markers that are missing, doubled, unseen or on a line.
    pub fn start(&self, sightings: &[Sighting]) -> Result<Rigid, PoseError> {
        let seen = self.matched(sightings)?;
        let flat: Vec<DVec2> = seen.iter().map(|(m, _)| m.position_mm.truncate()).collect();
        let four = widest_four(&flat).ok_or(PoseError::Collinear)?;
        let mut rays = [DVec3::ZERO; 4];
        for (ray, i) in rays.iter_mut().zip(four) {
            let hidden = |limit: crate::camera::LensLimit| PoseError::NotVisible {
                id: seen[i].0.id,
                limit: limit.into(),
            };
            *ray = self.optics.lens().unproject(seen[i].1).map_err(hidden)?;
        }
        let starts = planar_poses(&four.map(|i| flat[i]), &rays).ok_or(PoseError::Collinear)?;
        let [one, two] = starts.map(|start| self.start_pose(&start));
        let turn = |pose: &Rigid| vector_from_rotation(&pose.rotation).length();
        Ok(if turn(&two) < turn(&one) { two } else { one })
    }

    fn matched(&self, sightings: &[Sighting]) -> Result<Vec<(Marker, DVec2)>, PoseError> {
        let mut seen: Vec<(Marker, DVec2)> = Vec::with_capacity(sightings.len());
        for sighting in sightings {
            let id = sighting.id;
            let marker = self.markers.iter().find(|m| m.id == id).ok_or(PoseError::UnknownMarker { id })?;
            if !sighting.centroid_px.is_finite() {
                return Err(PoseError::NotFinite { id });
            }
            for (other, px) in &seen {
                if other.id == id || px.distance_squared(sighting.centroid_px) < ONE_BLOB_PX * ONE_BLOB_PX {
                    return Err(PoseError::Duplicate { ids: [other.id, id] });
                }
            }
            seen.push((*marker, sighting.centroid_px));
        }
        if seen.len() < 4 {
            let missing = self.markers.iter().filter(|m| seen.iter().all(|(s, _)| s.id != m.id));
            return Err(PoseError::Missing { ids: missing.map(|m| m.id).collect() });
        }
        Ok(seen)
    }

    fn solve_matched(&self, seen: &[(Marker, DVec2)]) -> Result<PoseEstimate, PoseError> {
        let four = if seen.len() == 4 {
            [0, 1, 2, 3]
        } else {
            let flat: Vec<DVec2> = seen.iter().map(|(m, _)| m.position_mm.truncate()).collect();
            widest_four(&flat).ok_or(PoseError::Collinear)?
        };
        let hidden = |i: usize, limit: RayLimit| PoseError::NotVisible { id: seen[i].0.id, limit };
        let mut rays = [DVec3::ZERO; 4];
        let mut tangent_residuals = None;
        if let Some(sheet) = &self.sheet {
            let mut observed = Vec::with_capacity(seen.len());
            for (i, (_, px)) in seen.iter().enumerate() {
                observed.push(sheet.observed_ray(*px).map_err(|limit| hidden(i, limit))?);
            }
            rays = four.map(|i| observed[i].ray());
            let at_rest = |m: &Marker| {
                self.markers.iter().position(|own| own.id == m.id).map(|i| self.offsets_at_rest[i])
            };
            let offsets = seen.iter().map(|(m, _)| at_rest(m).unwrap_or_default()).collect();
            tangent_residuals = Some(TangentResiduals::new(sheet, seen, observed, offsets));
        } else {
            for (ray, i) in rays.iter_mut().zip(four) {
                *ray = self.optics.lens().unproject(seen[i].1).map_err(|limit| hidden(i, limit.into()))?;
            }
        }
        let points = four.map(|i| seen[i].0.position_mm.truncate());
        let starts = planar_poses(&points, &rays).ok_or(PoseError::Collinear)?;
        let allowed = chi2_limit(2 * seen.len()) * self.options.noise_px.powi(2);
        // The second start is worth refining only where it could come to fit: far from that it is the mirror of
        // a plane so near that perspective tells the two apart.
        let far = 400.0 * allowed;
        let mut limit = None;
        let mut run = |start: &Rigid, known: Option<&Rigid>| {
            let start = self.start_pose(start);
            let fit = match &mut tangent_residuals {
                Some(residuals) => refine(residuals, start, far, known),
                None => {
                    let (optics, seen) = (&mut self.optics.clone(), seen.iter().copied());
                    refine(&mut PixelResiduals { optics, seen }, start, far, known)
                }
            };
            fit.map_err(|error| limit = limit.or(Some(error))).ok()
        };
        let first = run(&starts[0], None);
        let second = run(&starts[1], first.as_ref().filter(|f| f.chi2 <= allowed).map(|f| &f.pose));
        let (best, other) = match (first, second) {
            // A second fit that stopped because it was closing in on the first is the first.
            (Some(a), Some(b)) if b.chi2 < a.chi2 && (b.converged || !a.converged) => (b, Some(a)),
            (Some(a), b) => (a, b),
            (None, Some(b)) => (b, None),
            (None, None) => {
                let (id, limit) = limit.unwrap_or((seen[0].0.id, RayLimit::NotConverged));
                return Err(PoseError::NoViewFits { id, limit });
            }
        };
        self.accept(best, other, 2 * seen.len(), allowed)
    }

    /// The estimate of the best fit to `count` numbers, if its residual is within `allowed` (px^2) and the platform
    /// can reach the pose; with the other fit where noise cannot tell the two apart.
    fn accept(
        &self,
        best: RefinedPose,
        other: Option<RefinedPose>,
        count: usize,
        allowed: f64,
    ) -> Result<PoseEstimate, PoseError> {
        let count = count as f64;
        let rms_px = (best.chi2 / count).sqrt();
        if best.chi2 > allowed {
            return Err(PoseError::DoesNotFit { rms_px, allowed_px: (allowed / count).sqrt() });
        }
        if !best.converged {
            return Err(PoseError::NotConverged { rms_px });
        }
        let mut estimate = PoseEstimate {
            pose: best.pose,
            information: best.normal / self.options.noise_px.powi(2),
            rms_px,
            iterations: best.steps,
            other: None,
        };
        // Both starts may lead to one pose; two poses are two when they differ by more than noise.
        let other = other.filter(|o| o.converged && o.chi2 <= allowed && differs(&estimate, &o.pose));
        let reachable = |pose: &Rigid| {
            pose.translation_mm.length() <= self.options.max_shift_mm
                && vector_from_rotation(&pose.rotation).length() <= self.options.max_turn_rad
        };
        match (reachable(&estimate.pose), other) {
            (true, other) => estimate.other = other.map(|o| o.pose).filter(reachable),
            (false, Some(o)) if reachable(&o.pose) => {
                estimate.pose = o.pose;
                estimate.information = o.normal / self.options.noise_px.powi(2);
            }
            (false, _) => {
                return Err(PoseError::OutOfReach {
                    shift_mm: estimate.pose.translation_mm.length(),
                    turn_rad: vector_from_rotation(&estimate.pose.rotation).length(),
                });
            }
        }
        Ok(estimate)
    }

    /// From the camera's view of a plane without layers to the platform's pose behind them, paraxially.
    fn start_pose(&self, camera_from_plane: &Rigid) -> Rigid {
        let rest_from_camera = self.optics.rest_from_camera();
        let mut pose = rest_from_camera.compose(camera_from_plane);
        pose.translation_mm += pose.rotation.z_axis * self.apparent_lift_mm;
        // A start must let the camera stay below the sheet.
        let camera = pose.inverse().point(rest_from_camera.translation_mm);
        let bottom = -self.optics.layers().iter().skip(1).filter_map(|l| l.thickness_mm).sum::<f64>();
        if camera.z > bottom {
            pose.translation_mm += pose.rotation.z_axis * (camera.z - bottom + 1e-3 * bottom.abs().max(1.0));
        }
        pose
    }

    /// The order of marker numbers in which the pixels fit, if another order than the given one does: tried for up to
    /// five sightings.
    fn swap_that_fits(&self, seen: &[(Marker, DVec2)]) -> Option<Vec<u32>> {
        if seen.len() > 5 {
            return None;
        }
        permutations(seen.len()).into_iter().find_map(|order| {
            let permuted: Vec<(Marker, DVec2)> =
                order.iter().zip(seen).map(|(from, (_, px))| (seen[*from].0, *px)).collect();
            self.solve_matched(&permuted).ok().map(|_| permuted.iter().map(|(m, _)| m.id).collect())
        })
    }
}

/// All orders of n things but the first, which is no change.
fn permutations(n: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..n {
        all = all
            .into_iter()
            .flat_map(|head: Vec<usize>| {
                (0..n)
                    .filter(|i| !head.contains(i))
                    .map(|i| [head.as_slice(), &[i]].concat())
                    .collect::<Vec<_>>()
            })
            .collect();
    }
    all.into_iter().skip(1).collect()
}

/// The squared residual that noise of one pixel passes once in a million poses: chi-squared with `count - 6`
/// degrees of freedom by Wilson and Hilferty's cube, and room for a disc's centroid found a little off.
fn chi2_limit(count: usize) -> f64 {
    let freedom = (count - 6) as f64;
    let part = 2.0 / (9.0 * freedom);
    freedom * (1.0 - part + 4.753 * part.sqrt()).powi(3)
}

fn differs(estimate: &PoseEstimate, other: &Rigid) -> bool {
    let covariance = estimate.covariance();
    let between = other.compose(&estimate.pose.inverse());
    let (t, r) = (between.translation_mm, vector_from_rotation(&between.rotation));
    let motion = Vector6::new(t.x, t.y, t.z, r.x, r.y, r.z);
    (0..6).any(|i| motion[i].abs() > 6.0 * covariance[(i, i)].max(0.0).sqrt() + 1e-9)
}

fn spans_plane(four: &[DVec2; 4]) -> bool {
    let area = |i: usize, j: usize, k: usize| (four[j] - four[i]).perp_dot(four[k] - four[i]).abs();
    let areas = [area(0, 1, 2), area(0, 1, 3), area(0, 2, 3), area(1, 2, 3)];
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let smallest = areas.iter().copied().fold(f64::INFINITY, f64::min);
    smallest > 1e-4 * largest && largest > 0.0
}
