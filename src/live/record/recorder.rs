//! The file of a recording.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Write;

use glam::DVec3;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{WriteOptions, Writer};

use super::cdr::Cdr;
use super::messages::{self, Header};
use super::schemas::{
    COMPRESSED_IMAGE, DIAGNOSTICS, FLOAT64, IMAGE, POINT_CLOUD, POSE, Schema, TRANSFORMS, WRENCH,
};
use crate::decode::PictureFormat;
use domecast_optics::numeric::Rigid;
use domecast_runtime::constants::{BlackDot, Constants};
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, Springs, Tracked, Tracker};

/// A chunk is written once it holds so many bytes: what a kill may cost is less than a second of frames.
pub const MCAP_CHUNK_BYTES: u64 = 1 << 20;
/// A chunk is written at least every so often, by the frames' times.
const MAX_CHUNK_NS: u64 = 500_000_000;

const REST: &str = "domecast_rest";
const SENSOR: &str = "domecast_sensor";
const WRENCH_FRAME: &str = "domecast_wrench";
const CAMERA: &str = "domecast_camera";

const SCALARS: [&str; 6] = [
    "/domecast/wrench/force_x_n",
    "/domecast/wrench/force_y_n",
    "/domecast/wrench/force_z_n",
    "/domecast/wrench/moment_x_nmm",
    "/domecast/wrench/moment_y_nmm",
    "/domecast/wrench/moment_z_nmm",
];

/// Why a recording does not go on.
#[derive(Debug)]
pub struct McapError(mcap::McapError);

impl fmt::Display for McapError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // what the system says (a full disk), not that it said something
        match &self.0 {
            mcap::McapError::Io(error) => write!(f, "the recording cannot be written ({error})"),
            other => write!(f, "the recording cannot be written ({other})"),
        }
    }
}

impl std::error::Error for McapError {}

impl From<mcap::McapError> for McapError {
    fn from(error: mcap::McapError) -> Self {
        Self(error)
    }
}

