//! Dots on caps, and on hemispheres that stand on cylinders.

use domecast_optics::{DomeShape, OpticsSpec};

use super::*;
use crate::layout::lost::{Reason, Zone};
use crate::layout::target::print_target;

fn over(dome: DomeShape, change: serde_json::Value) -> LayoutSpec {
    let mut spec = spec(LensModel::KannalaBrandt, change);
    spec.optics = spec.optics.rebuilt(&OpticsSpec { dome, ..spec.optics.spec() }).unwrap();
    spec
}

#[test]
fn dots_lie_on_the_sphere_and_come_back_from_the_plate() {
    for (dome, polar_deg) in [
        (DomeShape::cap(11.5, 60_f64.to_radians()), 57.0_f64),
        (DomeShape::cap(18.0, 30_f64.to_radians()), 30.0),
        (DomeShape::on_cylinder(9.0, 3.0), 55.0),
    ] {
        for size in ["dot_diameter_px", "dot_diameter_mm"] {
            let value = if size == "dot_diameter_px" { 7.0 } else { 0.5 };
            let mut change = serde_json::json!({ "polar_angle_deg": polar_deg, "dot_diameter_px": null });
            change[size] = value.into();
            let spec = over(dome, change);
            let layout = Layout::new(&spec).unwrap();
            assert!(layout.dots.len() > 60 && layout.lost.is_empty(), "{dome:?} {}", layout.dots.len());
            for dot in &layout.dots {
                let from_center = dot.surface_mm - dome.center_mm();
                assert!((from_center.length() - dome.radius_mm()).abs() < 1e-12 && dot.surface_mm.z > 0.0);
                assert!((from_center / dome.radius_mm() - dot.normal).length() < 1e-12);
                // The orthographic pad shows the dome from above.
                assert!((dot.plate_mm - dot.surface_mm.truncate()).length() < 1e-12);
                let back = layout.transfer.dome_from_plate(dot.plate_mm).unwrap() + dome.center_mm();
                assert!((back - dot.surface_mm).length() < 1e-9);
                let own = (0.5 * dot.diameter_mm / dome.radius_mm()).asin();
                assert!(
                    dot.polar_rad() + own < polar_deg.to_radians() + 0.02,
                    "{dome:?} {}",
                    dot.polar_rad()
                );
            }
        }
    }
}

#[test]
fn the_pad_and_its_target_end_where_the_cap_does() {
    let dome = DomeShape::cap(11.5, 40_f64.to_radians());
    let spec = over(dome, serde_json::json!({ "polar_angle_deg": 38.0 }));
    let transfer = spec.transfer().unwrap();
    assert!((transfer.max_polar_rad() - dome.sphere_end_rad()).abs() < 1e-12);
    let marks = print_target(&transfer, &spec.print);
    let furthest = marks.iter().map(|mark| mark.surface_mm.angle_between(DVec3::Z)).fold(0.0, f64::max);
    assert!(marks.len() > 10 && furthest < dome.sphere_end_rad());
}

#[test]
fn no_dot_hangs_over_the_rim_or_lies_on_the_cylinder() {
    // An edge in pixels knows nothing of the rim: what lies over it is lost by name.
    let change = serde_json::json!({
        "polar_angle_deg": null, "image_radius_px": 200.0, "unseen": "drop", "unprintable": "drop",
        "dot_diameter_px": null, "dot_diameter_mm": 0.6,
    });
    let cap = Layout::new(&over(DomeShape::cap(11.5, 50_f64.to_radians()), change.clone())).unwrap();
    assert!(cap.lost.iter().any(|dot| matches!(dot.reason, Reason::KeepOut(Zone::Rim))));
    let end = 50_f64.to_radians();
    assert!(cap.dots.iter().all(|dot| dot.polar_rad() + 0.5 * dot.diameter_mm / 11.5 <= end + 1e-3));
    let pillar = Layout::new(&over(DomeShape::on_cylinder(9.0, 4.0), change)).unwrap();
    assert!(pillar.dots.iter().all(|dot| dot.surface_mm.z > 4.0));
    assert!(pillar.lost.iter().any(|dot| matches!(dot.reason, Reason::BeyondWrap { .. })));
}
