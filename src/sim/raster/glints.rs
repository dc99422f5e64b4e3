//! The lights' images in the sheet's faces, laid over a picture.

use crate::effect_name::EffectName;
use crate::light::gloss::Gloss;
use crate::raster::coverage::Coverage;
use crate::raster::frame::Frame;
use crate::raster::rolled::Slice;
use crate::raster::sensor_state::units;
use crate::work::Work;

/// Counted work of a way by a face.
pub(crate) const WAY_UNITS: u64 = 1_500;

/// Adds the light of what is mirrored to a picture, of which slices of rows are seen at times of their own.
pub(crate) fn lay(
    gloss: &Gloss,
    slices: &[Slice<'_>],
    frame: &mut Frame,
    coverage: &mut Coverage,
    work: &mut Work,
) {
    let (width, height) = (frame.width(), frame.height());
    for slice in slices {
        let Some(optics) = slice.instant.eye.optics(0) else { continue };
        work.add(EffectName::Gloss, gloss.way_count() * WAY_UNITS);
        for glint in gloss.glints(optics) {
            coverage.fill(&glint.corners_px);
            work.add(EffectName::Gloss, coverage.area() as u64 * units::PIXEL);
            for (y, x, part) in coverage.rows(width, height).filter(|(y, ..)| slice.rows().contains(y)) {
                let start = y * width + x;
                for (plane, level) in frame.planes.iter_mut().zip(glint.level) {
                    let Some(row) = plane.get_mut(start..start + part.len()) else { continue };
                    for (value, share) in row.iter_mut().zip(part) {
                        *value += share * level;
                    }
                }
            }
        }
    }
}
