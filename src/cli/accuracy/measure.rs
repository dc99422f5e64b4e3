//! The measurement: one sweep after the other, then what the errors come to.

use super::budget::{self, ErrorBudget};
use super::clock::TimeLimit;
use super::result::{Accuracy, AccuracyError, Machine, SettingRecord};
use super::sweep::Sweep;
use super::tracking;
use super::{
    contact, frames, lens, light, meshes, monte_carlo, outline, placement, pose, shape, supersampling,
};
use crate::touch_scene;
use domecast_design::layout::report::LayoutReport;
use domecast_design::layout::{Layout, LayoutError, LayoutSpec};
use domecast_design::parts::{Measures, Part, PartError, build};
use domecast_design::settings::{Setting, Settings};
use domecast_design::{Design, DesignError, claims_of, suspension_of};
use domecast_fab::constants;
use domecast_fab::light::marker_noise_px;
use domecast_runtime::constants::Constants;
use domecast_sim::Scene;

/// Steps of [`measure`], for a progress bar.
pub const STEPS: u32 = 13;

/// What the sweeps are made on, and what they gave.
struct Measurement<'a> {
    design: &'a Design,
    settings: &'a Settings,
    spec: LayoutSpec,
    layout: Layout,
    constants: Constants,
    parts: Vec<Part>,
    time_limit: TimeLimit,
    quick: bool,
    step: &'a mut dyn FnMut(u32, &str),
    sweeps: Vec<Sweep>,
    left_out: Vec<String>,
}

/// Measures a design, and frames and runtime on a scene of it: the one that is given, or a ball pressed onto it;
/// `step` gets how many of [`STEPS`] are done and what comes next.
///
/// # Errors
/// Those of a build of the design.
pub fn measure(
    design: &Design,
    scene: Option<&Scene>,
    quick: bool,
    step: &mut dyn FnMut(u32, &str),
) -> Result<Accuracy, AccuracyError> {
    step(0, "laying out and making the parts");
    let as_design = |error: LayoutError| DesignError::from(error);
    let spec = LayoutSpec::of_design(design).map_err(as_design)?;
    let layout = Layout::new(&spec).map_err(as_design)?;
    let judged = LayoutReport::new(design, &spec, &layout);
    let settings = design.settings();
    let mut on = Measurement {
        design,
        settings,
        constants: constants::of(design, &layout)?,
        parts: build(&Measures::of(design)?, &layout.passes)?,
        spec,
        layout,
        time_limit: if quick { TimeLimit::QUICK } else { TimeLimit::FULL },
        quick,
        step,
        sweeps: Vec::new(),
        left_out: Vec::new(),
    };
    on.geometry()?;
    on.loads();
    on.simulator(scene);
    (on.step)(12, "the error budgets");
    let Measurement { layout, constants, sweeps, left_out, .. } = on;
    let budgets: Vec<ErrorBudget> =
        [budget::of_dots(design, &layout, &judged, &sweeps), budget::of_force(design, &constants, &sweeps)]
            .into_iter()
            .flatten()
            .collect();
    Ok(Accuracy {
        design: design.name().to_owned(),
        version: env!("CARGO_PKG_VERSION"),
        machine: Machine::here(),
        quick,
        settings: setting_records(settings),
        sweeps,
        budgets,
        frames_to_average: frames_to_average(design),
        left_out,
    })
}

