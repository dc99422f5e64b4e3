//! Light on a small dome against counted photons: lamps under its middle, under the edge of its foot, and outside.

use super::*;

/// Places across a bin, each way, at which the light is taken.
const PLACES: u32 = 16;

/// Mean irradiance of a bin of polar angles and azimuths under a light.
fn bin_mean(light: &DirectLight<'_>, source: &Emitter, polar: [f64; 2], azimuth: [f64; 2]) -> f64 {
    let rule = EmitterRule::default();
    let radius_mm = light.optics.dome_radius_mm();
    let part =
        |range: [f64; 2], i: u32| range[0] + (range[1] - range[0]) * (f64::from(i) + 0.5) / f64::from(PLACES);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (i, j) in (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| (i, j))) {
        let (polar, azimuth) = (part(polar, i), part(azimuth, j));
        let direction = (DVec2::from_angle(azimuth) * polar.sin()).extend(polar.cos());
        let flux = light.vector_irradiance(source, direction * radius_mm, &rule).dot(direction);
        sum += polar.sin() * flux.max(0.0);
        weights += polar.sin();
    }
    sum / weights
}

#[test]
fn lamps_inside_under_and_outside_of_the_foot_light_the_dome_as_photons_do() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .join("tests/cases/photons_at_the_foot.json");
    let golden: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let radius_mm = number(&golden["dome_radius_mm"]);
    let optics = sensor_of(&[number(&golden["acrylic_index"])], number(&golden["silicone_index"]), radius_mm);
    let light = DirectLight {
        fresnel: true,
        sheet_half_mm: DVec2::splat(number(&golden["sheet_half_mm"])),
        ..light(&optics)
    };
    let edges: Vec<f64> =
        golden["polar_edges_deg"].as_array().unwrap().iter().map(|v| number(v).to_radians()).collect();
    let count = golden["azimuths"].as_u64().unwrap() as usize;
    for (name, lamp) in golden["lamps"].as_object().unwrap() {
        let tilt = number(&lamp["tilt_deg"]).to_radians();
        let at = DVec3::new(number(&lamp["radius_mm"]), 0.0, number(&lamp["z_mm"]));
        let z = DVec3::new(-tilt.sin(), 0.0, tilt.cos());
        let y = DVec3::new(tilt.cos(), 0.0, tilt.sin());
        let pose = DAffine3 { matrix3: DMat3::from_cols(y.cross(z), y, z), translation: at };
        let source =
            Emitter { platform_from_emitter: pose, ..emitter(at, z, number(&golden["lamp_side_mm"]), 1.0) };
        let value = |ring: usize, k: usize| number(&lamp["irradiance"][ring][k]);
        let bins = || (0..edges.len() - 1).flat_map(|ring| (0..count).map(move |k| (ring, k)));
        let largest = bins().map(|(ring, k)| value(ring, k)).fold(0.0, f64::max);
        let (mut worst, mut share) = (0.0_f64, 0.0);
        for (ring, k) in bins() {
            let azimuth = [-0.5, 0.5].map(|side| TAU * (k as f64 + side) / count as f64);
            let polar = [edges[ring], edges[ring + 1]];
            let found = bin_mean(&light, &source, polar, azimuth);
            let counted = value(ring, k);
            worst = worst.max((found - counted).abs() / counted.max(0.1 * largest));
            share += found * radius_mm * radius_mm * (polar[0].cos() - polar[1].cos()) * TAU / count as f64;
        }
        let off = share / number(&lamp["share"]) - 1.0;
        println!("{name}: bins to {:.2} %, all together {:.2} %", 100.0 * worst, 100.0 * off);
        assert!(worst < 0.01 && off.abs() < 0.005, "{name}: {worst} {off}");
    }
}
