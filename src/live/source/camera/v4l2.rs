//! Cameras of Linux.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

use linuxvideo::controls::Cid;
use linuxvideo::format::{FrameSizes, PixFormat, PixelFormat};
use linuxvideo::stream::ReadStream;
use linuxvideo::{BufType, CapabilityFlags, Device, Fract};

use super::request::CameraRequest;
use crate::source::controls::{CameraControls, ControlId, ControlRange, lock_controls};
use crate::source::{ArrivedFrame, FrameData, LiveSource, SourceInfo, SourceLost};

/// A rate that is this much of the wanted one is it.
const ENOUGH_RATE: f64 = 0.9;

/// A camera that gives frames.
pub struct V4l2Camera {
    path: PathBuf,
    request: CameraRequest,
    stream: Option<ReadStream>,
    layout: Layout,
    info: SourceInfo,
    began: Instant,
    next: u64,
}

/// How its frames lie in memory.
#[derive(Debug, Clone, Copy)]
struct Layout {
    width: usize,
    height: usize,
    line_bytes: usize,
    is_jpeg: bool,
}

/// A format of the camera that we can decode: the raw one first, for what JPEG takes from dots.
const FORMATS: [(PixelFormat, &str); 2] = [(PixelFormat::YUYV, "yuyv"), (PixelFormat::MJPG, "mjpeg")];

impl V4l2Camera {
    pub fn open(path: &Path, request: CameraRequest) -> Result<Self, String> {
        let (stream, layout, info) = start(path, &request)?;
        let (path, began) = (path.to_path_buf(), Instant::now());
        Ok(Self { path, request, stream: Some(stream), layout, info, began, next: 0 })
    }
}

fn device_of(path: &Path) -> Result<Device, String> {
    let device = Device::open(path).map_err(|error| format!("cannot be opened as a camera ({error})"))?;
    let about = device.capabilities().map_err(|error| format!("does not say what it is ({error})"))?;
    if about.device_capabilities().contains(CapabilityFlags::VIDEO_CAPTURE) {
        Ok(device)
    } else {
        Err("captures no video: a camera often has a second device for its data; try the one before it"
            .into())
    }
}

