//! Light on the dome against another renderer.

use super::*;

/// What Mitsuba found for the same sensor; made by scripts/golden_light.py.
fn golden() -> serde_json::Value {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("tests/cases/golden_light.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap()
}

/// The light of the golden file: `designs/thumb24.json`'s first, as a square or a point.
fn golden_emitter(golden: &serde_json::Value, side_mm: f64) -> Emitter {
    let light = &golden["light"];
    let tilt = number(&light["tilt_deg"]).to_radians();
    let at = DVec3::new(number(&light["radius_mm"]), 0.0, number(&light["z_mm"]));
    let z = DVec3::new(-tilt.sin(), 0.0, tilt.cos());
    let y = DVec3::new(tilt.cos(), 0.0, tilt.sin());
    let pose = DAffine3 { matrix3: DMat3::from_cols(y.cross(z), y, z), translation: at };
    Emitter {
        platform_from_emitter: pose,
        half_side_mm: 0.5 * side_mm,
        flux_mw: 1.0,
        lobe: Lobe::cosine_power(1.0),
    }
}

/// Largest difference of a map of irradiance from Mitsuba's, of each bin's value or a tenth of the largest; a bin
/// that the light reaches at a cosine below the cut is left out.
fn off_from_mitsuba(golden: &serde_json::Value, map: &str, emitter: &Emitter, min_cos: f64) -> (f64, usize) {
    let optics = sensor(&[number(&golden["acrylic_index"])], number(&golden["silicone_index"]));
    let light = DirectLight { fresnel: true, ..light(&optics) };
    let edges: Vec<f64> =
        golden["polar_edges_deg"].as_array().unwrap().iter().map(|v| number(v).to_radians()).collect();
    let count = golden["azimuths"].as_u64().unwrap() as usize;
    let rule = EmitterRule::default();
    let value = |ring: usize, k: usize| number(&golden[map][ring][k]);
    let largest = (0..edges.len() - 1).flat_map(|r| (0..count).map(move |k| (r, k)));
    let largest = largest.map(|(r, k)| value(r, k)).fold(0.0, f64::max);
    let (mut worst, mut compared) = (0.0_f64, 0);
    for ring in 0..edges.len() - 1 {
        for k in 0..=count / 2 {
            let (mut sum, mut weights, mut seen) = (0.0, 0.0, true);
            for i in 0..8 {
                let polar = edges[ring] + (edges[ring + 1] - edges[ring]) * (f64::from(i) + 0.5) / 8.0;
                for j in 0..8 {
                    let azimuth = TAU * (k as f64 - 0.5 + (f64::from(j) + 0.5) / 8.0) / count as f64;
                    let direction = (DVec2::from_angle(azimuth) * polar.sin()).extend(polar.cos());
                    let point = direction * 10.0;
                    sum += polar.sin() * light.vector_irradiance(emitter, point, &rule).dot(direction);
                    weights += polar.sin();
                    let pose = &emitter.platform_from_emitter;
                    let tube = optics.light_tube(pose.translation, point, 0.0).unwrap();
                    seen &= tube.leaving.dot(pose.matrix3.z_axis) > min_cos;
                }
            }
            if !seen {
                continue;
            }
            // The sensor is its own mirror image, so two bins of Mitsuba's noise make one.
            let other = 0.5 * (value(ring, k) + value(ring, (count - k) % count));
            worst = worst.max((sum / weights - other).abs() / other.max(0.1 * largest));
            compared += 1;
        }
    }
    (worst, compared)
}

#[test]
fn irradiance_is_that_of_mitsuba() {
    let golden = golden();
    let square = golden_emitter(&golden, number(&golden["square_side_mm"]));
    let (off, compared) = off_from_mitsuba(&golden, "square", &square, -1.0);
    println!("square: {:.2} % in {compared} bins", 100.0 * off);
    assert!(off < 0.03 && compared == 35, "{off} {compared}");
    let mut point = golden_emitter(&golden, 1e-3);
    point.lobe = point.lobe.behind(&Diffuser {
        lambert_fraction: number(&golden["diffuser"]["lambert_fraction"]),
        lobe_width_rad: number(&golden["diffuser"]["lobe_width_deg"]).to_radians(),
        transmittance: 1.0,
    });
    let cut = (number(&golden["cutoff_deg"]) - 1.0).to_radians().cos();
    let (off, compared) = off_from_mitsuba(&golden, "diffused", &point, cut);
    println!("diffused: {:.2} % in {compared} bins", 100.0 * off);
    assert!(off < 0.03 && compared > 28, "{off} {compared}");
}

#[test]
fn dots_are_seen_where_mitsuba_sees_them() {
    let golden = golden();
    let focal = number(&golden["focal_px"]);
    let layer = |n: &serde_json::Value, thickness_mm| FlatLayer {
        name: "layer".into(),
        index: [number(n); 3],
        thickness_mm,
    };
    let optics = SensorOptics::new(&OpticsSpec {
        lens: LensSpec {
            model: LensModel::Pinhole,
            width: 640,
            height: 480,
            matrix: [[focal, 0.0, 319.5], [0.0, focal, 239.5], [0.0, 0.0, 1.0]],
            distortion: Vec::new(),
            field_of_view_rad: 2.7,
            pupil_shift_mm: Vec::new(),
        },
        sensor_from_camera: Rigid::from_translation(DVec3::Z * number(&golden["pupil_z_mm"])),
        layers: vec![
            layer(&golden["acrylic_index"], Some(number(&golden["sheet_mm"]))),
            layer(&golden["silicone_index"], None),
        ],
        dome: domecast_optics::DomeShape::hemisphere(10.0),
    })
    .unwrap();
    let reach = number(&golden["dot_radius_mm"]) / 10.0;
    let vector = |v: &serde_json::Value| -> Vec<f64> { v.as_array().unwrap().iter().map(number).collect() };
    let (places, pixels) = (golden["dots_mm"].as_array().unwrap(), golden["dots_px"].as_array().unwrap());
    let mut worst = 0.0_f64;
    for (place, pixel) in places.iter().zip(pixels) {
        let axis = DVec3::from_slice(&vector(place)).normalize();
        let (x, y) = (axis.any_orthonormal_vector(), axis.cross(axis.any_orthonormal_vector()));
        let rim: Vec<DVec2> = (0..96)
            .map(|k| {
                let aside = DVec2::from_angle(TAU * f64::from(k) / 96.0) * reach.sin();
                optics.project((x * aside.x + y * aside.y + axis * reach.cos()) * 10.0).unwrap()
            })
            .collect();
        let origin = rim[0];
        let (mut area, mut center) = (0.0, DVec2::ZERO);
        for (a, b) in rim.iter().zip(rim.iter().cycle().skip(1)) {
            let part = (*a - origin).perp_dot(*b - origin);
            area += part;
            center += (*a + *b - 2.0 * origin) * (part / 3.0);
        }
        let found = vector(pixel);
        worst = worst.max((origin + center / area).distance(DVec2::new(found[0], found[1])));
    }
    println!("{} dots, at most {worst:.4} px from Mitsuba's", places.len());
    assert!(worst < 0.05 && places.len() >= 45, "{worst}");
}
