//! What is needed beside the sensor's own parts: the sheet, the pad-printing
//! jig, the marker stencil, the fit coupon.

use glam::{DAffine3, DVec2, DVec3};

use super::measures::Measures;
use super::{Blueprint, Feature, PartError};
use crate::layout::PrintPass;
use crate::spec::DesignWarning;
use domecast_mesh::{Fit, Shape};

/// The clear sheet, in the sensor frame: cut by laser, so no process limits of
/// printing hold.
pub(super) fn sheet(m: &Measures) -> Result<Blueprint, PartError> {
    let mut b = Blueprint::new(
        "acrylic_sheet",
        "clear sheet between camera and dome; laser-cut from acrylic, not printed",
        m.chord,
    );
    b.printed = false;
    let plate = Shape::rounded_plate(m.sheet_size_mm, m.sheet.corner_radius_mm, m.seat_z_mm(), 0.0);
    b.added.push(Feature::new("sheet", "sheet", plate));
    Ok(b)
}

/// The stencil that the white markers are painted through: a thin plate with a
/// skirt that grips the bare sheet. Frame: sheet's top face at z = 0.
pub(super) fn stencil(m: &Measures) -> Result<Blueprint, PartError> {
    let s = &m.stencil;
    let mut b = Blueprint::new(
        "marker_stencil",
        "stencil for the white markers, sits on the bare sheet; printed",
        m.chord,
    );
    let grip = 0.5 * m.sheet_size_mm + DVec2::splat(m.sheet.clearance_mm);
    let outer = grip + DVec2::splat(s.border_mm);
    let over = m.overcut_mm;
    if s.skirt_depth_mm > 0.0 && s.border_mm < m.process.min_wall_mm {
        return Err(b.infeasible("skirt", s.border_mm, m.process.min_wall_mm, "stencil.border_mm"));
    }
    let box_to = |h: DVec2, low: f64, high: f64| Shape::cuboid((-h).extend(low), h.extend(high));
    b.added.push(Feature::new(
        "plate",
        "stencil.thickness_mm",
        box_to(outer, -s.skirt_depth_mm, s.thickness_mm),
    ));
    if s.skirt_depth_mm > 0.0 {
        let low = -s.skirt_depth_mm - over;
        b.cut.push(Feature::new("grip", "stencil.skirt_depth_mm", box_to(grip, low, 0.0)));
    }
    b.may_meet = &[("grip", "marker hole")];
    for (i, at) in m.markers_mm.iter().enumerate() {
        let hole = Shape::cylinder(
            m.marker_radius_mm,
            -0.5 * s.skirt_depth_mm - over,
            s.thickness_mm + over,
            Fit::Area,
        );
        b.cut
            .push(Feature::new("marker hole", "white_markers.positions_mm", hole).numbered(i).at(at.x, at.y));
        b.genus += 1;
    }
    Ok(b)
}

