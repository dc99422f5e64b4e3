//! One dot: where it is in the image, on the dome and on the plate, and its outlines.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let layout = Design::load(THUMB24.as_ref())?.layout()?;
//! let dot = &layout.dots[0];
//! assert!((dot.plate_outline.centroid() - dot.plate_mm).length() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Vector2, Vector3};

use super::frame::EvenFrame;
use super::lost::Reason;
use super::outline::{CurvePoint, Outline};
use crate::transfer::TransferMap;
use domecast_optics::{RayLimit, SensorOptics};

/// A dot that is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct Dot {
    /// Number of the dot: its index in the layout.
    pub id: u32,
    /// Its centre in the raw image, px.
    pub image_px: DVec2,
    /// Its centre in the frame in which the pattern is even, px.
    pub even_px: DVec2,
    /// Its centre on the dome, sensor frame, mm.
    pub surface_mm: DVec3,
    /// Outward unit normal of the dome there, sensor frame.
    pub normal: DVec3,
    /// Angle of its ray in air to the camera's axis, rad.
    pub field_angle_rad: f64,
    /// Index of the print pass that prints it.
    pub pass: usize,
    /// Angle between the normal and the stroke of its print pass, rad.
    pub wrap_rad: f64,
    /// Its centre on the plate of its print pass, mm.
    pub plate_mm: DVec2,
    /// Diameter of the flat disc with the area that its outline on the dome encloses, mm.
    pub diameter_mm: f64,
    /// Its outline in the raw image, px.
    pub image_outline: Outline,
    /// Its outline on the plate of its print pass, mm.
    pub plate_outline: Outline,
    /// The dots next to it in the image, by id, ascending.
    pub neighbors: Vec<u32>,
}

impl Dot {
    /// Angle from the pole, rad.
    pub fn polar_rad(&self) -> f64 {
        self.normal.truncate().length().atan2(self.normal.z)
    }
}

/// How large the dots are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DotSize {
    /// A circle of this diameter in the even frame, px.
    Apparent(f64),
    /// A circle on the dome with this diameter (the flat disc that it bounds), mm.
    OnDome(f64),
}

/// Projects dots between image, dome and plate.
#[derive(Debug, Clone, Copy)]
pub struct DotProjector<'a> {
    /// Lens, layers and dome at rest.
    pub optics: &'a SensorOptics,
    /// The frame in which the pattern is even.
    pub frame: EvenFrame<'a>,
    /// The pad's map.
    pub transfer: &'a TransferMap,
    /// Size of the dots.
    pub size: DotSize,
    /// Largest distance between a drawn outline on the plate and the exact one, mm.
    pub outline_tolerance_mm: f64,
}

/// Outlines in the image serve pictures and checks of overlap, px.
const IMAGE_TOLERANCE_PX: f64 = 1e-3;

/// Points at which the curve on the dome is integrated. The rule's error falls with the power of their
/// number; with 16 it is below 1e-9 for a dot as wide as a third of the dome's radius.
const AREA_POINTS: u32 = 16;

/// A dot's closed curve, as a function of an angle.
pub(super) enum DotCurve<'a> {
    /// A circle in the even frame.
    Apparent { projector: &'a DotProjector<'a>, center_px: DVec2, radius_px: f64 },
    /// A circle on the dome: the centre of its plane, and its two radii.
    OnDome { optics: Option<&'a SensorOptics>, center: DVec3, side: DVec3, up: DVec3 },
}

impl DotCurve<'_> {
    /// A circle on a sphere about the origin, around a point of it; it has no image.
    pub(super) fn on_dome_of(radius_mm: f64, surface_mm: DVec3, diameter_mm: f64) -> Self {
        let flat = 0.5 * diameter_mm;
        let axis = surface_mm / radius_mm;
        let (side, up) = tangents(axis);
        let center = axis * ((radius_mm - flat) * (radius_mm + flat)).max(0.0).sqrt();
        Self::OnDome { optics: None, center, side: side * flat, up: up * flat }
    }

    /// Centre of the sphere that the curve lies on, mm.
    fn sphere_mm(&self) -> DVec3 {
        match self {
            Self::Apparent { projector, .. } => projector.optics.dome().center_mm(),
            Self::OnDome { optics, .. } => optics.map_or(DVec3::ZERO, |optics| optics.dome().center_mm()),
        }
    }

    /// The point on the dome and its derivative, mm.
    pub(super) fn on_dome(&self, angle: f64) -> Result<(DVec3, DVec3), Reason> {
        match self {
            Self::Apparent { projector, .. } => {
                let pixel = self.in_image(angle)?;
                let (surface, by_pixel) =
                    projector.optics.trace_with_jacobian(pixel.at).map_err(Reason::Unseen)?;
                let slope = by_pixel * Vector2::new(pixel.slope.x, pixel.slope.y);
                Ok((surface.surface_mm, DVec3::new(slope.x, slope.y, slope.z)))
            }
            Self::OnDome { center, side, up, .. } => {
                let (sin, cos) = angle.sin_cos();
                Ok((*center + *side * cos + *up * sin, *up * cos - *side * sin))
            }
        }
    }

    /// The point in the raw image and its derivative, px.
    fn in_image(&self, angle: f64) -> Result<CurvePoint, Reason> {
        match self {
            Self::Apparent { projector, center_px, radius_px } => {
                let out = DVec2::from_angle(angle) * *radius_px;
                let (at, slope) = projector
                    .frame
                    .raw_from_even_with_slope(*center_px + out, out.perp())
                    .map_err(|limit| Reason::Unseen(limit.into()))?;
                Ok(CurvePoint { at, slope })
            }
            Self::OnDome { optics, .. } => {
                let (point, slope) = self.on_dome(angle)?;
                let optics = optics.ok_or(Reason::Unseen(RayLimit::Unreachable))?;
                let (at, by_point) = optics.project_with_jacobian(point).map_err(Reason::Unseen)?;
                let slope = by_point * Vector3::from(slope.to_array());
                Ok(CurvePoint { at, slope: DVec2::new(slope.x, slope.y) })
            }
        }
    }
}

