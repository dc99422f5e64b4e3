//! How deep in a hole of the readings each cell lies, and how wide that hole is.

use super::cells::{Cells, View};

/// Part of its half width by which a hole counts as narrower for each cell that its middle lies away: what is joined to it is no part of it.
const NARROWER: f32 = 0.5;

/// Distances in cells, along rows and columns; 0 beside holes. Kept between frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Holes {
    /// From the hole's edge.
    pub deep: Vec<f32>,
    /// Half width of the hole about the cell.
    pub wide: Vec<f32>,
}

impl Holes {
    pub fn find(&mut self, cells: &Cells, view: &View, is_hole: impl Fn(usize) -> bool) {
        let lists = [&mut self.deep, &mut self.wide];
        for list in lists {
            list.clear();
            list.resize(cells.count(), 0.0);
        }
        let max_cells = (cells.width + cells.height) as f32;
        for cell in (0..cells.count()).filter(|cell| view.is_dome[*cell] && is_hole(*cell)) {
            self.deep[cell] = max_cells;
        }
        for is_down in [true, false] {
            pass(&mut self.deep, cells, view, is_down, |own, next| own.min(next + 1.0));
        }
        self.wide.copy_from_slice(&self.deep);
        for is_down in [true, false] {
            pass(&mut self.wide, cells, view, is_down, |own, next| own.max(next - NARROWER));
        }
    }
}

/// Mixes each cell of a hole with the two before it, in one of two directions over the picture (G. Borgefors, Computer Vision 27, 1984).
fn pass(list: &mut [f32], cells: &Cells, view: &View, is_down: bool, mix: impl Fn(f32, f32) -> f32) {
    let (w, rows) = (cells.width, cells.height);
    for k in 0..rows {
        let row = if is_down { k } else { rows - 1 - k };
        let span = view.spans[row].clone();
        for k in 0..span.len() {
            let cell = row * w + if is_down { span.start + k } else { span.end - 1 - k };
            if list[cell] > 0.0 {
                let before = if is_down {
                    [cell.checked_sub(1), cell.checked_sub(w)]
                } else {
                    [Some(cell + 1), Some(cell + w)]
                };
                for next in before {
                    let next = next.and_then(|next| list.get(next)).copied().unwrap_or(0.0);
                    list[cell] = mix(list[cell], next);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_as_wide_as_its_middle_is_deep() {
        let cells = Cells { px: 2, width: 60, height: 30, rays: Vec::new() };
        let view = View { spans: vec![0..60; 30], is_dome: vec![true; 1800], ..View::default() };
        // A disc of ten cells, and a strip of three that leads away from it.
        let is_hole = |cell: usize| {
            let (x, y) = (cell % 60, cell / 60);
            x.abs_diff(15).pow(2) + y.abs_diff(15).pow(2) <= 100 || (y.abs_diff(15) <= 1 && x > 15 && x < 58)
        };
        let mut holes = Holes::default();
        holes.find(&cells, &view, is_hole);
        let at = |x: usize, y: usize| (holes.deep[y * 60 + x], holes.wide[y * 60 + x]);
        assert_eq!(at(15, 15), (11.0, 11.0));
        assert!(at(6, 15).0 <= 2.0 && at(6, 15).1 >= 5.5, "{:?}", at(6, 15));
        assert_eq!(at(50, 15), (2.0, 2.0));
        assert_eq!(at(30, 5), (0.0, 0.0));
    }
}
