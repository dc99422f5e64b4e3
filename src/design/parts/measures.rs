//! The dimensions that the parts are made from, taken from the design once.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::poses::{Pose, poses};
use super::view::ViewCone;
use super::{Blueprint, Feature, PartError};
use crate::spec::Design;
use crate::spec::sections::{
    CameraBodySection, CouponSection, JigSection, LedsSection, MagnetPocketsSection, MagnetsSection,
    MouldSection, MountSection, PlatformsSection, ProcessSection, SheetSection, StencilSection,
};
use domecast_mesh::{Chord, Fit, Shape};
use domecast_optics::{DomeShape, SensorOptics};

/// Dimensions of a design as the parts need them. Heights are in the sensor
/// frame at rest.
#[derive(Debug, Clone)]
pub struct Measures {
    /// The platforms.
    pub platforms: PlatformsSection,
    /// The LEDs and their boards.
    pub leds: LedsSection,
    /// The magnets.
    pub magnets: MagnetsSection,
    /// Their pockets.
    pub pockets: MagnetPocketsSection,
    /// The sheet's outline.
    pub sheet: SheetSection,
    /// The mould.
    pub mould: MouldSection,
    /// How the upper platform stands on the lower one.
    pub mount: MountSection,
    /// The camera's housing.
    pub camera_body: CameraBodySection,
    /// Limits of the process.
    pub process: ProcessSection,
    /// Linear shrinkage of the elastomer, as a fraction.
    pub shrinkage: f64,
    /// Outer sides of the platforms, mm.
    pub outer_mm: DVec2,
    /// Sides of the sheet, mm.
    pub sheet_size_mm: DVec2,
    /// Thickness of all flat layers but the dome, mm.
    pub sheet_thickness_mm: f64,
    /// The elastomer's outer face.
    pub dome: DomeShape,
    /// Top of the lower platform, mm.
    pub lower_top_z_mm: f64,
    /// Where the springs stand.
    pub spring_axes_mm: Vec<DVec2>,
    /// Camera frame to sensor frame at rest.
    pub sensor_from_camera: DAffine3,
    /// What the camera must see through the upper platform.
    pub view: ViewCone,
    /// What it must see through the lower platform, about the pupil; `None` where it stands above it, or where the
    /// bore is wide enough.
    pub lower_view: Option<ViewCone>,
    /// Positions of the platform: rest first, then the travel, the claimed
    /// loads, and the corners of the load envelope.
    pub poses: Vec<Pose>,
    /// Lens, layers and dome at rest.
    pub optics: SensorOptics,
    /// Centres of the white markers on the sheet's top face, mm.
    pub markers_mm: Vec<DVec2>,
    /// Radius of a white marker, mm.
    pub marker_radius_mm: f64,
    /// Thickness of the membrane on the dome, mm.
    pub membrane_mm: f64,
    /// Room that the whole sensor may take, mm.
    pub envelope_mm: DVec3,
    /// Wire of the springs, mm.
    pub spring_wire_mm: f64,
    /// Outer diameter of the springs, mm.
    pub spring_outer_mm: f64,
    /// Active coils of the springs.
    pub spring_coils: f64,
    /// Length of the springs without load, mm.
    pub spring_length_mm: f64,
    /// The pad-print jig.
    pub jig: JigSection,
    /// The marker stencil.
    pub stencil: StencilSection,
    /// The fit coupon.
    pub coupon: CouponSection,
    /// Tolerance of ordinary faces.
    pub chord: Chord,
    /// Tolerance of the mould's cavity.
    pub optical_chord: Chord,
    /// How far a cutting tool reaches beyond the face that it opens, mm.
    pub overcut_mm: f64,
}

/// Pose of LED `i`: origin at the centre of its emitting face, x across the
/// board, y up the board, z out of the emitting face.
pub(super) fn platform_from_led(leds: &LedsSection, i: usize) -> DAffine3 {
    let azimuth_deg = leds.list.get(i).map_or(0.0, |led| led.azimuth_deg);
    let (sin, cos) = leds.tilt_deg.to_radians().sin_cos();
    let outward = polar(1.0, azimuth_deg).extend(0.0);
    // The board leans outwards with its top, so that the face looks up.
    let y = DVec3::Z * sin + outward * cos;
    let z = -outward * sin + DVec3::Z * cos;
    let center = (outward * leds.center_radius_mm).with_z(leds.center_z_mm);
    DAffine3 { matrix3: DMat3::from_cols(y.cross(z), y, z), translation: center }
}