/// A bar with the magnets' pockets and the camera's bore in steps of diameter
/// round nominal, smallest at the corner that is cut off.
pub(super) fn coupon(m: &Measures) -> Result<Blueprint, PartError> {
    let c = &m.coupon;
    let mut b = Blueprint::new(
        "fit_coupon",
        if m.spring_axes_mm.is_empty() {
            "test piece: camera bores in steps of diameter, smallest at the cut corner; printed"
        } else {
            "test piece: magnet pockets and camera bores in steps of diameter, smallest at the cut corner; printed"
        },
        m.chord,
    );
    let (pocket, depth) = m.pocket_mm();
    let bore = m.bore_radius_mm();
    let steps = i64::from(c.steps);
    let grow = 0.5 * c.step_mm * steps as f64;
    let wall = (2.0 * m.process.min_wall_mm).max(0.5 * pocket);
    let has_magnets = !m.spring_axes_mm.is_empty();
    if has_magnets && pocket <= grow {
        return Err(b.infeasible("radius of the smallest pocket", pocket - grow, 0.0, "coupon.step_mm"));
    }
    let pitch = 2.0 * (bore.max(pocket) + grow) + wall;
    let count = 2 * steps + 1;
    let half_length = 0.5 * pitch * count as f64 + 0.5 * wall;
    let rows = DVec2::new(2.0 * (pocket + grow) + wall, 2.0 * (bore + grow) + wall);
    let height = depth + wall;
    let over = m.overcut_mm;
    let low_y = -0.5 * (rows.x + rows.y);
    // The corner at the smallest bore is cut off, half a wall deep: it tells the ends apart.
    let cut = 0.5 * wall;
    let (x, y) = (half_length, -low_y);
    let outline = [(-x, -y), (x, -y), (x, y), (cut - x, y), (-x, y - cut)];
    let bar = Shape::Prism {
        outline_mm: outline.map(|(x, y)| DVec2::new(x, y)).to_vec(),
        corner_radius_mm: 0.0,
        bottom_z_mm: 0.0,
        top_z_mm: height,
    };
    b.added.push(Feature::new("bar", "coupon", bar));
    let push_out = 0.5 * m.pockets.push_out_diameter_mm;
    for k in -steps..=steps {
        let i = usize::try_from(k + steps).unwrap_or(0);
        let x = pitch * k as f64;
        let d = 0.5 * c.step_mm * k as f64;
        if has_magnets {
            let y = low_y + 0.5 * rows.x;
            let shape = Shape::cylinder(pocket + d, height - depth, height + over, Fit::Outside);
            b.cut.push(Feature::new("magnet pocket", "coupon.step_mm", shape).numbered(i).at(x, y));
            if push_out > 0.0 {
                let hole = Shape::cylinder(push_out, -over, height - 0.5 * depth, Fit::Outside);
                b.cut.push(Feature::new("push-out hole", "coupon.step_mm", hole).numbered(i).at(x, y));
                b.genus += 1;
            }
        }
        let y = -low_y - 0.5 * rows.y;
        let shape = Shape::cylinder(bore + d, -over, height + over, Fit::Outside);
        b.cut.push(Feature::new("camera bore", "coupon.step_mm", shape).numbered(i).at(x, y));
        b.genus += 1;
    }
    Ok(b)
}

/// The block of a jig that holds the sheet, in the sensor frame, mm.
struct JigBlock {
    /// Half sides of the sheet's recess.
    recess: DVec2,
    /// Wall round the recess.
    rim: f64,
    /// Half sides of the block.
    block: DVec2,
    /// Depth of the recess.
    grip: f64,
    /// Height of the recess's floor.
    seat: f64,
    /// Height of the block's top.
    top: f64,
}

impl JigBlock {
    fn of(m: &Measures) -> Self {
        let recess = 0.5 * m.sheet_size_mm + DVec2::splat(m.jig.clearance_mm);
        let rim = (3.0 * m.process.min_wall_mm).max(0.15 * recess.min_element());
        // The sheet's top stands clear of the grip, so that the pad can wrap.
        let grip = 0.6 * m.sheet_thickness_mm;
        let seat = -m.sheet_thickness_mm;
        Self { recess, rim, block: recess + DVec2::splat(rim), grip, seat, top: seat + grip }
    }

    /// The highest corner of sheet and block along a stroke, from the middle of the dome's base, mm.
    fn height_mm(&self, m: &Measures, pass: &PrintPass) -> f64 {
        let up = pass.pass_from_sensor.transpose().z_axis;
        let corner = |half: DVec2, z: f64| up.truncate().abs().dot(half) + up.z * z;
        corner(0.5 * m.sheet_size_mm, 0.0).max(corner(self.block, self.top))
    }
}

/// The dome's top along a stroke, from the middle of its base, mm.
fn top_mm(m: &Measures, pass: &PrintPass) -> f64 {
    m.dome.radius_mm() + pass.pass_from_sensor.z_axis.z * m.dome.center_z_mm()
}

/// The print passes whose pad would meet sheet or jig before the dome: tilted so far that a corner of them stands higher
/// along the stroke than the dome's top.
pub fn stroke_notes(m: &Measures, passes: &[PrintPass]) -> Vec<DesignWarning> {
    const STEP_DEG: f64 = 0.5;
    let block = JigBlock::of(m);
    let note = |pass: &PrintPass| {
        let over_mm = block.height_mm(m, pass) - top_mm(m, pass);
        if over_mm <= 0.0 {
            return None;
        }
        let (tilt_deg, azimuth_deg) = (pass.tilt_rad.to_degrees(), pass.azimuth_rad.to_degrees());
        let lower = (1..).map(|step| tilt_deg - STEP_DEG * f64::from(step)).take_while(|deg| *deg > 0.0);
        let clear = lower.into_iter().find(|deg| {
            let lower = PrintPass::new(deg.to_radians(), pass.azimuth_rad);
            block.height_mm(m, &lower) <= top_mm(m, &lower)
        });
        let cure =
            clear.map_or_else(String::new, |deg| format!("; up to {deg:.1} degrees they stay below it"));
        let message = format!(
            "the pad of the pass tilted by {tilt_deg:.1} degrees towards {azimuth_deg:.0} meets sheet or jig before the dome: a \
             corner of them stands {over_mm:.2} mm higher along the stroke{cure}"
        );
        Some(DesignWarning { field: "print.max_tilt_deg".into(), message })
    };
    passes.iter().filter_map(note).collect()
}

