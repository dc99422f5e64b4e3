//! A sensor that is turned against its lens; see [`super::thin_prism`].

use glam::{DMat2, DVec2};

/// Relative distance that the domain keeps from the tilt's horizon.
const HORIZON_MARGIN: f64 = 1e-6;

/// The projective map `P(v) = A v / (k . v + w)` of a tilted sensor, which keeps the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SensorTilt {
    a: DMat2,
    k: DVec2,
    w: f64,
    /// The larger singular value of `A`.
    size: f64,
}

impl SensorTilt {
    /// Turned about x and y, radians. `None` where the sensor would face away from the lens.
    ///
    /// With `R = Ry Rx`, `Rx = [[1,0,0],[0,cx,sx],[0,-sx,cx]]` and `Ry = [[cy,0,-sy],[0,1,0],[sy,0,cy]]`, OpenCV's
    /// formula is `[[R33,0,-R13],[0,R33,-R23],[0,0,1]] R (v, 1)`; the third column of the product is `(0, 0, R33)`.
    pub fn new(tau_x_rad: f64, tau_y_rad: f64) -> Option<Self> {
        let half = std::f64::consts::FRAC_PI_2;
        if tau_x_rad.abs() >= half || tau_y_rad.abs() >= half {
            return None;
        }
        let ((sx, cx), (sy, cy)) = (tau_x_rad.sin_cos(), tau_y_rad.sin_cos());
        let [r11, r12, r13] = [cy, sy * sx, -sy * cx];
        let [r21, r22, r23] = [0.0, cx, sx];
        let [r31, r32, r33] = [sy, -cy * sx, cy * cx];
        let a = DMat2::from_cols(
            DVec2::new(r33 * r11 - r13 * r31, r33 * r21 - r23 * r31),
            DVec2::new(r33 * r12 - r13 * r32, r33 * r22 - r23 * r32),
        );
        // The larger singular value of a 2x2 matrix, from the norms of its conformal and anticonformal parts.
        let [p, q] = [a.x_axis.x + a.y_axis.y, a.x_axis.y - a.y_axis.x];
        let [s, t] = [a.x_axis.x - a.y_axis.y, a.x_axis.y + a.y_axis.x];
        let size = 0.5 * (p.hypot(q) + s.hypot(t));
        (r33 > 0.0 && a.determinant() > 0.0).then_some(Self { a, k: DVec2::new(r31, r32), w: r33, size })
    }

    /// The radius that points must keep to, so that none comes near the horizon; `None` without one.
    pub fn horizon(&self) -> Option<f64> {
        let slant = self.k.length();
        (slant > 0.0).then(|| (1.0 - HORIZON_MARGIN) * self.w / slant)
    }

    /// An upper bound of the image radius of points up to `radius`.
    pub fn max_radius(&self, radius: f64) -> f64 {
        self.size * radius / (self.w - self.k.length() * radius)
    }

    /// `P` and its Jacobian.
    pub fn apply(&self, v: DVec2) -> (DVec2, DMat2) {
        let per = 1.0 / (self.k.dot(v) + self.w);
        let image = self.a * v * per;
        let bent = DMat2::from_cols(image * self.k.x, image * self.k.y);
        (image, (self.a - bent) * per)
    }

    /// The point that `P` sends to `image`, and how much longer a short step is there than in the image; `None`
    /// past the horizon.
    pub fn invert(&self, image: DVec2) -> Option<(DVec2, f64)> {
        if self.k == DVec2::ZERO {
            return Some((image, 1.0));
        }
        let matrix = self.a - DMat2::from_cols(image * self.k.x, image * self.k.y);
        let inverse = matrix.inverse();
        let v = inverse * image * self.w;
        let depth = self.k.dot(v) + self.w;
        let stretch = depth * inverse.x_axis.length().hypot(inverse.y_axis.length());
        (depth > 0.0 && v.is_finite() && stretch.is_finite()).then_some((v, stretch))
    }
}
