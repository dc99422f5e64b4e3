//! From the sections as written to a design in which the rules between fields hold.

use glam::{DMat3, DVec2, DVec3};
use serde_json::json;

use super::error::DesignError;
use super::rules;
use super::sections::{CameraSection, DesignFile, DomeSection, ModelName, OpticsSection, SpringPlaces};
use super::settings::Settings;
use super::suspicions::suspicions;
use domecast_optics::camera::{LensSpec, Model};
use domecast_optics::numeric::Rigid;
use domecast_optics::{Layer, OpticsSpec, SensorOptics};

/// Something about a design that does not stop a build but that its maker should know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DesignWarning {
    /// The field to change, as a path.
    pub field: String,
    /// What is the matter, with numbers.
    pub message: String,
}

/// A resolved, validated design.
///
/// The sections can be read as they were written ([`Design::sections`]); what follows from several of
/// them is a method here, so that no two modules derive it in two ways. Lengths mm, sensor frame at rest.
#[derive(Debug, Clone)]
pub struct Design {
    sections: DesignFile,
    text: String,
    optics: SensorOptics,
    warnings: Vec<DesignWarning>,
    suspicions: Vec<DesignWarning>,
    pub(super) settings: Settings,
}

impl Design {
    /// The sections as written, with the settings that the file leaves to its `accuracy`; every rule between them
    /// holds.
    pub fn sections(&self) -> &DesignFile {
        &self.sections
    }

    /// The text that the design was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Lens, layers and dome at rest.
    pub fn optics(&self) -> &SensorOptics {
        &self.optics
    }

    /// What the maker should know.
    pub fn warnings(&self) -> &[DesignWarning] {
        &self.warnings
    }

    /// A fault found later, with what looked wrong from the start.
    pub fn beside_suspicions(&self, fault: DesignError) -> DesignError {
        beside(fault, &self.suspicions)
    }

    /// Name of the design.
    pub fn name(&self) -> &str {
        &self.sections.name
    }

    /// Thickness of the sheet: all flat layers between the air and the dome, mm.
    pub fn sheet_thickness_mm(&self) -> f64 {
        sheet_thickness_mm(&self.sections)
    }

    /// Height of the sheet's underside, mm; negative.
    pub fn sheet_underside_z_mm(&self) -> f64 {
        -self.sheet_thickness_mm()
    }

    /// Height of the lower platform's top at rest: one free spring length below the upper platform, mm.
    pub fn lower_top_z_mm(&self) -> f64 {
        self.sections.platforms.upper.underside_z_mm - self.sections.springs.free_length_mm
    }

    /// x, y of every spring's axis, mm.
    pub fn springs_at_mm(&self) -> Vec<DVec2> {
        match &self.sections.springs.places {
            SpringPlaces::Listed(places) => places.iter().map(|place| DVec2::from_array(*place)).collect(),
            SpringPlaces::Ring(ring) => (0..ring.count)
                .map(|index| {
                    let turn = f64::from(index) / f64::from(ring.count);
                    let azimuth_rad = ring.first_azimuth_deg.to_radians() + turn * std::f64::consts::TAU;
                    ring.radius_mm * DVec2::from_angle(azimuth_rad)
                })
                .collect(),
        }
    }

    /// Centres of the white markers on the sheet's top face, mm.
    pub fn white_markers_mm(&self) -> Vec<DVec3> {
        self.sections.white_markers.positions_mm.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect()
    }

    /// From the camera's frame to the sensor's, at rest.
    pub fn sensor_from_camera(&self) -> Rigid {
        sensor_from_camera(&self.sections.camera)
    }

    /// Height of the camera's back on its axis, mm.
    pub fn camera_back_z_mm(&self) -> f64 {
        let body = &self.sections.camera_body;
        self.sections.camera.position_mm[2] + body.front_from_pupil_mm - body.length_mm
    }

    /// Lowest and highest corner of the whole sensor at rest, mm.
    pub fn bounds_mm(&self) -> [DVec3; 2] {
        let sections = &self.sections;
        let half = DVec2::from_array(sections.platforms.outer_mm) / 2.0;
        let top_mm = sections.dome.radius_mm + sections.elastomer.membrane_thickness_mm;
        let bottom_mm = sections.platforms.lower.underside_z_mm.min(self.camera_back_z_mm());
        [DVec3::new(-half.x, -half.y, bottom_mm), DVec3::new(half.x, half.y, top_mm)]
    }

    /// Camera matrix of the undistorted frame: the raw frame's size and principal point, and the focal
    /// length that shows `mask_field_angle_deg` at the mask's edge.
    pub fn undistorted_matrix(&self) -> [[f64; 3]; 3] {
        let runtime = &self.sections.runtime;
        let focal_px = runtime.mask_radius_px / runtime.mask_field_angle_deg.to_radians().tan();
        let [[_, _, cx], [_, _, cy], _] = self.sections.camera.matrix;
        [[focal_px, 0.0, cx], [0.0, focal_px, cy], [0.0, 0.0, 1.0]]
    }
}

