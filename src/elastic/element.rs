//! Stiffness of a nine-node quadrilateral swept about the axis, by harmonic.
//!
//! A displacement u_r, u_z ~ cos(m phi), u_phi ~ sin(m phi) keeps its form in a body of revolution (E. L. Wilson,
//! Structural analysis of axisymmetric solids, AIAA J. 3, 1965). Its strain is B0 + m B1, so the stiffness is a
//! quadratic in m: K0 + m K1 + m^2 K2. The change of volume is projected on 1, xi, eta in each element (the
//! pressure of the Q2/P-1 pair, which is stable up to incompressibility: D. Boffi, F. Brezzi, M. Fortin, Mixed
//! Finite Element Methods, 2013, 8.6), so that nothing locks near Poisson's ratio 1/2.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

/// Three displacements (r, z, phi) at each of nine nodes.
pub(crate) const DOFS: usize = 27;
pub(crate) type Stiffness = SMatrix<f64, DOFS, DOFS>;

/// K0, K1, K2 of one element, without the factor of the sweep (pi, or 2 pi for m = 0).
pub(crate) fn stiffness(nodes_mm: [DVec2; 9], shear_mpa: f64, bulk_mpa: f64) -> [Stiffness; 3] {
    let mut k = [Stiffness::zeros(), Stiffness::zeros(), Stiffness::zeros()];
    let mut volume = [SMatrix::<f64, 3, DOFS>::zeros(), SMatrix::<f64, 3, DOFS>::zeros()];
    let mut mass = SMatrix::<f64, 3, 3>::zeros();
    for (xi, wx) in GAUSS {
        for (eta, we) in GAUSS {
            let (n, dx, de) = shapes(xi, eta);
            let mut at = DVec2::ZERO;
            let (mut by_xi, mut by_eta) = (DVec2::ZERO, DVec2::ZERO);
            for i in 0..9 {
                at += nodes_mm[i] * n[i];
                by_xi += nodes_mm[i] * dx[i];
                by_eta += nodes_mm[i] * de[i];
            }
            let jacobian = by_xi.perp_dot(by_eta);
            let weight = wx * we * jacobian.abs() * at.x;
            let mut b = [SMatrix::<f64, 6, DOFS>::zeros(), SMatrix::<f64, 6, DOFS>::zeros()];
            for i in 0..9 {
                // Gradient by the inverse Jacobian.
                let dr = (dx[i] * by_eta.y - de[i] * by_xi.y) / jacobian;
                let dz = (de[i] * by_xi.x - dx[i] * by_eta.x) / jacobian;
                let over_r = n[i] / at.x;
                let (r, z, phi) = (3 * i, 3 * i + 1, 3 * i + 2);
                // Rows: rr, zz, phi phi, rz, r phi, z phi (engineering shears).
                b[0][(0, r)] = dr;
                b[0][(1, z)] = dz;
                b[0][(2, r)] = over_r;
                b[1][(2, phi)] = over_r;
                b[0][(3, r)] = dz;
                b[0][(3, z)] = dr;
                b[1][(4, r)] = -over_r;
                b[0][(4, phi)] = dr - over_r;
                b[0][(5, phi)] = dz;
                b[1][(5, z)] = -over_r;
            }
            let deviatoric = [deviator(&b[0], shear_mpa), deviator(&b[1], shear_mpa)];
            k[0] += b[0].tr_mul(&deviatoric[0]) * weight;
            let mixed = b[0].tr_mul(&deviatoric[1]) * weight;
            k[1] += mixed + mixed.transpose();
            k[2] += b[1].tr_mul(&deviatoric[1]) * weight;
            let psi = SVector::<f64, 3>::new(1.0, xi, eta);
            mass += psi * psi.transpose() * weight;
            for (volume, b) in volume.iter_mut().zip(&b) {
                let trace = b.row(0) + b.row(1) + b.row(2);
                *volume += psi * trace * weight;
            }
        }
    }
    let inverse = mass.try_inverse().unwrap_or_else(SMatrix::zeros) * bulk_mpa;
    let lifted = [inverse * volume[0], inverse * volume[1]];
    k[0] += volume[0].tr_mul(&lifted[0]);
    let mixed = volume[0].tr_mul(&lifted[1]);
    k[1] += mixed + mixed.transpose();
    k[2] += volume[1].tr_mul(&lifted[1]);
    k
}

/// 2 G times the deviator of the strain; shears have the engineering factor 2.
fn deviator(b: &SMatrix<f64, 6, DOFS>, shear_mpa: f64) -> SMatrix<f64, 6, DOFS> {
    let mut out = b * shear_mpa;
    let third = (b.row(0) + b.row(1) + b.row(2)) / 3.0;
    for row in 0..3 {
        let deviatoric = (b.row(row) - third) * (2.0 * shear_mpa);
        out.set_row(row, &deviatoric);
    }
    out
}

/// Three-point Gauss rule on [-1, 1].
pub(crate) const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Quadratic shape functions on -1, 0, 1 and their slopes.
pub(crate) fn quadratic(t: f64) -> ([f64; 3], [f64; 3]) {
    ([0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)], [t - 0.5, -2.0 * t, t + 0.5])
}

fn shapes(xi: f64, eta: f64) -> ([f64; 9], [f64; 9], [f64; 9]) {
    let ((a, da), (b, db)) = (quadratic(xi), quadratic(eta));
    let pick = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|i| p[i % 3] * q[i / 3]);
    (pick(a, b), pick(da, b), pick(a, db))
}
