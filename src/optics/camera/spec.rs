//! What a lens is made from, and what is wrong with it.

/// The form of the lens model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LensModel {
    /// Perspective, no distortion coefficients.
    Pinhole,
    /// D. C. Brown, "Decentering distortion of lenses" (1966), as in OpenCV's
    /// `calib3d`: 5 coefficients `k1 k2 p1 p2 k3` (ROS `plumb_bob`), or 8 with
    /// the denominator `k4 k5 k6` (`rational_polynomial`); with 12 the thin prism `s1 s2 s3 s4` follows, with 14
    /// the sensor's tilt `tau_x tau_y`, radians.
    BrownConrady,
    /// J. Kannala and S. S. Brandt (2006), doi:10.1109/TPAMI.2006.153, as in
    /// OpenCV's `fisheye`: 4 coefficients `k1 k2 k3 k4` (ROS `equidistant`).
    KannalaBrandt,
}

impl LensModel {
    /// The name in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::BrownConrady => "brown_conrady",
            Self::KannalaBrandt => "kannala_brandt",
        }
    }

    /// The model of that name.
    pub fn parse(name: &str) -> Option<Self> {
        [Self::Pinhole, Self::BrownConrady, Self::KannalaBrandt]
            .into_iter()
            .find(|model| model.as_str() == name)
    }

    /// The lengths that its list of coefficients may have.
    pub fn coefficient_counts(self) -> &'static [usize] {
        match self {
            Self::Pinhole => &[0],
            Self::BrownConrady => &[5, 8, 12, 14],
            Self::KannalaBrandt => &[4],
        }
    }
}

impl std::fmt::Display for LensModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A lens as calibrations state it.
#[derive(Debug, Clone, PartialEq)]
pub struct LensSpec {
    /// Form of the model.
    pub model: LensModel,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Camera matrix `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`, pixels.
    pub matrix: [[f64; 3]; 3],
    /// Coefficients in OpenCV's order, see [`LensModel`].
    pub distortion: Vec<f64>,
    /// Full angle of the cone that the lens sees, in radians.
    pub field_of_view_rad: f64,
    /// Shift of the entrance pupil along the axis, towards the scene, as
    /// coefficients in millimetres of the second, fourth, ... power of the
    /// field angle in radians; empty for a central lens.
    pub pupil_shift_mm: Vec<f64>,
}

/// A lens that cannot be: the field, its value and what is allowed there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LensError {
    /// Field of [`LensSpec`], with an index where one entry is at fault.
    pub field: String,
    /// The value as given.
    pub value: String,
    /// What would be right.
    pub allowed: String,
}

impl std::fmt::Display for LensError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} is {}: {}", self.field, self.value, self.allowed)
    }
}

impl std::error::Error for LensError {}

fn error(field: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> LensError {
    LensError { field: field.into(), value: value.to_string(), allowed: allowed.into() }
}

/// Largest magnitude of a coefficient. Published overfit sets reach 1e4; the
/// bound keeps every polynomial of the domain search finite.
const MAX_COEFFICIENT: f64 = 1e9;

impl LensSpec {
    /// Whether every field can be used; the domain is found by [`super::Lens::new`].
    ///
    /// # Errors
    /// The first field at fault.
    pub fn check(&self) -> Result<(), LensError> {
        for (field, value) in [("width", self.width), ("height", self.height)] {
            if value == 0 {
                return Err(error(field, value, "an image needs at least 1 pixel"));
            }
        }
        for (i, row) in self.matrix.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                let field = format!("matrix[{i}][{j}]");
                if !value.is_finite() || value.abs() > 1e9 {
                    return Err(error(field, value, "a finite number, at most 1e9"));
                }
                let fixed = match (i, j) {
                    (0, 1) | (1, 0) | (2, 0) | (2, 1) => Some(0.0),
                    (2, 2) => Some(1.0),
                    _ => None,
                };
                if fixed.is_some_and(|fixed| value != fixed) {
                    return Err(error(field, value, "the matrix is [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]"));
                }
                if i == j && i < 2 && value < 1e-6 {
                    return Err(error(field, value, "a focal length is positive, in pixels (at least 1e-6)"));
                }
            }
        }
        let counts = self.model.coefficient_counts();
        if !counts.contains(&self.distortion.len()) {
            let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
            return Err(error(
                "distortion",
                format!("a list of {}", self.distortion.len()),
                format!("{} takes {} coefficients", self.model, counts.join(" or ")),
            ));
        }
        for (list, values, largest) in
            [("distortion", &self.distortion, MAX_COEFFICIENT), ("pupil_shift_mm", &self.pupil_shift_mm, 1e6)]
        {
            for (i, &value) in values.iter().enumerate() {
                if !value.is_finite() || value.abs() > largest {
                    return Err(error(
                        format!("{list}[{i}]"),
                        value,
                        format!("a finite number, at most {largest:e} in size"),
                    ));
                }
            }
        }
        if self.pupil_shift_mm.len() > 8 {
            return Err(error(
                "pupil_shift_mm",
                format!("a list of {}", self.pupil_shift_mm.len()),
                "at most 8 coefficients",
            ));
        }
        let view = self.field_of_view_rad;
        if view.is_nan() || view <= 0.0 || view > std::f64::consts::TAU {
            return Err(error("field_of_view_rad", view, "more than 0 and at most 2 pi (360 degrees)"));
        }
        Ok(())
    }

    pub(super) fn no_domain() -> LensError {
        error(
            "distortion",
            "a model without a usable domain",
            "the image radius must grow from the centre on",
        )
    }
}
