//! Bill of materials.

use std::fmt::Write as _;

use super::Part;
use super::board::BoardSeat;
use super::measures::Measures;
use super::mount;
use crate::electrical::{Electrical, LedBoard};
use crate::spec::Design;
use crate::spec::sections::{LedColor, LedDrive};

/// What to print, cut, cast and buy, with tolerances and where each comes from,
/// as CSV: one line per item.
pub(super) fn bom(design: &Design, m: &Measures, parts: &[Part]) -> String {
    let mut table = Table(String::from(
        "item,quantity,unit,description,size_mm,tolerance_mm,made_of,source,design_field\n",
    ));
    made(design, m, parts, &mut table);
    purchased(design, m, &mut table);
    leds(m, &mut table);
    circuits(m, &mut table);
    let clamps = m.platforms.lower.clamp.azimuth_deg.len();
    if clamps > 0 {
        let size = format!("for a tapping hole of {}", m.platforms.lower.clamp.hole_diameter_mm);
        let clamps = clamps.to_string();
        let what = "holds the camera";
        table.row([
            "set screw",
            &clamps,
            "piece",
            what,
            &size,
            "",
            "steel",
            "bought",
            "platforms.lower.clamp",
        ]);
    }
    if let Some(seat) = BoardSeat::of(m)
        && let Some(thread) = seat.thread
    {
        let size = format!(
            "{} x {:.0}, for a hole of {}",
            thread.name,
            (seat.board.thickness_mm + seat.hole_depth_mm).floor(),
            thread.tap_mm
        );
        let count = seat.holes_mm.len().to_string();
        let what = "thread-forming, holds the camera's board";
        table.row(["board screw", &count, "piece", what, &size, "", "steel", "bought", "camera_body.board"]);
    }
    table.0
}

/// The table as text.
struct Table(String);

impl Table {
    fn row(&mut self, cells: [&str; 9]) {
        let line: Vec<String> = cells.iter().map(|c| quoted(c)).collect();
        let _ = writeln!(self.0, "{}", line.join(","));
    }
}

/// What is printed, cut, cast and sprayed.
fn made(design: &Design, m: &Measures, parts: &[Part], table: &mut Table) {
    let sections = design.sections();
    let process = &m.process;
    let printed_tolerance = format!("+-{}", process.tolerance_mm);
    for part in parts.iter().filter(|p| p.name != "acrylic_sheet") {
        let size = part.bounds.size_mm();
        let size = format!("{:.2} x {:.2} x {:.2}", size.x, size.y, size.z);
        let grams = part.volume_mm3 * 1e-3 * process.density_g_per_cm3;
        let tool = !part.name.ends_with("platform");
        let description = format!("{}{}, {grams:.1} g", part.summary, if tool { " (tool)" } else { "" });
        let file = format!("parts/{}.stl", part.name);
        table.row([
            &part.name,
            "1",
            "piece",
            &description,
            &size,
            &printed_tolerance,
            &process.name,
            &file,
            "process",
        ]);
    }
    let sheet = format!("{} x {} x {}", m.sheet_size_mm.x, m.sheet_size_mm.y, m.sheet_thickness_mm);
    let sheet_material = sections.optics.layers.first().map_or("clear sheet", |layer| layer.name.as_str());
    let slack = format!("outline +0/-{}", m.sheet.clearance_mm);
    table.row([
        "acrylic_sheet",
        "1",
        "piece",
        "clear sheet, laser-cut",
        &sheet,
        &slack,
        sheet_material,
        "parts/acrylic_sheet.dxf",
        "sheet",
    ]);
    let volume_ml = m.dome.volume_mm3() * 1e-3;
    let elastomer = &sections.elastomer.material;
    let dome = dome_size(m);
    let amount = format!("{volume_ml:.1}");
    table.row([
        "dome",
        &amount,
        "ml",
        "clear elastomer for one dome, without waste",
        &dome,
        "",
        elastomer,
        "cast in the mould",
        "elastomer",
    ]);
    let membrane = format!("{}", m.membrane_mm);
    table.row([
        "membrane",
        "1",
        "coat",
        "reflective coat on the dome, thickness",
        &membrane,
        "",
        "reflective silicone paint",
        "sprayed or dipped",
        "elastomer.membrane_thickness_mm",
    ]);
}

/// Camera, springs and magnets.
fn purchased(design: &Design, m: &Measures, table: &mut Table) {
    let sections = design.sections();
    let body = &m.camera_body;
    let camera = match &body.board {
        None => format!("diameter {} x {}", body.diameter_mm, body.length_mm),
        Some(board) => format!(
            "board {} x {} x {}, lens diameter {} x {}",
            board.size_mm[0], board.size_mm[1], board.thickness_mm, body.diameter_mm, body.length_mm
        ),
    };
    let lens = format!(
        "camera {} x {} px, {} degrees",
        sections.camera.width, sections.camera.height, sections.camera.field_of_view_deg
    );
    let bore = format!("diameter +{}/-any", 2.0 * body.bore_clearance_mm);
    table.row(["camera", "1", "piece", &lens, &camera, &bore, "", "bought", "camera_body"]);
    if m.mount.is_rigid() {
        let count = m.mount.at_mm.len().to_string();
        let size = mount::thread(m).map_or_else(String::new, |thread| {
            let through = m.platforms.upper.underside_z_mm - m.platforms.lower.underside_z_mm;
            format!(
                "{} x {:.0}, heads sunk",
                thread.name,
                (through - thread.nominal_mm).floor() + 2.0 * thread.nominal_mm
            )
        });
        let what = "thread-forming, holds the upper platform on its posts";
        table.row(["post screw", &count, "piece", what, &size, "", "steel", "bought", "mount"]);
        return;
    }
    let count = m.spring_axes_mm.len().to_string();
    let springs = &sections.springs;
    let size = format!(
        "wire {} x outer {} x free {}, {} active coils",
        springs.wire_diameter_mm, springs.outer_diameter_mm, springs.free_length_mm, springs.active_coils
    );
    let tolerance = format!(
        "wire {}, outer {}",
        sections.tolerances.wire_diameter_mm, sections.tolerances.spring_diameter_mm
    );
    table.row([
        "spring",
        &count,
        "piece",
        "compression spring (tolerances are one sigma)",
        &size,
        &tolerance,
        &springs.wire.name,
        "bought",
        "springs",
    ]);
    let count = (2 * m.spring_axes_mm.len()).to_string();
    let size = format!("diameter {} x {}", m.magnets.diameter_mm, m.magnets.thickness_mm);
    let pocket = format!("diameter +{}/-any", m.pockets.diameter_clearance_mm);
    table.row([
        "magnet",
        &count,
        "piece",
        "disc magnet, glued into its pocket",
        &size,
        &pocket,
        "NdFeB",
        "bought",
        "magnets",
    ]);
}

