//! The board as a KiCad file: S-expressions of version 20240108, which KiCad 8 and every later one reads
//! (<https://dev-docs.kicad.org/en/file-formats/sexpr-pcb/>).
//!
//! KiCad's y runs down; a point (x, y) of the board stands at (100 + x, 100 - y), in the middle of the sheet.

use std::fmt::Write as _;

use glam::DVec2;

use crate::hash::sha256_hex;
use domecast_design::electrical::{BoardPad, BoardRect, LedBoard};
use domecast_mesh::number::rounded;

/// Where the board's centre stands on KiCad's sheet, mm.
const ORIGIN_MM: DVec2 = DVec2::new(100.0, 100.0);
/// Width of the line along the board's edge and of outlines that are not printed, mm.
const THIN_MM: f64 = 0.05;
/// The layers of a board in KiCad 8: number, name, kind, and what the program shows.
const LAYERS: &str = "\t(layers\n\t\t(0 \"F.Cu\" signal)\n\t\t(31 \"B.Cu\" signal)\n\t\t(34 \"B.Paste\" user)\n\t\t(35 \"F.Paste\" user)\n\
     \t\t(36 \"B.SilkS\" user \"B.Silkscreen\")\n\t\t(37 \"F.SilkS\" user \"F.Silkscreen\")\n\t\t(38 \"B.Mask\" user)\n\
     \t\t(39 \"F.Mask\" user)\n\t\t(44 \"Edge.Cuts\" user)\n\t\t(45 \"Margin\" user)\n\t\t(46 \"B.CrtYd\" user \"B.Courtyard\")\n\
     \t\t(47 \"F.CrtYd\" user \"F.Courtyard\")\n\t\t(48 \"B.Fab\" user)\n\t\t(49 \"F.Fab\" user)\n\t)\n";

/// The board file.
pub(super) fn pcb(name: &str, board: &LedBoard) -> String {
    let mut file = File { text: String::new(), name, count: 0 };
    let _ = write!(
        file.text,
        "(kicad_pcb\n\t(version 20240108)\n\t(generator \"domecast\")\n\t(generator_version \"{}\")\n\t(general\n\t\t(thickness {})\n\
         \t\t(legacy_teardrops no)\n\t)\n\t(paper \"A4\")\n{LAYERS}\
         \t(setup\n\t\t(pad_to_mask_clearance {})\n\t\t(allow_soldermask_bridges_in_footprints yes)\n\t)\n\t(net 0 \"\")\n",
        env!("CARGO_PKG_VERSION"),
        number(board.thickness_mm),
        number(board.mask_margin_mm),
    );
    for (index, net) in LedBoard::NETS.iter().enumerate() {
        let _ = writeln!(file.text, "\t(net {} \"{net}\")", index + 1);
    }
    let (lands, wires) = board.pads.split_at(2);
    file.footprint("LED", "D1", board.package_mm, lands);
    for (index, pad) in wires.iter().enumerate() {
        file.footprint("WirePad", &format!("W{}", index + 1), pad.rect_mm, std::slice::from_ref(pad));
    }
    let half = 0.5 * board.size_mm;
    file.rect("gr_rect", "Edge.Cuts", [-half, half], ORIGIN_MM, 1);
    for [from, to] in &board.silk_mm {
        let uuid = file.uuid();
        let _ = writeln!(
            file.text,
            "\t(gr_line (start {}) (end {}) (stroke (width {}) (type default)) (layer \"F.SilkS\") (uuid \"{uuid}\"))",
            point(*from, ORIGIN_MM),
            point(*to, ORIGIN_MM),
            number(board.silk_line_mm)
        );
    }
    for (index, corners) in board.tracks_mm.iter().enumerate() {
        for ends in corners.windows(2).filter(|ends| ends[0].distance(ends[1]) > 1e-9) {
            let uuid = file.uuid();
            let _ = writeln!(
                file.text,
                "\t(segment (start {}) (end {}) (width {}) (layer \"F.Cu\") (net {}) (uuid \"{uuid}\"))",
                point(ends[0], ORIGIN_MM),
                point(ends[1], ORIGIN_MM),
                number(board.track_mm),
                index + 1
            );
        }
    }
    file.text.push_str(")\n");
    file.text
}

