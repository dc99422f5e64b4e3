//! Caps, and hemispheres on cylinders.

use super::*;

/// Caps, the hemisphere, and hemispheres on cylinders.
fn shapes() -> [DomeShape; 6] {
    [
        DomeShape::cap(10.0, 20_f64.to_radians()),
        DomeShape::cap(10.0, 60_f64.to_radians()),
        DomeShape::cap(10.0, 85_f64.to_radians()),
        DomeShape::hemisphere(10.0),
        DomeShape::on_cylinder(9.0, 1.0),
        DomeShape::on_cylinder(6.0, 7.0),
    ]
}

#[test]
fn every_shape_is_traced_and_projected_back() {
    for shape in shapes() {
        for mut spec in lenses() {
            spec.dome = shape;
            spec.sensor_from_camera = Rigid::new(DMat3::from_rotation_y(0.1), DVec3::new(0.4, -0.3, -9.0));
            let optics = SensorOptics::new(&spec).unwrap();
            let (mut seen, mut on_wall) = (0, 0);
            for v in (0..480).step_by(12) {
                for u in (0..640).step_by(12) {
                    let pixel = DVec2::new(f64::from(u) + 0.25, f64::from(v) - 0.125);
                    let Ok(hit) = optics.trace(pixel) else { continue };
                    seen += 1;
                    let at = hit.surface_mm;
                    // The face by its definition, not by the code's own words.
                    let above = at.z - shape.center_z_mm();
                    let off = if above < 0.0 && shape.center_z_mm() > 0.0 {
                        on_wall += 1;
                        assert_eq!(hit.normal.z, 0.0);
                        at.truncate().length() - shape.radius_mm()
                    } else {
                        at.distance(shape.center_mm()) - shape.radius_mm()
                    };
                    assert!(off.abs() < 1e-13 * shape.radius_mm(), "{off:e}");
                    assert!(at.z >= 0.0 && (hit.normal.length() - 1.0).abs() < 1e-13);
                    let back = optics.project(at).unwrap();
                    assert!((back - pixel).length() < 1e-8, "{pixel} came back as {back}");
                    slopes_agree(&optics, pixel, &shape);
                }
            }
            assert!(seen > 60, "{shape:?}: {seen}");
            assert_eq!(on_wall > 0, shape.center_z_mm() > 0.0, "{shape:?}");
        }
    }
}

/// The derivative of a trace against differences, away from the circle where cylinder and sphere meet.
fn slopes_agree(optics: &SensorOptics, pixel: DVec2, shape: &DomeShape) {
    let (hit, slope) = optics.trace_with_jacobian(pixel).unwrap();
    let near_edge = (hit.surface_mm.z - shape.center_z_mm()).abs() < 0.05 || hit.surface_mm.z < 0.05;
    if near_edge {
        return;
    }
    for (column, step) in [DVec2::new(1e-4, 0.0), DVec2::new(0.0, 1e-4)].into_iter().enumerate() {
        let (Ok(a), Ok(b)) = (optics.trace(pixel - step), optics.trace(pixel + step)) else { return };
        let by_difference = (b.surface_mm - a.surface_mm) / 2e-4;
        let by_slope = DVec3::new(slope[(0, column)], slope[(1, column)], slope[(2, column)]);
        assert!((by_difference - by_slope).length() < 1e-5 * (1.0 + by_slope.length()), "{pixel}");
    }
}

#[test]
fn what_goes_on_below_the_rim_is_met_smoothly() {
    for shape in shapes() {
        let mut spec = spec(LensModel::KannalaBrandt, &[0.0; 4]);
        spec.dome = shape;
        let optics = SensorOptics::new(&spec).unwrap();
        let rim = optics.project(shape.point_mm(shape.meridian_end_rad(), 0.3)).unwrap();
        let out = (rim - DVec2::new(319.5, 239.5)).normalize();
        let (inner, _) = optics.trace_continued(rim - out * 1e-4).unwrap();
        let (outer, _) = optics.trace_continued(rim + out * 1e-4).unwrap();
        assert!(inner.z > 0.0 && outer.z < 0.0, "{shape:?}: {inner} {outer}");
        assert!(inner.distance(outer) < 0.01, "{shape:?}: {inner} {outer}");
        assert_eq!(optics.trace(rim + out * 0.01), Err(RayLimit::MissesDome));
    }
}

#[test]
fn area_volume_and_centroid_by_slices() {
    for shape in shapes() {
        let (steps, top) = (200_000, shape.height_mm());
        let (mut volume, mut moment, mut area) = (0.0, 0.0, 0.0);
        let radius_at = |z: f64| {
            let above = z - shape.center_z_mm();
            let above = if shape.center_z_mm() > 0.0 { above.max(0.0) } else { above };
            (shape.radius_mm().powi(2) - above * above).max(0.0).sqrt()
        };
        for i in 0..steps {
            let (low, high) =
                (top * f64::from(i) / f64::from(steps), top * f64::from(i + 1) / f64::from(steps));
            let (a, b) = (radius_at(low), radius_at(high));
            let slice = std::f64::consts::PI * radius_at(0.5 * (low + high)).powi(2) * (high - low);
            volume += slice;
            moment += slice * 0.5 * (low + high);
            area += std::f64::consts::PI * (a + b) * (high - low).hypot(a - b);
        }
        assert!((shape.volume_mm3() / volume - 1.0).abs() < 1e-8, "{shape:?}");
        assert!((shape.centroid_z_mm() / (moment / volume) - 1.0).abs() < 1e-7, "{shape:?}");
        assert!((shape.area_mm2() / area - 1.0).abs() < 1e-6, "{shape:?}");
        // Levels share the area evenly, and the meridian's end is the rim.
        let rim = shape.point_mm(shape.meridian_end_rad(), 1.0);
        assert!(rim.z.abs() < 1e-12 && (rim.truncate().length() - shape.rim_radius_mm()).abs() < 1e-12);
        let level = shape.rim_level();
        assert!((DomeShape::meridian_of_level(level) - shape.meridian_end_rad()).abs() < 1e-12);
    }
}
