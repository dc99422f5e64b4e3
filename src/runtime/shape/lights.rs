//! What each light gives now, parts of what it gave in the frame at rest.
//!
//! The places low over the sheet say so at which a light gives most of a colour's light, less what other lights of the colour have
//! lost there. A touch changes some of those places, a weaker light changes them all: the middle one counts. A light that is out is
//! named. What the others have lost is taken out of every place's gain, so that a supply that sags or a light that ages is no slope;
//! a wide touch bends the skin down to its rim and feigns the same, so it is asked where the dots show the skin at rest alone, and kept.

use glam::{DVec3, Vec3A};

use super::cells::{Cells, View};
use super::lattice::Lattice;
use super::levels::Level;
use crate::track::Tracked;
use domecast_light::direct::EmitterRule;
use domecast_light::tables::Ways;

/// Every so many cells are asked.
const STEP: usize = 5;

/// Of a light's places those are asked at which it has so much of its largest share, and of these the part lowest over the sheet.
const OWN: f32 = 0.8;
const LOW: f32 = 0.25;

/// How many places must speak for a light.
const MIN_PLACES: usize = 12;

/// Light of a place at rest by which a part of a hundred can be seen, full scale 1.
const MIN_LEVEL: f32 = 20.0 / 255.0;

/// A light that has lost so much of what it gave at rest is out.
const OUT: f32 = 0.5;

/// Where no light changed by more than the first part, nothing is taken out, where one did by more than the second, all is: estimates of
/// lights that did not change lie up to 0.005 from 1 on untouched skin, on five designs.
const CHANGED: [f32; 2] = [0.015, 0.03];

/// Motion of a dot since the frame at rest, part of the dome's radius, below which it lies as there: noise of two levels moves all of a
/// design's dots but one by up to 0.0017. So does a skin at rest, a hundredth of whose dots (at least one) may be astray.
const STILL: f64 = 2e-3;
const ASTRAY: usize = 100;

/// Bound on the rounds in which lights of a colour are distinguished, and the change, a part, that ends them.
const MAX_ROUNDS: usize = 64;
const END: f32 = 1e-5;

/// A place at which one light gives the most of a channel's light.
#[derive(Debug, Clone, Copy)]
struct Place {
    cell: usize,
    channel: usize,
    light: usize,
    /// Part of the light that has gone; NaN where it is not seen.
    gone: f32,
}

/// The lights of the constants at the frame at rest.
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
    /// Each light's irradiance by channel.
    fields: Vec<Lattice>,
    /// What is left of the light at rest.
    left: Lattice,
}

impl Lights {
    /// Of these cells of the frame at rest.
    pub fn at_rest(
        ways: &Ways,
        cells: &Cells,
        view: &View,
        levels: &[Level],
        tracked: &Tracked,
        is_bare: impl Fn(usize) -> bool,
    ) -> Self {
        let rule = EmitterRule::default();
        let count = ways.sources.len();
        let mut lights = Self {
            gone: vec![0.0; count],
            taken: vec![0.0; count],
            dots_mm: tracked.black_dots.iter().map(|dot| dot.displacement_mm).collect(),
            ..Self::default()
        };
        for source in &ways.sources {
            let mut field = Lattice::default();
            field.take(cells, view, |cell| {
                let still = ways.still(source, view.place[cell].as_dvec3(), &rule);
                Some(Vec3A::from_array(source.seen_mw.map(|seen| (still * seen) as f32)))
            });
            lights.fields.push(field);
        }
        // What the dome gives itself is shared as what the lights give it.
        let shares_at = |cell: usize| -> Vec<Vec3A> {
            let (column, row) = (cell % cells.width, cell / cells.width);
            let own: Vec<Vec3A> = lights.fields.iter().map(|field| field.at(column, row)).collect();
            let sum: Vec3A = own.iter().sum();
            own.into_iter().map(|own| own / sum.max(Vec3A::splat(f32::MIN_POSITIVE))).collect()
        };
        let mut of_lights = vec![Vec::new(); count];
        for cell in (0..view.is_dome.len()).step_by(STEP).filter(|cell| is_bare(*cell)) {
            let shares = shares_at(cell);
            for channel in (0..3).filter(|channel| levels[cell].light[*channel] > MIN_LEVEL) {
                let strongest = (0..count).max_by(|a, b| shares[*a][channel].total_cmp(&shares[*b][channel]));
                if let Some(light) = strongest.filter(|light| shares[*light][channel] > 0.0) {
                    of_lights[light].push(Place { cell, channel, light, gone: f32::NAN });
                }
            }
        }
        for (light, mut own) in of_lights.into_iter().enumerate() {
            let share = |place: &Place| shares_at(place.cell)[light][place.channel];
            let largest = own.iter().map(share).fold(0.0, f32::max);
            own.retain(|place| share(place) >= OWN * largest);
            let low = ((own.len() as f32 * LOW) as usize).max(MIN_PLACES).min(own.len());
            own.sort_by(|a, b| view.place[a.cell].z.total_cmp(&view.place[b.cell].z));
            for place in &own[..low] {
                lights.shares.extend(shares_at(place.cell).iter().map(|share| share[place.channel]));
                lights.places.push(*place);
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
        let Self { places, shares, gone, room, .. } = self;
        for place in &mut *places {
            let level = levels[place.cell].light[place.channel] - stray;
            place.gone =
                if is_bare(place.cell) { 1.0 - level / at_rest(place.cell, place.channel) } else { f32::NAN };
        }
        gone.fill(0.0);
        for _ in 0..MAX_ROUNDS {
            let mut change = 0.0_f32;
            for light in 0..gone.len() {
                room.clear();
                for (place, shares) in places.iter().zip(shares.chunks(gone.len())) {
                    if place.light == light && place.gone.is_finite() {
                        let others: f32 =
                            shares.iter().zip(&*gone).map(|(share, gone)| share * gone).sum::<f32>()
                                - shares[light] * gone[light];
                        room.push((place.gone - others) / shares[light]);
                    }
                }
                let middle = room.len() / 2;
                let now = if room.len() < MIN_PLACES {
                    0.0
                } else {
                    room.select_nth_unstable_by(middle, f32::total_cmp).1.clamp(-1.0, 1.0)
                };
                change = change.max((now - gone[light]).abs());
                gone[light] = now;
            }
            if change < END {
                break;
            }
        }
        out.extend((0..gone.len()).filter(|light| gone[*light] > OUT));
    }
}
