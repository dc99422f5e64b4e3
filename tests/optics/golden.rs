//! The golden values, as they stand and turned, rolled, mirrored and scaled.

use domecast::optics::SensorOptics;
use glam::DVec3;

use super::cases::{Case, files, golden};

fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

/// Checks one case; `slack` widens the bounds for inputs that were themselves
/// rounded when the case was turned.
fn check(case: &Case, slack: f64) {
    let name = &case.name;
    let optics = SensorOptics::new(&case.spec).unwrap_or_else(|e| panic!("{name}: {e}"));
    let lens = optics.lens();
    let end = case.max_field_angle_rad;
    assert!(
        (lens.max_field_angle_rad() - end).abs() < 1e-9 * end,
        "{name}: {} is not {end}",
        lens.max_field_angle_rad()
    );
    assert_eq!(lens.end_limit().as_str(), case.limit, "{name}");
    for t in &case.trace {
        let at = format!("{name} at pixel {}", t.pixel);
        if let Some((ray, allowed)) = t.ray {
            let found = lens.unproject(t.pixel).unwrap_or_else(|e| panic!("{at}: {e}"));
            let error = angle(found, ray);
            assert!(error <= allowed * slack, "{at}: off by {error:e} rad, {allowed:e} allowed");
            assert!((found.length() - 1.0).abs() < 1e-15, "{at}: not a unit vector");
        }
        match (optics.trace(t.pixel), t.surface_mm) {
            (Ok(hit), Some((surface, allowed))) => {
                let error = (hit.surface_mm - surface).length();
                assert!(error <= allowed * slack, "{at}: off by {error:e} mm, {allowed:e} allowed");
                let theta = t.field_angle_rad.unwrap();
                let (_, allowed) = t.ray.unwrap();
                assert!(
                    (hit.field_angle_rad - theta).abs() <= (allowed * slack).max(1e-14),
                    "{at}: field angle"
                );
            }
            (Err(limit), None) => assert_eq!(limit.as_str(), t.status, "{at}"),
            (found, _) => panic!("{at}: {found:?}, expected {}", t.status),
        }
    }
    for p in &case.project {
        let at = format!("{name} at point {}", p.point_mm);
        match (optics.project(p.point_mm), p.image_px) {
            (Ok(pixel), Some((expected, allowed))) => {
                let error = (pixel - expected).length();
                assert!(error <= allowed * slack, "{at}: off by {error:e} px, {allowed:e} allowed");
            }
            (Err(limit), None) => assert_eq!(limit.as_str(), p.status, "{at}"),
            (found, _) => panic!("{at}: {found:?}, expected {}", p.status),
        }
    }
}

/// Every text in the file that is a number other than zero.
fn numbers<'a>(value: &'a serde_json::Value, found: &mut Vec<&'a str>) {
    match value {
        serde_json::Value::String(text) if text.parse().is_ok_and(|v: f64| v != 0.0) => found.push(text),
        serde_json::Value::Array(list) => list.iter().for_each(|v| numbers(v, found)),
        serde_json::Value::Object(map) => map.values().for_each(|v| numbers(v, found)),
        _ => {}
    }
}

#[test]
fn golden_values_have_thirty_digits() {
    let values: Vec<serde_json::Value> =
        files("golden-optics").iter().map(|(_, text)| serde_json::from_str(text).unwrap()).collect();
    let mut found = Vec::new();
    values.iter().for_each(|value| numbers(value, &mut found));
    assert!(found.len() > 1000);
    for text in found {
        let mantissa = text.split('e').next().unwrap().trim_start_matches(['-', '0', '.']);
        let digits = mantissa.chars().filter(char::is_ascii_digit).count();
        assert!(digits >= 30, "{text} has {digits} digits");
    }
}

#[test]
fn golden_values() {
    let cases = golden();
    assert!(cases.len() >= 29);
    for case in &cases {
        check(case, 1.0);
    }
}

#[test]
fn golden_values_scaled() {
    for case in golden() {
        // The millimetre dome's bounds scale with it, the pixels stay.
        for factor in [2f64.powi(-7), 0.1, 100.0, 2f64.powi(10)] {
            check(&case.clone().scaled(factor), 1.5);
        }
    }
}

#[test]
fn golden_values_turned() {
    for case in golden() {
        for angle in [0.3, std::f64::consts::FRAC_PI_2, -2.5] {
            check(&case.clone().turned(angle), 2.0);
            if let Some(rolled) = case.clone().rolled(angle) {
                check(&rolled, 2.0);
            }
        }
    }
}

#[test]
fn golden_values_mirrored() {
    for case in golden() {
        check(&case.clone().mirrored(), 1.0);
        check(&case.scaled(0.5).turned(1.0).mirrored(), 2.0);
    }
}
