//! Levenberg-Marquardt over poses, and two forms of the residuals: the one loop for poses, of the solver that starts from
//! nothing and of the tracker that starts from the last frame.

use glam::{DVec2, DVec3};
use nalgebra::Matrix6;

use super::disc::{DIRECTIONS, Marker, OUTLINE, centroid_offset};
use super::sheet::{ObservedRay, PlacedSheet, SheetView};
use crate::numeric::{Rigid, rotation_from_vector, vector_from_rotation};
use crate::refraction::{RayLimit, SensorOptics};

const MAX_STEPS: u32 = 40;
/// A step this short ends the refinement, mm: the pose is then right to 1e-8 mm.
const CONVERGED_MM: f64 = 2e-6;
/// Longer steps are cut, mm; a turn of half a radian likewise.
const MAX_STEP_MM: f64 = 3.0;
const MM_PER_RAD: f64 = 6.0;

/// Why residuals do not exist at a pose: which marker, which limit.
pub(super) type HiddenMarker = (u32, RayLimit);

/// Sum of squared residuals (px^2), normal matrix (its lower half) and right side.
pub(super) struct NormalEquations {
    pub chi2: f64,
    matrix: [[f64; 6]; 6],
    right: [f64; 6],
}

/// Residuals of sightings as a function of the pose.
pub(super) trait ResidualModel {
    /// Normal equations at a pose. The first evaluation may use a guess for slow parts; the second value is whether all
    /// parts are exact.
    fn at(&mut self, pose: &Rigid, first_evaluation: bool) -> Result<(NormalEquations, bool), HiddenMarker>;
}

/// A refined pose.
pub(super) struct RefinedPose {
    pub pose: Rigid,
    pub chi2: f64,
    pub normal: Matrix6<f64>,
    pub steps: u32,
    pub converged: bool,
}

/// The pose at which discs have these centroids in the image (px), from a pose nearby (`rest_from_platform`): least squares
/// on raw pixels, to 1e-8 mm, in at most 40 steps, without allocating. `None` where fewer than three are seen, one is past what
/// the camera sees, or the steps do not converge. The optics are moved, and left at a pose near the one that is found.
pub fn refine_pose(
    optics: &mut SensorOptics,
    seen: impl ExactSizeIterator<Item = (Marker, DVec2)> + Clone,
    start: &Rigid,
) -> Option<Rigid> {
    if seen.len() < 3 {
        return None;
    }
    let refined = refine(&mut PixelResiduals { optics, seen }, *start, f64::INFINITY, None).ok()?;
    refined.converged.then(|| refined.pose.orthonormalized())
}

impl NormalEquations {
    fn empty() -> Self {
        Self { chi2: 0.0, matrix: [[0.0; 6]; 6], right: [0.0; 6] }
    }

    #[inline]
    fn add(&mut self, row: [f64; 6], left: f64) {
        self.chi2 += left * left;
        for i in 0..6 {
            self.right[i] += row[i] * left;
            for j in 0..=i {
                self.matrix[i][j] += row[i] * row[j];
            }
        }
    }

    fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.matrix[i.max(j)][i.min(j)])
    }

    /// The step of Levenberg and Marquardt: `(N + damping diag N) step = right`, by Cholesky's factors; `None` where
    /// the matrix is not positive definite.
    fn step(&self, damping: f64) -> Option<[f64; 6]> {
        let mut l = self.matrix;
        let mut x = self.right;
        let mut per_diagonal = [0.0; 6];
        for i in 0..6 {
            for j in 0..i {
                let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                l[i][j] = (l[i][j] - sum) * per_diagonal[j];
            }
            let sum: f64 = (0..i).map(|k| l[i][k] * l[i][k]).sum();
            let square = l[i][i] * (1.0 + damping) - sum;
            // Rounding of the sum: below it the direction is open.
            if square.is_nan() || square <= 1e-15 * l[i][i] {
                return None;
            }
            per_diagonal[i] = 1.0 / square.sqrt();
            let sum: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
            x[i] = (x[i] - sum) * per_diagonal[i];
        }
        for i in (0..6).rev() {
            let sum: f64 = (i + 1..6).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) * per_diagonal[i];
        }
        Some(x)
    }
}

/// PixelResiduals through all of `optics`, for any lens.
pub(super) struct PixelResiduals<'a, S> {
    pub optics: &'a mut SensorOptics,
    pub seen: S,
}

impl<S: Iterator<Item = (Marker, DVec2)> + Clone> ResidualModel for PixelResiduals<'_, S> {
    fn at(&mut self, pose: &Rigid, _first_look: bool) -> Result<(NormalEquations, bool), HiddenMarker> {
        let first = self.seen.clone().next().map_or(0, |(m, _)| m.id);
        self.optics.move_to(pose).map_err(|_| (first, RayLimit::PupilInsideSheet))?;
        let mut normal = NormalEquations::empty();
        for (marker, px) in self.seen.clone() {
            let (centroid, motion) =
                marker.centroid_with_motion(self.optics).map_err(|limit| (marker.id, limit))?;
            for axis in 0..2 {
                normal.add(std::array::from_fn(|j| motion[(axis, j)]), (px - centroid)[axis]);
            }
        }
        Ok((normal, true))
    }
}

