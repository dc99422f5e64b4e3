//! From a picture in linear light to the camera's bytes.

pub mod pass;