/// What the camera must see through the lower platform, from its front to the top.
fn lower_view(design: &Design, poses: &[Pose], markers_mm: &[DVec2]) -> Result<Option<ViewCone>, PartError> {
    /// The view is narrow near the pupil; below this share of the way to the top no opening is cut for it.
    const LOW: f64 = 0.05;
    let sections = design.sections();
    let body = &sections.camera_body;
    let pupil_z = design.sensor_from_camera().translation_mm.z;
    let hood_mm = sections.platforms.lower.hood.map_or(f64::NEG_INFINITY, |hood| hood.rim_from_pupil_mm);
    let top = design.lower_top_z_mm().max(pupil_z + hood_mm);
    let low = (pupil_z + body.front_from_pupil_mm)
        .max(pupil_z + LOW * (top - pupil_z))
        .max(sections.platforms.lower.underside_z_mm);
    if low >= top {
        return Ok(None);
    }
    let view = ViewCone::below(
        design.optics(),
        sections.dome.shape().rim_radius_mm(),
        (markers_mm, 0.5 * sections.white_markers.diameter_mm),
        &poses.iter().map(|pose| pose.rest_from_platform).collect::<Vec<_>>(),
        (low, top),
        sections.platforms.window_margin_mm,
    )?;
    let bore_mm = 0.5 * body.diameter_mm + body.bore_clearance_mm;
    Ok((!view.is_within(bore_mm)).then_some(view))
}

/// A point in the plane from radius and azimuth.
pub(super) fn polar(radius_mm: f64, azimuth_deg: f64) -> DVec2 {
    radius_mm * DVec2::from_angle(azimuth_deg.to_radians())
}

impl Measures {
    /// Takes the measures of a design.
    ///
    /// # Errors
    /// [`PartError::View`] if the camera's view cannot be computed;
    /// [`PartError::Mesh`] for a chord tolerance that is none.
    pub fn of(design: &Design) -> Result<Self, PartError> {
        let sections = design.sections();
        let chord = |tolerance_mm: f64| {
            Chord::new(tolerance_mm).map_err(|error| PartError::Mesh { part: "mesh".into(), error })
        };
        let camera = design.sensor_from_camera();
        let poses = poses(design)?;
        let markers_mm: Vec<DVec2> = design.white_markers_mm().iter().map(|p| p.truncate()).collect();
        let view = ViewCone::over(
            design.optics(),
            sections.dome.shape().rim_radius_mm(),
            (&markers_mm, 0.5 * sections.white_markers.diameter_mm),
            &poses.iter().map(|pose| pose.rest_from_platform).collect::<Vec<_>>(),
            (sections.platforms.upper.underside_z_mm, design.sheet_underside_z_mm()),
            sections.platforms.window_margin_mm,
        )?;
        let lower_view = lower_view(design, &poses, &markers_mm)?;
        Ok(Self {
            platforms: sections.platforms.clone(),
            leds: sections.leds.clone(),
            magnets: sections.magnets.clone(),
            pockets: sections.magnet_pockets.clone(),
            sheet: sections.sheet.clone(),
            mould: sections.mould.clone(),
            mount: sections.mount.clone(),
            camera_body: sections.camera_body.clone(),
            process: sections.process.clone(),
            shrinkage: 0.01 * sections.elastomer.shrinkage_percent,
            outer_mm: DVec2::from_array(sections.platforms.outer_mm),
            sheet_size_mm: DVec2::from_array(sections.sheet.size_mm),
            sheet_thickness_mm: design.sheet_thickness_mm(),
            dome: sections.dome.shape(),
            lower_top_z_mm: design.lower_top_z_mm(),
            spring_axes_mm: design.springs_at_mm(),
            sensor_from_camera: DAffine3 { matrix3: camera.rotation, translation: camera.translation_mm },
            view,
            lower_view,
            poses,
            optics: design.optics().clone(),
            markers_mm,
            marker_radius_mm: 0.5 * sections.white_markers.diameter_mm,
            membrane_mm: sections.elastomer.membrane_thickness_mm,
            envelope_mm: DVec3::from_array(sections.envelope.size_mm),
            spring_wire_mm: sections.springs.wire_diameter_mm,
            spring_outer_mm: sections.springs.outer_diameter_mm,
            spring_coils: sections.springs.active_coils,
            spring_length_mm: sections.springs.free_length_mm,
            jig: sections.jig.clone(),
            stencil: sections.stencil.clone(),
            coupon: sections.coupon.clone(),
            chord: chord(design.settings().chord_tolerance_mm.value)?,
            optical_chord: chord(design.settings().optical_chord_tolerance_mm.value)?,
            // Any length will do that is not small against the part.
            overcut_mm: 0.05 * sections.platforms.outer_mm[0].max(sections.platforms.outer_mm[1]),
        })
    }

    /// Where the sheet lies, mm.
    pub fn seat_z_mm(&self) -> f64 {
        -self.sheet_thickness_mm
    }

