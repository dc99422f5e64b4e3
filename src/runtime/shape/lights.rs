//! What each light gives now, parts of what it gave in the frame at rest.
//!
//! What a place has lost since the frame at rest is what its lights have lost, each by its share there; places that say something else, under
//! a touch or a stain, count the less the farther they are off. A light that is out is named. What the others have lost is taken out of
//! every place's gain, so that a supply that sags or a light that ages is no slope; a wide touch bends the skin down to its rim and feigns
//! the same, so it is asked where the dots show the skin at rest alone, and kept.

use glam::{DVec3, Vec3A};

use super::cells::{Cells, View};
use super::lattice::Lattice;
use super::levels::Level;
use super::light::ShapeLight;
use crate::cholesky::{factor, solve};
use crate::track::Tracked;
use domecast_light::direct::EmitterRule;
use domecast_light::radiosity::Rings;
use domecast_light::tables::Ways;

/// Every so many cells are asked.
const STEP: usize = 13;

/// How many places or dots must speak.
const MIN_PLACES: usize = 12;

/// Light of a place at rest by which a part of a hundred can be seen, full scale 1.
const MIN_LEVEL: f32 = 20.0 / 255.0;

/// A light that has lost so much of what it gave at rest is out.
const OUT: f32 = 0.5;

/// Where no light changed by more than the first part, nothing is taken out, where one did by more than the second, all is: on untouched
/// skin, on five designs, estimates of lights that did not change lie up to 0.001 from 1, of neighbours of one color up to 0.005.
const CHANGED: [f32; 2] = [0.005, 0.01];

/// Motion of a dot since the frame at rest, part of the dome's radius, below which it lies as there: noise of two levels moves all of a
/// design's dots but one by up to 0.0017. So does a skin at rest, a hundredth of whose dots (at least one) may be astray.
const STILL: f64 = 2e-3;
const ASTRAY: usize = 100;

/// Bound on the rounds in which places are weighed, and the change, a part, that ends them.
const MAX_ROUNDS: usize = 32;
const END: f64 = 1e-5;

/// What is off by so many deviations counts a half (Cauchy's weights; P. W. Holland and R. E. Welsch, 1977).
const HALF: f64 = 2.385;

/// Median of a normal number's size, deviations.
const MEDIAN: f64 = 0.6745;

/// What holds a light that no place shows where it was: light at rest, full scale 1, that it gives all places together.
const UNSEEN: f64 = 0.02;

/// One channel of a place.
#[derive(Debug, Clone, Copy)]
struct Place {
    cell: usize,
    channel: usize,
    /// Light at rest, and what is gone of it in this frame; NaN where it is not seen.
    at_rest: f32,
    gone: f32,
}

/// The lights of a sensor and the places that say what they give.
#[derive(Debug, Clone, Default)]
pub(super) struct Lights {
    places: Vec<Place>,
    /// Each light's share of the light at each place.
    shares: Vec<f32>,
    /// What of each light has gone in this frame, and by the last one with the skin at rest.
    gone: Vec<f32>,
    taken: Vec<f32>,
    /// Where the dots were at rest, mm.
    dots_mm: Vec<Option<DVec3>>,
    room: Vec<f32>,
    /// Normal equations.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Each light's irradiance by channel.
    fields: Vec<Lattice>,
    /// What is left of the light at rest.
    left: Lattice,
}

impl Lights {
    /// Of these cells of the frame at rest.
    pub fn at_rest(
        (ways, light): (&Ways, &ShapeLight),
        cells: &Cells,
        view: &View,
        levels: &[Level],
        tracked: &Tracked,
        is_bare: impl Fn(usize) -> bool,
    ) -> Self {
        let count = ways.sources.len();
        let mut lights = Self {
            fields: fields(ways, light, cells, view),
            gone: vec![0.0; count],
            taken: vec![0.0; count],
            matrix: vec![0.0; count * count],
            right: vec![0.0; count],
            dots_mm: tracked.black_dots.iter().map(|dot| dot.displacement_mm).collect(),
            ..Self::default()
        };
        for cell in (0..view.is_dome.len()).step_by(STEP).filter(|cell| is_bare(*cell)) {
            let (column, row) = (cell % cells.width, cell / cells.width);
            let sum = lights.fields.iter().fold(Vec3A::ZERO, |sum, field| sum + field.at(column, row));
            for channel in 0..3 {
                if levels[cell].light[channel] > MIN_LEVEL && sum[channel] > 0.0 {
                    lights.places.push(Place { cell, channel, at_rest: 0.0, gone: f32::NAN });
                    let share = |field: &Lattice| field.at(column, row)[channel] / sum[channel];
                    lights.shares.extend(lights.fields.iter().map(share));
                }
            }
        }
        lights.room.reserve(lights.places.len().max(lights.dots_mm.len()));
        lights
    }

