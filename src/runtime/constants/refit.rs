//! The plain runtime's part of the constants, fitted anew to what they say of optics and springs.

use glam::DVec3;

use super::loads::PosedLoad;
use super::model::Constants;
use super::plain::PlainFit;
use super::plain_input::PlainInput;
use super::stiffness::{matrix_of, wrench_by_table};
use domecast_springs::Displacement;

impl Constants {
    /// Fits the apparent positions and the plain runtime anew to what the constants now say of optics and springs,
    /// over presses, shifts, tilts and twists inside the table of compressions; takes them out where no fit exists.
    pub fn refit_plain_runtime(&mut self) {
        let fit = self.plain_fit();
        for (index, marker) in self.white_markers.iter_mut().enumerate() {
            marker.apparent_position_mm =
                fit.as_ref().and_then(|f| f.apparent_mm.get(index)).map(|p| p.to_array());
        }
        if let Some(springs) = self.springs.as_mut() {
            springs.plain_runtime = fit.as_ref().map(PlainFit::constants);
        }
    }

    fn plain_fit(&self) -> Option<PlainFit> {
        let springs = self.springs.as_ref()?;
        let optics = self.sensor().ok()?;
        let markers = self.markers();
        let at_mm = DVec3::from_array(springs.at_mm);
        let deepest = springs.stiffness_at.last().map_or(1.0, |entry| entry.compression_mm);
        let mut loads = Vec::new();
        for step in 0..5 {
            let down = 0.6 * deepest * f64::from(step) / 4.0;
            for turn in 0..8 {
                let angle = f64::from(turn) * std::f64::consts::FRAC_PI_4;
                let (cos, sin) = (angle.cos(), angle.sin());
                for (shift, tilt, twist) in [
                    (0.0, 0.0, 0.0),
                    (0.1, 0.0, 0.01),
                    (0.1, 0.0, -0.01),
                    (0.0, 0.03, 0.01),
                    (0.0, 0.03, -0.01),
                    (0.1, 0.03, 0.02),
                    (0.1, 0.03, -0.02),
                ] {
                    let displacement = Displacement {
                        translation_mm: DVec3::new(shift * cos, shift * sin, -down),
                        rotation_rad: DVec3::new(-tilt * sin, tilt * cos, twist),
                    };
                    let pose = displacement.to_pose(at_mm);
                    let placed = optics.at_pose(&pose);
                    if placed.is_ok_and(|o| markers.iter().all(|m| m.image(&o).is_ok())) {
                        loads.push(PosedLoad { pose, wrench: wrench_by_table(springs, &displacement) });
                    }
                }
            }
        }
        let input = PlainInput {
            optics: &optics,
            markers: &markers,
            undistorted_matrix: self.camera.undistorted_matrix,
            at_mm,
            stiffness: matrix_of(&springs.stiffness),
            stiffness_at: &springs.stiffness_at,
        };
        PlainFit::over(&input, &loads).ok()
    }
}
