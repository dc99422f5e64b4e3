//! One triquadratic hexahedron of a nearly incompressible neo-Hookean body.
//!
//! Energy mu/2 (J^(-2/3) tr C - 3) + kappa/2 (P(J - 1))^2, total Lagrangian. P projects on functions that are linear in the
//! element's local coordinates: the mixed element Q2/P-1 with its pressure eliminated, which does not lock and is of second
//! order in stress (T. Sussman and K.-J. Bathe, Computers & Structures 26, 1987; D. Boffi, F. Brezzi and M. Fortin, Mixed
//! Finite Element Methods, 2013, 8.6).

use glam::{DMat3, DVec3};
use nalgebra::{Matrix4, Vector4};

/// Nodes of an element, points of its quadrature (three Gauss points a direction).
pub(crate) const NODES: usize = 27;

/// Shape functions of three nodes at -1, 0, 1 and their slopes.
pub(crate) fn quadratic(t: f64) -> ([f64; 3], [f64; 3]) {
    ([0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)], [t - 0.5, -2.0 * t, t + 0.5])
}

/// Material constants, MPa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Material {
    pub shear_mpa: f64,
    pub bulk_mpa: f64,
}

/// What stays of an element while it deforms.
#[derive(Debug, Clone)]
pub(crate) struct Element {
    /// By point: gradients of the shape functions on the undeformed body, 1/mm.
    gradients: Vec<[DVec3; NODES]>,
    /// By point: volume, mm3.
    volumes_mm3: [f64; NODES],
    /// Inverse of the pressures' mass matrix.
    inverse_mass: Matrix4<f64>,
}

/// Pressure functions at a point.
fn pressures(point: usize) -> Vector4<f64> {
    let [xi, eta, zeta] = local(point);
    Vector4::new(1.0, xi, eta, zeta)
}

fn local(point: usize) -> [f64; 3] {
    const AT: [f64; 3] = [-0.774_596_669_241_483_4, 0.0, 0.774_596_669_241_483_4];
    [AT[point % 3], AT[point / 3 % 3], AT[point / 9]]
}

fn weight(point: usize) -> f64 {
    const WEIGHTS: [f64; 3] = [5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0];
    WEIGHTS[point % 3] * WEIGHTS[point / 3 % 3] * WEIGHTS[point / 9]
}

/// Forces and, where asked for, tangent of an element.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    pub forces_n: [DVec3; NODES],
    /// By node of the row, node of the column; empty where not asked for. Only columns up to the row are filled.
    pub tangent: Vec<DMat3>,
}

/// State of one point.
struct Point {
    deformation: DMat3,
    /// Inverse transposed.
    cofactor: DMat3,
    volume: f64,
}

impl Element {
    /// Of the places of its nodes; `None` if it is inside out somewhere.
    pub fn new(places_mm: &[DVec3; NODES]) -> Option<Self> {
        let mut gradients = Vec::with_capacity(NODES);
        let mut volumes_mm3 = [0.0; NODES];
        let mut mass = Matrix4::zeros();
        for (point, volume_mm3) in volumes_mm3.iter_mut().enumerate() {
            let [a, b, c] = local(point).map(quadratic);
            let slopes: [DVec3; NODES] = std::array::from_fn(|k| {
                let [p, q, r] = [k % 3, k / 3 % 3, k / 9];
                DVec3::new(a.1[p] * b.0[q] * c.0[r], a.0[p] * b.1[q] * c.0[r], a.0[p] * b.0[q] * c.1[r])
            });
            let mut jacobian = DMat3::ZERO;
            for (place, slope) in places_mm.iter().zip(&slopes) {
                jacobian += outer(*place, *slope);
            }
            let determinant = jacobian.determinant();
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            let back = jacobian.inverse().transpose();
            gradients.push(slopes.map(|slope| back * slope));
            *volume_mm3 = weight(point) * determinant;
            let n = pressures(point);
            mass += n * n.transpose() * *volume_mm3;
        }
        Some(Self { gradients, volumes_mm3, inverse_mass: mass.try_inverse()? })
    }

    /// Inner forces for a displacement; `None` if a point is turned inside out.
    pub fn answer(&self, displaced_mm: &[DVec3; NODES], material: Material, tangent: bool) -> Option<Answer> {
        let mut points = Vec::with_capacity(NODES);
        let mut growth = Vector4::zeros();
        for (point, gradients) in self.gradients.iter().enumerate() {
            let mut deformation = DMat3::IDENTITY;
            for (u, gradient) in displaced_mm.iter().zip(gradients) {
                deformation += outer(*u, *gradient);
            }
            let volume = deformation.determinant();
            if volume.is_nan() || volume <= 1e-3 {
                return None;
            }
            growth += pressures(point) * (self.volumes_mm3[point] * (volume - 1.0));
            points.push(Point { deformation, cofactor: deformation.inverse().transpose(), volume });
        }
        let pressure = self.inverse_mass * growth * material.bulk_mpa;
        let mut answer = Answer {
            forces_n: [DVec3::ZERO; NODES],
            tangent: if tangent { vec![DMat3::ZERO; NODES * NODES] } else { Vec::new() },
        };
        let mut coupling = [[DVec3::ZERO; NODES]; 4];
        for (number, point) in points.iter().enumerate() {
            self.add_point(
                number,
                point,
                (material, pressure.dot(&pressures(number))),
                &mut answer,
                &mut coupling,
            );
        }
        if tangent {
            let bulk = self.inverse_mass * material.bulk_mpa;
            for a in 0..NODES {
                let rows: [DVec3; 4] =
                    std::array::from_fn(|p| (0..4).map(|q| coupling[q][a] * bulk[(p, q)]).sum());
                for b in 0..=a {
                    let block = &mut answer.tangent[a * NODES + b];
                    for (row, column) in rows.iter().zip(&coupling) {
                        *block += outer(*row, column[b]);
                    }
                }
            }
        }
        Some(answer)
    }