    /// Top of the upper platform's rim, mm.
    pub fn upper_top_z_mm(&self) -> f64 {
        self.seat_z_mm() + self.platforms.upper.rim_height_mm
    }

    /// The camera's entrance pupil on the axis, mm.
    pub fn pupil_mm(&self) -> DVec3 {
        self.sensor_from_camera.translation
    }

    /// Height of the middle of the hood's rim, mm; `None` where there is no hood.
    pub fn hood_rim_z_mm(&self) -> Option<f64> {
        let hood = self.platforms.lower.hood?;
        Some(self.sensor_from_camera.transform_point3(DVec3::Z * hood.rim_from_pupil_mm).z)
    }

    /// Radius of the camera's bore, mm.
    pub fn bore_radius_mm(&self) -> f64 {
        0.5 * self.camera_body.diameter_mm + self.camera_body.bore_clearance_mm
    }

    /// Radius of the mould's cavity as printed: the silicone that shrinks to
    /// the dome, and the sealer round it.
    pub fn cavity_radius_mm(&self) -> f64 {
        self.dome.radius_mm() / (1.0 - self.shrinkage) + self.mould.sealer_thickness_mm
    }

    /// Height of the cavity's centre above the dome's flat face while it is cast, mm: the cast is larger than the dome
    /// by what it shrinks.
    pub fn cast_center_z_mm(&self) -> f64 {
        self.dome.center_z_mm() / (1.0 - self.shrinkage)
    }

    /// Radius of the mould's cavity in the parting plane, one sealer's thickness beyond the cast's flat face, mm.
    pub fn mouth_radius_mm(&self) -> f64 {
        let (radius, beyond) =
            (self.cavity_radius_mm(), self.cast_center_z_mm() + self.mould.sealer_thickness_mm);
        if beyond < 0.0 { ((radius - beyond) * (radius + beyond)).max(0.0).sqrt() } else { radius }
    }

    /// Radius of the cast's rim in the sealed cavity, mm.
    pub fn cast_rim_mm(&self) -> f64 {
        if self.dome.center_z_mm() < 0.0 {
            self.dome.rim_radius_mm() / (1.0 - self.shrinkage)
        } else {
            self.cavity_radius_mm() - self.mould.sealer_thickness_mm
        }
    }

    /// Axes of the mould's vents: just inside the rim of the sealed cavity.
    pub fn vent_axes_mm(&self) -> Vec<DVec2> {
        let vents = &self.mould.vents;
        let radius = self.cast_rim_mm() - vents.inset_mm - 0.5 * vents.diameter_mm;
        (0..vents.count)
            .map(|i| polar(radius, vents.first_azimuth_deg + 360.0 * f64::from(i) / f64::from(vents.count)))
            .collect()
    }

    /// Radius and depth of a magnet's pocket, mm.
    pub fn pocket_mm(&self) -> (f64, f64) {
        (
            0.5 * (self.magnets.diameter_mm + self.pockets.diameter_clearance_mm),
            self.magnets.thickness_mm + self.pockets.depth_clearance_mm,
        )
    }

    /// Pose of LED `i`: origin at the centre of its emitting face, x across
    /// the board, y up the board, z out of the emitting face.
    pub fn platform_from_led(&self, i: usize) -> DAffine3 {
        platform_from_led(&self.leds, i)
    }

    /// Cuts a pocket for a magnet at every spring into the face at
    /// `face_z_mm`, each with its push-out hole as far as `end_z_mm`, beyond
    /// the part.
    pub(super) fn cut_magnet_pockets(&self, b: &mut Blueprint, face_z_mm: f64, end_z_mm: f64) {
        let (radius, depth) = self.pocket_mm();
        let into = (end_z_mm - face_z_mm).signum();
        let cylinder = |radius: f64, from: f64, to: f64| {
            Shape::cylinder(radius, from.min(to), from.max(to), Fit::Outside)
        };
        for (i, axis) in self.spring_axes_mm.iter().enumerate() {
            let pocket = cylinder(radius, face_z_mm - into * self.overcut_mm, face_z_mm + into * depth);
            let feature = Feature::new("magnet pocket", "springs.places", pocket);
            b.cut.push(feature.numbered(i).at(axis.x, axis.y));
            let hole = 0.5 * self.pockets.push_out_diameter_mm;
            if hole > 0.0 {
                // From the middle of the pocket, so that no faces coincide.
                let shape = cylinder(hole, face_z_mm + into * 0.5 * depth, end_z_mm);
                let feature = Feature::new("push-out hole", "magnet_pockets.push_out_diameter_mm", shape);
                b.cut.push(feature.numbered(i).at(axis.x, axis.y));
                b.genus += 1;
            }
        }
    }
}