    /// What each light gives, parts of what it gave at rest.
    pub fn gains(&self) -> impl Iterator<Item = f32> + '_ {
        self.taken.iter().map(|gone| 1.0 - gone)
    }

    /// Takes what has gone of the lights out of the gain of every cell.
    pub fn take_out(
        &mut self,
        cells: &Cells,
        view: &View,
        tracked: &Tracked,
        radius_mm: f64,
        gain: &mut [Vec3A],
    ) {
        if self.is_still(tracked, radius_mm) {
            let [none, all] = CHANGED;
            let change = self.gone.iter().fold(0.0_f32, |largest, gone| largest.max(gone.abs()));
            // One part for all lights: where the exposure changed they change together.
            let part = ((change - none) / (all - none)).clamp(0.0, 1.0);
            self.taken.iter_mut().zip(&self.gone).for_each(|(taken, gone)| *taken = part * gone);
        }
        let Self { taken: gone, fields, left, .. } = self;
        if gone.iter().all(|gone| *gone == 0.0) {
            return;
        }
        left.take(cells, view, |cell| {
            let (column, row) = (cell % cells.width, cell / cells.width);
            let (mut sum, mut lost) = (Vec3A::ZERO, Vec3A::ZERO);
            for (field, gone) in fields.iter().zip(&*gone) {
                let own = field.at(column, row);
                sum += own;
                lost += own * *gone;
            }
            (sum.min_element() > 0.0).then(|| Vec3A::ONE - lost / sum)
        });
        for (row, span) in view.spans.iter().enumerate() {
            for column in span.clone() {
                gain[row * cells.width + column] *= left.at(column, row);
            }
        }
    }

    /// Whether the dots lie as in the frame at rest: a touch moves those round it alone.
    fn is_still(&mut self, tracked: &Tracked, radius_mm: f64) -> bool {
        let moved = tracked.black_dots.iter().zip(&self.dots_mm);
        let moved = moved.filter_map(|(now, rest)| Some((now.displacement_mm? - (*rest)?).length() as f32));
        self.room.clear();
        self.room.extend(moved);
        if self.room.len() < MIN_PLACES {
            return false;
        }
        let largest = self.room.len() - 1 - (self.room.len() / ASTRAY).max(1);
        f64::from(*self.room.select_nth_unstable_by(largest, f32::total_cmp).1) < STILL * radius_mm
    }

    /// Finds what each light gives, and those that are out; `at_rest` is the level of a cell's channel in the frame at rest, without stray light.
    pub fn find_out(
        &mut self,
        levels: &[Level],
        stray: f32,
        is_bare: impl Fn(usize) -> bool,
        at_rest: impl Fn(usize, usize) -> f32,
        out: &mut Vec<usize>,
    ) {
        out.clear();
        for place in &mut self.places {
            place.at_rest = at_rest(place.cell, place.channel);
            let level = levels[place.cell].light[place.channel] - stray;
            let is_seen = is_bare(place.cell) && levels[place.cell].is_known[place.channel] > 0.0;
            place.gone = if is_seen { place.at_rest - level } else { f32::NAN };
        }
        self.solve();
        out.extend((0..self.gone.len()).filter(|light| self.gone[*light] > OUT));
    }

    /// Finds what has gone of each light: nothing where too few places are seen.
    fn solve(&mut self) {
        self.gone.fill(0.0);
        for _ in 0..MAX_ROUNDS {
            match self.weigh() {
                Some(change) if change >= END => {}
                Some(_) => break,
                None => {
                    self.gone.fill(0.0);
                    break;
                }
            }
        }
    }

    /// Least squares with places weighed by how far they are off; the largest change, nothing where too few places are seen.
    fn weigh(&mut self) -> Option<f64> {
        let Self { places, shares, gone, room, matrix, right, .. } = self;
        let count = gone.len();
        let seen = || places.iter().zip(shares.chunks(count)).filter(|(place, _)| place.gone.is_finite());
        let off = |(place, shares): (&Place, &[f32]), gone: &[f32]| {
            place.gone
                - place.at_rest * shares.iter().zip(gone).map(|(share, gone)| share * gone).sum::<f32>()
        };
        room.clear();
        room.extend(seen().map(|place| off(place, gone).abs()));
        let middle = room.len() / 2;
        if room.len() < MIN_PLACES.max(count) {
            return None;
        }
        let median = f64::from(*room.select_nth_unstable_by(middle, f32::total_cmp).1);
        let scale = HALF * (median / MEDIAN).max(1e-4);
        matrix.fill(0.0);
        right.fill(0.0);
        for (place, shares) in seen() {
            let far = f64::from(off((place, shares), gone)) / scale;
            let weight = f64::from(place.at_rest) / (1.0 + far * far);
            for (i, share) in shares.iter().enumerate() {
                let own = weight * f64::from(*share);
                right[i] += own * f64::from(place.gone);
                for (entry, other) in matrix[i * count..].iter_mut().zip(&shares[..=i]) {
                    *entry += own * f64::from(place.at_rest * other);
                }
            }
        }
        for i in 0..count {
            matrix[i * count + i] += UNSEEN * UNSEEN;
        }
        if !factor(matrix, count, count) {
            return None;
        }
        solve(matrix, count, right);
        let mut change = 0.0_f64;
        for (gone, now) in gone.iter_mut().zip(&*right) {
            let now = now.clamp(-1.0, 1.0) as f32;
            change = change.max(f64::from((now - *gone).abs()));
            *gone = now;
        }
        Some(change)
    }
}