    /// Adds a point's part. The first Piola stress is s F + (p J - s I1 / 3) F^-T with s = mu J^(-2/3).
    fn add_point(
        &self,
        number: usize,
        point: &Point,
        (material, pressure_mpa): (Material, f64),
        answer: &mut Answer,
        coupling: &mut [[DVec3; NODES]; 4],
    ) {
        let (gradients, weight) = (&self.gradients[number], self.volumes_mm3[number]);
        let f = &point.deformation;
        let first = f.x_axis.length_squared() + f.y_axis.length_squared() + f.z_axis.length_squared();
        let s = weight * material.shear_mpa * point.volume.powf(-2.0 / 3.0);
        let bulk = weight * pressure_mpa * point.volume;
        let along: [DVec3; NODES] = std::array::from_fn(|a| point.cofactor * gradients[a]);
        let stretched: [DVec3; NODES] = std::array::from_fn(|a| *f * gradients[a]);
        for a in 0..NODES {
            answer.forces_n[a] += stretched[a] * s + along[a] * (bulk - s * first / 3.0);
        }
        if answer.tangent.is_empty() {
            return;
        }
        let both = 0.5 * (2.0 / 9.0 * s * first + bulk);
        let crossed = s * first / 3.0 - bulk;
        let mixed: [DVec3; NODES] =
            std::array::from_fn(|a| stretched[a] * (-2.0 / 3.0 * s) + along[a] * both);
        for a in 0..NODES {
            for b in 0..=a {
                let block = &mut answer.tangent[a * NODES + b];
                let even = s * gradients[a].dot(gradients[b]);
                *block += outer(mixed[a], along[b])
                    + outer(along[a], mixed[b])
                    + outer(along[b] * crossed, along[a])
                    + DMat3::from_diagonal(DVec3::splat(even));
            }
        }
        let n = pressures(number);
        for (p, row) in coupling.iter_mut().enumerate() {
            for a in 0..NODES {
                row[a] += along[a] * (weight * n[p] * point.volume);
            }
        }
    }
}

/// a b^T.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> [DVec3; NODES] {
        std::array::from_fn(|k| {
            let [i, j, l] = [k % 3, k / 3 % 3, k / 9].map(|v| v as f64);
            DVec3::new(i + 0.1 * j * l, 0.8 * j - 0.05 * i * i, 1.1 * l + 0.06 * i * j)
        })
    }

    #[test]
    fn the_tangent_is_the_derivative_of_the_forces() {
        let element = Element::new(&places()).unwrap();
        let material = Material { shear_mpa: 0.2, bulk_mpa: 9.0 };
        let wave = |k: usize, p: f64| (p * k as f64).sin();
        let u: [DVec3; NODES] =
            std::array::from_fn(|k| DVec3::new(wave(k, 1.3), wave(k, 2.1), wave(k, 0.7)) * 0.08);
        let v: [DVec3; NODES] = std::array::from_fn(|k| DVec3::new(wave(k, 0.4), wave(k, 1.9), wave(k, 3.1)));
        let at = |t: f64| {
            let moved: [DVec3; NODES] = std::array::from_fn(|k| u[k] + v[k] * t);
            element.answer(&moved, material, false).unwrap().forces_n
        };
        let tangent = element.answer(&u, material, true).unwrap().tangent;
        let (more, less) = (at(1e-5), at(-1e-5));
        for a in 0..NODES {
            let by_tangent: DVec3 = (0..NODES)
                .map(|b| {
                    let block =
                        if b <= a { tangent[a * NODES + b] } else { tangent[b * NODES + a].transpose() };
                    block * v[b]
                })
                .sum();
            let by_difference = (more[a] - less[a]) / 2e-5;
            assert!(by_tangent.distance(by_difference) < 1e-6 * by_tangent.length().max(1.0), "{a}");
        }
    }

    #[test]
    fn a_turn_costs_nothing_and_an_even_stretch_is_in_balance_inside() {
        let element = Element::new(&places()).unwrap();
        let material = Material { shear_mpa: 0.2, bulk_mpa: 9.0 };
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 2.2);
        let of = |f: DMat3| {
            let u = places().map(|x| f * x - x);
            element.answer(&u, material, false).unwrap().forces_n
        };
        assert!(of(turn).iter().all(|force| force.length() < 1e-12));
        // The middle node of an evenly stretched body bears nothing: the stress has no divergence.
        let even = of(DMat3::from_diagonal(DVec3::new(1.2, 0.9, 0.95)));
        assert!(even[13].length() < 1e-12, "{}", even[13]);
        // Uniaxial: traction times area on the end face, by the law itself.
        assert!(even.iter().copied().sum::<DVec3>().length() < 1e-12);
    }
}