/// `sensor_from_camera` as the design file defines it: Rz(c) Ry(b) Rx(a), and the pupil's place.
pub(super) fn sensor_from_camera(camera: &CameraSection) -> Rigid {
    let [a, b, c] = camera.rotation_deg.map(f64::to_radians);
    let rotation = DMat3::from_rotation_z(c) * DMat3::from_rotation_y(b) * DMat3::from_rotation_x(a);
    Rigid::new(rotation, DVec3::from_array(camera.position_mm))
}

/// Thickness of all flat layers but the one that fills the dome.
pub(super) fn sheet_thickness_mm(sections: &DesignFile) -> f64 {
    sections.optics.layers.iter().filter_map(|layer| layer.thickness_mm).sum()
}

/// The optics of a design.
pub(super) fn optics(
    camera: &CameraSection,
    optics: &OpticsSection,
    dome: &DomeSection,
) -> Result<SensorOptics, DesignError> {
    rules::layers(&optics.layers)?;
    rules::camera_below_sheet(camera, optics)?;
    let layers = optics.layers.iter().map(|layer| Layer {
        name: layer.name.clone(),
        index: layer.index.rgb(),
        thickness_mm: layer.thickness_mm,
    });
    let spec = OpticsSpec {
        lens: LensSpec {
            model: match camera.model {
                ModelName::Pinhole => Model::Pinhole,
                ModelName::BrownConrady => Model::BrownConrady,
                ModelName::KannalaBrandt => Model::KannalaBrandt,
            },
            width: camera.width,
            height: camera.height,
            matrix: camera.matrix,
            distortion: camera.distortion.clone(),
            field_of_view_rad: camera.field_of_view_deg.to_radians(),
            pupil_shift_mm: camera.pupil_shift_mm.clone(),
        },
        sensor_from_camera: sensor_from_camera(camera),
        layers: layers.collect(),
        dome_radius_mm: dome.radius_mm,
    };
    SensorOptics::new(&spec).map_err(|fault| {
        // the optics speak of their own inputs; the writer knows the fields of the file
        let field = match fault.field.split_once('.') {
            Some(("lens", rest)) => {
                format!("camera.{}", rest.replace("field_of_view_rad", "field_of_view_deg"))
            }
            _ if fault.field.starts_with("layers") => format!("optics.{}", fault.field),
            _ if fault.field == "dome_radius_mm" => "dome.radius_mm".to_owned(),
            _ => "camera.position_mm".to_owned(),
        };
        DesignError::at(field, fault.value, "the optics cannot be", fault.allowed)
    })
}

/// Checks the rules between fields and computes what follows from them.
pub(super) fn resolve(mut sections: DesignFile, text: &str) -> Result<Design, DesignError> {
    check_name(&sections.name)?;
    let optics = optics(&sections.camera, &sections.optics, &sections.dome)
        .map_err(|fault| beside(fault, &suspicions(&sections, None)))?;
    let suspicions = suspicions(&sections, Some(&optics));
    let warnings =
        field_of_view_warning(&sections.camera, &optics).into_iter().chain(suspicions.clone()).collect();
    let settings = Settings::of(&sections, &optics).map_err(|fault| beside(fault, &suspicions))?;
    sections.print.outline_tolerance_mm = Some(settings.outline_tolerance_mm.value);
    sections.mesh.chord_tolerance_mm = Some(settings.chord_tolerance_mm.value);
    sections.mesh.optical_chord_tolerance_mm = Some(settings.optical_chord_tolerance_mm.value);
    sections.tolerances.samples = Some(settings.samples.value);
    let design = Design { sections, text: text.to_owned(), optics, warnings, suspicions, settings };
    rules::check(&design).map_err(|fault| design.beside_suspicions(fault))?;
    Ok(design)
}

/// A fault with what else looks wrong: where it shows is often not where the mistake is. One mistake throws many
/// numbers out of proportion, so only the first suspicions are told.
fn beside(mut fault: DesignError, suspicions: &[DesignWarning]) -> DesignError {
    const MOST: usize = 2;
    for suspicion in suspicions.iter().take(MOST) {
        let told = format!("perhaps `{}`: {}", suspicion.field, suspicion.message);
        fault.help = Some(fault.help.map_or_else(|| told.clone(), |help| format!("{help}; {told}")));
    }
    fault
}

/// A field of view that the lens model cannot reach is said, with the fold that ends it.
fn field_of_view_warning(camera: &CameraSection, optics: &SensorOptics) -> Option<DesignWarning> {
    let wanted_deg = camera.field_of_view_deg / 2.0;
    let reached_deg = optics.lens().max_field_angle_rad().to_degrees();
    if reached_deg >= wanted_deg * (1.0 - 1e-9) {
        return None;
    }
    let fold = match optics.lens().fold_angle_rad() {
        Some(fold_rad) => format!("folds at {:.2} degrees of field angle", fold_rad.to_degrees()),
        None => "ends short of it".to_owned(),
    };
    Some(DesignWarning {
        field: "camera.distortion".into(),
        message: format!(
            "the lens model {fold}, but the field of view asks for {wanted_deg:.2} (half of \
             camera.field_of_view_deg); max_field_angle_rad is what can be reached, {:.4} rad = {reached_deg:.2} \
             degrees; a kannala_brandt calibration reaches further",
            optics.lens().max_field_angle_rad()
        ),
    })
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
