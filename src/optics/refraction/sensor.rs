//! The camera under the sheet under the dome.

use std::sync::Arc;

use glam::DVec3;

use super::dome::DomeShape;
use super::spec::{ColorChannel, FlatLayer, OpticsError, OpticsSpec};
use super::stack::Plate;
use crate::camera::Lens;
use crate::numeric::Rigid;

/// Lens, layers and dome, at one pose of the platform and for one channel.
#[derive(Debug, Clone)]
pub struct SensorOptics {
    pub(super) lens: Arc<Lens>,
    channel: ColorChannel,
    pub(super) rest_from_camera: Rigid,
    pub(super) sensor_from_camera: Rigid,
    layers: Vec<FlatLayer>,
    pub(super) plates: Vec<Plate>,
    pub(super) fill: Plate,
    pub(super) bottom_mm: f64,
    pub(super) dome: DomeShape,
}

impl SensorOptics {
    /// The sensor at rest, for the reference channel (green).
    ///
    /// # Errors
    /// The first field that cannot be used; a pupil above the sheet's lower
    /// face.
    pub fn new(spec: &OpticsSpec) -> Result<Self, OpticsError> {
        spec.check()?;
        Self::assemble(spec, Arc::new(Lens::new(spec.lens.clone())?))
    }

    /// As [`SensorOptics::new`], with this sensor's lens, which takes the longest to prepare, where it is the same.
    ///
    /// # Errors
    /// As [`SensorOptics::new`].
    pub fn rebuilt(&self, spec: &OpticsSpec) -> Result<Self, OpticsError> {
        if spec.lens != *self.lens.spec() {
            return Self::new(spec);
        }
        spec.check()?;
        Self::assemble(spec, Arc::clone(&self.lens))
    }

    fn assemble(spec: &OpticsSpec, lens: Arc<Lens>) -> Result<Self, OpticsError> {
        let sheet = &spec.layers[..spec.layers.len() - 1];
        let bottom_mm = -sheet.iter().filter_map(|l| l.thickness_mm).sum::<f64>();
        let air = FlatLayer { name: "air".to_owned(), index: [1.0; 3], thickness_mm: None };
        let mut layers = vec![air];
        layers.extend_from_slice(&spec.layers);
        let rest_from_camera = spec.sensor_from_camera.orthonormalized();
        let optics = Self {
            lens,
            channel: ColorChannel::Green,
            rest_from_camera,
            sensor_from_camera: rest_from_camera,
            layers,
            plates: Vec::new(),
            fill: Plate::new(1.0, 0.0),
            bottom_mm,
            dome: spec.dome,
        };
        let mut optics = optics.for_channel(ColorChannel::Green);
        optics.place(rest_from_camera)?;
        Ok(optics)
    }

    fn place(&mut self, sensor_from_camera: Rigid) -> Result<(), OpticsError> {
        let height = sensor_from_camera.translation_mm.z;
        let air_mm = self.bottom_mm - height;
        // One part in 1e12 of the lengths involved is rounding, not a place.
        let rounding = 1e-12 * height.abs().max(self.bottom_mm.abs());
        if air_mm.is_nan() || air_mm < -rounding {
            return Err(OpticsError::new(
                "camera.position_mm[2]",
                height,
                format!("the pupil must not be above the sheet's lower face at z = {} mm", self.bottom_mm),
            ));
        }
        self.sensor_from_camera = sensor_from_camera;
        if air_mm < 0.0 {
            self.sensor_from_camera.translation_mm.z = self.bottom_mm;
        }
        self.layers[0].thickness_mm = Some(self.air_gap_mm());
        Ok(())
    }

    /// The same sensor after the platform, with sheet and dome, has moved; the
    /// camera stays. The pose is taken from rest, not from the present one.
    ///
    /// # Errors
    /// A pose that is not rigid, or one that puts the pupil into the sheet.
    pub fn at_pose(&self, rest_from_platform: &Rigid) -> Result<Self, OpticsError> {
        let mut other = self.clone();
        other.move_to(rest_from_platform)?;
        Ok(other)
    }

    /// [`SensorOptics::at_pose`] in place, which allocates nothing; after an error the sensor is where it was.
    ///
    /// # Errors
    /// As [`SensorOptics::at_pose`].
    pub fn move_to(&mut self, rest_from_platform: &Rigid) -> Result<(), OpticsError> {
        rest_from_platform
            .check()
            .map_err(|error| OpticsError::new("rest_from_platform", "not rigid", error.to_string()))?;
        let platform_from_rest = rest_from_platform.orthonormalized().inverse();
        self.place(platform_from_rest.compose(&self.rest_from_camera))
    }

    /// The same sensor as another colour channel sees it.
    pub fn for_channel(&self, channel: ColorChannel) -> Self {
        let mut other = self.clone();
        other.channel = channel;
        let last = self.layers.len() - 1;
        other.plates = self.layers[1..last]
            .iter()
            .map(|layer| Plate::new(layer.index_for(channel), layer.thickness_mm.unwrap_or(0.0)))
            .collect();
        other.fill = Plate::new(self.layers[last].index_for(channel), 0.0);
        other
    }

    /// The channel that the indices are for.
    pub fn channel(&self) -> ColorChannel {
        self.channel
    }

    /// What the sensor was made from: to make another that differs in one thing.
    pub fn spec(&self) -> OpticsSpec {
        OpticsSpec {
            lens: self.lens.spec().clone(),
            sensor_from_camera: self.rest_from_camera,
            // the air is what the camera's place leaves
            layers: self.layers.iter().skip(1).cloned().collect(),
            dome: self.dome,
        }
    }

    /// The lens.
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Camera frame to sensor frame at the present pose.
    pub fn sensor_from_camera(&self) -> &Rigid {
        &self.sensor_from_camera
    }

    /// Camera frame to sensor frame at rest.
    pub fn rest_from_camera(&self) -> &Rigid {
        &self.rest_from_camera
    }

    /// Air between the pupil (on the axis) and the sheet's lower face, along
    /// the sheet's normal, at the present pose, millimetres.
    pub fn air_gap_mm(&self) -> f64 {
        self.bottom_mm - self.sensor_from_camera.translation_mm.z
    }

    /// All layers from the camera outwards, the air first with its present
    /// thickness, the medium of the dome last.
    pub fn layers(&self) -> &[FlatLayer] {
        &self.layers
    }

    /// The dome's outer face.
    pub fn dome(&self) -> &DomeShape {
        &self.dome
    }

    /// Radius of the dome's sphere, millimetres.
    pub fn dome_radius_mm(&self) -> f64 {
        self.dome.radius_mm()
    }

    /// The entrance pupil of a ray with this field angle, sensor frame.
    pub(super) fn pupil_mm(&self, shift_mm: f64) -> DVec3 {
        self.sensor_from_camera.translation_mm + self.sensor_from_camera.rotation.z_axis * shift_mm
    }
}
