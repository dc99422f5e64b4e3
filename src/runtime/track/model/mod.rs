//! What the constants say of the sensor, made ready to be looked for: dots, white markers, mask.

mod dots;
mod markers;
mod sensor;

pub(super) use dots::{DotModel, KeyModel};
pub(super) use markers::MarkerModels;
pub(super) use sensor::SensorModel;
