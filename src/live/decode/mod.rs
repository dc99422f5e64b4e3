//! Pictures from their files and from cameras, and back.
//!
//! ```
//! use domecast_live::decode::{picture, png_of};
//!
//! let file = png_of(2, 1, 1, &[7, 9])?;
//! let read = picture(&file)?;
//! assert_eq!((read.width, read.height, read.bytes), (2, 1, vec![7, 9]));
//! # Ok::<(), String>(())
//! ```

mod huffman;
mod yuyv;

use std::io::Read;

use domecast_runtime::track::CameraFrame;

pub use huffman::with_huffman_tables;
pub use yuyv::yuyv;

/// Bytes at most of an unpacked picture.
const MAX_BYTES: usize = 3 << 26;

/// A decoded picture: grey or interleaved red, green, blue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// 1 or 3.
    pub channels: usize,
    /// Rows from the top.
    pub bytes: Vec<u8>,
}

/// How the bytes of a picture's file are coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Portable Network Graphics.
    Png,
    /// JPEG, also a frame of Motion JPEG.
    Jpeg,
}

impl PictureFormat {
    /// By the first bytes; `None` for others.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"\x89PNG") {
            Some(Self::Png)
        } else if bytes.starts_with(b"\xff\xd8") {
            Some(Self::Jpeg)
        } else {
            None
        }
    }

    /// `png` or `jpeg`, as ROS 2 names them.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpeg",
        }
    }
}

impl Picture {
    /// As trackers take it.
    ///
    /// # Errors
    /// What is wrong with its size.
    pub fn frame(&self) -> Result<CameraFrame<'_>, String> {
        let frame = CameraFrame::new(self.width, self.height, self.channels, &self.bytes);
        frame.map_err(|error| error.to_string())
    }

    /// Mirrors it left to right.
    pub fn mirror(&mut self) {
        for row in self.bytes.chunks_exact_mut(self.width * self.channels) {
            let mut right = self.width;
            for left in 0..self.width / 2 {
                right -= 1;
                for channel in 0..self.channels {
                    row.swap(left * self.channels + channel, right * self.channels + channel);
                }
            }
        }
    }

    fn checked(self) -> Result<Self, String> {
        self.frame()?;
        Ok(self)
    }
}

/// A PNG, JPEG or PNM picture, recognized by its first bytes.
///
/// # Errors
/// What is wrong with it: cut off, too large, of another kind.
pub fn picture(bytes: &[u8]) -> Result<Picture, String> {
    if let Some(format) = PictureFormat::of(bytes) {
        match format {
            PictureFormat::Png => png(bytes),
            PictureFormat::Jpeg => jpeg(bytes),
        }
    } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P6") {
        let mut rest = bytes;
        pnm(&mut rest)?.ok_or_else(|| "holds nothing".into())
    } else {
        Err("is no PNG, JPEG or PNM picture".into())
    }
}

fn png(bytes: &[u8]) -> Result<Picture, String> {
    let fault = |error: png::DecodingError| format!("is not a whole PNG picture ({error})");
    let limits = png::Limits { bytes: 2 * MAX_BYTES };
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(fault)?;
    let size = reader.output_buffer_size().filter(|size| *size <= MAX_BYTES / 3 * 4);
    let Some(size) = size else { return Err("is too large".into()) };
    let mut raw = vec![0; size];
    let info = reader.next_frame(&mut raw).map_err(fault)?;
    raw.truncate(info.buffer_size());
    let (width, height) = (info.width as usize, info.height as usize);
    let samples = info.color_type.samples();
    // Transparency is passed over.
    let channels = if samples >= 3 { 3 } else { 1 };
    let bytes = if samples == channels {
        raw
    } else {
        raw.chunks_exact(samples).flat_map(|pixel| pixel[..channels].iter().copied()).collect()
    };
    Picture { width, height, channels, bytes }.checked()
}

fn jpeg(bytes: &[u8]) -> Result<Picture, String> {
    use zune_jpeg::JpegDecoder;
    use zune_jpeg::zune_core::bytestream::ZCursor;
    use zune_jpeg::zune_core::colorspace::ColorSpace;
    use zune_jpeg::zune_core::options::DecoderOptions;
    // A cut file is an error, not a picture with a grey rest.
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(1 << 14)
        .set_max_height(1 << 14);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    // the decoder ends some of its messages with a line break
    let bytes = decoder
        .decode()
        .map_err(|error| format!("is not a whole JPEG picture ({})", error.to_string().trim_end()))?;
    let Some((width, height)) = decoder.dimensions() else { return Err("has no size".into()) };
    Picture { width, height, channels: 3, bytes }.checked()
}

