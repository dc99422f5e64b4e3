//! The parts that are printed, cut and cast, as exact solids and as meshes.
//!
//! Every dimension comes from the resolved design through [`Measures`]; a part
//! is first a [`Construction`] of exact shapes, then a mesh. What a part should
//! be is stated beside it, from the count of its features and not from the
//! mesh: the number of holes through it ([`Part::genus`]) is checked against the mesh by
//! [`Part::check`], and again by independent programs that read the written
//! file.
//!
//! Frames: the platforms are in the sensor frame at rest, the mould has its own
//! with the parting plane at z = 0 and the cavity below.
//!
//! ```
//! use domecast_design::Design;
//! use domecast_design::parts::{self, Measures};
//!
//! let design: Design = include_str!("../../../designs/thumb24.json").parse()?;
//! let made = parts::build(&Measures::of(&design)?, &design.layout()?.passes).expect("parts that can be made");
//! assert!(made.iter().any(|part| part.name == "upper_platform" && part.check().is_ok()));
//! # Ok::<(), domecast_design::DesignError>(())
//! ```

mod accessories;
mod assembly;
mod bearing;
mod board;
mod board_seat;
mod bom;
mod checks;
mod drawing;
mod error;
mod feature;
mod files;
mod hood;
mod image_rays;
mod light_ways;
mod lip;
mod lower;
mod measures;
mod meeting;
mod mould;
mod mount;
mod openings;
mod pits;
mod poses;
mod process;
mod purchased;
mod remedy;
mod screws;
mod seats;
mod sight;
mod traced;
mod trial;
mod undercut;
mod upper;
mod verdict;
mod view;
mod walls;

#[cfg(test)]
pub(crate) mod tests;

use std::io::{self, Write};

use glam::DAffine3;
use rayon::prelude::*;

pub use accessories::stroke_notes;
pub use assembly::{Assembly, AssemblyItem};
pub use checks::check_assembly;
pub use error::{Cure, PartError};
use feature::{Blueprint, Feature};
pub use files::{PartFile, files};
pub use hood::highest_hood_rim_mm;
pub use image_rays::RayKind;
pub use lip::HidingLip;
pub use measures::Measures;
pub use pits::{min_well_floor_mm, missing_light_wall_mm};
pub use poses::Pose;
pub use sight::{EdgeRay, MarkerView, markers_of};
pub use traced::{PoseSight, RayCount, trace_sight};
pub use verdict::{CheckedSensor, build_seated, check_light_room, check_sensor, with_tried_cures};
pub use view::ViewCone;

use crate::layout::PrintPass;
use crate::spec::sections::LedsSection;
use domecast_mesh::{BoundingBox, Construction, Inspection, TriMesh, inspect, truck_modeling, write_stl};

/// One part, ready to be written.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name, also of its files: `upper_platform`.
    pub name: String,
    /// One line on what it is and what it is made of.
    pub summary: &'static str,
    /// The exact shapes that it is made of.
    pub construction: Construction,
    /// Tolerance that the mesh was made with.
    pub chord_tolerance_mm: f64,
    /// The mesh as a reader of the STL gets it: vertices rounded to `f32` and
    /// welded.
    pub mesh: TriMesh,
    /// Volume before rounding to `f32`, mm^3.
    pub volume_mm3: f64,
    /// Surface, mm^2.
    pub area_mm2: f64,
    /// Holes through the part, by the count of its features.
    pub genus: i64,
    /// Box of the mesh.
    pub bounds: BoundingBox,
}

type Maker = fn(&Measures) -> Result<Blueprint, PartError>;

/// Name of the part that only a design with white markers has.
const STENCIL: &str = "marker_stencil";

/// The parts of a design by name, in their order.
const MAKERS: [(&str, Maker); 7] = [
    ("upper_platform", upper::blueprint),
    ("lower_platform", lower::blueprint),
    ("mould_cavity", mould::cavity),
    ("mould_base", mould::base),
    ("acrylic_sheet", accessories::sheet),
    (STENCIL, accessories::stencil),
    ("fit_coupon", accessories::coupon),
];

/// Name of the jig of a print pass.
fn jig_name(i: usize, passes: &[PrintPass]) -> String {
    if passes.len() == 1 { "print_jig".to_owned() } else { format!("print_jig_{i}") }
}

/// A part before it is meshed, by its name.
fn blueprint_of(m: &Measures, name: &str, passes: &[PrintPass]) -> Option<Result<Blueprint, PartError>> {
    if let Some((_, make)) = MAKERS.iter().find(|(known, _)| *known == name) {
        return Some(make(m));
    }
    let pass = (0..passes.len()).find(|i| jig_name(*i, passes) == name)?;
    passes.get(pass).map(|pass| accessories::jig(m, name, pass))
}

