//! A pose where only two white markers are seen: their four equations, and the dots for the two that are missing.
//!
//! Dots stand on the platform but for what touches them. A load shears, lifts and twists the whole dome, the more the farther
//! from its bonded foot: four numbers of the skin are fitted with the six of the pose. What else a touch moves lies far from
//! where the others say and counts little (S. Geman and D. McClure, Bull. Int. Stat. Inst. 52, 1987). What the rest is off by is
//! taken from the residuals: that in which neighbours differ is each dot's own (its print), the other part goes together over
//! some of the dome (its skin).

use glam::{DVec2, DVec3};
use nalgebra::{Matrix2x4, Matrix6, Matrix6x2, SMatrix, SVector, Vector2};

use super::refine::{MarkerSighting, RefinedPose};
use crate::track::identities::DotTrack;
use crate::track::marks::MarkState;
use crate::track::model::DotModel;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::{Rigid, rotation_from_vector};
use domecast_optics::pose::Marker;

/// Numbers that are fitted: of the pose, of the skin, and both.
const SKIN: usize = 4;
const ALL: usize = 6 + SKIN;
/// Fewest dots that help.
const MIN_DOTS: usize = 16;
/// Steps, each with new weights, and the length of the last one, mm; a turn counts at ten millimetres.
const MAX_STEPS: usize = 30;
const CONVERGED_MM: f64 = 1e-5;
/// A residual of so many deviations counts a quarter.
const DOUBTFUL: f64 = 2.0;
/// Largest deviation of the dots, in parts of their spacing: beyond it the numbers are another pose's.
const MAX_SCATTER: f64 = 0.4;
/// Deviation of what the skin of the pole is moved by as a whole, and over what distance its other displacements go together, in
/// parts of the dome's radius: choices; more than any claimed load does, and between a fingertip and the whole dome.
const MOVED_PART: f64 = 0.05;
const TOGETHER_PART: f64 = 0.5;
/// What all dots of a region are off by alike in frames without a fault, px: light that falls off, the lens's blur.
const MIN_SKIN_PX: f64 = 0.03;
/// Least part of the skin's displacements that is taken to be left in the residuals.
const MIN_LEFT: f64 = 0.05;
/// Medians of the length of a normal vector in the plane, and of half of its square.
const MEDIAN_LENGTH: f64 = 1.1774;
const MEDIAN_HALF_SQUARE: f64 = std::f64::consts::LN_2;

/// How a sighting's centroid moves with all numbers, and what it is off by.
type Motion = SMatrix<f64, 2, ALL>;

/// What the numbers are off by.
struct Spread {
    inverse: SMatrix<f64, ALL, ALL>,
    /// What the square of one of the skin's numbers counts.
    prior: f64,
    /// Variances of what each dot has of its own, of what the skin has, and of what counts one.
    px2: [f64; 3],
    /// Over which distance the skin's goes together.
    reach_mm: f64,
}

/// Refines poses with the dots' help; keeps its buffers.
#[derive(Debug, Clone)]
pub(super) struct DotHelp {
    /// Numbers of the dots that help, and by number the residual, px.
    used: Vec<usize>,
    residuals: Vec<Option<DVec2>>,
    /// Of each sighting: its motion, its residual, what its square counts.
    rows: Vec<(Motion, DVec2, f64)>,
    values: Vec<f64>,
}

impl DotHelp {
    /// For so many dots.
    pub fn new(dots: usize, markers: usize) -> Self {
        Self {
            used: Vec::with_capacity(dots),
            residuals: vec![None; dots],
            rows: Vec::with_capacity(dots + markers),
            values: Vec::with_capacity(dots),
        }
    }

