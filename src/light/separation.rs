//! How well the colours of the lights tell a surface's normal.
//!
//! A matt surface under lights of three colours has levels `M n`: row k of `M` is the vector irradiance that channel k
//! sees, in grey levels, and `n` the unit normal. So `n = M^-1 levels`, and what noise does to it follows from `M` alone.

use glam::{DMat3, DVec3};

/// Smallest singular value, part of the largest, below which a matrix has no inverse worth the name: with it, one grey
/// level is more than any angle.
const SINGULAR: f64 = 1e-9;

/// Sweeps of the Jacobi rotations: three columns are orthogonal to rounding after four or five.
const SWEEPS: usize = 12;

/// Singular values, largest first: columns are rotated in pairs until they are orthogonal; their lengths are then the
/// values (one-sided Jacobi; M. R. Hestenes, J. SIAM 6, 1958). Unlike the eigenvalues of `M^T M` by a closed form, that is
/// exact to rounding where two of them are equal.
pub fn singular_values(matrix: &DMat3) -> [f64; 3] {
    let mut columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    for _ in 0..SWEEPS {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (a, b) = (columns[i], columns[j]);
            let across = a.dot(b);
            if across == 0.0 {
                continue;
            }
            let half = (b.length_squared() - a.length_squared()) / (2.0 * across);
            let tangent = half.signum() / (half.abs() + (1.0 + half * half).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sine = cosine * tangent;
            (columns[i], columns[j]) = (a * cosine - b * sine, a * sine + b * cosine);
        }
    }
    let mut values = columns.map(DVec3::length);
    values.sort_unstable_by(|a, b| b.total_cmp(a));
    values
}

/// Condition number of crosstalk times light: the largest singular value over the smallest; `None` where a colour is
/// missing or the directions of the three lie in a plane.
///
/// Three equal lights 120 degrees apart, `s` off the normal, have `sqrt(2) / tan s` for `s` up to 54.7 degrees, where it
/// is 1, and the inverse beyond.
pub fn condition_number(light: &DMat3) -> Option<f64> {
    let [largest, _, smallest] = singular_values(light);
    let is_regular = largest.is_finite() && smallest > SINGULAR * largest;
    is_regular.then(|| largest / smallest)
}

/// Standard deviation of the normal in a tangential direction, rad, for one grey level of noise in each channel:
/// `|| (1 - n n^T) M^-1 ||_F / sqrt(2)`. `levels` is `M`, in grey levels. `None` where it has no inverse.
///
/// The error of `M^-1 levels` is `M^-1` times the noise; what lies along the normal is taken for brightness, the rest
/// turns the normal, and the root of two makes it that of one of the two tangential directions.
pub fn normal_error_rad(levels: &DMat3, normal: DVec3) -> Option<f64> {
    condition_number(levels)?;
    let inverse = levels.inverse();
    let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
    let square: f64 =
        columns.iter().map(|column| column.reject_from_normalized(normal).length_squared()).sum();
    let error = (0.5 * square).sqrt();
    error.is_finite().then_some(error)
}

/// How well the brightness of the membrane is known beside the frame at rest, a part: what a touch changes of the light that the
/// dome gives itself (a third of all) and what JPEG leaves of brightness.
pub const BRIGHTNESS_SD: f64 = 0.03;

/// As [`normal_error_rad`] by as many colors as there are, where brightness is known to [`BRIGHTNESS_SD`] beside a frame at rest, as
/// `track --shape` reads normals; `None` where a direction cannot be distinguished.
pub fn slope_error_rad(levels: &DMat3, normal: DVec3) -> Option<f64> {
    let (first, second) = normal.any_orthonormal_pair();
    let [j1, j2, whole] = [first, second, normal].map(|way| levels.mul_vec3(way));
    // The brightness, with what is known of it, put into the slopes' equations (Schur's complement).
    let bright = 1.0 / (whole.length_squared() + 1.0 / (BRIGHTNESS_SD * BRIGHTNESS_SD));
    let entry = |a: DVec3, b: DVec3| a.dot(b) - a.dot(whole) * whole.dot(b) * bright;
    let (a11, a12, a22) = (entry(j1, j1), entry(j1, j2), entry(j2, j2));
    let determinant = a11 * a22 - a12 * a12;
    let error = (0.5 * (a11 + a22) / determinant).sqrt();
    (determinant > SINGULAR * (a11 + a22).powi(2) && error.is_finite()).then_some(error)
}

