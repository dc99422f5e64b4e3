//! A network that is ready to run: steps over buffers that were laid out once.
//!
//! Some of the steps see one frame alone (its picture, its readings); the others see what these made of the last frames.
//! So a new frame costs one frame's steps and the few of the window, not those of all its frames.

use crate::kernels::{Conv, Gru, Linear, Map, MaxPool, average, softmax};

/// Which of the buffers.
pub(crate) type Slot = usize;

/// What a buffer holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Shape {
    /// A picture-like value of one frame.
    Map(Map),
    /// A list of numbers of one frame.
    Row(usize),
    /// A value of the window, its sides the slowest first.
    Window(Vec<usize>),
}

impl Shape {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Map(map) => map.len(),
            Self::Row(count) => *count,
            Self::Window(sides) => sides.iter().product(),
        }
    }
}

/// One operation on buffers; the last slot is that of its result.
#[derive(Debug, Clone)]
pub(crate) enum Step {
    Conv(Conv, Slot, Slot),
    MaxPool(MaxPool, Slot, Slot),
    Average(Map, Slot, Slot),
    Linear(Linear, Slot, Slot),
    Gru(Box<Gru>, Slot, Slot),
    /// Values of two maps (of their own borders) are added.
    AddMaps {
        maps: [Map; 3],
        from: [Slot; 2],
        to: Slot,
        relu: bool,
    },
    Relu(Slot, Slot),
    /// Lists one after the other.
    Concat(Vec<Slot>, Slot),
    /// The oldest row goes, the frame's comes in at the end.
    Remember(Slot, Slot),
    /// Some of the numbers, from a first one on.
    Part(Slot, usize, Slot),
    /// The mean over the first side.
    MeanOfRows(Slot, Slot),
    SumOfSquares(Slot, Slot),
    Softmax(Slot, Slot),
}

impl Step {
    /// Where the result goes.
    pub(crate) fn target(&self) -> Slot {
        match self {
            Self::Conv(_, _, to)
            | Self::MaxPool(_, _, to)
            | Self::Average(_, _, to)
            | Self::Linear(_, _, to)
            | Self::Gru(_, _, to)
            | Self::AddMaps { to, .. }
            | Self::Relu(_, to)
            | Self::Concat(_, to)
            | Self::Remember(_, to)
            | Self::Part(_, _, to)
            | Self::MeanOfRows(_, to)
            | Self::SumOfSquares(_, to)
            | Self::Softmax(_, to) => *to,
        }
    }

    fn run(&mut self, buffers: &mut [Vec<f32>]) {
        let to = self.target();
        let mut out = std::mem::take(&mut buffers[to]);
        match self {
            Self::Conv(conv, from, _) => conv.run(&buffers[*from], &mut out),
            Self::MaxPool(pool, from, _) => pool.run(&buffers[*from], &mut out),
            Self::Average(map, from, _) => average(map, &buffers[*from], &mut out),
            Self::Linear(linear, from, _) => linear.run(&buffers[*from], &mut out),
            Self::Gru(gru, from, _) => gru.run(&buffers[*from], &mut out),
            Self::AddMaps { maps: [a, b, sum], from, relu, .. } => {
                let floor = if *relu { 0.0 } else { f32::NEG_INFINITY };
                for row in 0..sum.height {
                    let (a, b) = (&buffers[from[0]][a.row(row)], &buffers[from[1]][b.row(row)]);
                    for ((out, a), b) in out[sum.row(row)].iter_mut().zip(a).zip(b) {
                        *out = (a + b).max(floor);
                    }
                }
            }
            Self::Relu(from, _) => {
                out.iter_mut().zip(&buffers[*from]).for_each(|(out, value)| *out = value.max(0.0));
            }
            Self::Concat(from, _) => {
                let mut at = 0;
                for part in from.iter().map(|slot| &buffers[*slot]) {
                    out[at..at + part.len()].copy_from_slice(part);
                    at += part.len();
                }
            }
            Self::Remember(from, _) => {
                let row = &buffers[*from];
                out.copy_within(row.len().., 0);
                let last = out.len() - row.len();
                out[last..].copy_from_slice(row);
            }
            Self::Part(from, first, _) => {
                let count = out.len();
                out.copy_from_slice(&buffers[*from][*first..*first + count]);
            }
            Self::MeanOfRows(from, _) => {
                let rows = buffers[*from].len() / out.len();
                out.fill(0.0);
                for row in buffers[*from].chunks_exact(out.len()) {
                    out.iter_mut().zip(row).for_each(|(out, value)| *out += value);
                }
                out.iter_mut().for_each(|out| *out /= rows as f32);
            }
            Self::SumOfSquares(from, _) => out[0] = buffers[*from].iter().map(|value| value * value).sum(),
            Self::Softmax(from, _) => softmax(&buffers[*from], &mut out),
        }
        buffers[to] = out;
    }
}

/// A network of a fixed window of frames.
#[derive(Debug, Clone)]
pub struct Network {
    pub(crate) buffers: Vec<Vec<f32>>,
    pub(crate) frame_steps: Vec<Step>,
    pub(crate) window_steps: Vec<Step>,
    pub(crate) picture: Option<(Map, Slot)>,
    pub(crate) readings: Option<Slot>,
    pub(crate) outputs: Vec<(String, Slot)>,
    pub(crate) window: usize,
    pub(crate) frames: usize,
}

impl Network {
    /// Frames of the window.
    pub fn window(&self) -> usize {
        self.window
    }

    /// Sides of the picture, `[channels, height, width]`, where the network sees one.
    pub fn picture_dims(&self) -> Option<[usize; 3]> {
        self.picture.map(|(map, _)| [map.channels, map.height, map.width])
    }

    /// How many readings of a frame the network sees.
    pub fn readings_count(&self) -> usize {
        self.readings.map_or(0, |slot| self.buffers[slot].len())
    }

    /// Takes the next frame in: its picture, `[row][column][channel]`, and its readings. Both are as long as
    /// [`Network::picture_dims`] and [`Network::readings_count`] say, or empty where the network sees none; numbers that are
    /// missing count as zero, more are left out. Nothing is allocated.
    pub fn push(&mut self, picture: &[f32], readings: &[f32]) {
        if let Some((map, slot)) = self.picture {
            let rows = picture.chunks_exact(map.width * map.channels);
            for (row, pixels) in rows.take(map.height).enumerate() {
                self.buffers[slot][map.row(row)].copy_from_slice(pixels);
            }
        }
        if let Some(slot) = self.readings {
            self.buffers[slot].iter_mut().zip(readings).for_each(|(to, value)| *to = *value);
        }
        self.frame_steps.iter_mut().for_each(|step| step.run(&mut self.buffers));
        self.frames = (self.frames + 1).min(self.window);
    }

    /// Forgets the frames.
    pub fn restart(&mut self) {
        self.frames = 0;
    }

    /// Runs the window, once it is full. Nothing is allocated.
    pub fn run(&mut self) -> bool {
        let full = self.frames == self.window;
        if full {
            self.window_steps.iter_mut().for_each(|step| step.run(&mut self.buffers));
        }
        full
    }

    /// An output of the last run.
    pub fn output(&self, name: &str) -> Option<&[f32]> {
        let (_, slot) = self.outputs.iter().find(|(other, _)| other == name)?;
        Some(&self.buffers[*slot])
    }
}
