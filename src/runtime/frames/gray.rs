//! A frame of one channel.

/// Pixels that a frame may have.
pub const MAX_PIXELS: usize = 1 << 26;

/// A frame of one channel: values from 0 (black) to 1 (the file's largest value), row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Gray {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Why a file is not a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FrameError {
    /// It cannot be decoded.
    NotPng(String),
    /// It has no pixels, or more than [`MAX_PIXELS`].
    Size {
        /// Its width, px.
        width: usize,
        /// Its height, px.
        height: usize,
    },
    /// The number of values is not width times height.
    Count {
        /// Values given.
        values: usize,
    },
}

impl std::fmt::Display for FrameError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPng(why) => write!(f, "is not a PNG picture ({why})"),
            Self::Size { width, height } => {
                write!(f, "has {width} x {height} pixels; allowed: 1 to {MAX_PIXELS} in all")
            }
            Self::Count { values } => write!(f, "has {values} values, not one for each pixel"),
        }
    }
}

impl std::error::Error for FrameError {}

impl Gray {
    /// A frame from its values.
    ///
    /// # Errors
    /// [`FrameError::Size`] or [`FrameError::Count`].
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self, FrameError> {
        let count = width.checked_mul(height).filter(|count| (1..=MAX_PIXELS).contains(count));
        match count {
            None => Err(FrameError::Size { width, height }),
            Some(count) if count != values.len() => Err(FrameError::Count { values: values.len() }),
            Some(_) => Ok(Self { width, height, values }),
        }
    }

    /// Reads a PNG of 8 or 16 bits. Of a colour picture the green channel is taken, for which the constants give the
    /// refractive indices; transparency is passed over.
    ///
    /// # Errors
    /// [`FrameError`] for what is no such picture or has no sensible size.
    pub fn from_png(bytes: &[u8]) -> Result<Self, FrameError> {
        let fault = |error: png::DecodingError| FrameError::NotPng(error.to_string());
        let limits = png::Limits { bytes: 8 * MAX_PIXELS };
        let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
        // Palettes and fewer than 8 bits become 8 bits a channel.
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().map_err(fault)?;
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        if width.checked_mul(height).is_none_or(|count| count == 0 || count > MAX_PIXELS) {
            return Err(FrameError::Size { width, height });
        }
        let Some(size) = reader.output_buffer_size() else { return Err(FrameError::Size { width, height }) };
        let mut raw = vec![0; size];
        let info = reader.next_frame(&mut raw).map_err(fault)?;
        let channels = info.color_type.samples();
        let wanted = usize::from(channels >= 3);
        let wide = info.bit_depth == png::BitDepth::Sixteen;
        let per_sample = if wide { 2 } else { 1 };
        let value = |row: &[u8], x: usize| {
            let at = (x * channels + wanted) * per_sample;
            match (row.get(at), row.get(at + 1)) {
                (Some(high), Some(low)) if wide => f32::from(u16::from_be_bytes([*high, *low])) / 65535.0,
                (Some(byte), _) => f32::from(*byte) / 255.0,
                (None, _) => 0.0,
            }
        };
        let values = raw
            .chunks(info.line_size.max(1))
            .take(height)
            .flat_map(|row| (0..width).map(move |x| value(row, x)))
            .collect();
        Self::new(width, height, values)
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The value of a pixel; beyond the border, that of the nearest pixel.
    pub fn at(&self, x: isize, y: isize) -> f32 {
        let inside = |v: isize, end: usize| v.clamp(0, end as isize - 1) as usize;
        self.values[inside(y, self.height) * self.width + inside(x, self.width)]
    }

    /// Convolved with a Gaussian of this standard deviation (px), cut at three of them; the border continues its
    /// nearest pixels. A deviation of 0 or less changes nothing.
    pub fn blurred(&self, sd_px: f64) -> Self {
        if !(sd_px > 0.0 && sd_px.is_finite()) {
            return self.clone();
        }
        let reach = (3.0 * sd_px).ceil().min(self.width.max(self.height) as f64) as isize;
        let weight = |k: isize| (-0.5 * (k as f64 / sd_px).powi(2)).exp();
        let sum: f64 = (-reach..=reach).map(weight).sum();
        let kernel: Vec<(isize, f32)> = (-reach..=reach).map(|k| (k, (weight(k) / sum) as f32)).collect();
        let along = |from: &Self, dx: isize, dy: isize| {
            let mut values = Vec::with_capacity(from.values.len());
            for y in 0..from.height as isize {
                for x in 0..from.width as isize {
                    values.push(kernel.iter().map(|(k, w)| w * from.at(x + k * dx, y + k * dy)).sum());
                }
            }
            Self { values, ..*from }
        };
        along(&along(self, 1, 0), 0, 1)
    }
}
