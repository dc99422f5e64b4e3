//! Pictures: linear light while effects work on them, bytes at the end.

/// A picture in linear light: one plane (grey) or three (red, green, blue), rows from the top; 1 is full scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    width: usize,
    height: usize,
    /// The planes, each `width * height` values long.
    pub planes: Vec<Vec<f32>>,
}

impl Frame {
    /// A dark picture of 1 or 3 planes.
    pub fn new(width: usize, height: usize, planes: usize) -> Self {
        Self { width, height, planes: vec![vec![0.0; width * height]; planes] }
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The code of each value: `255 value^(1/gamma)`, rounded, as interleaved bytes.
    pub fn encode(&self, gamma: f64) -> Image8 {
        let code = |value: f32| {
            let clear = f64::from(value).clamp(0.0, 1.0);
            let level = if gamma == 1.0 { clear } else { clear.powf(1.0 / gamma) };
            // In range by the clamp; NaN, which no pass gives, would become 0.
            (255.0 * level + 0.5) as u8
        };
        let mut bytes = vec![0; self.width * self.height * self.planes.len()];
        for (channel, plane) in self.planes.iter().enumerate() {
            let places = bytes.iter_mut().skip(channel).step_by(self.planes.len());
            for (byte, value) in places.zip(plane) {
                *byte = code(*value);
            }
        }
        Image8 { width: self.width, height: self.height, channels: self.planes.len(), bytes }
    }
}

/// A coded picture: rows from the top, the channels (1 grey, or 3 red, green, blue) interleaved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image8 {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// 1 or 3.
    pub channels: usize,
    /// `width * height * channels` bytes.
    pub bytes: Vec<u8>,
}
