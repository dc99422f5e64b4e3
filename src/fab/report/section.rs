//! The sensor cut along its x axis, from the meshes of its assembly, with the rays that its camera sees by as they run.
//!
//! ```
//! use domecast_fab::report::section;
//! use glam::DVec2;
//! use std::str::FromStr;
//!
//! let design = domecast_design::Design::from_str(include_str!("../../../designs/thumb24.json"))?;
//! let ray = section::ray_points(design.optics(), DVec2::new(400.0, 240.0)).expect("inside the image");
//! // from the pupil through both faces of the sheet to the dome
//! assert_eq!(ray.len(), 4);
//! assert!((ray[3].length() - 10.0).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt::Write as _;

use glam::{DVec2, DVec3};

use crate::html::{AsHtml, Html};
use crate::numbers::dimension;
use domecast_design::Design;
use domecast_design::parts::{Assembly, AssemblyItem};
use domecast_mesh::{CuttingPlane, RayTarget};
use domecast_optics::camera::Lens;
use domecast_optics::{ColorChannel, SensorOptics};

/// Rays on either side of the axis.
const RAYS_A_SIDE: u32 = 8;
/// Further rays on either side, beyond the dome, as far as the frame goes.
const RAYS_PAST: u32 = 3;

/// The points of a pixel's ray from the pupil to the dome, sensor frame, mm; `None` where it does not arrive.
pub fn ray_points(optics: &SensorOptics, pixel: DVec2) -> Option<Vec<DVec3>> {
    let end = optics.trace(pixel).ok()?.surface_mm;
    let ray = optics.lens().unproject(pixel).ok()?;
    let shift = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray)).0;
    let pose = optics.sensor_from_camera();
    let (mut at, mut along) = (pose.point(DVec3::Z * shift), pose.vector(ray).normalize());
    let mut points = vec![at];
    let flat: Vec<_> = optics.layers().iter().filter(|layer| layer.thickness_mm.is_some()).collect();
    // from the sheet's top face downwards the thicknesses say where each face lies; the air reaches the pupil
    let mut faces_mm = vec![0.0];
    for layer in flat.iter().skip(1).rev() {
        let below = faces_mm.last().copied().unwrap_or(0.0) - layer.thickness_mm.unwrap_or(0.0);
        faces_mm.push(below);
    }
    faces_mm.reverse();
    let indices: Vec<f64> =
        optics.layers().iter().map(|layer| layer.index_for(ColorChannel::Green)).collect();
    for (face_mm, pair) in faces_mm.iter().zip(indices.windows(2)) {
        if along.z <= 0.0 {
            return None;
        }
        at += along * ((face_mm - at.z) / along.z);
        points.push(at);
        // Snell: what lies along the face scales with the ratio of the indices
        let flat = along.truncate() * (pair[0] / pair[1]);
        let up = 1.0 - flat.length_squared();
        along = flat.extend((up > 0.0).then(|| up.sqrt())?);
    }
    points.push(end);
    Some(points)
}

/// What an item of the assembly is drawn as.
fn class_of(name: &str) -> &'static str {
    match name {
        "upper_platform" | "lower_platform" => "solid",
        "acrylic_sheet" => "sheet",
        "dome" => "dome",
        "camera" => "camera",
        _ if name.starts_with("LED board") => "board",
        _ if name.starts_with("LED") => "led",
        _ if name.starts_with("spring") => "wire",
        _ => "magnet",
    }
}

/// The picture: every item of the assembly where the plane through the camera's pupil along x cuts it, what stands
/// behind the cut, rays through the image's middle row as they run, and the main dimensions.
pub fn drawing(design: &Design, assembly: &Assembly) -> Html {
    let optics = design.optics();
    let pupil = optics.sensor_from_camera().translation_mm;
    let plane = CuttingPlane { origin_mm: DVec3::Y * pupil.y, right: DVec3::X, up: DVec3::Z };
    let [low, high] = design.bounds_mm();
    let margin = 0.2 * (high.z - low.z);
    let mut art = String::new();
    for item in &assembly.items {
        art += &behind(item, &plane);
    }
    for item in &assembly.items {
        art += &cut(item, &plane);
    }
    let s = design.sections();
    for marker in design.white_markers_mm() {
        let width = s.white_markers.diameter_mm;
        let _ = write!(
            art,
            "<rect class=\"marker\" x=\"{:.3}\" y=\"-0.15\" width=\"{width:.3}\" height=\"0.15\"><title>white marker \
             (not in the cut)</title></rect>",
            marker.x - 0.5 * width
        );
    }
    art += &rays(optics, assembly);
    art += &dimensions(design, low, high);
    let size = high - low + DVec3::splat(2.0 * margin);
    Html::trusted(format!(
        "<svg class=\"section\" viewBox=\"{:.3} {:.3} {:.3} {:.3}\" role=\"img\" aria-label=\"The \
         sensor cut along its x axis, with rays from the camera through the sheet to the dome\">{art}</svg>",
        low.x - margin,
        -high.z - margin,
        size.x,
        size.z,
    ))
}

