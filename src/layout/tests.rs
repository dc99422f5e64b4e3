use glam::{DMat3, DVec2, DVec3};

use super::frame::Undistorted;
use super::*;
use crate::camera::{LensSpec, Model};
use crate::design::{PatternSection, PrintSection};
use crate::numeric::Rigid;
use crate::optics::{Layer, OpticsSpec, SensorOptics};

fn optics(model: Model) -> SensorOptics {
    let distortion = match model {
        Model::Pinhole => vec![],
        Model::BrownConrady => vec![-0.2917, 0.0878, 0.0, 0.0, -0.01156],
        Model::KannalaBrandt => vec![0.0; 4],
    };
    let layer =
        |name: &str, index: f64, thickness_mm| Layer { name: name.into(), index: [index; 3], thickness_mm };
    SensorOptics::new(&OpticsSpec {
        lens: LensSpec {
            model,
            width: 640,
            height: 480,
            matrix: [[229.18, 0.0, 319.5], [0.0, 229.18, 239.5], [0.0, 0.0, 1.0]],
            distortion,
            field_of_view_rad: 160f64.to_radians(),
            pupil_shift_mm: vec![],
        },
        sensor_from_camera: Rigid::new(DMat3::IDENTITY, DVec3::new(0.0, 0.0, -10.0)),
        layers: vec![layer("acrylic", 1.491, Some(1.0)), layer("silicone", 1.41, None)],
        dome_radius_mm: 10.0,
    })
    .unwrap()
}

fn spec(model: Model, pattern: &str) -> LayoutSpec {
    let mut json: serde_json::Value = serde_json::json!({
        "kind": "hexagonal", "pitch_px": 16.0, "dot_diameter_px": 7.0, "polar_angle_deg": 60.0,
        "unprintable": "drop",
    });
    let change: serde_json::Value = serde_json::from_str(pattern).unwrap();
    for (key, value) in change.as_object().unwrap() {
        json[key] = value.clone();
    }
    let pattern: PatternSection = serde_json::from_value(json).unwrap();
    let print: PrintSection = serde_json::from_value(serde_json::json!({
        "min_dot_mm": 0.2, "min_gap_mm": 0.1, "wrap_warn_deg": 50.0, "wrap_limit_deg": 65.0,
        "pad_over_image": 1.3, "dpi": 2400, "outline_tolerance_mm": 0.0005,
    }))
    .unwrap();
    LayoutSpec {
        optics: optics(model),
        undistorted: Undistorted::new(&[[140.0, 0.0, 319.5], [0.0, 140.0, 239.5], [0.0, 0.0, 1.0]]).unwrap(),
        mask: Some(Mask { center_px: DVec2::new(319.5, 239.5), radius_px: 240.0 }),
        white_markers: vec![],
        pattern,
        print,
    }
}

#[test]
fn try_out() {
    for kind in ["hexagonal", "square", "rings", "fill"] {
        for model in [Model::Pinhole, Model::BrownConrady, Model::KannalaBrandt] {
            let t = std::time::Instant::now();
            let layout = Layout::new(&spec(model, &format!("{{\"kind\":\"{kind}\"}}"))).unwrap();
            println!(
                "{kind} {model:?} {} dots {} lost {:?} {:?}",
                layout.dots.len(),
                layout.lost.len(),
                t.elapsed(),
                layout.warnings
            );
            let counts: Vec<usize> =
                (0..8).map(|n| layout.dots.iter().filter(|d| d.neighbors.len() == n).count()).collect();
            println!("{counts:?} edge {} {}", layout.edge.largest_px(), layout.edge.smallest_px());
            let mut d: Vec<f64> = layout.dots.iter().map(|d| d.diameter_mm).collect();
            d.sort_by(f64::total_cmp);
            println!("{} {} pieces {}", d[0], d[d.len() - 1], layout.dots[0].plate_outline.pieces().len());
            let mut nn: Vec<f64> = layout
                .dots
                .iter()
                .map(|d| {
                    layout
                        .dots
                        .iter()
                        .filter(|e| e.id != d.id)
                        .map(|e| e.even_px.distance(d.even_px))
                        .fold(f64::INFINITY, f64::min)
                })
                .collect();
            nn.sort_by(f64::total_cmp);
            let mean = nn.iter().sum::<f64>() / nn.len() as f64;
            let sd = (nn.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / nn.len() as f64).sqrt();
            println!("nn {} .. {} mean {mean} sd {}", nn[0], nn[nn.len() - 1], sd / mean);
        }
    }
}