/// The pad-printing jig for one print pass: it holds sheet and dome rigidly from
/// below, tilted so that the pass's direction points up into the pad's stroke.
///
/// Frame: top of the base plate z = 0, register pins on the x axis, the pass's
/// direction through the centre of the dome's sphere is the z axis.
pub(super) fn jig(m: &Measures, name: &str, pass: &PrintPass) -> Result<Blueprint, PartError> {
    let j = &m.jig;
    let mut b =
        Blueprint::new(name, "pad-printing jig: holds sheet and dome under the pad; printed", m.chord);
    b.may_meet = &[("below", "pin hole"), ("sheet recess", "finger slot")];
    let over = m.overcut_mm;
    let JigBlock { recess, rim, block, grip, seat, top } = JigBlock::of(m);
    let turn = pass.pass_from_sensor;
    let lowest = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
        .map(|(x, y)| (turn * DVec3::new(x * block.x, y * block.y, seat)).z)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let height = j.seat_height_mm - lowest;
    // The stroke goes through the centre of the dome's sphere.
    let aside = (turn * m.dome.center_mm()).with_z(0.0);
    let jig_from_sensor = DAffine3 { matrix3: turn, translation: DVec3::Z * height - aside };
    let base = 0.5 * DVec2::from_array(j.base_mm);
    let plate = Shape::cuboid((-base).extend(-j.base_thickness_mm), base.extend(0.0));
    b.added.push(Feature::new("base", "jig.base_mm", plate));
    // Down into the base, and cut off where a tilted block would come out below.
    let deep = seat - (height + 0.5 * j.base_thickness_mm) / turn.z_axis.z.max(0.2);
    let pedestal = Shape::cuboid((-block).extend(deep), block.extend(top));
    b.added.push(Feature::new("pedestal", "jig.seat_height_mm", pedestal).placed(jig_from_sensor));
    let reach = 4.0 * (base.length() + height + block.length());
    let below = Shape::cuboid(
        DVec3::new(-reach, -reach, -j.base_thickness_mm - reach),
        DVec3::new(reach, reach, -j.base_thickness_mm),
    );
    let lowest = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
        .map(|(x, y)| jig_from_sensor.transform_point3(DVec3::new(x * block.x, y * block.y, deep)).z)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    if lowest < -j.base_thickness_mm {
        b.cut.push(Feature::new("below", "jig.base_thickness_mm", below));
    }
    let pocket = Shape::cuboid((-recess).extend(seat), recess.extend(top + over));
    b.cut.push(Feature::new("sheet recess", "jig.clearance_mm", pocket).placed(jig_from_sensor));
    // A slot across the middle, to lift the sheet out with two fingers; it
    // also tells which way x is.
    let slot = 0.3 * recess.y;
    let finger = Shape::cuboid(
        DVec3::new(-block.x - over, -slot, seat - grip),
        DVec3::new(-recess.x + rim, slot, top + over),
    );
    b.cut.push(Feature::new("finger slot", "jig.clearance_mm", finger).placed(jig_from_sensor));
    for (i, side) in [-0.5, 0.5].into_iter().enumerate() {
        // Upwards through everything, so that a pin is never in the way of a tilted block.
        let hole =
            Shape::cylinder(0.5 * j.pin_diameter_mm, -j.base_thickness_mm - over, over + reach, Fit::Outside);
        b.cut.push(
            Feature::new("pin hole", "jig.pin_distance_mm", hole)
                .numbered(i)
                .at(side * j.pin_distance_mm, 0.0),
        );
        b.genus += 1;
    }
    // The block of a tilted pass may hang over a hole, which then goes through it once more: whether it does
    // is a question of angles, and the mesh answers it.
    b.genus_is_min = pass.tilt_rad != 0.0;
    Ok(b)
}
