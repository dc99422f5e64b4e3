//! The sensor that constants describe, ready to project, trace and find poses.

use glam::DVec3;

use super::model::Constants;
use domecast_optics::camera::{LensModel, LensSpec};
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::Marker;
use domecast_optics::{FlatLayer, OpticsSpec, SensorOptics};

impl Constants {
    /// What the optics are made from.
    ///
    /// The field of view is not in the constants: the lens is taken to end at `max_field_angle_rad`.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn optics_spec(&self) -> Result<OpticsSpec, String> {
        let camera = &self.camera;
        let model = LensModel::parse(&camera.model)
            .ok_or_else(|| format!("camera.model \"{}\" is not a lens model", camera.model))?;
        let camera_from_sensor = Rigid::from_rows_4x4(&camera.camera_from_sensor)
            .map_err(|error| format!("camera.camera_from_sensor: {error}"))?;
        let is_air = |name: &str| name == "air";
        let mut layers = self.optics.layers.as_slice();
        if let Some((first, rest)) = layers.split_first()
            && is_air(&first.name)
        {
            // The air gap is what the camera's place leaves.
            layers = rest;
        }
        let layer = |l: &super::LayerConstants| FlatLayer {
            name: l.name.clone(),
            index: l.index_rgb.unwrap_or([l.index; 3]),
            thickness_mm: l.thickness_mm,
        };
        Ok(OpticsSpec {
            lens: LensSpec {
                model,
                width: camera.width,
                height: camera.height,
                matrix: camera.matrix,
                distortion: camera.distortion.clone(),
                field_of_view_rad: 2.0 * camera.max_field_angle_rad,
                pupil_shift_mm: camera.pupil_shift_mm.clone(),
            },
            sensor_from_camera: camera_from_sensor.orthonormalized().inverse(),
            layers: layers.iter().map(layer).collect(),
            dome: self.optics.dome(),
        })
    }

    /// The optics at rest, for the reference channel.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn sensor(&self) -> Result<SensorOptics, String> {
        SensorOptics::new(&self.optics_spec()?).map_err(|error| error.to_string())
    }

    /// The white markers.
    pub fn markers(&self) -> Vec<Marker> {
        let marker = |m: &super::WhiteMarker| Marker {
            id: m.id as u32,
            position_mm: DVec3::from_array(m.position_mm),
            diameter_mm: m.diameter_mm,
        };
        self.white_markers.iter().map(marker).collect()
    }
}
