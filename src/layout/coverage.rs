//! How much of the dome the camera covers, at rest and under load.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::Serialize;

use super::Layout;
use super::region::dome_point;
use super::spec::LayoutSpec;
use crate::optics::SensorOptics;

/// Rings and points per ring at which the dome is looked at. Rings are at equal steps of height, so that every
/// point stands for the same area.
const RINGS: u32 = 90;
const AROUND: u32 = 72;

/// How much of the dome is seen at one pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Share of the dome's area that the lens sees through the layers, on the raster or not.
    pub seen_by_lens: f64,
    /// Share that lies on the camera's raster.
    pub on_raster: f64,
    /// Share that lies inside the runtime's mask as well.
    pub in_mask: f64,
    /// Polar angle up to which every point lies on the raster and in the mask, degrees.
    pub whole_to_deg: f64,
    /// Ids of laid-out dots that are not seen at this pose.
    pub unseen_dots: Vec<u32>,
}

/// Looks at the dome from one pose of the platform, which `optics` carries.
pub fn coverage(spec: &LayoutSpec, layout: &Layout, optics: &SensorOptics) -> Coverage {
    let radius_mm = optics.dome_radius_mm();
    let (mut lens, mut raster, mut mask, mut whole) = (0u32, 0u32, 0u32, true);
    let mut whole_to_rad = 0.0;
    for ring in 0..RINGS {
        let height = 1.0 - (f64::from(ring) + 0.5) / f64::from(RINGS);
        let polar_rad = height.acos();
        let before = mask;
        for k in 0..AROUND {
            let azimuth_rad = TAU * f64::from(k) / f64::from(AROUND);
            let sight = sight(spec, optics, dome_point(radius_mm, polar_rad, azimuth_rad));
            lens += u32::from(sight >= Sight::Lens);
            raster += u32::from(sight >= Sight::Raster);
            mask += u32::from(sight >= Sight::Mask);
        }
        whole &= mask - before == AROUND;
        if whole {
            whole_to_rad = if ring + 1 == RINGS { FRAC_PI_2 } else { polar_rad };
        }
    }
    let all = f64::from(RINGS * AROUND);
    let unseen = layout.dots.iter().filter(|dot| sight(spec, optics, dot.surface_mm) < Sight::Mask);
    Coverage {
        seen_by_lens: f64::from(lens) / all,
        on_raster: f64::from(raster) / all,
        in_mask: f64::from(mask) / all,
        whole_to_deg: f64::to_degrees(whole_to_rad),
        unseen_dots: unseen.map(|dot| dot.id).collect(),
    }
}

/// How far towards being seen a point comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Sight {
    None,
    Lens,
    Raster,
    Mask,
}

fn sight(spec: &LayoutSpec, optics: &SensorOptics, point_mm: glam::DVec3) -> Sight {
    let Ok(pixel) = optics.project(point_mm) else { return Sight::None };
    let lens = optics.lens();
    let size = glam::DVec2::new(f64::from(lens.spec().width), f64::from(lens.spec().height));
    if pixel.min_element() < -0.5 || (pixel - size).max_element() >= -0.5 {
        return Sight::Lens;
    }
    let Some(mask) = &spec.mask else { return Sight::Mask };
    let inside =
        spec.undistorted.from_raw(lens, pixel).is_ok_and(|p| p.distance(mask.center_px) <= mask.radius_px);
    if inside { Sight::Mask } else { Sight::Raster }
}
