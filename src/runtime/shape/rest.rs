//! The sensor at rest: by how much what the camera sees there differs from the constants' light.

use glam::{DVec2, Vec3A};
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::error::ShapeError;
use super::fill::{Pyramid, Weighted};
use super::lattice::Lattice;
use super::levels::Level;
use super::light::ShapeLight;
use super::rows::{MIN_ROWS, share};
use domecast_optics::SensorOptics;

/// Orders of three colours beside the one as it is; those of two that are swapped first.
pub(super) const OTHER_ORDERS: [[usize; 3]; 5] = [[2, 1, 0], [1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
/// Passes of a mean over three by three cells that smooth the ratio: noise goes, spots of the membrane stay.
pub(super) const SMOOTHING: usize = 3;

/// How far the ratio of a place is from the middle of all, a part: spots of the membrane, the lens's falloff, the lights.
const RATIO_SD: f32 = 0.3;

/// Largest exponent of a lens's falloff.
const MAX_FALLOFF: f64 = 10.0;

/// Level for each mW/mm^2 on the membrane, channel by channel and place by place: exposure, white balance, and whatever
/// membrane and lens have that the constants do not say.
#[derive(Debug, Clone)]
pub(super) struct RestMap {
    /// By place of the dome, without the lens's falloff.
    gain: Vec<Vec3A>,
    /// The lens's falloff, a power of the cosine of the field angle: it stays with the pixel where the platform moves.
    falloff: Vec<f32>,
}

/// What a level says of one place.
pub(super) struct Seen {
    pub cell: usize,
    ratio: Vec3A,
    pub expected: Vec3A,
    pub level: Vec3A,
}

/// Ratio of picture and light at those of these cells that see the bare membrane.
pub(super) fn seen<'a>(
    levels: &'a [Level],
    covered: &'a [bool],
    view: &'a View,
    light: &'a ShapeLight,
    cells: impl Iterator<Item = usize> + 'a,
) -> impl Iterator<Item = Seen> + 'a {
    cells.filter(|cell| view.is_dome[*cell] && !covered[*cell]).filter_map(|cell| {
        let level = &levels[cell];
        let expected = light.passed(view.ray[cell].z) * light.still(view.place[cell]);
        let level_there = level.light - Vec3A::splat(light.stray);
        let is_known = level.is_known.min_element() > 0.0 && expected.min_element() > 0.0;
        is_known.then(|| Seen { cell, ratio: level_there / expected, expected, level: level_there })
    })
}

/// The middle of some values; 0 of none.
fn median(mut values: Vec<f32>) -> f32 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// The exponent n with which cos^n of the field angle explains what all channels have in common: least squares of the
/// logarithms.
fn falloff(seen: &[Seen], cells: &Cells) -> f32 {
    let medians = medians(seen).max(Vec3A::splat(1e-12));
    let (mut n, mut x, mut y, mut xx, mut xy) = (0.0_f64, 0.0, 0.0, 0.0, 0.0);
    for one in seen {
        let common = (one.ratio / medians).max(Vec3A::splat(0.05));
        let value = f64::from((common.x * common.y * common.z).ln() / 3.0);
        let cosine = f64::from(cells.cosine(one.cell).ln());
        n += 1.0;
        x += cosine;
        y += value;
        xx += cosine * cosine;
        xy += cosine * value;
    }
    let spread = n * xx - x * x;
    let exponent = if spread > 0.0 { (n * xy - x * y) / spread } else { 0.0 };
    exponent.clamp(-MAX_FALLOFF, MAX_FALLOFF) as f32
}

/// Takes the falloff out of what was seen.
fn without(mut seen: Vec<Seen>, cells: &Cells, falloff: f32) -> Vec<Seen> {
    for one in &mut seen {
        let part = cells.cosine(one.cell).powf(falloff);
        one.expected *= part;
        one.ratio /= part;
    }
    seen
}

fn medians(seen: &[Seen]) -> Vec3A {
    let of = |c: usize| median(seen.iter().map(|one| one.ratio[c]).collect());
    Vec3A::new(of(0), of(1), of(2))
}

