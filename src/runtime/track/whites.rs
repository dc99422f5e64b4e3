//! White markers in the frame: candidates by contrast, then a fit of what a disc beside the dome looks like.
//!
//! A marker lies 0.2 mm beside the dome's rim, whose membrane is bright too: a centroid over a window would take some
//! of it in. So the picture of it is fitted: a disc on the sheet, the rim, three levels, the disc's place free.

use glam::{DMat2, DVec2};
use nalgebra::{SMatrix, SVector};

use super::frame::Plane;
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;

/// Half of the width over which an edge goes from one level to the other, px.
const EDGE_PX: f64 = 1.1;
/// Pixels that far outside of the outline are part of the fit: the ground around.
const GROUND_PX: f64 = 2.6;
/// Pixels so far from every outline are flat: what is left of them is noise.
const FLAT_PX: f64 = 1.6;
const MOST_STEPS: u32 = 12;
/// Steps from a place in a disc to its middle.
const CENTER_STEPS: u32 = 6;
/// A step below this ends the fit, px; the next one would be a tenth of it.
const SETTLED_PX: f64 = 4e-3;
/// Least difference between marker and ground, levels: what quantisation and a small camera's noise leave of the mean
/// of nine pixels is a tenth of it. Markers that only the dome's own light reaches rise by little more than ten.
const LEAST_RISE: f64 = 4.0;
/// And in parts of the noise of one pixel.
const LEAST_RISE_IN_NOISE: f64 = 3.0;
/// Largest half of a window, px.
const MOST_HALF: i32 = 40;

/// A marker as it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Disc {
    pub centroid_px: DVec2,
    pub sd_px: f64,
    /// Part of the contrast that the picture of a disc leaves unexplained.
    pub misfit: f64,
    /// Levels of ground, disc and dome, the last two counted from the ground: a start for the next frame.
    pub levels: [f64; 3],
    /// By what part of itself the disc's level rises in a px, as this frame shows it; `None` where too little of it is
    /// flat.
    pub tilt: Option<DVec2>,
}

/// Fewest flat pixels that tell a slope.
const TILT_PIXELS: f64 = 16.0;

/// How a marker's surroundings map to the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Millimetres on the sheet by pixels.
    mm_by_px: DMat2,
    place_mm: DVec2,
    radius_mm: f64,
    rim_mm: f64,
    half: i32,
    /// Eight places outside of the outline, a fifth larger than it is, from its middle, whole pixels.
    around: [[i32; 2]; 8],
}

