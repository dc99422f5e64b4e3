//! The shape on the raw image's grid.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec3A};
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::contact::{Chart, SkinContact, farthest_place};
use super::outline::outline;
use super::rows::{MIN_ROWS, share};
use super::system::SolveStatus;
use domecast_optics::{DomeShape, SensorOptics};

/// What a solve found.
pub(super) struct Skin<'a> {
    pub view: &'a View,
    /// Where each cell's point is, sensor frame, mm.
    pub points_mm: &'a [Vec3A],
    pub dome: &'a DomeShape,
}

/// The skin as triangles between the cells of a [`ShapeMap`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SkinSurface {
    /// Points of the skin, sensor frame, mm.
    pub points_mm: Vec<Vec3>,
    /// Outward unit normal of each.
    pub normals: Vec<Vec3>,
    /// Signed distance of each from the skin at rest, mm; negative where it is pressed in.
    pub heights_mm: Vec<f32>,
    /// Standard deviation of each height, mm.
    pub height_sds_mm: Vec<f32>,
    /// Corners of the triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The skin as a frame shows it: a value for each raw pixel, row by row; NaN where nothing is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ShapeMap {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Signed distance of the skin from its shape at rest, mm; negative where it is pressed in.
    pub height_mm: Vec<f32>,
    /// Its standard deviation, mm.
    pub height_sd_mm: Vec<f32>,
    /// Outward unit normal, sensor frame.
    pub normal: Vec<Vec3>,
    /// Whether the skin is touched there.
    pub is_touched: Vec<bool>,
    /// The touch, where there is one.
    pub contact: Option<SkinContact>,
    /// How the solve ended; `None` where the pose has no picture of the dome.
    pub status: Option<SolveStatus>,
    /// Whether the skin lies farther above its shape at rest than anywhere below it; then no touch is stated.
    pub is_raised: bool,
    /// Lights, by their place in the constants, that were on in the frame at rest and are out: then nothing is known.
    pub lights_out: Vec<usize>,
    /// What each light of the constants gives, parts of what it gave in the frame at rest.
    pub light_gain: Vec<f32>,
    /// The same for each cell, before it is drawn.
    cell_mm: Vec<f32>,
    /// Pixels along a cell, cells across and down.
    cell_px: usize,
    cells_across: usize,
    cells_down: usize,
    cell_normal: Vec<Vec3A>,
    cell_point: Vec<Vec3A>,
    /// Pressure over that at the edge of the touch.
    cell_pressure: Vec<f32>,
    cell_sd_mm: Vec<f32>,
    /// Room for an outline while nothing is touched.
    outline_room: Vec<Vec2>,
    /// The columns of cells between which each row of pixels has values.
    drawn: Vec<Range<usize>>,
    /// Room for a row of pixels of each band, by cell.
    mixed: Vec<Mixed>,
}

/// Values of a cell, or between one and the one below: height, its deviation and pressure; and the normal. NaN beside the dome.
type Mixed = [Vec3A; 2];

/// A row of pixels: heights, their deviations, normals, touch.
type Row<'a> = (&'a mut [f32], &'a mut [f32], &'a mut [Vec3], &'a mut [bool]);

/// Rows of pixels that are drawn one after the other.
const BAND: usize = 32;

impl ShapeMap {
    pub(super) fn new(cells: &Cells, optics: &SensorOptics) -> Self {
        let spec = optics.lens().spec();
        let (width, height) = (spec.width as usize, spec.height as usize);
        let pixels = width * height;
        Self {
            width,
            height,
            height_mm: vec![f32::NAN; pixels],
            height_sd_mm: vec![f32::NAN; pixels],
            normal: vec![Vec3::NAN; pixels],
            is_touched: vec![false; pixels],
            contact: None,
            status: None,
            is_raised: false,
            lights_out: Vec::new(),
            light_gain: Vec::new(),
            cell_mm: vec![f32::NAN; cells.count()],
            cell_px: cells.px,
            cells_across: cells.width,
            cells_down: cells.height,
            cell_normal: vec![Vec3A::NAN; cells.count()],
            cell_point: vec![Vec3A::NAN; cells.count()],
            cell_pressure: vec![0.0; cells.count()],
            cell_sd_mm: vec![f32::NAN; cells.count()],
            // Around all cells.
            outline_room: Vec::with_capacity(2 * (cells.width + cells.height)),
            drawn: vec![0..0; height],
            mixed: vec![[Vec3A::NAN; 2]; cells.width * height.div_ceil(BAND)],
        }
    }