impl RestMap {
    /// From a frame without touch; `noise` is the deviation of a cell's level, full scale 1.
    pub fn measured(
        levels: &[Level],
        covered: &[bool],
        cells: &Cells,
        view: &View,
        light: &ShapeLight,
        noise: Vec3A,
    ) -> Result<Self, ShapeError> {
        let seen: Vec<Seen> = seen(levels, covered, view, light, 0..cells.count()).collect();
        let medians = medians(&seen);
        check(&seen, medians)?;
        let falloff = falloff(&seen, cells);
        let seen = without(seen, cells, falloff);
        let medians = self::medians(&seen);
        // Least squares over the neighbours: a dark place says little of its ratio, and then the middle of all does.
        let mut sums = [vec![Vec3A::ZERO; cells.count()], vec![Vec3A::ZERO; cells.count()]];
        for one in &seen {
            sums[0][one.cell] = one.level * one.expected;
            sums[1][one.cell] = one.expected * one.expected;
        }
        for _ in 0..SMOOTHING {
            sums = sums.map(|values| smooth(&values, cells.width));
        }
        let [products, squares] = &sums;
        let prior = (noise / (medians * RATIO_SD)).powf(2.0);
        let mut values: Vec<Weighted> = vec![Weighted::default(); cells.count()];
        for one in &seen {
            let (product, square) = (products[one.cell], squares[one.cell]);
            values[one.cell] = Weighted::new((product + prior * medians) / (square + prior), 1.0);
        }
        Pyramid::default().fill(cells.width, &mut values);
        let gain = values.into_iter().map(|value| value.value().max(medians * 0.02)).collect();
        let falloff = (0..cells.count()).map(|cell| cells.cosine(cell).powf(falloff)).collect();
        Ok(Self { gain, falloff })
    }

    /// The gain at every cell for a pose of the platform: what the same places of the dome had at rest.
    pub fn at_pose(
        &self,
        cells: &Cells,
        view: &View,
        rest: &SensorOptics,
        shifts: &mut Lattice,
        is_rigid: bool,
        out: &mut Vec<Vec3A>,
    ) {
        out.resize(cells.count(), Vec3A::ONE);
        if !is_rigid {
            shifts.take(cells, view, |cell| {
                let pixel = rest.project(view.surface_mm[cell].as_dvec3()).ok()?;
                let own = DVec2::new((cell % cells.width) as f64, (cell / cells.width) as f64);
                Some((cells.of_pixel(pixel) - own).extend(0.0).as_vec3a())
            });
        }
        let shifts = &*shifts;
        let rows = out.par_chunks_mut(cells.width).zip(&view.spans).enumerate();
        rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (out, span))| {
            for column in span.clone() {
                let cell = row * cells.width + column;
                let gain = if is_rigid {
                    self.gain[cell]
                } else {
                    let shift = shifts.at(column, row);
                    self.between(cells, column as f32 + shift.x, row as f32 + shift.y)
                };
                out[column] = gain * self.falloff[cell];
            }
        });
    }

    /// Linear between the cells.
    fn between(&self, cells: &Cells, column: f32, row: f32) -> Vec3A {
        let x = column.clamp(0.0, cells.width as f32 - 1.001);
        let y = row.clamp(0.0, cells.height as f32 - 1.001);
        let (i, j) = (x as usize, y as usize);
        let start = j * cells.width + i;
        let below = start + cells.width;
        let (px, py) = (x - i as f32, y - j as f32);
        let (upper, lower) = (
            self.gain[start].lerp(self.gain[start + 1], px),
            self.gain[below].lerp(self.gain[below + 1], px),
        );
        upper.lerp(lower, py)
    }
}

/// Means over three by three.
fn smooth(values: &[Vec3A], width: usize) -> Vec<Vec3A> {
    let height = values.len() / width.max(1);
    let mean = |i: usize| {
        let (column, row) = (i % width, i / width);
        let columns = column.saturating_sub(1)..(column + 2).min(width);
        let rows = row.saturating_sub(1)..(row + 2).min(height);
        let sum: Vec3A = rows
            .map(|y| values[y * width + columns.start..y * width + columns.end].iter().sum::<Vec3A>())
            .sum();
        sum / 9.0
    };
    (0..values.len()).map(mean).collect()
}

