//! What each pixel of a frame sees of the membrane: place, normal, displacement, and what bears on it there.
//!
//! Each pixel's chief ray in the reference channel (green) goes through lens and layers as the picture's rays do, with the
//! effects that the plan uses, and meets the membrane where it is at the frame's time; exposure and rolling shutter do not blur
//! these maps.

use glam::{DVec2, DVec3, Vec3A};
use rayon::prelude::*;
use serde::Serialize;

use crate::contact::between::Between;
use crate::contact::displacement_map::{DisplacementMap, MAX_OFF_RAY_MM};
use crate::raster::sensor_state::SensorState;
use domecast_contact::ContactState;
use domecast_files::{npy_f32, png_u16};
use domecast_optics::SensorOptics;

/// The depth picture's steps, mm: the finest at which 16 bits hold the farthest point.
const STEPS_MM: [f64; 3] = [0.001, 0.01, 0.1];

/// The depth picture's name among the maps; it stands in a folder of its own, or a tracker would take it for a frame.
const DEPTH_PNG: &str = "depth.png";
pub(super) const DEPTH_FOLDER: &str = "depth";

/// What a pixel sees.
#[derive(Debug, Clone, Copy)]
struct SeenPoint {
    surface_mm: DVec3,
    displacement_mm: DVec3,
    normal: DVec3,
    /// Area of the membrane there over that at rest.
    area_ratio: f64,
}

/// The maps of a frame, on the raw image's grid, row by row from the top; NaN where no dome is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMaps {
    /// Height and width, px.
    pub size: [usize; 2],
    /// The point of the membrane that the pixel sees, sensor frame, mm.
    pub surface_mm: Vec<[f32; 3]>,
    /// The membrane's outward unit normal there.
    pub normal: Vec<[f32; 3]>,
    /// How far that point of the membrane has moved from where it is at rest, mm.
    pub displacement_mm: Vec<[f32; 3]>,
    /// What bears on the membrane there; `None` where contact takes no part in the frames.
    pub bearing: Option<BearingMaps>,
    /// Depth of the point along the camera's axis from the camera's origin, in steps, 0 where no dome is seen.
    pub depth: Vec<u16>,
    /// What the truth says of them.
    pub truth: DepthTruth,
}

/// What bears on the membrane, over its area as it is now.
#[derive(Debug, Clone, PartialEq)]
pub struct BearingMaps {
    /// Force that the objects put on it over its area, sensor frame, N/mm2.
    pub traction_n_mm2: Vec<[f32; 3]>,
    /// Its part against the outward normal, N/mm2.
    pub pressure_n_mm2: Vec<f32>,
}

/// How the maps of a frame are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DepthTruth {
    /// Pixels that see the dome.
    pub seen_px: usize,
    /// A step of `depth/frame_NNNN.png`, mm: depth along the camera's axis from its origin is the number times this; 0 where
    /// no dome is seen.
    pub mm_per_level: f64,
}

impl DepthMaps {
    /// What the pixels of a picture of this width and height see of the sensor; `around_contact` is what touches it,
    /// `Some(None)` where nothing does in this frame.
    pub(crate) fn new(
        state: &SensorState,
        optics: &SensorOptics,
        (width, height): (usize, usize),
        map_step_mm: f64,
        contact: Option<Option<&ContactState>>,
    ) -> Self {
        let own;
        let map = match (&state.shape.map, &state.shape.touch) {
            (Some(map), _) => Some(map),
            (None, Some(touch)) => {
                own = map_of(touch, optics, map_step_mm);
                own.as_ref()
            }
            (None, None) => None,
        };
        let seen: Vec<Option<SeenPoint>> = (0..height * width)
            .into_par_iter()
            .map(|i| see(optics, map, DVec2::new((i % width) as f64, (i / width) as f64)))
            .collect();
        let vectors = |of: &dyn Fn(&SeenPoint) -> DVec3| -> Vec<[f32; 3]> {
            let short = |seen: &Option<SeenPoint>| match seen {
                Some(seen) => of(seen).as_vec3().to_array(),
                None => [f32::NAN; 3],
            };
            seen.iter().map(short).collect()
        };
        let camera_from_sensor = optics.sensor_from_camera().inverse();
        let depth_mm = |seen: &SeenPoint| camera_from_sensor.point(seen.surface_mm).z;
        let farthest_mm = seen.iter().flatten().map(depth_mm).fold(0.0, f64::max);
        let [.., coarsest] = STEPS_MM;
        let holds = |step_mm: &f64| farthest_mm <= step_mm * f64::from(u16::MAX);
        let mm_per_level = STEPS_MM.into_iter().find(holds).unwrap_or(coarsest);
        let level = |seen: &Option<SeenPoint>| {
            seen.as_ref().map_or(0, |seen| (depth_mm(seen) / mm_per_level).round().max(1.0) as u16)
        };
        Self {
            size: [height, width],
            surface_mm: vectors(&|seen| seen.surface_mm),
            normal: vectors(&|seen| seen.normal),
            displacement_mm: vectors(&|seen| seen.displacement_mm),
            bearing: contact.map(|contact| BearingMaps::new(&seen, contact)),
            depth: seen.iter().map(level).collect(),
            truth: DepthTruth { seen_px: seen.iter().flatten().count(), mm_per_level },
        }
    }

