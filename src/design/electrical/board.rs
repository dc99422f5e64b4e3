//! The board of one light: outline, lands, wire pads, tracks, mask and silkscreen.
//!
//! The light's lands lie side by side, the cathode at the left as seen from the light's face. Beside them, or below or above
//! where the board is higher than wide, a wire pad for each, with a `-` or `+` beside it. The series resistors have no
//! room here; they belong to the cable's end. One copper layer, no holes.
//!
//! Frame: origin at the board's centre, x across, y up, seen from the light's face; mm.

use glam::DVec2;

use crate::spec::DesignWarning;
use crate::spec::sections::LedsSection;

/// A rectangle by its lowest and highest corner, mm.
pub type BoardRect = [DVec2; 2];

/// Widest track, mm.
const MAX_TRACK_MM: f64 = 0.4;
/// Widest wire pad, mm: more only takes the iron's heat.
const MAX_WIRE_PAD_MM: f64 = 2.0;

/// A pad: bare copper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardPad {
    /// Its net, by the place in [`LedBoard::NETS`].
    pub net: usize,
    /// Where it is, mm.
    pub rect_mm: BoardRect,
    /// Whether a wire is soldered to it by hand; else it is a land of the light, with paste.
    pub is_for_wire: bool,
}

/// The board of one light.
#[derive(Debug, Clone, PartialEq)]
pub struct LedBoard {
    /// Its sides, mm.
    pub size_mm: DVec2,
    /// Its thickness, mm.
    pub thickness_mm: f64,
    /// Outline of the light's package, mm.
    pub package_mm: BoardRect,
    /// Its pads: two lands, then two wire pads; cathode first.
    pub pads: [BoardPad; 4],
    /// For each net the corners of its track, from the land to the wire pad, mm.
    pub tracks_mm: [[DVec2; 3]; 2],
    /// Width of the tracks, mm.
    pub track_mm: f64,
    /// Lines of the silkscreen, mm: the minus, then the two of the plus.
    pub silk_mm: [[DVec2; 2]; 3],
    /// Width of those lines, mm.
    pub silk_line_mm: f64,
    /// How far the solder mask stays off the pads, mm.
    pub mask_margin_mm: f64,
    /// Whether it is too small to be cut singly.
    pub is_for_panel: bool,
}

/// A wire pad and the middle of its polarity mark.
type WirePlace = (BoardRect, DVec2);

