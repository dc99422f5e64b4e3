//! Whether a light has gone out since the frame at rest.
//!
//! What a light gives now is said by the places at which it gives most of a colour's light, less what other lights of the colour have
//! lost there. A touch changes some of those places, a light that is out changes them all: the middle one counts.

use super::cells::View;
use super::levels::Level;
use domecast_light::direct::EmitterRule;
use domecast_light::tables::Ways;

/// Every so many cells are asked.
const STEP: usize = 29;

/// How many places must speak for a light.
const MIN_PLACES: usize = 12;

/// A light that has lost so much of what it gave at rest is out.
const OUT: f32 = 0.5;

/// Bound on the rounds in which lights of a colour are distinguished.
const MAX_ROUNDS: usize = 16;

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
    /// What of each light has gone.
    gone: Vec<f32>,
    room: Vec<f32>,
}

impl Lights {
    /// Of these cells of the frame at rest.
    pub fn at_rest(ways: &Ways, view: &View, is_bare: impl Fn(usize) -> bool) -> Self {
        let rule = EmitterRule::default();
        let mut lights = Self { gone: vec![0.0; ways.sources.len()], ..Self::default() };
        for cell in (0..view.is_dome.len()).step_by(STEP).filter(|cell| is_bare(*cell)) {
            let still: Vec<f64> = ways
                .sources
                .iter()
                .map(|source| ways.still(source, view.place[cell].as_dvec3(), &rule))
                .collect();
            for channel in 0..3 {
                // What the dome gives itself is shared as what the lights give it.
                let seen =
                    || ways.sources.iter().zip(&still).map(|(source, own)| own * source.seen_mw[channel]);
                let sum: f64 = seen().sum();
                let strongest =
                    seen().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, seen)| *seen > 0.0);
                if let Some((light, _)) = strongest {
                    lights.places.push(Place { cell, channel, light, gone: f32::NAN });
                    lights.shares.extend(seen().map(|own| (own / sum) as f32));
                }
            }
        }
        lights.room.reserve(lights.places.len());
        lights
    }

    /// Finds those that are out; `at_rest` is the level of a cell's channel in the frame at rest, without stray light.
    pub fn find_out(
        &mut self,
        levels: &[Level],
        stray: f32,
        is_bare: impl Fn(usize) -> bool,
        at_rest: impl Fn(usize, usize) -> f32,
        out: &mut Vec<usize>,
    ) {
        out.clear();
        let Self { places, shares, gone, room } = self;
        for place in &mut *places {
            let level = levels[place.cell].light[place.channel] - stray;
            place.gone =
                if is_bare(place.cell) { 1.0 - level / at_rest(place.cell, place.channel) } else { f32::NAN };
        }
        gone.fill(0.0);
        for _ in 0..MAX_ROUNDS {
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
                gone[light] = if room.len() < MIN_PLACES {
                    0.0
                } else {
                    room.select_nth_unstable_by(middle, f32::total_cmp).1.clamp(-1.0, 1.0)
                };
            }
        }
        out.extend((0..gone.len()).filter(|light| gone[*light] > OUT));
    }
}
