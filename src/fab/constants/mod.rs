//! What the runtime needs to know of one sensor, and the files that carry it.
//!
//! Everything here comes from the resolved design and its layout, so that a runtime which sees nothing
//! but the constants works with the same numbers that the artwork and the parts were made from.
//!
//! ```
//! use domecast_fab::constants;
//! use std::str::FromStr;
//!
//! let design = domecast_design::Design::from_str(include_str!("../../../designs/thumb24.json"))?;
//! let constants = constants::of(&design, &design.layout()?)?;
//! assert_eq!(constants.white_markers.len(), 4);
//! assert!(constants.springs.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod envelope_picture;
mod force_report;
pub mod formats;
mod light;
mod mass;
mod moving;
mod resolution;
mod sight;
mod springs;

use serde_json::json;

pub use force_report::{EnvelopeLine, ForceReport, RIGID, force_report};
pub use resolution::{DesignChoice, Resolution, design_choices, frames_to_average, resolution_at};
pub use sight::{MarkerSight, markers_of};
pub use springs::{DesignSprings, claimed_loads, springs_of};

use light::light_of;

use domecast_design::layout::{KeyImage, Layout, PatternKey};
use domecast_design::{Design, DesignError};
use domecast_optics::ColorChannel;
use domecast_runtime::constants::{
    BlackDot, CalibrationPriors, CameraConstants, Constants, ElastomerConstants, FORMAT, KeyConstants,
    KeyImageConstants, LayerConstants, MaskConstants, OpticsConstants, SpringTolerances, VERSION,
    WhiteMarker,
};

/// The constants of a design with its dots.
///
/// # Errors
/// A white marker whose centre the lens cannot see at rest.
pub fn of(design: &Design, layout: &Layout) -> Result<Constants, DesignError> {
    with_springs(design, layout, &springs_of(design, MarkerSight::of(design))?)
}

/// [`of`] with springs that are known already.
///
/// # Errors
/// As [`of`].
pub fn with_springs(
    design: &Design,
    layout: &Layout,
    springs: &DesignSprings,
) -> Result<Constants, DesignError> {
    let sections = design.sections();
    let optics = design.optics();
    let spec = optics.lens().spec();
    let undistorted_matrix = design.undistorted_matrix();
    let [[_, _, cx], [_, _, cy], _] = undistorted_matrix;
    let mut white_markers = white_markers(design)?;
    if let Some(plain) = &springs.plain {
        for (marker, apparent) in white_markers.iter_mut().zip(&plain.apparent_mm) {
            marker.apparent_position_mm = Some(apparent.to_array());
        }
    }
    Ok(Constants {
        format: FORMAT.into(),
        version: VERSION,
        design: design.name().into(),
        camera: CameraConstants {
            model: spec.model.as_str().into(),
            width: spec.width,
            height: spec.height,
            matrix: spec.matrix,
            distortion: spec.distortion.clone(),
            intrinsics_covariance: Vec::new(),
            pupil_shift_mm: spec.pupil_shift_mm.clone(),
            undistorted_matrix,
            max_field_angle_rad: optics.lens().max_field_angle_rad(),
            camera_from_sensor: optics.sensor_from_camera().inverse().to_rows_4x4(),
        },
        optics: OpticsConstants {
            dome_radius_mm: optics.dome_radius_mm(),
            dome_center_z_mm: optics.dome().center_z_mm(),
            layers: optics
                .layers()
                .iter()
                .map(|layer| LayerConstants {
                    name: layer.name.clone(),
                    index: layer.index_for(ColorChannel::Green),
                    index_rgb: (layer.index != [layer.index_for(ColorChannel::Green); 3])
                        .then_some(layer.index),
                    thickness_mm: layer.thickness_mm,
                })
                .collect(),
        },
        elastomer: Some(elastomer_of(design)),
        mask: MaskConstants { center_px: [cx, cy], radius_px: sections.runtime.mask_radius_px },
        white_markers,
        black_dots: layout
            .dots
            .iter()
            .map(|dot| BlackDot {
                id: dot.id as usize,
                image_px: dot.image_px.to_array(),
                surface_mm: dot.surface_mm.to_array(),
                normal: dot.normal.to_array(),
                plate_mm: dot.plate_mm.to_array(),
                diameter_mm: dot.diameter_mm,
                neighbors: dot.neighbors.iter().map(|id| *id as usize).collect(),
            })
            .collect(),
        key: layout.key.as_ref().map(key_of),
        springs: springs.constants.clone(),
        light: light_of(design)?,
        tolerances: Some(priors_of(design)),
        optics_uncertainty: None,
        calibrations: Vec::new(),
    })
}