impl Blueprint {
    /// Meshes the part, checks its walls, and looks at what came out.
    fn build(&self, m: &Measures) -> Result<Part, PartError> {
        let construction = self.construction();
        let made = construction.solid(self.chord).map(|solid| solid.to_mesh());
        // First the walls: they tell better what is wrong with a part that cannot be made.
        walls::check(self, m, made.as_ref().ok())?;
        let in_f64 = made.map_err(|error| PartError::Mesh { part: self.name.clone(), error })?;
        let mesh = in_f64.welded_f32();
        let broken =
            |problem: String| PartError::Broken { part: self.name.clone(), problem, field: String::new() };
        let bounds = mesh.bounds().ok_or_else(|| broken("the mesh is empty".into()))?;
        let genus = match inspect(&mesh).genus() {
            Some(found) if self.genus_is_min => found.max(self.genus),
            _ => self.genus,
        };
        let part = Part {
            name: self.name.clone(),
            summary: self.summary,
            construction,
            chord_tolerance_mm: self.chord.tolerance_mm(),
            volume_mm3: in_f64.volume_mm3(),
            area_mm2: in_f64.area_mm2(),
            genus,
            bounds,
            mesh,
        };
        part.check().map_err(|fault| self.with_meetings(fault, m.process.min_wall_mm))?;
        Ok(part)
    }

    /// A broken part with the features that break it.
    fn with_meetings(&self, fault: PartError, min_wall_mm: f64) -> PartError {
        let PartError::Broken { part, problem, .. } = fault else { return fault };
        let found = meeting::meetings(self, min_wall_mm);
        let problem = format!("{problem}: {}", found.text);
        PartError::Broken { part, problem, field: found.fields.join(" or ") }
    }
}

impl Part {
    /// Looks at the welded mesh.
    pub fn inspect(&self) -> Inspection {
        inspect(&self.mesh)
    }

    /// One closed solid with as many holes through it as were designed?
    ///
    /// # Errors
    /// [`PartError::Broken`] with what is wrong.
    pub fn check(&self) -> Result<(), PartError> {
        let found = self.inspect();
        let problem = found.problem().or_else(|| {
            let genus = found.genus()?;
            (genus != self.genus).then(|| {
                format!(
                    "its mesh has {genus} holes through the part, its features make {}: features touch or miss",
                    self.genus
                )
            })
        });
        match problem {
            None => Ok(()),
            Some(problem) => {
                Err(PartError::Broken { part: self.name.clone(), problem, field: String::new() })
            }
        }
    }

    /// The part with exact faces, to be measured, written or worked on with `truck-modeling`; `None` if it is no
    /// plate with upright, separate features.
    pub fn exact_solid(&self) -> Option<truck_modeling::Solid> {
        self.construction.exact_solid()
    }

    /// Writes the mesh as binary STL.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_stl(&self, writer: &mut impl Write) -> io::Result<()> {
        write_stl(&self.mesh, writer)
    }
}

/// The upper platform as exact shapes in the sensor frame, before any mesh: what stands in the way of the lights.
///
/// # Errors
/// A platform that the design cannot have.
pub fn upper_platform(measures: &Measures) -> Result<Construction, PartError> {
    Ok(upper::blueprint(measures)?.construction())
}

/// Pose of LED `i`: origin at the centre of its emitting face, x across the board, y up the board, z out of the
/// emitting face; sensor frame.
pub fn platform_from_led(leds: &LedsSection, i: usize) -> DAffine3 {
    measures::platform_from_led(leds, i)
}

/// Makes all parts, in a fixed order, and checks each against the process. One
/// pad-printing jig is made for each print pass.
///
/// # Errors
/// Why parts cannot be made: the first fault of each, in that order.
pub fn build(m: &Measures, passes: &[PrintPass]) -> Result<Vec<Part>, PartError> {
    let makers: Vec<Maker> = MAKERS
        .iter()
        // No markers, no stencil.
        .filter(|(name, _)| *name != STENCIL || !m.markers_mm.is_empty())
        .map(|(_, make)| *make)
        .collect();
    let results: Vec<Result<Part, PartError>> = (0..makers.len() + passes.len())
        .into_par_iter()
        .filter_map(|i| {
            let maker = makers.get(i).map(|make| make(m));
            let jig = |i: usize| accessories::jig(m, &jig_name(i, passes), &passes[i]);
            maker.or_else(|| Some(jig(i.checked_sub(makers.len())?)))
        })
        .map(|blueprint| blueprint?.build(m))
        .collect();
    let (mut made, mut faults) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(part) => made.push(part),
            Err(fault) => faults.push(fault),
        }
    }
    PartError::all(faults).map(|()| made)
}
