//! What several steps of a build need of a design: its dots laid out, its parts made and checked.

use crate::constants;
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_design::parts::{self, PartError};
use domecast_design::{Design, DesignError};

/// The parts, checked in their assembly, and their files.
pub(super) struct MadeParts {
    pub made: Vec<parts::Part>,
    pub assembly: parts::Assembly,
    pub checked: parts::CheckedSensor,
    pub files: Vec<parts::PartFile>,
    /// Names of the positions at which the assembly was checked.
    pub poses: Vec<String>,
}

/// Makes, assembles and checks the parts, and writes their files.
pub(super) fn make_parts(
    design: &Design,
    layout: &Layout,
    springs: &constants::DesignSprings,
) -> Result<MadeParts, PartError> {
    let measures = springs.sight.measures()?;
    let cured = |fault| parts::with_tried_cures(design, &layout.passes, fault);
    let made = parts::build_seated(design, measures, &layout.passes).map_err(cured)?;
    let (assembly, mut checked) = assemble(design, layout, measures, &made)?;
    checked.notes.extend(parts::stroke_notes(measures, &layout.passes));
    let files = parts::files(design, measures, &made, &assembly)?;
    let poses = measures.poses.iter().map(|pose| pose.name.clone()).collect();
    Ok(MadeParts { made, assembly, checked, files, poses })
}

/// The faults of the parts and of their assembly, without a search for what takes them away.
pub(super) fn check_parts(
    design: &Design,
    layout: &Layout,
    springs: &constants::DesignSprings,
) -> Result<(), PartError> {
    let measures = springs.sight.measures()?;
    let made = parts::build_seated(design, measures, &layout.passes)?;
    assemble(design, layout, measures, &made).map(|_| ())
}

fn assemble(
    design: &Design,
    layout: &Layout,
    measures: &parts::Measures,
    made: &[parts::Part],
) -> Result<(parts::Assembly, parts::CheckedSensor), PartError> {
    let assembly = parts::Assembly::of(measures, made)?;
    let checked = parts::check_sensor(design, measures, made, &assembly, &layout.dots)?;
    Ok((assembly, checked))
}

/// The layout of a design's dots, and what it was made from.
pub(super) fn lay_out(design: &Design) -> Result<(LayoutSpec, Layout), DesignError> {
    let spec = LayoutSpec::of_design(design)?;
    let layout = Layout::new(&spec)?;
    Ok((spec, layout))
}
