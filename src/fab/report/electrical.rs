//! Currents, resistors, heat and wires of the lights on the page, and their board.

use std::fmt::Write as _;

use super::subject::ReportSubject;
use crate::html::{Html, figure, html, table};
use crate::led_board::{Wire, rows};
use crate::numbers::{dimension, typeset};
use domecast_design::electrical::{BoardRect, Electrical, LedBoard};
use domecast_design::sections::LedDrive;

/// Their chapter.
pub(super) fn chapter(subject: &ReportSubject<'_>) -> Html {
    let leds = &subject.design.sections().leds;
    let Some(electrical) = &subject.lights.electrical else {
        return match leds.electrical.drive {
            LedDrive::OwnDriver => html!(
                "<p>The lights have drivers of their own: no resistor, and no board with two wires. Follow their data \
                 sheet.</p>"
            ),
            LedDrive::Resistor => html!("<p>No lights.</p>"),
        };
    };
    let board = subject.lights.board.as_ref().map_or_else(Html::default, board_figure);
    html!(
        "<p>{} V for all, {} mA and {} mW together; {} mW of it stay in the sensor, whose platform comes to {} °C. A resistor \
         in series with each light: they have no room on the boards and belong to the cable's end. All as \
         <a href=\"../parts/led_wiring.csv\"><code>parts/led_wiring.csv</code></a>.</p>\n{}{}{}",
        dimension(electrical.supply_voltage_v),
        typeset(electrical.total_current_ma),
        typeset(electrical.total_power_mw),
        typeset(electrical.power_in_sensor_mw),
        typeset(electrical.platform_c),
        circuits(electrical),
        wires(subject, electrical),
        board,
    )
}

fn circuits(electrical: &Electrical) -> Html {
    let ohm =
        |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |ohm| format!("{} Ω", typeset(ohm)));
    let row = |light: &domecast_design::electrical::LedCircuit| {
        vec![
            html!("{}", light.light),
            light.color.as_str().into(),
            format!("{} mW", typeset(light.asked_flux_mw)).into(),
            ohm(light.ideal_resistor_ohm).into(),
            ohm(light.resistor_ohm).into(),
            format!("{} mA", typeset(light.current_ma)).into(),
            format!("{} mW", typeset(light.flux_mw)).into(),
            format!("{} mW", typeset(light.resistor_power_mw)).into(),
            format!("{} mW", typeset(light.light_power_mw)).into(),
            format!("{} °C", typeset(light.board_c)).into(),
            format!("{} °C", typeset(light.junction_c)).into(),
        ]
    };
    table(
        "Circuits: light asked for, exact and nearest E24 resistor, and what that gives",
        &[
            "light",
            "colour",
            "asked",
            "exact",
            "E24",
            "current",
            "light",
            "in resistor",
            "in light",
            "board",
            "junction",
        ],
        &electrical.lights.iter().map(row).collect::<Vec<Vec<Html>>>(),
    )
}

fn wires(subject: &ReportSubject<'_>, electrical: &Electrical) -> Html {
    let row = |row: &crate::led_board::WiringRow<'_>| {
        let light = row.circuit;
        vec![
            html!("{}", light.light),
            format!("{} at {}°", light.color.as_str(), dimension(light.azimuth_deg)).into(),
            Wire::Anode.color(light.color).into(),
            Wire::Cathode.color(light.color).into(),
            row.upper_hole.as_str().into(),
            row.lower_hole.as_str().into(),
        ]
    };
    let rows: Vec<Vec<Html>> = rows(subject.design, electrical).iter().map(row).collect();
    table(
        "Wiring: supply, resistor, anode wire, light, cathode wire, ground",
        &["light", "where", "anode wire (+)", "cathode wire (−)", "upper platform", "lower platform"],
        &rows,
    )
}

/// The board, enlarged.
fn board_figure(board: &LedBoard) -> Html {
    let mut art = String::new();
    let mut rect = |class: &str, [low, high]: BoardRect, name: &str| {
        let _ = write!(
            art,
            "<rect class=\"{class}\" x=\"{:.3}\" y=\"{:.3}\" width=\"{:.3}\" height=\"{:.3}\"><title>{name}</title></rect>",
            low.x,
            -high.y,
            high.x - low.x,
            high.y - low.y
        );
    };
    let half = 0.5 * board.size_mm;
    rect("pcb", [-half, half], "board");
    let names = ["cathode land", "anode land", "cathode wire (−)", "anode wire (+)"];
    for (pad, name) in board.pads.iter().zip(names) {
        rect("pad", pad.rect_mm, name);
    }
    rect("package", board.package_mm, "the light's package");
    let mut line = |class: &str, points: &[domecast_design::glam::DVec2], width: f64| {
        let points: Vec<String> = points.iter().map(|p| format!("{:.3},{:.3}", p.x, -p.y)).collect();
        let _ = write!(
            art,
            "<polyline class=\"{class}\" points=\"{}\" stroke-width=\"{width:.3}\"/>",
            points.join(" ")
        );
    };
    for corners in &board.tracks_mm {
        line("track", corners, board.track_mm);
    }
    for ends in &board.silk_mm {
        line("silk", ends, board.silk_line_mm);
    }
    let margin = 0.05 * board.size_mm.max_element();
    let view = board.size_mm + 2.0 * margin;
    let panel = if board.is_for_panel {
        " It is smaller than boards are cut singly: order it in a panel."
    } else {
        ""
    };
    let picture = Html::trusted(format!(
        "<svg class=\"led-board\" viewBox=\"{:.3} {:.3} {:.3} {:.3}\" role=\"img\" aria-label=\"The board of one light, seen from \
         the light's face\">{art}</svg>",
        -half.x - margin,
        -half.y - margin,
        view.x,
        view.y
    ));
    let caption = format!(
        "The board of one light, {} × {} mm, seen from the light's face: lands under the package, a pad for each wire beside \
         it.{panel}",
        dimension(board.size_mm.x),
        dimension(board.size_mm.y)
    );
    figure(&picture, &caption)
}
