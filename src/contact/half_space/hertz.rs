//! Closed forms: Hertz' ellipse and its kin on a dome.
//!
//! K. L. Johnson, Contact Mechanics, 1985: chapter 4 (Hertz), 5.2 (cone), with the potential of the ellipsoid in
//! the form w = 3F/(4 pi E*) int_lambda^inf (1 - x^2/(a^2+s) - y^2/(b^2+s)) ds / sqrt((a^2+s)(b^2+s)s).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use domecast_optics::numeric::bracketed_newton;

/// Complete elliptic integrals K and E of the modulus k, by the arithmetic-geometric mean (M. Abramowitz,
/// I. Stegun, 17.6).
pub(crate) fn elliptic(k: f64) -> (f64, f64) {
    let (mut a, mut b, mut power) = (1.0_f64, ((1.0 - k) * (1.0 + k)).sqrt(), 0.5);
    let mut sum = 0.5 * k * k;
    for _ in 0..40 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
        if c.abs() <= 1e-17 * a {
            break;
        }
    }
    let first = PI / (2.0 * a);
    (first, first * (1.0 - sum))
}

/// A touched ellipse, or a circle under a cone, of the half-space theory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Patch {
    /// Half axes, mm: along `first`, and across.
    pub a_mm: f64,
    pub b_mm: f64,
    /// Force, N.
    pub force_n: f64,
    /// Approach of the half-spaces, mm.
    pub depth_mm: f64,
    /// Slope of a cone's flank, 0 for a smooth object.
    pub cone: f64,
    /// Relative curvatures: gap = a x^2 + b y^2, 1/mm.
    pub gap: [f64; 2],
}

/// Hertz' ellipse for an approach, gap = A x^2 + B y^2 with A <= B; `None` for curvatures without contact.
pub(crate) fn ellipse(depth_mm: f64, gap: [f64; 2], modulus_mpa: f64) -> Option<Patch> {
    let [low, high] = gap;
    if !(low > 0.0 && high >= low && depth_mm > 0.0 && (high / low).is_finite()) {
        return None;
    }
    // (K - E)/k^2 and (E/(1-k^2) - K)/k^2, both pi/4 at k = 0; their quotient is B/A.
    let parts = |k: f64| {
        if k < 1e-3 {
            let k2 = k * k;
            return (FRAC_PI_2, PI / 4.0 * (1.0 + 0.375 * k2), PI / 4.0 * (1.0 + 1.125 * k2));
        }
        let (first, second) = elliptic(k);
        (first, (first - second) / (k * k), (second / (1.0 - k * k) - first) / (k * k))
    };
    let ratio = high / low;
    let k = if ratio - 1.0 < 1e-9 {
        0.0
    } else {
        // By bisection on log(1 - k), where the quotient is nearly straight.
        let excess = |t: f64| {
            let (_, p, q) = parts(1.0 - (-t).exp());
            ((q / p).ln() - ratio.ln(), f64::NAN)
        };
        let root = bracketed_newton(excess, 1e-9, 34.0, 1.0).ok()?;
        1.0 - (-root.value).exp()
    };
    let (first, p, _) = parts(k);
    let a_mm = (depth_mm * p / (low * first)).sqrt();
    let b_mm = a_mm * ((1.0 - k) * (1.0 + k)).sqrt();
    let force_n = 2.0 * PI * modulus_mpa * a_mm * depth_mm / (3.0 * first);
    Some(Patch { a_mm, b_mm, force_n, depth_mm, cone: 0.0, gap })
}

/// A ball-and-cone profile, gap = r^2 / (2 R) + slope r: Sneddon's solution is linear in the profile, so that
/// depth = a^2/R + pi/2 slope a and F = E* (4 a^3 / (3 R) + pi/2 slope a^2).
pub(crate) fn cone(depth_mm: f64, curvature: f64, slope: f64, modulus_mpa: f64) -> Patch {
    let linear = FRAC_PI_2 * slope;
    // Positive root of curvature a^2 + linear a = depth, without cancellation.
    let a = 2.0 * depth_mm / (linear + (linear * linear + 4.0 * curvature * depth_mm).sqrt());
    let force_n = modulus_mpa * a * a * (4.0 / 3.0 * curvature * a + linear);
    let gap = [0.5 * curvature; 2];
    Patch { a_mm: a, b_mm: a, force_n, depth_mm, cone: slope, gap }
}

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1].
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_64),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

