//! Results as text: one JSON object or one line of CSV a frame.

use std::io::{self, Write};

use glam::{DVec2, DVec3};

use super::result::Tracked;
use crate::track::marks::MarkState;
use domecast_springs::{Displacement, Wrench};

/// First line of [`write_csv`]'s table.
pub const CSV_HEADER: &str = "frame,status,tx_mm,ty_mm,tz_mm,rx_rad,ry_rad,rz_rad,Fx_n,Fy_n,Fz_n,Mx_nmm,My_nmm,\
Mz_nmm,Fx_sd_n,Fy_sd_n,Fz_sd_n,Mx_sd_nmm,My_sd_nmm,Mz_sd_nmm,dots_ok";

/// First line of [`write_dots_csv`]'s table.
pub const DOTS_CSV_HEADER: &str = "frame,id,state,u_px,v_px,motion_u_px,motion_v_px,dx_mm,dy_mm,dz_mm";

/// Numbers to so many places: a hundredth of what can be measured.
const PX: usize = 4;
const MM: usize = 6;

fn pair(out: &mut impl Write, name: &str, value: Option<DVec2>) -> io::Result<()> {
    match value {
        Some(v) => write!(out, ",\"{name}\":[{:.PX$},{:.PX$}]", v.x, v.y),
        None => write!(out, ",\"{name}\":null"),
    }
}

fn triple(out: &mut impl Write, name: &str, value: Option<DVec3>) -> io::Result<()> {
    match value {
        Some(v) => write!(out, ",\"{name}\":[{:.MM$},{:.MM$},{:.MM$}]", v.x, v.y, v.z),
        None => write!(out, ",\"{name}\":null"),
    }
}

fn six(out: &mut impl Write, name: &str, value: Option<[f64; 6]>) -> io::Result<()> {
    write!(out, ",\"{name}\":")?;
    let Some(values) = value else { return write!(out, "null") };
    for (i, v) in values.iter().enumerate() {
        write!(out, "{}{v:.MM$}", if i == 0 { "[" } else { "," })?;
    }
    write!(out, "]")
}

fn one(out: &mut impl Write, name: &str, value: Option<f64>) -> io::Result<()> {
    match value {
        Some(v) => write!(out, ",\"{name}\":{v:.PX$}"),
        None => write!(out, ",\"{name}\":null"),
    }
}

/// One JSON object with a line's end: `frame`, `status`, `problems`, `pose`, `wrench`, `black_dots`, `white_markers`.
///
/// # Errors
/// Those of the writer.
pub fn write_json(out: &mut impl Write, tracked: &Tracked) -> io::Result<()> {
    write!(out, "{{\"frame\":{},\"status\":\"{}\",\"problems\":[", tracked.frame, tracked.status())?;
    for (i, problem) in tracked.problems.iter().enumerate() {
        write!(out, "{}\"{}\"", if i == 0 { "" } else { "," }, problem.as_str())?;
    }
    write!(out, "]")?;
    if let Some(turn) = tracked.camera_turn {
        let (deg, mirrored) = (turn.turned_rad.to_degrees(), turn.is_mirrored);
        write!(out, ",\"camera_turned_deg\":{deg:.1},\"camera_mirrored\":{mirrored}")?;
    }
    write!(out, ",\"pose\":")?;
    match &tracked.pose {
        None => write!(out, "null")?,
        Some(pose) => {
            for (i, row) in pose.to_rows_4x4().iter().enumerate() {
                let [a, b, c, d] = row;
                write!(out, "{}[{a:.9},{b:.9},{c:.9},{d:.MM$}]", if i == 0 { "[" } else { "," })?;
            }
            write!(out, "]")?;
        }
    }
    six(out, "pose_sd", tracked.pose_sd.map(Displacement::to_array))?;
    one(out, "pose_rms_px", tracked.pose_rms_px)?;
    six(out, "wrench", tracked.wrench.map(Wrench::to_array))?;
    six(out, "wrench_sd", tracked.wrench_sd.map(Wrench::to_array))?;
    write!(out, ",\"black_dots\":[")?;
    for (i, dot) in tracked.black_dots.iter().enumerate() {
        write!(
            out,
            "{}{{\"id\":{},\"state\":\"{}\"",
            if i == 0 { "" } else { "," },
            dot.id,
            dot.state.as_str()
        )?;
        pair(out, "image_px", dot.image_px)?;
        pair(out, "centroid_px", dot.centroid_px)?;
        one(out, "sd_px", dot.sd_px)?;
        pair(out, "motion_px", dot.motion_px)?;
        triple(out, "displacement_mm", dot.displacement_mm)?;
        write!(out, "}}")?;
    }
    write!(out, "],\"white_markers\":[")?;
    for (i, m) in tracked.white_markers.iter().enumerate() {
        write!(out, "{}{{\"id\":{},\"state\":\"{}\"", if i == 0 { "" } else { "," }, m.id, m.state.as_str())?;
        pair(out, "image_px", m.image_px)?;
        pair(out, "centroid_px", m.centroid_px)?;
        one(out, "sd_px", m.sd_px)?;
        pair(out, "residual_px", m.residual_px)?;
        write!(out, "}}")?;
    }
    write!(out, "]")?;
    if tracked.searched {
        write!(out, ",\"false_dots\":[")?;
        for (i, at) in tracked.false_dots.iter().enumerate() {
            write!(out, "{}[{:.2},{:.2}]", if i == 0 { "" } else { "," }, at.x, at.y)?;
        }
        write!(out, "]")?;
    }
    writeln!(out, "}}")
}

/// The frame's line of a table of poses and wrenches; cells that are not known are empty.
///
/// # Errors
/// Those of the writer.
pub fn write_csv(out: &mut impl Write, tracked: &Tracked, at_mm: DVec3) -> io::Result<()> {
    write!(out, "{},{}", tracked.frame, tracked.status())?;
    let displacement = tracked.pose.map(|pose| Displacement::of_pose(&pose, at_mm).to_array());
    let (wrench, wrench_sd) = (tracked.wrench.map(Wrench::to_array), tracked.wrench_sd.map(Wrench::to_array));
    for six in [displacement, wrench, wrench_sd] {
        for i in 0..6 {
            match six {
                Some(values) => write!(out, ",{:.MM$}", values[i])?,
                None => write!(out, ",")?,
            }
        }
    }
    writeln!(out, ",{}", tracked.count(MarkState::Ok))
}

/// The frame's lines of a table of dots.
///
/// # Errors
/// Those of the writer.
pub fn write_dots_csv(out: &mut impl Write, tracked: &Tracked) -> io::Result<()> {
    for dot in &tracked.black_dots {
        write!(out, "{},{},{}", tracked.frame, dot.id, dot.state.as_str())?;
        for v in [dot.image_px, dot.motion_px] {
            match v {
                Some(v) => write!(out, ",{:.PX$},{:.PX$}", v.x, v.y)?,
                None => write!(out, ",,")?,
            }
        }
        match dot.displacement_mm {
            Some(d) => writeln!(out, ",{:.MM$},{:.MM$},{:.MM$}", d.x, d.y, d.z)?,
            None => writeln!(out, ",,,")?,
        }
    }
    Ok(())
}
