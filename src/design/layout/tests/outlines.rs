//! Sizes and outlines of dots.

use glam::DVec2;

use super::super::*;
use super::spec;
use domecast_optics::camera::LensModel;

#[test]
fn equal_apparent_size_is_equal_in_the_image_and_grows_on_the_dome() {
    let layout = Layout::new(&spec(LensModel::KannalaBrandt, serde_json::json!({}))).unwrap();
    for dot in &layout.dots {
        // A circle's cubics enclose 1.00028 of its area in four pieces.
        assert!((dot.image_outline.equivalent_diameter() / 7.0 - 1.0).abs() < 2e-4);
        assert!((dot.image_outline.centroid() - dot.image_px).length() < 1e-9);
    }
    let diameters = layout.dots.iter().map(|dot| dot.diameter_mm);
    let (low, high) = diameters.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), d| (l.min(d), h.max(d)));
    assert!(low > 0.4 && high < 0.6 && high > low * 1.01, "{low} {high}");
}

#[test]
fn equal_size_on_the_dome_is_a_circle_on_the_dome() {
    let change =
        serde_json::json!({"dot_diameter_px": null, "dot_diameter_mm": 0.5, "polar_angle_deg": 45.0});
    let layout = Layout::new(&spec(LensModel::KannalaBrandt, change)).unwrap();
    for dot in &layout.dots {
        assert_eq!(dot.diameter_mm, 0.5);
        for corner in dot.plate_outline.polygon(8) {
            let on_dome = layout.transfer.dome_from_plate(corner).unwrap();
            let from_center = on_dome.angle_between(dot.surface_mm);
            assert!((10.0 * from_center.sin() - 0.25).abs() < 5e-4, "{from_center}");
        }
        // Orthographic: the disc's flat area, seen from above.
        let flat = std::f64::consts::PI * 0.25 * 0.25 * dot.normal.z;
        assert!((dot.plate_outline.signed_area() / flat - 1.0).abs() < 1e-3);
        let reach = dot.polar_rad() + 0.025f64.asin();
        assert!(reach <= 45f64.to_radians() + 1e-9);
    }
}

#[test]
fn outlines_on_the_plate_follow_the_exact_curve() {
    for even_in in ["raw", "undistorted"] {
        let change = serde_json::json!({"even_in": even_in, "polar_angle_deg": 58.0, "dot_diameter_px": 6.0});
        let spec = spec(LensModel::BrownConrady, change);
        let layout = Layout::new(&spec).unwrap();
        let frame = frame::EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
        for dot in &layout.dots {
            let exact: Vec<DVec2> = (0..720)
                .map(|k| DVec2::from_angle(f64::from(k).to_radians() / 2.0) * 3.0)
                .map(|out| frame.raw_from_even(dot.even_px + out).unwrap())
                .map(|px| spec.optics.trace(px).unwrap().surface_mm)
                .map(|point| layout.transfer.plate_from_dome(point).unwrap())
                .collect();
            for corner in dot.plate_outline.polygon(16) {
                let off = exact.iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
                // The samples of the exact curve are 0.003 mm apart.
                assert!(off < 0.0015 + 0.0005, "{off}");
            }
            let area = 0.5
                * exact.iter().zip(exact.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum::<f64>();
            // The image's y runs down, the plate's y up: the outline turns over on its way.
            assert!((dot.plate_outline.signed_area().abs() / area.abs() - 1.0).abs() < 2e-3);
        }
    }
}

#[test]
fn what_a_dot_holds_does_not_grow_with_their_number() {
    let held = |count: u32| {
        let change =
            serde_json::json!({"count": count, "pitch_px": null, "dot_diameter_px": 0.5, "kind": "fill"});
        let mut spec = spec(LensModel::KannalaBrandt, change);
        spec.print.min_dot_mm = 1e-4;
        spec.print.min_gap_mm = 1e-4;
        let layout = Layout::new(&spec).unwrap();
        assert_eq!(layout.dots.len() + usize::from(layout.key.is_some()), count as usize);
        let numbers = |dot: &Dot| {
            dot.image_outline.pieces().len() + dot.plate_outline.pieces().len() + dot.neighbors.len()
        };
        layout.dots.iter().map(numbers).sum::<usize>() as f64 / layout.dots.len() as f64
    };
    let (few, many) = (held(300), held(6000));
    assert!(many < 1.1 * few, "{few} {many}");
}

#[test]
fn outlines_measure_themselves_exactly() {
    // An ellipse, traced; its area and centroid are known.
    let (half, center) = (DVec2::new(3.0, 1.5), DVec2::new(10.0, -7.0));
    let curve = |angle: f64| -> Result<outline::CurvePoint, ()> {
        let (sin, cos) = angle.sin_cos();
        let at = center + DVec2::new(half.x * cos, half.y * sin);
        Ok(outline::CurvePoint { at, slope: DVec2::new(-half.x * sin, half.y * cos) })
    };
    for tolerance in [1e-2, 1e-4, 1e-6] {
        let (outline, fit) = outline::Outline::of_curve(curve, tolerance).unwrap();
        assert!(fit.reached && fit.error <= tolerance);
        let area = std::f64::consts::PI * half.x * half.y;
        assert!((outline.signed_area() / area - 1.0).abs() < tolerance);
        assert!((outline.centroid() - center).length() < 1e-12);
        // Against a fine polygon of the cubics themselves.
        let polygon = outline.polygon(2000);
        let next = polygon.iter().cycle().skip(1);
        let flat =
            0.5 * polygon.iter().zip(next).map(|(a, b)| (*a - center).perp_dot(*b - center)).sum::<f64>();
        assert!((outline.signed_area() / flat - 1.0).abs() < 1e-6);
        let (narrow, wide) = outline.widths();
        assert!((narrow - 3.0).abs() < 0.01 && (wide - 6.0).abs() < 0.01, "{narrow} {wide}");
        for corner in outline.polygon_within(tolerance) {
            let on = ((corner - center) / half).length();
            assert!((on - 1.0).abs() < tolerance);
        }
    }
    // A failure of the curve is the failure of the outline.
    assert_eq!(outline::Outline::of_curve(|_| Err("no"), 1.0), Err("no"));
}
