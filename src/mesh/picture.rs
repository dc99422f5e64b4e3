//! Shaded pictures of meshes, by a small rasteriser with a depth buffer.

use glam::{DVec2, DVec3};

use super::TriMesh;

/// Something to draw.
#[derive(Debug, Clone)]
pub struct PictureItem<'a> {
    /// The mesh, mm, Z up.
    pub mesh: &'a TriMesh,
    /// Where it is moved to, mm.
    pub shift_mm: DVec3,
    /// Red, green, blue, 0 to 1. Everything is drawn opaque.
    pub color: [f32; 3],
}

/// Where the viewer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Seen from above, from +x counter-clockwise, degrees.
    pub azimuth_deg: f64,
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
}

/// Each pixel is the mean of this many squared.
const OVERSAMPLING: usize = 2;
const MARGIN: f64 = 0.06;

/// Draws items in parallel projection on white, fitted to the picture; the
/// rows of RGB pixels from the top. Faces are lit by a lamp over the viewer's
/// shoulder, and sharp edges are drawn as dark lines.
pub fn shade(items: &[PictureItem<'_>], view: View, width: u32, height: u32) -> Vec<u8> {
    let (w, h) = (width as usize * OVERSAMPLING, height as usize * OVERSAMPLING);
    let (az, el) = (view.azimuth_deg.to_radians(), view.elevation_deg.to_radians());
    let toward = DVec3::new(el.cos() * az.cos(), el.cos() * az.sin(), el.sin());
    let right = DVec3::new(-az.sin(), az.cos(), 0.0);
    let up = toward.cross(right);
    let lamp = (toward + 0.8 * up - 0.5 * right).normalize();
    let project = |p: DVec3| DVec3::new(p.dot(right), p.dot(up), p.dot(toward));

    let moved = |item: &PictureItem<'_>| -> Vec<DVec3> {
        item.mesh.vertices_mm.iter().map(|&v| project(v + item.shift_mm)).collect()
    };
    let projected: Vec<Vec<DVec3>> = items.iter().map(moved).collect();
    let all = || projected.iter().flatten().copied();
    let (low, high) = (
        all().fold(DVec3::splat(f64::INFINITY), DVec3::min),
        all().fold(DVec3::splat(f64::NEG_INFINITY), DVec3::max),
    );
    let size = (high - low).truncate().max(DVec2::splat(1e-9));
    let scale = ((w as f64 / size.x).min(h as f64 / size.y)) * (1.0 - 2.0 * MARGIN);
    let center = 0.5 * (low + high);
    // Per pixel the depth and the face (item and triangle) that is seen.
    let mut depth = vec![f32::NEG_INFINITY; w * h];
    let mut seen = vec![NOTHING; w * h];
    let mut faces: Vec<Seen> = Vec::new();
    for (item, points) in items.iter().zip(&projected) {
        for triangle in &item.mesh.triangles {
            let corner = |i: u32| points.get(i as usize).copied().unwrap_or_default();
            let [a, b, c] = triangle.map(corner);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            if normal.z <= 0.0 {
                continue;
            }
            let in_world = right * normal.x + up * normal.y + toward * normal.z;
            let light = (0.38 + 0.62 * in_world.dot(lamp).max(0.0)) as f32;
            let id = faces.len() as u32;
            faces.push(Seen { color: item.color.map(|c| (c * light).min(1.0)), normal });
            let pixel = |p: DVec3| {
                DVec3::new(
                    0.5 * w as f64 + (p.x - center.x) * scale,
                    0.5 * h as f64 - (p.y - center.y) * scale,
                    p.z,
                )
            };
            fill([pixel(a), pixel(b), pixel(c)], (w, h), |at, z| {
                if z > depth[at] {
                    depth[at] = z;
                    seen[at] = id;
                }
            });
        }
    }
    resolved(&seen, &depth, &faces, (width as usize, height as usize), scale)
}

/// No face is seen in this pixel.
const NOTHING: u32 = u32::MAX;

struct Seen {
    color: [f32; 3],
    normal: DVec3,
}

