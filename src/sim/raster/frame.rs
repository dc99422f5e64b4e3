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
        self.encode_into(gamma, Vec::new())
    }

    /// [`Frame::encode`] in room that is there already; what it holds does not matter.
    pub fn encode_into(&self, gamma: f64, mut bytes: Vec<u8>) -> Image8 {
        let coder = Coder::new(gamma);
        bytes.resize(self.width * self.height * self.planes.len(), 0);
        match self.planes.as_slice() {
            [red, green, blue] => {
                // In runs that stay in the nearest cache: codes first, channel by channel, then woven, four pixels into
                // three words.
                let mut codes = [[0_u32; RUN]; 3];
                let (mut colour, mut even) = ([0; 3], [0_u8; 3 * RUN]);
                let runs = red.chunks(RUN).zip(green.chunks(RUN)).zip(blue.chunks(RUN));
                for (pixels, ((red, green), blue)) in bytes.chunks_mut(3 * RUN).zip(runs) {
                    // Beside the sensor there is one colour.
                    if let (Some(red), Some(green), Some(blue)) = (only(red), only(green), only(blue)) {
                        let found = [red, green, blue].map(|value| coder.code(value));
                        if found != colour {
                            colour = found;
                            even.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
                        }
                        pixels.iter_mut().zip(&even).for_each(|(byte, code)| *byte = *code);
                        continue;
                    }
                    for (codes, values) in codes.iter_mut().zip([red, green, blue]) {
                        coder.fill(values, codes);
                    }
                    let [red, green, blue] = &mut codes;
                    for ((r, g), b) in red.iter_mut().zip(&*green).zip(&*blue) {
                        *r |= g << 8 | b << 16;
                    }
                    let count = pixels.len() / 3;
                    let mut words = pixels.chunks_exact_mut(12);
                    for (pixels, four) in (&mut words).zip(red.chunks_exact(4)) {
                        let three = [
                            four[0] | four[1] << 24,
                            four[1] >> 8 | four[2] << 16,
                            four[2] >> 16 | four[3] << 8,
                        ];
                        for (pixel, word) in pixels.chunks_exact_mut(4).zip(three) {
                            pixel.copy_from_slice(&word.to_le_bytes());
                        }
                    }
                    let last = words.into_remainder().chunks_exact_mut(3);
                    let left = last.len();
                    for (pixel, code) in last.zip(red.iter().skip(count - left)) {
                        pixel.copy_from_slice(&code.to_le_bytes()[..3]);
                    }
                }
            }
            [grey] => {
                let mut codes = [0_u32; RUN];
                for (bytes, values) in bytes.chunks_mut(RUN).zip(grey.chunks(RUN)) {
                    coder.fill(values, &mut codes);
                    bytes.iter_mut().zip(&codes).for_each(|(byte, code)| *byte = *code as u8);
                }
            }
            planes => {
                for (channel, plane) in planes.iter().enumerate() {
                    let places = bytes.iter_mut().skip(channel).step_by(planes.len());
                    for (byte, value) in places.zip(plane) {
                        *byte = coder.code(*value);
                    }
                }
            }
        }
        Image8 { width: self.width, height: self.height, channels: self.planes.len(), bytes }
    }
}

/// Pixels that are coded at a time.
const RUN: usize = 128;

/// The value of a run that has but one.
fn only(values: &[f32]) -> Option<f32> {
    let (first, last) = (values.first()?, values.last()?);
    // Most others differ at their ends.
    let differs = |value: &f32| u32::from(value.to_bits() != first.to_bits());
    (differs(last) == 0 && values.iter().map(differs).sum::<u32>() == 0).then_some(*first)
}

/// 2^23: a number from 0 to it, added to it, leaves its nearest whole number, and that in the lowest bits.
const WHOLE: f32 = 8_388_608.0;

/// From light to code: 255, and two roundings more, so that what lies half way between two codes goes to the upper one.
const SCALE: f32 = 255.0 * (1.0 + 2.0 * f32::EPSILON);

/// From light to code.
enum Coder {
    Linear,
    /// The light at which each code begins, and the code at the start of each of 1024 equal parts of the scale:
    /// few steps from there lead to the exact one.
    Power {
        begins: Box<[f32; 256]>,
        start: Box<[u8; PARTS + 1]>,
    },
}

const PARTS: usize = 1024;

impl Coder {
    fn new(gamma: f64) -> Self {
        if gamma == 1.0 {
            return Self::Linear;
        }
        let begin = |code: usize| ((code as f64 - 0.5).max(0.0) / 255.0).powf(gamma) as f32;
        let begins: Box<[f32; 256]> = Box::new(std::array::from_fn(begin));
        let code_of = |part: usize| {
            let value = part as f32 / PARTS as f32;
            begins.partition_point(|begin| *begin <= value).saturating_sub(1) as u8
        };
        let start = Box::new(std::array::from_fn(code_of));
        Self::Power { begins, start }
    }

    /// The codes of some values.
    fn fill(&self, values: &[f32], codes: &mut [u32]) {
        match self {
            // As in `code`, in steps that machines do several of at once.
            Self::Linear => {
                for (code, value) in codes.iter_mut().zip(values) {
                    // Two plain choices, of which NaN takes the darker, are one step of a machine each.
                    let clear = if *value > 0.0 { *value } else { 0.0 };
                    let clear = if clear < 1.0 { clear } else { 1.0 };
                    *code = (SCALE * clear + WHOLE).to_bits() & 0xff;
                }
            }
            Self::Power { .. } => {
                for (code, value) in codes.iter_mut().zip(values) {
                    *code = u32::from(self.code(*value));
                }
            }
        }
    }

    /// NaN, which no pass gives, becomes 0.
    #[inline]
    fn code(&self, value: f32) -> u8 {
        let clear = value.clamp(0.0, 1.0);
        match self {
            Self::Linear => (SCALE * clear + WHOLE).to_bits() as u8,
            Self::Power { begins, start } => {
                let part = (clear * PARTS as f32) as usize;
                let mut code = start.get(part).copied().unwrap_or(0);
                while code < 255 && begins.get(usize::from(code) + 1).is_some_and(|begin| *begin <= clear) {
                    code += 1;
                }
                code
            }
        }
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
