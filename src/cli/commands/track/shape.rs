//! The files of `track --shape`.

use std::path::Path;

use serde_json::json;

use super::arguments::TrackArguments;
use super::decode;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use domecast_files::{OutputRules, StagedFolder};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::{ShapeError, ShapeFromColor, ShapeMap, ShapeOptions, npy_f32, npy_u8};
use domecast_runtime::track::{CameraFrame, ForceDistribution, PressureMap, Tracked, Tracker};

/// What reads the shape, and the folder for its maps.
pub struct ShapeFiles {
    shape: ShapeFromColor,
    folder: StagedFolder,
    pressure: PressureMap,
}

impl ShapeFiles {
    /// `None` where no shape is asked for. The frame at rest is tracked with a tracker of its own.
    pub fn open(
        arguments: &TrackArguments,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
    ) -> Result<Option<Self>, Failure> {
        let Some(path) = &arguments.shape else { return Ok(None) };
        let of_constants = |error: ShapeError| unfit(&arguments.constants, &error);
        let mut shape =
            ShapeFromColor::new(constants, tracker, ShapeOptions::default()).map_err(of_constants)?;
        if let Some(rest) = &arguments.rest {
            let bytes = std::fs::read(rest).map_err(|error| {
                input_fault(rest, format!("cannot be read: {error}"), "a PNG or JPEG frame")
            })?;
            let fault = |problem: String| input_fault(rest, problem, "a frame of the untouched sensor");
            let picture = decode::picture(&bytes).map_err(&fault)?;
            let frame = CameraFrame::new(picture.width, picture.height, picture.channels, &picture.bytes)
                .map_err(|error| fault(error.to_string()))?;
            let mut at_rest = tracker.clone();
            let tracked = at_rest.track(0, &frame).clone();
            shape.set_rest(&frame, &tracked).map_err(|error| unfit(rest, &error))?;
        }
        let folder = StagedFolder::new(path, "track", rules)?;
        Ok(Some(Self { shape, folder, pressure: PressureMap::default() }))
    }

    /// The last frame's.
    pub fn map(&self) -> &ShapeMap {
        self.shape.map()
    }

    /// Measures a frame.
    pub fn measure(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), Failure> {
        let measured = self.shape.measure(frame, tracked);
        measured.map(|_| ()).map_err(|error| unfit(Path::new("the frames"), &error))
    }

    /// Writes the measured frame's maps, and puts `contact` and `shape` into its JSON line, which ends with `}` and a line feed;
    /// the first into the second where forces have one of their own.
    pub fn write(
        &mut self,
        number: u64,
        line: Option<&mut Vec<u8>>,
        forces: Option<&mut ForceDistribution>,
    ) -> Result<(), Failure> {
        let map = self.shape.map();
        for (name, bytes) in files(map) {
            self.folder.write(&format!("frame_{number:04}.{name}"), &bytes)?;
        }
        let has_forces = forces.is_some();
        if let Some(forces) = forces {
            forces.draw_pressure(map, &mut self.pressure);
            let PressureMap { width, height, pressure_n_mm2, pressure_sd_n_mm2 } = &self.pressure;
            for (name, values) in [("pressure", pressure_n_mm2), ("pressure_sd", pressure_sd_n_mm2)] {
                let bytes = npy_f32(&[*height, *width], values.iter().copied());
                self.folder.write(&format!("frame_{number:04}.{name}.npy"), &bytes)?;
            }
        }
        let Some(line) = line else { return Ok(()) };
        while line.last().is_some_and(|byte| matches!(byte, b'\n' | b'}')) {
            line.pop();
        }
        line.extend_from_slice(format!(",{}}}\n", members(map, has_forces)).as_bytes());
        Ok(())
    }

    /// Puts the folder in its place.
    pub fn end(self, output: &Output) -> Result<(), Failure> {
        output.kept(self.folder.commit()?);
        Ok(())
    }
}

fn files(map: &ShapeMap) -> [(&'static str, Vec<u8>); 4] {
    let grid = [map.height, map.width];
    [
        ("height.npy", npy_f32(&grid, map.height_mm.iter().copied())),
        ("height_sd.npy", npy_f32(&grid, map.height_sd_mm.iter().copied())),
        ("contact.npy", npy_u8(&grid, &map.is_touched.iter().map(|is| u8::from(*is)).collect::<Vec<u8>>())),
        ("normal.npy", npy_f32(&[map.height, map.width, 3], map.normal.iter().flat_map(|n| n.to_array()))),
    ]
}

fn unfit(path: &Path, error: &ShapeError) -> Failure {
    input_fault(path, error.to_string(), "what shape from colour needs")
}

/// The members of a JSON line that the shape adds.
fn members(map: &ShapeMap, has_forces: bool) -> String {
    let mut shape = match &map.status {
        None => json!({ "status": "no_pose" }),
        Some(solved) => json!({
            "status": if solved.is_converged { "ok" } else { "not_converged" },
            "rounds": solved.rounds, "residual": solved.residual, "last_step_mm": solved.last_step_mm,
        }),
    };
    let round = |v: f64| (v * 1e6).round() / 1e6;
    let point = |at: glam::DVec3| at.to_array().map(round);
    let contact = map.contact.as_ref().map(|contact| {
        json!({
            "area_mm2": round(contact.area_mm2),
            "point_mm": point(contact.point_mm),
            "normal": point(contact.normal),
            "deepest_mm": point(contact.deepest_mm),
            "depth_mm": round(contact.depth_mm),
            "depth_sd_mm": round(contact.depth_sd_mm),
            "curvatures_per_mm": contact.curvatures_per_mm.map(|both| both.map(round)),
            "outline_px": contact.outline_px.iter().map(|at| at.to_array()).collect::<Vec<_>>(),
        })
    });
    // what touches as a whole stands in the line already where forces are asked for
    if has_forces {
        shape["contact"] = json!(contact);
        return format!("\"shape\":{shape}");
    }
    format!("\"contact\":{},\"shape\":{shape}", json!(contact))
}
