//! The forces on the skin as members of a frame's JSON line.

use std::io::{self, Write};

use glam::DVec3;

use super::result::LocalForces;
use crate::track::{Field, Tracked, write_json_fields};

/// Room for a line before its forces.
const LINE: usize = 1 << 16;

/// As [`write_json_fields`], with `traction`, `contact`, `traction_status`, `traction_rms_px` and `compliance_factor`.
///
/// # Errors
/// Those of the writer.
pub fn write_json_forces(
    out: &mut impl Write,
    tracked: &Tracked,
    fields: &[Field],
    forces: &LocalForces,
) -> io::Result<()> {
    let mut line = Vec::with_capacity(LINE);
    write_json_fields(&mut line, tracked, fields)?;
    let open = line.strip_suffix(b"}\n").unwrap_or(&line);
    out.write_all(open)?;
    let three = |v: DVec3| format!("[{:.6},{:.6},{:.6}]", v.x, v.y, v.z);
    write!(out, ",\"traction_status\":\"{}\",\"traction\":[", forces.status.as_str())?;
    for (i, dot) in forces.dots.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        let (at, traction) = (three(dot.surface_mm), three(dot.traction_n_mm2));
        let (depth_sd, noise_sd, sd) = (dot.depth_sd_mm, dot.noise_sd_n_mm2, dot.sd_n_mm2);
        write!(
            out,
            "{comma}{{\"id\":{},\"surface_mm\":{at},\"depth_sd_mm\":{depth_sd:.6},\"n_mm2\":{traction},\"noise_sd\":{noise_sd:.6},\"sd\":{sd:.6}}}",
            dot.id
        )?;
    }
    write!(out, "],\"contact\":")?;
    match &forces.contact {
        None => write!(out, "null")?,
        Some(contact) => {
            let (point, normal) = (three(contact.point_mm), three(contact.normal));
            let (force, force_sd) = (three(contact.force_n), three(contact.force_sd_n));
            write!(
                out,
                "{{\"area_mm2\":{:.4},\"point_mm\":{point},\"point_noise_sd_mm\":{:.6},\"point_sd_mm\":{:.6},\"normal\":{normal},\"force_n\":{force},\
                 \"force_sd_n\":{force_sd},\"slip_share\":{:.4}}}",
                contact.area_mm2, contact.point_noise_sd_mm, contact.point_sd_mm, contact.slip_share
            )?;
        }
    }
    writeln!(
        out,
        ",\"traction_rms_px\":{:.4},\"compliance_factor\":{:.4}}}",
        forces.rms_px, forces.compliance_factor
    )
}