impl Measurement<'_> {
    /// Keeps a sweep, or the reason why there is none.
    fn keep(&mut self, sweep: Option<Sweep>, otherwise: &str) {
        match sweep {
            Some(sweep) => self.sweeps.push(sweep),
            None => self.left_out.push(otherwise.to_owned()),
        }
    }

    /// Lens, places of dots, outlines, meshes.
    fn geometry(&mut self) -> Result<(), AccuracyError> {
        let (design, time_limit) = (self.design, self.time_limit);
        let asked = design.sections().accuracy.as_ref();
        (self.step)(1, "the lens's inverse");
        let image_px = asked.map(|asked| asked.image_px);
        self.keep(
            lens::sweep(design.optics().lens(), &self.layout, image_px, time_limit),
            "the lens's inverse: a pinhole has no distortion to invert",
        );
        (self.step)(2, "dots on the dome");
        let placement_mm = asked.map(|asked| asked.dot_placement_mm);
        self.keep(
            placement::sweep(design.optics(), &self.layout, placement_mm, time_limit),
            "dots on the dome: the optics have no model without refraction",
        );
        (self.step)(3, "outlines");
        let in_use_mm = self.settings.outline_tolerance_mm.value;
        self.keep(
            outline::sweep(&self.spec, &self.layout, in_use_mm, placement_mm, time_limit),
            "outlines: no dot is printed",
        );
        (self.step)(4, "meshes");
        let in_use_mm = self.settings.chord_tolerance_mm.value;
        let mesh = meshes::sweep(&self.parts, in_use_mm, asked.map(|a| a.mesh_mm), time_limit, self.quick);
        self.keep(Some(mesh.map_err(|error| PartError::Mesh { part: "sweep".into(), error })?), "");
        Ok(())
    }

    /// Poses, drawn sensors, contact.
    fn loads(&mut self) {
        let (design, time_limit, quick) = (self.design, self.time_limit, self.quick);
        let asked = design.sections().accuracy.as_ref();
        let image_px = asked.map(|asked| asked.image_px);
        (self.step)(5, "poses");
        self.keep(
            pose::sweep(&self.constants, asked.map(|asked| asked.force_n), time_limit),
            "poses: the white markers cannot be followed",
        );
        (self.step)(6, "drawn sensors");
        let tolerances = &design.sections().tolerances;
        let drawn = self.settings.samples.value;
        self.keep(
            monte_carlo::sweep(&self.spec, &self.layout, tolerances, drawn, image_px, time_limit, quick),
            "drawn sensors: too few of them see all dots",
        );
        (self.step)(7, "a touch");
        let px_per_mm = budget::scales(design.optics(), &self.layout).map(|(px_per_mm, _)| px_per_mm);
        let touch_mm = image_px.zip(px_per_mm).map(|(px, px_per_mm)| px / px_per_mm);
        match contact::sweep(design, &self.layout, touch_mm, time_limit, quick) {
            Ok(sweep) => self.keep(Some(sweep), ""),
            Err(error) => self.keep(None, &format!("a touch: {error}")),
        }
    }

    /// Light, edges of dots, frames, and the runtime on these frames.
    fn simulator(&mut self, scene: Option<&Scene>) {
        let (time_limit, quick) = (self.time_limit, self.quick);
        (self.step)(8, "light");
        let own;
        let scene = match scene {
            Some(scene) => Ok(scene),
            None => {
                own = touch_scene::scene(self.design);
                own.as_ref().map_err(ToString::to_string)
            }
        };
        match scene.clone().and_then(|s| light::sweeps(s, time_limit, quick).map_err(|e| e.to_string())) {
            Ok(found) if found.is_empty() => {
                self.keep(None, "light: the scene has none of the design's lights");
            }
            Ok(found) => found.into_iter().for_each(|sweep| self.keep(Some(sweep), "")),
            Err(error) => self.keep(None, &format!("light: {error}")),
        }
        (self.step)(9, "frames");
        let grey = scene.as_ref().ok().map(|scene| scene.file().tolerance.grey);
        let image = self.design.optics().lens().spec();
        let size = (image.width as usize, image.height as usize);
        self.keep(
            supersampling::sweep(&self.layout, size, grey, time_limit, quick),
            "edges of dots: the pattern has none",
        );
        match scene.clone().and_then(|scene| frames::sweep(scene, quick).map_err(|error| error.to_string())) {
            Ok((sweep, sequence)) => {
                self.keep(Some(sweep), "");
                (self.step)(10, "the runtime");
                self.keep(
                    tracking::sweep(&self.constants, &sequence, time_limit),
                    "the runtime: the scene draws no frames, or the constants fit no tracker",
                );
            }
            Err(error) => self.keep(None, &format!("frames and the runtime: {error}")),
        }
        (self.step)(11, "shape from colour");
        let shaped = scene.and_then(|scene| {
            let found = shape::sweep(self.design, &self.constants, scene, time_limit, quick);
            found.map_err(|error| error.to_string())
        });
        match shaped {
            Ok(sweep) => self.keep(sweep, "shape from colour: scene or constants have no light to read by"),
            Err(error) => self.keep(None, &format!("shape from colour: {error}")),
        }
    }
}

/// Frames to average for the design's `accuracy.force_n`, at rest and under every claimed load.
fn frames_to_average(design: &Design) -> Option<u32> {
    let suspension = suspension_of(design).ok()?;
    let held = claims_of(design, &suspension);
    let poses: Vec<_> = held.iter().filter_map(|case| Some(case.equilibrium.as_ref().ok()?.pose)).collect();
    constants::frames_to_average(design, &marker_noise_px(design).ok()?, &suspension, &poses)
}

fn setting_records(settings: &Settings) -> Vec<SettingRecord> {
    fn record<T>(setting: &Setting<T>, value: f64) -> SettingRecord {
        let because = setting.because.clone();
        SettingRecord { field: setting.field, value, chosen: setting.chosen, because }
    }
    let mm = |setting: &Setting<f64>| record(setting, setting.value);
    vec![
        mm(&settings.outline_tolerance_mm),
        mm(&settings.chord_tolerance_mm),
        mm(&settings.optical_chord_tolerance_mm),
        record(&settings.samples, f64::from(settings.samples.value)),
    ]
}
