//! One sheet of flat layers seen by a central lens, stripped to what a pose needs: the same refraction as
//! `optics`, for points on the sheet's top only, with the derivative by the pose, in tens of nanoseconds.

use glam::{DMat3, DVec2, DVec3};

use crate::camera::Lens;
use crate::numeric::Rigid;
use crate::refraction::{RayLimit, SensorOptics};

/// Newton steps; each squares the error.
const MAX_CLIMB_STEPS: u32 = 40;
/// Newton steps for neighbours of a disc that is wide for its distance.
const WIDE_CLIMB_STEPS: u32 = 8;

/// The sensor as the pose solver sees it.
#[derive(Debug, Clone)]
pub(super) struct SheetView {
    lens: Lens,
    /// Index squared, index squared less one, thickness (mm) of each layer between air and dome.
    plates: Vec<[f64; 3]>,
    bottom_mm: f64,
    rest_from_camera: Rigid,
}

/// A ray in air to a point of the sheet's top.
#[derive(Debug, Clone, Copy)]
struct SheetRay {
    /// Tangent of the angle over the reach, 1/mm.
    tangent_per_mm: f64,
    /// Derivative of the tangent by the reach and by the air's thickness, 1/mm.
    by_reach: f64,
    by_air: f64,
}

/// A platform pose, from the sheet's side.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedSheet {
    rotation: DMat3,
    camera_from_sensor: DMat3,
    pupil: DVec3,
    air_mm: f64,
}

/// A direction that a pixel sees, and how pixels change with the direction there.
#[derive(Debug, Clone, Copy)]
pub(super) struct ObservedRay {
    ray: DVec3,
    rows: [DVec3; 2],
}

impl ObservedRay {
    /// The unit direction.
    pub fn ray(&self) -> DVec3 {
        self.ray
    }
}

impl SheetView {
    /// `None` where the shortcut does not hold: a lens whose pupil wanders.
    pub fn new(optics: &SensorOptics) -> Option<Self> {
        if !optics.lens().is_central() {
            return None;
        }
        let flat = optics.layers().iter().skip(1).filter_map(|layer| {
            let n = layer.index_for(optics.channel());
            layer.thickness_mm.filter(|d| *d > 0.0).map(|d| [n * n, (n - 1.0) * (n + 1.0), d])
        });
        let plates: Vec<[f64; 3]> = flat.collect();
        // Newton converges from below where no layer is thinner than air.
        if plates.iter().any(|[_, excess, _]| *excess < 0.0) {
            return None;
        }
        let bottom_mm = -plates.iter().map(|[_, _, d]| d).sum::<f64>();
        Some(Self {
            lens: optics.lens().clone(),
            plates,
            bottom_mm,
            rest_from_camera: *optics.rest_from_camera(),
        })
    }

    /// The camera as seen from a platform at this pose; `None` where it would be in the sheet.
    pub fn placed(&self, pose: &Rigid) -> Option<PlacedSheet> {
        let inverse = pose.rotation.transpose();
        let pupil = inverse * (self.rest_from_camera.translation_mm - pose.translation_mm);
        let air_mm = self.bottom_mm - pupil.z;
        let camera_from_sensor = self.rest_from_camera.rotation.transpose() * pose.rotation;
        (air_mm > 0.0).then_some(PlacedSheet { rotation: pose.rotation, camera_from_sensor, pupil, air_mm })
    }

    /// Tangent over reach near the axis, 1/mm: the first guess.
    pub fn paraxial_tangent_per_mm(&self, placed: &PlacedSheet) -> f64 {
        1.0 / (placed.air_mm + self.plates.iter().map(|[n2, _, d]| d / n2.sqrt()).sum::<f64>())
    }