/// PixelResiduals in the plane that touches the observed pixel's ray, scaled to pixels by the lens's Jacobian there,
/// plus an offset: what the exact centroid of the disc's image differs by. The offset changes slowly with the pose
/// (hundredths of a pixel per mm): a guess is enough for the first evaluation, every later one updates it, so that at
/// the end the residuals are those of raw pixels.
pub(super) struct TangentResiduals<'a> {
    sheet: &'a SheetView,
    seen: &'a [(Marker, DVec2)],
    observed: Vec<ObservedRay>,
    offsets: Vec<DVec2>,
    /// Tangent over reach of each marker's last ray, 1/mm; zero before.
    nears: Vec<f64>,
}

impl<'a> TangentResiduals<'a> {
    /// `offsets` are a first guess, px.
    pub fn new(
        sheet: &'a SheetView,
        seen: &'a [(Marker, DVec2)],
        observed: Vec<ObservedRay>,
        offsets: Vec<DVec2>,
    ) -> Self {
        Self { sheet, seen, observed, offsets, nears: vec![0.0; seen.len()] }
    }

    fn update_offsets(&mut self, placed: &PlacedSheet) -> Result<(), HiddenMarker> {
        let parts = self.seen.iter().zip(&self.observed).zip(&mut self.offsets).zip(&self.nears);
        for ((((marker, px), observed), offset), near) in parts {
            let radius = 0.5 * marker.diameter_mm;
            let steps: [DVec2; OUTLINE] = DIRECTIONS.map(|[cos, sin]| DVec2::new(radius * cos, radius * sin));
            let found = self.sheet.pixels(placed, marker.position_mm, steps, observed, *near);
            let (center, first_order, outline) = found.ok_or((marker.id, RayLimit::BeyondFieldOfView))?;
            // The exact centroid less what the first order says of the centre.
            *offset = center - *px - first_order;
            if radius > 0.0 {
                *offset += centroid_offset(center, &outline);
            }
        }
        Ok(())
    }
}

impl ResidualModel for TangentResiduals<'_> {
    fn at(&mut self, pose: &Rigid, first_evaluation: bool) -> Result<(NormalEquations, bool), HiddenMarker> {
        let first = self.seen.first().map_or(0, |(m, _)| m.id);
        let placed = self.sheet.placed(pose).ok_or((first, RayLimit::PupilInsideSheet))?;
        if first_evaluation {
            self.nears.fill(self.sheet.paraxial_tangent_per_mm(&placed));
        } else {
            self.update_offsets(&placed)?;
        }
        let mut normal = NormalEquations::empty();
        let parts = self.seen.iter().zip(&self.observed).zip(&self.offsets).zip(&mut self.nears);
        for ((((marker, _), observed), offset), near) in parts {
            let (from_observed, motion) = self
                .sheet
                .offset(&placed, marker.position_mm, observed, near)
                .ok_or((marker.id, RayLimit::BeyondFieldOfView))?;
            let left = -(from_observed + *offset);
            for (axis, [v, w]) in motion.iter().enumerate() {
                normal.add([v.x, v.y, v.z, w.x, w.y, w.z], left[axis]);
            }
        }
        Ok((normal, !first_evaluation))
    }
}

/// Refines a pose. Stops early when the residual is above `far` (px^2) after two steps (at once if a pose is `known`),
/// or when the pose comes near the known one.
pub(super) fn refine(
    model: &mut impl ResidualModel,
    start: Rigid,
    far: f64,
    known: Option<&Rigid>,
) -> Result<RefinedPose, HiddenMarker> {
    let mut pose = start;
    let (mut now, mut exact) = model.at(&pose, true)?;
    let (mut damping, mut steps, mut converged) = (0.0, 0, false);
    while steps < MAX_STEPS && !converged {
        // A second start is the mirror of a pose that fits: where both fit, it starts near its minimum.
        if (steps >= 2 || known.is_some()) && now.chi2 > far.max(1.0) {
            break;
        }
        steps += 1;
        let Some(step) = now.step(damping) else {
            damping = f64::max(10.0 * damping, 1e-6);
            continue;
        };
        let (v, w) = (DVec3::new(step[0], step[1], step[2]), DVec3::new(step[3], step[4], step[5]));
        let cut = (MAX_STEP_MM / v.length().max(MM_PER_RAD * w.length())).min(1.0);
        let (v, w) = (v * cut, w * cut);
        let next = Rigid::new(rotation_from_vector(w), v).compose(&pose);
        if known.is_some_and(|known| near(known, &next)) {
            break;
        }
        // A turn counts by what it moves at a lever of ten millimetres.
        let moved = v.length().max(10.0 * w.length());
        if exact && moved <= CONVERGED_MM && damping == 0.0 {
            // What is left after this step is some thousandths of it (the offset's own motion, and the curvature
            // where noise leaves residuals): no other evaluation is needed.
            (pose, converged) = (next, true);
            break;
        }
        match model.at(&next, false) {
            Ok((n, e)) if n.chi2 < now.chi2 || !exact => {
                (pose, now, exact) = (next, n, e);
                damping = if damping > 1e-9 { 0.1 * damping } else { 0.0 };
            }
            // At the floor of rounding no step goes down: this is the minimum.
            Ok((n, e)) if moved <= 1e-6 => (pose, now, exact, converged) = (next, n, e, true),
            _ => damping = f64::max(10.0 * damping, 1e-4),
        }
    }
    Ok(RefinedPose { pose, chi2: now.chi2, normal: now.matrix(), steps, converged })
}

/// A pose within a hundredth of a millimetre and a thousandth of a radian of a minimum leads to it.
fn near(a: &Rigid, b: &Rigid) -> bool {
    let between = a.compose(&b.inverse());
    between.translation_mm.length() < 1e-2 && vector_from_rotation(&between.rotation).length() < 1e-3
}
