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
const OVERSAMPLING: usize = 3;
const MARGIN: f64 = 0.06;

/// Draws items in parallel projection on white, fitted to the picture; the
/// rows of RGBA pixels from the top. Faces are lit by a lamp over the viewer's
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
    let mut depth = vec![f64::NEG_INFINITY; w * h];
    let mut color = vec![[1.0_f32; 3]; w * h];
    // Which face of which item, by direction: edges are where it changes.
    let mut face = vec![DVec3::ZERO; w * h];

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
            let lit = item.color.map(|c| (c * light).min(1.0));
            let pixel = |p: DVec3| {
                DVec2::new(
                    0.5 * w as f64 + (p.x - center.x) * scale,
                    0.5 * h as f64 - (p.y - center.y) * scale,
                )
            };
            let (pa, pb, pc) = (pixel(a), pixel(b), pixel(c));
            let area = (pb - pa).perp_dot(pc - pa);
            if area == 0.0 {
                continue;
            }
            let (min, max) = (pa.min(pb).min(pc), pa.max(pb).max(pc));
            let clamp = |v: f64, n: usize| v.clamp(0.0, n as f64 - 1.0) as usize;
            for y in clamp(min.y.floor(), h)..=clamp(max.y.ceil(), h) {
                for x in clamp(min.x.floor(), w)..=clamp(max.x.ceil(), w) {
                    let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let (u, v) = ((pb - p).perp_dot(pc - p) / area, (pc - p).perp_dot(pa - p) / area);
                    let t = 1.0 - u - v;
                    if u < 0.0 || v < 0.0 || t < 0.0 {
                        continue;
                    }
                    let z = u * a.z + v * b.z + t * c.z;
                    let at = y * w + x;
                    if z > depth[at] {
                        depth[at] = z;
                        color[at] = lit;
                        face[at] = normal;
                    }
                }
            }
        }
    }
    outline(&mut color, &depth, &face, (w, h), scale);
    downsampled(&color, width as usize, height as usize)
}

/// Darkens pixels where the surface breaks off or bends sharply.
fn outline(color: &mut [[f32; 3]], depth: &[f64], face: &[DVec3], (w, h): (usize, usize), scale: f64) {
    let step = 3.0 / scale;
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            let neighbors = [(x + 1 < w).then(|| at + 1), (y + 1 < h).then(|| at + w)];
            let edge = neighbors.into_iter().flatten().any(|n| {
                let (near, far) = (depth[at].max(depth[n]), depth[at].min(depth[n]));
                if !near.is_finite() {
                    return false;
                }
                // Slanting faces drop from pixel to pixel without an edge.
                let slant = face[at].z.max(0.05).recip();
                !far.is_finite() || near - far > step * slant || face[at].dot(face[n]) < 0.8
            });
            if edge {
                color[at] = color[at].map(|c| 0.45 * c);
            }
        }
    }
}

fn downsampled(color: &[[f32; 3]], width: usize, height: usize) -> Vec<u8> {
    let w = width * OVERSAMPLING;
    let share = 255.0 / (OVERSAMPLING * OVERSAMPLING) as f32;
    let mut out = Vec::with_capacity(4 * width * height);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0_f32; 3];
            for j in 0..OVERSAMPLING {
                for i in 0..OVERSAMPLING {
                    let c = color[(y * OVERSAMPLING + j) * w + x * OVERSAMPLING + i];
                    for k in 0..3 {
                        sum[k] += c[k];
                    }
                }
            }
            out.extend(sum.map(|s| (s * share).round().clamp(0.0, 255.0) as u8));
            out.push(255);
        }
    }
    out
}
