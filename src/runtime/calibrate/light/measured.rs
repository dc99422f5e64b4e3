//! The fitted light as constants, with what is left open of it.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::model::{LightModel, Number, directions};
use super::solve::Solved;
use super::verdict::parameters;
use crate::constants::{LedDeviations, LightConstants, LightDeviations, LightUncertainty, LobeDeviations};

/// The nominal light with what was fitted, deviations and covariance.
pub(super) fn measured_light(model: &LightModel, solved: &Solved) -> LightConstants {
    let mut light = model.physical_light(&solved.values.numbers);
    let all = parameters(model, solved);
    let units: Vec<f64> =
        all.iter().enumerate().map(|(k, p)| p.sd / solved.covariance[(k, k)].max(1e-300).sqrt()).collect();
    let n = model.count();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        0.5 * (solved.covariance[(i, j)] + solved.covariance[(j, i)]) * units[i] * units[j]
    });
    light.sd = Some(deviations(model, &light, &covariance));
    light.uncertainty = Some(LightUncertainty {
        parameters: all.into_iter().map(|parameter| parameter.name).collect(),
        covariance: (0..n).map(|i| covariance.row(i).iter().copied().collect()).collect(),
    });
    light.source = "measured".into();
    light
}

fn deviations(model: &LightModel, light: &LightConstants, covariance: &DMatrix<f64>) -> LightDeviations {
    let at = |number: Number| model.numbers.iter().position(|own| *own == number);
    let sd = |number: Number| at(number).map_or(0.0, |k| covariance[(k, k)].max(0.0).sqrt());
    let led = |i: usize| {
        let body = model.bodies.iter().position(|list| list.contains(&i)).unwrap_or(0);
        let lobe = model.lobes.iter().position(|list| list.contains(&i)).unwrap_or(0);
        let ways = directions(&model.nominal.leds[i]);
        let along = |axis: DVec3| {
            let mut weights = DVector::zeros(covariance.nrows());
            for (k, way) in ways.iter().enumerate() {
                if let Some(number) = at(Number::Place(body, k)) {
                    weights[number] = way.dot(axis);
                }
            }
            (weights.transpose() * covariance * &weights)[(0, 0)].max(0.0).sqrt()
        };
        LedDeviations {
            position_mm: DVec3::AXES.map(along),
            axis_rad: [0, 1].map(|k| sd(Number::Axis(body, k))),
            flux: sd(Number::Flux(i)),
            lobe: LobeDeviations {
                exponent: sd(Number::Exponent(lobe)),
                lambert_fraction: sd(Number::Lambert(lobe)),
                lobe_width_rad: sd(Number::Width(lobe)),
            },
        }
    };
    let crosstalk = |channel: usize| [0, 1, 2].map(|color| sd(Number::Crosstalk(channel, color)));
    LightDeviations {
        leds: (0..light.leds.len()).map(led).collect(),
        crosstalk: [0, 1, 2].map(crosstalk),
        reflectance: [0, 1, 2].map(|c| sd(Number::Reflectance(c))),
        stray: sd(Number::Stray),
    }
}
