//! The numbers of the light that are fitted, and the constants that they make.

use glam::{DMat3, DVec3};

use crate::constants::{LedConstants, LightConstants};

/// Parts of nominal that a flux or a lobe may reach.
const MAX_PART: f64 = 4.0;
/// Largest mean reflectance: above it the balance of light in the dome has no end.
const MAX_REFLECTANCE: f64 = 0.95;
/// Deviation of the logarithm of each channel's exposure, of which nothing is known beforehand.
const GAIN_SD: f64 = 2.0;
/// Deviation of the exponent of the lens's falloff.
const FALLOFF_SD: f64 = 2.0;

/// A fitted number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    /// Offset of a light's place: outwards, along its ring, up.
    Place(usize, usize),
    /// Its axis: tilt out of the vertical plane's nominal angle, turn across that.
    Axis(usize, usize),
    /// Logarithm of a light's flux over nominal.
    Flux(usize),
    Lambert(usize),
    Width(usize),
    Exponent(usize),
    /// Logarithm of a channel's reflectance over nominal.
    Reflectance(usize),
    /// Channel, and the colour that it takes beside its own.
    Crosstalk(usize, usize),
    Stray,
    /// Logarithm of a channel's exposure over what the frame at rest says with nominal numbers.
    Gain(usize),
    Falloff,
}

/// The numbers with their nominal constants; values of the fit are in prior deviations from nominal.
#[derive(Debug, Clone)]
pub(super) struct LightModel {
    pub nominal: LightConstants,
    /// Lights that are one part: the three colours of a white one.
    pub bodies: Vec<Vec<usize>>,
    /// Lights that share a lobe.
    pub lobes: Vec<Vec<usize>>,
    pub numbers: Vec<Number>,
    pub sds: Vec<f64>,
}

