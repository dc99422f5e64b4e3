//! What a touch with a given force would show: where on the dome it is, and by how much the dots would seem to move.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;

use crate::constants::Constants;
use crate::track::model::DotModel;
use domecast_optics::{DomeShape, SensorOptics};
use domecast_springs::Wrench;

/// Of the dome that may be touched.
#[derive(Debug, Clone)]
pub(super) struct TouchModel {
    dome: DomeShape,
    /// Young's modulus over one less the square of Poisson's ratio, N/mm2.
    modulus_mpa: f64,
    /// Where wrenches are stated about.
    at_mm: DVec3,
    optics: SensorOptics,
}

impl TouchModel {
    /// Of the constants' sensor; `None` of constants without an elastomer or springs.
    pub fn new(constants: &Constants, optics: &SensorOptics) -> Option<Self> {
        let elastomer = constants.elastomer.as_ref().filter(|elastomer| elastomer.check().is_ok())?;
        Some(Self {
            dome: constants.optics.dome(),
            modulus_mpa: elastomer.young_modulus_mpa / (1.0 - elastomer.poisson_ratio.powi(2)),
            at_mm: DVec3::from_array(constants.springs.as_ref()?.at_mm),
            optics: optics.clone(),
        })
    }

    /// Where one touch would press to give a wrench; `None` of a wrench that no touch gives: its line of action does not
    /// meet the dome, or it pulls. Both give or take what a deviation of the force is of it.
    pub fn place_mm(&self, wrench: &Wrench, sd: &Wrench) -> Option<DVec3> {
        let Wrench { force_n, moment_nmm } = *wrench;
        let square = force_n.length_squared();
        let way = force_n.try_normalize()?;
        let line_mm = self.at_mm + force_n.cross(moment_nmm) / square - self.dome.center_mm();
        let aside_mm = line_mm - way * line_mm.dot(way);
        let radius_mm = self.dome.radius_mm();
        let rest = radius_mm * radius_mm - aside_mm.length_squared();
        // The first of both places: there it presses inwards.
        let out = (aside_mm - way * rest.max(0.0).sqrt()).normalize_or_zero();
        let place_mm = self.dome.center_mm() + radius_mm * out;
        let slack_mm = radius_mm * sd.force_n.length() / square.sqrt();
        (aside_mm.length() < radius_mm + slack_mm && place_mm.z > -slack_mm).then_some(place_mm)
    }

    /// How far the dots would seem to move, px, under a plate that presses onto an untouched dome at a place: of all objects it
    /// deforms the dome the least, and the widest. By Hertz (K. L. Johnson, Contact Mechanics, 1985, chapter 4), no friction.
    pub fn motions_px(&self, place_mm: DVec3, force_n: f64, dots: &[DotModel], motions: &mut Vec<DVec2>) {
        let radius_mm = self.dome.radius_mm();
        let contact_mm = (0.75 * force_n.abs() * radius_mm / self.modulus_mpa).cbrt().max(1e-6);
        let depth_mm = contact_mm * contact_mm / radius_mm;
        let normal = (place_mm - self.dome.center_mm()).normalize_or_zero();
        motions.clear();
        motions.extend(dots.iter().map(|dot| {
            let part = dot.surface_mm.distance(place_mm) / contact_mm;
            let sunk = if part < 1.0 {
                1.0 - 0.5 * part * part
            } else {
                ((2.0 - part * part) * (1.0 / part).asin() + (part * part - 1.0).sqrt()) / PI
            };
            let deformed_mm = dot.surface_mm - normal * (depth_mm * sunk);
            self.optics.project(deformed_mm).map_or(DVec2::ZERO, |at_px| at_px - dot.rest_px)
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::marks::SpotOutline;
    use crate::track::pose::pinhole_sensor;

    fn model() -> TouchModel {
        let optics = pinhole_sensor();
        TouchModel { dome: DomeShape::hemisphere(10.0), modulus_mpa: 0.7, at_mm: DVec3::Z * -9.0, optics }
    }

    /// Of a force at a place.
    fn wrench(model: &TouchModel, at_mm: DVec3, force_n: DVec3) -> Wrench {
        Wrench { force_n, moment_nmm: (at_mm - model.at_mm).cross(force_n) }
    }

    fn sd(force_n: f64) -> Wrench {
        Wrench { force_n: DVec3::splat(force_n), ..Wrench::default() }
    }

    #[test]
    fn a_wrench_says_where_it_is_pressed_or_that_it_is_not() {
        let model = model();
        let normal = DVec3::new(0.48, 0.36, 0.8);
        let pressed = wrench(&model, 10.0 * normal, -0.5 * normal + DVec3::new(0.1, 0.0, 0.0));
        assert!(model.place_mm(&pressed, &sd(0.01)).unwrap().distance(10.0 * normal) < 1e-9);
        assert_eq!(model.place_mm(&wrench(&model, 10.0 * normal, 0.5 * normal), &sd(0.01)), None, "pulled");
        let beside = wrench(&model, DVec3::new(14.0, 0.0, -1.0), DVec3::Z * -1.0);
        assert_eq!(model.place_mm(&beside, &sd(0.01)), None);
        assert!(model.place_mm(&beside, &sd(0.5)).is_some(), "it may be");
        let turned = Wrench { moment_nmm: DVec3::X, ..Wrench::default() };
        assert_eq!(model.place_mm(&turned, &sd(0.01)), None);
    }

    #[test]
    fn a_press_moves_the_dots_around_it_and_one_along_the_rays_none() {
        let model = model();
        let outline = SpotOutline { radius_px: 3.0, area_px: 28.0, spread_px2: 4.5, elongation: DVec2::ZERO };
        let mut dots = DotModel::lattice(2, 1, 18.0, outline);
        let places_mm = [10.0 * DVec3::Z, 10.0 * DVec3::new(0.6, 0.0, 0.8)];
        for (dot, place_mm) in dots.iter_mut().zip(places_mm) {
            dot.surface_mm = place_mm;
            dot.rest_px = model.optics.project(place_mm).unwrap();
        }
        let mut motions = Vec::new();
        model.motions_px(places_mm[0], 1.0, &dots, &mut motions);
        assert!(motions[0].length() < 1e-9 && motions[1].length() > 0.1, "{motions:?}");
        // By Hertz: 1.96 mm wide and 0.49 mm deep here.
        let contact_mm = (0.75 * 10.0 / 0.7_f64).cbrt();
        let depth_mm = contact_mm * contact_mm / 10.0;
        model.motions_px(places_mm[1], 1.0, &dots, &mut motions);
        let bottom_px = model.optics.project(places_mm[1] * (1.0 - depth_mm / 10.0)).unwrap();
        assert!((motions[1] - (bottom_px - dots[1].rest_px)).length() < 1e-9);
        model.motions_px(places_mm[1], 0.0, &dots, &mut motions);
        assert!(motions.iter().all(|m| m.length() < 1e-3));
    }
}
