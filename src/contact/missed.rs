//! Contacts that are smaller than the elements: what the nodes miss of them.
//!
//! An object may reach into the dome where no node is, or bear on one node that stands for much more than what it touches. What
//! it would press with, the geometric level's foundation tells from samples of the overlap itself, which no element is too long for
//! (Hertz' force of a ball exactly, Sneddon's of a cone to 5 %, a flat punch's to 19 %).

use std::f64::consts::PI;

use crate::elastomer::{Elastomer, Indenter};
use crate::levels::{FOUNDATION, overlap};
use crate::object::{Placed, deepest};
use crate::outcome::Deviation;
use domecast_optics::numeric::Rigid;

/// What an answer with nodes `element_mm` apart misses, where it found the force `force_n` on a contact of `radius_mm`; nothing where
/// the contact is larger than the elements.
pub(crate) fn missed(
    elastomer: &Elastomer,
    indenter: &Indenter,
    sensor_from_object: &Rigid,
    element_mm: f64,
    (force_n, radius_mm): (f64, f64),
) -> Deviation {
    if radius_mm >= element_mm {
        return Deviation::default();
    }
    let dome = elastomer.dome();
    let placed = Placed::new(indenter.solid.clone(), *sensor_from_object);
    let sharing = 1.0 + indenter.yield_ratio(elastomer);
    let modulus_mpa = elastomer.plane_strain_mpa() / sharing;
    let (at_mm, distance_mm, _) = deepest(&placed, dome);
    if distance_mm >= 0.0 {
        return Deviation::default();
    }
    // Of the sphere about its own centre; what would lie below the base is in the sheet, where no object is.
    let centred = Rigid::from_translation(-dome.center_mm()).compose(sensor_from_object);
    let found = overlap(&Placed::new(indenter.solid.clone(), centred), dome.radius_mm());
    let (expected_n, depth_mm) = if found.samples.is_empty() || dome.center_mm().z > at_mm.z {
        // The side of a cylinder: no more than a flat punch as wide as the object, nor than a plate.
        let (_, reach_mm) = indenter.solid.bounding_sphere();
        let punch_mm2 = 2.0 * reach_mm * -distance_mm;
        let plate_mm2 = 4.0 / 3.0 * dome.radius_mm().sqrt() * (-distance_mm).powf(1.5);
        (modulus_mpa * punch_mm2.min(plate_mm2), -distance_mm)
    } else {
        let pressed_mm3: f64 = found.samples.iter().map(|(_, area, way, _)| way * area).sum();
        let depth_mm = found.samples.iter().map(|(_, _, way, _)| *way).fold(-distance_mm, f64::max);
        (FOUNDATION * modulus_mpa / (found.area_mm2 / PI).sqrt() * pressed_mm3, depth_mm)
    };
    let part = if expected_n > 0.0 { ((expected_n - force_n) / expected_n).abs().min(1.0) } else { 1.0 };
    Deviation { displacement_mm: part * depth_mm / sharing, force_n: (expected_n - force_n).abs() }
}