    /// The skin as triangles; empty where nothing is known.
    pub fn surface(&self) -> SkinSurface {
        let mut surface = SkinSurface::default();
        if self.status.is_none() {
            return surface;
        }
        let mut vertex: Vec<Option<u32>> = vec![None; self.cell_mm.len()];
        for (cell, height_mm) in self.cell_mm.iter().enumerate().filter(|(_, height)| height.is_finite()) {
            vertex[cell] = u32::try_from(surface.points_mm.len()).ok();
            surface.points_mm.push(self.cell_point[cell].into());
            surface.normals.push(self.cell_normal[cell].into());
            surface.heights_mm.push(*height_mm);
            surface.height_sds_mm.push(self.cell_sd_mm[cell]);
        }
        let across = self.cells_across;
        for cell in 0..vertex.len().saturating_sub(across + 1) {
            if cell % across == across - 1 {
                continue;
            }
            let corners = [cell, cell + 1, cell + across + 1, cell + across].map(|cell| vertex[cell]);
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let (Some(a), Some(b), Some(c)) = (corners[a], corners[b], corners[c]) else { continue };
                let [p, q, r] = [a, b, c].map(|corner| surface.points_mm[corner as usize]);
                let is_outward = (q - p).cross(r - p).dot(surface.normals[a as usize]) > 0.0;
                surface.triangles.push(if is_outward { [a, b, c] } else { [a, c, b] });
            }
        }
        surface
    }

    /// The cells.
    #[cfg(feature = "traction")]
    pub(crate) fn cell_count(&self) -> usize {
        self.cell_mm.len()
    }

    /// Where a cell's skin is, sensor frame, mm; NaN where nothing is known.
    #[cfg(feature = "traction")]
    pub(crate) fn cell_point(&self, cell: usize) -> Vec3A {
        let is_known = self.cell_mm.get(cell).is_some_and(|height| !height.is_nan());
        self.cell_point.get(cell).copied().filter(|_| is_known).unwrap_or(Vec3A::NAN)
    }

    /// What the skin's own shape says of the pressure on a cell, over that at the edge of the touch; 0 where nothing touches.
    #[cfg(feature = "traction")]
    pub(crate) fn own_pressure(&self, cell: usize) -> f32 {
        self.cell_pressure.get(cell).copied().filter(|pressure| *pressure > 1.0).unwrap_or(0.0)
    }

    /// Area of the skin that a cell shows, mm^2; 0 at the dome's outline.
    #[cfg(feature = "traction")]
    pub(crate) fn cell_area_mm2(&self, cell: usize) -> f64 {
        let beside = |step: usize| self.cell_point(cell + step) - self.cell_point(cell);
        let area_mm2 = beside(1).cross(beside(self.cells_across)).length();
        if area_mm2.is_finite() { f64::from(area_mm2) } else { 0.0 }
    }

    /// Draws values of cells, linear between them, where the map has a height.
    #[cfg(feature = "traction")]
    pub(crate) fn draw_cells(&self, values: &[f32], out: &mut [f32]) {
        let (px, columns, rows) = (self.cell_px, self.cells_across, self.cells_down);
        let known = self.height_mm.iter().zip(out).enumerate().filter(|(_, (height, _))| height.is_finite());
        for (pixel, (_, out)) in known {
            let (x, y) = (pixel % self.width, pixel / self.width);
            let own = y / px * columns + x / px;
            let ((i, part_x), (j, part_y)) = (place(x, px, columns), place(y, px, rows));
            let corner = |i: usize, j: usize| {
                let value = values.get(j * columns + i).copied().unwrap_or(f32::NAN);
                if value.is_nan() { values.get(own).copied().unwrap_or(f32::NAN) } else { value }
            };
            let line = |j: usize| corner(i, j) * (1.0 - part_x) + corner(i + 1, j) * part_x;
            *out = line(j) * (1.0 - part_y) + line(j + 1) * part_y;
        }
    }

    /// How the reading ended: `ok`, `not_converged`, `no_pose`, `light_out` where a light is out that was on at rest, or `raised` where
    /// the skin lies farther above its shape at rest than anywhere below it, as no touch leaves it: where the frame at rest was touched.
    pub fn status_name(&self) -> &'static str {
        match &self.status {
            None if !self.lights_out.is_empty() => "light_out",
            None => "no_pose",
            Some(solved) if !solved.is_converged => "not_converged",
            Some(_) if self.is_raised => "raised",
            Some(_) => "ok",
        }
    }

    /// Nothing is known.
    pub(super) fn forget(&mut self) {
        self.height_mm.fill(f32::NAN);
        self.height_sd_mm.fill(f32::NAN);
        self.normal.fill(Vec3::NAN);
        self.is_touched.fill(false);
        self.drawn.fill(0..0);
        self.forget_cells();
        self.status = None;
        self.is_raised = false;
        self.lights_out.clear();
        self.light_gain.clear();
    }

    fn forget_cells(&mut self) {
        self.cell_mm.fill(f32::NAN);
        if let Some(contact) = self.contact.take() {
            // The next outline is written over the last.
            self.outline_room = contact.outline_px;
        }
    }

    /// Draws what the solve found; `sd_mm` is the deviation of a cell's height.
    pub(super) fn draw(
        &mut self,
        cells: &Cells,
        Skin { view, points_mm, dome }: &Skin<'_>,
        sd_mm: impl Fn(usize, f32) -> f32 + Sync,
        chart: &mut Chart,
        status: SolveStatus,
    ) {
        self.forget_cells();
        self.status = Some(status);
        let w = cells.width;
        let is_dome = |cell: usize| view.is_dome.get(cell).copied().unwrap_or(false);
        let heights = self.cell_mm.par_chunks_mut(w).zip(self.cell_sd_mm.par_chunks_mut(w));
        let others = self.cell_point.par_chunks_mut(w).zip(self.cell_normal.par_chunks_mut(w));
        let rows = heights.zip(others).zip(&view.spans).enumerate().with_min_len(share(MIN_ROWS));
        rows.for_each(|(row, (((heights, sds), (points, normals)), span))| {
            for column in span.clone() {
                let cell = row * w + column;
                if !is_dome(cell) {
                    continue;
                }
                let at = points_mm[cell];
                points[column] = at;
                heights[column] = dome.distance_mm(at.as_dvec3()) as f32;
                sds[column] = sd_mm(cell, heights[column]);
                let side = |next: usize| if is_dome(next) { points_mm[next] } else { at };
                let along = side(cell + 1) - side(cell.wrapping_sub(1));
                let down = side(cell + w) - side(cell.wrapping_sub(w));
                let normal = along.cross(down).normalize_or(view.normal[cell]);
                // The camera looks from inside.
                normals[column] = if normal.dot(view.ray[cell]) < 0.0 { -normal } else { normal };
            }
        });
        let deepest = self.touch(cells, view, dome, chart);
        self.spread(cells, view);
        if let Some(cell) = deepest {
            self.draw_outline(cells, cell);
        }
    }

    /// Finds the outline of the touch about its deepest place, or its middle, where an object's hole is deepest.
    fn draw_outline(&mut self, cells: &Cells, cell: usize) {
        let Some(contact) = &mut self.contact else { return };
        let (width, height) = (self.width as i64, self.height as i64);
        let is_in = |x: i64, y: i64| {
            let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
            is_inside && self.is_touched[(y * width + x) as usize]
        };
        let own = |k: usize| (k * cells.px) as i64;
        let from = (own(cell % cells.width), own(cell / cells.width));
        let mut room = std::mem::take(&mut self.outline_room);
        room.clear();
        outline(is_in, from, (width, height), &mut room);
        contact.outline_px = room;
    }

    /// Finds the touch; its deepest cell.
    fn touch(&mut self, cells: &Cells, view: &View, dome: &DomeShape, chart: &mut Chart) -> Option<usize> {
        self.cell_pressure.fill(0.0);
        let deepest = farthest_place(&self.cell_mm, &self.cell_sd_mm, cells.width, -1.0);
        let highest = farthest_place(&self.cell_mm, &self.cell_sd_mm, cells.width, 1.0);
        let far_mm = |place: Option<(usize, f32)>| place.map_or(0.0, |(_, far_mm)| far_mm);
        self.is_raised = far_mm(highest) > far_mm(deepest);
        let (deepest, _) = deepest.filter(|_| !self.is_raised)?;
        chart.take(cells, view, &self.cell_point, &self.cell_mm, deepest, dome);
        let shown = &*chart;
        let pressures = self.cell_pressure.par_iter_mut().enumerate();
        pressures.with_min_len(share(MIN_ROWS * cells.width)).for_each(|(cell, pressure)| {
            *pressure = shown.at(cell);
        });
        let (contact, deepest) = chart.contact(
            &self.cell_point,
            &self.cell_normal,
            &self.cell_mm,
            &self.cell_pressure,
            &self.cell_sd_mm,
        )?;
        self.contact = Some(contact);
        Some(deepest)
    }

    /// Linear between the cells; a pixel whose own cell sees no dome has nothing.
    fn spread(&mut self, cells: &Cells, view: &View) {
        let (width, px) = (self.width, cells.px);
        let Self { cell_mm, cell_normal, cell_pressure, cell_sd_mm, mixed, drawn, .. } = self;
        let of = |cell: usize| -> Mixed {
            let height_mm = cell_mm[cell];
            let is_known = !height_mm.is_nan();
            let values = Vec3A::new(height_mm, cell_sd_mm[cell], cell_pressure[cell]);
            if is_known { [values, cell_normal[cell]] } else { [Vec3A::NAN; 2] }
        };
        // Rows have a room together, which stays in the nearest cache.
        let band = width * BAND;
        let heights = self.height_mm.par_chunks_mut(band).zip(self.height_sd_mm.par_chunks_mut(band));
        let others = self.normal.par_chunks_mut(band).zip(self.is_touched.par_chunks_mut(band));
        let rooms = drawn.par_chunks_mut(BAND).zip(mixed.par_chunks_mut(cells.width));
        let bands = heights.zip(others).zip(rooms).enumerate().with_min_len(share(1));
        let draw_row = |y: usize,
                        (heights, sds, normals, touched): Row<'_>,
                        drawn: &mut Range<usize>,
                        mixed: &mut [Mixed]| {
            let span = view.spans.get(y / px).cloned().unwrap_or(0..0);
            if *drawn != span {
                heights.fill(f32::NAN);
                sds.fill(f32::NAN);
                normals.fill(Vec3::NAN);
                touched.fill(false);
                *drawn = span.clone();
            }
            let (row, down) = place(y, px, cells.height);
            // Pixels lie between their own cell and the one on either side.
            let beside = span.start.saturating_sub(1)..(span.end + 1).min(cells.width);
            for (column, mixed) in beside.clone().zip(&mut mixed[beside]) {
                let cell = row * cells.width + column;
                *mixed = between([of(cell), of(cell + cells.width)], down);
            }
            for x in span.start * px..span.end * px {
                let own = y / px * cells.width + x / px;
                let (column, right) = place(x, px, cells.width);
                let [values, normal] = between([mixed[column], mixed[column + 1]], right);
                let is_known = !cell_mm[own].is_nan();
                (heights[x], sds[x]) = if is_known { (values.x, values.y) } else { (f32::NAN, f32::NAN) };
                normals[x] = if is_known { normal.normalize_or_zero().into() } else { Vec3::NAN };
                touched[x] = is_known && values.z > 1.0;
            }
        };
        bands.for_each(|(band, (((heights, sds), (normals, touched)), (drawn, mixed)))| {
            let heights = heights.chunks_mut(width).zip(sds.chunks_mut(width));
            let others = normals.chunks_mut(width).zip(touched.chunks_mut(width));
            let rows = heights.zip(others).zip(drawn).zip(band * BAND..);
            for ((((heights, sds), (normals, touched)), drawn), y) in rows {
                draw_row(y, (heights, sds, normals, touched), drawn, mixed);
            }
        });
    }
}

/// Linear between two cells; one of them where the other is beside the dome.
#[inline]
fn between([first, second]: [Mixed; 2], part: f32) -> Mixed {
    if first[0].x.is_nan() {
        second
    } else if second[0].x.is_nan() {
        first
    } else {
        [0, 1].map(|k| first[k] + (second[k] - first[k]) * part)
    }
}

/// The first of the two cells about a pixel, and how far it lies from that.
#[inline]
fn place(v: usize, px: usize, n: usize) -> (usize, f32) {
    let at = (v as f32 - 0.5 * (px as f32 - 1.0)) / px as f32;
    // A cast cuts off towards 0, as a floor does of what is not negative.
    let first = (at.max(0.0) as usize).min(n.saturating_sub(2));
    (first, at - first as f32)
}
