//! How sharply the tables of the light bend, cell by cell: what tells a picture where it may fill in between rays.

use glam::{Vec2, Vec3A, Vec4};

use super::super::tables::SHELLS;
use super::places::{Scale, disc_of};
use super::{LightField, ShellNode, ShellNodes};
use crate::sim::rests::{BOTH, largest, rest};
use crate::sim::shading::Turned;

/// A kink between a parabola's nodes leaves at most this part of the change of slope times their distance: 3/16.
const KINK: f32 = 0.1875;
/// Straight pieces leave at most an eighth of the second difference, and the parabola through them that much and a quarter
/// more.
const PIECES: f32 = 0.28;
/// What the outer shell's own kinks weigh where the membrane has moved by a part of the radius.
const NEAR: f32 = 20.0;

/// Bounds by cell of the light's tables.
#[derive(Debug, Clone, Default)]
pub(super) struct Bends {
    /// Third derivative of the undeformed membrane's light in any three directions, by the width of a cell.
    third: Vec<f32>,
    /// By node of the shells: the largest second difference, and the largest vector irradiance.
    kink: Vec<f32>,
    turn: Vec<f32>,
}

impl Bends {
    /// Of the coefficients of the undeformed membrane's light.
    pub fn find_third(&mut self, still: &[Vec4], nodes: usize) {
        let at = |i: usize| still.get(i).copied().unwrap_or(Vec4::ZERO);
        let (x, y) = (1, nodes);
        let second = |i: usize, way: usize| at(i.wrapping_sub(way)) - at(i) * 2.0 + at(i + way);
        let third =
            |i: usize, way: usize| at(i + 2 * way) - at(i.wrapping_sub(way)) + (at(i) - at(i + way)) * 3.0;
        let mixed = |i: usize, twice: usize, once: usize| second(i + once, twice) - second(i, twice);
        let squared = |most: Vec4, v: Vec4| most.max(v * v);
        let cell = |i: usize| {
            let (column, row) = (i % nodes, i / nodes);
            if column < 1 || row < 1 || column + 2 >= nodes || row + 2 >= nodes {
                return 0.0;
            }
            let node = |dx: usize, dy: usize| (row + dy - 1) * nodes + column + dx - 1;
            let (mut pure_x, mut pure_y) = (Vec4::ZERO, Vec4::ZERO);
            let (mut twice_x, mut twice_y) = (Vec4::ZERO, Vec4::ZERO);
            for k in 0..4 {
                pure_x = squared(pure_x, third(node(1, k), x));
                pure_y = squared(pure_y, third(node(k, 1), y));
            }
            for (k, l) in [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)] {
                twice_x = squared(twice_x, mixed(node(k, l), x, y));
                twice_y = squared(twice_y, mixed(node(l, k), y, x));
            }
            // The largest value of a cubic form of unit directions is at most its Frobenius norm.
            (pure_x + pure_y + 3.0 * (twice_x + twice_y)).max_element().sqrt()
        };
        self.third = (0..nodes * nodes).map(cell).collect();
    }

    /// Of the shells.
    pub fn find_kinks(&mut self, shells: &[ShellNodes], nodes: usize) {
        let longest = |along: [Vec3A; 3], own: Vec3A| {
            let [x, y, z] = along;
            ((x * x + y * y + z * z).max_element().sqrt()) + own.abs().max_element()
        };
        let turn = |i: usize| {
            let of = |node: &ShellNode| longest(node.along, Vec3A::ZERO);
            shells.get(i).map_or(0.0, |nodes| nodes.iter().map(of).fold(0.0, f32::max))
        };
        let kink = |i: usize| {
            let (column, row) = (i % nodes, i / nodes);
            if column < 1 || row < 1 || column + 1 >= nodes || row + 1 >= nodes {
                return 0.0;
            }
            let of = |shell: usize, way: usize| {
                let [a, b, c] = [i - way, i, i + way]
                    .map(|i| shells.get(i).map_or(ShellNode::default(), |all| all[shell]));
                let along = std::array::from_fn(|k| a.along[k] - b.along[k] * 2.0 + c.along[k]);
                longest(along, a.own - b.own * 2.0 + c.own)
            };
            (0..SHELLS.len()).map(|shell| of(shell, 1).max(of(shell, nodes))).fold(0.0, f32::max)
        };
        self.turn = (0..nodes * nodes).map(turn).collect();
        self.kink = (0..nodes * nodes).map(kink).collect();
    }
}

