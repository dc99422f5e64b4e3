//! Where the dots are on the dome, less where they are at rest.
//!
//! One camera sees along rays: a dot that is pressed in along its ray stays where it is in the image. What is said of a dot
//! is therefore its place on the undeformed dome, the ray on which it lies wherever it is, and how exact it is across that.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix3x2, Matrix3x6, Matrix6};

use crate::track::identities::DotTrack;
use crate::track::model::DotModel;
use domecast_optics::SensorOptics;

/// Rays that come up beside the dome's foot by less than this meet its rim, mm.
const RIM_MM: f64 = 1e-9;

/// A dot's displacement in the platform's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::track) struct DotDisplacement {
    /// Its ray met with the undeformed dome, less its rest position, mm.
    pub displacement_mm: DVec3,
    /// Unit direction of that ray, away from the camera: along it the displacement is not known.
    pub ray: DVec3,
    /// Standard deviation across the ray that the frame's noise means, on each of two axes, mm.
    pub sd_random_mm: f64,
}

/// What errors of centroid and pose do to a dot's place across its ray: at rest, a dot under load is much like it.
#[derive(Debug, Clone, Copy)]
struct Spread {
    /// Mean variance on the two axes across the ray, mm^2, for a centroid's of 1 px^2.
    by_px2: f64,
    /// The place's motion with the platform's (mm and rad about the rest frame's origin).
    by_motion: Matrix3x6<f64>,
}

impl Spread {
    fn new(rest: &SensorOptics, at_mm: DVec3) -> Option<Self> {
        let seen = rest.project_with_motion(at_mm).ok()?;
        // A pixel moves the point by the pseudoinverse of its Jacobian, which is across the ray.
        let inverse = (seen.by_point * seen.by_point.transpose()).try_inverse()?;
        let by_pixel: Matrix3x2<f64> = seen.by_point.transpose() * inverse;
        Some(Self { by_px2: 0.5 * inverse.trace(), by_motion: by_pixel * seen.by_pose })
    }

    fn variance(&self, sd_px: f64, motion: &Matrix6<f64>) -> f64 {
        let moved = self.by_motion * motion;
        self.by_px2 * sd_px * sd_px + 0.5 * moved.component_mul(&self.by_motion).sum()
    }
}

/// Displacement of each dot; keeps its buffers.
#[derive(Debug, Clone)]
pub(in crate::track) struct DotDisplacements {
    /// Of each dot; `None` where the camera does not see it at rest.
    spreads: Vec<Option<Spread>>,
    displacements: Vec<Option<DotDisplacement>>,
}

impl DotDisplacements {
    /// For the dots of a sensor at rest.
    pub fn new(rest: &SensorOptics, models: &[DotModel]) -> Self {
        let spreads = models.iter().map(|model| Spread::new(rest, model.surface_mm)).collect();
        Self { spreads, displacements: vec![None; models.len()] }
    }

    /// Of each dot that is found; `optics`: at the platform's pose, whose motion (mm, rad about the rest frame's origin)
    /// has the covariance `motion`.
    pub fn at_pose(
        &mut self,
        optics: &SensorOptics,
        motion: &Matrix6<f64>,
        models: &[DotModel],
        tracks: &[DotTrack],
    ) -> &[Option<DotDisplacement>] {
        let dots = tracks.iter().zip(models).zip(&self.spreads);
        for (((track, model), spread), to) in dots.zip(&mut self.displacements) {
            *to = track.spot.zip(track.center_px()).and_then(|(spot, center)| {
                let (hit, ray) = traced(optics, center)?;
                let variance = spread.as_ref()?.variance(spot.sd_px, motion);
                let sd_random_mm = variance.max(0.0).sqrt();
                let displacement_mm = hit - model.surface_mm;
                sd_random_mm.is_finite().then_some(DotDisplacement { displacement_mm, ray, sd_random_mm })
            });
        }
        &self.displacements
    }
}

