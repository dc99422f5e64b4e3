//! The lens of a design's camera, as the optics want it.

use super::sections::{CameraSection, ModelName};
use domecast_optics::camera::{LensModel, LensSpec};

/// The lens of a camera section.
pub(super) fn lens_spec(camera: &CameraSection) -> LensSpec {
    LensSpec {
        model: match camera.model {
            ModelName::Pinhole => LensModel::Pinhole,
            ModelName::BrownConrady => LensModel::BrownConrady,
            ModelName::KannalaBrandt => LensModel::KannalaBrandt,
        },
        width: camera.width,
        height: camera.height,
        matrix: camera.matrix,
        distortion: camera.distortion.clone(),
        field_of_view_rad: camera.field_of_view_deg.to_radians(),
        pupil_shift_mm: camera.pupil_shift_mm.clone(),
    }
}
