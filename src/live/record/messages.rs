//! What a frame says, as ROS 2 messages. Lengths are metres and torques N m there (REP 103), whatever domecast's own files have.

use glam::{DMat3, DQuat, DVec3};

use super::cdr::Cdr;
use domecast_optics::numeric::Rigid;
use domecast_runtime::constants::BlackDot;
use domecast_runtime::shape::ShapeMap;
use domecast_runtime::track::{CameraFrame, DotResult, MarkState, Tracked};
use domecast_springs::Wrench;

/// Metres of a millimetre; also N m of a N mm.
const M_PER_MM: f64 = 1e-3;
const NS_PER_S: u64 = 1_000_000_000;

/// When and in which frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Header<'a> {
    pub time_ns: u64,
    pub frame_id: &'a str,
}

fn header(cdr: &mut Cdr, of: Header<'_>) {
    cdr.begin();
    stamp(cdr, of);
}

fn stamp(cdr: &mut Cdr, of: Header<'_>) {
    // A clock past the year 2038 ends in what the message can say.
    cdr.i32(i32::try_from(of.time_ns / NS_PER_S).unwrap_or(i32::MAX));
    cdr.u32((of.time_ns % NS_PER_S) as u32);
    cdr.string(of.frame_id);
}

pub(super) fn float64(cdr: &mut Cdr, value: f64) {
    cdr.begin();
    cdr.f64(value);
}

/// A picture as its file has it: `png` or `jpeg`.
pub(super) fn compressed_image(cdr: &mut Cdr, of: Header<'_>, format: &str, bytes: &[u8]) {
    header(cdr, of);
    cdr.string(format);
    cdr.blob(bytes);
}

/// Pixels: `mono8` or `rgb8`.
pub(super) fn image(cdr: &mut Cdr, of: Header<'_>, frame: &CameraFrame<'_>) {
    header(cdr, of);
    cdr.length(frame.height());
    cdr.length(frame.width());
    cdr.string(if frame.channels() == 3 { "rgb8" } else { "mono8" });
    cdr.u8(0);
    cdr.length(frame.width() * frame.channels());
    cdr.blob(frame.bytes());
}

/// The skin's heights, m from its shape at rest; NaN where nothing is known, as depth images have it (REP 118).
pub(super) fn height_image(cdr: &mut Cdr, of: Header<'_>, map: &ShapeMap) {
    header(cdr, of);
    cdr.length(map.height);
    cdr.length(map.width);
    cdr.string("32FC1");
    cdr.u8(0);
    cdr.length(4 * map.width);
    cdr.floats(map.height_mm.iter().map(|height_mm| (f64::from(*height_mm) * M_PER_MM) as f32));
}

fn vector(cdr: &mut Cdr, v: DVec3) {
    for value in v.to_array() {
        cdr.f64(value);
    }
}

pub(super) fn wrench(cdr: &mut Cdr, of: Header<'_>, wrench: &Wrench) {
    header(cdr, of);
    vector(cdr, wrench.force_n);
    vector(cdr, wrench.moment_nmm * M_PER_MM);
}

/// Place in metres, then the quaternion x, y, z, w: the fields of a pose and of a transform.
fn motion(cdr: &mut Cdr, motion: &Rigid) {
    let rows = motion.to_rows_4x4();
    vector(cdr, DVec3::new(rows[0][3], rows[1][3], rows[2][3]) * M_PER_MM);
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    let turn = DQuat::from_mat3(&DMat3::from_cols(column(0), column(1), column(2))).normalize();
    for value in turn.to_array() {
        cdr.f64(value);
    }
}

pub(super) fn pose(cdr: &mut Cdr, of: Header<'_>, pose: &Rigid) {
    header(cdr, of);
    motion(cdr, pose);
}

