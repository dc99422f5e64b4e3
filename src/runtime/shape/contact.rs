//! Where the skin is touched, from its shape.
//!
//! On a soft half-space the pressure `p` of a touch and the depth `u` of the skin are bound by `p = E*/2 |k| u` in the Fourier
//! plane (K. L. Johnson, Contact Mechanics, 1985, 3.2). So the pressure over half the modulus is `|k| u`: as large as slopes are,
//! and as noisy. It ends where the touch does, with a steep edge, while the depth goes on smoothly for long. The depth is laid
//! out about the deepest place by the stereographic projection, which keeps circles.

use glam::{DVec3, Vec2, Vec3A};
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::curvature::{ContactEdge, Touch};
use super::fill::{Pyramid, Weighted};
use super::fourier::Fourier;
use super::rows::{MIN_ROWS, share};
use domecast_optics::DomeShape;

/// Places along each side of the chart.
const SIDE: usize = 128;

/// Depth from which on a touch is looked for, mm, and in deviations of the depth: a dome has some thousand places of a touch's size that
/// err apart from each other, of which one in a hundred pictures lies five deviations too deep (one in 3.5 million does), and four in
/// every tenth.
pub(super) const MIN_DEPTH_MM: f32 = 0.015;
const MIN_DEPTH_SDS: f32 = 5.0;
/// Cells to each side of a place that a touch presses in with it.
const AROUND: usize = 2;

/// The chart reaches this much farther than where the skin is pressed in by a fifth of the depth.
const REACH: f32 = 1.8;

/// Smoothing, standard deviation in steps of the chart.
const SMOOTHING_STEPS: f32 = 1.2;

/// Pressure at the edge of a ball's touch of radius a, smoothed by s, over its largest: this times `sqrt(2 s / a)`. It is the
/// mean of `sqrt(max(0, z))` over a normal z (Hertz' pressure falls as the root of the distance to the edge).
const EDGE_PART: f32 = 0.411;

/// The same where nothing is known of the radius yet, and its bounds.
const FIRST_PART: f32 = 0.15;
const PARTS: [f32; 2] = [0.08, 0.3];

/// A touch of the skin. Sensor frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SkinContact {
    /// Area, on the dome at rest, mm^2.
    pub area_mm2: f64,
    /// Centre of pressure on the skin, mm.
    pub point_mm: DVec3,
    /// Mean outward normal by pressure.
    pub normal: DVec3,
    /// The deepest touched place of the skin, mm.
    pub deepest_mm: DVec3,
    /// How deep it lies under its shape at rest, mm.
    pub depth_mm: f64,
    /// Standard deviation of that, mm.
    pub depth_sd_mm: f64,
    /// Outline of the touched pixels about the deepest place, raw px, in their order.
    pub outline_px: Vec<Vec2>,
    /// Principal curvatures of the skin at the deepest place, 1/mm, the larger first: positive where it is hollow, as under a
    /// ball. `None` where the touch is too small to tell.
    pub curvatures_per_mm: Option<[f64; 2]>,
    /// The line along which an edge, a rod or a ridge presses. `None` where curvatures do not clearly differ, as under a ball.
    pub edge: Option<ContactEdge>,
}

/// The chart of one touch, and room for it, kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Chart {
    center: Vec3A,
    side_x: Vec3A,
    side_y: Vec3A,
    step_mm: f32,
    radius_mm: f32,
    center_mm: Vec3A,
    pressure: Vec<f32>,
    threshold: f32,
    /// Where each cell lies in the chart, in steps; NaN beside the dome.
    places: Vec<Vec2>,
    values: Vec<Weighted>,
    pyramid: Pyramid,
    fourier: Fourier,
}

impl Chart {
    /// Finds the pressure of a touch with a deep cell. `depths` are signed distances, NaN beside the dome.
    pub fn take(
        &mut self,
        cells: &Cells,
        view: &View,
        points: &[Vec3A],
        depths: &[f32],
        deepest: usize,
        dome: &DomeShape,
    ) {
        self.center_mm = dome.center_mm().as_vec3a();
        self.radius_mm = dome.radius_mm() as f32;
        let out = |cell: usize| (points[cell] - self.center_mm).normalize_or(Vec3A::Z);
        let is_pressed = |cell: &usize| view.is_dome[*cell] && depths[*cell] < 0.2 * depths[deepest];
        let pressed = || (0..cells.count()).filter(is_pressed);
        self.center = pressed().map(out).sum::<Vec3A>().normalize_or(out(deepest));
        self.side_x = self.center.any_orthonormal_vector();
        self.side_y = self.center.cross(self.side_x);
        let far = pressed().map(|cell| self.flat(points[cell]).length()).fold(0.0, f32::max);
        // At least sixteen cells to each side: the edge of a small touch needs places around it.
        let near = (points[deepest] - points[(deepest + 1).min(points.len() - 1)]).length();
        let reach = (REACH * far).max(16.0 * near.min(0.1 * self.radius_mm)).min(1.5 * self.radius_mm);
        self.step_mm = 2.0 * reach / SIDE as f32;
        self.find_places(cells, view, points);
        self.lay_out(cells, view, depths);
        self.find_pressure(near.min(reach));
    }

