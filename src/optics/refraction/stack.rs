//! Flat layers between the pupil and a height, and the ray through them.

use super::limit::RayLimit;

/// Most Newton steps for the ray to a point. Observed in millions of random stacks:
/// at most 14; each step past the first few doubles the digits.
pub(super) const MAX_NEWTON_STEPS: u32 = 24;

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
pub(super) struct LayerPath<'a> {
    /// Air between the pupil and the sheet (or the point, if that is lower).
    pub air_mm: f64,
    /// The sheet's layers from below.
    pub plates: &'a [Plate],
    /// How much of the sheet, from its top down, is not in the way.
    pub skipped_mm: f64,
    /// The medium above the sheet, with the height of the point in it.
    pub fill: Plate,
}

/// The tangent of a ray, with the reach and its derivative there.
#[derive(Debug, Clone, Copy)]
pub(super) struct SolvedTangent {
    /// The lowest index in the way, whose layer the tangent is for.
    pub index: f64,
    /// Tangent there.
    pub tangent: f64,
    /// Reach over tangent.
    pub reach_per_tangent: f64,
    /// Derivative of the reach by the tangent.
    pub slope: f64,
}

/// A ray in air towards a point, and how it changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct AirRay {
    /// Tangent of its angle to the normal, per millimetre of reach: finite on
    /// the axis.
    pub tangent_per_mm: f64,
    /// Derivative of the tangent by the reach.
    pub by_reach: f64,
    /// Derivative of the tangent by the height of the point.
    pub by_height: f64,
    /// Derivative of the tangent by the thickness of the air.
    pub by_air: f64,
}

impl LayerPath<'_> {
    /// Calls `visit(index, thickness)` for every layer with thickness in the
    /// way, from the air up.
    fn for_each(&self, mut visit: impl FnMut(f64, f64)) {
        if self.air_mm > 0.0 {
            visit(1.0, self.air_mm);
        }
        if self.skipped_mm == 0.0 {
            for plate in self.plates {
                if plate.thickness_mm > 0.0 {
                    visit(plate.index, plate.thickness_mm);
                }
            }
        } else {
            let whole: f64 = self.plates.iter().map(|p| p.thickness_mm).sum();
            let mut left = whole - self.skipped_mm;
            for plate in self.plates {
                let thickness = left.min(plate.thickness_mm);
                if thickness > 0.0 {
                    visit(plate.index, thickness);
                }
                left -= plate.thickness_mm;
            }
        }
        if self.fill.thickness_mm > 0.0 {
            visit(self.fill.index, self.fill.thickness_mm);
        }
    }

    /// `X(t) / t` and `X'(t)` of the sideways reach
    /// `X(t) = sum d n0 t / sqrt(n^2 + a t^2)`, `a = n^2 - n0^2`.
    fn reach(&self, n0: f64, t: f64) -> (f64, f64) {
        let (mut by_t, mut slope) = (0.0, 0.0);
        let square = t * t;
        self.for_each(|n, d| {
            let inverse = 1.0 / (n * n + (n - n0) * (n + n0) * square);
            let part = d * inverse.sqrt();
            by_t += part;
            slope += part * (n * n * inverse);
        });
        (n0 * by_t, n0 * slope)
    }

    /// Lowest index in the way.
    fn lowest_index(&self) -> Result<f64, RayLimit> {
        if self.air_mm > 0.0 {
            return Ok(1.0);
        }
        let mut lowest = f64::INFINITY;
        self.for_each(|n, _| lowest = lowest.min(n));
        if lowest.is_finite() { Ok(lowest) } else { Err(RayLimit::Unreachable) }
    }

    /// Tangent in the layer of index `n0` whose reach is `reach_mm`.
    ///
    /// `X` rises and is concave, so each Newton step from below ends below.
    fn tangent(&self, n0: f64, reach_mm: f64) -> Result<f64, RayLimit> {
        Ok(self.tangent_with_steps(n0, reach_mm)?.0)
    }

    /// [`LayerPath::tangent`] and the steps that it took.
    fn tangent_with_steps(&self, n0: f64, reach_mm: f64) -> Result<(f64, u32), RayLimit> {
        let (at_axis, _) = self.reach(n0, 0.0);
        // X(t) <= t X'(0): a lower bound of the solution.
        self.tangent_from_below(n0, reach_mm, reach_mm / at_axis)
    }

    /// Newton's method from `t`, which must not be above the solution: the tangent and the steps.
    fn tangent_from_below(&self, n0: f64, reach_mm: f64, mut t: f64) -> Result<(f64, u32), RayLimit> {
        if t == 0.0 {
            return Ok((0.0, 0));
        }
        for steps in 1..=MAX_NEWTON_STEPS {
            let (by_t, slope) = self.reach(n0, t);
            let step = (reach_mm - by_t * t) / slope;
            t += step;
            // |X''| / X' is at most 3 / (2 n) and at most 3 / t, which bounds
            // what Newton's method leaves; a step down is rounding.
            let left = step * step * (0.75_f64).min(1.5 / t);
            if step <= 0.0 || left <= 1e-17 * t {
                return Ok((t, steps));
            }
        }
        Err(RayLimit::NotConverged)
    }

    /// Tangent in air of the ray with this reach, per millimetre of reach.
    pub fn tangent_per_mm(&self, reach_mm: f64) -> Result<f64, RayLimit> {
        let n0 = self.lowest_index()?;
        let t = self.tangent(n0, reach_mm)?;
        finite(in_air(n0, t)?.0 / self.reach_by(n0, t, reach_mm))
    }

    /// The tangent from that of a neighbour, with what a tube of light needs.
    ///
    /// The tangent line of a concave function lies above it, so one Newton step from anywhere, even above the
    /// solution, ends below; the next steps rise to it.
    pub fn tangent_from_neighbor(&self, reach_mm: f64, near_tangent: f64) -> Result<SolvedTangent, RayLimit> {
        let index = self.lowest_index()?;
        let (at_axis, _) = self.reach(index, 0.0);
        let lowest = reach_mm / at_axis;
        let mut start = lowest;
        if near_tangent > lowest {
            let (by_t, slope) = self.reach(index, near_tangent);
            start = (near_tangent + (reach_mm - by_t * near_tangent) / slope).max(lowest);
        }
        let (tangent, _) = self.tangent_from_below(index, reach_mm, start)?;
        let (reach_per_tangent, slope) = self.reach(index, tangent);
        Ok(SolvedTangent { index, tangent, reach_per_tangent, slope })
    }

    /// Newton steps for this reach, and the residual of the reach, in millimetres.
    pub fn steps_and_residual(&self, reach_mm: f64) -> Result<(u32, f64), RayLimit> {
        let n0 = self.lowest_index()?;
        let (t, steps) = self.tangent_with_steps(n0, reach_mm)?;
        Ok((steps, (self.reach(n0, t).0 * t - reach_mm).abs()))
    }

    /// `reach / t`, also on the axis.
    fn reach_by(&self, n0: f64, t: f64, reach_mm: f64) -> f64 {
        if t > 0.0 { reach_mm / t } else { self.reach(n0, 0.0).0 }
    }

    /// [`LayerPath::tangent_per_mm`] with derivatives.
    pub fn air_ray(&self, reach_mm: f64) -> Result<AirRay, RayLimit> {
        let n0 = self.lowest_index()?;
        let t = self.tangent(n0, reach_mm)?;
        let (scale, slope) = in_air(n0, t)?;
        let (_, reach_slope) = self.reach(n0, t);
        let tangent_in = |n: f64| n0 * t / (n * n + (n - n0) * (n + n0) * (t * t)).sqrt();
        // The point moves up into the medium that it is in: the last one.
        let mut last = 1.0;
        self.for_each(|n, _| last = n);
        if self.skipped_mm == 0.0 {
            last = self.fill.index;
        }
        let by_reach = slope / reach_slope;
        Ok(AirRay {
            tangent_per_mm: finite(scale / self.reach_by(n0, t, reach_mm))?,
            by_reach: finite(by_reach)?,
            by_height: finite(-by_reach * tangent_in(last))?,
            by_air: finite(-by_reach * t * scale)?,
        })
    }
}

