//! A neo-Hookean brick with the mean dilatation of its eight points.
//!
//! Psi = mu/2 (J^(-2/3) tr F'F - 3) at each point, and kappa/2 ((theta^2 - 1)/2 - ln theta) of the element's mean
//! change of volume theta (J. C. Simo, R. L. Taylor, K. S. Pister, Comput. Methods Appl. Mech. Eng. 51, 1985): one
//! volume constraint per brick, so that it does not lock towards incompressibility. Gradient and tangent are the
//! energy's exact derivatives.

use glam::{DMat3, DVec3};
use nalgebra::SMatrix;

/// Three displacements at each of eight corners.
pub(super) const DOFS: usize = 24;

/// Energy (N*mm), its gradient (N), its second derivative (N/mm).
pub(super) struct Response {
    #[cfg_attr(not(test), expect(dead_code, reason = "what force and stiffness are the derivatives of"))]
    pub energy: f64,
    pub force: [DVec3; 8],
    pub stiffness: Option<Box<SMatrix<f64, DOFS, DOFS>>>,
}

const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// One integration point: gradients of the shape functions over the rest shape (1/mm), its volume (mm3).
pub(super) type Point = ([DVec3; 8], f64);

/// The eight points of a brick at rest; `None` if it is turned inside out.
pub(super) fn points(nodes_mm: &[DVec3; 8]) -> Option<[Point; 8]> {
    let mut out = [([DVec3::ZERO; 8], 0.0); 8];
    for (point, place) in out.iter_mut().zip(CORNERS) {
        let at = place.map(|c| c / 3.0_f64.sqrt());
        let local = CORNERS.map(|c| {
            let factor: [f64; 3] = std::array::from_fn(|d| 1.0 + c[d] * at[d]);
            DVec3::new(
                0.125 * c[0] * factor[1] * factor[2],
                0.125 * c[1] * factor[0] * factor[2],
                0.125 * c[2] * factor[0] * factor[1],
            )
        });
        // Columns: derivatives of the place by the local coordinates.
        let mut jacobian = DMat3::ZERO;
        for (g, x) in local.iter().zip(nodes_mm) {
            jacobian += DMat3::from_cols(*x * g.x, *x * g.y, *x * g.z);
        }
        let volume = jacobian.determinant();
        if volume.is_nan() || volume <= 0.0 {
            return None;
        }
        let back = jacobian.inverse().transpose();
        *point = (local.map(|g| back * g), volume);
    }
    Some(out)
}

/// The response of a brick to its corners' displacements; `None` where a point has turned inside out.
pub(super) fn respond(
    points: &[Point; 8],
    u_mm: &[DVec3; 8],
    shear_mpa: f64,
    bulk_mpa: f64,
    tangent: bool,
) -> Option<Response> {
    let mut energy = 0.0;
    let mut force = [DVec3::ZERO; 8];
    let (mut rest, mut now) = (0.0, 0.0);
    let mut swell = [DVec3::ZERO; 8];
    let mut states = [(DMat3::ZERO, DMat3::ZERO, 0.0, 0.0); 8];
    for ((gradients, volume), state) in points.iter().zip(&mut states) {
        let mut f = DMat3::IDENTITY;
        for (g, u) in gradients.iter().zip(u_mm) {
            f += DMat3::from_cols(*u * g.x, *u * g.y, *u * g.z);
        }
        let j = f.determinant();
        if j.is_nan() || j <= 0.05 {
            return None;
        }
        let back = f.inverse().transpose();
        let scale = shear_mpa * j.powf(-2.0 / 3.0);
        let trace = f.to_cols_array().iter().map(|e| e * e).sum::<f64>();
        energy += volume * 0.5 * (scale * trace - 3.0 * shear_mpa);
        rest += volume;
        now += volume * j;
        for ((force, swell), g) in force.iter_mut().zip(&mut swell).zip(gradients) {
            let here = back * *g;
            *force += (f * *g - here * (trace / 3.0)) * (scale * volume);
            *swell += here * (j * volume);
        }
        *state = (f, back, j, trace);
    }
    let theta = now / rest;
    energy += rest * 0.5 * bulk_mpa * (0.5 * (theta * theta - 1.0) - theta.ln());
    let pressure = 0.5 * bulk_mpa * (theta - 1.0 / theta);
    for (force, swell) in force.iter_mut().zip(&swell) {
        *force += *swell * pressure;
    }
    let stiffness = tangent.then(|| {
        let mut k = Box::new(SMatrix::<f64, DOFS, DOFS>::zeros());
        for ((gradients, volume), (f, back, j, trace)) in points.iter().zip(&states) {
            let scale = shear_mpa * j.powf(-2.0 / 3.0) * volume;
            let here = gradients.map(|g| *back * g);
            let there = gradients.map(|g| *f * g);
            let p = pressure * j * volume;
            for a in 0..8 {
                for b in 0..8 {
                    let same = scale * gradients[a].dot(gradients[b]);
                    let (ga, gb) = (here[a].to_array(), here[b].to_array());
                    let (ha, hb) = (there[a].to_array(), there[b].to_array());
                    for i in 0..3 {
                        for l in 0..3 {
                            let iso = (2.0 / 9.0) * trace * ga[i] * gb[l] + trace / 3.0 * gb[i] * ga[l]
                                - (2.0 / 3.0) * (ha[i] * gb[l] + ga[i] * hb[l]);
                            let volumetric = p * (ga[i] * gb[l] - gb[i] * ga[l]);
                            k[(3 * a + i, 3 * b + l)] += scale * iso + volumetric;
                        }
                        k[(3 * a + i, 3 * b + i)] += same;
                    }
                }
            }
        }
        let curvature = 0.5 * bulk_mpa * (1.0 + 1.0 / (theta * theta)) / rest;
        for a in 0..8 {
            for b in 0..8 {
                for (i, qa) in swell[a].to_array().into_iter().enumerate() {
                    for (l, qb) in swell[b].to_array().into_iter().enumerate() {
                        k[(3 * a + i, 3 * b + l)] += curvature * qa * qb;
                    }
                }
            }
        }
        k
    });
    energy.is_finite().then_some(Response { energy, force, stiffness })
}
