//! Maps of the light: over the dome as a polar chart, and in the raw image.

use glam::DVec2;
use tiny_skia::Pixmap;

use super::crescents::COLORS;
use super::measure::POLAR_ANGLES_DEG;
use super::numbers::IlluminationReport;
use crate::artwork::canvas::{color, fill_hard, stroke};
use domecast_design::{Design, DesignError};
use domecast_runtime::overlay::viridis;
use domecast_sim::light::illumination::Illumination;

/// A map as a PNG.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Name without ending: `dome-red`, `image-red`.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// The picture.
    pub png: Vec<u8>,
    /// What the ends of its colour scale stand for; empty where it has none.
    pub scale: String,
}

/// Side of the polar charts, and the largest width of the maps in the image, px.
const SIDE_PX: u32 = 420;
const MAX_WIDTH_PX: u32 = 560;

/// Around the dome, where the value is missing, and the lines of polar angles.
const AROUND: [u8; 3] = [58, 58, 62];
const MISSING: [u8; 3] = [200, 40, 30];
const LINES: [u8; 3] = [255, 255, 255];

/// Ends of the scales, the same for every design so that their maps can be compared.
const CONDITION: [f64; 2] = [1.0, 100.0];
const ERROR_DEG: [f64; 2] = [0.1, 10.0];

/// What one map shows: its name, title and scale, and the colour of each place.
struct Layer {
    name: &'static str,
    title: String,
    scale: String,
    colors: Vec<[u8; 3]>,
}

/// Both pictures of every layer.
pub(super) fn maps(
    design: &Design,
    light: &Illumination,
    report: &IlluminationReport,
) -> Result<Vec<Map>, DesignError> {
    let lens = design.optics().lens().spec();
    let shrink = (f64::from(MAX_WIDTH_PX) / f64::from(lens.width.max(1))).min(1.0);
    let size = [lens.width, lens.height].map(|side| ((f64::from(side) * shrink) as u32).max(1));
    let dome = corners(light, &|ring, place| Some(on_chart(light, ring, place)));
    let image = corners(light, &|ring, place| {
        let unit = light.grid.on_unit_dome(light.face, ring, place);
        let optics = design.optics();
        // The rim itself is the edge of the foot: a little above it is the dome's.
        let point_mm = optics.dome().center_mm() + unit * optics.dome_radius_mm();
        let pixel = optics.project(point_mm.with_z(point_mm.z.max(1e-9 * optics.dome_radius_mm()))).ok()?;
        Some(shrink * pixel)
    });
    let mut maps = Vec::new();
    for layer in layers(light, report) {
        let pictures =
            [("dome", "on the dome", [SIDE_PX; 2], &dome), ("image", "in the image", size, &image)];
        for (kind, place, [width, height], corners) in pictures {
            let mut picture = Pixmap::new(width, height).ok_or_else(|| picture_fault("a map has no size"))?;
            picture.fill(color(AROUND));
            for (cell, rgb) in corners.iter().zip(&layer.colors) {
                if let Some(cell) = cell {
                    fill_hard(&mut picture, cell, *rgb);
                }
            }
            if kind == "dome" {
                draw_angles(&mut picture, light);
            }
            maps.push(Map {
                name: format!("{kind}-{}", layer.name),
                title: format!("{} {place}", layer.title),
                png: picture.encode_png().map_err(picture_fault)?,
                scale: layer.scale.clone(),
            });
        }
    }
    Ok(maps)
}

/// Why a picture could not be coded: its size, as a rule.
fn picture_fault(problem: impl ToString) -> DesignError {
    DesignError::at("camera", "", problem.to_string(), "an image size that can be drawn")
}