    /// The files of frame `number` by name.
    ///
    /// # Errors
    /// A depth picture that cannot be coded.
    pub(super) fn files(&self, number: u32) -> Result<Vec<(String, Vec<u8>)>, png::EncodingError> {
        let of_points = [self.size[0], self.size[1], 3];
        let points = |values: &[[f32; 3]]| npy_f32(&of_points, values.as_flattened().iter().copied());
        let mut files = vec![
            ("surface.npy", points(&self.surface_mm)),
            ("normal.npy", points(&self.normal)),
            ("displacement.npy", points(&self.displacement_mm)),
            (DEPTH_PNG, png_u16(self.size, &self.depth)?),
        ];
        if let Some(bearing) = &self.bearing {
            files.push(("traction.npy", points(&bearing.traction_n_mm2)));
            files.push(("pressure.npy", npy_f32(&self.size, bearing.pressure_n_mm2.iter().copied())));
        }
        let named = |(name, bytes): (&str, Vec<u8>)| match name {
            DEPTH_PNG => (format!("{DEPTH_FOLDER}/frame_{number:04}.png"), bytes),
            name => (format!("frame_{number:04}.{name}"), bytes),
        };
        Ok(files.into_iter().map(named).collect())
    }
}

impl BearingMaps {
    fn new(seen: &[Option<SeenPoint>], contact: Option<&ContactState>) -> Self {
        let rest_mm: Vec<DVec3> =
            seen.iter().flatten().map(|seen| seen.surface_mm - seen.displacement_mm).collect();
        let mut over_rest = vec![DVec3::ZERO; rest_mm.len()];
        if let Some(contact) = contact {
            // the slices have one length
            let _ = contact.tractions_mpa(&rest_mm, &mut over_rest);
        }
        let mut next = over_rest.into_iter();
        let (mut traction_n_mm2, mut pressure_n_mm2) = (Vec::new(), Vec::new());
        for seen in seen {
            let of = |seen: &SeenPoint| {
                let traction = next.next().unwrap_or_default() / seen.area_ratio;
                (traction.as_vec3().to_array(), -traction.dot(seen.normal) as f32)
            };
            let (traction, pressure) = seen.as_ref().map_or(([f32::NAN; 3], f32::NAN), of);
            traction_n_mm2.push(traction);
            // no minus zero
            pressure_n_mm2.push(pressure + 0.0);
        }
        Self { traction_n_mm2, pressure_n_mm2 }
    }
}

fn map_of(touch: &Between, optics: &SensorOptics, step_mm: f64) -> Option<DisplacementMap> {
    let map = touch.is_deformed().then(|| DisplacementMap::new(touch, *optics.dome(), step_mm))?;
    map.map(|(map, _)| map)
}

/// What a pixel sees; `None` beside the dome.
fn see(optics: &SensorOptics, map: Option<&DisplacementMap>, pixel: DVec2) -> Option<SeenPoint> {
    // A ray that comes up beside the base is followed back to below it.
    let (rest_mm, inside) = optics.trace_continued(pixel).ok().filter(|(at_mm, _)| at_mm.z >= 0.0)?;
    let met = map.and_then(|map| Some((map, map.meet(rest_mm.as_vec3a(), inside.as_vec3a(), Vec3A::ZERO)?)));
    let Some((map, (material_mm, displaced))) = met else {
        let normal = optics.dome().normal(rest_mm);
        return Some(SeenPoint {
            surface_mm: rest_mm,
            displacement_mm: DVec3::ZERO,
            normal,
            area_ratio: 1.0,
        });
    };
    let displacement_mm = displaced.displacement_mm.as_dvec3();
    let surface_mm = material_mm.as_dvec3() + displacement_mm;
    let off_mm = (surface_mm - rest_mm).reject_from(inside).length();
    let seen = SeenPoint {
        surface_mm,
        displacement_mm,
        normal: displaced.normal.as_dvec3().normalize_or_zero(),
        area_ratio: f64::from(map.area_ratio(material_mm)),
    };
    (off_mm <= f64::from(MAX_OFF_RAY_MM)).then_some(seen)
}
