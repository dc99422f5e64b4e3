//! Which part of the dome the camera sees, at rest and under load, and which dots a load hides.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::coverage::coverage;
//! use domecast_design::layout::{Layout, LayoutSpec};
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let spec = LayoutSpec::of_design(&Design::load(THUMB24.as_ref())?)?;
//! let layout = Layout::new(&spec)?;
//! let at_rest = coverage(&spec, &layout, &spec.optics, None);
//! assert!(at_rest.in_sight > 0.9 && at_rest.unseen_dots.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::dot::{Dot, DotProjector};
use super::frame::EvenFrame;
use super::lost::Reason;
use super::plan::Layout;
use super::spec::LayoutSpec;
use super::window::Window;
use super::zones::{ImageZone, check_corners, marker_zones};
use domecast_optics::{DomeShape, SensorOptics};

/// Rings and points per ring at which the dome is sampled. Rings are at equal steps of height, so that every
/// point stands for the same area, on a cylinder as on the sphere.
const RINGS: u32 = 90;
const AROUND: u32 = 72;

/// Points on a dot's outline that are checked where something near may hide it.
const EDGE_POINTS: u32 = 16;

/// A dot is checked point by point where something is nearer than this multiple of its radius at rest: the image of
/// a dot grows less between rest and full load, and less from the raw image to the undistorted one.
const NEAR: f64 = 6.0;

/// How much of the dome is seen at one pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DomeCoverage {
    /// Share of the dome's area that the lens sees through the layers, in the image or beyond its edges.
    pub seen_by_lens: f64,
    /// Share inside the image.
    pub on_raster: f64,
    /// Share inside the image and the runtime's mask.
    pub in_mask: f64,
    /// Share that is visible: of all that, less what white markers or the platform's window hide.
    pub in_sight: f64,
    /// Polar angle up to which the dome is fully visible, degrees.
    pub whole_to_deg: f64,
    /// The nearest that the line of sight of a dot comes to the edge of the upper platform's window, mm sideways;
    /// null where the window is not known.
    pub window_gap_mm: Option<f64>,
    /// Laid-out dots that are hidden in part or in full at this pose.
    pub unseen_dots: Vec<UnseenDot>,
}

/// A laid-out dot that is hidden in part or in full.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnseenDot {
    /// Its number.
    pub id: u32,
    /// Why, by name.
    pub reason: &'static str,
    /// Why, in words.
    pub because: String,
}

/// The coverage at one pose of the platform, the pose of `optics`.
pub fn coverage(
    spec: &LayoutSpec,
    layout: &Layout,
    optics: &SensorOptics,
    window: Option<&Window>,
) -> DomeCoverage {
    let visibility = Visibility { spec, optics, markers: marker_zones(optics, &spec.white_markers), window };
    let dome = optics.dome();
    let (mut lens, mut raster, mut mask, mut free, mut whole) = (0u32, 0u32, 0u32, 0u32, true);
    let mut whole_to_rad = 0.0;
    for ring in 0..RINGS {
        let level = 1.0 - (1.0 - dome.rim_level()) * ((f64::from(ring) + 0.5) / f64::from(RINGS));
        let meridian_rad = DomeShape::meridian_of_level(level);
        let before = free;
        for k in 0..AROUND {
            let azimuth_rad = TAU * f64::from(k) / f64::from(AROUND);
            let reason = visibility.point(dome.point_mm(meridian_rad, azimuth_rad)).err();
            lens += u32::from(!matches!(reason, Some(Reason::Unseen(_))));
            raster += u32::from(!matches!(reason, Some(Reason::Unseen(_) | Reason::OutsideImage)));
            mask += u32::from(!matches!(
                reason,
                Some(Reason::Unseen(_) | Reason::OutsideImage | Reason::OutsideMask)
            ));
            free += u32::from(reason.is_none());
        }
        whole &= free - before == AROUND;
        if whole {
            let seen_rad = if ring + 1 == RINGS { FRAC_PI_2 } else { meridian_rad };
            whole_to_rad = seen_rad.min(dome.sphere_end_rad());
        }
    }
    let all = f64::from(RINGS * AROUND);
    let (window_gap_mm, unseen_dots) = visibility.dots(layout);
    DomeCoverage {
        seen_by_lens: f64::from(lens) / all,
        on_raster: f64::from(raster) / all,
        in_mask: f64::from(mask) / all,
        in_sight: f64::from(free) / all,
        whole_to_deg: f64::to_degrees(whole_to_rad),
        window_gap_mm,
        unseen_dots,
    }
}

