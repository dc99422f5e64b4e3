//! What is tracked of a frame, less what is tracked of the sensor at rest: in sets with tracked readings, and for the models that are
//! trained on them.

use glam::{DVec2, DVec3};

use crate::columns::SeenDot;
use domecast_runtime::track::Tracked;
use domecast_springs::{Displacement, Wrench};

/// What is tracked of a frame of the untouched sensor, which is taken off all others.
#[derive(Debug, Clone)]
pub struct TrackedRest {
    at_mm: DVec3,
    rigid: [[f64; 6]; 2],
    wrench_sd: Option<Wrench>,
    /// How far each dot is seen from where it would be on the undeformed dome.
    dots_px: Vec<Option<DVec2>>,
}

impl TrackedRest {
    /// Of the frame at rest; wrench and platform are about this point, mm.
    pub fn new(tracked: &Tracked, at_mm: DVec3) -> Self {
        let dots_px = moved_px(tracked).map(|dot| dot.map(|(_, moved_px)| moved_px)).collect();
        Self { at_mm, rigid: rigid(tracked, at_mm), wrench_sd: tracked.wrench_sd, dots_px }
    }

    /// Whether wrench and platform are known at rest.
    pub fn is_known(&self) -> bool {
        self.rigid.iter().flatten().all(|value| value.is_finite())
    }

    /// What wrench and platform are about, mm.
    pub fn at_mm(&self) -> DVec3 {
        self.at_mm
    }

    /// Deviations of the wrench that the load has brought, N: what stays from frame to frame is in the rest as well.
    pub fn load_sd_n(&self, tracked: &Tracked) -> DVec3 {
        let Some((now, rest)) = tracked.wrench_sd.zip(self.wrench_sd) else { return DVec3::ZERO };
        let square = now.force_n * now.force_n - rest.force_n * rest.force_n;
        square.max(DVec3::ZERO).map(f64::sqrt)
    }

    /// Wrench (N, N mm) and displacement of the platform (mm, rad) of a frame, less those at rest; NaN where the tracker withholds
    /// them.
    pub fn rigid(&self, tracked: &Tracked) -> [[f64; 6]; 2] {
        let now = rigid(tracked, self.at_mm);
        std::array::from_fn(|part| std::array::from_fn(|k| now[part][k] - self.rigid[part][k]))
    }

    /// The dots of a frame, and what has moved them since the rest; `None` where one is not seen now or was not at rest.
    pub fn dots<'a>(&'a self, tracked: &'a Tracked) -> impl Iterator<Item = Option<SeenDot>> + 'a {
        moved_px(tracked).zip(&self.dots_px).map(|(dot, rest_px)| {
            let ((at_px, moved_px), rest_px) = dot.zip(*rest_px)?;
            Some(SeenDot { at_px, moved_px: moved_px - rest_px })
        })
    }
}

fn rigid(tracked: &Tracked, at_mm: DVec3) -> [[f64; 6]; 2] {
    [
        tracked.wrench.map_or([f64::NAN; 6], |wrench| wrench.to_array()),
        tracked.pose.map_or([f64::NAN; 6], |pose| Displacement::of_pose(&pose, at_mm).to_array()),
    ]
}

/// Where each dot would be on the undeformed dome, and how far from there it is seen.
fn moved_px(tracked: &Tracked) -> impl Iterator<Item = Option<(DVec2, DVec2)>> {
    tracked.black_dots.iter().map(|dot| {
        let at_px = dot.undeformed_px?;
        Some((at_px, dot.image_px? - at_px))
    })
}