    /// The pose of the markers in `seen` and the dots, which are added to it, from one nearby. The optics are left at it.
    pub fn refine(
        &mut self,
        optics: &mut SensorOptics,
        seen: &mut Vec<MarkerSighting>,
        (models, tracks): (&[DotModel], &[DotTrack]),
        start: &Rigid,
    ) -> Option<RefinedPose> {
        let markers = seen.len();
        let marker_px = seen.iter().map(|one| one.sd_px).sum::<f64>() / markers.max(1) as f64;
        self.take(seen, models, tracks);
        if self.used.len() < MIN_DOTS || markers == 0 {
            return None;
        }
        let radius_mm = optics.dome().radius_mm();
        let (mut pose, mut skin) = (*start, SVector::<f64, SKIN>::zeros());
        for step in 0..MAX_STEPS {
            optics.move_to(&pose).ok()?;
            let scatter_px = self.compare(optics, seen, &skin, markers)?.max(marker_px);
            let dots_part = (marker_px / scatter_px).powi(2);
            for (_, off, weight) in &mut self.rows[markers..] {
                let far =
                    if step == 0 { 0.0 } else { off.length_squared() / (DOUBTFUL * scatter_px).powi(2) };
                *weight = dots_part / (1.0 + far).powi(2);
            }
            // Each of the skin's numbers has been seen to be zero, to that deviation.
            let prior = (marker_px / (MOVED_PART * radius_mm)).powi(2);
            let (matrix, right) = self.normal(&skin, prior);
            let factors = matrix.cholesky()?;
            let by = factors.solve(&right);
            let (v, w) = (DVec3::new(by[0], by[1], by[2]), DVec3::new(by[3], by[4], by[5]));
            let moved_mm = v.length().max(10.0 * w.length());
            if moved_mm < CONVERGED_MM {
                let is_near = scatter_px < MAX_SCATTER * models.first()?.spacing_px;
                let own_px2 = self.own_px2(models).min(scatter_px * scatter_px);
                let skin_px2 = (scatter_px * scatter_px - own_px2).max(MIN_SKIN_PX * MIN_SKIN_PX);
                let px2 = [own_px2, skin_px2, marker_px * marker_px];
                let spread =
                    Spread { inverse: factors.inverse(), prior, px2, reach_mm: TOGETHER_PART * radius_mm };
                let refined = self.refined(seen, markers, &spread, pose);
                return Some(refined).filter(|_| is_near);
            }
            pose = Rigid::new(rotation_from_vector(w), v).compose(&pose).orthonormalized();
            skin += by.fixed_rows::<SKIN>(6);
        }
        None
    }

    /// Adds the dots that are sure.
    fn take(&mut self, seen: &mut Vec<MarkerSighting>, models: &[DotModel], tracks: &[DotTrack]) {
        self.used.clear();
        for (index, (model, track)) in models.iter().zip(tracks).enumerate() {
            let is_sure = track.state == MarkState::Ok && track.fault.is_none() && !track.is_unsure;
            let seen_there = track.spot.zip(track.center_px()).filter(|_| is_sure);
            let Some((spot, centroid_px)) = seen_there else { continue };
            self.used.push(index);
            let marker = Marker { id: model.id, position_mm: model.surface_mm, diameter_mm: 0.0 };
            let sighting = MarkerSighting::new(marker, centroid_px, [spot.sd_px; 2]);
            seen.push(MarkerSighting { is_dot: true, ..sighting });
        }
    }

    /// Motions and residuals of all sightings at the pose of the optics; the dots' deviation on each axis, px.
    fn compare(
        &mut self,
        optics: &SensorOptics,
        seen: &[MarkerSighting],
        skin: &SVector<f64, SKIN>,
        markers: usize,
    ) -> Option<f64> {
        let dome = optics.dome();
        self.residuals.fill(None);
        self.values.clear();
        self.rows.clear();
        for (index, one) in seen.iter().enumerate() {
            let at = one.marker.position_mm;
            let seen = optics.project_with_motion(at).ok()?;
            let mut motion = Motion::zeros();
            motion.fixed_columns_mut::<6>(0).copy_from(&seen.by_pose);
            let mut off = one.centroid_px - seen.pixel;
            if one.is_dot {
                let height = at.z / dome.pole_mm().z;
                let around = DVec3::Z.cross(at) / dome.radius_mm();
                let modes = SMatrix::<f64, 3, SKIN>::from_columns(
                    &[DVec3::X, DVec3::Y, DVec3::Z, around].map(|v| (v * height).to_array().into()),
                );
                let by_skin: Matrix2x4<f64> = seen.by_point * modes;
                motion.fixed_columns_mut::<SKIN>(6).copy_from(&by_skin);
                let moved = by_skin * skin;
                off -= DVec2::new(moved.x, moved.y);
                self.residuals[self.used[index - markers]] = Some(off);
                self.values.push(off.length());
            } else {
                off -= one.marker.centroid_offset_px(optics, seen.pixel).ok()?;
            }
            self.rows.push((motion, off, 1.0));
        }
        Some(median(&mut self.values)? / MEDIAN_LENGTH)
    }