/// LEDs, their boards and diffusers.
fn leds(m: &Measures, table: &mut Table) {
    for (color, name) in [
        (LedColor::Red, "red"),
        (LedColor::Green, "green"),
        (LedColor::Blue, "blue"),
        (LedColor::White, "white"),
    ] {
        let n = m.leds.list.iter().filter(|led| led.color == color).count();
        if n > 0 {
            let size =
                format!("{} x {} x {}", m.leds.package_mm[0], m.leds.package_mm[1], m.leds.package_height_mm);
            let item = format!("LED {name}");
            table.row([
                &item,
                &n.to_string(),
                "piece",
                "surface-mounted LED",
                &size,
                "",
                "",
                "bought",
                "leds.list",
            ]);
        }
    }
    if !m.leds.list.is_empty() {
        let n = m.leds.list.len().to_string();
        let size = format!("{} x {} x {}", m.leds.board_mm[0], m.leds.board_mm[1], m.leds.board_thickness_mm);
        let slack = format!("+-{}", m.leds.clearance_mm);
        let board = LedBoard::of(&m.leds).ok().filter(|_| has_resistors(m));
        let (what, source) = match &board {
            Some(board) if board.is_for_panel => {
                ("circuit board for one LED; ordered in a panel", "parts/led_board.kicad_pcb")
            }
            Some(_) => ("circuit board for one LED", "parts/led_board.kicad_pcb"),
            None => ("circuit board for one LED", "ordered"),
        };
        table.row(["LED board", &n, "piece", what, &size, &slack, "FR4", source, "leds.board_mm"]);
        if m.leds.diffuser_thickness_mm > 0.0 {
            let t = m.leds.diffuser_thickness_mm.to_string();
            table.row([
                "diffuser",
                &n,
                "piece",
                "diffuser tape before the LED, thickness",
                &t,
                "",
                "tape",
                "bought",
                "leds.diffuser_thickness_mm",
            ]);
        }
    }
}

/// Whether the lights are plain ones, with resistors.
fn has_resistors(m: &Measures) -> bool {
    m.leds.electrical.drive == LedDrive::Resistor
}

/// Resistors by value, and wires by colour.
fn circuits(m: &Measures, table: &mut Table) {
    // a build has refused what cannot be before it comes to its list
    let Ok(Some(electrical)) = Electrical::of_leds(&m.leds) else { return };
    let mut resistors: Vec<(f64, f64, usize)> = Vec::new();
    for light in &electrical.lights {
        let (Some(ohm), Some(rating_w)) = (light.resistor_ohm, light.resistor_rating_w) else { continue };
        match resistors.iter_mut().find(|(known, ..)| *known == ohm) {
            Some((_, rated, count)) => (*rated, *count) = (rated.max(rating_w), *count + 1),
            None => resistors.push((ohm, rating_w, 1)),
        }
    }
    for (ohm, rating_w, count) in resistors {
        table.row([
            &format!("resistor {ohm} ohm"),
            &count.to_string(),
            "piece",
            "in series with a light, at the cable's end",
            &format!("{rating_w} W or more"),
            "",
            "5 %, E24",
            "bought",
            "leds.electrical.supply_voltage_v",
        ]);
    }
    let length_m = 1e-3 * m.leds.electrical.wire_length_mm;
    let mut wires: Vec<(&str, usize)> = Vec::new();
    for light in &electrical.lights {
        match wires.iter_mut().find(|(known, _)| *known == light.color.as_str()) {
            Some((_, count)) => *count += 1,
            None => wires.push((light.color.as_str(), 1)),
        }
    }
    wires.push(("black", electrical.lights.len()));
    for (color, count) in wires {
        table.row([
            &format!("wire {color}"),
            &format!("{:.2}", length_m * count as f64),
            "m",
            if color == "black" { "stranded, from the cathodes" } else { "stranded, to the anodes" },
            "AWG 30 to 32",
            "",
            "copper",
            "bought",
            "leds.electrical.wire_length_mm",
        ]);
    }
}

/// A CSV cell, quoted where it must be (RFC 4180).
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// The dome's size in words.
fn dome_size(m: &Measures) -> String {
    let sphere = format!("radius {}", m.dome.radius_mm());
    match m.dome.center_z_mm() {
        z if z < 0.0 => {
            format!("{sphere}, cap {:.3} high, {:.3} wide", m.dome.height_mm(), 2.0 * m.dome.rim_radius_mm())
        }
        z if z > 0.0 => format!("{sphere}, on a cylinder {z} high"),
        _ => sphere,
    }
}
