//! Poses and wrenches that fill the load envelope that a design claims.

use glam::{DMat3, DVec3};

use domecast_optics::numeric::Rigid;

/// A pose of the platform (`rest_from_platform`) and the wrench that holds it there, about the reference point
/// (N, N*mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedLoad {
    /// The pose.
    pub pose: Rigid,
    /// (Fx, Fy, Fz, Mx, My, Mz).
    pub wrench: [f64; 6],
}

/// Two wrenches nearer than this are one, N and N*mm.
const SAME: f64 = 1e-9;

/// Loads that fill the claims: each claimed wrench at a third, two thirds and in whole, and each half and half with
/// every other at the four quarter turns; all of them at the four quarter turns about the axis and mirrored, so that
/// what is fitted over them favours no direction. Each with the pose that `pose_of` finds for it; loads without a
/// pose are left out.
pub fn loads_over(claims: &[[f64; 6]], mut pose_of: impl FnMut([f64; 6]) -> Option<Rigid>) -> Vec<PosedLoad> {
    let mut wrenches: Vec<[f64; 6]> = Vec::new();
    for (i, claim) in claims.iter().enumerate() {
        for part in [1.0 / 3.0, 2.0 / 3.0, 1.0] {
            wrenches.push(claim.map(|v| v * part));
        }
        for other in &claims[..i] {
            for quarter in 0..4 {
                let whole = turned(*claim, quarter);
                wrenches.push(std::array::from_fn(|k| 0.5 * (whole[k] + other[k])));
            }
        }
    }
    let same = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME);
    let mut all: Vec<[f64; 6]> = Vec::new();
    for wrench in wrenches {
        for one in [wrench, mirrored(wrench)] {
            for quarter in 0..4 {
                let wrench = turned(one, quarter);
                if !all.iter().any(|known| same(known, &wrench)) {
                    all.push(wrench);
                }
            }
        }
    }
    all.into_iter().filter_map(|wrench| Some(PosedLoad { pose: pose_of(wrench)?, wrench })).collect()
}

fn turned(w: [f64; 6], quarter: u32) -> [f64; 6] {
    let turn = DMat3::from_rotation_z(f64::from(quarter) * std::f64::consts::FRAC_PI_2);
    let f = turn * DVec3::new(w[0], w[1], w[2]);
    let m = turn * DVec3::new(w[3], w[4], w[5]);
    [f.x, f.y, f.z, m.x, m.y, m.z]
}

/// The load in the mirror y = 0; a moment turns the other way there.
fn mirrored([fx, fy, fz, mx, my, mz]: [f64; 6]) -> [f64; 6] {
    [fx, -fy, fz, -mx, my, -mz]
}