fn layers(light: &Illumination, report: &IlluminationReport) -> Vec<Layer> {
    let mut layers = Vec::new();
    let names = ["red", "green", "blue"];
    for (c, (color, name)) in COLORS.into_iter().zip(names).enumerate() {
        let values: Vec<f64> = light.places.iter().map(|place| place.direct_mw_mm2()[c]).collect();
        let largest = values.iter().copied().fold(0.0, f64::max);
        layers.push(Layer {
            name,
            title: format!("Direct irradiance by the {color} lights"),
            scale: format!("0 to {} mW/mm²", crate::numbers::typeset(largest)),
            colors: values.iter().map(|v| viridis(v / largest.max(f64::MIN_POSITIVE))).collect(),
        });
    }
    let places = &report.places;
    let logarithmic = |values: &[Option<f64>], [low, high]: [f64; 2]| -> Vec<[u8; 3]> {
        let one =
            |value: &Option<f64>| value.map_or(MISSING, |v| viridis((v / low).ln() / (high / low).ln()));
        values.iter().map(one).collect()
    };
    layers.push(Layer {
        name: "condition",
        title: "Condition number of crosstalk times direct light".into(),
        scale: "factor 1 to 100 and more, logarithmic; red: no number".into(),
        colors: logarithmic(&places.condition_number, CONDITION),
    });
    layers.push(Layer {
        name: "normal-error",
        title: "Error of the normal for one grey level".into(),
        scale: "0.1° to 10° and more, logarithmic; red: no number".into(),
        colors: logarithmic(&places.normal_error_deg_per_level, ERROR_DEG),
    });
    // Each missing colour in its own; two of them mixed.
    let lacking = |lacks: &[bool; 3]| {
        let is_whole = !lacks.contains(&true);
        if is_whole { [235, 235, 230] } else { lacks.map(|is_lacking| if is_lacking { 220 } else { 40 }) }
    };
    layers.push(Layer {
        name: "crescents",
        title: "Crescents".into(),
        scale: "red, green, blue: that colour is below a twentieth of its median within 75°".into(),
        colors: places.is_lacking.iter().map(lacking).collect(),
    });
    layers
}

/// Corners of every place in a picture; `None` where one of them is not in it.
fn corners(light: &Illumination, at: &dyn Fn(f64, f64) -> Option<DVec2>) -> Vec<Option<[DVec2; 4]>> {
    let (rings, around) = (light.grid.rings, light.grid.places);
    let nodes: Vec<Option<DVec2>> =
        (0..(rings + 1) * around).map(|index| at((index / around) as f64, (index % around) as f64)).collect();
    let cell = |index: usize| {
        let (ring, place) = (index / around, index % around);
        let next = (place + 1) % around;
        let [a, b, c, d] = [(ring, place), (ring, next), (ring + 1, next), (ring + 1, place)]
            .map(|(ring, place)| nodes.get(ring * around + place).copied().flatten());
        let cell = [a?, b?, c?, d?];
        // A little larger: no seams between the places.
        let middle = cell.iter().sum::<DVec2>() / 4.0;
        Some(cell.map(|corner| corner + 0.4 * (corner - middle).normalize_or_zero()))
    };
    (0..light.grid.count()).map(cell).collect()
}

/// Largest polar angle of the chart, degrees.
fn chart_edge_deg(light: &Illumination) -> f64 {
    light.places.iter().map(|place| place.polar_deg).fold(1.0, f64::max) + 2.0
}

/// A place of the chart: distance from the middle is polar angle, x to the right and y up.
fn on_chart(light: &Illumination, ring: f64, place: f64) -> DVec2 {
    let unit = light.grid.on_unit_dome(light.face, ring, place);
    let polar_deg = unit.truncate().length().atan2(unit.z).to_degrees();
    chart_px(polar_deg / chart_edge_deg(light), unit.y.atan2(unit.x))
}

fn chart_px(part: f64, azimuth_rad: f64) -> DVec2 {
    let half = 0.5 * f64::from(SIDE_PX);
    let way = DVec2::from_angle(azimuth_rad) * DVec2::new(1.0, -1.0);
    DVec2::splat(half - 0.5) + way * (0.97 * half * part)
}

/// Circles at the polar angles of the statistics, and a tick where the azimuth is 0.
fn draw_angles(picture: &mut Pixmap, light: &Illumination) {
    let edge_deg = chart_edge_deg(light);
    for polar_deg in POLAR_ANGLES_DEG.into_iter().filter(|polar_deg| *polar_deg < edge_deg) {
        let circle: Vec<DVec2> =
            (0..120).map(|k| chart_px(polar_deg / edge_deg, f64::from(3 * k).to_radians())).collect();
        stroke(picture, &circle, true, 1.0, LINES);
    }
    stroke(picture, &[chart_px(0.96, 0.0), chart_px(1.02, 0.0)], false, 2.0, LINES);
}
