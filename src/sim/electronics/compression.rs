//! The camera's lossy code: baseline JPEG, as UVC cameras send it (MJPEG), and decoded again.

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::effect_name::EffectName;
use crate::electronics::pass::{CodedPass, PassContext};
use crate::raster::frame::Image8;
use crate::scene::electronics::JpegChroma;
use crate::work::Work;

/// Work of a pixel's channel, coded and decoded.
pub(crate) const VALUE_UNITS: u64 = 12;

/// Codes the picture and decodes it again.
pub(crate) struct Jpeg {
    pub quality: u8,
    pub chroma: JpegChroma,
}

impl Jpeg {
    /// The picture as it comes out of the code; `None` if coder or decoder refuse it, which no picture of a size
    /// that a design may have makes them do.
    fn through(&self, image: &Image8) -> Option<Vec<u8>> {
        let size = |length: usize| u16::try_from(length).ok();
        let (width, height) = (size(image.width)?, size(image.height)?);
        let (kind, space) = match image.channels {
            1 => (ColorType::Luma, ColorSpace::Luma),
            3 => (ColorType::Rgb, ColorSpace::RGB),
            _ => return None,
        };
        let mut code = Vec::new();
        let mut encoder = Encoder::new(&mut code, self.quality.clamp(1, 100));
        encoder.set_sampling_factor(match self.chroma {
            JpegChroma::Full => SamplingFactor::F_1_1,
            JpegChroma::HalfWidth => SamplingFactor::F_2_1,
            JpegChroma::Quarter => SamplingFactor::F_2_2,
        });
        encoder.encode(&image.bytes, width, height, kind).ok()?;
        let options = DecoderOptions::default().jpeg_set_out_colorspace(space);
        let decoded = JpegDecoder::new_with_options(ZCursor::new(&code), options).decode().ok()?;
        (decoded.len() == image.bytes.len()).then_some(decoded)
    }
}

impl CodedPass for Jpeg {
    fn effect(&self) -> EffectName {
        EffectName::Compression
    }

    fn is_lossy(&self) -> bool {
        true
    }

    fn run(&self, image: &mut Image8, _context: &PassContext, work: &mut Work) {
        if let Some(bytes) = self.through(image) {
            image.bytes = bytes;
        }
        work.add(EffectName::Compression, image.bytes.len() as u64 * VALUE_UNITS);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(channels: usize) -> Image8 {
        let (width, height) = (64, 48);
        let value = |i: usize| {
            let (x, y, c) = ((i / channels) % width, i / channels / width, i % channels);
            (40 + 2 * x + y + 30 * c) as u8
        };
        Image8 { width, height, channels, bytes: (0..width * height * channels).map(value).collect() }
    }

    fn worst(quality: u8, chroma: JpegChroma, image: &Image8) -> u8 {
        let out = Jpeg { quality, chroma }.through(image).unwrap();
        image.bytes.iter().zip(out).map(|(a, b)| a.abs_diff(b)).max().unwrap()
    }

    #[test]
    fn the_loss_is_small_at_high_quality_and_grows_as_it_falls() {
        for channels in [1, 3] {
            let image = ramp(channels);
            let fine = worst(100, JpegChroma::Full, &image);
            let coarse = worst(10, JpegChroma::Full, &image);
            assert!(fine <= 3, "{channels}: {fine}");
            assert!(coarse > fine, "{channels}: {coarse}");
        }
    }

    #[test]
    fn colour_is_kept_coarser_than_light_where_asked() {
        let mut image = ramp(3);
        for (i, pixel) in image.bytes.chunks_exact_mut(3).enumerate() {
            pixel[0] = if i % 2 == 0 { 200 } else { 60 };
            pixel[2] = if i % 2 == 0 { 60 } else { 200 };
        }
        assert!(worst(95, JpegChroma::HalfWidth, &image) > 3 * worst(95, JpegChroma::Full, &image));
    }

    #[test]
    fn a_picture_too_wide_for_the_code_is_left_as_it_is() {
        let mut image = Image8 { width: 70_000, height: 1, channels: 1, bytes: vec![7; 70_000] };
        let before = image.clone();
        let context = PassContext::default();
        Jpeg { quality: 50, chroma: JpegChroma::Full }.run(&mut image, &context, &mut Work::default());
        assert_eq!(image, before);
    }
}