fn key_of(key: &PatternKey) -> KeyConstants {
    let image = |image: &KeyImage| KeyImageConstants {
        // To a millionth of a degree: multiples of 15 are whole numbers then.
        turned_deg: (image.turned_rad.to_degrees() * 1e6).round() / 1e6,
        mirrored: image.is_mirrored,
        dot: image.dot as usize,
    };
    KeyConstants {
        image_px: key.dot.image_px.to_array(),
        surface_mm: key.dot.surface_mm.to_array(),
        diameter_mm: key.dot.diameter_mm,
        neighbors: key.dot.neighbors.iter().map(|id| *id as usize).collect(),
        images: key.images.iter().map(image).collect(),
    }
}

/// Standard deviation of a silicone's modulus over it: data sheets give Shore A to 3 points, which by Gent's formula (A. N. Gent,
/// Rubber Chem. Technol. 31, 1958) are 17 % at Shore A 15.
const YOUNG_SD_PART: f64 = 0.17;
/// Standard deviation of Poisson's ratio: what bulk moduli of silicones leave open.
const POISSON_SD: f64 = 0.005;

/// The elastomer of a design.
fn elastomer_of(design: &Design) -> ElastomerConstants {
    let elastomer = &design.sections().elastomer;
    ElastomerConstants {
        young_modulus_mpa: elastomer.young_modulus_mpa,
        young_modulus_sd_mpa: YOUNG_SD_PART * elastomer.young_modulus_mpa,
        poisson_ratio: elastomer.poisson_ratio,
        poisson_ratio_sd: POISSON_SD,
        friction: elastomer.friction,
    }
}

/// The tolerances of a design, as the priors of `calibrate-optics`.
pub fn priors_of(design: &Design) -> CalibrationPriors {
    let (tolerances, noise) = (&design.sections().tolerances, &design.sections().noise);
    CalibrationPriors {
        pupil_mm: tolerances.pupil_mm,
        camera_rotation_rad: tolerances.camera_rotation_deg.map(f64::to_radians),
        layer_thickness_mm: tolerances.layer_thickness_mm,
        index: tolerances.index,
        white_marker_mm: tolerances.white_marker_mm,
        black_dot_mm: tolerances.black_dot_mm,
        white_centroid_px: noise.white_centroid_px,
        black_centroid_px: noise.black_centroid_px,
        camera_drift_mm: tolerances.camera_drift_mm,
        camera_drift_rad: tolerances.camera_drift_deg.to_radians(),
        springs: (!design.is_rigid()).then_some(SpringTolerances {
            wire_diameter_mm: tolerances.wire_diameter_mm,
            outer_diameter_mm: tolerances.spring_diameter_mm,
            active_coils: tolerances.active_coils,
            modulus_part: 0.01 * tolerances.modulus_percent,
        }),
    }
}

fn white_markers(design: &Design) -> Result<Vec<WhiteMarker>, DesignError> {
    let diameter_mm = design.sections().white_markers.diameter_mm;
    let marker = |(id, position): (usize, glam::DVec3)| {
        let image = design.optics().project(position).map_err(|limit| {
            DesignError::at(
                format!("white_markers.positions_mm[{id}]"),
                json!([position.x, position.y]),
                format!("the lens cannot see the marker at rest ({limit})"),
                "a place inside the field of view, nearer to the axis, or a deeper camera",
            )
        })?;
        Ok(WhiteMarker {
            id,
            position_mm: position.to_array(),
            diameter_mm,
            apparent_position_mm: None,
            image_px: image.to_array(),
        })
    };
    design.white_markers_mm().into_iter().enumerate().map(marker).collect()
}

#[cfg(test)]
mod runtime_tests;
