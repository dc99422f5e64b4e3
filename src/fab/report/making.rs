//! The making, step by step, with this design's quantities.

use super::subject::ReportSubject;
use crate::html::{Html, html};
use crate::numbers::dimension;
use domecast_design::parts::Part;

/// Silicone that stays in cup, syringe and sprue, as a share of what is needed: an estimate for hand casting.
const WASTE: f64 = 1.0;

/// One step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MakingStep {
    /// What is done.
    pub title: &'static str,
    /// How, with the numbers.
    pub text: Html,
}

fn step(title: &'static str, text: Html) -> MakingStep {
    MakingStep { title, text }
}

/// A link to a file of the build, from the page.
fn file(path: &str) -> Html {
    html!("<a href=\"../{0}\"><code>{0}</code></a>", path)
}

/// The steps, in the order in which they are done.
pub fn making_steps(subject: &ReportSubject<'_>) -> Vec<MakingStep> {
    let mut steps = printing_and_casting(subject);
    steps.extend(dots_and_assembly(subject));
    if subject.design.sections().leds.list.is_empty() {
        steps.retain(|step| step.title != "Lights");
    }
    steps
}

/// The steps as a list on the page.
pub(super) fn chapter(subject: &ReportSubject<'_>) -> Html {
    let line = |step: MakingStep| html!("<li><strong>{}.</strong> {}</li>\n", step.title, step.text);
    html!(
        "<ol class=\"making\">\n{}</ol>\n<p>What to buy and print: <a href=\"../parts/bom.csv\"><code>parts/bom.csv\
         </code></a>.</p>\n",
        making_steps(subject).into_iter().map(line).collect::<Html>(),
    )
}

fn printing_and_casting(subject: &ReportSubject<'_>) -> Vec<MakingStep> {
    let s = subject.design.sections();
    let n = dimension;
    let dome_ml = s.dome.shape().volume_mm3() / 1000.0;
    let printed = subject.parts.iter().filter(|part| part.name != "acrylic_sheet");
    let grams = |part: &Part| part.volume_mm3 / 1000.0 * s.process.density_g_per_cm3;
    let total_g: f64 = printed.clone().map(grams).sum();
    let printed: Vec<String> = printed
        .map(|part| format!("{} ({} g)", part.name.replace('_', " "), n((grams(part) * 10.0).round() / 10.0)))
        .collect();
    vec![
        step(
            "Print and clean",
            html!(
                "Print in {} at 1:1: {}. About {} g in all, without support. Print the fit coupon first, try magnets \
                 and camera in its holes, and put what fits into <code>magnet_pockets.diameter_clearance_mm</code> and \
                 <code>camera_body.bore_clearance_mm</code>. Wash, dry, and clear the small holes: they come out \
                 undersize.",
                s.process.name,
                printed.join(", "),
                n(total_g.round()),
            ),
        ),
        step(
            "Cut the sheet",
            html!(
                "{} × {} mm, {} mm thick, from {}. The cut gives back {} mm on each edge (kerf), already in the outline.",
                n(s.sheet.size_mm[0]),
                n(s.sheet.size_mm[1]),
                n(subject.design.sheet_thickness_mm()),
                file("parts/acrylic_sheet.dxf"),
                n(0.5 * s.sheet.kerf_mm),
            ),
        ),
        step(
            "Paint the white markers",
            if s.white_markers.positions_mm.is_empty() {
                html!("None on a rigid mount.")
            } else {
                html!(
                    "Lay the marker stencil on the bare sheet and paint its {} holes, {} mm across, white and opaque, \
                 on the face that will carry the dome.",
                    s.white_markers.positions_mm.len(),
                    n(s.white_markers.diameter_mm),
                )
            },
        ),
        step(
            "Seal the mould",
            html!(
                "Resin keeps platinum silicone from curing. Coat every face that touches silicone ({} mm² in the cavity) \
                 until the sealer is {} mm thick, dry it fully, then release agent. The cavity is made larger by the sealer and \
                 by {} % shrinkage.",
                n(skin_mm2(subject).round()),
                n(s.mould.sealer_thickness_mm),
                n(s.elastomer.shrinkage_percent),
            ),
        ),
        step(
            "Cast the dome",
            html!(
                "{}: the dome holds {} ml; mix {} ml, so that cup and sprue may keep the same again. Degas, close the mould \
                 on its {} pins, fill through the {} mm hole from the flat side until all {} vents run over.",
                s.elastomer.material,
                n(dome_ml),
                n(dome_ml * (1.0 + WASTE)),
                s.mould.pins.at_mm.len(),
                n(s.mould.fill.diameter_mm),
                s.mould.vents.count,
            ),
        ),
        step(
            "Bond",
            html!(
                "Bond the dome's flat side to the painted face of the sheet with the same silicone, thin and without bubbles, \
             centred by the stencil's marks."
            ),
        ),
    ]
}