/// The value below which a part of `sorted` lies, interpolated between neighbours; `None` where there is none. Of places
/// that stand for equal areas it is the percentile by area.
pub fn percentile(sorted: &[f64], part: f64) -> Option<f64> {
    let at = part.clamp(0.0, 1.0) * sorted.len().saturating_sub(1) as f64;
    let low = at as usize;
    let (below, above) = (sorted.get(low)?, sorted.get(low + 1).or(sorted.last())?);
    Some(below + (at - low as f64) * (above - below))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three lights of one strength, 120 degrees apart, `slant` off z.
    fn three_lights(slant_rad: f64) -> DMat3 {
        let row = |k: i32| {
            let (sine, cosine) = (f64::from(120 * k)).to_radians().sin_cos();
            DVec3::new(slant_rad.sin() * cosine, slant_rad.sin() * sine, slant_rad.cos())
        };
        DMat3::from_cols(row(0), row(1), row(2)).transpose()
    }

    #[test]
    fn three_lights_have_the_condition_number_of_their_slant() {
        for slant_deg in [1.0_f64, 10.0, 20.0, 33.0, 45.0, 50.0, 54.7] {
            let slant = slant_deg.to_radians();
            let found = condition_number(&three_lights(slant)).expect("three directions");
            let exact = 2f64.sqrt() / slant.tan();
            assert!((found - exact).abs() < 1e-9 * exact, "{slant_deg}: {found} {exact}");
        }
        let steep = 70f64.to_radians();
        let found = condition_number(&three_lights(steep)).expect("three directions");
        assert!((found - steep.tan() / 2f64.sqrt()).abs() < 1e-9, "{found}");
    }

    #[test]
    fn a_missing_colour_and_lights_in_a_plane_have_no_condition_number() {
        let missing = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::ZERO).transpose();
        let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y).transpose();
        for matrix in [missing, flat, DMat3::ZERO, DMat3::from_diagonal(DVec3::splat(f64::NAN))] {
            assert_eq!((condition_number(&matrix), normal_error_rad(&matrix, DVec3::Z)), (None, None));
        }
    }

    #[test]
    fn the_error_of_a_normal_is_that_of_a_numeric_derivative_of_the_solved_normal() {
        let light = DMat3::from_cols_array(&[90.0, 20.0, -35.0, 3.0, 60.0, 41.0, 55.0, 70.0, 48.0]);
        let normal = DVec3::new(0.3, -0.2, 0.9).normalize();
        let solved = |levels: DVec3| light.inverse().mul_vec3(levels).normalize();
        let (levels, step) = (light.mul_vec3(normal), 1e-4);
        let turned =
            |noise: DVec3| (solved(levels + noise * step) - solved(levels - noise * step)) / (2.0 * step);
        let square: f64 = DVec3::AXES.iter().map(|axis| turned(*axis).length_squared()).sum();
        let found = normal_error_rad(&light, normal).expect("an inverse");
        assert!((found / (0.5 * square).sqrt() - 1.0).abs() < 1e-7, "{found} {}", (0.5 * square).sqrt());
    }

    #[test]
    fn slopes_are_told_by_two_colors_where_brightness_is_known_and_not_between_opposite_lights() {
        let light = DMat3::from_cols_array(&[90.0, 20.0, -35.0, 3.0, 60.0, 41.0, 55.0, 70.0, 48.0]) * 10.0;
        let normal = DVec3::new(0.3, -0.2, 0.9).normalize();
        // Of three bright colors brightness, known to a part, tells little.
        let [free, held] =
            [normal_error_rad, slope_error_rad].map(|error| error(&light, normal).expect("three colors"));
        assert!(held < free && held > 0.9 * free, "{held} {free}");
        let two = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)) * light;
        let error = slope_error_rad(&two, normal).expect("two colors and the brightness");
        assert!(
            error > held && error < 20.0 * held && normal_error_rad(&two, normal).is_none(),
            "{error} {held}"
        );
        // Light of each color from both sides is light from above.
        assert_eq!(
            slope_error_rad(&DMat3::from_cols(DVec3::ZERO, DVec3::ZERO, DVec3::splat(200.0)), DVec3::Z),
            None
        );
    }

    #[test]
    fn percentiles_interpolate_and_do_without_values() {
        let values = [1.0, 2.0, 4.0];
        let found = [0.0, 0.25, 0.5, 1.0, 7.0].map(|part| percentile(&values, part));
        assert_eq!(found, [1.0, 1.5, 2.0, 4.0, 4.0].map(Some));
        assert_eq!((percentile(&[], 0.5), percentile(&[3.0], 0.95)), (None, Some(3.0)));
    }
}
