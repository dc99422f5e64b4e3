//! The camera under the sheet under the dome.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::stack::{MAX_CLIMB_STEPS, Path, Plate, travel};
use super::{Channel, Layer, Limit, OpticsError, OpticsSpec};
use crate::camera::Lens;
use crate::numeric::batch::{fill, fill_runs};
use crate::numeric::{LengthMismatch, MAX_ITERATIONS, Rigid, RootError, bracketed_newton};

/// Rounding slack at the dome's rim, relative to its radius: a ray that meets
/// the sheet's top this little outside the base circle still meets the rim.
const RIM_ROUNDING: f64 = 1e-11;

/// Rays that are kept between the lens and the layers.
const TRACE_RUN: usize = 64;

/// How far outside the dome, relative to its radius, a point may be and still
/// be on it: what a file with seven digits says of a surface point.
const ON_DOME_TOLERANCE: f64 = 1e-6;

/// Where a pixel's chief ray meets the dome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The pixel.
    pub pixel: DVec2,
    /// The point on the dome, sensor frame, millimetres.
    pub surface_mm: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// Angle of the ray in air to the camera's axis, radians.
    pub field_angle_rad: f64,
}

/// Where a point is seen, and how that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolvedPixel {
    /// The pixel.
    pub pixel: DVec2,
    /// Newton steps of the climb through the layers, at most
    /// [`SensorOptics::MAX_CLIMB_ITERATIONS`].
    pub climb_iterations: u32,
    /// Steps to the place of the entrance pupil, at most
    /// [`SensorOptics::MAX_PUPIL_ITERATIONS`]; each is a climb of its own. Zero
    /// for a central lens.
    pub pupil_iterations: u32,
    /// By how much the ray misses the point, in millimetres along the sheet.
    pub residual_mm: f64,
}

/// A ray's way to the dome, sensor frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    /// Unit direction in air.
    pub direction: DVec3,
    /// Air in its way, along the normal.
    pub gap_mm: f64,
    /// Unit direction in the dome.
    pub inside: DVec3,
    /// Length of the way in the dome.
    pub inside_mm: f64,
    /// Where it meets the dome.
    pub point: DVec3,
}

