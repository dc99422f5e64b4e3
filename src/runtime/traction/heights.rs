//! Heights of the skin as rows of the least squares.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::forces::ForceDistribution;
use super::model::Node;
use crate::shape::ShapeMap;
use crate::shape::rows::share;

/// Least deviation of a height, mm.
const MIN_HEIGHT_SD_MM: f64 = 0.002;

/// What the elastic model may be off, as a part of a height: coarse elements and small strain.
const HEIGHT_MODEL_PART: f64 = 0.03;
/// Nodes that a thread takes at once, at least.
const MIN_NODES: usize = 16;
/// Part of a node's surroundings that must be touched for it to bear a pressure.
const MIN_TOUCHED: f64 = 0.04;
/// Places in each direction about a node at which is looked whether the skin is touched, and their distance over the nodes'.
const LOOKS: i32 = 3;
const LOOK_STEP: f64 = 0.25;
/// By how much the image of a square about a node may reach beyond its corners, as a part of its size.
const BULGE: f64 = 0.1;

impl ForceDistribution {
    /// Takes the heights of the nodes where they are now; none without a map.
    pub(super) fn take_heights(&mut self, map: Option<&ShapeMap>) {
        self.measured.clear();
        if let Some(map) = map {
            self.take_map(map);
        }
    }

    /// The pixel that shows a place of the skin that has moved, if the map has one.
    fn pixel(&self, map: &ShapeMap, at_mm: DVec3) -> Option<usize> {
        let px = self.optics.project_deformed(at_mm).ok()?.round();
        let is_within = px.x >= 0.0 && px.y >= 0.0 && px.x < map.width as f64 && px.y < map.height as f64;
        let pixel = is_within.then(|| px.y as usize * map.width + px.x as usize)?;
        map.height_mm.get(pixel).is_some_and(|height| height.is_finite()).then_some(pixel)
    }

    /// The nodes about which the skin is touched may bear a pressure; all may where no touch is seen.
    pub(super) fn allow(&mut self, map: Option<&ShapeMap>) {
        let Some(map) = map.filter(|map| map.contact.is_some()) else { return self.set.allowed.fill(true) };
        let step_mm = LOOK_STEP * self.model.compliance.grid.spacing_mm();
        let touched_px = touched_px(map);
        let mut allowed = std::mem::take(&mut self.set.allowed);
        let nodes = allowed.par_iter_mut().enumerate().with_min_len(share(MIN_NODES));
        nodes.for_each(|(node, is_allowed)| {
            let own = &self.model.nodes[node];
            let at_mm = own.at_mm + self.nodes_moved_mm[node];
            *is_allowed = false;
            if self.is_far(&touched_px, at_mm, own, f64::from(LOOKS) * step_mm) {
                return;
            }
            let (mut touched, mut all) = (0.0, 0.0);
            for i in -LOOKS..=LOOKS {
                for j in -LOOKS..=LOOKS {
                    let [x, y] = [i, j].map(|k| f64::from(k) * step_mm);
                    let Some(pixel) = self.pixel(map, at_mm + own.axes.y_axis * x + own.axes.z_axis * y)
                    else {
                        continue;
                    };
                    // As much as the node's own pressure is there.
                    let hat = [i, j].map(|k| 1.0 - LOOK_STEP * f64::from(k.abs()));
                    all += hat[0] * hat[1];
                    touched += if map.is_touched[pixel] { hat[0] * hat[1] } else { 0.0 };
                }
            }
            *is_allowed = touched > MIN_TOUCHED * all;
        });
        self.set.allowed = allowed;
        // A touch smaller than the nodes' distance bears on those about it.
        if let Some(contact) = &map.contact {
            for (node, _) in self.model.about(contact.deepest_mm) {
                self.set.allowed[node] = true;
            }
        }
    }

    /// Whether no place within a square about a node is seen where anything touches.
    fn is_far(&self, touched_px: &[DVec2; 2], at_mm: DVec3, node: &Node, half_mm: f64) -> bool {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for [x, y] in [[-half_mm, -half_mm], [half_mm, -half_mm], [-half_mm, half_mm], [half_mm, half_mm]] {
            let corner_mm = at_mm + node.axes.y_axis * x + node.axes.z_axis * y;
            let Ok(px) = self.optics.project_deformed(corner_mm) else { return false };
            (low, high) = (low.min(px), high.max(px));
        }
        // The square's sides are a little curved in the image.
        let beyond = DVec2::splat(BULGE * (high - low).max_element() + 1.0);
        let [touched_low, touched_high] = *touched_px;
        (low - beyond).cmpgt(touched_high).any() || (high + beyond).cmplt(touched_low).any()
    }

    /// Notes whose columns the frame needs.
    pub(super) fn need(&mut self) {
        self.needed.copy_from_slice(&self.set.allowed);
        for (node, _) in self.set.allowed.iter().enumerate().filter(|(_, is_allowed)| **is_allowed) {
            self.model.nodes[node].beside.iter().for_each(|(other, ..)| self.needed[*other] = true);
        }
    }

    fn take_map(&mut self, map: &ShapeMap) {
        let mut heights = std::mem::take(&mut self.heights);
        let nodes = heights.par_iter_mut().enumerate().with_min_len(share(MIN_NODES));
        nodes.for_each(|(node, height)| *height = self.height_of(map, node).unwrap_or_default());
        self.heights = heights;
        self.measured.extend((0..self.heights.len()).filter(|node| self.heights[*node].1 > 0.0));
    }

    /// Height of a node where it is now, and one over its deviation.
    fn height_of(&self, map: &ShapeMap, node: usize) -> Option<(f64, f64)> {
        let moved_mm = self.nodes_moved_mm[node];
        let own = &self.model.nodes[node];
        let pixel = self.pixel(map, own.at_mm + moved_mm)?;
        let height_mm = f64::from(map.height_mm[pixel]);
        let sd_mm = f64::from(map.height_sd_mm[pixel]).hypot(HEIGHT_MODEL_PART * height_mm);
        if !sd_mm.is_finite() {
            return None;
        }
        // A place that went aside on the sphere is higher than its motion along the normal says.
        let inward = own.axes.x_axis;
        let aside_mm = moved_mm - inward * moved_mm.dot(inward);
        let higher_mm = 0.5 * aside_mm.length_squared() / self.radius_mm;
        Some((height_mm - higher_mm, 1.0 / sd_mm.max(MIN_HEIGHT_SD_MM)))
    }
}

/// Corners of the box around the pixels that are touched; it is inside out where none is.
fn touched_px(map: &ShapeMap) -> [DVec2; 2] {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (y, row) in map.is_touched.chunks_exact(map.width.max(1)).enumerate() {
        let first = row.iter().position(|is_touched| *is_touched);
        for x in first.into_iter().chain(row.iter().rposition(|is_touched| *is_touched)) {
            let px = DVec2::new(x as f64, y as f64);
            (low, high) = (low.min(px), high.max(px));
        }
    }
    [low, high]
}
