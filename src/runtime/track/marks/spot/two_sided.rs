//! Ground that is lit on one side of a line: the edge of a lamp's shadow runs under the spot.

use glam::DVec2;

use super::ground::Ground;
use super::light_edge::{LightEdge, ramp};
use super::stencil::Stencil;

/// Directions of the line, places of it across the ring, and half widths of the edge that are tried at first, px.
const TURNS: usize = 16;
const PLACES: usize = 9;
const HALF_WIDTHS_PX: [f64; 3] = [0.8, 2.0, 4.5];
/// Rounds of ever smaller steps from the best of them.
const ROUNDS: usize = 6;
/// Levels of the ring below the spot's own and this part of the way up to the ground are other marks.
const MARK_PART: f32 = 0.2;
/// The part of the ring's pixels, by level, that the lit ground's level is taken at.
const LIT: f32 = 0.85;
/// Fewest pixels of ground, and the part of the ring that they must be.
const MIN_PIXELS: usize = 12;
const MIN_SHARE: f32 = 0.35;

#[derive(Clone, Copy)]
struct Trial {
    turn_rad: f64,
    at: f64,
    half: f64,
}

/// Sum of squared residuals of two levels about an edge, the nearer level and the step.
fn fit(pixels: &[[f32; 3]], trial: Trial) -> Option<(f64, f64, LightEdge)> {
    let way = DVec2::from_angle(trial.turn_rad);
    let (way, at, half) = ([way.x as f32, way.y as f32], trial.at as f32, trial.half as f32);
    let [mut s, mut ss, mut v, mut vv, mut sv] = [0.0_f32; 5];
    for [x, y, level] in pixels {
        let part = ramp(x * way[0] + y * way[1], at, half);
        s += part;
        ss += part * part;
        v += level;
        vv += level * level;
        sv += part * level;
    }
    let n = pixels.len() as f64;
    let [s, ss, v, vv, sv] = [s, ss, v, vv, sv].map(f64::from);
    let spread = ss - s * s / n;
    // A side of less than two pixels is none.
    (spread > 1.5).then(|| {
        let step = (sv - s * v / n) / spread;
        let level = (v - step * s) / n;
        let left = (vv - v * v / n - step * step * spread).max(0.0);
        (left, level, LightEdge { way, at, half, step: step as f32 })
    })
}

/// Two levels and an edge through the ring around a spot; `None` where other marks leave too little of it.
pub(super) fn two_sided_ground(
    stencil: &Stencil,
    levels: &[f32],
    ring: &mut Vec<[f32; 3]>,
) -> Option<Ground> {
    let side = stencil.side();
    let middle = (stencil.half as usize) * (side + 1);
    let core = [middle, middle - 1, middle + 1, middle - side, middle + side];
    let mark = core.iter().filter_map(|at| levels.get(*at)).sum::<f32>() / core.len() as f32;
    ring.clear();
    for ((index, x), y) in stencil.ring.iter().zip(&stencil.ring_x).zip(&stencil.ring_y) {
        ring.push([*x, *y, *levels.get(*index as usize)?]);
    }
    let total = ring.len();
    let at = ((LIT * total as f32) as usize).min(total.checked_sub(1)?);
    let lit = ring.select_nth_unstable_by(at, |a, b| a[2].total_cmp(&b[2])).1[2];
    let floor = mark + MARK_PART * (lit - mark);
    ring.retain(|pixel| pixel[2] >= floor);
    if ring.len() < MIN_PIXELS || (ring.len() as f32) < MIN_SHARE * total as f32 {
        return None;
    }
    // The order of the sums must not depend on how the selection moved the pixels.
    ring.sort_unstable_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    let outer = f64::from(stencil.reach_px);
    let mut best: Option<(f64, f64, LightEdge, Trial)> = None;
    let try_one = |trial: Trial, best: &mut Option<(f64, f64, LightEdge, Trial)>| {
        if let Some((left, level, edge)) = fit(ring, trial)
            && best.as_ref().is_none_or(|b| left < b.0)
        {
            *best = Some((left, level, edge, trial));
        }
    };
    for turn in 0..TURNS {
        let turn_rad = std::f64::consts::PI * turn as f64 / TURNS as f64;
        for place in 0..PLACES {
            let at = outer * (2.0 * place as f64 / (PLACES - 1) as f64 - 1.0);
            for half in HALF_WIDTHS_PX {
                try_one(Trial { turn_rad, at, half }, &mut best);
            }
        }
    }
    let (mut turn_step, mut place_step) = (std::f64::consts::PI / TURNS as f64, outer / PLACES as f64);
    for _ in 0..ROUNDS {
        let from = best.as_ref()?.3;
        for turn in [-turn_step, turn_step] {
            try_one(Trial { turn_rad: from.turn_rad + turn, ..from }, &mut best);
        }
        for place in [-place_step, place_step] {
            try_one(Trial { at: best.as_ref()?.3.at + place, ..best.as_ref()?.3 }, &mut best);
        }
        for by in [0.75, 1.33] {
            try_one(Trial { half: best.as_ref()?.3.half * by, ..best.as_ref()?.3 }, &mut best);
        }
        (turn_step, place_step) = (0.6 * turn_step, 0.6 * place_step);
    }
    let (left, level, edge, _) = best?;
    let noise = (left / (ring.len() as f64 - 5.0).max(1.0)).max(1.0 / 12.0).sqrt() as f32;
    // Neither side may be black: the darker one of a shadow still shows the mark on it.
    let darker = level.min(level + f64::from(edge.step));
    (darker > 0.5).then_some(Ground { a: level as f32, b: 0.0, c: 0.0, noise, edge: Some(edge) })
}