/// The item where the plane cuts it.
fn cut(item: &AssemblyItem, plane: &CuttingPlane) -> String {
    let mut path = String::new();
    for outline in item.mesh.outlines(plane) {
        let kept = without_straight(&outline);
        for (i, p) in kept.iter().enumerate() {
            let _ = write!(path, "{}{:.3} {:.3}", if i == 0 { 'M' } else { 'L' }, p.x, -p.y);
        }
        if !kept.is_empty() {
            path.push('Z');
        }
    }
    if path.is_empty() {
        return path;
    }
    let name = item.name.replace('_', " ");
    format!(
        "<path class=\"{}\" fill-rule=\"evenodd\" d=\"{path}\"><title>{}</title></path>",
        class_of(&item.name),
        AsHtml(name.as_str())
    )
}

/// A closed outline less what lies on it within a hair: faces are cut into pieces by their triangles (Douglas and
/// Peucker 1973, between the first point and the one farthest from it).
fn without_straight(outline: &[DVec2]) -> Vec<DVec2> {
    const HAIR_MM: f64 = 5e-4;
    let Some(&start) = outline.first() else { return Vec::new() };
    let farthest = |from: usize, to: usize, off: &dyn Fn(DVec2) -> f64| {
        (from..to)
            .map(|i| (i, outline.get(i).map_or(0.0, |p| off(*p))))
            .reduce(|a, b| if b.1 > a.1 { b } else { a })
    };
    let count = outline.len();
    let Some((middle, _)) = farthest(0, count, &|p| p.distance(start)) else { return Vec::new() };
    let at = |i: usize| outline.get(i % count).copied().unwrap_or(start);
    let mut keep = vec![false; count];
    let mut spans = vec![(0, middle), (middle, count)];
    while let Some((from, to)) = spans.pop() {
        if let Some(kept) = keep.get_mut(from) {
            *kept = true;
        }
        let (a, b) = (at(from), at(to));
        let along = (b - a).normalize_or_zero();
        let off = |p: DVec2| (p - a - along * (p - a).dot(along).clamp(0.0, a.distance(b))).length();
        if let Some((i, far)) = farthest(from + 1, to, &off)
            && far > HAIR_MM
        {
            spans.extend([(from, i), (i, to)]);
        }
    }
    outline.iter().zip(keep).filter_map(|(p, kept)| kept.then_some(*p)).collect()
}

/// The outline of a light, board, magnet or spring that stands behind the cut.
fn behind(item: &AssemblyItem, plane: &CuttingPlane) -> String {
    let class = class_of(&item.name);
    if !matches!(class, "led" | "board" | "magnet" | "wire") {
        return String::new();
    }
    let is_behind = item.mesh.bounds().is_some_and(|b| b.min_mm.y > plane.origin_mm.y);
    if !is_behind {
        return String::new();
    }
    let hull = convex_hull(item.mesh.vertices_mm.iter().map(|&v| plane.flat_mm(v)).collect());
    let mut path = String::new();
    for (i, p) in hull.iter().enumerate() {
        let _ = write!(path, "{}{:.3} {:.3}", if i == 0 { 'M' } else { 'L' }, p.x, -p.y);
    }
    format!(
        "<path class=\"behind {class}\" d=\"{path}Z\"><title>{}, behind the cut</title></path>",
        AsHtml(item.name.as_str())
    )
}

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain).
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    let chain = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut hull: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..]
                && (b - a).perp_dot(*p - b) <= 1e-9
            {
                hull.pop();
            }
            hull.push(*p);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter());
    hull.extend(chain(&mut points.iter().rev()));
    hull
}

/// Rays of the row through the principal point: evenly spread over what arrives at the dome, and some beyond. Each is
/// bent at every face, and ends on the dome or on the first part that it meets before the sheet.
fn rays(optics: &SensorOptics, assembly: &Assembly) -> String {
    let blockers: Vec<RayTarget> = assembly
        .items
        .iter()
        .filter(|item| !matches!(class_of(&item.name), "sheet" | "dome" | "camera"))
        .map(|item| RayTarget::new(&item.mesh))
        .collect();
    let spec = optics.lens().spec();
    let (center, row) = (spec.matrix[0][2], spec.matrix[1][2]);
    let mut art = String::new();
    let mut draw = |points: &[DVec3]| {
        let [pupil, sheet, ..] = *points else { return };
        let first = blockers
            .iter()
            .filter_map(|blocker| blocker.first_hit(pupil, pupil.lerp(sheet, 1.0 - 1e-6)))
            .map(|(share, _)| share)
            .reduce(f64::min);
        let stopped = first.map(|share| [pupil, pupil.lerp(sheet, share)]);
        let mut path = String::new();
        for (index, p) in stopped.as_ref().map_or(points, |ends| ends).iter().enumerate() {
            let _ = write!(path, "{}{:.3} {:.3}", if index == 0 { 'M' } else { 'L' }, p.x, -p.z);
        }
        let class = if stopped.is_some() { "ray stopped" } else { "ray" };
        let _ = write!(art, "<path class=\"{class}\" d=\"{path}\"/>");
    };
    for side in [-1.0, 1.0] {
        let reach = if side < 0.0 { center } else { f64::from(spec.width) - 1.0 - center };
        let pixel = |share: f64| DVec2::new(center + side * reach * share, row);
        // the furthest pixel of the row that arrives
        let steps = 400u32;
        let last = (1..=steps)
            .rev()
            .map(|k| f64::from(k) / f64::from(steps))
            .find(|share| optics.trace(pixel(*share)).is_ok());
        let Some(last) = last else { continue };
        for k in (if side < 0.0 { 1 } else { 0 })..=RAYS_A_SIDE {
            if let Some(points) = ray_points(optics, pixel(last * f64::from(k) / f64::from(RAYS_A_SIDE))) {
                draw(&points);
            }
        }
        for k in 1..=RAYS_PAST {
            let share = last + (1.0 - last) * f64::from(k) / f64::from(RAYS_PAST);
            if let Some(points) = air_points(optics, pixel(share)) {
                draw(&points);
            }
        }
    }
    art
}

