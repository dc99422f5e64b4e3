//! Random lenses and sensors, from published ones to absurd ones.

use std::f64::consts::PI;

use domecast::camera::{LensModel, LensSpec};
use domecast::numeric::{Rigid, SeededRandom};
use domecast::optics::{FlatLayer, OpticsSpec};
use glam::{DMat3, DVec3};

pub fn lens_spec(r: &mut SeededRandom) -> LensSpec {
    let (model, distortion, widest) = match r.next_u64() % 8 {
        0 => (LensModel::Pinhole, vec![], 179.9),
        // Like published ones, then anything.
        1 | 2 => {
            let p = if r.next_u64().is_multiple_of(2) { 0.0 } else { 0.005 };
            let k = vec![
                r.between(-0.35, 0.1),
                r.between(-0.05, 0.12),
                p * r.between(-1.0, 1.0),
                p * r.between(-1.0, 1.0),
                r.between(-0.02, 0.02),
            ];
            (LensModel::BrownConrady, k, 179.9)
        }
        3 => {
            let size = 10f64.powf(r.between(-2.0, 2.0));
            let mut k: Vec<f64> = (0..5).map(|_| size * r.between(-1.0, 1.0)).collect();
            k[2] *= 0.02;
            k[3] *= 0.02;
            (LensModel::BrownConrady, k, 179.9)
        }
        4 => {
            let mut k: Vec<f64> = (0..8).map(|_| r.between(-1.0, 1.0)).collect();
            k[2] *= 0.01;
            k[3] *= 0.01;
            (LensModel::BrownConrady, k, 179.9)
        }
        5 | 6 => {
            let k = (0..4).map(|_| r.between(-0.06, 0.06)).collect();
            (LensModel::KannalaBrandt, k, 260.0)
        }
        _ => {
            let k = (0..4).map(|_| r.between(-0.5, 0.5)).collect();
            (LensModel::KannalaBrandt, k, 360.0)
        }
    };
    let fx = 10f64.powf(r.between(1.7, 3.3));
    LensSpec {
        model,
        width: 640,
        height: 480,
        matrix: [
            [fx, 0.0, r.between(200.0, 400.0)],
            [0.0, fx * r.between(0.95, 1.05), r.between(100.0, 300.0)],
            [0.0, 0.0, 1.0],
        ],
        distortion,
        field_of_view_rad: r.between(20.0, widest).to_radians(),
        pupil_shift_mm: vec![],
    }
}

pub fn optics_spec(r: &mut SeededRandom, mut lens: LensSpec) -> OpticsSpec {
    let radius = 10f64.powf(r.between(-1.0, 3.0));
    let mut layers = Vec::new();
    let mut last = 1.0;
    for _ in 0..r.next_u64() % 5 {
        let index = match r.next_u64() % 8 {
            0 => last,
            1 => 1.0,
            _ => r.between(1.0, 2.5),
        };
        last = index;
        let thickness = if r.next_u64().is_multiple_of(5) { 0.0 } else { radius * r.between(0.0, 0.3) };
        layers.push(FlatLayer {
            name: "sheet".into(),
            index: [index, (index * 1.002).min(2.5), index * 1.005],
            thickness_mm: Some(thickness),
        });
    }
    let fill = if r.next_u64().is_multiple_of(6) { 1.0 } else { r.between(1.0, 2.0) };
    layers.push(FlatLayer { name: "fill".into(), index: [fill; 3], thickness_mm: None });
    let bottom: f64 = layers.iter().filter_map(|l| l.thickness_mm).sum();
    let gap = match r.next_u64() % 8 {
        0 => 0.0,
        1 => radius * 1e-4,
        _ => radius * r.between(0.01, 2.0),
    };
    let mut rotation = DMat3::IDENTITY;
    let mut at = DVec3::new(0.0, 0.0, -bottom - gap);
    if r.next_u64().is_multiple_of(2) {
        rotation = DMat3::from_rotation_z(r.between(-PI, PI)) * DMat3::from_rotation_x(r.between(-0.5, 0.5));
        at.x = radius * r.between(-0.5, 0.5);
        at.y = radius * r.between(-0.5, 0.5);
    }
    if r.next_u64().is_multiple_of(4) && gap > 0.0 {
        // A shift worth up to a fifth of the gap at the domain's end.
        let half = (0.5 * lens.field_of_view_rad).min(PI);
        lens.pupil_shift_mm = vec![0.2 * gap * r.between(-1.0, 1.0) / (half * half)];
    }
    OpticsSpec {
        lens,
        sensor_from_camera: Rigid::new(rotation, at),
        layers,
        dome: domecast::optics::DomeShape::hemisphere(radius),
    }
}