    /// Normal equations of all numbers; `prior`: what the square of one of the skin's counts.
    fn normal(&self, skin: &SVector<f64, SKIN>, prior: f64) -> (SMatrix<f64, ALL, ALL>, SVector<f64, ALL>) {
        let (mut matrix, mut right) = (SMatrix::zeros(), SVector::zeros());
        for (motion, off, weight) in &self.rows {
            let weighed = motion.transpose() * *weight;
            matrix += weighed * motion;
            right += weighed * Vector2::new(off.x, off.y);
        }
        for k in 0..SKIN {
            matrix[(6 + k, 6 + k)] += prior;
            right[6 + k] -= prior * skin[k];
        }
        (matrix, right)
    }

    /// Variance on each axis of what each dot has of its own, px^2: by what it differs from the mean of its neighbours.
    fn own_px2(&mut self, models: &[DotModel]) -> f64 {
        self.values.clear();
        for dot in &self.used {
            let around = models[*dot].neighbors.iter().filter_map(|other| self.residuals[*other]);
            let (sum, count) = around.fold((DVec2::ZERO, 0.0), |(sum, count), off| (sum + off, count + 1.0));
            if let Some(off) = self.residuals[*dot].filter(|_| count > 1.0) {
                self.values.push(0.5 * (off - sum / count).length_squared() / (1.0 + 1.0 / count));
            }
        }
        median(&mut self.values).unwrap_or(0.0) / MEDIAN_HALF_SQUARE
    }

    /// The pose with its covariance.
    fn refined(
        &self,
        seen: &mut [MarkerSighting],
        markers: usize,
        &Spread { inverse, prior, px2: [own_px2, skin_px2, unit_px2], reach_mm }: &Spread,
        pose: Rigid,
    ) -> RefinedPose {
        let (mut covariance, mut random, mut chi2) = (Matrix6::zeros(), Matrix6::zeros(), 0.0);
        for (one, (motion, off, weight)) in seen.iter_mut().zip(&self.rows) {
            let pull: Matrix6x2<f64> = inverse.fixed_rows::<6>(0) * motion.transpose() * *weight;
            let square = pull * pull.transpose();
            one.pull = Some(pull);
            random += square * one.random_sd_px.powi(2);
            covariance += square * if one.is_dot { own_px2 } else { one.sd_px.powi(2) };
            chi2 += if one.is_dot { 0.0 } else { off.length_squared() };
        }
        for column in inverse.fixed_view::<6, SKIN>(0, 6).column_iter() {
            covariance += column * column.transpose() * (prior * unit_px2);
        }
        // What goes together over the dome: with the correlations K and the fit's residuals (1 - H) e its variance is theirs over
        // the mean of the diagonal of (1 - H) K (1 - H)^T.
        let dots = || seen.iter().zip(&self.rows).skip(markers);
        let all: SMatrix<f64, ALL, ALL> =
            dots().fold(SMatrix::zeros(), |sum, (_, (motion, ..))| sum + motion.transpose() * motion);
        let (mut skin, mut fitted) = (Matrix6::zeros(), 0.0);
        for (one, (motion, _, weight)) in dots() {
            let own = inverse * motion.transpose() * *weight;
            let together =
                dots().fold(SMatrix::<f64, ALL, 2>::zeros(), |sum, (other, (motion, _, weight))| {
                    let apart = one.marker.position_mm.distance_squared(other.marker.position_mm);
                    sum + motion.transpose() * (*weight * (-0.5 * apart / (reach_mm * reach_mm)).exp())
                });
            let together = inverse * together;
            skin += (own * together.transpose()).fixed_view::<6, 6>(0, 0);
            fitted += (2.0 * (motion * together) - own.transpose() * all * together).trace();
        }
        let left = (1.0 - fitted / (2.0 * self.used.len() as f64)).max(MIN_LEFT);
        covariance += skin * (skin_px2 / left);
        let rms_px = (chi2 / (2.0 * markers as f64)).sqrt();
        RefinedPose { pose, rms_px, covariance, random }
    }
}