/// What each light gives over the picture, with what the dome throws on itself: that is nearly even over the dome, and as much as
/// the light gives the whole of it.
fn fields(ways: &Ways, light: &ShapeLight, cells: &Cells, view: &View) -> Vec<Lattice> {
    let rule = EmitterRule::default();
    let rings = Rings { rings: 8, patches: 24, ..Rings::usual(ways.face()) };
    let whole: Vec<Vec3A> = ways
        .sources
        .iter()
        .map(|source| {
            let places = (0..rings.count()).map(|k| rings.place(k / rings.patches, k % rings.patches));
            let sum: f64 = places.map(|place| ways.still(source, place, &rule)).sum();
            Vec3A::from_array(source.seen_mw.map(|seen| (sum * seen) as f32))
        })
        .collect();
    let all = whole.iter().fold(Vec3A::splat(f32::MIN_POSITIVE), |all, own| all + *own);
    let mut fields = vec![Lattice::default(); ways.sources.len()];
    for (field, source) in fields.iter_mut().zip(&ways.sources) {
        field.take(cells, view, |cell| {
            let still = ways.still(source, view.place[cell].as_dvec3(), &rule);
            Some(Vec3A::from_array(source.seen_mw.map(|seen| (still * seen) as f32)))
        });
    }
    let mut thrown = Lattice::default();
    thrown.take(cells, view, |cell| {
        let (column, row) = (cell % cells.width, cell / cells.width);
        let direct = fields.iter().fold(Vec3A::ZERO, |sum, field| sum + field.at(column, row));
        Some((light.still(view.place[cell]) - direct).max(Vec3A::ZERO))
    });
    for (field, whole) in fields.iter_mut().zip(&whole) {
        let direct = field.clone();
        field.take(cells, view, |cell| {
            let (column, row) = (cell % cells.width, cell / cells.width);
            Some(direct.at(column, row) + thrown.at(column, row) * *whole / all)
        });
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places along a line between three lights, each with its share there; `gone` says what a place has lost beside its lights.
    fn lights(lost: [f32; 3], places: usize, gone: impl Fn(usize) -> f32) -> Lights {
        let mut lights =
            Lights { gone: vec![0.0; 3], matrix: vec![0.0; 9], right: vec![0.0; 3], ..Lights::default() };
        for cell in 0..places {
            let at = cell as f32 / places as f32;
            let near = [0.0, 0.5, 1.0].map(|light| 1.0 / (0.1 + (at - light) * (at - light)));
            let sum: f32 = near.iter().sum();
            let shares = near.map(|near| near / sum);
            let at_rest = 0.2 + 0.5 * at;
            let own: f32 = shares.iter().zip(lost).map(|(share, lost)| share * lost).sum();
            lights.places.push(Place { cell, channel: 0, at_rest, gone: at_rest * own + gone(cell) });
            lights.shares.extend(shares);
        }
        lights
    }

    #[test]
    fn what_each_light_has_lost_is_found_beside_stains() {
        let lost = [0.2, 0.0, 0.012];
        for (is_stained, max_off) in [(false, 1e-4), (true, 0.01)] {
            let noise = |cell: usize| 0.004 * ((cell * 37 % 11) as f32 / 5.0 - 1.0);
            let stain = |cell: usize| if cell / 10 % 4 == 1 { 0.1 } else { noise(cell) };
            let mut lights = lights(lost, 300, |cell| if is_stained { stain(cell) } else { 0.0 });
            lights.solve();
            for (found, lost) in lights.gone.iter().zip(lost) {
                assert!((found - lost).abs() < max_off, "{is_stained}: {:?}", lights.gone);
            }
        }
    }

    #[test]
    fn a_light_that_nothing_shows_is_as_it_was_and_few_places_say_nothing() {
        let mut lights = lights([0.1; 3], 300, |_| 0.0);
        // The last light's part is covered.
        lights.places[120..].iter_mut().for_each(|place| place.gone = f32::NAN);
        lights.shares.chunks_mut(3).for_each(|shares| shares[2] = 0.0);
        lights.solve();
        assert!(
            lights.gone[2] == 0.0 && lights.gone.iter().all(|gone| gone.is_finite()),
            "{:?}",
            lights.gone
        );
        lights.places[MIN_PLACES - 1..].iter_mut().for_each(|place| place.gone = f32::NAN);
        lights.solve();
        assert_eq!(lights.gone, [0.0; 3]);
    }
}