impl LedBoard {
    /// Names of the two nets, cathode first: KiCad's lights have pad 1 at the cathode.
    pub const NETS: [&'static str; 2] = ["CATHODE", "ANODE"];

    /// The board that a design's lights stand on.
    ///
    /// # Errors
    /// Why it cannot be drawn: a warning, because a sensor can have boards of another make.
    pub fn of(leds: &LedsSection) -> Result<Self, DesignWarning> {
        let limits = &leds.electrical.board;
        let size = DVec2::from_array(leds.board_mm);
        let edge = DVec2::splat(limits.min_edge_mm);
        let usable = [-0.5 * size + edge, 0.5 * size - edge];
        // the board's centre stands above the light's
        let middle = DVec2::new(0.0, -leds.board_offset_mm);
        let around = |at: DVec2, sides: [f64; 2]| {
            let half = 0.5 * DVec2::from_array(sides);
            [at - half, at + half]
        };
        let lands =
            [-0.5, 0.5].map(|side| around(middle + DVec2::X * (side * limits.land_pitch_mm), limits.land_mm));
        let package = around(middle, leds.package_mm);
        check_lands(leds, &lands, usable)?;
        let busy = [
            package[0].min(lands[0][0]) - limits.min_gap_mm,
            package[1].max(lands[1][1]) + limits.min_gap_mm,
        ];
        let mark = 3.0 * limits.silk_line_mm;
        let needs = Needs {
            pad: limits.min_wire_pad_mm,
            mark,
            room: limits.mask_margin_mm + limits.silk_line_mm + mark,
        };
        let places = cells(usable, busy, limits.min_gap_mm)
            .into_iter()
            .find_map(|[cathode, anode]| Some([needs.place(cathode)?, needs.place(anode)?]))
            .ok_or_else(|| no_room(leds, &needs))?;
        let pad = |net: usize, rect_mm: BoardRect, is_for_wire| BoardPad { net, rect_mm, is_for_wire };
        let pads = [
            pad(0, lands[0], false),
            pad(1, lands[1], false),
            pad(0, places[0].0, true),
            pad(1, places[1].0, true),
        ];
        let narrowest = pads.iter().map(|pad| (pad.rect_mm[1] - pad.rect_mm[0]).min_element());
        let track_mm = narrowest.fold(MAX_TRACK_MM, f64::min);
        let is_beside = center(places[0].0).x < busy[0].x;
        let tracks_mm = [0, 1].map(|net| {
            let (from, to) = (center(lands[net]), center(places[net].0));
            let corner = if is_beside { DVec2::new(to.x, from.y) } else { DVec2::new(from.x, to.y) };
            [from, corner, to]
        });
        let arm = 0.5 * mark - 0.5 * limits.silk_line_mm;
        let bar = |at: DVec2, along: DVec2| [at - along * arm, at + along * arm];
        let [minus, plus] = [places[0].1, places[1].1];
        Ok(Self {
            size_mm: size,
            thickness_mm: leds.board_thickness_mm,
            package_mm: package,
            pads,
            tracks_mm,
            track_mm,
            silk_mm: [bar(minus, DVec2::X), bar(plus, DVec2::X), bar(plus, DVec2::Y)],
            silk_line_mm: limits.silk_line_mm,
            mask_margin_mm: limits.mask_margin_mm,
            is_for_panel: size.min_element() < limits.min_single_mm,
        })
    }

    /// The pads with the mask's margin: where the solder mask is open, mm.
    pub fn mask_openings_mm(&self) -> [BoardRect; 4] {
        let margin = DVec2::splat(self.mask_margin_mm);
        self.pads.map(|pad| [pad.rect_mm[0] - margin, pad.rect_mm[1] + margin])
    }
}

/// The middle of a rectangle, mm.
fn center(rect: BoardRect) -> DVec2 {
    0.5 * (rect[0] + rect[1])
}

/// The two places for wire pads, cathode first: beside the light, below it, above it.
fn cells(usable: BoardRect, busy: BoardRect, gap: f64) -> [[BoardRect; 2]; 3] {
    let row = |low: f64, high: f64| {
        [
            [DVec2::new(usable[0].x, low), DVec2::new(-0.5 * gap, high)],
            [DVec2::new(0.5 * gap, low), DVec2::new(usable[1].x, high)],
        ]
    };
    [
        [[usable[0], DVec2::new(busy[0].x, usable[1].y)], [DVec2::new(busy[1].x, usable[0].y), usable[1]]],
        row(usable[0].y, busy[0].y),
        row(busy[1].y, usable[1].y),
    ]
}

/// What a wire pad and its mark take, mm.
struct Needs {
    /// Smallest side of the pad.
    pad: f64,
    /// Side of the mark.
    mark: f64,
    /// What the mark takes off the pad's length, its distance included.
    room: f64,
}

impl Needs {
    /// Pad and mark in a cell: the mark above the pad, or on the outer side where the cell is wider than high.
    fn place(&self, [low, high]: BoardRect) -> Option<WirePlace> {
        // written decimals leave 1e-16
        const ROUNDING_MM: f64 = 1e-9;
        let size = high - low;
        let fits = |across: f64, along: f64| {
            across.min(along - self.room) >= self.pad - ROUNDING_MM && across >= self.mark - ROUNDING_MM
        };
        let middle = 0.5 * (low + high);
        if fits(size.x, size.y) {
            let pad = DVec2::new(size.x, size.y - self.room).min(DVec2::splat(MAX_WIRE_PAD_MM));
            let start = middle - 0.5 * DVec2::new(pad.x, pad.y + self.room);
            let mark = DVec2::new(middle.x, start.y + pad.y + self.room - 0.5 * self.mark);
            return Some(([start, start + pad], mark));
        }
        if !fits(size.y, size.x) {
            return None;
        }
        let pad = DVec2::new(size.x - self.room, size.y).min(DVec2::splat(MAX_WIRE_PAD_MM));
        let outward = if middle.x < 0.0 { -1.0 } else { 1.0 };
        let at = middle - DVec2::X * (0.5 * outward * self.room);
        let mark = middle + DVec2::X * (0.5 * outward * (pad.x + self.room - self.mark));
        Some(([at - 0.5 * pad, at + 0.5 * pad], mark))
    }
}

/// The lands are apart, and on the board.
fn check_lands(leds: &LedsSection, lands: &[BoardRect; 2], usable: BoardRect) -> Result<(), DesignWarning> {
    const ROUNDING_MM: f64 = 1e-9;
    let limits = &leds.electrical.board;
    let gap_mm = lands[1][0].x - lands[0][1].x;
    if gap_mm < limits.min_gap_mm - ROUNDING_MM {
        return Err(DesignWarning {
            field: "leds.electrical.board.land_pitch_mm".into(),
            message: format!(
                "No board is drawn: the light's lands are {gap_mm:.3} mm apart, the board's maker needs {} (min_gap_mm): a \
                 pitch of {:.3} or more",
                limits.min_gap_mm,
                limits.land_mm[0] + limits.min_gap_mm
            ),
        });
    }
    let over = (usable[0] - lands[0][0]).max(lands[1][1] - usable[1]);
    if over.max_element() > ROUNDING_MM {
        return Err(DesignWarning {
            field: "leds.board_mm".into(),
            message: format!(
                "No board is drawn: the light's lands would be {:.3} mm too near to the board's edge (min_edge_mm {}): a \
                 larger board, or smaller leds.electrical.board.land_mm",
                over.max_element(),
                limits.min_edge_mm
            ),
        });
    }
    Ok(())
}

/// A board without room for wires.
fn no_room(leds: &LedsSection, needs: &Needs) -> DesignWarning {
    let limits = &leds.electrical.board;
    let around = 2.0 * (needs.pad.max(needs.mark) + limits.min_gap_mm + limits.min_edge_mm);
    let lands = limits.land_pitch_mm + limits.land_mm[0];
    let width = leds.package_mm[0].max(lands) + around;
    let height = needs.pad + needs.room + 2.0 * limits.min_edge_mm;
    DesignWarning {
        field: "leds.board_mm".into(),
        message: format!(
            "No board is drawn: {} x {} mm have no room for two wires beside a light of {} x {} mm: {:.2} x {:.2} mm or more, \
             or a smaller light",
            leds.board_mm[0],
            leds.board_mm[1],
            leds.package_mm[0],
            leds.package_mm[1],
            (100.0 * width).ceil() / 100.0,
            (100.0 * height.max(leds.board_mm[1])).ceil() / 100.0
        ),
    }
}
