//! The dots and white markers in the picture: where the membrane's colour is not seen.

use glam::{DMat2, DVec2, DVec3};

use super::cells::{Cells, View};
use crate::constants::Constants;
use crate::track::{MarkState, Tracked};
use domecast_optics::SensorOptics;

/// How far beyond its edge a mark still colours the picture, px: blur, and what JPEG spreads.
const MARGIN_PX: f64 = 2.0;

/// The same where the mark was not found, and may be that far from where the undeformed dome would show it.
const LOST_MARGIN_PX: f64 = 5.0;

/// Cells so near to what is beside the dome show some of that, as what lies beside a mark does; so do those that a pose which is off by
/// its noise takes for the dome's. The margin of marks in cells of the usual two pixels.
const OUTLINE_CELLS: usize = 1;

/// A mark's ellipse in the picture: the images of two of its radii at right angles, px.
#[derive(Debug, Clone, Copy)]
struct Ellipse {
    radii_px: [DVec2; 2],
}

/// The marks of a sensor, in the order of its constants.
#[derive(Debug, Clone)]
pub(super) struct Marks {
    dots: Vec<Option<Ellipse>>,
    markers: Vec<Option<Ellipse>>,
}

impl Marks {
    pub fn new(constants: &Constants, optics: &SensorOptics) -> Self {
        let ellipse = |at_mm: DVec3, normal: DVec3, diameter_mm: f64| {
            let [a, b] = <[DVec3; 2]>::from(normal.try_normalize()?.any_orthonormal_pair());
            let across = |along: DVec3| {
                let end = |side: f64| optics.project(optics.dome().nearest_mm(at_mm + along * side)).ok();
                Some(0.5 * (end(0.5 * diameter_mm)? - end(-0.5 * diameter_mm)?))
            };
            Some(Ellipse { radii_px: [across(a)?, across(b)?] })
        };
        let flat = |at_mm: DVec3, diameter_mm: f64| {
            let across = |along: DVec3| {
                let end = |side: f64| optics.project(at_mm + along * side).ok();
                Some(0.5 * (end(0.5 * diameter_mm)? - end(-0.5 * diameter_mm)?))
            };
            Some(Ellipse { radii_px: [across(DVec3::X)?, across(DVec3::Y)?] })
        };
        let array = DVec3::from_array;
        let dots = constants.black_dots.iter();
        let markers = constants.white_markers.iter();
        Self {
            dots: dots
                .map(|dot| ellipse(array(dot.surface_mm), array(dot.normal), dot.diameter_mm))
                .collect(),
            markers: markers.map(|marker| flat(array(marker.position_mm), marker.diameter_mm)).collect(),
        }
    }

    /// Marks the cells that a frame's dots and markers cover, and those at the dome's outline.
    pub fn cover(&self, tracked: &Tracked, cells: &Cells, view: &View, covered: &mut [bool]) {
        covered.fill(false);
        cover_outline(cells, view, covered);
        for (dot, ellipse) in tracked.black_dots.iter().zip(&self.dots) {
            let Some(ellipse) = ellipse else { continue };
            let seen = dot.centroid_px.filter(|_| dot.state == MarkState::Ok);
            let margin_px = if seen.is_some() { MARGIN_PX } else { LOST_MARGIN_PX };
            // A dot that is not sure may be at either place.
            for at in [seen.or(dot.undeformed_px), dot.ink_px].into_iter().flatten() {
                ellipse.cover(at, margin_px, cells, covered);
            }
        }
        for (marker, ellipse) in tracked.white_markers.iter().zip(&self.markers) {
            if let (Some(ellipse), Some(at)) = (ellipse, marker.centroid_px) {
                ellipse.cover(at, MARGIN_PX, cells, covered);
            }
        }
        for at in &tracked.false_dots {
            let Some(ellipse) = self.dots.iter().flatten().next() else { continue };
            ellipse.cover(*at, MARGIN_PX, cells, covered);
        }
    }
}

/// Marks the dome's cells that have others beside them.
fn cover_outline(cells: &Cells, view: &View, covered: &mut [bool]) {
    let width = cells.width;
    let is_beside = |row: usize, column: usize| {
        let rows = row.saturating_sub(OUTLINE_CELLS)..=(row + OUTLINE_CELLS).min(cells.height - 1);
        let columns = column.saturating_sub(OUTLINE_CELLS)..=(column + OUTLINE_CELLS).min(width - 1);
        rows.into_iter().any(|row| columns.clone().any(|column| !view.is_dome[row * width + column]))
    };
    for (row, span) in view.spans.iter().enumerate() {
        for column in span.clone().filter(|column| is_beside(row, *column)) {
            covered[row * width + column] = true;
        }
    }
}