/// Lens, layers and dome, at one pose of the platform and for one channel.
#[derive(Debug, Clone)]
pub struct SensorOptics {
    pub(super) lens: Arc<Lens>,
    channel: Channel,
    pub(super) rest_from_camera: Rigid,
    pub(super) sensor_from_camera: Rigid,
    layers: Vec<Layer>,
    pub(super) plates: Vec<Plate>,
    pub(super) fill: Plate,
    pub(super) bottom_mm: f64,
    pub(super) dome_radius_mm: f64,
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
        let air = Layer { name: "air".to_owned(), index: [1.0; 3], thickness_mm: None };
        let mut layers = vec![air];
        layers.extend_from_slice(&spec.layers);
        let rest_from_camera = spec.sensor_from_camera.orthonormalized();
        let optics = Self {
            lens,
            channel: Channel::Green,
            rest_from_camera,
            sensor_from_camera: rest_from_camera,
            layers,
            plates: Vec::new(),
            fill: Plate::new(1.0, 0.0),
            bottom_mm,
            dome_radius_mm: spec.dome_radius_mm,
        };
        let mut optics = optics.for_channel(Channel::Green);
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
    pub fn for_channel(&self, channel: Channel) -> Self {
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
    pub fn channel(&self) -> Channel {
        self.channel
    }

    /// What the sensor was made from: to make another that differs in one thing.
    pub fn spec(&self) -> OpticsSpec {
        OpticsSpec {
            lens: self.lens.spec().clone(),
            sensor_from_camera: self.rest_from_camera,
            // the air is what the camera's place leaves
            layers: self.layers.iter().skip(1).cloned().collect(),
            dome_radius_mm: self.dome_radius_mm,
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
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Radius of the dome, millimetres.
    pub fn dome_radius_mm(&self) -> f64 {
        self.dome_radius_mm
    }

    /// The entrance pupil of a ray with this field angle, sensor frame.
    pub(super) fn pupil_mm(&self, shift_mm: f64) -> DVec3 {
        self.sensor_from_camera.translation_mm + self.sensor_from_camera.rotation.z_axis * shift_mm
    }

    /// Where the chief ray of a pixel meets the dome.
    ///
    /// # Errors
    /// The limit that the pixel is past.
    pub fn trace(&self, pixel: DVec2) -> Result<SurfacePoint, Limit> {
        self.trace_ray(pixel, self.lens.unproject(pixel)?)
    }

    #[inline]
    fn trace_ray(&self, pixel: DVec2, ray: DVec3) -> Result<SurfacePoint, Limit> {
        let field_angle_rad = Lens::field_angle_of_unit_rad(ray);
        let hit = self.meet(ray, field_angle_rad)?;
        Ok(self.surface_point(pixel, field_angle_rad, &hit))
    }

    /// Where a pixel's chief ray meets the dome, and its unit direction inside, away from the camera. Here the sphere goes on
    /// below the dome's base: a ray that comes up beside the base is followed back to it. What lies on
    /// the dome then goes on smoothly for a way beyond its outline in the image.
    ///
    /// # Errors
    /// As `trace`, less the rays that pass the base but not the sphere.
    #[inline]
    pub fn trace_continued(&self, pixel: DVec2) -> Result<(DVec3, DVec3), Limit> {
        self.follow_continued(self.lens.unproject(pixel)?)
    }

    /// [`SensorOptics::trace_continued`] from the unit direction that the pixel sees, camera frame
    /// ([`Lens::unproject`]).
    ///
    /// # Errors
    /// As `trace_continued`, less the lens's.
    #[inline]
    pub fn follow_continued(&self, ray: DVec3) -> Result<(DVec3, DVec3), Limit> {
        // Only a pupil that moves asks for the angle.
        let field_angle_rad = if self.lens.is_central() { 0.0 } else { Lens::field_angle_rad(ray) };
        let (hit, _) = self.meet_sphere(ray, field_angle_rad)?;
        Ok((hit.point, hit.inside))
    }

    pub(super) fn surface_point(&self, pixel: DVec2, field_angle_rad: f64, hit: &Hit) -> SurfacePoint {
        SurfacePoint {
            pixel,
            surface_mm: hit.point,
            normal: hit.point / self.dome_radius_mm,
            field_angle_rad,
        }
    }

    /// A ray of the camera, through the layers and on to the dome.
    #[inline]
    pub(super) fn meet(&self, ray: DVec3, field_angle_rad: f64) -> Result<Hit, Limit> {
        match self.meet_sphere(ray, field_angle_rad)? {
            (hit, false) => Ok(hit),
            (_, true) => Err(Limit::MissesDome),
        }
    }

    /// [`Self::meet`]; a ray that comes up beside the dome's base is followed back to the sphere below, and said to be
    /// so.
    #[inline]
    fn meet_sphere(&self, ray: DVec3, field_angle_rad: f64) -> Result<(Hit, bool), Limit> {
        let direction = self.sensor_from_camera.vector(ray);
        let origin = if self.lens.is_central() {
            self.sensor_from_camera.translation_mm
        } else {
            self.pupil_mm(self.lens.pupil_shift_mm(field_angle_rad).0)
        };
        let gap_mm = self.bottom_mm - origin.z;
        if gap_mm < 0.0 {
            return Err(Limit::PupilInsideSheet);
        }
        if direction.z <= 0.0 {
            return Err(Limit::MissesDome);
        }
        let p = DVec2::new(direction.x, direction.y);
        let base =
            DVec2::new(origin.x, origin.y) + p * (gap_mm / direction.z + travel(&self.plates, direction.z));
        let radius = self.dome_radius_mm;
        let distance = base.length();
        // From a ray so grazing that its travel overflowed.
        if !distance.is_finite() {
            return Err(Limit::MissesDome);
        }
        let beside = distance > radius * (1.0 + RIM_ROUNDING);
        let n = self.fill.index;
        let up = (self.fill.excess + direction.z * direction.z).sqrt() / n;
        let sideways = p / n;
        // |base + s (sideways, up)| = radius: s^2 + 2 b s - c = 0.
        let b = base.dot(sideways);
        let mut c = (radius - distance) * (radius + distance);
        if !beside {
            c = c.max(0.0);
        } else if b <= 0.0 || b * b + c <= 0.0 {
            return Err(Limit::MissesDome);
        }
        let root = (b * b + c).sqrt();
        // The root that does not cancel.
        let s = if b > 0.0 { c / (b + root) } else { root - b };
        let flat = base + sideways * s;
        let point = DVec3::new(flat.x, flat.y, up * s);
        let hit = Hit {
            direction,
            gap_mm,
            inside: DVec3::new(sideways.x, sideways.y, up),
            inside_mm: s,
            // Onto the sphere to the last bit that the arithmetic has.
            point: point * (radius / point.length()),
        };
        Ok((hit, beside))
    }

    /// The pixel that sees a point of the sensor frame (millimetres): on the
    /// dome, inside it, or on or under the sheet's top, where it may lie beside
    /// the dome.
    ///
    /// # Errors
    /// The limit that the point is past.
    pub fn project(&self, point_mm: DVec3) -> Result<DVec2, Limit> {
        Ok(self.lens.project(self.chief_ray(point_mm)?)?)
    }

    /// [`SensorOptics::project`] for a point of a dome that is out of shape: the medium is taken to reach as far as
    /// the point, also where it bulges past the undeformed dome.
    ///
    /// # Errors
    /// As `project`, but never [`Limit::OutsideDome`].
    pub fn project_deformed(&self, point_mm: DVec3) -> Result<DVec2, Limit> {
        if !point_mm.is_finite() {
            return Err(Limit::NotFinite);
        }
        let (pupil, _) = self.chief_pupil(point_mm)?;
        Ok(self.lens.project(self.central_ray(point_mm, pupil)?)?)
    }

    /// No climb through the layers takes more steps.
    pub const MAX_CLIMB_ITERATIONS: u32 = MAX_CLIMB_STEPS;

    /// No search for the place of the entrance pupil takes more steps.
    pub const MAX_PUPIL_ITERATIONS: u32 = MAX_ITERATIONS;

    /// [`SensorOptics::project`] and how it was found.
    ///
    /// # Errors
    /// As `project`.
    pub fn project_solved(&self, point_mm: DVec3) -> Result<SolvedPixel, Limit> {
        let point = self.usable_point(point_mm)?;
        let (pupil, pupil_iterations) = self.chief_pupil(point)?;
        let pixel = self.lens.project(self.central_ray(point, pupil)?)?;
        let reach_mm = DVec2::new(point.x - pupil.x, point.y - pupil.y).length();
        let (climb_iterations, residual_mm) = self.path(point, pupil)?.climb_record(reach_mm)?;
        Ok(SolvedPixel { pixel, climb_iterations, pupil_iterations, residual_mm })
    }

    /// [`SensorOptics::trace`] for each pixel, written to the place of the same
    /// number; see [`crate::numeric::batch::fill`].
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn trace_all(
        &self,
        pixels: &[DVec2],
        hits: &mut [Result<SurfacePoint, Limit>],
    ) -> Result<(), LengthMismatch> {
        fill_runs(pixels, hits, |pixels, hits| {
            let mut rays = [Ok(DVec3::Z); TRACE_RUN];
            for (pixels, hits) in pixels.chunks(TRACE_RUN).zip(hits.chunks_mut(TRACE_RUN)) {
                let rays = &mut rays[..pixels.len()];
                self.lens.unproject_run(pixels, rays);
                for ((hit, &pixel), &ray) in hits.iter_mut().zip(pixels).zip(&*rays) {
                    *hit = ray.map_err(Limit::from).and_then(|ray| self.trace_ray(pixel, ray));
                }
            }
        })
    }

    /// [`SensorOptics::project`] for each point.
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn project_all(
        &self,
        points_mm: &[DVec3],
        pixels: &mut [Result<DVec2, Limit>],
    ) -> Result<(), LengthMismatch> {
        fill(points_mm, pixels, |&point| self.project(point))
    }

    /// Direction in air, camera frame, of the ray through a point.
    fn chief_ray(&self, point_mm: DVec3) -> Result<DVec3, Limit> {
        let point = self.usable_point(point_mm)?;
        let (pupil, _) = self.chief_pupil(point)?;
        self.central_ray(point, pupil)
    }

    /// The entrance pupil of the ray through a usable point, sensor frame, and
    /// the steps that it took.
    pub(super) fn chief_pupil(&self, point: DVec3) -> Result<(DVec3, u32), Limit> {
        if self.lens.is_central() {
            return Ok((self.sensor_from_camera.translation_mm, 0));
        }
        // The pupil's shift S(theta) must be the one that belongs to the field
        // angle of the ray from there: seen(S(theta)) = theta. The left side
        // starts above the right one at zero and, if the point is inside the
        // domain, ends below; the difference falls at a slope near -1.
        let end = self.lens.max_field_angle_rad();
        let shift_at = |theta: f64| self.lens.pupil_shift_mm(theta).0;
        let seen = |theta: f64| self.seen_angle_rad(point, shift_at(theta));
        let (mut theta, mut steps) = (end, 0);
        if seen(end) < end {
            let mismatch = |theta: f64| (seen(theta) - theta, -1.0);
            let root =
                bracketed_newton(mismatch, 0.0, end, seen(0.0).min(end)).map_err(|error| match error {
                    RootError::NotFinite { .. } => Limit::NotFinite,
                    _ => Limit::NotConverged,
                })?;
            (theta, steps) = (root.value, root.iterations);
        }
        let pupil = self.pupil_mm(shift_at(theta));
        if pupil.z > self.bottom_mm { Err(Limit::PupilInsideSheet) } else { Ok((pupil, steps)) }
    }

    /// Field angle at which a point is seen from a shifted pupil. A pupil that
    /// would be in the sheet counts as touching it; a point past the critical
    /// angle, or not in front, is seen along the sheet.
    fn seen_angle_rad(&self, point: DVec3, shift_mm: f64) -> f64 {
        let mut pupil = self.pupil_mm(shift_mm);
        pupil.z = pupil.z.min(self.bottom_mm);
        let ray = self.central_ray(point, pupil).unwrap_or_else(|_| {
            let along = DVec3::new(point.x - pupil.x, point.y - pupil.y, 0.0);
            self.sensor_from_camera.rotation.transpose() * along
        });
        Lens::field_angle_rad(ray)
    }

    pub(super) fn usable_point(&self, point: DVec3) -> Result<DVec3, Limit> {
        if !point.is_finite() {
            return Err(Limit::NotFinite);
        }
        let slack = ON_DOME_TOLERANCE * self.dome_radius_mm;
        // Above the top, one has to be in the dome.
        if point.z <= 0.0 || point.length() <= self.dome_radius_mm + slack {
            Ok(point)
        } else if point.z <= slack {
            Ok(DVec3::new(point.x, point.y, 0.0))
        } else {
            Err(Limit::OutsideDome)
        }
    }

    /// The layers between a pupil and a point.
    pub(super) fn path(&self, point: DVec3, pupil: DVec3) -> Result<Path<'_>, Limit> {
        if point.z <= pupil.z {
            return Err(Limit::BehindCamera);
        }
        Ok(Path {
            air_mm: self.bottom_mm.min(point.z) - pupil.z,
            plates: &self.plates,
            spared_mm: (-point.z).clamp(0.0, -self.bottom_mm),
            fill: Plate { thickness_mm: point.z.max(0.0), ..self.fill },
        })
    }

    /// Direction in air, camera frame, of the ray from a point to a pupil.
    fn central_ray(&self, point: DVec3, pupil: DVec3) -> Result<DVec3, Limit> {
        let sideways = DVec2::new(point.x - pupil.x, point.y - pupil.y);
        let per_mm = self.path(point, pupil)?.tangent_per_mm(sideways.length())?;
        let tangent = sideways * per_mm;
        let direction = DVec3::new(tangent.x, tangent.y, 1.0);
        Ok(self.sensor_from_camera.rotation.transpose() * direction)
    }
}