/// The frame that is recorded.
#[derive(Debug, Clone, Copy)]
pub enum RecordedPicture<'a> {
    /// As its file or camera has it.
    Encoded(PictureFormat, &'a [u8]),
    /// Its pixels.
    Pixels(CameraFrame<'a>),
    /// There was none that could be read.
    None,
}

/// Channels of the file; those of pictures are there once they are used.
#[derive(Debug)]
struct Channels {
    wrench: u16,
    scalars: [u16; 6],
    pose: u16,
    transforms: u16,
    dots: u16,
    status: u16,
}

/// Writes what frames say, a frame at a time.
pub struct McapRecorder<W: Write> {
    writer: Writer<NoSeek<W>>,
    channels: Channels,
    cdr: Cdr,
    design: String,
    dots: Vec<BlackDot>,
    /// Frames that stay where they are at rest: moments are about the first one's origin.
    fixed: [(&'static str, Rigid); 2],
    sequence: u32,
    /// Bytes of messages in the chunk that is not written yet.
    pending: u64,
    last_ns: Option<u64>,
    chunk_ns: u64,
}

fn add<W: Write>(writer: &mut Writer<NoSeek<W>>, topic: &str, schema: &Schema) -> Result<u16, McapError> {
    let id = writer.add_schema(schema.name, "ros2msg", schema.text().as_bytes())?;
    Ok(writer.add_channel(id, topic, "cdr", &BTreeMap::new())?)
}

impl<W: Write> McapRecorder<W> {
    /// Begins a recording of the sensor of the constants, which the tracker follows.
    ///
    /// # Errors
    /// [`McapError`]: the system refuses.
    pub fn new(to: W, constants: &Constants, tracker: &Tracker) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("domecast ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            .chunk_size(None)
            // without it the length of a chunk is written after the chunk, and one that is cut off ends the reading
            .disable_seeking(true);
        let mut writer = options.create(NoSeek::new(to))?;
        let mut scalars = [0; 6];
        for (channel, topic) in scalars.iter_mut().zip(SCALARS) {
            *channel = add(&mut writer, topic, &FLOAT64)?;
        }
        let channels = Channels {
            wrench: add(&mut writer, "/domecast/wrench", &WRENCH)?,
            scalars,
            pose: add(&mut writer, "/domecast/pose", &POSE)?,
            transforms: add(&mut writer, "/tf", &TRANSFORMS)?,
            dots: add(&mut writer, "/domecast/dots", &POINT_CLOUD)?,
            status: add(&mut writer, "/domecast/status", &DIAGNOSTICS)?,
        };
        writer.flush()?;
        Ok(Self {
            writer,
            channels,
            cdr: Cdr::default(),
            design: constants.design.clone(),
            dots: constants.black_dots.clone(),
            fixed: [
                (
                    WRENCH_FRAME,
                    Rigid::from_translation(tracker.springs().map_or(DVec3::ZERO, Springs::at_mm)),
                ),
                (CAMERA, *tracker.optics().rest_from_camera()),
            ],
            sequence: 0,
            pending: 0,
            last_ns: None,
            chunk_ns: 0,
        })
    }

    /// Records a frame at a time since 1970, ns; the skin where it was measured. Times that do not rise are moved on to the
    /// first that does.
    ///
    /// # Errors
    /// [`McapError`]: the system refuses, as on a full disk.
    pub fn write(
        &mut self,
        time_ns: u64,
        picture: RecordedPicture<'_>,
        tracked: &Tracked,
        skin: Option<&ShapeMap>,
    ) -> Result<(), McapError> {
        let time_ns = self.last_ns.map_or(time_ns, |last| time_ns.max(last.saturating_add(1)));
        let began_ns = if self.last_ns.is_none() { time_ns } else { self.chunk_ns };
        self.last_ns = Some(time_ns);
        self.sequence = self.sequence.wrapping_add(1);
        let of = |frame_id| Header { time_ns, frame_id };
        match picture {
            RecordedPicture::Encoded(format, bytes) => {
                messages::compressed_image(&mut self.cdr, of(CAMERA), format.as_str(), bytes);
                self.put_on("/domecast/image/compressed", &COMPRESSED_IMAGE, time_ns)?;
            }
            RecordedPicture::Pixels(frame) => {
                messages::image(&mut self.cdr, of(CAMERA), &frame);
                self.put_on("/domecast/image", &IMAGE, time_ns)?;
            }
            RecordedPicture::None => {}
        }
        if let Some(skin) = skin {
            self.write_height(time_ns, skin)?;
        }
        self.write_motion(time_ns, tracked)?;
        messages::dots(&mut self.cdr, of(SENSOR), &self.dots, &tracked.black_dots);
        self.put(self.channels.dots, time_ns)?;
        messages::diagnostics(&mut self.cdr, of(SENSOR), &self.design, tracked);
        self.put(self.channels.status, time_ns)?;
        self.chunk_ns = began_ns;
        if self.pending >= MCAP_CHUNK_BYTES || time_ns.saturating_sub(began_ns) >= MAX_CHUNK_NS {
            self.flush()?;
            self.chunk_ns = time_ns;
        }
        Ok(())
    }

    /// Records the skin of a frame that may be recorded already: with its time, ns since 1970.
    ///
    /// # Errors
    /// [`McapError`].
    pub fn write_height(&mut self, time_ns: u64, skin: &ShapeMap) -> Result<(), McapError> {
        messages::height_image(&mut self.cdr, Header { time_ns, frame_id: CAMERA }, skin);
        self.put_on("/domecast/height", &IMAGE, time_ns)
    }

    /// Wrench and pose, where the frame has them.
    fn write_motion(&mut self, time_ns: u64, tracked: &Tracked) -> Result<(), McapError> {
        let of = |frame_id| Header { time_ns, frame_id };
        if let Some(wrench) = &tracked.wrench {
            messages::wrench(&mut self.cdr, of(WRENCH_FRAME), wrench);
            self.put(self.channels.wrench, time_ns)?;
            for (axis, value) in wrench.to_array().into_iter().enumerate() {
                messages::float64(&mut self.cdr, value);
                self.put(self.channels.scalars[axis], time_ns)?;
            }
        }
        let [wrench, camera] = self.fixed;
        let Some(pose) = &tracked.pose else {
            messages::transforms(&mut self.cdr, of(REST), &self.fixed);
            return self.put(self.channels.transforms, time_ns);
        };
        messages::pose(&mut self.cdr, of(REST), pose);
        self.put(self.channels.pose, time_ns)?;
        messages::transforms(&mut self.cdr, of(REST), &[wrench, camera, (SENSOR, *pose)]);
        self.put(self.channels.transforms, time_ns)
    }

    fn put_on(&mut self, topic: &str, schema: &Schema, time_ns: u64) -> Result<(), McapError> {
        let channel = add(&mut self.writer, topic, schema)?;
        self.put(channel, time_ns)
    }

    fn put(&mut self, channel_id: u16, time_ns: u64) -> Result<(), McapError> {
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time: time_ns, publish_time: time_ns };
        self.pending += self.cdr.bytes().len() as u64;
        Ok(self.writer.write_to_known_channel(&header, self.cdr.bytes())?)
    }

    /// Ends the chunk, so that all so far is read whatever happens.
    ///
    /// # Errors
    /// [`McapError`].
    pub fn flush(&mut self) -> Result<(), McapError> {
        self.pending = 0;
        Ok(self.writer.flush()?)
    }

    /// Ends the recording with its index and summary, and returns where it was written to.
    ///
    /// # Errors
    /// [`McapError`].
    pub fn finish(mut self) -> Result<W, McapError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}
