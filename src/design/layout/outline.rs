//! Closed outlines made of cubic Bezier curves.
//!
//! # Example
//! ```
//! use domecast_design::glam::DVec2;
//! use domecast_design::layout::outline::{CurvePoint, Outline};
//!
//! let circle = |angle| {
//!     let at = DVec2::from_angle(angle);
//!     Ok::<_, ()>(CurvePoint { at, slope: at.perp() })
//! };
//! let (outline, fit) = Outline::of_curve(circle, 1e-3).map_err(|()| "no curve")?;
//! assert!(fit.reached && (outline.equivalent_diameter() - 2.0).abs() < 1e-3);
//! # Ok::<(), &str>(())
//! ```

use std::f64::consts::TAU;

use glam::DVec2;

/// A closed outline, counter-clockwise or clockwise as it was traced: a start and the cubic pieces that lead
/// back to it, each as (first control point, second control point, end).
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pieces: Vec<[DVec2; 3]>,
}

/// A point of a curve that is traced, with its derivative by the parameter (an angle, rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// The point.
    pub at: DVec2,
    /// Derivative of the point by the angle.
    pub slope: DVec2,
}

/// How closely an outline follows the curve from which it was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutlineFit {
    /// Largest distance seen between outline and curve, in the curve's unit.
    pub error: f64,
    /// Whether that is within the tolerance asked for.
    pub reached: bool,
}

/// Most pieces of one outline: a curve that needs more is no smooth closed curve.
const MAX_PIECES: u32 = 256;

/// The largest distance over the largest that is seen.
const SEEN: f64 = 1.1;

impl Outline {
    /// The outline of a smooth closed curve, given as a function of an angle over a full turn.
    ///
    /// The pieces have the curve's point and direction at their ends. Their handles are those of a circle's arc,
    /// scaled by the curve's slope, so that an ellipse is as close as a circle can be; their number
    /// doubles from four until the distance between, measured across the curve, is within the tolerance.
    ///
    /// # Errors
    /// The first failure of `curve`.
    pub fn of_curve<E>(
        mut curve: impl FnMut(f64) -> Result<CurvePoint, E>,
        tolerance: f64,
    ) -> Result<(Self, OutlineFit), E> {
        let mut count = 4;
        loop {
            let (outline, error) = Self::of_curve_in(&mut curve, count)?;
            // between the places that are looked at it may be a little larger
            let reached = SEEN * error <= tolerance;
            if reached || count >= MAX_PIECES {
                return Ok((outline, OutlineFit { error, reached }));
            }
            count *= 2;
        }
    }

    fn of_curve_in<E>(
        curve: &mut impl FnMut(f64) -> Result<CurvePoint, E>,
        count: u32,
    ) -> Result<(Self, f64), E> {
        let step = TAU / f64::from(count);
        let handle = 4.0 / 3.0 * (0.25 * step).tan();
        let ends = (0..count).map(|k| curve(step * f64::from(k))).collect::<Result<Vec<_>, _>>()?;
        let mut pieces = Vec::with_capacity(ends.len());
        let mut error: f64 = 0.0;
        for (k, from) in ends.iter().enumerate() {
            let to = ends[(k + 1) % ends.len()];
            let piece = [from.at + from.slope * handle, to.at - to.slope * handle, to.at];
            // A circle's cubic is furthest off near 0.21 and 0.79 of its length and exact in the middle; other curves
            // have their worst nearer the ends too.
            for share in [0.11, 0.21, 0.5, 0.79, 0.89] {
                let exact = curve(step * (k as f64 + share))?;
                let off = point_on(from.at, &piece, share) - exact.at;
                let along = exact.slope.normalize_or_zero();
                error = error.max(off.perp_dot(along).abs());
            }
            pieces.push(piece);
        }
        Ok((Self { pieces }, error))
    }

    /// An outline from its pieces, each as (first control point, second control point, end).
    pub fn from_pieces(pieces: Vec<[DVec2; 3]>) -> Self {
        Self { pieces }
    }

    /// Where the outline starts and ends.
    pub fn start(&self) -> DVec2 {
        self.pieces.last().map_or(DVec2::ZERO, |piece| piece[2])
    }

    /// The pieces in order: (first control point, second control point, end).
    pub fn pieces(&self) -> &[[DVec2; 3]] {
        &self.pieces
    }

