//! domecast: from a parameter file to a dome-shaped camera tactile sensor.
pub mod artwork;
pub mod build;
pub mod calibrate;
pub mod camera;
pub mod cli;
pub mod constants;
pub mod design;
pub mod layout;
pub mod mechanics;
pub mod mesh;
pub mod numeric;
pub mod optics;
pub mod parts;
pub mod pose;
pub mod sim;
pub mod track;
pub mod transfer;
