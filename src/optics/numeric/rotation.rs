//! Rotation vectors (axis times angle) and rotation matrices.

use glam::{DMat3, DVec3};

/// The matrix `[v]x` with `[v]x w = v x w`.
pub fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}

/// The rotation by `|vector|` radians about `vector` (Rodrigues' formula), exact at and near zero.
pub fn rotation_from_vector(vector_rad: DVec3) -> DMat3 {
    let angle = vector_rad.length();
    let cross = cross_matrix(vector_rad);
    // Below this angle the next terms of both series are under the rounding of 1.
    let (sine, versine) = if angle < 1e-4 {
        (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
    } else {
        let half = (0.5 * angle).sin() / angle;
        (angle.sin() / angle, 2.0 * half * half)
    };
    DMat3::IDENTITY + cross * sine + cross * cross * versine
}

/// The rotation vector of a rotation matrix, angle in [0, pi], to rounding at every angle.
///
/// At exactly half a turn both signs of the axis are right; the one whose largest component is
/// positive is given. The matrix is taken as it is: its departure from a rotation goes into the result.
pub fn vector_from_rotation(rotation: &DMat3) -> DVec3 {
    let r = |row: usize, col: usize| rotation.col(col)[row];
    let twice_sine = DVec3::new(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
    let trace = r(0, 0) + r(1, 1) + r(2, 2);
    let sine = 0.5 * twice_sine.length();
    let cosine = 0.5 * (trace - 1.0);
    let angle = sine.atan2(cosine);
    if cosine > -0.5 {
        // sin(x)/x is far from zero here.
        let scale = if sine < 1e-8 { 0.5 } else { 0.5 * angle / sine };
        return twice_sine * scale;
    }
    // Towards half a turn the antisymmetric part fades: take the axis from the symmetric one,
    // (R + R^T)/2 = cos I + (1 - cos) a a^T, by its largest diagonal entry.
    let versine = 1.0 - cosine;
    let squares = DVec3::new(r(0, 0) - cosine, r(1, 1) - cosine, r(2, 2) - cosine) / versine;
    let big = if squares.x >= squares.y && squares.x >= squares.z {
        0
    } else if squares.y >= squares.z {
        1
    } else {
        2
    };
    let mut axis = DVec3::ZERO;
    for i in 0..3 {
        let symmetric = 0.5 * (r(i, big) + r(big, i));
        axis[i] = if i == big { symmetric - cosine } else { symmetric };
    }
    let axis = axis.normalize_or_zero();
    if axis.dot(twice_sine) < 0.0 { -axis * angle } else { axis * angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vector_and_matrix_invert_each_other_at_every_angle() {
        for angle in
            [0.0, 1e-12, 1e-9, 9e-5, 1.1e-4, 0.3, 1.5, 2.0, 2.2, 3.0, 3.13, std::f64::consts::PI - 1e-9]
        {
            for axis in [
                DVec3::X,
                -DVec3::Y,
                DVec3::new(1.0, -2.0, 0.5).normalize(),
                DVec3::new(-0.1, 0.2, -3.0).normalize(),
            ] {
                let vector = axis * angle;
                let matrix = rotation_from_vector(vector);
                assert!(
                    (matrix.transpose() * matrix - DMat3::IDENTITY)
                        .to_cols_array()
                        .iter()
                        .all(|e| e.abs() < 4e-15)
                );
                let back = vector_from_rotation(&matrix);
                assert!((back - vector).length() < 1e-14 * (1.0 + angle), "{vector} {back}");
            }
        }
    }

    #[test]
    fn half_a_turn_has_its_axis() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(2.0, -1.0, 0.3).normalize()] {
            let back = vector_from_rotation(&rotation_from_vector(axis * std::f64::consts::PI));
            assert!(back.length() - std::f64::consts::PI < 1e-15);
            assert!(back.cross(axis).length() < 1e-14);
        }
    }
}
