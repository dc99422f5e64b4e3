//! Splines on even nodes: the weights of their coefficients, and the coefficients through values.

use glam::{Vec2, Vec4};

/// Weights of the cubic spline's four coefficients about a place between the middle two, along x and along y.
#[inline]
pub fn cubics(part: Vec2) -> ([f32; 4], [f32; 4]) {
    // Both at once.
    let t = Vec4::new(part.x, part.y, 0.0, 0.0);
    let s = Vec4::ONE - t;
    let sixth = 1.0 / 6.0;
    let (t2, s2) = (t * t, s * s);
    let four = Vec4::splat(4.0);
    let weights = [
        s * s2 * sixth,
        (t2 * (t * 3.0 - 6.0) + four) * sixth,
        (s2 * (s * 3.0 - 6.0) + four) * sixth,
        t * t2 * sixth,
    ];
    (weights.map(|w| w.x), weights.map(|w| w.y))
}

/// The derivatives of [`cubics`] along one of the two.
#[inline]
pub fn cubic_slopes(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-0.5 * s * s, t * (1.5 * t - 2.0), s * (2.0 - 1.5 * s), 0.5 * t * t]
}

/// Weights of the quadratic spline's three coefficients about a place, which is so far past the middle between the first
/// two, along x and along y.
#[inline]
pub fn quadratics(part: Vec2) -> ([f32; 3], [f32; 3]) {
    let (high, low) = (part * part * 0.5, (1.0 - part) * (1.0 - part) * 0.5);
    let middle = 1.0 - high - low;
    ([low.x, middle.x, high.x], [low.y, middle.y, high.y])
}

/// How much more a spline's own coefficient weighs at its node than each of the two beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Degree {
    /// Parabolas that join without creases.
    Quadratic = 6,
    /// Cubics with continuous curvature.
    Cubic = 4,
}

/// Turns the values of a square table into the coefficients of the spline through them, along each row, then each column.
/// The ends, where nothing looks, keep their values as coefficients.
pub fn to_coefficients(values: &mut [Vec4], nodes: usize, degree: Degree) {
    let own = degree as u8 as f32;
    let mut line = vec![(Vec4::ZERO, 0.0_f32); nodes];
    for (next, step) in [(nodes, 1), (1, nodes)] {
        for start in (0..nodes).map(|i| i * next) {
            // A coefficient, before it and after it one more, sum to a value times all their weights: eliminated forwards,
            // then put in backwards.
            let mut before = (Vec4::ZERO, 0.0);
            for (i, place) in line.iter_mut().enumerate() {
                let value = values.get(start + i * step).copied().unwrap_or(Vec4::ZERO);
                let part = 1.0 / (own - before.1);
                let is_end = i == 0 || i + 1 == nodes;
                *place = if is_end { (value, 0.0) } else { ((value * (own + 2.0) - before.0) * part, part) };
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What each kind of spline says at its nodes and between them of a parabola and, where it can, of a cubic.
    #[test]
    fn splines_pass_through_their_values() {
        let nodes = 24;
        let value = |x: f32, y: f32| {
            let (x, y) = (x - 11.0, y - 12.0);
            Vec4::new(1.0 + 0.1 * x * x - 0.05 * x * y, 0.02 * y * y - x, 1e-3 * x * x * y, 0.0)
        };
        for degree in [Degree::Quadratic, Degree::Cubic] {
            let mut table: Vec<Vec4> =
                (0..nodes * nodes).map(|i| value((i % nodes) as f32, (i / nodes) as f32)).collect();
            to_coefficients(&mut table, nodes, degree);
            for (x, y) in [(11.0, 12.0), (11.25, 12.5), (10.75, 11.125)] {
                let at = Vec2::new(x, y);
                let mut found = Vec4::ZERO;
                let mut add = |wx: &[f32], wy: &[f32], first: Vec2| {
                    for (j, wy) in wy.iter().enumerate() {
                        for (i, wx) in wx.iter().enumerate() {
                            found += table[(first.y as usize + j) * nodes + first.x as usize + i] * (wx * wy);
                        }
                    }
                };
                if degree == Degree::Quadratic {
                    let near = (at + 0.5).floor();
                    let (wx, wy) = quadratics(at + 0.5 - near);
                    add(&wx, &wy, near - 1.0);
                } else {
                    let (wx, wy) = cubics(at - at.floor());
                    add(&wx, &wy, at.floor() - 1.0);
                }
                assert!((found - value(x, y)).abs().max_element() < 2e-5, "{degree:?} {at}: {found}");
            }
        }
        let slopes = cubic_slopes(0.3);
        let (more, less) = (cubics(Vec2::new(0.301, 0.0)).0, cubics(Vec2::new(0.299, 0.0)).0);
        for ((more, less), slope) in more.iter().zip(less).zip(slopes) {
            assert!(((more - less) / 0.002 - slope).abs() < 1e-3);
        }
    }
}
