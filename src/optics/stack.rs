//! Flat layers between the pupil and a height, and the ray through them.

use glam::DVec2;

use super::Limit;

/// Newton steps of the climb to a point. Observed: at most 14; each step past
/// the first few doubles the digits, so the bound is never near.
pub(super) const MAX_CLIMB_STEPS: u32 = 64;

/// A flat layer for one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plate {
    /// Index of refraction.
    pub index: f64,
    /// `index^2 - 1` without cancellation.
    pub excess: f64,
    /// Thickness in millimetres.
    pub thickness_mm: f64,
}

impl Plate {
    pub fn new(index: f64, thickness_mm: f64) -> Self {
        Self { index, excess: (index - 1.0) * (index + 1.0), thickness_mm }
    }
}

/// What a ray from the pupil to a point has to cross: each layer with the
/// thickness that is really in the way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path<'a> {
    /// Air between the pupil and the sheet (or the point, if that is lower).
    pub air_mm: f64,
    /// The sheet's layers from below.
    pub plates: &'a [Plate],
    /// How much of the sheet, from its top down, is not in the way.
    pub spared_mm: f64,
    /// The medium above the sheet, with the height of the point in it.
    pub fill: Plate,
}

impl Path<'_> {
    /// The layers with thickness in the way.
    fn crossed(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let mut left: f64 = self.plates.iter().map(|p| p.thickness_mm).sum::<f64>() - self.spared_mm;
        let whole = self.spared_mm == 0.0;
        let sheet = self.plates.iter().map(move |plate| {
            let thickness = if whole { plate.thickness_mm } else { left.clamp(0.0, plate.thickness_mm) };
            left -= plate.thickness_mm;
            (plate.index, thickness)
        });
        std::iter::once((1.0, self.air_mm))
            .chain(sheet)
            .chain(std::iter::once((self.fill.index, self.fill.thickness_mm)))
            .filter(|&(_, thickness)| thickness > 0.0)
    }

    /// Tangent of the ray in air whose sideways reach is `reach_mm`, per unit
    /// of reach: `tan / reach_mm`, which stays finite on the axis.
    pub fn air_tangent_per_mm(&self, reach_mm: f64) -> Result<f64, Limit> {
        // The layer of lowest index, n0.
        let n0 = self.crossed().fold(f64::INFINITY, |n, (m, _)| n.min(m));
        if n0.is_infinite() {
            return Err(Limit::Unreachable);
        }
        // X(t) = sum d n0 t / sqrt(n^2 + a t^2), a = n^2 - n0^2.
        let value_and_slope = |t: f64| {
            let (mut x_by_t, mut slope) = (0.0, 0.0);
            for (n, d) in self.crossed() {
                let square = n * n + (n - n0) * (n + n0) * (t * t);
                let part = d * n0 / square.sqrt();
                x_by_t += part;
                slope += part * (n * n / square);
            }
            (x_by_t, slope)
        };
        let (at_axis, _) = value_and_slope(0.0);
        let mut t = reach_mm / at_axis;
        let mut x_by_t = at_axis;
        let mut converged = t == 0.0;
        for _ in 0..MAX_CLIMB_STEPS {
            if converged {
                break;
            }
            let slope;
            (x_by_t, slope) = value_and_slope(t);
            let step = (reach_mm - x_by_t * t) / slope;
            // Below the solution every step is upwards; the first one that is
            // not is rounding.
            let next = t + step;
            converged = step <= 2.0 * f64::EPSILON * t || next.is_nan();
            if step.is_finite() && step.abs() < 1e-3 * t {
                t = next;
            } else if step > 0.0 {
                t = next;
            }
        }
        if !converged || !t.is_finite() {
            return Err(Limit::NotConverged);
        }
        let per_mm = if reach_mm > 0.0 { t / reach_mm } else { 1.0 / x_by_t };
        if n0 == 1.0 {
            return Ok(per_mm);
        }
        // No air in the way: sin in air = n0 sin in that layer, and
        // 1 - sin^2 = (1 - (n0^2 - 1) t^2) / (1 + t^2).
        let left = 1.0 - (n0 - 1.0) * (n0 + 1.0) * t * t;
        if left <= 0.0 {
            return Err(Limit::TotalInternalReflection);
        }
        Ok(per_mm * n0 / left.sqrt())
    }
}

/// Sideways travel of a ray through whole plates: `p` is the momentum along
/// them (the sine in air), `cos` the cosine in air.
pub(super) fn travel(plates: &[Plate], p: DVec2, cos: f64) -> DVec2 {
    let square = cos * cos;
    let mut by_p = 0.0;
    for plate in plates {
        if plate.thickness_mm > 0.0 {
            by_p += plate.thickness_mm / (plate.excess + square).sqrt();
        }
    }
    p * by_p
}