    /// The direction that a pixel sees, with the pixel's derivative by it.
    pub fn observed_ray(&self, pixel: DVec2) -> Result<ObservedRay, RayLimit> {
        let ray = self.lens.unproject(pixel)?;
        let (_, m) = self.lens.project_with_jacobian(ray)?;
        let row = |i: usize| DVec3::new(m[(i, 0)], m[(i, 1)], m[(i, 2)]);
        Ok(ObservedRay { ray, rows: [row(0), row(1)] })
    }

    /// X(t) = air t + sum d t / sqrt(n^2 + (n^2 - 1) t^2) = reach, by Newton: X rises and is concave, so from
    /// anywhere the first step lands at or below the answer, and the others rise to it.
    fn air_ray(&self, air_mm: f64, reach_mm: f64, start: f64) -> Option<SheetRay> {
        let mut t = start;
        for _ in 0..MAX_CLIMB_STEPS {
            let t2 = t * t;
            let (mut by_t, mut slope) = (air_mm, air_mm);
            for [n2, excess, d] in &self.plates {
                let inverse = 1.0 / (n2 + excess * t2);
                let part = d * inverse.sqrt();
                by_t += part;
                slope += part * n2 * inverse;
            }
            let per_slope = 1.0 / slope;
            let step = (reach_mm - by_t * t) * per_slope;
            t = (t + step).max(0.0);
            // |X''|/X' <= 3/2 for indices from 1 up: what a step leaves is below its square, and the slope is
            // right to the step.
            if step * step <= 1e-15 * t || reach_mm == 0.0 {
                // On the axis the two meet: t / reach -> dt / dreach.
                let per_mm = if reach_mm > 0.0 { t / reach_mm } else { per_slope };
                return Some(SheetRay {
                    tangent_per_mm: per_mm,
                    by_reach: per_slope,
                    by_air: -t * per_slope,
                });
            }
        }
        None
    }

    /// Second and third derivative of the tangent by the reach, at a tangent: from those of X.
    fn higher_derivatives(&self, tangent: f64, by_reach: f64) -> [f64; 2] {
        let (mut second, mut third) = (0.0, 0.0);
        for [n2, excess, d] in &self.plates {
            let inverse = 1.0 / (n2 + excess * tangent * tangent);
            let scale = -3.0 * d * n2 * excess * inverse * inverse * inverse.sqrt();
            second += scale * tangent;
            third += scale * (n2 - 4.0 * excess * tangent * tangent) * inverse;
        }
        let s = by_reach;
        [-second * s * s * s, (3.0 * second * second * s - third) * s * s * s * s]
    }

