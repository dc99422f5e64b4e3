//! From the sensor's state and its light to a picture in linear light.

pub(crate) mod coverage;
pub mod edges;
pub(crate) mod frame;
pub(crate) mod glints;
pub(crate) mod lattice;
pub(crate) mod lens_field;
pub(crate) mod outline;
pub(crate) mod overlap;
pub(crate) mod picture;
pub(crate) mod printed;
pub(crate) mod projector;
pub(crate) mod rolled;
pub(crate) mod sensor_state;
pub mod settings;
pub(crate) mod specks;
pub(crate) mod spots;
pub(crate) mod surface;

#[cfg(test)]
mod rolled_tests;
#[cfg(test)]
mod shading_tests;
