//! The files of `track --shape`.

use std::path::Path;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde_json::json;

use super::arguments::TrackArguments;
use crate::commands::input::input_fault;
use crate::commands::output::{Failure, Output};
use crate::commands::rest_frame::RestFrame;
use domecast_files::{OutputRules, StagedFolder, npy_f32, npy_u8, ply, png_u16};
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::{ShapeError, ShapeFromColor, ShapeMap};
use domecast_runtime::track::{CameraFrame, Tracked, Tracker};
use domecast_runtime::traction::{ForceDistribution, PressureMap};

/// What reads the shape, and the folder for its maps.
pub struct ShapeFiles {
    shape: ShapeFromColor,
    folder: StagedFolder,
    pressure: PressureMap,
    /// Frames whose skin lies above its shape at rest.
    raised: u64,
    /// Frames of whose skin a large part is not known, and the largest.
    unknown: (u64, f64),
}

/// Heights with a larger deviation than this, mm, say nothing of a touch; more than so large a part of the skin without is named: under lights as
/// they are meant to be it is 0.003 on three designs.
const UNKNOWN_SD_MM: f32 = 0.1;
const MAX_UNKNOWN_PART: f64 = 0.05;

/// The part of the skin whose height is not known.
fn unknown_part(map: &ShapeMap) -> f64 {
    let known = map.height_sd_mm.iter().filter(|sd| sd.is_finite());
    let (all, unknown) =
        known.fold((0_u64, 0_u64), |(all, unknown), sd| (all + 1, unknown + u64::from(*sd > UNKNOWN_SD_MM)));
    unknown as f64 / all.max(1) as f64
}

impl ShapeFiles {
    /// `None` where no shape is asked for.
    pub fn open(
        output: &Output,
        arguments: &TrackArguments,
        rules: &OutputRules<'_>,
        constants: &Constants,
        tracker: &Tracker,
        rest: Option<&RestFrame>,
    ) -> Result<Option<Self>, Failure> {
        let Some(path) = &arguments.shape else { return Ok(None) };
        let of_constants = |error: ShapeError| unfit(&arguments.constants, &error);
        let mut shape = output.shape(constants, tracker).map_err(of_constants)?;
        if let Some(rest) = rest {
            let taken = shape.set_rest(&rest.frame()?, &rest.tracked);
            taken.map_err(|error| rest.fault(error.to_string()))?;
        }
        let folder = StagedFolder::new(path, "track", rules)?;
        Ok(Some(Self { shape, folder, pressure: PressureMap::default(), raised: 0, unknown: (0, 0.0) }))
    }

    /// Measures a frame.
    pub fn measure(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), Failure> {
        let measured = self.shape.measure(frame, tracked);
        let map = measured.map_err(|error| unfit(Path::new("the frames"), &error))?;
        self.raised += u64::from(map.is_raised);
        let part = unknown_part(map);
        if part > MAX_UNKNOWN_PART {
            self.unknown = (self.unknown.0 + 1, self.unknown.1.max(part));
        }
        Ok(())
    }

    /// The measured frame's shape.
    pub fn map(&self) -> &ShapeMap {
        self.shape.map()
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
        let has_forces = forces.is_some();
        if let Some(forces) = forces {
            forces.draw_pressure(map, &mut self.pressure);
        }
        let (folder, skin) = (&self.folder, (map, &self.pressure));
        let count = if has_forces { FILES.len() } else { FILES_OF_SHAPE };
        FILES[..count].par_iter().try_for_each(|(name, encode)| {
            let bytes = encode(skin).map_err(|error| Failure::Internal(error.to_string()))?;
            Ok::<(), Failure>(folder.write(&format!("frame_{number:04}.{name}"), &bytes)?)
        })?;
        let Some(line) = line else { return Ok(()) };
        while line.last().is_some_and(|byte| matches!(byte, b'\n' | b'}')) {
            line.pop();
        }
        line.extend_from_slice(format!(",{}}}\n", shape_members(map, has_forces)).as_bytes());
        Ok(())
    }

