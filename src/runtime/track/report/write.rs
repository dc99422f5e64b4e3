//! Results as text: one JSON object or one line of CSV a frame.

use std::io::{self, Write};

use glam::{DVec2, DVec3};

use super::fields::Field;
use super::result::Tracked;
use crate::track::marks::MarkState;
use domecast_springs::{Displacement, Wrench};

/// First line of [`write_csv`]'s table.
pub const CSV_HEADER: &str = "frame,status,tx_mm,ty_mm,tz_mm,rx_rad,ry_rad,rz_rad,Fx_n,Fy_n,Fz_n,Mx_nmm,My_nmm,\
Mz_nmm,Fx_sd_n,Fy_sd_n,Fz_sd_n,Mx_sd_nmm,My_sd_nmm,Mz_sd_nmm,dots_ok,Fx_sd_random_n,Fy_sd_random_n,Fz_sd_random_n,\
Mx_sd_random_nmm,My_sd_random_nmm,Mz_sd_random_nmm";

/// First line of [`write_dots_csv`]'s table.
pub const DOTS_CSV_HEADER: &str = "frame,id,state,u_px,v_px,motion_u_px,motion_v_px,dx_mm,dy_mm,dz_mm";

/// Numbers to so many places: a hundredth of what can be measured.
const PX: usize = 4;
const MM: usize = 6;

/// Beyond this many units of the last place a number is written by the standard library.
const MAX_UNITS: f64 = 4e9;
/// A part of a unit so near to a half is too: the product may have rounded over it.
const NEAR_HALF: f64 = 1e-5;

/// A number to so many places, at most nine: the bytes of `{:.places$}`, several times as fast.
fn fixed(out: &mut impl Write, value: f64, places: usize) -> io::Result<()> {
    const POWERS: [u32; 10] =
        [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];
    let Some(power) = POWERS.get(places).filter(|_| places > 0) else {
        return write!(out, "{value:.places$}");
    };
    let units = value.abs() * f64::from(*power);
    if units.is_nan() || units >= MAX_UNITS || (units.fract() - 0.5).abs() < NEAR_HALF {
        return write!(out, "{value:.places$}");
    }
    let mut rest = units.round() as u64;
    let mut digits = [0; 24];
    let mut from = digits.len();
    let point = digits.len() - places;
    while rest > 0 || from + 1 >= point {
        if from == point {
            from -= 1;
            digits[from] = b'.';
            continue;
        }
        from -= 1;
        digits[from] = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    if value.is_sign_negative() {
        from -= 1;
        digits[from] = b'-';
    }
    out.write_all(&digits[from..])
}

fn pair(out: &mut impl Write, name: &str, value: Option<DVec2>) -> io::Result<()> {
    match value {
        Some(v) => {
            write!(out, ",\"{name}\":[")?;
            fixed(out, v.x, PX)?;
            out.write_all(b",")?;
            fixed(out, v.y, PX)?;
            out.write_all(b"]")
        }
        None => write!(out, ",\"{name}\":null"),
    }
}

fn triple(out: &mut impl Write, name: &str, value: Option<DVec3>) -> io::Result<()> {
    match value {
        Some(v) => {
            write!(out, ",\"{name}\":[")?;
            fixed(out, v.x, MM)?;
            out.write_all(b",")?;
            fixed(out, v.y, MM)?;
            out.write_all(b",")?;
            fixed(out, v.z, MM)?;
            out.write_all(b"]")
        }
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
        Some(v) => {
            write!(out, ",\"{name}\":")?;
            fixed(out, v, PX)
        }
        None => write!(out, ",\"{name}\":null"),
    }
}

/// One JSON object with a line's end: `frame`, `status`, `problems`, `pose`, `wrench`, `black_dots`, `white_markers`.
///
/// # Errors
/// Those of the writer.
pub fn write_json(out: &mut impl Write, tracked: &Tracked) -> io::Result<()> {
    write_json_fields(out, tracked, &Field::ALL)
}

/// The same with these fields alone, in the line's own order; with none given, all. What the frame is and what is wrong with
/// it (`frame`, `time_s`, `status`, `problems`, how the camera is turned) is always there.
///
/// # Errors
/// Those of the writer.
pub fn write_json_fields(out: &mut impl Write, tracked: &Tracked, fields: &[Field]) -> io::Result<()> {
    let fields = if fields.is_empty() { &Field::ALL[..] } else { fields };
    header(out, tracked)?;
    for field in Field::ALL.into_iter().filter(|field| fields.contains(field)) {
        let name = field.as_str();
        match field {
            Field::Pose => pose(out, name, tracked)?,
            Field::PoseSd => six(out, name, tracked.pose_sd.map(Displacement::to_array))?,
            Field::PoseSdRandom => six(out, name, tracked.pose_sd_random.map(Displacement::to_array))?,
            Field::PoseRmsPx => one(out, name, tracked.pose_rms_px)?,
            Field::Wrench => six(out, name, tracked.wrench.map(Wrench::to_array))?,
            Field::WrenchSd => six(out, name, tracked.wrench_sd.map(Wrench::to_array))?,
            Field::WrenchSdRandom => six(out, name, tracked.wrench_sd_random.map(Wrench::to_array))?,
            Field::BlackDots => black_dots(out, name, tracked)?,
            Field::WhiteMarkers => white_markers(out, name, tracked)?,
            Field::FalseDots => false_dots(out, name, tracked)?,
        }
    }
    writeln!(out, "}}")
}

fn header(out: &mut impl Write, tracked: &Tracked) -> io::Result<()> {
    write!(out, "{{\"frame\":{}", tracked.frame)?;
    if let Some(time_s) = tracked.time_s {
        write!(out, ",\"time_s\":{time_s:.6}")?;
    }
    write!(out, ",\"status\":\"{}\",\"problems\":[", tracked.status())?;
    for (i, problem) in tracked.problems.iter().enumerate() {
        write!(out, "{}\"{}\"", if i == 0 { "" } else { "," }, problem.as_str())?;
    }
    write!(out, "]")?;
    if let Some(turn) = tracked.camera_turn {
        let (deg, mirrored) = (turn.turned_rad.to_degrees(), turn.is_mirrored);
        write!(out, ",\"camera_turned_deg\":{deg:.1},\"camera_mirrored\":{mirrored}")?;
    }
    Ok(())
}

fn pose(out: &mut impl Write, name: &str, tracked: &Tracked) -> io::Result<()> {
    write!(out, ",\"{name}\":")?;
    let Some(pose) = &tracked.pose else { return write!(out, "null") };
    for (i, row) in pose.to_rows_4x4().iter().enumerate() {
        let [a, b, c, d] = row;
        write!(out, "{}[{a:.9},{b:.9},{c:.9},{d:.MM$}]", if i == 0 { "[" } else { "," })?;
    }
    write!(out, "]")
}

fn black_dots(out: &mut impl Write, name: &str, tracked: &Tracked) -> io::Result<()> {
    write!(out, ",\"{name}\":[")?;
    for (i, dot) in tracked.black_dots.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        write!(out, "{comma}{{\"id\":{},\"state\":\"{}\"", dot.id, dot.state.as_str())?;
        pair(out, "image_px", dot.image_px)?;
        pair(out, "centroid_px", dot.centroid_px)?;
        one(out, "sd_px", dot.sd_px)?;
        pair(out, "motion_px", dot.motion_px)?;
        triple(out, "displacement_mm", dot.displacement_mm)?;
        match dot.displacement_sd_random_mm {
            Some(sd) => write!(out, ",\"displacement_sd_random_mm\":{sd:.MM$}")?,
            None => write!(out, ",\"displacement_sd_random_mm\":null")?,
        }
        triple(out, "ray", dot.ray)?;
        write!(out, "}}")?;
    }
    write!(out, "]")
}

