//! What the reference frames showed, to be taken off.

use glam::DVec3;

use super::result::{DotReference, Tracked};
use crate::track::wrench::WrenchErrors;
use domecast_springs::Wrench;

/// Means over the reference frames.
#[derive(Debug, Clone)]
pub(super) struct ReferenceMean {
    /// Frames that make the reference; 0: the constants' rest.
    wanted: u32,
    frames: u32,
    wrench: Wrench,
    /// Sums of what the frames' wrenches may be off by; frames without are left out.
    errors: WrenchErrors,
    displacement: Vec<(DVec3, u32)>,
}

impl ReferenceMean {
    /// Over the first `wanted` good frames with so many dots.
    pub fn new(wanted: u32, dots: usize) -> Self {
        let displacement = vec![(DVec3::ZERO, 0); dots];
        Self { wanted, frames: 0, wrench: Wrench::default(), errors: WrenchErrors::default(), displacement }
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.frames = 0;
        self.wrench = Wrench::default();
        self.errors = WrenchErrors::default();
        self.displacement.fill((DVec3::ZERO, 0));
    }

    /// Takes in a frame while the reference is not full, and takes the mean off it; `good`: nothing is wrong with it. Whether it
    /// is one of the reference.
    pub fn apply(&mut self, result: &mut Tracked, errors: Option<&WrenchErrors>, good: bool) -> bool {
        let is_taken = self.frames < self.wanted;
        if is_taken {
            if !good {
                return false;
            }
            self.frames += 1;
            if let Some(wrench) = result.wrench {
                self.wrench = self.wrench + wrench;
            }
            if let Some(errors) = errors {
                self.errors.add(errors);
            }
            for (dot, (to, count)) in result.black_dots.iter().zip(&mut self.displacement) {
                if let Some(displacement) = dot.displacement_mm {
                    *to += displacement;
                    *count += 1;
                }
            }
        }
        if self.frames == 0 {
            return false;
        }
        if let Some(wrench) = &mut result.wrench {
            let frames = f64::from(self.frames);
            let mean =
                Wrench { force_n: self.wrench.force_n / frames, moment_nmm: self.wrench.moment_nmm / frames };
            *wrench = *wrench - mean;
            // What is off for good and in both is taken off too.
            result.wrench_sd = errors.and_then(|errors| errors.sd_less_mean(&self.errors, frames));
        }
        for (dot, (sum, count)) in result.black_dots.iter_mut().zip(&self.displacement) {
            if *count == 0 {
                continue;
            }
            let displacement_mm = *sum / f64::from(*count);
            dot.reference = Some(DotReference { displacement_mm, frames: *count });
            if let Some(displacement) = &mut dot.displacement_mm {
                *displacement -= displacement_mm;
            }
        }
        is_taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::report::DotResult;

    fn frame(force: f64, moved: f64) -> Tracked {
        let dot = DotResult { displacement_mm: Some(DVec3::X * moved), ..DotResult::default() };
        Tracked {
            wrench: Some(Wrench { force_n: DVec3::Z * force, ..Wrench::default() }),
            black_dots: vec![dot],
            ..Tracked::default()
        }
    }

    #[test]
    fn the_mean_of_good_frames_is_taken_off() {
        let mut reference = ReferenceMean::new(2, 1);
        let mut bad = frame(9.0, 9.0);
        reference.apply(&mut bad, None, false);
        assert_eq!(bad, frame(9.0, 9.0));
        reference.apply(&mut frame(1.0, 0.1), None, true);
        reference.apply(&mut frame(3.0, 0.3), None, true);
        let mut later = frame(5.0, 0.5);
        reference.apply(&mut later, None, false);
        assert_eq!(later.wrench.unwrap().force_n, DVec3::Z * 3.0);
        assert!((later.black_dots[0].displacement_mm.unwrap().x - 0.3).abs() < 1e-12);
        reference.restart();
        let mut again = frame(5.0, 0.5);
        reference.apply(&mut again, None, false);
        assert_eq!(again, frame(5.0, 0.5));
    }
}
