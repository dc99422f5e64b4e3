//! Where points of the sensor appear: the chain of geometric effects that the plan uses.

use glam::{DVec2, DVec3};

use crate::SimError;
use crate::raster::settings::Geometry;
use crate::scene::Scene;
use domecast_design::DesignError;
use domecast_optics::camera::{Lens, LensModel, LensSpec};
use domecast_optics::numeric::Rigid;
use domecast_optics::{ColorChannel, OpticsSpec, RayLimit, SensorOptics};

/// The camera over sheet and dome, with the geometric effects that are used and without the others.
#[derive(Debug, Clone)]
pub struct Projector {
    geometry: Geometry,
    /// One for each colour that has its own rays; one for all without dispersion.
    optics: Vec<SensorOptics>,
}

/// An [`Projector`] at one pose of the platform.
#[derive(Debug, Clone)]
pub struct PlacedProjector {
    optics: Vec<SensorOptics>,
}

/// A point as a straight ray shows it: where it appears to be at rest, and the pupil's shift for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apparent {
    /// Place on the air's ray, sensor frame, mm.
    pub point_mm: DVec3,
    /// Pupil on the camera's axis, mm before the camera's origin.
    pub shift_mm: f64,
}

impl Projector {
    /// The eye of a scene's sensor with these effects.
    ///
    /// # Errors
    /// A sensor that cannot be without the effects that are left out (a pinhole that sees nothing).
    pub fn new(scene: &Scene, geometry: Geometry) -> Result<Self, SimError> {
        let real = scene.optics();
        let mut lens = real.lens().spec().clone();
        if !geometry.lens_distortion {
            lens = LensSpec { model: LensModel::Pinhole, distortion: Vec::new(), ..lens };
        }
        if !geometry.pupil_shift {
            lens.pupil_shift_mm.clear();
        }
        let mut spec = OpticsSpec { lens, ..real.spec() };
        if !geometry.refraction {
            spec.layers.iter_mut().for_each(|layer| layer.index = [1.0; 3]);
        }
        let green = SensorOptics::new(&spec).map_err(|fault| {
            DesignError::at(fault.field, fault.value, "the optics cannot be", fault.allowed)
        })?;
        let optics = if geometry.dispersion && scene.planes() == 3 {
            ColorChannel::ALL.iter().map(|channel| green.for_channel(*channel)).collect()
        } else {
            vec![green]
        };
        Ok(Self { geometry, optics })
    }

    /// The eye over the platform at a pose.
    ///
    /// # Errors
    /// A pose that puts the pupil into the sheet.
    pub fn at(&self, rest_from_platform: &Rigid) -> Result<PlacedProjector, SimError> {
        let place = |optics: &SensorOptics| {
            if !self.geometry.sheet_motion {
                return Ok(optics.clone());
            }
            optics.at_pose(rest_from_platform).map_err(|fault| {
                SimError::from(DesignError::at(
                    fault.field,
                    fault.value,
                    "the platform cannot be there",
                    fault.allowed,
                ))
            })
        };
        let optics = self.optics.iter().map(place).collect::<Result<_, _>>()?;
        Ok(PlacedProjector { optics })
    }

    /// Colours that have rays of their own: 1 or 3.
    pub fn channels(&self) -> usize {
        self.optics.len()
    }

    /// Which of them is the reference: green.
    pub fn reference(&self) -> usize {
        if self.optics.len() == 3 { ColorChannel::Green as usize } else { 0 }
    }

    /// Where a point appears at rest in a channel: where its ray in air crosses the sheet's normal through it.
    /// (For motions around that normal the apparent point moves with the point exactly.)
    ///
    /// # Errors
    /// The limit that the point is past.
    pub fn apparent(&self, channel: usize, point_mm: DVec3) -> Result<Apparent, RayLimit> {
        let optics = self.optics.get(channel).ok_or(RayLimit::Unreachable)?;
        let ray = optics.lens().unproject(optics.project(point_mm)?)?;
        let shift_mm = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray)).0;
        let pupil = optics.sensor_from_camera().point(DVec3::Z * shift_mm);
        let direction = optics.sensor_from_camera().vector(ray);
        let sideways = (point_mm - pupil).truncate();
        // On the axis every height gives the same ray; the paraxial one is that of a point beside it.
        let reach = sideways.length();
        if reach < BESIDE_AXIS_MM {
            let beside =
                self.apparent(channel, pupil.with_z(point_mm.z) + DVec3::X * (2.0 * BESIDE_AXIS_MM))?;
            let along = (beside.point_mm.z - pupil.z) / direction.z;
            return Ok(Apparent { point_mm: pupil + direction * along, shift_mm });
        }
        let along = reach / direction.truncate().length();
        Ok(Apparent { point_mm: pupil + direction * along, shift_mm })
    }
}

/// Nearer to the pupil's normal than this, the apparent height is taken from a point beside it, mm.
const BESIDE_AXIS_MM: f64 = 1e-3;

impl PlacedProjector {
    /// The optics of a channel (of the first, where the number is beyond them).
    pub fn optics(&self, channel: usize) -> Option<&SensorOptics> {
        self.optics.get(channel).or(self.optics.first())
    }

    /// Colours that have rays of their own.
    pub fn channels(&self) -> usize {
        self.optics.len()
    }

    /// The pixel of a point (sensor frame, mm) in a channel.
    ///
    /// # Errors
    /// The limit that the point is past.
    pub fn project(&self, channel: usize, point_mm: DVec3) -> Result<DVec2, RayLimit> {
        self.optics(channel).ok_or(RayLimit::Unreachable)?.project(point_mm)
    }

    /// The pixel of a point of the deformed dome.
    ///
    /// # Errors
    /// The limit that the point is past.
    pub fn project_deformed(&self, channel: usize, point_mm: DVec3) -> Result<DVec2, RayLimit> {
        self.optics(channel).ok_or(RayLimit::Unreachable)?.project_deformed(point_mm)
    }

    /// The pixel of an apparent point in a channel: one rigid motion and the lens.
    ///
    /// # Errors
    /// The limit that the ray is past.
    pub fn project_apparent(&self, channel: usize, apparent: &Apparent) -> Result<DVec2, RayLimit> {
        let optics = self.optics(channel).ok_or(RayLimit::Unreachable)?;
        let camera = optics.sensor_from_camera();
        let ray = camera.rotation.transpose() * (apparent.point_mm - camera.translation_mm)
            - DVec3::Z * apparent.shift_mm;
        Ok(optics.lens().project(ray)?)
    }
}