    /// Exact pixels of a point on the sheet's top and of its neighbours there, at the given steps from it, and
    /// how far the point's pixel lies from the observed one to first order, px. `near` is a guess of the tangent
    /// over the reach, 1/mm.
    ///
    /// The neighbours' rays start from the point's own by Taylor's series and take the same number of Newton steps
    /// each, side by side: the series is right to the fourth power of step over distance, and each step squares that.
    pub fn pixels<const N: usize>(
        &self,
        placed: &PlacedSheet,
        point: DVec3,
        steps: [DVec2; N],
        observed: &ObservedRay,
        near: f64,
    ) -> Option<(DVec2, DVec2, [DVec2; N])> {
        let sideways = DVec2::new(point.x - placed.pupil.x, point.y - placed.pupil.y);
        let reach = sideways.length();
        let air = self.air_ray(placed.air_mm, reach, reach * near)?;
        let in_camera = |sideways: DVec2, per_mm: f64| {
            placed.camera_from_sensor * DVec3::new(sideways.x * per_mm, sideways.y * per_mm, 1.0)
        };
        let ray = in_camera(sideways, air.tangent_per_mm);
        let center = self.lens.project(ray).ok()?;
        let depth = ray.dot(observed.ray);
        let first_order = DVec2::from_array(observed.rows.map(|row| row.dot(ray) / depth));
        let tangent = reach * air.tangent_per_mm;
        let [second, third] = self.higher_derivatives(tangent, air.by_reach);
        let there = steps.map(|step| sideways + step);
        let far = there.map(DVec2::length);
        let mut tangents = far.map(|far| {
            let dr = far - reach;
            (tangent + dr * (air.by_reach + dr * (0.5 * second + dr * third / 6.0))).max(0.0)
        });
        let widest = steps.iter().map(|step| step.length_squared()).fold(0.0, f64::max);
        // Up to a tenth of the distance one step reaches rounding.
        let rounds = if widest < 0.01 * placed.air_mm * placed.air_mm { 1 } else { WIDE_CLIMB_STEPS };
        let mut slopes = [0.0; N];
        for _ in 0..rounds {
            let mut by_t = [placed.air_mm; N];
            slopes = [placed.air_mm; N];
            for [n2, excess, d] in &self.plates {
                for ((t, by_t), slope) in tangents.iter().zip(&mut by_t).zip(&mut slopes) {
                    let inverse = 1.0 / (n2 + excess * t * t);
                    let part = d * inverse.sqrt();
                    *by_t += part;
                    *slope += part * n2 * inverse;
                }
            }
            for (((t, far), by_t), slope) in tangents.iter_mut().zip(&far).zip(&by_t).zip(&slopes) {
                *t = (*t + (far - by_t * *t) / slope).max(0.0);
            }
        }
        let mut around = [DVec2::ZERO; N];
        let rays = there.iter().zip(&far).zip(&tangents).zip(&slopes);
        for (pixel, (((there, far), tangent), slope)) in around.iter_mut().zip(rays) {
            // On the axis the two meet: t / reach -> dt / dreach.
            let per_mm = if *far > 0.0 { tangent / far } else { 1.0 / slope };
            *pixel = self.lens.project(in_camera(*there, per_mm)).ok()?;
        }
        Some((center, first_order, around))
    }

    /// Where a point appears from the observed pixel, px to first order in that distance, and its derivative by
    /// a motion of the platform (v, w) after the pose, two rows of six. `near` is a guess of
    /// the tangent over the reach, 1/mm, and is replaced by the answer.
    pub fn offset(
        &self,
        placed: &PlacedSheet,
        point: DVec3,
        observed: &ObservedRay,
        near: &mut f64,
    ) -> Option<(DVec2, [[DVec3; 2]; 2])> {
        let sideways = DVec2::new(point.x - placed.pupil.x, point.y - placed.pupil.y);
        let reach = sideways.length();
        let air = self.air_ray(placed.air_mm, reach, reach * *near)?;
        *near = air.tangent_per_mm;
        let tangent = sideways * air.tangent_per_mm;
        let direction = DVec3::new(tangent.x, tangent.y, 1.0);
        let in_camera = placed.camera_from_sensor * direction;
        let depth = in_camera.dot(observed.ray);
        // Behind the plane that touches the observed ray the first order does not hold.
        if depth <= 0.1 * in_camera.length() {
            return None;
        }
        let pixels = observed.rows.map(|row| row.dot(in_camera) / depth);
        let along = if reach > 0.0 { sideways / reach } else { DVec2::ZERO };
        let (around, mix) = (air.tangent_per_mm, air.by_reach - air.tangent_per_mm);
        let seen = placed.rotation * direction;
        let camera_mm = self.rest_from_camera.translation_mm;
        let to_sensor = placed.camera_from_sensor.transpose();
        let motion = std::array::from_fn(|i| {
            // Derivative of the pixel by the direction, sensor axes.
            let q = to_sensor * ((observed.rows[i] - observed.ray * pixels[i]) / depth);
            let q_flat = DVec2::new(q.x, q.y);
            let radial = q_flat.dot(along);
            // The direction by the pupil's place, transposed onto q.
            let flat = q_flat * around + along * (mix * radial);
            let u = placed.rotation * DVec3::new(flat.x, flat.y, air.by_air * radial);
            [u, camera_mm.cross(u) + seen.cross(placed.rotation * q)]
        });
        Some((DVec2::from_array(pixels), motion))
    }
}