impl LightField {
    /// How far the undeformed membrane's light may be from the surface of the second order through nine nodes, in rows
    /// of three, over a part of the dome that holds these directions from its centre: two parabolas' rests, from the
    /// largest third differences of the table's cells about.
    pub fn bend(&self, directions: &[Vec3A]) -> f32 {
        let (low, high) = self.cells(&self.scale, directions);
        let apart = 0.5 * (high - low).max_element();
        rest(most(&self.bends.third, self.grid.nodes, low, high), apart)
    }

    /// The same for what the shells add where the membrane has moved: their kinks, and what they give a normal that is not
    /// quite known.
    pub fn moved_bend(&self, directions: &[Vec3A], turned: Turned) -> f32 {
        if self.bends.kink.is_empty() {
            return 0.0;
        }
        let (low, high) = self.cells(&self.shell_scale, directions);
        let apart = 0.5 * (high - low).max_element();
        let kink = most(&self.bends.kink, self.shell_grid.nodes, low, high + 1.0);
        let turn = most(&self.bends.turn, self.shell_grid.nodes, low, high + 1.0);
        // Near the undeformed membrane its own smooth table stands in for the outer shell.
        let part = (2.0 * turned.slope + NEAR * turned.moved_mm / self.radius_mm as f32).min(1.0);
        let kinks = BOTH * (KINK * apart * (2.0 * apart + 1.0)).min(PIECES) * kink * part;
        kinks + turn * turned.tilt_rad
    }

    /// The box of cells around some directions.
    fn cells(&self, scale: &Scale, directions: &[Vec3A]) -> (Vec2, Vec2) {
        let last = Vec2::splat(scale.last_cell - 1.0);
        let (mut low, mut high) = (last, Vec2::ONE);
        for at in directions {
            let place = scale.place(disc_of(*at)).max(Vec2::ONE).min(last);
            (low, high) = (low.min(place), high.max(place));
        }
        (low.min(high), high)
    }
}

/// The largest value in a box of cells.
fn most(table: &[f32], nodes: usize, low: Vec2, high: Vec2) -> f32 {
    let [columns, rows] = [(low.x, high.x), (low.y, high.y)]
        .map(|(low, high): (f32, f32)| low as i32 as usize..high as i32 as usize + 1);
    largest(table, nodes, &columns, &rows)
}

/// Turns the values of a square table into the coefficients of the cubic spline through them, along each row, then each
/// column. The ends, where nothing looks, keep their values as coefficients.
pub(super) fn to_coefficients(values: &mut [Vec4], nodes: usize) {
    let mut line = vec![(Vec4::ZERO, 0.0_f32); nodes];
    for (next, step) in [(nodes, 1), (1, nodes)] {
        for start in (0..nodes).map(|i| i * next) {
            // A coefficient, four times it and the next sum to six values: eliminated forwards, then put in backwards.
            let mut before = (Vec4::ZERO, 0.0);
            for (i, place) in line.iter_mut().enumerate() {
                let value = values.get(start + i * step).copied().unwrap_or(Vec4::ZERO);
                let part = 1.0 / (4.0 - before.1);
                let is_end = i == 0 || i + 1 == nodes;
                *place = if is_end { (value, 0.0) } else { ((value * 6.0 - before.0) * part, part) };
                before = *place;
            }
            let mut after = Vec4::ZERO;
            for (i, (sum, part)) in line.iter().enumerate().rev() {
                after = *sum - after * *part;
                values.get_mut(start + i * step).into_iter().for_each(|place| *place = after);
            }
        }
    }
}
