//! The dots of a reading, as the forces take them.

use std::f64::consts::SQRT_2;

use glam::DVec3;

use super::forces::ForceDistribution;
use super::model::Dot;
use super::posterior::USUAL_DOT_SD_PX;
use super::wrench_rows::SpringLoad;
use crate::track::{DotResult, Tracked};
use domecast_optics::numeric::Rigid;
use domecast_springs::Wrench;

/// What the elastic model may be off, as a part of each dot's motion: coarse elements and small strain.
pub(super) const MODEL_PART: f64 = 0.05;
/// Least standard deviation of a dot on each axis, px: what `track` is off by on clean frames, which its noise does not say.
const MIN_DOT_SD_PX: f64 = 0.01;
/// Dots whose motions' sum of squares is no more than so many deviations over that of noise have not moved.
const MIN_MOTION_OVER_SD: f64 = 4.0;
/// Dots at least that must be seen.
const MIN_DOTS: usize = 8;
/// From so many px on, an undeformed dot is not that of these constants: the two lie within some hundredths.
const FOREIGN_PX: f64 = 2.0;

impl ForceDistribution {
    /// Whether the undeformed dots of a reading are where these constants have them; every eighth is asked.
    pub(super) fn is_ours(&self, tracked: &Tracked) -> bool {
        let is_off = |(dot, found): (&Dot, &DotResult)| {
            let here = self.optics.project_deformed(dot.surface_mm).ok();
            here.zip(found.undeformed_px).is_some_and(|(here, there)| here.distance(there) > FOREIGN_PX)
        };
        let pairs = self.dots.iter().zip(&tracked.black_dots);
        self.dots.len() == tracked.black_dots.len() && !pairs.step_by(8).any(is_off)
    }

    /// Takes a frame of the untouched sensor: its dots lie where that shows them, whatever print and camera are off the
    /// constants. Without one, and without the tracker's own reference, places count as sure as the constants' tolerances have them.
    /// `false`, and nothing is taken, where it shows no pose or is another sensor's.
    pub fn set_rest(&mut self, tracked: &Tracked) -> bool {
        let is_posed = self.pose_of(tracked).is_some_and(|pose| self.optics.move_to(&pose).is_ok());
        if !(is_posed && self.is_ours(tracked)) {
            return false;
        }
        for (dot, found) in self.dots.iter_mut().zip(&tracked.black_dots) {
            let before_mm = found.reference.map_or(DVec3::ZERO, |reference| reference.displacement_mm);
            if let Some(displacement_mm) = found.displacement_mm {
                dot.rest_mm = dot.surface_mm + before_mm + displacement_mm;
                dot.rest_frames = 1;
            }
        }
        self.rest_wrench = tracked.wrench;
        true
    }

    /// The platform's pose; on a rigid mount it never moves.
    pub(super) fn pose_of(&self, tracked: &Tracked) -> Option<Rigid> {
        if self.reference_mm.is_some() { tracked.pose } else { Some(Rigid::identity()) }
    }

    /// Takes the dots of a frame; whether there are enough.
    pub(super) fn see(&mut self, tracked: &Tracked) -> bool {
        let (mut count, mut over) = (0, 0.0);
        for (dot, found) in self.dots.iter_mut().zip(&tracked.black_dots) {
            dot.per_sd = 0.0;
            if let Some(reference) = found.reference {
                dot.rest_mm = dot.surface_mm + reference.displacement_mm;
                dot.rest_frames = reference.frames;
            }
            dot.rest_px = self.optics.project_deformed(dot.rest_mm).ok();
            let seen = found.image_px.filter(|_| found.undeformed_px.is_some());
            let Some((now, rest)) = seen.zip(dot.rest_px) else { continue };
            dot.seen_px = now - rest;
            let noise_px = found.sd_px.unwrap_or(USUAL_DOT_SD_PX).max(MIN_DOT_SD_PX);
            let rest_sd_px = match dot.rest_frames {
                0 => dot.place_sd_px,
                frames => noise_px / f64::from(frames).sqrt(),
            };
            let variance_px2 = noise_px * noise_px + rest_sd_px * rest_sd_px;
            let off_px = MODEL_PART * dot.seen_px.length();
            dot.per_sd = 1.0 / (variance_px2 + off_px * off_px).sqrt();
            over += dot.seen_px.length_squared() / variance_px2;
            count += 1;
        }
        // Of 2 n squares of noise the sum is 2 n, and the deviation of that the root of 4 n.
        let squares = 2.0 * count as f64;
        self.is_moved = over > squares + MIN_MOTION_OVER_SD * (2.0 * squares).sqrt();
        count >= MIN_DOTS.min(self.dots.len())
    }

    /// What the springs say of a frame, where there are such: less what they say at rest, if that is known, and then what stays for good
    /// is no part of its deviation.
    pub(super) fn load(&self, tracked: &Tracked) -> Option<SpringLoad> {
        let (_, wrench) = self.reference_mm.zip(tracked.wrench)?;
        let random = tracked.wrench_sd_random.unwrap_or_default();
        if tracked.black_dots.iter().any(|dot| dot.reference.is_some()) {
            return Some(SpringLoad { wrench, sd: random });
        }
        let Some(at_rest) = self.rest_wrench else {
            return Some(SpringLoad { wrench, sd: tracked.wrench_sd.unwrap_or(random) });
        };
        let sd = Wrench::from_array(random.to_array().map(|sd| SQRT_2 * sd));
        Some(SpringLoad { wrench: wrench - at_rest, sd })
    }
}