/// From the tangent `t` in index `n0` to the tangent in air: the factor, and
/// the derivative. The sine in air is `n0 sin`, and
/// `1 - n0^2 sin^2 = (1 - (n0^2 - 1) t^2) / (1 + t^2)`.
fn in_air(n0: f64, t: f64) -> Result<(f64, f64), RayLimit> {
    if n0 == 1.0 {
        return Ok((1.0, 1.0));
    }
    let left = 1.0 - (n0 - 1.0) * (n0 + 1.0) * t * t;
    if left <= 0.0 {
        return Err(RayLimit::TotalInternalReflection);
    }
    let root = left.sqrt();
    Ok((n0 / root, n0 / (root * left)))
}

/// A value that overflowed belongs to a ray along the layers, which no point
/// at a finite distance has.
fn finite(value: f64) -> Result<f64, RayLimit> {
    if value.is_finite() { Ok(value) } else { Err(RayLimit::Unreachable) }
}

/// Sideways travel of a ray through whole plates, per unit of its sine
/// in air; `cos` is the cosine in air.
#[inline]
pub(super) fn travel(plates: &[Plate], cos: f64) -> f64 {
    let square = cos * cos;
    let mut by_p = 0.0;
    for plate in plates {
        if plate.thickness_mm > 0.0 {
            by_p += plate.thickness_mm / (plate.excess + square).sqrt();
        }
    }
    by_p
}

/// Derivative of [`travel`] by `cos`.
pub(super) fn travel_by_cos(plates: &[Plate], cos: f64) -> f64 {
    let square = cos * cos;
    let mut slope = 0.0;
    for plate in plates {
        if plate.thickness_mm > 0.0 {
            let inverse = 1.0 / (plate.excess + square);
            slope -= plate.thickness_mm * cos * inverse * inverse.sqrt();
        }
    }
    slope
}