fn white_markers(out: &mut impl Write, name: &str, tracked: &Tracked) -> io::Result<()> {
    write!(out, ",\"{name}\":[")?;
    for (i, m) in tracked.white_markers.iter().enumerate() {
        write!(out, "{}{{\"id\":{},\"state\":\"{}\"", if i == 0 { "" } else { "," }, m.id, m.state.as_str())?;
        pair(out, "image_px", m.image_px)?;
        pair(out, "centroid_px", m.centroid_px)?;
        one(out, "sd_px", m.sd_px)?;
        pair(out, "residual_px", m.residual_px)?;
        write!(out, "}}")?;
    }
    write!(out, "]")
}

fn false_dots(out: &mut impl Write, name: &str, tracked: &Tracked) -> io::Result<()> {
    if !tracked.searched {
        return Ok(());
    }
    write!(out, ",\"{name}\":[")?;
    for (i, at) in tracked.false_dots.iter().enumerate() {
        write!(out, "{}[{:.2},{:.2}]", if i == 0 { "" } else { "," }, at.x, at.y)?;
    }
    write!(out, "]")
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
    write!(out, ",{}", tracked.count(MarkState::Ok))?;
    match tracked.wrench_sd_random.map(Wrench::to_array) {
        Some(values) => values.iter().try_for_each(|v| write!(out, ",{v:.MM$}"))?,
        None => write!(out, ",,,,,,")?,
    }
    writeln!(out)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_fields_stand_alone_in_the_order_of_the_line() {
        let text = |fields: &[Field]| {
            let mut line = Vec::new();
            write_json_fields(&mut line, &Tracked::default(), fields).unwrap();
            String::from_utf8(line).unwrap()
        };
        let head = r#"{"frame":0,"status":"ok","problems":[]"#;
        let chosen = text(&[Field::WrenchSd, Field::Wrench]);
        assert_eq!(chosen, format!("{head},\"wrench\":null,\"wrench_sd\":null}}\n"));
        assert_eq!(text(&[]), text(&Field::ALL));
        for field in Field::ALL {
            assert_eq!(Field::from_name(field.as_str()), Some(field));
        }
    }

    #[test]
    fn fixed_numbers_are_those_of_the_standard_library() {
        let mut state = 9_u64;
        let mut next = || {
            // Knuth's MMIX generator
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut values =
            vec![0.0, -0.0, 0.5, 0.125, 1.0, -1e-9, 9.99995, 99_999.5, 1e9, -3e12, f64::NAN, f64::INFINITY];
        values.extend((0..40_000).map(|_| (next() - 0.5) * 10f64.powf(12.0 * next() - 7.0)));
        // ties in binary
        values.extend((0..2000).map(|k| f64::from(k) / 32.0));
        for value in values {
            for places in [0, 1, 2, PX, MM, 9, 12] {
                let mut text = Vec::new();
                fixed(&mut text, value, places).unwrap();
                assert_eq!(
                    String::from_utf8(text).unwrap(),
                    format!("{value:.places$}"),
                    "{value:e} {places}"
                );
            }
        }
    }
}
