//! A design in which every rule holds, and what follows from several of its sections.

use glam::{DMat3, DVec2, DVec3};

use super::derive::DerivedField;
use super::error::DesignError;
use super::sections::{CameraSection, DesignFile, SpringPlaces};
use super::settings::Settings;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

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
    pub(super) sections: DesignFile,
    pub(super) text: String,
    pub(super) optics: SensorOptics,
    pub(super) warnings: Vec<DesignWarning>,
    pub(super) notes: Vec<String>,
    pub(super) lints: Vec<DesignWarning>,
    pub(super) settings: Settings,
    pub(super) derived: Vec<DerivedField>,
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

    /// Facts about the design that ask its maker for nothing.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// A fault found later, with the design's lints as help.
    pub fn with_lints(&self, fault: DesignError) -> DesignError {
        with_lints(fault, &self.lints)
    }

    /// The settings that trade time for exactness, given or chosen.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The fields that the file leaves out, each with the value that its rule gives.
    pub fn derived(&self) -> &[DerivedField] {
        &self.derived
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

    /// Whether the upper platform stands on posts, and no net wrench is promised.
    pub fn is_rigid(&self) -> bool {
        self.sections.mount.is_rigid()
    }

    /// Height of the lower platform's top at rest: one free spring length below the upper platform, or the height of a
    /// rigid mount's posts, mm.
    pub fn lower_top_z_mm(&self) -> f64 {
        let mount = &self.sections.mount;
        let gap_mm = if mount.is_rigid() { mount.height_mm } else { self.sections.springs.free_length_mm };
        self.sections.platforms.upper.underside_z_mm - gap_mm
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

    /// Height of the camera's back on its axis, mm; of a board that of what stands on its back.
    pub fn camera_back_z_mm(&self) -> f64 {
        let body = &self.sections.camera_body;
        let board_mm = body.board.as_ref().map_or(0.0, |b| b.thickness_mm + b.components_height_mm);
        self.sections.camera.position_mm[2] + body.front_from_pupil_mm - body.length_mm - board_mm
    }

    /// Lowest and highest corner of the whole sensor at rest, mm.
    pub fn bounds_mm(&self) -> [DVec3; 2] {
        let sections = &self.sections;
        let half = DVec2::from_array(sections.platforms.outer_mm) / 2.0;
        let top_mm = sections.dome.shape().height_mm() + sections.elastomer.membrane_thickness_mm;
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

/// A fault with the first lints as help: where a fault shows is often not where the mistake is. One mistake puts many
/// numbers out of proportion, so two are enough.
pub(super) fn with_lints(mut fault: DesignError, lints: &[DesignWarning]) -> DesignError {
    const MAX_SHOWN: usize = 2;
    for lint in lints.iter().take(MAX_SHOWN) {
        let help = format!("perhaps `{}`: {}", lint.field, lint.message);
        fault.help = Some(fault.help.map_or_else(|| help.clone(), |before| format!("{before}; {help}")));
    }
    fault
}
