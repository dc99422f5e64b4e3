//! The rules of a camera's board.

use glam::DVec2;
use serde_json::json;

use super::error::DesignError;
use super::sections::{CameraBoardSection, CameraBodyKind, DesignFile};

/// The kind and what stands beside it belong together, and the board's places lie on it.
pub(super) fn check(sections: &DesignFile) -> Result<(), DesignError> {
    let body = &sections.camera_body;
    match (body.kind, &body.board) {
        (CameraBodyKind::Cylinder, None) => Ok(()),
        (CameraBodyKind::Cylinder, Some(_)) => Err(DesignError::at(
            "camera_body.kind",
            json!("cylinder"),
            "a board is described, but the body is a cylinder",
            "\"board\", or no camera_body.board",
        )),
        (CameraBodyKind::Board, None) => Err(DesignError::at(
            "camera_body.board",
            "",
            "the body is a board, and nothing describes it",
            "size_mm, thickness_mm, holes_mm, hole_diameter_mm and components_height_mm",
        )
        .with_help("boards that are known: domecast list cameras")),
        (CameraBodyKind::Board, Some(board)) => {
            if !sections.platforms.lower.clamp.azimuth_deg.is_empty() {
                return Err(DesignError::at(
                    "platforms.lower.clamp.azimuth_deg",
                    json!(sections.platforms.lower.clamp.azimuth_deg),
                    "set screws press on a round body; a board is screwed against posts",
                    "an empty list, []",
                ));
            }
            places(board)
        }
    }
}

fn places(board: &CameraBoardSection) -> Result<(), DesignError> {
    if board.size_mm.iter().any(|side| !(*side > 0.0 && *side <= 500.0)) {
        return Err(DesignError::at(
            "camera_body.board.size_mm",
            json!(board.size_mm),
            "the value is out of range",
            "more than 0, at most 500",
        ));
    }
    let half = 0.5 * DVec2::from_array(board.size_mm);
    let on_board = |field: String, at: &[f64; 2], margin_mm: f64, what: &str| {
        let reach = half - margin_mm;
        if DVec2::from_array(*at).abs().cmple(reach).all() {
            return Ok(());
        }
        let allowed =
            format!("x within +-{:.3} and y within +-{:.3} mm of the board's middle", reach.x, reach.y);
        Err(DesignError::at(field, json!(at), format!("{what} is not on the board"), allowed))
    };
    on_board("camera_body.board.lens_offset_mm".into(), &board.lens_offset_mm, 0.0, "the lens's axis")?;
    let radius_mm = 0.5 * board.hole_diameter_mm;
    for (i, at) in board.holes_mm.iter().enumerate() {
        let field = format!("camera_body.board.holes_mm[{i}]");
        on_board(field.clone(), at, radius_mm, "the hole")?;
        let distance = |other: &[f64; 2]| DVec2::from_array(*other).distance(DVec2::from_array(*at));
        if board.holes_mm[..i].iter().any(|other| distance(other) <= 2.0 * radius_mm) {
            let problem = "the hole overlaps another";
            return Err(DesignError::at(field, json!(at), problem, "holes apart by more than a diameter"));
        }
    }
    Ok(())
}
