//! From the sections as written to a design in which the rules between fields hold.

use serde_json::json;

use super::body_rules;
use super::derive::DerivedField;
use super::design::{Design, DesignWarning, sensor_from_camera, with_lints};
use super::error::DesignError;
use super::lens::lens_spec;
use super::lints::lints;
use super::mount_rules;
use super::rules;
use super::sections::{CameraSection, DesignFile, DomeSection, OpticsSection};
use super::settings::Settings;
use domecast_optics::{FlatLayer, OpticsSpec, SensorOptics};

/// The optics of a design.
pub(super) fn optics(
    camera: &CameraSection,
    optics: &OpticsSection,
    dome: &DomeSection,
) -> Result<SensorOptics, DesignError> {
    rules::layers(&optics.layers)?;
    rules::camera_below_sheet(camera, optics)?;
    rules::dome_shape(dome)?;
    let layers = optics.layers.iter().map(|layer| FlatLayer {
        name: layer.name.clone(),
        index: layer.index.rgb(),
        thickness_mm: layer.thickness_mm,
    });
    let spec = OpticsSpec {
        lens: lens_spec(camera),
        sensor_from_camera: sensor_from_camera(camera),
        layers: layers.collect(),
        dome: dome.shape(),
    };
    SensorOptics::new(&spec).map_err(|fault| {
        // the optics name their own inputs; the message names the fields of the file
        let field = match fault.field.split_once('.') {
            Some(("lens", rest)) => {
                format!("camera.{}", rest.replace("field_of_view_rad", "field_of_view_deg"))
            }
            _ if fault.field.starts_with("layers") => format!("optics.{}", fault.field),
            _ if fault.field.starts_with("dome_") => "dome.radius_mm".to_owned(),
            _ => "camera.position_mm".to_owned(),
        };
        DesignError::at(field, fault.value, "the optics cannot be", fault.allowed)
    })
}

/// Checks the rules between fields and computes what follows from them.
pub(super) fn resolve(
    mut sections: DesignFile,
    text: &str,
    derived: Vec<DerivedField>,
) -> Result<Design, DesignError> {
    check_name(&sections.name)?;
    let optics = optics(&sections.camera, &sections.optics, &sections.dome)
        .map_err(|fault| with_lints(fault, &lints(&sections, None)))?;
    let lints = lints(&sections, Some(&optics));
    let short = short_lens_model(&sections.camera, &optics);
    // the runtime reads nothing beyond its mask: a model that holds as far is no fault of the design
    let ends_in_mask =
        optics.lens().max_field_angle_rad() < sections.runtime.mask_field_angle_deg.to_radians();
    let notes = short.clone().filter(|_| !ends_in_mask).into_iter().collect();
    let warnings = short.filter(|_| ends_in_mask).map(|message| {
        let cure = "a kannala_brandt calibration reaches further";
        DesignWarning { field: "camera.distortion".into(), message: format!("{message}; {cure}") }
    });
    let warnings = warnings.into_iter().chain(lints.clone()).collect();
    let settings = Settings::of(&sections, &optics).map_err(|fault| with_lints(fault, &lints))?;
    sections.print.outline_tolerance_mm = Some(settings.outline_tolerance_mm.value);
    sections.mesh.chord_tolerance_mm = Some(settings.chord_tolerance_mm.value);
    sections.mesh.optical_chord_tolerance_mm = Some(settings.optical_chord_tolerance_mm.value);
    sections.tolerances.samples = Some(settings.samples.value);
    mount_rules::check(&sections).map_err(|fault| with_lints(fault, &lints))?;
    body_rules::check(&sections).map_err(|fault| with_lints(fault, &lints))?;
    let design =
        Design { sections, text: text.to_owned(), optics, warnings, notes, lints, settings, derived };
    rules::check(&design).map_err(|fault| design.with_lints(fault))?;
    Ok(design)
}

/// What a lens model that ends inside of the camera's field of view reaches, with the fold that ends it.
fn short_lens_model(camera: &CameraSection, optics: &SensorOptics) -> Option<String> {
    let wanted_deg = camera.field_of_view_deg / 2.0;
    let reached_deg = optics.lens().max_field_angle_rad().to_degrees();
    if reached_deg >= wanted_deg * (1.0 - 1e-9) {
        return None;
    }
    let why = optics.lens().fold_angle_rad().map_or("", |_| ", where it folds");
    Some(format!(
        "The lens sees {wanted_deg:.1} degrees from its axis (half of camera.field_of_view_deg), its model holds up to \
         {reached_deg:.1} degrees{why}: nothing beyond is used"
    ))
}

/// Folder names come from design names, so a name must not be able to leave the output folder.
pub(super) fn check_name(name: &str) -> Result<(), DesignError> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > 64 || !name.chars().all(fits) {
        return Err(DesignError::at(
            "name",
            json!(name),
            "a name that no folder can have on every system",
            "1 to 64 letters (a-z, A-Z), digits, - and _",
        ));
    }
    Ok(())
}