impl DotProjector<'_> {
    /// A dot's outline on the plate of a print pass, as `pass_from_sensor` turns the dome under the pad, drawn as closely as
    /// `tolerance_mm` asks.
    ///
    /// # Errors
    /// Why the dot has none.
    pub fn plate_outline(
        &self,
        dot: &Dot,
        pass_from_sensor: DMat3,
        tolerance_mm: f64,
    ) -> Result<Outline, Reason> {
        plate_outline(&self.curve(dot.even_px, dot.surface_mm), self.transfer, pass_from_sensor, tolerance_mm)
    }

    /// The exact curve that the outline follows, at an angle; mm and mm per rad.
    ///
    /// # Errors
    /// Why there is no such point.
    pub fn plate_point(
        &self,
        dot: &Dot,
        pass_from_sensor: DMat3,
        angle_rad: f64,
    ) -> Result<CurvePoint, Reason> {
        plate_point(&self.curve(dot.even_px, dot.surface_mm), self.transfer, pass_from_sensor, angle_rad)
    }

    pub(super) fn curve(&self, even_px: DVec2, surface_mm: DVec3) -> DotCurve<'_> {
        match self.size {
            DotSize::Apparent(diameter) => {
                DotCurve::Apparent { projector: self, center_px: even_px, radius_px: 0.5 * diameter }
            }
            DotSize::OnDome(diameter_mm) => {
                let sphere_mm = self.optics.dome().center_mm();
                let radius_mm = self.optics.dome_radius_mm();
                let mut curve = DotCurve::on_dome_of(radius_mm, surface_mm - sphere_mm, diameter_mm);
                if let DotCurve::OnDome { optics, center, .. } = &mut curve {
                    *optics = Some(self.optics);
                    *center += sphere_mm;
                }
                curve
            }
        }
    }

    /// The dot's outline in the raw image.
    pub(super) fn image_outline(&self, curve: &DotCurve<'_>) -> Result<Outline, Reason> {
        Ok(Outline::of_curve(|angle| curve.in_image(angle), IMAGE_TOLERANCE_PX)?.0)
    }

    /// Diameter of the flat disc whose area is the vector area of the curve on the dome, mm.
    pub(super) fn dome_diameter_mm(&self, curve: &DotCurve<'_>) -> Result<f64, Reason> {
        if let DotSize::OnDome(diameter_mm) = self.size {
            return Ok(diameter_mm);
        }
        let mut area = DVec3::ZERO;
        let mut first = None;
        for k in 0..AREA_POINTS {
            let (point, slope) = curve.on_dome(TAU * f64::from(k) / f64::from(AREA_POINTS))?;
            // Relative to a point of the curve: the vector area does not depend on it, its rounding does.
            let origin = *first.get_or_insert(point);
            area += (point - origin).cross(slope);
        }
        Ok(2.0 * (area.length() * 0.5 * TAU / f64::from(AREA_POINTS) / PI).sqrt())
    }
}

/// A curve's outline on the plate of a print pass, as `pass_from_sensor` turns the dome under the pad.
pub(super) fn plate_outline(
    curve: &DotCurve<'_>,
    transfer: &TransferMap,
    pass_from_sensor: DMat3,
    tolerance_mm: f64,
) -> Result<Outline, Reason> {
    let (outline, fit) =
        Outline::of_curve(|angle| plate_point(curve, transfer, pass_from_sensor, angle), tolerance_mm)?;
    if fit.reached { Ok(outline) } else { Err(Reason::NotSmooth { error_mm: fit.error }) }
}

fn plate_point(
    curve: &DotCurve<'_>,
    transfer: &TransferMap,
    pass_from_sensor: DMat3,
    angle_rad: f64,
) -> Result<CurvePoint, Reason> {
    let (point, slope) = curve.on_dome(angle_rad)?;
    let on_pass = pass_from_sensor * (point - curve.sphere_mm());
    let plate = transfer.plate_from_dome_with_slope(on_pass).map_err(Reason::BeyondTransfer)?;
    let slope = pass_from_sensor * slope;
    let [x, y] = plate.plate_from_dome;
    Ok(CurvePoint { at: plate.plate_mm, slope: DVec2::new(x.dot(slope), y.dot(slope)) })
}

/// Two unit vectors across a unit axis, the first level and the second uphill; right-handed with the axis.
fn tangents(axis: DVec3) -> (DVec3, DVec3) {
    let side = if axis.truncate().length() > 1e-12 {
        DVec3::new(-axis.y, axis.x, 0.0).normalize()
    } else {
        DVec3::X
    };
    (side, axis.cross(side))
}
