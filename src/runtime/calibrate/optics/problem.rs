//! The numbers that are fitted, and what each mark should look like for given ones.

use glam::{DVec2, DVec3};

use super::intrinsics::Intrinsics;
use super::types::{Kind, Observation, OpticsFitError};
use crate::constants::{CalibrationPriors, Constants, body_numbers, shift_body};
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver, outline_centroid_offset};
use domecast_optics::{DomeShape, OpticsSpec, SensorOptics};

/// What is fitted, apart from the poses. Numbers: pupil (3), camera rotation (3), thickness of each flat layer, index
/// of each layer, the camera's own numbers where their covariance is known, x and y of each white marker, two steps along
/// the dome of each dot; as departures from nominal.
pub(super) struct Problem<'a> {
    pub nominal: OpticsSpec,
    pub white_markers: Vec<Marker>,
    pub black_dots: Vec<Black>,
    pub priors: Vec<f64>,
    pub frames: Vec<usize>,
    pub seen: Vec<Vec<Seen<'a>>>,
    pub flat: usize,
    pub intrinsics: Intrinsics,
    /// How many of the frames, from the first, are at rest.
    pub at_rest: usize,
}

pub(super) struct Seen<'a> {
    pub observation: &'a Observation,
    /// Place of the mark in its list.
    pub index: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Black {
    pub at_mm: DVec3,
    pub radius_mm: f64,
    pub east: DVec3,
    pub north: DVec3,
}

impl Black {
    fn moved(&self, step: DVec2, dome: &DomeShape) -> DVec3 {
        dome.onto(self.at_mm + self.east * step.x + self.north * step.y)
    }
}

impl<'a> Problem<'a> {
    pub fn new(
        constants: &Constants,
        observations: &'a [Observation],
        priors: &CalibrationPriors,
        at_rest: usize,
    ) -> Result<Self, OpticsFitError> {
        let nominal = constants.optics_spec().map_err(OpticsFitError::Constants)?;
        let flat = nominal.layers.len().saturating_sub(1);
        let intrinsics = Intrinsics::new(&constants.camera).map_err(OpticsFitError::Constants)?;
        let white_markers = constants.markers();
        let black = |dot: &crate::constants::BlackDot| {
            let at_mm = DVec3::from_array(dot.surface_mm);
            let east = DVec3::new(-at_mm.y, at_mm.x, 0.0).try_normalize().unwrap_or(DVec3::X);
            let north = nominal.dome.outward_mm(at_mm).cross(east).normalize_or_zero();
            Black { at_mm, radius_mm: 0.5 * dot.diameter_mm, east, north }
        };
        let black_dots: Vec<Black> = constants.black_dots.iter().map(black).collect();
        let mut sds = Vec::new();
        sds.extend(priors.pupil_mm);
        sds.extend(priors.camera_rotation_rad);
        sds.extend(vec![priors.layer_thickness_mm; flat]);
        sds.extend(vec![priors.index; flat + 1]);
        sds.extend(vec![1.0; intrinsics.count()]);
        sds.extend(vec![priors.white_marker_mm; 2 * white_markers.len()]);
        sds.extend(vec![priors.black_dot_mm; 2 * black_dots.len()]);
        // A tolerance of zero holds a number to where it is.
        let priors = sds.into_iter().map(|sd: f64| sd.max(1e-9)).collect();
        let mut frames: Vec<usize> = observations.iter().map(|o| o.frame).collect();
        frames.sort_unstable();
        frames.dedup();
        if frames.is_empty() {
            return Err(OpticsFitError::Empty);
        }
        let mut seen: Vec<Vec<Seen>> = frames.iter().map(|_| Vec::new()).collect();
        for observation in observations {
            let index = match observation.kind {
                Kind::White => constants.white_markers.iter().position(|m| m.id == observation.id),
                Kind::Black => constants.black_dots.iter().position(|d| d.id == observation.id),
            };
            let Some(index) = index else {
                return Err(OpticsFitError::UnknownMark { kind: observation.kind, id: observation.id });
            };
            if let Ok(frame) = frames.binary_search(&observation.frame) {
                seen[frame].push(Seen { observation, index });
            }
        }
        let at_rest = at_rest.max(1);
        Ok(Self { nominal, white_markers, black_dots, priors, frames, seen, flat, intrinsics, at_rest })
    }

    /// Pupil, camera rotation and layers take the first numbers.
    pub fn body_numbers(&self) -> usize {
        body_numbers(&self.nominal)
    }

    /// Then the camera's own.
    pub fn camera_numbers(&self) -> usize {
        self.body_numbers() + self.intrinsics.count()
    }

    pub fn numbers(&self) -> usize {
        self.priors.len()
    }