/// Calls `put` with index and depth of every pixel whose middle is in the
/// triangle: row by row between its edges.
fn fill(corners: [DVec3; 3], (w, h): (usize, usize), mut put: impl FnMut(usize, f32)) {
    let [a, b, c] = corners;
    let area = (b - a).truncate().perp_dot((c - a).truncate());
    if area == 0.0 {
        return;
    }
    // Depth is linear in the picture: z = a.z + x slope and y slope.
    let slope_x = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area;
    let slope_y = ((c.z - a.z) * (b.x - a.x) - (b.z - a.z) * (c.x - a.x)) / area;
    let top = a.y.min(b.y).min(c.y);
    let bottom = a.y.max(b.y).max(c.y);
    let first = (top - 0.5).ceil().max(0.0) as usize;
    let last = (bottom - 0.5).floor().min(h as f64 - 1.0);
    for row in first..=(last.max(-1.0) + 1.0) as usize {
        let y = row as f64 + 0.5;
        if row >= h || y > bottom {
            break;
        }
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            if (p.y <= y) != (q.y <= y) {
                let x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
                from = from.min(x);
                to = to.max(x);
            }
        }
        let left = (from - 0.5).ceil().max(0.0);
        let right = (to - 0.5).floor().min(w as f64 - 1.0);
        if left > right {
            continue;
        }
        for column in left as usize..=right as usize {
            let z = a.z + slope_x * (column as f64 + 0.5 - a.x) + slope_y * (y - a.y);
            put(row * w + column, z as f32);
        }
    }
}

/// Mean colour of the pixels that make one of the picture; those where the
/// surface breaks off or bends sharply are darkened.
fn resolved(
    seen: &[u32],
    depth: &[f32],
    faces: &[Seen],
    (width, height): (usize, usize),
    scale: f64,
) -> Vec<u8> {
    let (w, h) = (width * OVERSAMPLING, height * OVERSAMPLING);
    let face = |at: usize| faces.get(seen[at] as usize);
    let is_edge = |at: usize, next: usize| {
        if seen[at] == seen[next] {
            return false;
        }
        let (Some(one), Some(two)) = (face(at), face(next)) else { return true };
        // Slanting faces drop from pixel to pixel without an edge.
        let slant = one.normal.z.min(two.normal.z).max(0.05).recip();
        f64::from((depth[at] - depth[next]).abs()) > 2.0 / scale * slant || one.normal.dot(two.normal) < 0.8
    };
    let share = 255.0 / (OVERSAMPLING * OVERSAMPLING) as f32;
    let level = |sum: f32| (sum * share).round().clamp(0.0, 255.0) as u8;
    // Within a face, or beside everything, there is nothing to look for.
    let plain = |x: usize, y: usize| {
        let (left, right) = (x * OVERSAMPLING, ((x + 1) * OVERSAMPLING).min(w - 1));
        let id = seen[y * OVERSAMPLING * w + left];
        let rows = y * OVERSAMPLING..=((y + 1) * OVERSAMPLING).min(h - 1);
        rows.map(|row| &seen[row * w + left..=row * w + right]).all(|row| row.iter().all(|s| *s == id))
    };
    let mut out = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            if plain(x, y) {
                let color = face(y * OVERSAMPLING * w + x * OVERSAMPLING).map_or([1.0; 3], |f| f.color);
                out.extend(color.map(|c| level(c * (OVERSAMPLING * OVERSAMPLING) as f32)));
                continue;
            }
            let mut sum = [0.0_f32; 3];
            for (i, j) in (0..OVERSAMPLING * OVERSAMPLING).map(|k| (k % OVERSAMPLING, k / OVERSAMPLING)) {
                let (px, py) = (x * OVERSAMPLING + i, y * OVERSAMPLING + j);
                let at = py * w + px;
                let edge = (px + 1 < w && is_edge(at, at + 1)) || (py + 1 < h && is_edge(at, at + w));
                let dark = if edge { 0.4 } else { 1.0 };
                let color = face(at).map_or([1.0; 3], |f| f.color);
                for (total, c) in sum.iter_mut().zip(color) {
                    *total += dark * c;
                }
            }
            out.extend(sum.map(level));
        }
    }
    out
}