impl Ellipse {
    fn cover(&self, at_px: DVec2, margin_px: f64, cells: &Cells, covered: &mut [bool]) {
        // The margin, and half of a cell's diagonal.
        let more = margin_px + 0.5 * std::f64::consts::SQRT_2 * cells.px as f64;
        let [a, b] = self.radii_px.map(|radius| radius * (1.0 + more / radius.length().max(1e-3)));
        let matrix = DMat2::from_cols(a, b);
        let is_ellipse = matrix.determinant().abs() > 1e-6;
        if !is_ellipse || !at_px.is_finite() {
            return;
        }
        let unit_from_px = matrix.inverse();
        let reach = DVec2::new(a.x.abs() + b.x.abs(), a.y.abs() + b.y.abs());
        let low = cells.of_pixel(at_px - reach).max(DVec2::ZERO);
        let high = cells.of_pixel(at_px + reach);
        let (right, bottom) = (cells.width as f64 - 1.0, cells.height as f64 - 1.0);
        for row in low.y.ceil() as usize..=high.y.min(bottom).max(-1.0) as usize {
            for column in low.x.ceil() as usize..=high.x.min(right).max(-1.0) as usize {
                let away = unit_from_px * (cells.center_of(column, row) - at_px);
                if away.length_squared() <= 1.0
                    && let Some(covered) = covered.get_mut(row * cells.width + column)
                {
                    *covered = true;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::DotResult;

    #[test]
    fn ink_is_no_skin_whatever_the_tracker_thinks_of_it() {
        let radii_px = [DVec2::X * 4.0, DVec2::Y * 4.0];
        let marks = Marks { dots: vec![Some(Ellipse { radii_px })], markers: Vec::new() };
        let cells = Cells { px: 2, width: 40, height: 40, rays: Vec::new() };
        let covered = |dot: DotResult| {
            let mut covered = vec![false; cells.count()];
            let tracked = Tracked { black_dots: vec![dot], ..Tracked::default() };
            marks.cover(&tracked, &cells, &View::default(), &mut covered);
            move |x: usize, y: usize| covered[y / 2 * 40 + x / 2]
        };
        let (rest, ink) = (Some(DVec2::new(20.0, 20.0)), Some(DVec2::new(50.0, 40.0)));
        for state in [MarkState::Dirty, MarkState::IdentityUnsure] {
            let is_covered =
                covered(DotResult { state, undeformed_px: rest, ink_px: ink, ..DotResult::default() });
            assert!(is_covered(20, 20) && is_covered(50, 40) && !is_covered(35, 60), "{state:?}");
        }
        let seen = DotResult {
            state: MarkState::Ok,
            centroid_px: ink,
            ink_px: ink,
            undeformed_px: rest,
            ..DotResult::default()
        };
        let is_covered = covered(seen);
        assert!(is_covered(50, 40) && !is_covered(20, 20));
    }

    #[test]
    fn the_dome_is_not_read_at_its_outline() {
        let cells = Cells { px: 2, width: 9, height: 9, rays: Vec::new() };
        let is_dome = |cell: usize| (cell % 9).abs_diff(4).pow(2) + (cell / 9).abs_diff(4).pow(2) <= 13;
        let spans = (0..9).map(|row| {
            let on: Vec<usize> = (0..9).filter(|column| is_dome(row * 9 + column)).collect();
            on.first().map_or(0..0, |first| *first..on.last().map_or(*first, |last| last + 1))
        });
        let view =
            View { spans: spans.collect(), is_dome: (0..81).map(is_dome).collect(), ..View::default() };
        let mut covered = vec![false; 81];
        let marks = Marks { dots: Vec::new(), markers: Vec::new() };
        marks.cover(&Tracked::default(), &cells, &view, &mut covered);
        let bare: Vec<usize> = (0..81_usize).filter(|cell| view.is_dome[*cell] && !covered[*cell]).collect();
        // of a disc of three and a half cells two remain
        let wanted: Vec<usize> =
            (0..81_usize).filter(|cell| (cell % 9).abs_diff(4).max((cell / 9).abs_diff(4)) <= 2).collect();
        assert!(!bare.is_empty() && bare.iter().all(|cell| wanted.contains(cell)), "{bare:?}");
        assert!(covered.iter().zip(&view.is_dome).all(|(covered, is_dome)| *is_dome || !covered));
    }
}