/// The next PGM or PPM picture (binary, 8 bit) of a stream; `None` at its end.
///
/// # Errors
/// A stream that broke off, or holds something else.
pub fn pnm(stream: &mut dyn Read) -> Result<Option<Picture>, String> {
    let fault = |error: std::io::Error| format!("the stream broke off ({error})");
    let mut byte = || -> Result<Option<u8>, String> {
        let mut one = [0];
        loop {
            match stream.read(&mut one) {
                Ok(0) => return Ok(None),
                Ok(_) => return Ok(Some(one[0])),
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(fault(error)),
            }
        }
    };
    let Some(first) = byte()? else { return Ok(None) };
    let channels = match (first, byte()?) {
        (b'P', Some(b'5')) => 1,
        (b'P', Some(b'6')) => 3,
        _ => return Err("the stream holds no PGM or PPM picture".into()),
    };
    let mut numbers = [0_usize; 3];
    for number in &mut numbers {
        let mut digits = 0;
        let mut comment = false;
        loop {
            match byte()? {
                Some(b'#') if digits == 0 => comment = true,
                Some(b'\n') if comment => comment = false,
                Some(_) if comment => {}
                Some(d @ b'0'..=b'9') if digits < 6 => {
                    *number = 10 * *number + usize::from(d - b'0');
                    digits += 1;
                }
                Some(b' ' | b'\n' | b'\r' | b'\t') if digits == 0 => {}
                Some(b' ' | b'\n' | b'\r' | b'\t') => break,
                _ => return Err("the stream's picture has no proper head".into()),
            }
        }
    }
    let [width, height, max] = numbers;
    let size = width.checked_mul(height).and_then(|n| n.checked_mul(channels));
    let Some(size) = size.filter(|size| *size > 0 && *size <= MAX_BYTES && max == 255) else {
        return Err(format!("the stream's picture is {width} x {height} with values to {max}"));
    };
    let mut bytes = Vec::new();
    stream.take(size as u64).read_to_end(&mut bytes).map_err(fault)?;
    Picture { width, height, channels, bytes }.checked().map(Some)
}

/// A PNG of bytes: rows from the top, 1 or 3 channels.
///
/// # Errors
/// Bytes that are not of the size.
pub fn png_of(width: usize, height: usize, channels: usize, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width as u32, height as u32);
    encoder.set_color(if channels == 3 { png::ColorType::Rgb } else { png::ColorType::Grayscale });
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(bytes).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files that are whole: PNG, JPEG, PGM, PPM.
    fn files() -> [Vec<u8>; 4] {
        let bytes: Vec<u8> = (0..32 * 24 * 3).map(|i| (i % 251) as u8).collect();
        let mut pgm = b"P5\n32 24\n255\n".to_vec();
        pgm.extend(&bytes[..32 * 24]);
        let mut ppm = b"P6 # a comment\n32 24 255\n".to_vec();
        ppm.extend(&bytes);
        let jpeg = include_bytes!("../../../tests/cases/frames/tiny.jpg").to_vec();
        [png_of(32, 24, 3, &bytes).unwrap(), jpeg, pgm, ppm]
    }

    #[test]
    fn whole_files_are_read_and_cut_ones_named() {
        for file in files() {
            let whole = picture(&file).unwrap();
            assert_eq!((whole.width, whole.height), (32, 24));
            assert_eq!(whole.bytes.len(), 32 * 24 * whole.channels);
            for part in [0, 1, 2, 8, file.len() / 2, file.len() - 40] {
                assert!(picture(&file[..part]).is_err(), "{part} of {}", file.len());
            }
        }
    }

    // Bytes changed, cut out and doubled at random: a picture of its own size, or an error; never a panic.
    #[test]
    fn corrupt_files_do_no_harm() {
        let mut state = 88_172_645_463_325_252_u64;
        let mut random = move |end: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % end as u64) as usize
        };
        let mut refused = 0;
        let files = files();
        for round in 0..8_000 {
            let mut file = files[round % 4].clone();
            for _ in 0..1 + random(8) {
                let at = random(file.len());
                match random(8) {
                    0 => drop(file.drain(at..(at + random(16)).min(file.len()))),
                    1 => file.insert(at, random(256) as u8),
                    // Most in the head, where sizes and tables are.
                    2..5 => file[at.min(40)] = random(256) as u8,
                    _ => file[at] = random(256) as u8,
                }
                if file.len() < 8 {
                    break;
                }
            }
            match picture(&file) {
                Ok(whole) => assert_eq!(whole.bytes.len(), whole.width * whole.height * whole.channels),
                Err(problem) => {
                    assert!(!problem.is_empty());
                    refused += 1;
                }
            }
        }
        assert!(refused > 2_000, "{refused}");
    }
}