/// Starts the stream in the best format that has the size, and locks the controls.
fn start(path: &Path, request: &CameraRequest) -> Result<(ReadStream, Layout, SourceInfo), String> {
    let [width, height] = request.size;
    let mut best: Option<(f64, PixelFormat, &'static str)> = None;
    let offered: Vec<PixelFormat> = device_of(path)?
        .formats(BufType::VIDEO_CAPTURE)
        .filter_map(|format| Some(format.ok()?.pixel_format()))
        .collect();
    for (pixel_format, name) in FORMATS.into_iter().filter(|(format, _)| offered.contains(format)) {
        let Ok(capture) = device_of(path)?.video_capture(PixFormat::new(width, height, pixel_format)) else {
            continue;
        };
        let given = capture.format();
        if (given.width(), given.height(), given.pixel_format()) != (width, height, pixel_format) {
            continue;
        }
        let rate_hz = rate_of(capture.set_frame_interval(interval(request.rate_hz)).ok(), request.rate_hz);
        if best.is_none_or(|(best_hz, ..)| best_hz < ENOUGH_RATE * request.rate_hz && rate_hz > best_hz) {
            best = Some((rate_hz, pixel_format, name));
        }
    }
    let Some((_, pixel_format, format)) = best else {
        return Err(no_such_size(path, &offered, request.size));
    };
    let system = |error: std::io::Error| format!("does not start ({error})");
    let device = device_of(path)?;
    let name = device.capabilities().map(|about| about.card().to_owned()).unwrap_or_default();
    let capture = device.video_capture(PixFormat::new(width, height, pixel_format)).map_err(system)?;
    let rate_hz = rate_of(capture.set_frame_interval(interval(request.rate_hz)).ok(), request.rate_hz);
    let given = capture.format();
    let layout = Layout {
        width: given.width() as usize,
        height: given.height() as usize,
        line_bytes: given.bytes_per_line() as usize,
        is_jpeg: pixel_format == PixelFormat::MJPG,
    };
    let stream = capture.into_stream().map_err(system)?;
    // by a second handle and after the start: some cameras set their controls anew when they start
    let mut controls = Controls::of(device_of(path)?);
    let (controls, mut warnings) = lock_controls(&mut controls, &request.controls)?;
    if rate_hz < ENOUGH_RATE * request.rate_hz {
        warnings.push(format!("gives {rate_hz:.1} frames a second, not {:.1}", request.rate_hz));
    }
    let info = SourceInfo {
        name: if name.is_empty() { path.display().to_string() } else { name },
        size: Some([width as usize, height as usize]),
        format,
        rate_hz: Some(rate_hz),
        controls,
        warnings,
    };
    Ok((stream, layout, info))
}

fn interval(rate_hz: f64) -> Fract {
    Fract::new(1000, ((1000.0 * rate_hz) as u32).max(1))
}

/// The rate of an interval; of a camera that does not say, the one that is wanted.
fn rate_of(interval: Option<Fract>, wanted_hz: f64) -> f64 {
    let hz = |fract: Fract| f64::from(fract.denominator()) / f64::from(fract.numerator());
    interval.map(hz).filter(|hz| hz.is_finite() && *hz > 0.0).unwrap_or(wanted_hz)
}

/// What the camera has instead of the size.
fn no_such_size(path: &Path, offered: &[PixelFormat], size: [u32; 2]) -> String {
    let [width, height] = size;
    let mut sizes = BTreeSet::new();
    for (format, _) in FORMATS.into_iter().filter(|(format, _)| offered.contains(format)) {
        match device_of(path).ok().and_then(|device| device.frame_sizes(format).ok()) {
            Some(FrameSizes::Discrete(all)) => sizes.extend(all.iter().map(|s| (s.width(), s.height()))),
            Some(range) => sizes
                .extend([(range.min_width(), range.min_height()), (range.max_width(), range.max_height())]),
            None => {}
        }
    }
    if sizes.is_empty() {
        let formats: Vec<String> = offered.iter().map(ToString::to_string).collect();
        return format!(
            "gives neither YUYV nor MJPEG, only {}; convert it by ffmpeg, and read `-`",
            formats.join(", ")
        );
    }
    let sizes: Vec<String> = sizes.iter().map(|(w, h)| format!("{w}x{h}")).collect();
    format!(
        "does not give {width}x{height}, which the constants are of; it has {}: build or calibrate the sensor for one of these \
         (`camera.width` and `camera.height` of the design), or use the camera that it was built for",
        sizes.join(", ")
    )
}

/// The controls of a device.
struct Controls {
    device: Device,
    ranges: Vec<(Cid, ControlRange)>,
}

impl Controls {
    fn of(device: Device) -> Self {
        let range = |c: &linuxvideo::controls::ControlDesc| ControlRange {
            min: c.minimum(),
            max: c.maximum(),
            step: c.step(),
        };
        let ranges = device.controls().filter_map(Result::ok).map(|c| (c.id(), range(&c))).collect();
        Self { device, ranges }
    }
}

fn cid(id: ControlId) -> Cid {
    match id {
        ControlId::ExposureAuto => Cid::EXPOSURE_AUTO,
        ControlId::Exposure => Cid::EXPOSURE_ABSOLUTE,
        ControlId::ExposurePriority => Cid::EXPOSURE_AUTO_PRIORITY,
        ControlId::GainAuto => Cid::AUTOGAIN,
        ControlId::Gain => Cid::GAIN,
        ControlId::WhiteBalanceAuto => Cid::AUTO_WHITE_BALANCE,
        ControlId::WhiteBalance => Cid::WHITE_BALANCE_TEMPERATURE,
        ControlId::FocusAuto => Cid::FOCUS_AUTO,
    }
}

impl CameraControls for Controls {
    fn range(&self, id: ControlId) -> Option<ControlRange> {
        self.ranges.iter().find(|(of, _)| *of == cid(id)).map(|(_, range)| *range)
    }

    fn value(&self, id: ControlId) -> Result<i32, String> {
        self.device.read_control_raw(cid(id)).map_err(|error| error.to_string())
    }

    fn set(&mut self, id: ControlId, value: i32) -> Result<(), String> {
        self.device.write_control_raw(cid(id), value).map_err(|error| error.to_string())
    }
}

impl LiveSource for V4l2Camera {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<ArrivedFrame>, SourceLost> {
        let Some(stream) = &mut self.stream else { return Err(SourceLost("the device is gone".into())) };
        let read = stream.dequeue(|view| Ok((Instant::now(), view.is_error(), view.to_vec())));
        let (complete, is_damaged, bytes) = match read {
            Ok(read) => read,
            Err(error) => {
                self.stream = None;
                return Err(SourceLost(format!("the device is gone ({error})")));
            }
        };
        let number = self.next;
        self.next += 1;
        let Layout { width, height, line_bytes, is_jpeg } = self.layout;
        let data = if is_damaged {
            FrameData::Damaged("the camera says that the frame is damaged".into())
        } else if is_jpeg {
            FrameData::Jpeg(bytes.into())
        } else {
            FrameData::Yuyv { width, height, line_bytes, bytes: bytes.into() }
        };
        let file = match &data {
            FrameData::Jpeg(bytes) => Some(bytes.clone()),
            _ => None,
        };
        let time_s = complete.duration_since(self.began).as_secs_f64();
        Ok(Some(ArrivedFrame { number, time_s, complete, data, file }))
    }

    fn reopen(&mut self) -> Result<(), SourceLost> {
        self.stream = None;
        let (stream, layout, info) = start(&self.path, &self.request).map_err(SourceLost)?;
        (self.stream, self.layout, self.info) = (Some(stream), layout, info);
        Ok(())
    }
}