struct File<'a> {
    text: String,
    name: &'a str,
    count: u32,
}

impl File<'_> {
    /// An identifier that is the same in every run: KiCad wants one for each item (RFC 9562, version 8: from a hash).
    fn uuid(&mut self) -> String {
        self.count += 1;
        let hash = sha256_hex(format!("domecast led_board {} {}", self.name, self.count).as_bytes());
        let part = |from: usize, to: usize| hash.get(from..to).unwrap_or_default();
        format!("{}-{}-8{}-a{}-{}", part(0, 8), part(8, 12), part(13, 16), part(17, 20), part(20, 32))
    }

    /// A part on the board with its pads; its place is the middle of its outline.
    fn footprint(&mut self, kind: &str, reference: &str, outline: BoardRect, pads: &[BoardPad]) {
        let middle = 0.5 * (outline[0] + outline[1]);
        let uuid = self.uuid();
        let _ = write!(
            self.text,
            "\t(footprint \"domecast:{kind}\"\n\t\t(layer \"F.Cu\")\n\t\t(uuid \"{uuid}\")\n\t\t(at {})\n",
            point(middle, ORIGIN_MM)
        );
        for (key, value) in [("Reference", reference), ("Value", kind)] {
            let uuid = self.uuid();
            let _ = write!(
                self.text,
                "\t\t(property \"{key}\" \"{value}\"\n\t\t\t(at 0 0 0)\n\t\t\t(layer \"F.Fab\")\n\t\t\t(hide yes)\n\t\t\t(uuid \
                 \"{uuid}\")\n\t\t\t(effects (font (size 0.3 0.3) (thickness 0.05)))\n\t\t)\n"
            );
        }
        self.text.push_str("\t\t(attr smd)\n");
        self.rect("fp_rect", "F.Fab", [outline[0] - middle, outline[1] - middle], DVec2::ZERO, 2);
        for (index, pad) in pads.iter().enumerate() {
            let (uuid, size) = (self.uuid(), pad.rect_mm[1] - pad.rect_mm[0]);
            let layers =
                if pad.is_for_wire { "\"F.Cu\" \"F.Mask\"" } else { "\"F.Cu\" \"F.Paste\" \"F.Mask\"" };
            let _ = writeln!(
                self.text,
                "\t\t(pad \"{}\" smd rect (at {}) (size {} {}) (layers {layers}) (net {} \"{}\") (uuid \"{uuid}\"))",
                index + 1,
                point(0.5 * (pad.rect_mm[0] + pad.rect_mm[1]) - middle, DVec2::ZERO),
                number(size.x),
                number(size.y),
                pad.net + 1,
                LedBoard::NETS.get(pad.net).copied().unwrap_or_default()
            );
        }
        self.text.push_str("\t)\n");
    }

    /// A rectangle's outline.
    fn rect(&mut self, item: &str, layer: &str, rect: BoardRect, origin: DVec2, depth: usize) {
        let uuid = self.uuid();
        let _ = writeln!(
            self.text,
            "{}({item} (start {}) (end {}) (stroke (width {}) (type default)) (fill none) (layer \"{layer}\") (uuid \"{uuid}\"))",
            "\t".repeat(depth),
            point(rect[0], origin),
            point(rect[1], origin),
            number(THIN_MM)
        );
    }
}

fn number(value: f64) -> String {
    rounded(value, 6)
}

fn point(at: DVec2, origin: DVec2) -> String {
    format!("{} {}", number(origin.x + at.x), number(origin.y - at.y))
}