impl View {
    /// At the pose of the optics; `None` where the marker is not seen, or wider than what is looked at.
    pub fn new(optics: &SensorOptics, marker: &Marker) -> Option<Self> {
        let motion = optics.project_with_motion(marker.position_mm).ok()?;
        let m = motion.by_point;
        let px_by_mm = DMat2::from_cols_array(&[m[(0, 0)], m[(1, 0)], m[(0, 1)], m[(1, 1)]]);
        let radius_mm = 0.5 * marker.diameter_mm;
        let mm_by_px = px_by_mm.inverse();
        // A point has no picture of its own: a pixel stands for it.
        let radius_mm = radius_mm.max(0.5 / px_by_mm.determinant().abs().sqrt().max(1e-9));
        let reach = radius_mm * (px_by_mm.x_axis.length() + px_by_mm.y_axis.length());
        let half = (reach + GROUND_PX + 1.0).ceil();
        let usable = mm_by_px.is_finite() && half.is_finite() && half <= f64::from(MOST_HALF);
        usable.then_some(Self {
            mm_by_px,
            place_mm: marker.position_mm.truncate(),
            radius_mm,
            rim_mm: optics.dome_radius_mm(),
            half: half as i32,
            around: std::array::from_fn(|k| {
                let (sin, cos) = (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
                let edge = px_by_mm * (DVec2::new(cos, sin) * radius_mm);
                let out = edge * (1.2 + 1.6 / edge.length().max(0.5));
                [out.x.round() as i32, out.y.round() as i32]
            }),
        })
    }

    /// Levels of the middle and of what is around, where the first is brighter.
    fn levels(&self, plane: &Plane<'_>, x: i32, y: i32) -> Option<[f64; 2]> {
        let mut middle = 0;
        for dy in -1..=1 {
            for dx in -1..=1 {
                middle += i32::from(plane.at(x + dx, y + dy));
            }
        }
        // The fourth brightest around: three may fall on the dome beside; between dots, or on an edge, four and more are
        // as bright as the middle.
        let mut top = [0; 4];
        for [dx, dy] in self.around {
            let mut value = i32::from(plane.at(x + dx, y + dy));
            for place in &mut top {
                if value > *place {
                    std::mem::swap(&mut value, place);
                }
            }
            if 9 * top[3] >= middle {
                return None;
            }
        }
        Some([f64::from(middle) / 9.0, f64::from(top[3])])
    }

    /// By what part of itself the middle is brighter than what is around; `None` where that is not enough for a marker.
    ///
    /// A part, not levels: a dim marker before the dark rises by less than a bright patch between two dots does.
    fn rise(&self, plane: &Plane<'_>, x: i32, y: i32) -> Option<f64> {
        let [middle, around] = self.levels(plane, x, y)?;
        (middle - around >= LEAST_RISE).then(|| (middle - around) / (middle + LEAST_RISE))
    }

    /// The middle of what is as bright as a place, in an outline of the marker's size that moves with it.
    fn center(&self, plane: &Plane<'_>, start: DVec2) -> DVec2 {
        let (x, y) = (start.x.round() as i32, start.y.round() as i32);
        let Some([middle, around]) = self.levels(plane, x, y) else { return start };
        let level = 0.5 * (middle + around);
        let mut at = start;
        for _ in 0..CENTER_STEPS {
            let (cx, cy) = (at.x.round() as i32, at.y.round() as i32);
            let (mut sum, mut count) = (DVec2::ZERO, 0.0);
            for y in cy - self.half..=cy + self.half {
                for x in cx - self.half..=cx + self.half {
                    let place = DVec2::new(f64::from(x), f64::from(y));
                    let inside = (self.mm_by_px * (place - at)).length() <= 1.1 * self.radius_mm;
                    if inside && f64::from(plane.at(x, y)) > level {
                        sum += place;
                        count += 1.0;
                    }
                }
            }
            if count == 0.0 {
                return start;
            }
            let next = sum / count;
            let moved = next.distance(at);
            at = next;
            if moved < 0.3 {
                break;
            }
        }
        at
    }

    /// The places within `reach_px` of `start` that look most like a marker, the best first, at least its own size
    /// apart; `white`: the level that they must pass, if one is fixed. Returns how many of `out` are filled.
    pub fn candidates(
        &self,
        plane: &Plane<'_>,
        start: DVec2,
        reach_px: f64,
        white: Option<u8>,
        out: &mut [(f64, DVec2)],
    ) -> usize {
        let mut count = 0;
        let (cx, cy) = (start.x.round() as i32, start.y.round() as i32);
        let reach = reach_px.clamp(1.0, 2000.0).ceil() as i32;
        // Far searches look at every other pixel; markers are wider than that.
        let step = if reach > 24 { 2 } else { 1 };
        let apart = 0.7 * f64::from(self.half);
        let rows = (cy - reach).max(1)..=(cy + reach).min(plane.height() as i32 - 2);
        for y in rows.step_by(step) {
            let columns = (cx - reach).max(1)..=(cx + reach).min(plane.width() as i32 - 2);
            for x in columns.step_by(step) {
                let level = plane.at(x, y);
                if white.is_some_and(|white| level <= white) || level < LEAST_RISE as u8 {
                    continue;
                }
                let at = DVec2::new(f64::from(x), f64::from(y));
                if at.distance(start) > reach_px {
                    continue;
                }
                let Some(rise) = self.rise(plane, x, y) else { continue };
                let near = out[..count].iter().position(|(_, p)| p.distance(at) < apart);
                match near {
                    Some(i) if out[i].0 < rise => out[i] = (rise, at),
                    Some(_) => {}
                    None if count < out.len() => {
                        out[count] = (rise, at);
                        count += 1;
                    }
                    None => {
                        let least = (0..count).min_by(|a, b| out[*a].0.total_cmp(&out[*b].0));
                        if let Some(i) = least.filter(|i| out[*i].0 < rise) {
                            out[i] = (rise, at);
                        }
                    }
                }
            }
        }
        out[..count].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        // A disc is as bright all over: where in it the scan met it first says little.
        for (_, at) in &mut out[..count] {
            *at = self.center(plane, *at);
        }
        count
    }

    /// The disc near `start`, at most `stray_px` from it: Gauss-Newton on the pixels, for the place, the levels of
    /// ground, disc and dome; `levels`: those of the last frame, if there was one; `tilt`: how the light falls off.
    pub fn fit(
        &self,
        plane: &Plane<'_>,
        start: DVec2,
        stray_px: f64,
        levels: Option<[f64; 3]>,
        tilt: DVec2,
    ) -> Option<Disc> {
        let mut at = start;
        let mut normal = SMatrix::<f64, 5, 5>::zeros();
        let (mut left, mut count, mut noise, mut tilted) = (0.0, 0.0, 0.0, None);
        let mut levels = levels.map(SVector::from);
        let mut settled = false;
        for _ in 0..MOST_STEPS {
            let inside = at.x > 2.0
                && at.y > 2.0
                && at.x < plane.width() as f64 - 3.0
                && at.y < plane.height() as f64 - 3.0;
            if !(inside && at.distance(start) <= stray_px) {
                return None;
            }
            // First the levels alone, at the start; then the place with them.
            let known = match levels {
                Some(known) => known,
                None => {
                    let alone = self.sums(plane, at, None, tilt)?;
                    solve_levels(&alone.normal, &alone.right)?
                }
            };
            let sums = self.sums(plane, at, Some(&known), tilt)?;
            let step = solve_all(&sums.normal, &sums.right)?;
            (normal, left, count, noise) = (sums.normal, sums.left, sums.count, sums.noise());
            tilted = sums.slope.map(|slope| tilt + slope / (known[0] + known[1]).max(LEAST_RISE));
            levels = Some(known + step.fixed_rows::<3>(0));
            let shift = DVec2::new(step[3], step[4]).clamp_length_max(1.5);
            at += shift;
            if shift.length() < SETTLED_PX {
                settled = true;
                break;
            }
        }
        let levels = levels?;
        let rise = levels[1];
        let rms = (left / (count - 5.0).max(1.0)).max(1.0 / 12.0).sqrt();
        // What is a disc, perhaps beside a dome brighter than it, leaves a small part of that unexplained.
        let contrast = rise.max(0.5 * levels[2].abs());
        let clear = rise > LEAST_RISE && rise > LEAST_RISE_IN_NOISE * noise;
        if !(settled && clear && rms < 0.25 * contrast) {
            return None;
        }
        let inverse = with_floor(&normal).cholesky()?.inverse();
        let sd_px = noise * (0.5 * (inverse[(3, 3)] + inverse[(4, 4)])).max(0.0).sqrt();
        at.is_finite().then_some(Disc {
            centroid_px: at,
            sd_px,
            misfit: rms / contrast,
            levels: levels.into(),
            tilt: tilted,
        })
    }

    /// Normal equations over the window: columns ground, disc, dome, and the place (with `levels` known).
    fn sums(
        &self,
        plane: &Plane<'_>,
        at: DVec2,
        levels: Option<&SVector<f64, 3>>,
        tilt: DVec2,
    ) -> Option<Sums> {
        let mut normal = [[0.0; 5]; 5];
        let mut right = [0.0; 5];
        let (mut left, mut count) = (0.0, 0.0);
        // On ground, disc and dome: pixels, sum of what is left of them, sum of its squares.
        let mut flats = [[0.0; 3]; 3];
        // On the disc, for the slope of what is left: pixels, sums of x, y, xx, xy, yy, of what is left, and of its
        // products with x and y.
        let mut lean = [0.0; 9];
        let (cx, cy) = (at.x.round() as i32, at.y.round() as i32);
        let transposed = self.mm_by_px.transpose();
        // A pixel is at most this many mm: beyond that and the ground's width nothing is looked at.
        let far =
            self.radius_mm + GROUND_PX * (self.mm_by_px.x_axis.length() + self.mm_by_px.y_axis.length());
        // So far from the rim there is no dome.
        let from_axis = self.place_mm.length().max(1e-9);
        let has_rim = from_axis - far < self.rim_mm + far;
        // Over the window the rim's direction, and so the pixels to a millimetre across it, hardly change.
        let rim_px_by_mm = 1.0 / (transposed * (self.place_mm / from_axis)).length().max(1e-9);
        let mut known = [0.0; 3];
        if let Some(levels) = levels {
            known = [levels[0], levels[1], levels[2]];
        }
        for y in cy - self.half..=cy + self.half {
            for x in cx - self.half..=cx + self.half {
                let from = DVec2::new(f64::from(x), f64::from(y)) - at;
                let u = self.mm_by_px * from;
                let square = u.length_squared();
                if square > far * far {
                    continue;
                }
                let distance = square.sqrt().max(1e-9);
                let slope = transposed * (u / distance);
                let steep = slope.length().max(1e-9);
                let outside = (distance - self.radius_mm) / steep;
                if outside > GROUND_PX {
                    continue;
                }
                let (disc, disc_slope) = edge(outside);
                let (mut dome, mut from_rim) = (0.0, f64::INFINITY);
                if has_rim {
                    from_rim = ((self.place_mm + u).length() - self.rim_mm) * rim_px_by_mm;
                    dome = edge(from_rim).0;
                }
                let value = f64::from(plane.at(x, y));
                let beside = dome * (1.0 - disc);
                // The light falls off over disc and what it hides alike.
                let lit = tilt.dot(from);
                let mut row = [1.0 + disc * lit, disc * (1.0 + lit), beside, 0.0, 0.0];
                let mut rest = value;
                if levels.is_some() {
                    // The outline moves with the place: outside falls by the unit normal.
                    let (step, whole) = (known[1] - dome * known[2], known[0] + known[1]);
                    let by_place =
                        slope * (-disc_slope * (step + whole * lit) / steep) - tilt * (disc * whole);
                    row[3] = by_place.x;
                    row[4] = by_place.y;
                    rest -= known[0] * row[0] + known[1] * row[1] + known[2] * beside;
                }
                for i in 0..5 {
                    right[i] += row[i] * rest;
                    for j in 0..=i {
                        normal[i][j] += row[i] * row[j];
                    }
                }
                left += rest * rest;
                count += 1.0;
                if outside.abs() > FLAT_PX && from_rim.abs() > FLAT_PX + 1.0 {
                    let place = if disc == 1.0 { 1 } else { 2 * usize::from(dome == 1.0) };
                    let [n, sum, square] = &mut flats[place];
                    *n += 1.0;
                    *sum += rest;
                    *square += rest * rest;
                }
                if outside < -FLAT_PX {
                    let (x, y) = (from.x, from.y);
                    let add = [1.0, x, y, x * x, x * y, y * y, rest, x * rest, y * rest];
                    lean.iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
                }
            }
        }
        let slope = slope_of(&lean);
        let normal = SMatrix::from_fn(|i, j| if i < j { normal[j][i] } else { normal[i][j] });
        let right = SVector::from(right);
        (count > 12.0).then_some(Sums { normal, right, left, count, flats, slope })
    }
}

/// Normal equations over a window.
struct Sums {
    normal: SMatrix<f64, 5, 5>,
    right: SVector<f64, 5>,
    /// Sum of squared residuals, and the number of pixels.
    left: f64,
    count: f64,
    /// Where no edge is near, on ground, disc and dome: pixels, sum of residuals, sum of squared ones.
    flats: [[f64; 3]; 3],
    /// Slope of the residuals on the disc's flat, levels a px.
    slope: Option<DVec2>,
}

/// The slope of a plane through residuals, from their number, sums of x, y, xx, xy, yy, theirs, and of xr, yr.
fn slope_of([n, x, y, xx, xy, yy, rest, xr, yr]: &[f64; 9]) -> Option<DVec2> {
    if *n < TILT_PIXELS {
        return None;
    }
    let [cxx, cxy, cyy] = [xx - x * x / n, xy - x * y / n, yy - y * y / n];
    let [cxr, cyr] = [xr - x * rest / n, yr - y * rest / n];
    let det = cxx * cyy - cxy * cxy;
    (det > 1e-3 * cxx * cyy).then(|| DVec2::new(cxr * cyy - cyr * cxy, cyr * cxx - cxr * cxy) / det)
}

impl Sums {
    /// Standard deviation of a pixel, levels; quantisation alone leaves a twelfth.
    fn noise(&self) -> f64 {
        // About each flat's own mean: edges that are not quite like the model's shift the levels of the fit.
        let (mut left, mut freedom) = (0.0, 0.0);
        for [n, sum, square] in self.flats.iter().filter(|flat| flat[0] >= 4.0) {
            left += (square - sum * sum / n).max(0.0);
            freedom += n - 1.0;
        }
        if freedom < 9.0 {
            (left, freedom) = (self.left, self.count - 5.0);
        }
        (left / freedom.max(1.0)).max(1.0 / 12.0).sqrt()
    }
}

/// From 1 inside to 0 outside of an outline, and the slope, over the distance from it, px.
fn edge(outside_px: f64) -> (f64, f64) {
    let t = (0.5 - outside_px / (2.0 * EDGE_PX)).clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / (2.0 * EDGE_PX))
}

/// A rim that hardly enters the window has no level of its own.
fn with_floor(normal: &SMatrix<f64, 5, 5>) -> SMatrix<f64, 5, 5> {
    let mut floored = *normal;
    floored[(2, 2)] += 0.5;
    for i in 3..5 {
        floored[(i, i)] += 1e-6;
    }
    floored
}

fn solve_levels(normal: &SMatrix<f64, 5, 5>, right: &SVector<f64, 5>) -> Option<SVector<f64, 3>> {
    let matrix = with_floor(normal).fixed_view::<3, 3>(0, 0).into_owned();
    Some(matrix.cholesky()?.solve(&right.fixed_rows::<3>(0).into_owned()))
}

fn solve_all(normal: &SMatrix<f64, 5, 5>, right: &SVector<f64, 5>) -> Option<SVector<f64, 5>> {
    let step = with_floor(normal).cholesky()?.solve(right);
    step.iter().all(|v| v.is_finite()).then_some(step)
}
