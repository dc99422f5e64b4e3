//! The lights as things to order and wire: the board's drawing, its KiCad file and its Gerbers, the wiring table, and the
//! numbers of the circuits.
//!
//! ```
//! use domecast_design::Design;
//! use domecast_fab::led_board::Lights;
//!
//! let design: Design = include_str!("../../../designs/thumb24.json").parse()?;
//! let lights = Lights::of(&design)?;
//! let files = lights.files(&design).expect("files");
//! assert!(files.iter().any(|(path, _)| path == "parts/led_board.kicad_pcb"));
//! # Ok::<(), domecast_design::DesignError>(())
//! ```

mod drawing;
mod gerber;
mod kicad;
#[cfg(test)]
mod tests;
mod wiring;

pub use wiring::{Wire, WiringRow, rows};

use crate::artwork::{RenderError, to_dxf, to_pdf, to_svg};
use domecast_design::electrical::{Electrical, LedBoard};
use domecast_design::{Design, DesignError, DesignWarning};

/// Curves of the drawing are within this of their lines in DXF, mm; the board has straight edges alone.
const DXF_TOLERANCE_MM: f64 = 0.001;

/// The circuits of a design and the board of one light.
#[derive(Debug, Clone, PartialEq)]
pub struct Lights {
    /// The circuits; `None` without lights, or where they have drivers of their own.
    pub electrical: Option<Electrical>,
    /// The board; `None` where there are no circuits or it cannot be drawn, which the warnings say.
    pub board: Option<LedBoard>,
    /// What the maker should know.
    pub warnings: Vec<DesignWarning>,
}

impl Lights {
    /// The circuits and the board of a design.
    ///
    /// # Errors
    /// As [`Electrical::of`].
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        let leds = &design.sections().leds;
        let Some(electrical) = Electrical::of(design)? else {
            return Ok(Self { electrical: None, board: None, warnings: Vec::new() });
        };
        let mut warnings = electrical.warnings(leds);
        let board = LedBoard::of(leds).map_err(|warning| warnings.push(warning)).ok();
        Ok(Self { electrical: Some(electrical), board, warnings })
    }

    /// The files of a build, path and contents, in a fixed order; the bytes depend on the design alone.
    ///
    /// # Errors
    /// See [`RenderError`].
    pub fn files(&self, design: &Design) -> Result<Vec<(String, Vec<u8>)>, RenderError> {
        let mut files = Vec::new();
        let Some(electrical) = &self.electrical else { return Ok(files) };
        files.push(("parts/led_wiring.csv".to_owned(), wiring::csv(design, electrical).into_bytes()));
        files.push(("report/electrical.json".to_owned(), numbers(electrical)));
        let Some(board) = &self.board else { return Ok(files) };
        let drawing = drawing::drawing(design.name(), board)?;
        files.extend([
            ("parts/led_board.svg".to_owned(), to_svg(&drawing)),
            ("parts/led_board.pdf".to_owned(), to_pdf(&drawing)?),
            ("parts/led_board.dxf".to_owned(), to_dxf(&drawing, DXF_TOLERANCE_MM)),
            ("parts/led_board.kicad_pcb".to_owned(), kicad::pcb(design.name(), board).into_bytes()),
        ]);
        files.extend(gerber::files(board).into_iter().map(|(path, text)| (path, text.into_bytes())));
        Ok(files)
    }
}

/// The circuits for programs.
fn numbers(electrical: &Electrical) -> Vec<u8> {
    // numbers and names only: nothing here can fail to be written
    let mut text = serde_json::to_string_pretty(electrical).unwrap_or_default();
    text.push('\n');
    text.into_bytes()
}