    /// Stereographic coordinates of a point of the skin, mm.
    #[inline]
    fn flat(&self, point_mm: Vec3A) -> Vec2 {
        let out = (point_mm - self.center_mm).normalize_or(self.center);
        let along = 2.0 * self.radius_mm / (1.0 + out.dot(self.center)).max(1e-3);
        Vec2::new(out.dot(self.side_x), out.dot(self.side_y)) * along
    }

    #[inline]
    fn place(&self, point_mm: Vec3A) -> Vec2 {
        self.flat(point_mm) / self.step_mm + Vec2::splat(0.5 * SIDE as f32)
    }

    /// Finds each cell's place in the chart.
    fn find_places(&mut self, cells: &Cells, view: &View, points: &[Vec3A]) {
        let mut places = std::mem::take(&mut self.places);
        places.resize(cells.count(), Vec2::NAN);
        let rows = places.par_chunks_mut(cells.width).zip(points.par_chunks(cells.width)).enumerate();
        rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (places, points))| {
            let is_dome = &view.is_dome[row * cells.width..];
            for ((place, point), is_dome) in places.iter_mut().zip(points).zip(is_dome) {
                *place = if *is_dome { self.place(*point) } else { Vec2::NAN };
            }
        });
        self.places = places;
    }

    /// Puts the depths at the chart's places.
    fn lay_out(&mut self, cells: &Cells, view: &View, depths: &[f32]) {
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.resize(SIDE * SIDE, Weighted::default());
        for cell in (0..cells.count()).filter(|cell| view.is_dome[*cell]) {
            let at = self.places[cell];
            let low = at.floor();
            let part = at - low;
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let (x, y) = (low.x + dx, low.y + dy);
                if x >= 0.0 && y >= 0.0 && x < SIDE as f32 && y < SIDE as f32 {
                    let weight = (1.0 - (part.x - dx).abs()) * (1.0 - (part.y - dy).abs());
                    values[y as usize * SIDE + x as usize].add(Vec3A::X * depths[cell], weight);
                }
            }
        }
        values.iter_mut().for_each(|place| *place = place.mean());
        self.pyramid.fill(SIDE, &mut values);
        // The square goes on periodically: its margin leads to zero.
        let fade = |i: usize| {
            let to_edge = i.min(SIDE - 1 - i) as f32 / (0.15 * SIDE as f32);
            if to_edge < 1.0 { 0.5 - 0.5 * (std::f32::consts::PI * to_edge).cos() } else { 1.0 }
        };
        let fade: [f32; SIDE] = std::array::from_fn(fade);
        self.pressure.clear();
        let faded = values.iter().enumerate().map(|(i, v)| v.value().x * fade[i % SIDE] * fade[i / SIDE]);
        self.pressure.extend(faded);
        self.values = values;
    }

    /// From depth to pressure over half the modulus, and the level at which it ends.
    fn find_pressure(&mut self, cell_mm: f32) {
        let per_mm = std::f32::consts::TAU / (SIDE as f32 * self.step_mm);
        let smooth = SMOOTHING_STEPS * std::f32::consts::TAU / SIDE as f32;
        let smoothed: [f32; SIDE / 2 + 1] =
            std::array::from_fn(|wave| (-0.5 * (wave as f32 * smooth).powi(2)).exp());
        self.fourier.filter(&mut self.pressure, SIDE, |x, y| {
            let [part_x, part_y] = [x, y].map(|wave| smoothed[wave.abs() as usize]);
            -(x * x + y * y).sqrt() * per_mm * part_x * part_y
        });
        let largest = self.pressure.iter().fold(0.0_f32, |max, p| max.max(*p));
        self.threshold = FIRST_PART * largest;
        let radius_mm = (self.area_mm2() / std::f64::consts::PI).sqrt() as f32;
        let smoothed_mm = (SMOOTHING_STEPS * self.step_mm).hypot(0.5 * cell_mm);
        let part = EDGE_PART * (2.0 * smoothed_mm / radius_mm.max(smoothed_mm)).sqrt();
        self.threshold = part.clamp(PARTS[0], PARTS[1]) * largest;
    }

    /// Pressure at a cell, over that at the edge of the touch.
    #[inline]
    pub fn at(&self, cell: usize) -> f32 {
        let at = self.places[cell];
        let low = at.floor();
        let last = SIDE as f32 - 1.0;
        if !(low.x >= 0.0 && low.y >= 0.0 && low.x < last && low.y < last) {
            return 0.0;
        }
        let (part, start) = (at - low, low.y as usize * SIDE + low.x as usize);
        let of = |i: usize| self.pressure[start + i];
        let mix = |a: f32, b: f32, part: f32| a + (b - a) * part;
        mix(mix(of(0), of(1), part.x), mix(of(SIDE), of(SIDE + 1), part.x), part.y) / self.threshold
    }

    /// Area where the pressure is above its level at the edge, on the dome at rest.
    fn area_mm2(&self) -> f64 {
        let inside = (0..SIDE * SIDE).filter(|i| self.pressure[*i] > self.threshold);
        let areas = inside.map(|i| {
            let flat = Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) - Vec2::splat(0.5 * SIDE as f32);
            // The projection's scale.
            let square = (flat * self.step_mm).length_squared() / (4.0 * self.radius_mm * self.radius_mm);
            f64::from((self.step_mm / (1.0 + square)).powi(2))
        });
        areas.sum()
    }

    /// What the touch is as a whole, and its deepest cell; `pressures` are [`Chart::at`] of the cells.
    pub fn contact(
        &self,
        points: &[Vec3A],
        normals: &[Vec3A],
        depths: &[f32],
        pressures: &[f32],
        sds_mm: &[f32],
    ) -> Option<(SkinContact, usize)> {
        let touched = (0..depths.len()).filter(|cell| pressures[*cell] > 1.0 && depths[*cell].is_finite());
        let deepest = touched.min_by(|a, b| depths[*a].total_cmp(&depths[*b]))?;
        let (mut sum, mut point, mut normal) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for (cell, pressure) in pressures.iter().enumerate().filter(|(_, p)| **p > 1.0) {
            let load = f64::from(*pressure);
            sum += load;
            point += load * points[cell].as_dvec3();
            normal += load * normals[cell].as_dvec3();
        }
        let area_mm2 = self.area_mm2();
        let touch = Touch { points, normals, pressures, at: deepest };
        let (radius_mm, depth_sd_mm) = ((area_mm2 / std::f64::consts::PI).sqrt(), f64::from(sds_mm[deepest]));
        let contact = SkinContact {
            area_mm2,
            point_mm: point / sum,
            normal: normal.normalize_or_zero(),
            deepest_mm: points[deepest].as_dvec3(),
            depth_mm: f64::from(-depths[deepest]),
            depth_sd_mm,
            outline_px: Vec::new(),
            curvatures_per_mm: touch.bend(0.5 * radius_mm).map(|bend| bend.per_mm),
            edge: touch.edge(radius_mm, f64::from(MIN_DEPTH_SDS) * depth_sd_mm),
        };
        Some((contact, deepest))
    }
}

