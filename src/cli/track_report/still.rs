//! The picture of the skin for those without a script, and for print.

use super::skin::{HEIGHT_UNIT_MM, SkinFrame, Skins, UNSEEN, triangles};
use domecast_mesh::{PictureItem, TriMesh, View, shade};
use domecast_runtime::overlay::viridis;
use glam::DVec3;

const SIZE: (u32, u32) = (720, 520);
/// Colours that the scale is cut into.
const BANDS: usize = 128;
const UNSEEN_COLOR: [u8; 3] = [140; 3];
/// The skin at rest, and the share of the scale up to which its colour fades into those of depth.
pub(super) const REST_COLOR: [u8; 3] = [226, 223, 214];
pub(super) const FADE: f64 = 0.1;

/// The colour of a share of the scale of depths.
pub(super) fn depth_color(share: f64) -> [u8; 3] {
    let part = (share / FADE).clamp(0.0, 1.0);
    let deep = viridis(share);
    std::array::from_fn(|c| {
        let [rest, deep] = [REST_COLOR[c], deep[c]].map(f64::from);
        (rest + part * (deep - rest)).round() as u8
    })
}

/// A PNG of the skin, coloured by depth from 0 to `range_mm`; `None` if it could not be coded.
pub(super) fn still(skins: &Skins, frame: &SkinFrame, range_mm: f64) -> Option<Vec<u8>> {
    let place = |(index, (at_mm, normal)): (usize, &(DVec3, DVec3))| {
        let height = frame.heights.get(index).copied().filter(|height| *height != UNSEEN).unwrap_or(0);
        *at_mm + *normal * f64::from(height) * HEIGHT_UNIT_MM
    };
    let vertices_mm: Vec<DVec3> = skins.places.iter().enumerate().map(place).collect();
    // Places that are not seen are a band of their own, and so is the edge of what touches.
    let mut bands = vec![Vec::new(); BANDS + 2];
    for triangle in triangles() {
        let heights = triangle.map(|node| frame.heights.get(node as usize).copied().unwrap_or(UNSEEN));
        let touched = triangle.map(|node| frame.is_touched.get(node as usize).copied().unwrap_or(false));
        let band = if touched.contains(&true) && touched.contains(&false) {
            BANDS + 1
        } else if heights.contains(&UNSEEN) {
            BANDS
        } else {
            let depth_mm =
                -heights.iter().map(|height| f64::from(*height)).sum::<f64>() / 3.0 * HEIGHT_UNIT_MM;
            ((depth_mm / range_mm).clamp(0.0, 1.0) * (BANDS - 1) as f64).round() as usize
        };
        bands[band].push(triangle);
    }
    let meshes: Vec<TriMesh> =
        bands.into_iter().map(|triangles| TriMesh { vertices_mm: vertices_mm.clone(), triangles }).collect();
    let color = |band: usize| {
        let rgb = match band {
            ..BANDS => depth_color(band as f64 / (BANDS - 1) as f64),
            BANDS => UNSEEN_COLOR,
            _ => [255; 3],
        };
        rgb.map(|value| f32::from(value) / 255.0)
    };
    let item = |(band, mesh)| PictureItem { mesh, shift_mm: DVec3::ZERO, color: color(band) };
    let items: Vec<PictureItem<'_>> = meshes.iter().enumerate().map(item).collect();
    let (width, height) = SIZE;
    let rows = shade(&items, View { azimuth_deg: -50.0, elevation_deg: 40.0 }, width, height);
    let mut png = Vec::new();
    let mut encoder = png::Encoder::new(&mut png, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&rows));
    written.ok().map(|()| png)
}