    /// Puts the folder in its place.
    pub fn end(self, output: &Output) -> Result<(), Failure> {
        if self.raised > 0 {
            output.warn(&format!(
                "frames whose skin lies above its shape at rest (`raised`): {}; the frame at rest was touched, or the skin is pulled or \
                 stained: give a frame at rest of the clean, untouched sensor",
                self.raised
            ));
        }
        let (frames, part) = self.unknown;
        if frames > 0 {
            output.warn(&format!(
                "frames of which a part of the skin has no height (`height_sd` above {UNKNOWN_SD_MM} mm): {frames}, up to {:.0} % of it; \
                 too much light or too little is the usual cause: no channel of the untouched skin at 0 or 255",
                100.0 * part
            ));
        }
        output.kept(self.folder.commit()?);
        Ok(())
    }
}

/// A level of the height picture, mm, and the level of the skin at rest; 0 where nothing is known.
const HEIGHT_STEP_MM: f32 = 0.001;
const AT_REST: f32 = 32768.0;

/// What a file of a frame is made of.
type Skin<'a> = (&'a ShapeMap, &'a PressureMap);
type Encode = fn(Skin<'_>) -> Result<Vec<u8>, png::EncodingError>;

/// The files of a frame, the dearest first, and how many of them need no forces.
const FILES: [(&str, Encode); 8] = [
    ("normal.npy", |(map, _)| {
        Ok(npy_f32(&[map.height, map.width, 3], map.normal.iter().flat_map(|n| n.to_array())))
    }),
    ("height.png", |(map, _)| height_png(map)),
    ("ply", |(map, _)| Ok(surface_ply(map))),
    ("height.npy", |(map, _)| Ok(npy_f32(&[map.height, map.width], map.height_mm.iter().copied()))),
    ("height_sd.npy", |(map, _)| Ok(npy_f32(&[map.height, map.width], map.height_sd_mm.iter().copied()))),
    ("contact.npy", |(map, _)| {
        Ok(npy_u8(&[map.height, map.width], map.is_touched.iter().map(|is| u8::from(*is))))
    }),
    ("pressure.npy", |(_, map)| Ok(npy_f32(&[map.height, map.width], map.pressure_n_mm2.iter().copied()))),
    ("pressure_sd.npy", |(_, map)| {
        Ok(npy_f32(&[map.height, map.width], map.pressure_sd_n_mm2.iter().copied()))
    }),
];
const FILES_OF_SHAPE: usize = 6;

fn height_png(map: &ShapeMap) -> Result<Vec<u8>, png::EncodingError> {
    let level = |height_mm: &f32| {
        let level = (AT_REST + height_mm / HEIGHT_STEP_MM).round();
        if level.is_nan() { 0 } else { level.clamp(1.0, f32::from(u16::MAX)) as u16 }
    };
    let levels: Vec<u16> = map.height_mm.iter().map(level).collect();
    png_u16([map.height, map.width], &levels)
}

/// The skin as triangles; its points' properties beside place and normal are `height_mm` and `height_sd_mm`.
fn surface_ply(map: &ShapeMap) -> Vec<u8> {
    const PROPERTIES: [&str; 8] = ["x", "y", "z", "nx", "ny", "nz", "height_mm", "height_sd_mm"];
    let surface = map.surface();
    let mut rows = Vec::with_capacity(PROPERTIES.len() * surface.points_mm.len());
    for (i, point) in surface.points_mm.iter().enumerate() {
        rows.extend(point.to_array());
        rows.extend(surface.normals[i].to_array());
        rows.extend([surface.heights_mm[i], surface.height_sds_mm[i]]);
    }
    ply(&PROPERTIES, rows.into_iter(), &surface.triangles)
}

fn unfit(path: &Path, error: &ShapeError) -> Failure {
    input_fault(path, error.to_string(), "what shape from colour needs")
}

/// The members of a JSON line that the shape adds, without what encloses them.
pub fn shape_members(map: &ShapeMap, has_forces: bool) -> String {
    let mut shape = json!({ "status": map.status_name() });
    if !map.lights_out.is_empty() {
        shape["lights_out"] = json!(map.lights_out);
    }
    if let Some(solved) = &map.status {
        shape["rounds"] = json!(solved.rounds);
        shape["residual"] = json!(solved.residual);
        shape["last_step_mm"] = json!(solved.last_step_mm);
        shape["light_gain"] =
            map.light_gain.iter().map(|gain| (f64::from(*gain) * 1e4).round() / 1e4).collect();
    }
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
            "edge": contact.edge.map(|edge| json!({ "direction": point(edge.direction), "sd_rad": round(edge.sd_rad) })),
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
