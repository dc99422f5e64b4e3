//! What a layout is made from.

use glam::DVec2;

use super::dot::DotSize;
use super::error::LayoutError;
use super::frame::UndistortedFrame;
use crate::spec::Design;
use crate::spec::sections::{PatternSection, PrintSection, TransferMapName};
use crate::transfer::{Correction, Nominal, TransferError, TransferMap};
use domecast_optics::pose::Marker;
use domecast_optics::{DomeShape, SensorOptics};

/// The circle outside which the runtime does not look, in the undistorted frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mask {
    /// Centre, px.
    pub center_px: DVec2,
    /// Radius, px.
    pub radius_px: f64,
}

/// What a layout is made from: the parts of a design that it reads.
#[derive(Debug, Clone)]
pub struct LayoutSpec {
    /// Lens, layers and dome at rest, reference channel.
    pub optics: SensorOptics,
    /// The runtime's undistorted frame.
    pub undistorted: UndistortedFrame,
    /// The runtime's mask; dots outside are not seen.
    pub mask: Option<Mask>,
    /// The white markers, which may hide dots.
    pub white_markers: Vec<Marker>,
    /// The design's pattern.
    pub pattern: PatternSection,
    /// The design's print.
    pub print: PrintSection,
    /// The design's name and text, which its films carry.
    pub origin: LayoutOrigin,
}

/// The design that a layout was made from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LayoutOrigin {
    /// The design's name.
    pub name: String,
    /// The design's text, of which films state the hash.
    pub text: String,
}

impl LayoutSpec {
    /// The parts of a design that a layout reads.
    ///
    /// # Errors
    /// The runtime's camera matrix cannot be inverted.
    pub fn of_design(design: &Design) -> Result<Self, LayoutError> {
        let sections = design.sections();
        let matrix = design.undistorted_matrix();
        let undistorted = UndistortedFrame::new(&matrix).ok_or_else(|| {
            LayoutError::new(
                "runtime.mask_field_angle_deg",
                sections.runtime.mask_field_angle_deg,
                "the undistorted frame has no camera matrix that can be inverted",
                "an angle well inside 0 to 90",
            )
        })?;
        let markers = (0u32..).zip(design.white_markers_mm());
        let diameter_mm = sections.white_markers.diameter_mm;
        Ok(Self {
            optics: design.optics().clone(),
            undistorted,
            mask: Some(Mask {
                center_px: DVec2::new(matrix[0][2], matrix[1][2]),
                radius_px: sections.runtime.mask_radius_px,
            }),
            white_markers: markers.map(|(id, position_mm)| Marker { id, position_mm, diameter_mm }).collect(),
            pattern: sections.pattern.clone(),
            print: sections.print.clone(),
            origin: LayoutOrigin { name: design.name().to_owned(), text: design.text().to_owned() },
        })
    }

    /// The size of the dots as the design gives it.
    pub(super) fn size(&self) -> Result<DotSize, LayoutError> {
        let positive = |field: &str, value: f64, unit: &str| {
            if value.is_finite() && value > 0.0 {
                Ok(value)
            } else {
                Err(LayoutError::new(
                    field,
                    value,
                    "a dot needs a size",
                    format!("a positive number of {unit}"),
                ))
            }
        };
        match (self.pattern.dot_diameter_px, self.pattern.dot_diameter_mm) {
            (Some(px), None) => Ok(DotSize::Apparent(positive("pattern.dot_diameter_px", px, "px")?)),
            (None, Some(mm)) => {
                let mm = positive("pattern.dot_diameter_mm", mm, "mm")?;
                let radius_mm = self.optics.dome_radius_mm();
                if mm > radius_mm {
                    return Err(LayoutError::new(
                        "pattern.dot_diameter_mm",
                        mm,
                        "a dot is far smaller than the dome",
                        format!("up to the dome's radius, {radius_mm} mm"),
                    ));
                }
                Ok(DotSize::OnDome(mm))
            }
            (px, mm) => Err(LayoutError::new(
                "pattern.dot_diameter_px",
                format!("{px:?} beside dot_diameter_mm {mm:?}"),
                "the size of the dots is given once",
                "one of dot_diameter_px (equal in the image) and dot_diameter_mm (equal on the dome)",
            )),
        }
    }

    /// The pad's map.
    pub fn transfer(&self) -> Result<TransferMap, LayoutError> {
        transfer_map(&self.print, self.optics.dome()).map_err(|error| {
            LayoutError::new(format!("print.{}", error.field), error.value, error.problem, error.allowed)
        })
    }
}

/// The map that a `print` section names, about the centre of the dome's sphere.
///
/// # Errors
/// The measured map folds, or holds a number that is not finite.
pub fn transfer_map(print: &PrintSection, dome: &DomeShape) -> Result<TransferMap, TransferError> {
    let nominal = match print.transfer {
        TransferMapName::Orthographic => Nominal::Orthographic,
        TransferMapName::Equidistant => Nominal::Equidistant,
        TransferMapName::EqualArea => Nominal::EqualArea,
    };
    let correction = print.measured.as_ref().map(|measured| Correction {
        radial: measured.radial.clone(),
        two_fold: measured.two_fold,
        two_fold_sideways: measured.two_fold_sideways,
        rotation_rad: measured.rotation_deg.to_radians(),
        offset_mm: DVec2::from_array(measured.offset_mm),
        max_polar_rad: measured.max_polar_deg.to_radians(),
    });
    Ok(TransferMap::new(dome.radius_mm(), nominal, correction)?.up_to(dome.sphere_end_rad()))
}