/// The middle of the place that lies farthest from its shape at rest, and how far, as its nearest cell has it: a touch presses all of a
/// place in. What a few cells show that others beside them do not is noise, or an outline that is seen in part. `way` is -1 for what
/// is pressed in, 1 for what is raised.
pub(super) fn farthest_place(
    heights_mm: &[f32],
    sds_mm: &[f32],
    width: usize,
    way: f32,
) -> Option<(usize, f32)> {
    let is_far = |cell: usize, far_mm: f32| far_mm > MIN_DEPTH_MM.max(MIN_DEPTH_SDS * sds_mm[cell]);
    let nearest_mm = |cell: usize| -> Option<f32> {
        let (first, last) = (cell.checked_sub(AROUND * width + AROUND)?, cell + AROUND * width + AROUND);
        let rows = heights_mm.get(first..=last)?.chunks(width).flat_map(|row| &row[..=2 * AROUND]);
        let nearest =
            rows.map(|height_mm| way * height_mm).reduce(|a, b| if a.is_nan() || a <= b { a } else { b });
        nearest.filter(|far_mm| is_far(cell, *far_mm))
    };
    let far = |cell: &usize| is_far(*cell, way * heights_mm[*cell]);
    let places = (0..heights_mm.len()).filter(far).filter_map(|cell| Some((cell, nearest_mm(cell)?)));
    places.min_by(|a, b| b.1.total_cmp(&a.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farthest_place_is_one_that_all_around_it_shares() {
        let (width, height) = (20, 20);
        let mut heights_mm = vec![0.0_f32; width * height];
        let sds_mm = vec![0.01_f32; width * height];
        let mut block = |row: usize, column: usize, side: usize, height_mm: f32| {
            for r in row..row + side {
                heights_mm[r * width + column..][..side].fill(height_mm);
            }
            farthest_place(&heights_mm, &sds_mm, width, 1.0)
        };
        // no wider than noise; too low for its deviation
        assert_eq!(block(2, 2, 4, 1.0), None);
        assert_eq!(block(8, 8, 5, 0.045), None);
        assert_eq!(block(8, 8, 5, 0.06), Some((10 * width + 10, 0.06)));
        assert_eq!(block(14, 14, 6, -0.5), Some((10 * width + 10, 0.06)));
        let pressed = farthest_place(&heights_mm, &sds_mm, width, -1.0);
        assert_eq!(pressed, Some((16 * width + 16, 0.5)));
        heights_mm[16 * width + 16] = f32::NAN;
        assert_eq!(farthest_place(&heights_mm, &sds_mm, width, -1.0), None);
    }
}
