//! A drawn frame as the bytes of its files.

use std::io;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use crate::electronics::deviation::CodingDeviation;
use crate::output::drawn::Drawn;
use crate::output::truth::FrameTruth;
use crate::raster::frame::Image8;
use crate::scene::Scene;
use crate::work::Work;
use domecast_optics::DomeShape;

/// Quality of the video's JPEGs: the PNG frames are the exact ones.
const QUALITY: u8 = 92;

/// A frame's picture in both codes.
pub(super) struct CodedImage {
    pub width: usize,
    pub height: usize,
    pub png: Vec<u8>,
    pub jpeg: Vec<u8>,
}

/// A frame, coded.
pub(super) struct CodedFrame {
    pub image: Option<CodedImage>,
    /// Further files by name.
    pub extras: Vec<(String, Vec<u8>)>,
    /// The truth's line.
    pub line: String,
    pub truth: FrameTruth,
    pub coding: Option<CodingDeviation>,
    pub work: Work,
}

impl CodedFrame {
    /// Codes a frame; its picture comes back, for its room.
    pub fn new(scene: &Scene, drawn: Drawn) -> Result<(Self, Option<Image8>), String> {
        let image = match &drawn.image {
            Some(image) => Some(CodedImage {
                width: image.width,
                height: image.height,
                png: png_bytes(image).map_err(|error| error.to_string())?,
                jpeg: jpeg_bytes(image).map_err(|error| error.to_string())?,
            }),
            None => None,
        };
        let extras = extras(scene, &drawn)?;
        let line = drawn.truth.to_line();
        let Drawn { image: picture, truth, coding, work, .. } = drawn;
        Ok((Self { image, extras, line, truth, coding, work }, picture))
    }
}

/// A picture as PNG: grey or RGB, 8 bits, coded fast.
fn png_bytes(image: &Image8) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::with_capacity(image.bytes.len() / 2);
    let width = u32::try_from(image.width).unwrap_or(u32::MAX);
    let height = u32::try_from(image.height).unwrap_or(u32::MAX);
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(if image.channels == 3 { png::ColorType::Rgb } else { png::ColorType::Grayscale });
    encoder.set_depth(png::BitDepth::Eight);
    // One filter for all rows: smooth pictures gain little from a choice, which takes longer than the code.
    encoder.set_compression(png::Compression::Fastest);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&image.bytes)?;
    writer.finish()?;
    Ok(bytes)
}

/// A picture as JPEG, of its colours every other pixel each way, as videos have it.
fn jpeg_bytes(image: &Image8) -> io::Result<Vec<u8>> {
    let side = |n: usize| {
        let long = || io::Error::new(io::ErrorKind::InvalidInput, "a JPEG side has at most 65535 pixels");
        u16::try_from(n).map_err(|_| long())
    };
    let mut jpeg = Vec::with_capacity(image.bytes.len() / 8);
    let mut encoder = Encoder::new(&mut jpeg, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    let color = if image.channels == 3 { ColorType::Rgb } else { ColorType::Luma };
    encoder
        .encode(&image.bytes, side(image.width)?, side(image.height)?, color)
        .map_err(|error| io::Error::other(error.to_string()))?;
    Ok(jpeg)
}

/// Samples along each side of a height map.
const HEIGHT_SIDE: u32 = 200;

/// The membrane's heights, the contact's pressure and what each pixel sees, where the scene wants them.
fn extras(scene: &Scene, drawn: &Drawn) -> Result<Vec<(String, Vec<u8>)>, String> {
    let wanted = scene.file().output;
    let number = drawn.truth.frame;
    let dome = scene.optics().dome();
    let mut files = Vec::new();
    if wanted.heights {
        let heights = match &drawn.contact {
            Some(contact) => contact.height_map_mm(dome, HEIGHT_SIDE as usize),
            None => still_heights_mm(dome, HEIGHT_SIDE as usize),
        };
        files.push((
            format!("heights_{number:04}.tif"),
            float_tiff(&heights, HEIGHT_SIDE).map_err(|error| error.to_string())?,
        ));
    }
    if wanted.pressure {
        files.push((format!("pressure_{number:04}.json"), pressure_json(drawn).into_bytes()));
    }
    if let Some(maps) = &drawn.depth {
        files.extend(maps.files(number).map_err(|error| error.to_string())?);
    }
    Ok(files)
}

fn pressure_json(drawn: &Drawn) -> String {
    let nodes = drawn.contact.as_ref().map_or(&[][..], |contact| &contact.nodes);
    let nodes: Vec<_> = nodes
        .iter()
        .map(|node| {
            serde_json::json!({
                "at_mm": node.at_mm.to_array(), "area_mm2": node.area_mm2, "force_n": node.force_n.to_array(),
                "pressure_mpa": node.pressure_mpa, "sticks": node.sticks,
            })
        })
        .collect();
    let text = serde_json::json!({
        "frame": drawn.truth.frame,
        "contact_radius_mm": drawn.contact.as_ref().map(|contact| contact.contact_radius_mm),
        "peak_pressure_mpa": drawn.contact.as_ref().map(|contact| contact.peak_pressure_mpa),
        "nodes": nodes,
    });
    format!("{text}\n")
}

/// Heights of the undeformed dome on the raster of [`domecast_contact::ContactState::height_map_mm`], which reaches from
/// rim to rim; zero beside the dome.
fn still_heights_mm(dome: &DomeShape, side: usize) -> Vec<f64> {
    let (radius_mm, rim_mm) = (dome.radius_mm(), dome.rim_radius_mm());
    let at = |i: usize| ((2 * i + 1) as f64 / side as f64 - 1.0) * rim_mm;
    let height = |k: usize| {
        let (x, y) = (at(k % side), at(k / side));
        let above = (radius_mm * radius_mm - x.powi(2) - y.powi(2)).max(0.0).sqrt();
        if x.hypot(y) < rim_mm { (dome.center_z_mm() + above).max(0.0) } else { 0.0 }
    };
    (0..side * side).map(height).collect()
}

/// A square raster as 32-bit float TIFF.
fn float_tiff(values: &[f64], side: u32) -> tiff::TiffResult<Vec<u8>> {
    let mut bytes = io::Cursor::new(Vec::new());
    let values: Vec<f32> = values.iter().map(|v| *v as f32).collect();
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes)?;
    encoder.write_image::<tiff::encoder::colortype::Gray32Float>(side, side, &values)?;
    Ok(bytes.into_inner())
}
