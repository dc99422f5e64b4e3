//! The sensor again: rays through the layers to the dome and back, bisected, in double-double.

use domecast::optics::OpticsSpec;

use super::dd::{Dd, dd};
use super::reference_lens::{Lens, V3, dot, field_angle, rising_root, v3};

pub struct Sensor<'a> {
    pub lens: Lens<'a>,
    rotation: [V3; 3],
    position: V3,
    sheet: Vec<(Dd, Dd)>,
    fill: Dd,
    bottom: Dd,
    radius: f64,
}

impl<'a> Sensor<'a> {
    /// Pose and air gap are the crate's own: a sum of thicknesses is rounded,
    /// and whether the pupil touches the sheet is decided there once.
    pub fn new(spec: &'a OpticsSpec, optics: &domecast::optics::SensorOptics) -> Self {
        let (pose, channel) = (optics.sensor_from_camera(), optics.channel());
        let r = pose.rotation;
        let (last, sheet) = spec.layers.split_last().unwrap();
        let sheet: Vec<(Dd, Dd)> =
            sheet.iter().map(|l| (dd(l.index_for(channel)), dd(l.thickness_mm.unwrap()))).collect();
        let bottom = dd(pose.translation_mm.z) + dd(optics.air_gap_mm());
        Self {
            lens: Lens::new(&spec.lens),
            rotation: [v3(r.x_axis), v3(r.y_axis), v3(r.z_axis)],
            position: v3(pose.translation_mm),
            sheet,
            fill: dd(last.index_for(channel)),
            bottom,
            radius: spec.dome.radius_mm(),
        }
    }

    fn turn(&self, v: V3) -> V3 {
        std::array::from_fn(|i| {
            self.rotation[0][i] * v[0] + self.rotation[1][i] * v[1] + self.rotation[2][i] * v[2]
        })
    }

    fn turn_back(&self, v: V3) -> V3 {
        self.rotation.map(|axis| dot(axis, v))
    }

    fn pupil(&self, shift: Dd) -> V3 {
        std::array::from_fn(|i| self.position[i] + self.rotation[2][i] * shift)
    }

    /// Where a camera ray meets the dome; the distance of its base point from
    /// the axis stands beside it. `None` when it misses.
    pub fn surface(&self, ray: V3) -> (Option<V3>, f64) {
        let d = self.turn(ray);
        let origin = self.pupil(self.lens.shift(field_angle(ray)));
        if d[2].hi <= 0.0 {
            return (None, f64::INFINITY);
        }
        let sideways = d[0] * d[0] + d[1] * d[1];
        let along = |n: Dd| (n * n - sideways).sqrt();
        let mut per = (self.bottom - origin[2]) / d[2];
        for &(n, thickness) in &self.sheet {
            if thickness.hi > 0.0 {
                per = per + thickness / along(n);
            }
        }
        let (x, y) = (origin[0] + d[0] * per, origin[1] + d[1] * per);
        let away = (x * x + y * y).sqrt();
        let r = dd(self.radius);
        let c = (r - away) * (r + away);
        if c.hi < 0.0 {
            return (None, away.f64());
        }
        let (sx, sy, up) = (d[0] / self.fill, d[1] / self.fill, along(self.fill) / self.fill);
        let b = x * sx + y * sy;
        let root = (b * b + c).sqrt();
        let s = if b.hi > 0.0 { c / (b + root) } else { root - b };
        (Some([x + sx * s, y + sy * s, up * s]), away.f64())
    }

    /// Direction in air, camera frame, of the ray from a shifted pupil.
    fn ray_from(&self, point: V3, shift: Dd) -> Option<V3> {
        let pupil = self.pupil(shift);
        let zero = dd(0.0);
        let mut parts = vec![(dd(1.0), self.bottom - pupil[2])];
        parts.extend_from_slice(&self.sheet);
        parts.push((self.fill, if point[2] > zero { point[2] } else { zero }));
        parts.retain(|p| p.1.hi > 0.0);
        let (hx, hy) = (point[0] - pupil[0], point[1] - pupil[1]);
        let reach = (hx * hx + hy * hy).sqrt();
        if reach.hi == 0.0 {
            return Some(self.turn_back([zero, zero, dd(1.0)]));
        }
        let n0 = parts.iter().map(|p| p.0).fold(dd(f64::INFINITY), |m, n| if n < m { n } else { m });
        let total = |t: Dd| {
            parts.iter().fold(zero, |sum, &(n, d)| {
                let a = (n - n0) * (n + n0);
                sum + d * n0 * t / (n * n + a * t * t).sqrt()
            })
        };
        let rough = |t: f64| {
            parts.iter().fold(-reach.hi, |sum, &(n, d)| {
                let (n, d, n0) = (n.hi, d.hi, n0.hi);
                sum + d * n0 * t / (n * n + (n - n0) * (n + n0) * t * t).sqrt()
            })
        };
        let mut high = 1.0_f64;
        while total(dd(high)) < reach {
            high *= 8.0;
            if high > 1e30 {
                return None;
            }
        }
        let t = rising_root(|t| total(t) - reach, rough, high)?;
        let sine = n0 * t / (dd(1.0) + t * t).sqrt();
        let left = (dd(1.0) - sine) * (dd(1.0) + sine);
        if left.hi <= 0.0 {
            return None;
        }
        Some(self.turn_back([hx / reach * sine, hy / reach * sine, left.sqrt()]))
    }

    /// The camera ray that sees a point; `None` when no ray gets there.
    pub fn chief(&self, point: V3, end_rad: f64) -> Option<V3> {
        if self.lens.spec.pupil_shift_mm.is_empty() {
            return self.ray_from(point, dd(0.0));
        }
        // The shift that belongs to the field angle of the ray from there, by
        // secants; when they do not settle there is no reference.
        let miss = |shift: Dd| {
            let ray = self.ray_from(point, shift)?;
            let theta = field_angle(ray);
            let theta = if theta.hi > end_rad { dd(end_rad) } else { theta };
            Some((self.lens.shift(theta) - shift, ray))
        };
        let mut before = dd(0.0);
        let (mut at_before, _) = miss(before)?;
        let mut shift = at_before;
        for _ in 0..30 {
            let (at_shift, ray) = miss(shift)?;
            let step = at_shift * (shift - before) / (at_shift - at_before);
            if at_shift.f64().abs() < 1e-26 * self.radius || !step.f64().is_finite() {
                return (at_shift.f64().abs() < 1e-20 * self.radius).then_some(ray);
            }
            (before, at_before, shift) = (shift, at_shift, shift - step);
        }
        None
    }
}