/// The list is reordered.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::super::refine::tests::pinhole_sensor;
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};
    use domecast_optics::numeric::SeededRandom;

    /// Dots in rings on the dome, neighbours along each ring.
    fn dots() -> Vec<DotModel> {
        let outline = SpotOutline { radius_px: 3.0, area_px: 28.0, spread_px2: 4.5, elongation: DVec2::ZERO };
        let mut models = DotModel::lattice(16, 5, 18.0, outline);
        for (index, model) in models.iter_mut().enumerate() {
            let (polar, around) = (0.2 + 0.2 * (index / 16) as f64, 0.4 * (index % 16) as f64);
            model.surface_mm =
                DVec3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos()) * 10.0;
        }
        models
    }

    // A dome that is sheared and twisted, a touch on some dots, noise: errors lie within the deviations that are stated.
    #[test]
    fn two_markers_and_a_moved_skin_give_the_pose_within_its_deviations() {
        let rest = pinhole_sensor();
        let models = dots();
        let mut random = SeededRandom::new(5);
        let (mut within, draws) = ([0; 3], 60);
        for _ in 0..draws {
            let mut normal = |size: f64| size * random.normal();
            let pose = Rigid::new(
                rotation_from_vector(DVec3::new(normal(0.02), normal(0.02), normal(0.02))),
                DVec3::new(normal(0.2), normal(0.2), -0.6),
            );
            let moved = rest.at_pose(&pose).unwrap();
            let pull = DVec3::new(normal(0.1), normal(0.1), normal(0.03));
            let mut seen: Vec<_> = [(11.0, 10.0), (-11.0, 10.0)]
                .into_iter()
                .enumerate()
                .map(|(id, (x, y))| {
                    let marker =
                        Marker { id: id as u32, position_mm: DVec3::new(x, y, 0.0), diameter_mm: 1.0 };
                    let noise = DVec2::new(normal(0.02), normal(0.02));
                    MarkerSighting::new(marker, marker.image(&moved).unwrap().centroid_px + noise, [0.02; 2])
                })
                .collect();
            let tracks: Vec<_> = models
                .iter()
                .enumerate()
                .map(|(index, model)| {
                    let at = model.surface_mm;
                    let touch = if index % 16 < 3 && index > 32 { 0.3 } else { 0.0 };
                    let there = at + pull * (0.1 * at.z) - at * (0.1 * touch);
                    let noise = DVec2::new(normal(0.05), normal(0.05));
                    let at_px = moved.project_deformed(there).unwrap() + noise;
                    let spot = DarkSpot { at_px, sd_px: 0.05, ..DarkSpot::default() };
                    DotTrack { spot: Some(spot), state: MarkState::Ok, ..DotTrack::default() }
                })
                .collect();
            let mut help = DotHelp::new(models.len(), 2);
            let mut optics = rest.clone();
            let found = help.refine(&mut optics, &mut seen, (&models, &tracks), &Rigid::identity()).unwrap();
            let off = found.pose.compose(&pose.inverse());
            let turned = domecast_optics::numeric::vector_from_rotation(&off.rotation);
            let off = SVector::<f64, 6>::from_iterator(
                off.translation_mm.to_array().into_iter().chain(turned.to_array()),
            );
            for (off, variance) in off.iter().zip(found.covariance.diagonal().iter()) {
                (0..3).for_each(|k| within[k] += u32::from(off.abs() <= (k + 1) as f64 * variance.sqrt()));
            }
        }
        let [one, two, three] = within.map(|count| f64::from(count) / f64::from(6 * draws));
        assert!(one > 0.55 && two > 0.9 && three > 0.98, "{one} {two} {three}");
        // Too few dots leave it open.
        let mut help = DotHelp::new(models.len(), 2);
        assert!(
            help.refine(&mut rest.clone(), &mut Vec::new(), (&models, &[]), &Rigid::identity()).is_none()
        );
    }
}
