//! Every check fails when it should, and names what to change.

use super::*;

fn complaint(design: &Design, change: impl Fn(&mut Measures)) -> String {
    let mut m = Measures::of(design).unwrap();
    change(&mut m);
    let parts = match build(&m, &passes()) {
        Ok(parts) => parts,
        Err(error) => return error.to_string(),
    };
    let assembly = Assembly::of(&m, &parts).unwrap();
    check_assembly(&m, &parts, &assembly).err().map_or_else(String::new, |error| error.to_string())
}

#[track_caller]
fn expect(words: &[&str], change: impl Fn(&mut Measures)) {
    let said = complaint(&Design::load(Path::new(NEAR_LIGHTS)).unwrap(), change);
    for word in words {
        assert!(said.contains(word), "\"{word}\" is not in \"{said}\"");
    }
}

#[test]
fn thumb24_passes_every_check() {
    assert_eq!(complaint(&thumb24(), |_| {}), "");
}

#[test]
fn light_over_a_low_lip_is_seen() {
    expect(&["LED 0 shines straight into the lens", "leds.lip_top_z_mm"], |m| m.leds.lip_top_z_mm = -3.6);
}

#[test]
fn interference_names_both_parts_and_the_place() {
    // Springs so wide that they run into the camera's housing.
    expect(&["spring 0", "shares", "with camera", "springs.places"], |m| {
        m.spring_outer_mm = 12.6;
        m.envelope_mm *= 2.0;
    });
    // A pit smaller than its board.
    expect(&["upper_platform", "with LED 0", "always"], |m| {
        m.process.min_wall_mm = 0.0;
        m.process.min_gap_mm = -1.0;
        m.leds.clearance_mm = -0.2;
    });
}

#[test]
fn camera_under_load_keeps_its_gap() {
    expect(&["gap between the camera's front and the sheet", "camera_body.min_sheet_gap_mm"], |m| {
        m.camera_body.min_sheet_gap_mm = 7.9;
    });
}

#[test]
fn narrow_window_stands_in_the_view() {
    expect(&["stands before", "platforms.window_margin_mm"], |m| {
        m.leds.list.clear();
        m.pockets.push_out_diameter_mm = 0.0;
        // The window of a design with smaller markers nearer the axis.
        let design = thumb24();
        let near: Vec<_> = m.markers_mm.iter().map(|p| *p * 0.5).collect();
        m.view = ViewCone::over(
            design.optics(),
            9.0,
            (&near, 0.1),
            &[domecast_optics::numeric::Rigid::identity()],
            (-5.2, -1.0),
            0.1,
        )
        .unwrap();
    });
}

#[test]
fn process_and_printer_have_their_say() {
    expect(&["vent", "mould.vents.diameter_mm"], |m| m.mould.vents.diameter_mm = 0.5);
    expect(&["register pins", "mould.pins.diameter_mm"], |m| m.process.min_pin_diameter_mm = 3.5);
    expect(&["gap round the sheet", "sheet.clearance_mm"], |m| m.sheet.clearance_mm = 0.05);
    expect(&["side length", "process.build_volume_mm"], |m| m.process.build_volume_mm = [50.0, 50.0, 200.0]);
    expect(&["along z", "envelope.size_mm"], |m| m.envelope_mm.z = 25.99);
}

#[test]
fn thin_walls_are_found_with_what_bounds_them() {
    expect(&["magnet pocket", "mounting hole", "platforms.lower.mounting"], |m| {
        m.platforms.lower.mounting.at_mm[0] = [9.0, 7.2];
    });
    // Between pocket and outside: only the thickness of the material tells.
    expect(&["upper_platform: wall between", "magnet pocket", "plate"], |m| {
        m.spring_axes_mm[1].y += 0.4;
    });
    // Floor of an LED pit.
    expect(&["LED pit", "plate", "leds.center_radius_mm"], |m| {
        m.platforms.upper.underside_z_mm = -5.0;
    });
    expect(&["misses the part"], |m| m.platforms.lower.clamp.z_mm = -30.0);
}
