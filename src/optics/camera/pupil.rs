//! The entrance pupil's place on the axis.

/// `s(theta) = c1 theta^2 + c2 theta^4 + ...`, constant past the domain's end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PupilPolynomial {
    coefficients_mm: Vec<f64>,
    end_rad: f64,
}

impl PupilPolynomial {
    pub fn new(coefficients_mm: &[f64], end_rad: f64) -> Self {
        let mut coefficients_mm = coefficients_mm.to_vec();
        while coefficients_mm.last() == Some(&0.0) {
            coefficients_mm.pop();
        }
        Self { coefficients_mm, end_rad }
    }

    /// Whether all rays cross one point.
    pub fn is_central(&self) -> bool {
        self.coefficients_mm.is_empty()
    }

    /// Shift in millimetres and its derivative by the angle.
    pub fn at(&self, field_angle_rad: f64) -> (f64, f64) {
        let theta = field_angle_rad.clamp(0.0, self.end_rad);
        let u = theta * theta;
        let (mut value, mut slope) = (0.0, 0.0);
        for c in self.coefficients_mm.iter().rev() {
            slope = slope * u + value;
            value = value * u + c;
        }
        // value = P(u), slope = P'(u); s = u P(u).
        let by_u = value + u * slope;
        let by_angle = if theta == field_angle_rad { 2.0 * theta * by_u } else { 0.0 };
        (u * value, by_angle)
    }

    /// An interval that holds every shift of the domain.
    pub fn range_mm(&self) -> (f64, f64) {
        let u = self.end_rad * self.end_rad;
        let mut power = 1.0;
        let (mut low, mut high) = (0.0, 0.0);
        for c in &self.coefficients_mm {
            power *= u;
            if *c < 0.0 {
                low += c * power;
            } else {
                high += c * power;
            }
        }
        (low, high)
    }
}
