//! A frame as the camera gives it.

/// Pixels that a frame may have.
pub const MAX_PIXELS: usize = 1 << 26;

/// A raw frame: rows from the top, grey or interleaved red, green, blue.
#[derive(Debug, Clone, Copy)]
pub struct CameraFrame<'a> {
    width: usize,
    height: usize,
    channels: usize,
    bytes: &'a [u8],
}

/// Bytes that are no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameFault {
    /// Bytes given.
    pub bytes: usize,
    /// Bytes that width, height and channels call for.
    pub wanted: usize,
}

impl std::fmt::Display for FrameFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bytes where the frame's size calls for {}", self.bytes, self.wanted)
    }
}

impl std::error::Error for FrameFault {}

impl<'a> CameraFrame<'a> {
    /// A frame of 1 (grey) or 3 (red, green, blue) channels.
    ///
    /// # Errors
    /// Bytes that are not `width * height * channels`, other numbers of channels, no pixels, or more than 2^26.
    pub fn new(width: usize, height: usize, channels: usize, bytes: &'a [u8]) -> Result<Self, FrameFault> {
        let pixels = width.checked_mul(height).filter(|n| (1..=MAX_PIXELS).contains(n));
        let wanted = if channels == 1 || channels == 3 { pixels.unwrap_or(0) * channels } else { 0 };
        if wanted == 0 || bytes.len() != wanted {
            return Err(FrameFault { bytes: bytes.len(), wanted });
        }
        Ok(Self { width, height, channels, bytes })
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// 1 or 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Its bytes.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}
