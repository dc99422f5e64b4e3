//! The board as Gerber files: RS-274X with the attributes of X2 (Ucamco, The Gerber Layer Format Specification, revision
//! 2024.05).
//!
//! Coordinates are whole nanometres (format 4.6, mm) from the board's lower left corner, seen from the light's face. There
//! is one copper layer and no hole, so there is no drill file. The few commands that a board of rectangles needs are
//! written here: a library for the whole format would bring dates and identifiers of its own into files that must not
//! change from run to run.

use std::fmt::Write as _;

use glam::DVec2;

use domecast_design::electrical::{BoardRect, LedBoard};
use domecast_mesh::number::rounded;

/// Width of the line along the board's edge, mm; the edge is its middle.
const PROFILE_MM: f64 = 0.05;

/// The Gerber files: path and text.
pub(super) fn files(board: &LedBoard) -> [(String, String); 5] {
    let copper = {
        let mut file = Gerber::new("Copper,L1,Top", true);
        for (net, corners) in board.tracks_mm.iter().enumerate() {
            let Some(name) = LedBoard::NETS.get(net) else { continue };
            file.attribute(&format!("TO.N,{name}"));
            file.line(board, "Conductor", board.track_mm, corners);
        }
        for (index, pad) in board.pads.iter().enumerate() {
            let name = LedBoard::NETS.get(pad.net).copied().unwrap_or_default();
            file.attribute(&format!("TO.N,{name}"));
            // pins of the light D1, then the wires' own
            let pin = if pad.is_for_wire { format!("W{},1", index - 1) } else { format!("D1,{}", index + 1) };
            file.attribute(&format!("TO.P,{pin}"));
            file.flash(board, "SMDPad,CuDef", pad.rect_mm);
            file.attribute("TD");
        }
        file.finish()
    };
    let mut mask = Gerber::new("Soldermask,Top", false);
    for rect in board.mask_openings_mm() {
        mask.flash(board, "Material", rect);
    }
    let mut paste = Gerber::new("Paste,Top", true);
    for pad in board.pads.iter().filter(|pad| !pad.is_for_wire) {
        paste.flash(board, "Material", pad.rect_mm);
    }
    let mut silk = Gerber::new("Legend,Top", true);
    for line in &board.silk_mm {
        silk.line(board, "Material", board.silk_line_mm, line);
    }
    let mut profile = Gerber::new("Profile,NP", true);
    let half = 0.5 * board.size_mm;
    let (right, up) = (DVec2::new(half.x, -half.y), DVec2::new(-half.x, half.y));
    profile.line(board, "Profile", PROFILE_MM, &[-half, right, half, up, -half]);
    let named = |name: &str, text: String| (format!("parts/led_board-{name}.gbr"), text);
    [
        named("F_Cu", copper),
        named("F_Mask", mask.finish()),
        named("F_Paste", paste.finish()),
        named("F_Silkscreen", silk.finish()),
        named("Edge_Cuts", profile.finish()),
    ]
}

/// A Gerber file under construction: apertures come before what is drawn with them.
struct Gerber {
    head: String,
    apertures: Vec<String>,
    body: String,
}

impl Gerber {
    fn new(function: &str, is_positive: bool) -> Self {
        let polarity = if is_positive { "Positive" } else { "Negative" };
        let version = env!("CARGO_PKG_VERSION");
        let head = format!(
            "%TF.GenerationSoftware,domecast,domecast,{version}*%\n%TF.Part,Single*%\n%TF.SameCoordinates,led_board*%\n\
             %TF.FileFunction,{function}*%\n%TF.FilePolarity,{polarity}*%\n%FSLAX46Y46*%\n%MOMM*%\n"
        );
        Self { head, apertures: Vec::new(), body: String::new() }
    }

    /// An attribute of the objects that follow, or `TD`, which ends them.
    fn attribute(&mut self, text: &str) {
        let _ = writeln!(self.body, "%{text}*%");
    }

    /// Chooses an aperture, which is defined where it is new; D-codes start at 10.
    fn choose(&mut self, function: &str, shape: &str) {
        let definition = format!("%TA.AperFunction,{function}*%\n%ADD?{shape}*%\n%TD*%\n");
        let known = self.apertures.iter().position(|other| *other == definition);
        let index = known.unwrap_or(self.apertures.len());
        if known.is_none() {
            self.apertures.push(definition);
        }
        let _ = writeln!(self.body, "D{}*", 10 + index);
    }

    /// A rectangle.
    fn flash(&mut self, board: &LedBoard, function: &str, rect: BoardRect) {
        let size = rect[1] - rect[0];
        self.choose(function, &format!("R,{}X{}", rounded(size.x, 6), rounded(size.y, 6)));
        self.at(board, 0.5 * (rect[0] + rect[1]), "D03");
    }

    /// Straight lines through corners with a round end.
    fn line(&mut self, board: &LedBoard, function: &str, width_mm: f64, corners: &[DVec2]) {
        self.choose(function, &format!("C,{}", rounded(width_mm, 6)));
        for (i, corner) in corners.iter().enumerate() {
            self.at(board, *corner, if i == 0 { "D02" } else { "D01" });
        }
    }

    fn at(&mut self, board: &LedBoard, place_mm: DVec2, operation: &str) {
        let nm = ((place_mm + 0.5 * board.size_mm) * 1e6).round();
        let _ = writeln!(self.body, "X{}Y{}{operation}*", nm.x as i64, nm.y as i64);
    }

    fn finish(self) -> String {
        let numbered = |(index, text): (usize, &String)| text.replace('?', &(10 + index).to_string());
        let apertures: String = self.apertures.iter().enumerate().map(numbered).collect();
        format!("{}{apertures}%LPD*%\nG01*\n{}M02*\n", self.head, self.body)
    }
}
