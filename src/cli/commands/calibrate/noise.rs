//! How exact the markers' centroids in these frames are, learned from the frames.
//!
//! What a centroid is off by has two parts: noise, which is another one in each frame and falls with their number, and what stays in a
//! still picture (where the pixels' borders cut a marker's edge, light, what the fitted optics leave over). Scatter among the frames of
//! a step shows the first alone. Both are in what the pose of a step's mean centroids leaves over: 2 n numbers less six for n markers,
//! of which each step has others. Few of them can be small by luck, so the constants' tolerance counts as one marker more: the mean of
//! a variance that has a scaled inverse chi-square prior (Gelman et al., Bayesian Data Analysis, 3rd ed., section 2.6), and never less
//! than the scatter says.

use glam::DVec2;

use domecast_optics::pose::Marker;
use domecast_runtime::calibrate::optics::{Kind, Observation};
use domecast_runtime::constants::Constants;

/// As how many numbers the tolerance counts.
const PRIOR_COUNT: f64 = 2.0;
/// Numbers that a pose takes.
const POSE_NUMBERS: f64 = 6.0;

/// Standard deviation of a centroid where the constants do not say it, px.
const CENTROID_SD_PX: f64 = 0.1;

/// How far a centroid may be off by the constants, px.
pub fn tolerance_px(constants: &Constants) -> f64 {
    constants.tolerances.map_or(CENTROID_SD_PX, |t| t.white_centroid_px)
}

/// The centroids of a white marker, where there are any, and their mean, px.
pub fn centroids_of(marks: &[Observation], marker: usize) -> Option<(Vec<DVec2>, DVec2)> {
    let own = marks.iter().filter(|mark| mark.kind == Kind::White && mark.id == marker);
    let all: Vec<DVec2> = own.map(|mark| mark.centroid_px).collect();
    let mean = all.iter().sum::<DVec2>() / all.len() as f64;
    (!all.is_empty()).then_some((all, mean))
}

/// A sum of squares, px^2, and how many independent numbers are in it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Squares {
    sum_px2: f64,
    count: f64,
}

impl Squares {
    fn add(&mut self, sum_px2: f64, count: f64) {
        if sum_px2.is_finite() && count > 0.0 {
            self.sum_px2 += sum_px2;
            self.count += count;
        }
    }
}

/// What the frames of all steps say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CentroidNoise {
    scatter: Squares,
    residuals: Squares,
    /// Largest part of a frame's variance that is left in a step's mean, with that of the rest it is compared with.
    mean_part: f64,
}

impl CentroidNoise {
    /// Takes in how a step's centroids scatter from frame to frame; `rest_frames`: of the rest that all is compared with.
    pub fn add_scatter(&mut self, marks: &[Observation], markers: &[Marker], rest_frames: usize) {
        for marker in markers {
            let Some((own, mean)) = centroids_of(marks, marker.id as usize) else { continue };
            let sum = own.iter().map(|at| at.distance_squared(mean)).sum();
            self.scatter.add(sum, 2.0 * (own.len() as f64 - 1.0));
            let part = 1.0 / own.len() as f64 + 1.0 / rest_frames.max(1) as f64;
            self.mean_part = self.mean_part.max(part);
        }
    }

    /// Takes in what a step's pose leaves over: the residuals' rms over both axes of all its markers. Not that of the first rest: the
    /// markers' places are fitted to it.
    pub fn add_residuals(&mut self, rms_px: f64, markers: usize) {
        let numbers = 2.0 * markers as f64;
        self.residuals.add(rms_px * rms_px * numbers, numbers - POSE_NUMBERS);
    }

    /// Standard deviation of the mean of a step's centroids on each axis of the image, px.
    pub fn sd_px(&self, tolerance_px: f64) -> f64 {
        let sum = PRIOR_COUNT * tolerance_px * tolerance_px + self.residuals.sum_px2;
        let whole = sum / (PRIOR_COUNT + self.residuals.count);
        let of_scatter = self.mean_part * self.scatter.sum_px2 / self.scatter.count.max(1.0);
        whole.max(of_scatter).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn markers() -> [Marker; 2] {
        [0, 1].map(|id| Marker { id, position_mm: DVec3::ZERO, diameter_mm: 2.0 })
    }

    fn marks(scatter_px: f64) -> Vec<Observation> {
        let one = |k: usize| {
            let off = scatter_px * if k % 4 < 2 { 1.0 } else { -1.0 };
            Observation {
                frame: k / 2,
                kind: Kind::White,
                id: k % 2,
                centroid_px: DVec2::new(100.0 + off, 50.0),
            }
        };
        (0..8).map(one).collect()
    }

    #[test]
    fn the_tolerance_stands_until_frames_say_better_and_scatter_bounds_it() {
        let mut noise = CentroidNoise::default();
        assert_eq!(noise.sd_px(0.1), 0.1);
        noise.add_scatter(&marks(0.01), &markers(), 4);
        assert_eq!(noise.sd_px(0.1), 0.1);
        for _ in 0..100 {
            noise.add_residuals(0.02, 4);
        }
        // of eight numbers the pose has taken six: those that are left are twice as large
        assert!((noise.sd_px(0.1) - 0.04).abs() < 0.002, "{}", noise.sd_px(0.1));
        // four frames, one axis that moves by 0.1 px: 4 * 0.01 over 2 * 3 numbers, halved by the mean and doubled by the rest's
        let mut wild = CentroidNoise::default();
        wild.add_residuals(1e-6, 400);
        wild.add_scatter(&marks(0.1), &markers(), 4);
        assert!((wild.sd_px(0.1) - (0.5_f64 * 0.04 / 6.0).sqrt()).abs() < 1e-12);
        wild.add_residuals(f64::NAN, 4);
        assert!(wild.sd_px(0.1).is_finite());
    }
}