    pub fn spec(&self, x: &[f64]) -> OpticsSpec {
        let mut spec = self.nominal.clone();
        shift_body(&mut spec, x);
        self.intrinsics.apply(&x[self.body_numbers()..self.camera_numbers()], &mut spec.lens);
        spec
    }

    pub fn white(&self, x: &[f64], index: usize) -> Marker {
        let at = self.camera_numbers() + 2 * index;
        let mut marker = self.white_markers[index];
        marker.position_mm += DVec3::new(x[at], x[at + 1], 0.0);
        marker
    }

    pub fn black_number(&self, index: usize) -> usize {
        self.camera_numbers() + 2 * self.white_markers.len() + 2 * index
    }

    pub fn black(&self, x: &[f64], index: usize) -> DVec3 {
        let at = self.black_number(index);
        self.black_dots[index].moved(DVec2::new(x[at], x[at + 1]), &self.nominal.dome)
    }

    pub fn place(&self, x: &[f64], seen: &Seen) -> DVec3 {
        match seen.observation.kind {
            Kind::White => self.white(x, seen.index).position_mm,
            Kind::Black => self.black(x, seen.index),
        }
    }

    /// Centroid of a mark less its centre's image.
    pub fn offset(&self, x: &[f64], seen: &Seen, optics: &SensorOptics, center: DVec2) -> Option<DVec2> {
        match seen.observation.kind {
            Kind::White => self.white(x, seen.index).centroid_offset_px(optics, center).ok(),
            Kind::Black => {
                let dot = &self.black_dots[seen.index];
                let at = self.black(x, seen.index);
                let dome = self.nominal.dome;
                outline_centroid_offset(center, |cos, sin| {
                    let there = at + (dot.east * cos + dot.north * sin) * dot.radius_mm;
                    optics.project(dome.onto(there)).ok()
                })
            }
        }
    }

    /// Distance of the camera from the sheet, mm, at least one.
    fn away_mm(&self) -> f64 {
        self.nominal.sensor_from_camera.translation_mm.z.abs().max(1.0)
    }

    /// What tolerances move a mark's image by, roughly: its place and the pupil's over its distance, and the camera's
    /// rotation, in focal lengths, px.
    pub fn slack_px(&self, priors: &CalibrationPriors) -> f64 {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(*v));
        let place_mm = priors.white_marker_mm.max(priors.black_dot_mm) + largest(&priors.pupil_mm);
        let focal = self.nominal.lens.matrix[0][0].abs();
        let intrinsics_px: f64 = self.intrinsics.focal_and_center_sd_px();
        focal * (place_mm / self.away_mm() + largest(&priors.camera_rotation_rad)) + intrinsics_px + 0.5
    }

    /// A solver of poses that bears what tolerances do to the markers' images.
    pub fn pose_solver(
        &self,
        optics: &SensorOptics,
        priors: &CalibrationPriors,
    ) -> Result<PoseSolver, OpticsFitError> {
        let away = self.away_mm();
        let focal = self.nominal.lens.matrix[0][0].abs();
        let slack =
            focal * (priors.white_marker_mm + priors.pupil_mm.iter().fold(0.0_f64, |m, v| m.max(*v))) / away;
        let noise_px = priors.white_centroid_px.hypot(3.0 * slack);
        PoseSolver::new(optics, &self.white_markers, PoseOptions::new(noise_px, 10.0 * away))
            .map_err(|error| OpticsFitError::Constants(format!("white markers: {error}")))
    }

    pub fn noise(&self, priors: &CalibrationPriors, kind: Kind) -> f64 {
        match kind {
            Kind::White => priors.white_centroid_px,
            Kind::Black => priors.black_centroid_px,
        }
    }

    pub fn name(&self, number: usize, constants: &Constants) -> (String, f64) {
        let flat = self.flat;
        let pupil = self.nominal.sensor_from_camera.translation_mm;
        let axis = ["x", "y", "z"];
        match number {
            0..3 => (format!("pupil.{}", axis[number]), pupil[number]),
            3..6 => (format!("camera_rotation.{}", axis[number - 3]), 0.0),
            n if n < 6 + flat => {
                let layer = &self.nominal.layers[n - 6];
                (format!("{}.thickness", layer.name), layer.thickness_mm.unwrap_or(0.0))
            }
            n if n < self.body_numbers() => {
                let layer = &self.nominal.layers[n - 6 - flat];
                (format!("{}.index", layer.name), layer.index[1])
            }
            n if n < self.camera_numbers() => {
                self.intrinsics.name(n - self.body_numbers(), &self.nominal.lens)
            }
            n => {
                let k = n - self.camera_numbers();
                let id = constants.white_markers.get(k / 2).map_or(0, |m| m.id);
                let nominal = self.white_markers.get(k / 2).map_or(0.0, |m| m.position_mm[k % 2]);
                (format!("white_markers[{id}].{}", axis[k % 2]), nominal)
            }
        }
    }
}