impl Patch {
    /// Largest pressure, MPa; a cone's own peak is a spike, its mean pressure is given.
    pub fn peak_mpa(&self) -> f64 {
        let mean = self.force_n / (PI * self.a_mm * self.b_mm);
        if self.cone > 0.0 { mean } else { 1.5 * mean }
    }

    /// Pressure at a place of the patch, MPa; 0 outside.
    pub fn pressure_mpa(&self, x_mm: f64, y_mm: f64, modulus_mpa: f64) -> f64 {
        let q = (x_mm / self.a_mm).powi(2) + (y_mm / self.b_mm).powi(2);
        if q >= 1.0 {
            return 0.0;
        }
        if self.cone == 0.0 {
            return self.peak_mpa() * (1.0 - q).sqrt();
        }
        // Sum of the ball's half ellipsoid and the cone's arcosh(a/r) (Johnson, 5.10).
        let curvature = 2.0 * self.gap[0];
        let r = (q.sqrt()).max(1e-3);
        let ball = 2.0 * modulus_mpa * self.a_mm * curvature / PI * (1.0 - q).sqrt();
        ball + 0.5 * modulus_mpa * self.cone * (1.0 / r).acosh()
    }

    /// Inward displacement of the half-space's surface under the patch, mm.
    pub fn sink_mm(&self, x_mm: f64, y_mm: f64, modulus_mpa: f64) -> f64 {
        let (a, b) = (self.a_mm, self.b_mm);
        let q = (x_mm / a).powi(2) + (y_mm / b).powi(2);
        let gap = self.gap[0] * x_mm * x_mm + self.gap[1] * y_mm * y_mm;
        if self.cone > 0.0 {
            return self.cone_sink_mm(x_mm.hypot(y_mm));
        }
        if q <= 1.0 {
            return self.depth_mm - gap;
        }
        if a == b {
            // The integral in closed form (Johnson, 3.42a).
            let r2 = a * a * q;
            let ratio = q.sqrt().recip();
            let bracket = (2.0 * a * a - r2) * ratio.asin() + r2 * ratio * (1.0 - ratio * ratio).sqrt();
            return 0.75 * self.force_n / (PI * modulus_mpa * a * a * a) * bracket;
        }
        // Largest root of x^2/(a^2+l) + y^2/(b^2+l) = 1.
        let (x2, y2, a2, b2) = (x_mm * x_mm, y_mm * y_mm, a * a, b * b);
        let half = 0.5 * (x2 + y2 - a2 - b2);
        let constant = x2 * b2 + y2 * a2 - a2 * b2;
        let lambda = half + (half * half + constant).max(0.0).sqrt();
        // s = 1/t^2, t = tan(psi)/c with c between the axes keeps the integrand smooth.
        let c = (a * b).sqrt();
        let end = (c / lambda.sqrt()).atan();
        let sum: f64 = GAUSS
            .iter()
            .map(|(node, weight)| {
                let (sine, cosine) = (node * end).sin_cos();
                let t = sine / (cosine * c);
                let (p, q) = (1.0 + a2 * t * t, 1.0 + b2 * t * t);
                let rest = 1.0 - x2 * t * t / p - y2 * t * t / q;
                weight * rest / ((p * q).sqrt() * cosine * cosine * c)
            })
            .sum();
        3.0 * self.force_n / (2.0 * PI * modulus_mpa) * sum * end
    }

    /// Sneddon's displacement of ball and cone: depth less the profile inside, the integral of
    /// g(t) / sqrt(r^2 - t^2) outside, g(t) = depth - t^2/R - pi/2 slope t.
    fn cone_sink_mm(&self, r: f64) -> f64 {
        let (a, curvature) = (self.a_mm, 2.0 * self.gap[0]);
        if r <= a {
            return self.depth_mm - 0.5 * curvature * r * r - self.cone * r;
        }
        let ratio = a / r;
        let (angle, root) = (ratio.asin(), (1.0 - ratio * ratio).sqrt());
        let constant = angle;
        let linear = r * (1.0 - root);
        let square = 0.5 * r * r * (angle - ratio * root);
        (self.depth_mm * constant - curvature * square - FRAC_PI_2 * self.cone * linear) * 2.0 / PI
    }
}

/// The axes of the patch: `first` and `second` in the tangent plane at the contact, the first along the smaller
/// relative curvature.
pub(crate) fn axes(normal: DVec3, first: DVec3) -> (DVec3, DVec3) {
    let (any, _) = normal.any_orthonormal_pair();
    let u = (first - normal * first.dot(normal)).normalize_or(any);
    (u, normal.cross(u))
}