fn dots_and_assembly(subject: &ReportSubject<'_>) -> Vec<MakingStep> {
    let s = subject.design.sections();
    let n = dimension;
    let springs = subject.design.springs_at_mm().len();
    vec![
        step("Print the dots", dots_text(subject)),
        step(
            "Coat the membrane",
            html!(
                "{} mm of reflective coat over the dots: {} ml on {} mm². It must hide the dots from outside and the light \
                 from inside.",
                n(s.elastomer.membrane_thickness_mm),
                n(skin_mm2(subject) * s.elastomer.membrane_thickness_mm / 1000.0),
                n(skin_mm2(subject).round()),
            ),
        ),
        if s.mount.is_rigid() {
            step(
                "Posts",
                html!(
                    "Lay the upper platform on the {} posts and screw it to them from below ({} mm holes).",
                    s.mount.at_mm.len(),
                    n(s.mount.hole_diameter_mm),
                ),
            )
        } else {
            step(
                "Magnets and springs",
                html!(
                    "Glue {} magnets ({} × {} mm) into their pockets, every facing pair attracting; the holes behind them \
                 let a wrong one out again. Set {} springs ({} mm wire, {} mm outside, {} mm long, {} active coils) on \
                 the lower magnets, lower the upper platform on to them.",
                    2 * springs,
                    n(s.magnets.diameter_mm),
                    n(s.magnets.thickness_mm),
                    springs,
                    n(s.springs.wire_diameter_mm),
                    n(s.springs.outer_diameter_mm),
                    n(s.springs.free_length_mm),
                    n(s.springs.active_coils),
                ),
            )
        },
        step("Lights", lights_text(subject)),
        step("Camera", camera_text(subject)),
        step(
            "Calibrate",
            html!(
                "Lens: a checkerboard in air, into <code>camera</code>. Then, with the sensor built: \
                 <code>domecast calibrate-optics</code> on what it sees at rest and under some loads, and <code>domecast \
                 calibrate-force</code> on pairs of pose and reference wrench. Both write measured constants that replace {}.",
                file("constants/constants.json"),
            ),
        ),
    ]
}

fn camera_text(subject: &ReportSubject<'_>) -> Html {
    let s = subject.design.sections();
    let n = dimension;
    let exit = &s.platforms.lower.cable_exit;
    let down = match exit.width_mm > 0.0 && exit.height_mm > 0.0 {
        true => Html::default(),
        false => html!(
            " The cable leaves straight down: leave it a hole of {} mm or more in what the sensor stands on.",
            n(s.camera_body.cable_diameter_mm),
        ),
    };
    match &s.camera_body.board {
        None => html!(
            "Push the camera in from below until its front stands {} mm above the entrance pupil's place at z = {} mm, and \
             clamp it. Image axes are the sensor's axes.{}",
            n(s.camera_body.front_from_pupil_mm),
            n(s.camera.position_mm[2]),
            down,
        ),
        Some(board) => html!(
            "Lay the board into its pocket from below, the lens barrel in the bore, and screw it against its {} posts. The \
             front glass then stands {} mm above the entrance pupil's place at z = {} mm. Image axes are the sensor's axes.",
            board.holes_mm.len(),
            n(s.camera_body.front_from_pupil_mm),
            n(s.camera.position_mm[2]),
        ),
    }
}

/// Area of the dome's surface, mm^2.
fn skin_mm2(subject: &ReportSubject<'_>) -> f64 {
    subject.design.sections().dome.shape().area_mm2()
}

fn dots_text(subject: &ReportSubject<'_>) -> Html {
    let films = subject.layout.passes.len().max(1);
    let s = subject.design.sections();
    let mut text = html!(
        "{} dots from {} film{}: {} (or <code>.svg</code>, <code>.dxf</code>, <code>.tif</code> at {} dpi), true size, \
         positive. Measure the 10 mm bar on the film. The dome sits in its jig, the pad comes down along the stroke.",
        subject.layout.dots.len(),
        films,
        if films == 1 { "" } else { "s" },
        file("artwork/dots.pdf"),
        dimension(s.print.dpi.into()),
    );
    for (index, pass) in subject.layout.passes.iter().enumerate().filter(|_| films > 1) {
        text += html!(
            " Film {}: tilt {}°, towards {}°.",
            index + 1,
            dimension(pass.tilt_rad.to_degrees()),
            dimension(pass.azimuth_rad.to_degrees())
        );
    }
    text + html!(
        " Use silicone ink. Better: print the target first, measure it, run <code>domecast calibrate-print</code>, and \
         print from the corrected film."
    )
}

fn lights_text(subject: &ReportSubject<'_>) -> Html {
    let leds = &subject.design.sections().leds;
    let list: Vec<String> = leds
        .list
        .iter()
        .map(|led| format!("{} at {}°", led.color.as_str(), dimension(led.azimuth_deg)))
        .collect();
    let solder = match &subject.lights.board {
        Some(_) => html!(
            "Boards: {}, or its Gerbers. Solder a light and two wires on each, cathode where the minus is. ",
            file("parts/led_board.kicad_pcb")
        ),
        None => Html::default(),
    };
    let wiring = match &subject.lights.electrical {
        Some(_) => {
            html!(" Each light gets its resistor at the cable's end: {}.", file("parts/led_wiring.csv"))
        }
        None => Html::default(),
    };
    html!(
        "{}{} boards of {} × {} mm into their pits at {}° to the base: {}. Over each light a {} × {} mm piece of diffuser \
         tape, {} mm thick, of its colour. Wires leave through the {} mm holes.{}",
        solder,
        leds.list.len(),
        dimension(leds.board_mm[0]),
        dimension(leds.board_mm[1]),
        dimension(leds.tilt_deg),
        list.join(", "),
        dimension(leds.package_mm[0]),
        dimension(leds.package_mm[1]),
        dimension(leds.diffuser_thickness_mm),
        dimension(leds.wire_hole_diameter_mm),
        wiring,
    )
}