/// Where frames are in that of the header.
pub(super) fn transforms(cdr: &mut Cdr, of: Header<'_>, children: &[(&str, Rigid)]) {
    cdr.begin();
    cdr.length(children.len());
    for (child, parent_from_child) in children {
        stamp(cdr, of);
        cdr.string(child);
        motion(cdr, parent_from_child);
    }
}

/// `sensor_msgs/PointField`'s names of types.
const UINT8: u8 = 2;
const UINT32: u8 = 6;
const FLOAT32: u8 = 7;
const POINT_FIELDS: [(&str, u32, u8); 8] = [
    ("x", 0, FLOAT32),
    ("y", 4, FLOAT32),
    ("z", 8, FLOAT32),
    ("dx", 12, FLOAT32),
    ("dy", 16, FLOAT32),
    ("dz", 20, FLOAT32),
    ("id", 24, UINT32),
    ("state", 28, UINT8),
];
const POINT_BYTES: usize = 32;

/// The number of a state in a point cloud.
fn state_number(state: MarkState) -> u8 {
    match state {
        MarkState::Ok => 0,
        MarkState::Missing => 1,
        MarkState::Lost => 2,
        MarkState::Merged => 3,
        MarkState::IdentityUnsure => 4,
        MarkState::Dirty => 5,
        MarkState::Smeared => 6,
        MarkState::Glare => 7,
        MarkState::PartlyHidden => 8,
        MarkState::Hidden => 9,
    }
}

/// Dots: `x`, `y`, `z` where each is at rest, `dx`, `dy`, `dz` its displacement (m; NaN where it is not measured), `id`,
/// `state`.
pub(super) fn dots(cdr: &mut Cdr, of: Header<'_>, at_rest: &[BlackDot], dots: &[DotResult]) {
    let count = at_rest.len().min(dots.len());
    header(cdr, of);
    cdr.u32(1);
    cdr.length(count);
    cdr.length(POINT_FIELDS.len());
    for (name, offset, datatype) in POINT_FIELDS {
        cdr.string(name);
        cdr.u32(offset);
        cdr.u8(datatype);
        cdr.u32(1);
    }
    cdr.bool(false);
    cdr.length(POINT_BYTES);
    cdr.length(POINT_BYTES * count);
    cdr.length(POINT_BYTES * count);
    for (rest, dot) in at_rest.iter().zip(dots) {
        let moved_mm = dot.displacement_mm.map_or([f64::NAN; 3], |d| d.to_array());
        for value_mm in rest.surface_mm.into_iter().chain(moved_mm) {
            for byte in ((value_mm * M_PER_MM) as f32).to_le_bytes() {
                cdr.u8(byte);
            }
        }
        for byte in dot.id.to_le_bytes() {
            cdr.u8(byte);
        }
        for byte in [state_number(dot.state), 0, 0, 0] {
            cdr.u8(byte);
        }
    }
    cdr.bool(false);
}

/// The frame's status: OK; a warning where there are numbers all the same; an error where there is no pose.
pub(super) fn diagnostics(cdr: &mut Cdr, of: Header<'_>, design: &str, tracked: &Tracked) {
    let is_ok = tracked.problems.is_empty();
    let level = if is_ok {
        0
    } else if tracked.pose.is_some() {
        1
    } else {
        2
    };
    let problems: Vec<&str> = tracked.problems.iter().map(|problem| problem.as_str()).collect();
    let mut values = vec![
        ("frame", tracked.frame.to_string()),
        ("problems", problems.join(",")),
        ("dots_ok", tracked.count(MarkState::Ok).to_string()),
        ("dots", tracked.black_dots.len().to_string()),
    ];
    values.extend(tracked.pose_rms_px.map(|rms_px| ("pose_rms_px", format!("{rms_px:.4}"))));
    header(cdr, of);
    cdr.length(1);
    cdr.u8(level);
    cdr.string("domecast");
    cdr.string(tracked.status());
    cdr.string(design);
    cdr.length(values.len());
    for (key, value) in values {
        cdr.string(key);
        cdr.string(&value);
    }
}