/// Cells of the bare membrane that a frame at rest must show.
const MIN_CELLS: usize = 1000;
/// Level of a channel, in the middle of its places, that is still light: two deviations of a small camera's noise.
const MIN_LEVEL: f32 = 4.0 / 255.0;
/// Correlation of the picture's colours with the light's below which the constants' light is not what lights it.
const MIN_CORRELATION: f64 = 0.3;

/// Whether the picture's colours lie over the dome as the light's do.
fn check(seen: &[Seen], medians: Vec3A) -> Result<(), ShapeError> {
    let names = ["red", "green", "blue"];
    if seen.len() < MIN_CELLS {
        let problem = format!(
            "shows the bare membrane, not cut off, at {} places of 2 x 2 px; {MIN_CELLS} are needed",
            seen.len()
        );
        return Err(ShapeError::new("rest", problem, "take a lit, untouched frame at a lower exposure"));
    }
    for (c, name) in names.into_iter().enumerate() {
        let level = median(seen.iter().map(|one| one.level[c]).collect());
        if medians[c].is_nan() || medians[c] <= 0.0 || level < MIN_LEVEL {
            let problem =
                format!("has hardly any {name} light on the membrane: {:.1} levels of 255", 255.0 * level);
            return Err(ShapeError::new("rest", problem, "switch all lights on"));
        }
    }
    // Chromaticities: brightness alone is alike for all colours.
    let table: Vec<[f64; 9]> = seen
        .iter()
        .map(|one| {
            let share = |v: Vec3A| {
                let sum = v.element_sum().max(1e-9);
                [v.x / sum, v.y / sum, v.z / sum].map(f64::from)
            };
            let (a, b) = (share(one.level / medians), share(one.expected));
            [a[0], a[1], a[2], b[0], b[1], b[2], 0.0, 0.0, 0.0]
        })
        .collect();
    let correlation = |a: usize, b: usize| {
        let n = table.len() as f64;
        let mean = |k: usize| table.iter().map(|row| row[k]).sum::<f64>() / n;
        let (ma, mb) = (mean(a), mean(b + 3));
        let sum = |f: &dyn Fn(&[f64; 9]) -> f64| table.iter().map(f).sum::<f64>();
        let ab = sum(&|row| (row[a] - ma) * (row[b + 3] - mb));
        let aa = sum(&|row| (row[a] - ma).powi(2));
        let bb = sum(&|row| (row[b + 3] - mb).powi(2));
        ab / (aa * bb).sqrt().max(1e-12)
    };
    let own = [0, 1, 2].map(|c| correlation(c, c));
    if own.iter().all(|r| *r > MIN_CORRELATION) {
        return Ok(());
    }
    for order in OTHER_ORDERS {
        if order.into_iter().enumerate().all(|(a, b)| correlation(a, b) > MIN_CORRELATION) {
            let order = order.map(|c| names[c]);
            let moved: Vec<&str> = (0..3).filter(|c| order[*c] != names[*c]).map(|c| names[c]).collect();
            let what = match moved[..] {
                [a, b] => format!("{a} and {b} swapped"),
                _ => format!("its colours in the order {}", order.join(", ")),
            };
            let cure = "give the frames in the order red, green, blue (--raw ..:rgb or :bgr), or mend the lights' wires";
            return Err(ShapeError::new("rest", format!("has {what} against the constants' light"), cure)
                .of_other_order(order));
        }
    }
    let worst = (0..3).min_by(|a, b| own[*a].total_cmp(&own[*b])).unwrap_or(0);
    let problem = format!(
        "is not lit by the constants' light: the correlation of {} with it over the dome is {:.2}, at least {MIN_CORRELATION} \
         is needed",
        names[worst], own[worst]
    );
    Err(ShapeError::new("rest", problem, "take an untouched frame of this sensor, with its lights on"))
}