/// Lists of lights that have something in common.
fn grouped(
    leds: &[LedConstants],
    is_alike: impl Fn(&LedConstants, &LedConstants) -> bool,
) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, led) in leds.iter().enumerate() {
        match groups.iter_mut().find(|group| group.first().is_some_and(|k| is_alike(&leds[*k], led))) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// What a number's name says of directions: outwards from the axis, along the ring, up.
pub(super) fn directions(led: &LedConstants) -> [DVec3; 3] {
    let out = DVec3::new(led.position_mm[0], led.position_mm[1], 0.0).normalize_or(DVec3::X);
    [out, DVec3::Z.cross(out), DVec3::Z]
}

/// The axes that a light's own axis is tilted and turned about.
pub(super) fn turn_axes(led: &LedConstants) -> [DVec3; 2] {
    let [_, along, up] = directions(led);
    let tilt = along;
    [tilt, DVec3::from_array(led.axis).cross(tilt).normalize_or(up)]
}

impl LightModel {
    pub fn new(nominal: &LightConstants) -> Self {
        let leds = &nominal.leds;
        let bodies = grouped(leds, |a, b| a.position_mm == b.position_mm && a.axis == b.axis);
        let lobes = grouped(leds, |a, b| a.lobe == b.lobe);
        let open = nominal.tolerances;
        let (mut numbers, mut sds) = (Vec::new(), Vec::new());
        let mut add = |number: Number, sd: f64| {
            if sd > 0.0 && sd.is_finite() {
                numbers.push(number);
                sds.push(sd);
            }
        };
        (0..leds.len()).for_each(|i| add(Number::Flux(i), open.flux_part));
        for body in 0..bodies.len() {
            (0..3).for_each(|axis| add(Number::Place(body, axis), open.place_mm));
            (0..2).for_each(|axis| add(Number::Axis(body, axis), open.axis_rad));
        }
        for (i, lobe) in lobes.iter().enumerate() {
            if lobe.first().is_some_and(|led| leds[*led].lobe.diffuser.is_some()) {
                add(Number::Lambert(i), open.lambert_fraction);
                add(Number::Width(i), open.lobe_part);
            } else {
                add(Number::Exponent(i), open.lobe_part);
            }
        }
        (0..3).for_each(|c| add(Number::Reflectance(c), open.reflectance_part));
        // Colours that a channel's filter keeps out altogether stay out.
        let pairs = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];
        for (channel, color) in
            pairs.into_iter().filter(|(row, column)| nominal.crosstalk[*row][*column] > 0.0)
        {
            add(Number::Crosstalk(channel, color), open.crosstalk);
        }
        add(Number::Stray, open.stray);
        (0..3).for_each(|c| add(Number::Gain(c), GAIN_SD));
        add(Number::Falloff, FALLOFF_SD);
        Self { nominal: nominal.clone(), bodies, lobes, numbers, sds }
    }

    pub fn count(&self) -> usize {
        self.numbers.len()
    }

    /// Lights whose own light on the dome a number changes, other than by a factor.
    pub fn reshaped(&self, number: Number) -> &[usize] {
        let list = match number {
            Number::Place(body, _) | Number::Axis(body, _) => self.bodies.get(body),
            Number::Lambert(lobe) | Number::Width(lobe) | Number::Exponent(lobe) => self.lobes.get(lobe),
            _ => None,
        };
        list.map_or(&[], Vec::as_slice)
    }

    /// The light of these values.
    pub fn light(&self, values: &[f64]) -> LightConstants {
        let mut light = self.nominal.clone();
        let mut turns = vec![DVec3::ZERO; light.leds.len()];
        let part = |step: f64| step.exp().clamp(1.0 / (MAX_PART * MAX_PART), MAX_PART);
        for ((number, sd), value) in self.numbers.iter().zip(&self.sds).zip(values) {
            let step = value * sd;
            match *number {
                Number::Place(body, axis) => {
                    for i in self.bodies[body].iter().copied() {
                        let way = directions(&self.nominal.leds[i])[axis] * step;
                        let at = DVec3::from_array(light.leds[i].position_mm) + way;
                        light.leds[i].position_mm = at.to_array();
                    }
                }
                Number::Axis(body, axis) => {
                    for i in self.bodies[body].iter().copied() {
                        turns[i] += turn_axes(&self.nominal.leds[i])[axis] * step;
                    }
                }
                Number::Flux(i) => light.leds[i].flux *= part(step),
                Number::Lambert(_) | Number::Width(_) | Number::Exponent(_) => {
                    for i in self.reshaped(*number).iter().copied() {
                        reshape(&mut light.leds[i], *number, step, part(step));
                    }
                }
                Number::Reflectance(c) => {
                    let max_part = MAX_REFLECTANCE / light.mean_reflectance[c].max(1e-3);
                    let part = part(step).min(max_part.max(1.0));
                    light.reflectance[c] *= part;
                    light.mean_reflectance[c] *= part;
                }
                // Not held to what can be: a kink at 0, where the true value may lie, is no slope.
                Number::Crosstalk(channel, color) => light.crosstalk[channel][color] += step,
                Number::Stray => light.stray += step,
                Number::Gain(_) | Number::Falloff => {}
            }
        }
        let turned = light.leds.iter_mut().zip(turns).filter(|(_, turn)| *turn != DVec3::ZERO);
        for (led, turn) in turned {
            let rotation = DMat3::from_quat(glam::DQuat::from_scaled_axis(turn));
            let axis = (rotation * DVec3::from_array(led.axis)).normalize_or(DVec3::Z);
            let across = rotation * DVec3::from_array(led.across);
            led.axis = axis.to_array();
            led.across =
                (across - axis * axis.dot(across)).normalize_or(axis.any_orthonormal_vector()).to_array();
        }
        light
    }

    /// The light of these values as one can be: no crosstalk and no stray light below 0.
    pub fn physical_light(&self, values: &[f64]) -> LightConstants {
        let mut light = self.light(values);
        light.crosstalk.as_flattened_mut().iter_mut().for_each(|part| *part = part.clamp(0.0, 1.0));
        light.stray = light.stray.clamp(0.0, 0.5);
        light
    }

    /// Factors of the channels' exposure, and the exponent of the lens's falloff.
    pub fn camera(&self, values: &[f64]) -> ([f64; 3], f64) {
        let (mut gain, mut falloff) = ([1.0; 3], 0.0);
        for ((number, sd), value) in self.numbers.iter().zip(&self.sds).zip(values) {
            match *number {
                Number::Gain(c) => gain[c] = (value * sd).clamp(-10.0, 10.0).exp(),
                Number::Falloff => falloff = (value * sd).clamp(-10.0, 10.0),
                _ => {}
            }
        }
        (gain, falloff)
    }
}

fn reshape(led: &mut LedConstants, number: Number, step: f64, part: f64) {
    if matches!(number, Number::Exponent(_)) {
        led.lobe.exponent *= part;
    }
    if let Some(tape) = &mut led.lobe.diffuser {
        match number {
            Number::Lambert(_) => tape.lambert_fraction = (tape.lambert_fraction + step).clamp(0.0, 1.0),
            Number::Width(_) => tape.lobe_width_rad = (tape.lobe_width_rad * part).clamp(0.01, 3.0),
            _ => {}
        }
    }
}