    /// The pieces with their starts.
    fn curves(&self) -> impl Iterator<Item = [DVec2; 4]> + '_ {
        let starts = std::iter::once(self.start()).chain(self.pieces.iter().map(|piece| piece[2]));
        starts.zip(&self.pieces).map(|(start, piece)| [start, piece[0], piece[1], piece[2]])
    }

    /// Area inside, positive where the outline runs counter-clockwise (x towards y).
    ///
    /// Green's theorem on the cubics themselves: the integral of x dy - y dx over a cubic with control points
    /// p0..p3 is exact in closed form, so no chord error enters.
    pub fn signed_area(&self) -> f64 {
        let start = self.start();
        self.curves().map(|curve| half_cross_integral(curve.map(|p| p - start))).sum()
    }

    /// Diameter of the circle of equal area.
    pub fn equivalent_diameter(&self) -> f64 {
        2.0 * (self.signed_area().abs() / std::f64::consts::PI).sqrt()
    }

    /// Centroid of the area inside; the start where the area is zero.
    pub fn centroid(&self) -> DVec2 {
        let start = self.start();
        let (mut area, mut moment) = (0.0, DVec2::ZERO);
        for curve in self.curves() {
            let local = curve.map(|p| p - start);
            area += half_cross_integral(local);
            moment += moment_integral(local);
        }
        if area == 0.0 { start } else { start + moment / area }
    }

    /// Points along the outline, `per_piece` for each piece, from the start, which is not repeated.
    pub fn polygon(&self, per_piece: u32) -> Vec<DVec2> {
        self.curves()
            .flat_map(|[start, a, b, end]| {
                (0..per_piece)
                    .map(move |k| point_on(start, &[a, b, end], f64::from(k) / f64::from(per_piece)))
            })
            .collect()
    }

    /// Points along the outline such that no chord is further from it than `tolerance`; the start is not
    /// repeated. The pieces are divided evenly, by the bound that their second derivative sets.
    pub fn polygon_within(&self, tolerance: f64) -> Vec<DVec2> {
        let mut points = Vec::new();
        for [start, a, b, end] in self.curves() {
            // |chord - curve| <= |second derivative| / (8 n^2), and |second derivative| <= 6 max |..|.
            let bend = (start - 2.0 * a + b).length().max((a - 2.0 * b + end).length());
            let count = (0.75 * bend / tolerance).sqrt().ceil().clamp(1.0, 1e4) as u32;
            points.extend((0..count).map(|k| point_on(start, &[a, b, end], f64::from(k) / f64::from(count))));
        }
        points
    }

    /// Lowest and highest coordinates, of the control points: a box that is never too small.
    pub fn bounds(&self) -> (DVec2, DVec2) {
        let start = (self.start(), self.start());
        self.pieces.iter().flatten().fold(start, |(low, high), p| (low.min(*p), high.max(*p)))
    }

    /// The least width between two parallel lines that hold the outline, and the greatest, over 64 points.
    pub fn widths(&self) -> (f64, f64) {
        let points = self.polygon((64 / self.pieces.len().max(1)).max(4) as u32);
        let width = |k: u32| {
            let across = DVec2::from_angle(TAU / 2.0 * f64::from(k) / 32.0);
            let reach = points.iter().map(|p| p.dot(across));
            let (low, high) =
                reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        (0..32).map(width).fold((f64::INFINITY, 0.0), |(l, h), w| (l.min(w), h.max(w)))
    }
}

/// The point at parameter `t` of the cubic from `start`.
fn point_on(start: DVec2, [a, b, end]: &[DVec2; 3], t: f64) -> DVec2 {
    let u = 1.0 - t;
    start * (u * u * u) + *a * (3.0 * u * u * t) + *b * (3.0 * u * t * t) + *end * (t * t * t)
}

/// Half the integral of p x dp over a cubic.
fn half_cross_integral([p0, p1, p2, p3]: [DVec2; 4]) -> f64 {
    let cross = |a: DVec2, b: DVec2| a.perp_dot(b);
    (6.0 * cross(p0, p1)
        + 3.0 * cross(p0, p2)
        + cross(p0, p3)
        + 3.0 * cross(p1, p2)
        + 3.0 * cross(p1, p3)
        + 6.0 * cross(p2, p3))
        / 20.0
}

/// A third of the integral of p (p x dp) over a cubic: its share of the first moment of the area. The
/// integrand is a polynomial of degree 8, which Gauss's rule with five points integrates exactly.
fn moment_integral([p0, p1, p2, p3]: [DVec2; 4]) -> DVec2 {
    const NODES: [(f64, f64); 5] = [
        (0.046_910_077_030_668_0, 0.118_463_442_528_094_54),
        (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
        (0.5, 0.284_444_444_444_444_44),
        (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
        (0.953_089_922_969_332, 0.118_463_442_528_094_54),
    ];
    NODES
        .iter()
        .map(|(t, weight)| {
            let u = 1.0 - t;
            let at = point_on(p0, &[p1, p2, p3], *t);
            let slope = ((p1 - p0) * (u * u) + (p2 - p1) * (2.0 * u * t) + (p3 - p2) * (t * t)) * 3.0;
            at * (at.perp_dot(slope) * weight / 3.0)
        })
        .fold(DVec2::ZERO, |sum, part| sum + part)
}
