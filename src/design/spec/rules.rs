//! The rules that hold between the fields of a design.

use glam::DVec2;
use serde_json::{Value, json};

use super::design::Design;
use super::error::DesignError;
use super::sections::{CameraSection, DomeSection, LayerSection, OpticsSection, SpringEnds};

/// Sums of written decimals (10.1 + 15.9) may miss the written limit by rounding; a nanometre is far
/// below anything that can be made.
const ROUNDING_MM: f64 = 1e-6;

/// Checks all of them; the error carries every one that does not hold.
pub(super) fn check(design: &Design) -> Result<(), DesignError> {
    let mut faults = Vec::new();
    for rule in [sizes, dome_on_platform, envelope, pattern, pattern_on_dome, springs, white_markers] {
        rule(design, &mut faults);
    }
    DesignError::all(faults)
}

/// Every layer has a thickness but the last, which fills the dome.
pub(super) fn layers(layers: &[LayerSection]) -> Result<(), DesignError> {
    let last = layers.len().saturating_sub(1);
    for (index, layer) in layers.iter().enumerate() {
        let field = format!("optics.layers[{index}].thickness_mm");
        match layer.thickness_mm {
            None if index != last => {
                return Err(DesignError::at(field, "", "the field is missing", "0 or more, in mm")
                    .with_help("only the last layer, which fills the dome, has no thickness"));
            }
            Some(thickness_mm) if index == last => {
                return Err(DesignError::at(
                    field,
                    thickness_mm,
                    "the last layer fills the dome",
                    "no thickness",
                )
                .with_help("leave the field out, or add the layer that fills the dome"));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The entrance pupil is in the air below the sheet, or touches it.
pub(super) fn camera_below_sheet(camera: &CameraSection, optics: &OpticsSection) -> Result<(), DesignError> {
    let thickness_mm: f64 = optics.layers.iter().filter_map(|layer| layer.thickness_mm).sum();
    let z_mm = camera.position_mm[2];
    // one part in 1e12 is the rounding of written decimals, not a place
    if z_mm <= -thickness_mm * (1.0 - 1e-12) {
        return Ok(());
    }
    let place = if z_mm > 0.0 { "above the sheet, inside or beyond the dome" } else { "inside the sheet" };
    let fault = DesignError::at(
        "camera.position_mm",
        json!(camera.position_mm),
        format!("the camera's pupil is {place}"),
        format!("z of at most {} (the sheet's underside)", -thickness_mm),
    );
    Err(if z_mm > 0.0 {
        fault.with_help("the dome is above, z is negative below the sheet: a sign lost?")
    } else {
        fault
    })
}

/// Side lengths, which the schema cannot bound inside a list.
fn sizes(design: &Design, faults: &mut Vec<DesignError>) {
    let sections = design.sections();
    let lists: [(&str, &[f64]); 8] = [
        ("envelope.size_mm", &sections.envelope.size_mm),
        ("platforms.outer_mm", &sections.platforms.outer_mm),
        ("sheet.size_mm", &sections.sheet.size_mm),
        ("leds.package_mm", &sections.leds.package_mm),
        ("leds.board_mm", &sections.leds.board_mm),
        ("leds.electrical.board.land_mm", &sections.leds.electrical.board.land_mm),
        ("jig.base_mm", &sections.jig.base_mm),
        ("process.build_volume_mm", &sections.process.build_volume_mm),
    ];
    for (field, values) in lists {
        if values.iter().any(|value| !(*value > 0.0 && *value <= 1e4)) {
            faults.push(DesignError::at(
                field,
                json!(values),
                "the value is out of range",
                "more than 0, at most 10000",
            ));
        }
    }
    let deviations: [(&str, &[f64]); 2] = [
        ("tolerances.pupil_mm", &sections.tolerances.pupil_mm),
        ("tolerances.camera_rotation_deg", &sections.tolerances.camera_rotation_deg),
    ];
    for (field, values) in deviations {
        if values.iter().any(|value| !(0.0..=100.0).contains(value)) {
            faults.push(DesignError::at(field, json!(values), "the value is out of range", "0 to 100"));
        }
    }
}

fn dome_on_platform(design: &Design, faults: &mut Vec<DesignError>) {
    let sections = design.sections();
    let smallest_mm = DVec2::from_array(sections.platforms.outer_mm)
        .min_element()
        .min(DVec2::from_array(sections.sheet.size_mm).min_element());
    let dome = sections.dome.shape();
    let radius_mm = dome.rim_radius_mm();
    if 2.0 * radius_mm > smallest_mm {
        faults.push(
            DesignError::at(
                "dome.radius_mm",
                dome.radius_mm(),
                format!("the dome is {} mm wide, wider than the platform or its sheet", 2.0 * radius_mm),
                format!(
                    "at most {} (half of the smallest of platforms.outer_mm and sheet.size_mm)",
                    smallest_mm / 2.0 * (dome.radius_mm() / radius_mm)
                ),
            )
            .with_help("radius for diameter?"),
        );
    }
}

/// A cylinder stands under a whole hemisphere only.
pub(super) fn dome_shape(dome: &DomeSection) -> Result<(), DesignError> {
    let (rim_deg, height_mm) = (dome.rim_angle_deg.unwrap_or(90.0), dome.cylinder_height_mm.unwrap_or(0.0));
    if height_mm > 0.0 && rim_deg < 90.0 {
        return Err(DesignError::at(
            "dome.cylinder_height_mm",
            height_mm,
            format!(
                "the dome is a cap, dome.rim_angle_deg is {rim_deg}: a cylinder under it would leave a step"
            ),
            "0 under a cap, or a rim angle of 90 degrees",
        )
        .cured_by("dome.cylinder_height_mm", 0.0));
    }
    Ok(())
}

/// The pattern ends on the sphere.
fn pattern_on_dome(design: &Design, faults: &mut Vec<DesignError>) {
    let sections = design.sections();
    let (Some(asked_deg), Some(rim_deg)) = (sections.pattern.polar_angle_deg, sections.dome.rim_angle_deg)
    else {
        return;
    };
    if asked_deg > rim_deg {
        faults.push(
            DesignError::at(
                "pattern.polar_angle_deg",
                asked_deg,
                "the pattern would reach past the dome's rim",
                format!("at most dome.rim_angle_deg, {rim_deg}"),
            )
            .cured_by("pattern.polar_angle_deg", rim_deg),
        );
    }
}

fn envelope(design: &Design, faults: &mut Vec<DesignError>) {
    let [low, high] = design.bounds_mm();
    let size = (high - low).to_array();
    let allowed = design.sections().envelope.size_mm;
    let fields = ["platforms.outer_mm", "platforms.outer_mm", "platforms.lower.underside_z_mm"];
    for axis in 0..3 {
        if size[axis] > allowed[axis] + ROUNDING_MM {
            let name = ["x", "y", "z"][axis];
            faults.push(
                DesignError::at(
                    "envelope.size_mm",
                    json!(allowed),
                    format!("the sensor is {} mm along {name}", rounded(size[axis])),
                    format!("an envelope of at least that, or a smaller sensor (`{}`)", fields[axis]),
                )
                .cured_by(&format!("envelope.size_mm[{axis}]"), tenth_up(size[axis])),
            );
        }
    }
}

fn pattern(design: &Design, faults: &mut Vec<DesignError>) {
    let pattern = &design.sections().pattern;
    let mut one_of = |names: [&str; 2], given: [bool; 2]| {
        let problem = match given {
            [true, true] => "both are given",
            [false, false] => "neither is given",
            _ => return,
        };
        let fields = format!("pattern.{} / pattern.{}", names[0], names[1]);
        faults.push(DesignError::at(fields, "", problem, "exactly one of the two"));
    };
    one_of(["pitch_px", "count"], [pattern.pitch_px.is_some(), pattern.count.is_some()]);
    one_of(
        ["dot_diameter_px", "dot_diameter_mm"],
        [pattern.dot_diameter_px.is_some(), pattern.dot_diameter_mm.is_some()],
    );
    if pattern.polar_angle_deg.is_none() && pattern.image_radius_px.is_none() {
        faults.push(DesignError::at(
            "pattern.polar_angle_deg",
            "",
            "the pattern has no end",
            "polar_angle_deg, or image_radius_px, or both",
        ));
    }
    if let (Some(pitch_px), Some(diameter_px)) = (pattern.pitch_px, pattern.dot_diameter_px)
        && diameter_px >= pitch_px
    {
        faults.push(
            DesignError::at(
                "pattern.dot_diameter_px",
                diameter_px,
                "the dots would touch",
                format!("less than the pitch, {pitch_px} px"),
            )
            .cured_by("pattern.dot_diameter_px", rounded(0.5 * pitch_px)),
        );
    }
    let print = &design.sections().print;
    if print.wrap_warn_deg > print.wrap_limit_deg {
        faults.push(
            DesignError::at(
                "print.wrap_warn_deg",
                print.wrap_warn_deg,
                "the warning would come after the limit",
                format!("at most print.wrap_limit_deg, {}", print.wrap_limit_deg),
            )
            .cured_by("print.wrap_warn_deg", print.wrap_limit_deg),
        );
    }
}

fn springs(design: &Design, faults: &mut Vec<DesignError>) {
    if design.is_rigid() {
        return;
    }
    let springs = &design.sections().springs;
    if springs.outer_diameter_mm <= 2.0 * springs.wire_diameter_mm {
        faults.push(
            DesignError::at(
                "springs.outer_diameter_mm",
                springs.outer_diameter_mm,
                "no room is left inside the coil",
                format!("more than twice the wire, {}", 2.0 * springs.wire_diameter_mm),
            )
            .cured_by("springs.outer_diameter_mm", tenth_up(6.0 * springs.wire_diameter_mm)),
        );
    }
    // coils that stand in the solid height beside the active ones (Shigley, compression-spring ends)
    let dead_coils = match springs.ends {
        SpringEnds::Open | SpringEnds::OpenGround => 1.0,
        SpringEnds::Closed => 3.0,
        SpringEnds::ClosedGround => 2.0,
    };
    let solid_mm = (springs.active_coils + dead_coils) * springs.wire_diameter_mm;
    if springs.free_length_mm <= solid_mm {
        faults.push(
            DesignError::at(
                "springs.free_length_mm",
                springs.free_length_mm,
                "the spring is solid already",
                format!("more than its solid height, {} mm", rounded(solid_mm)),
            )
            .cured_by("springs.free_length_mm", tenth_up(2.0 * solid_mm)),
        );
    }
    let reach_mm = DVec2::from_array(design.sections().platforms.outer_mm) / 2.0;
    let coil_mm = springs.outer_diameter_mm / 2.0;
    for (index, at_mm) in design.springs_at_mm().into_iter().enumerate() {
        if (at_mm.abs() + coil_mm).cmpgt(reach_mm).any() {
            faults.push(
                DesignError::at(
                    "springs.places",
                    json!(at_mm.to_array().map(rounded)),
                    format!("spring {index} reaches out of the platforms"),
                    format!("within {} x {} mm, coils included", 2.0 * reach_mm.x, 2.0 * reach_mm.y),
                )
                .cured_by("platforms.outer_mm", room_for(at_mm.abs() + coil_mm, reach_mm)),
            );
        }
    }
}

fn white_markers(design: &Design, faults: &mut Vec<DesignError>) {
    let sections = design.sections();
    let radius_mm = sections.white_markers.diameter_mm / 2.0;
    let rim_mm = sections.dome.shape().rim_radius_mm();
    let half = DVec2::from_array(sections.sheet.size_mm) / 2.0;
    let places = &sections.white_markers.positions_mm;
    for (index, place) in places.iter().enumerate() {
        let at = DVec2::from_array(*place);
        let field = format!("white_markers.positions_mm[{index}]");
        if at.length() - radius_mm < rim_mm {
            faults.push(
                DesignError::at(
                    field.clone(),
                    json!(place),
                    "the marker lies under the dome and would hide dots",
                    format!("at least {} mm from the axis", rounded(rim_mm + radius_mm)),
                )
                .cured_by(&field, outwards(at, rim_mm + radius_mm)),
            );
        }
        if (at.abs() + radius_mm).cmpgt(half).any() {
            faults.push(
                DesignError::at(
                    field.clone(),
                    json!(place),
                    "the marker reaches over the sheet's edge",
                    format!("within {} x {} mm, its radius included", 2.0 * half.x, 2.0 * half.y),
                )
                .cured_by("sheet.size_mm", room_for(at.abs() + radius_mm, half)),
            );
        }
        let clash =
            places[..index].iter().position(|other| DVec2::from_array(*other).distance(at) < 2.0 * radius_mm);
        if let Some(other) = clash {
            faults.push(DesignError::at(
                field.clone(),
                json!(place),
                format!("the marker overlaps marker {other}"),
                "markers that are apart by a diameter or more",
            ));
        }
    }
}

/// Numbers in messages are for people: to a nanometre, without the tail of binary fractions.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// A tenth of a millimetre above.
fn tenth_up(value: f64) -> f64 {
    rounded((10.0 * value - 1e-6).ceil() / 10.0)
}

/// Sides that leave room for what reaches so far from the axis, none smaller than they are.
fn room_for(reach_mm: DVec2, half_mm: DVec2) -> Value {
    let sides = (2.0 * reach_mm.max(half_mm)).to_array().map(tenth_up);
    json!(sides)
}

/// A place moved away from the axis to at least a distance; one on the axis goes along x.
fn outwards(at_mm: DVec2, distance_mm: f64) -> Value {
    let way = at_mm.try_normalize().unwrap_or(DVec2::X);
    let place = (way * (distance_mm + 0.01)).to_array();
    json!(place.map(|side| rounded((100.0 * side).round() / 100.0)))
}