/// What the camera sees at one pose: everything that can hide a point.
struct Visibility<'a> {
    spec: &'a LayoutSpec,
    optics: &'a SensorOptics,
    markers: Vec<ImageZone>,
    window: Option<&'a Window>,
}

/// A visible point.
struct VisiblePoint {
    pixel: DVec2,
    /// Distance from the mask's edge in the undistorted frame, px; infinite without a mask.
    mask_px: f64,
    /// Gap to the window's edge, mm; infinite where no window is known.
    window_mm: f64,
}

impl Visibility<'_> {
    /// A point of the dome: lens, image, mask, markers and window, in this order.
    fn point(&self, point_mm: DVec3) -> Result<VisiblePoint, Reason> {
        let pixel = self.optics.project(point_mm).map_err(Reason::Unseen)?;
        if self.image_margin_px(pixel) < 0.0 {
            return Err(Reason::OutsideImage);
        }
        let mask_px = match &self.spec.mask {
            None => f64::INFINITY,
            Some(mask) => (self.spec.undistorted.from_raw(self.optics.lens(), pixel).ok())
                .map(|place| mask.radius_px - place.distance(mask.center_px))
                .filter(|left| *left >= 0.0)
                .ok_or(Reason::OutsideMask)?,
        };
        check_corners(&self.markers, &[pixel])?;
        let window_mm =
            self.window.and_then(|window| window.gap_mm(self.optics, pixel)).unwrap_or(f64::INFINITY);
        if window_mm < 0.0 {
            Err(Reason::HiddenByPlatform)
        } else {
            Ok(VisiblePoint { pixel, mask_px, window_mm })
        }
    }

    /// Distance from the edge of the image, px; negative outside.
    fn image_margin_px(&self, pixel: DVec2) -> f64 {
        let lens = self.optics.lens().spec();
        let last = DVec2::new(f64::from(lens.width), f64::from(lens.height)) - 0.5;
        (pixel + 0.5).min_element().min((last - pixel).min_element())
    }

    /// The narrowest gap of all dots to the window, and the dots that are not fully visible.
    fn dots(&self, layout: &Layout) -> (Option<f64>, Vec<UnseenDot>) {
        let projector = DotProjector {
            optics: &self.spec.optics,
            frame: EvenFrame::new(self.spec.optics.lens(), self.spec.pattern.even_in, self.spec.undistorted),
            transfer: &layout.transfer,
            size: layout.size,
            outline_tolerance_mm: self.spec.print.outline_mm(),
        };
        let gaps: Vec<Result<f64, Reason>> =
            layout.dots.par_iter().map(|dot| self.dot(&projector, dot)).collect();
        let narrowest = gaps.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let unseen = layout.dots.iter().zip(&gaps).filter_map(|(dot, gaps)| {
            let reason = gaps.as_ref().err()?;
            Some(UnseenDot { id: dot.id, reason: reason.as_str(), because: reason.to_string() })
        });
        (narrowest.is_finite().then_some(narrowest), unseen.collect())
    }

    /// The gap of a fully visible dot to the window's edge, mm. The dot's outline is checked only where something is near.
    fn dot(&self, projector: &DotProjector<'_>, dot: &Dot) -> Result<f64, Reason> {
        let middle = self.point(dot.surface_mm)?;
        let (low, high) = dot.image_outline.bounds();
        let near_px = NEAR * 0.5 * low.distance(high);
        let (low, high) = (middle.pixel - near_px, middle.pixel + near_px);
        let square = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        let alone = middle.mask_px > near_px
            && self.image_margin_px(middle.pixel) > near_px
            && middle.window_mm > NEAR * dot.diameter_mm
            && check_corners(&self.markers, &square).is_ok();
        if alone {
            return Ok(middle.window_mm);
        }
        let curve = projector.curve(dot.even_px, dot.surface_mm);
        let mut window_mm = middle.window_mm;
        let mut corners = Vec::with_capacity(EDGE_POINTS as usize);
        for k in 0..EDGE_POINTS {
            let (point, _) = curve.on_dome(TAU * f64::from(k) / f64::from(EDGE_POINTS))?;
            let seen = self.point(point)?;
            window_mm = window_mm.min(seen.window_mm);
            // Slightly inside, so that a dot that just clears a marker in the layout does so here.
            corners.push(middle.pixel.lerp(seen.pixel, 0.995));
        }
        check_corners(&self.markers, &corners)?;
        Ok(window_mm)
    }
}