/// Where a pixel's ray meets the undeformed dome, and its direction there.
fn traced(optics: &SensorOptics, pixel: DVec2) -> Option<(DVec3, DVec3)> {
    let (hit, ray) = optics.trace_continued(pixel).ok()?;
    // Beside the foot there is no dome.
    (hit.z >= -RIM_MM && hit.is_finite() && ray.is_finite()).then_some((hit, ray))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::{DarkSpot, SpotOutline};
    use crate::track::pose::pinhole_sensor;
    use domecast_optics::numeric::{Rigid, SeededRandom};
    use nalgebra::Vector6;

    fn dot(polar_deg: f64) -> DotModel {
        let outline = SpotOutline { radius_px: 3.0, area_px: 28.0, spread_px2: 4.5, elongation: DVec2::ZERO };
        let mut model = DotModel::lattice(1, 1, 18.0, outline).remove(0);
        let (sin, cos) = polar_deg.to_radians().sin_cos();
        model.surface_mm = DVec3::new(0.6 * sin, 0.8 * sin, cos) * 10.0;
        model
    }

    fn seen(at_px: DVec2, sd_px: f64) -> DotTrack {
        let spot = DarkSpot {
            at_px,
            contrast: 0.8,
            area_px: 28.0,
            spread_px2: 4.5,
            sd_px,
            ground: 150.0,
            ..DarkSpot::default()
        };
        DotTrack { spot: Some(spot), ..DotTrack::default() }
    }

    // A skin pressed in by 1.5 mm: what is off is off along the ray and nowhere else.
    #[test]
    fn what_is_not_known_lies_along_the_ray() {
        let optics = pinhole_sensor();
        for polar_deg in [0.0, 15.0, 40.0, 60.0] {
            let model = [dot(polar_deg)];
            let moved = DVec3::new(0.2, -0.1, 0.05) - 1.5 * model[0].surface_mm / 10.0;
            let pixel = optics.project_deformed(model[0].surface_mm + moved).unwrap();
            let mut displacements = DotDisplacements::new(&optics, &model);
            let tracks = [seen(pixel, 0.02)];
            let found = displacements.at_pose(&optics, &Matrix6::zeros(), &model, &tracks)[0].unwrap();
            let left = moved - found.displacement_mm;
            assert!(left.length() > 1.0, "{polar_deg}: {left}");
            assert!(left.cross(found.ray).length() < 1e-6, "{polar_deg}: {left} {}", found.ray);
        }
    }

    #[test]
    fn across_the_ray_the_deviation_holds() {
        let optics = pinhole_sensor();
        let mut random = SeededRandom::new(7);
        for (sd_px, motion_sd) in [(0.05, [0.0; 6]), (0.02, [2e-3, 1e-3, 2e-3, 2e-4, 3e-4, 1e-4])] {
            let model = [dot(35.0)];
            let motion = Matrix6::from_diagonal(&Vector6::from(motion_sd.map(|sd| sd * sd)));
            let mut displacements = DotDisplacements::new(&optics, &model);
            let (mut counts, draws) = ([0; 3], 4000);
            for _ in 0..draws {
                let mut step = || random.normal();
                let m = motion_sd.map(|sd| sd * step());
                let noise = DVec2::new(step(), step()) * sd_px;
                let (v, w) = (DVec3::new(m[0], m[1], m[2]), DVec3::new(m[3], m[4], m[5]));
                // The platform is elsewhere than it is taken to be.
                let truly = optics
                    .at_pose(&Rigid::new(domecast_optics::numeric::rotation_from_vector(w), v))
                    .unwrap();
                let tracks = [seen(truly.project(model[0].surface_mm).unwrap() + noise, sd_px)];
                let found = displacements.at_pose(&optics, &motion, &model, &tracks)[0].unwrap();
                let side = found.ray.any_orthonormal_vector();
                for axis in [side, found.ray.cross(side)] {
                    let z = (found.displacement_mm.dot(axis) / found.sd_random_mm).abs();
                    for (k, count) in counts.iter_mut().enumerate() {
                        *count += u32::from(z <= (k + 1) as f64);
                    }
                }
            }
            let [one, two, three] = counts.map(|count| 50.0 * f64::from(count) / f64::from(draws));
            assert!((60.0..=75.0).contains(&one), "{one} {two} {three}");
            assert!((93.0..=98.0).contains(&two) && three >= 99.0, "{one} {two} {three}");
        }
    }
}