/// The way of a pixel's ray in air alone, from the pupil to the sheet's underside.
fn air_points(optics: &SensorOptics, pixel: DVec2) -> Option<[DVec3; 2]> {
    let ray = optics.lens().unproject(pixel).ok()?;
    let shift = optics.lens().pupil_shift_mm(Lens::field_angle_rad(ray)).0;
    let pose = optics.sensor_from_camera();
    let (at, along) = (pose.point(DVec3::Z * shift), pose.vector(ray).normalize());
    let underside = -optics.layers().iter().skip(1).filter_map(|layer| layer.thickness_mm).sum::<f64>();
    (along.z > 0.0).then(|| [at, at + along * ((underside - at.z) / along.z)])
}

/// The main dimensions, beside the cut.
fn dimensions(design: &Design, low: DVec3, high: DVec3) -> String {
    let s = design.sections();
    let size = 0.028 * (high.z - low.z);
    let step = 2.2 * size;
    let pupil_z = design.optics().sensor_from_camera().translation_mm.z;
    let (underside, lower_top) = (s.platforms.upper.underside_z_mm, design.lower_top_z_mm());
    let mut art = String::new();
    let upright = |x: f64, from: f64, z: [f64; 2], what: &str| {
        let (middle, value) = (-0.5 * (z[0] + z[1]), (z[1] - z[0]).abs());
        let tick = 0.35 * size;
        let beside =
            x + if x > 0.0 { -0.4 * size } else { 0.9 * size } - if x > 0.0 { 0.0 } else { 1.3 * size };
        format!(
            "<path class=\"dimension\" d=\"M{from:.3} {a:.3}H{x:.3}M{from:.3} {b:.3}H{x:.3}M{x:.3} {a:.3}V{b:.3}\
             M{l:.3} {a0:.3}L{r:.3} {a1:.3}M{l:.3} {b0:.3}L{r:.3} {b1:.3}\"/><text x=\"{beside:.3}\" y=\"{middle:.3}\" \
             font-size=\"{size:.3}\" text-anchor=\"middle\" transform=\"rotate(-90 {beside:.3} {middle:.3})\">{}</text>",
            AsHtml(format!("{what} {}", dimension(value)).as_str()),
            a = -z[0],
            b = -z[1],
            l = x - tick,
            r = x + tick,
            a0 = -z[0] + tick,
            a1 = -z[0] - tick,
            b0 = -z[1] + tick,
            b1 = -z[1] - tick,
        )
    };
    let left = |k: f64| low.x - step * k;
    let right = |k: f64| high.x + step * k;
    art += &upright(left(1.0), -s.dome.shape().rim_radius_mm(), [0.0, s.dome.shape().height_mm()], "dome");
    art += &upright(left(1.0), 0.0, [pupil_z, 0.0], "pupil to dome");
    art += &upright(
        left(2.0),
        low.x,
        [lower_top, underside],
        if design.is_rigid() { "posts" } else { "springs" },
    );
    art += &upright(right(1.0), high.x, [low.z, lower_top], "lower platform");
    art += &upright(right(1.0), high.x, [design.sheet_underside_z_mm(), 0.0], "sheet");
    art += &upright(right(2.0), high.x, [low.z, high.z], "height");
    let (y, tick) = (-low.z + step, 0.35 * size);
    let _ = write!(
        art,
        "<path class=\"dimension\" d=\"M{0:.3} {2:.3}V{y:.3}M{1:.3} {2:.3}V{y:.3}M{0:.3} {y:.3}H{1:.3}M{3:.3} {4:.3}L{5:.3} \
         {6:.3}M{7:.3} {4:.3}L{8:.3} {6:.3}\"/><text x=\"{9:.3}\" y=\"{10:.3}\" font-size=\"{size:.3}\" \
         text-anchor=\"middle\">{11}</text>",
        low.x,
        high.x,
        -low.z,
        low.x - tick,
        y + tick,
        low.x + tick,
        y - tick,
        high.x - tick,
        high.x + tick,
        0.5 * (low.x + high.x),
        y - 0.4 * size,
        AsHtml(format!("width {} (mm)", dimension(high.x - low.x)).as_str()),
    );
    art
}
