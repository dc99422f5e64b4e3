//! A scene, resolved.

use super::file::{MAX_FRAMES, SceneFile};
use super::motion::{Motion, State};
use super::object::SceneObject;
use crate::SimError;
use crate::effect_name::{EffectChoice, EffectName};
use domecast_design::layout::Layout;
use domecast_design::{Design, DesignError};
use domecast_files::Cache;
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;
use domecast_springs::Suspension;
use glam::DVec3;
use std::any::Any;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Points that carry a dot's outline.
pub const RIM_POINTS: usize = 8;

/// A printed dot.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneDot {
    /// Its number.
    pub id: u32,
    /// Its centre on the undeformed dome, sensor frame, mm.
    pub center_mm: DVec3,
    /// Its outline on the undeformed dome: points at equal steps of the outline's angle, sensor frame, mm.
    pub rim_mm: [DVec3; RIM_POINTS],
    /// Part of its width that is printed, and the angle of the outline at which the missing part lies, rad.
    pub cut: Option<(f64, f64)>,
}

/// A resolved, validated scene: a design and what happens to it.
#[derive(Debug, Clone)]
pub struct Scene {
    pub(super) file: SceneFile,
    pub(super) folder: PathBuf,
    pub(super) design: Design,
    pub(super) layout: Layout,
    pub(super) suspension: Option<Suspension>,
    pub(super) dots: Vec<SceneDot>,
    pub(super) markers: Vec<Marker>,
    pub(super) motion: Motion,
    pub(super) objects: Vec<SceneObject>,
    pub(super) kept: OnceLock<Arc<dyn Any + Send + Sync>>,
    pub(super) cache: Option<Cache>,
}

impl Scene {
    /// Takes another number of frames, spread over the same time, or another seed than the file's. A single frame is the first.
    ///
    /// # Errors
    /// No frame at all, or more than a scene file may ask for.
    pub fn override_run(&mut self, frames: Option<u32>, seed: Option<u64>) -> Result<(), SimError> {
        if let Some(count) = frames {
            if !(1..=MAX_FRAMES).contains(&count) {
                let problem =
                    if count == 0 { "there is no frame to draw" } else { "these are too many frames" };
                let allowed = format!("1 to {MAX_FRAMES}");
                return Err(DesignError::at("frames.count", count, problem, allowed).into());
            }
            let [before, after] =
                [self.file.frames.count, count].map(|count| f64::from(count.saturating_sub(1)));
            if before > 0.0 && after > 0.0 {
                self.file.frames.rate_hz *= after / before;
            }
            self.file.frames.count = count;
            self.kept = OnceLock::new();
        }
        self.file.seed = seed.unwrap_or(self.file.seed);
        Ok(())
    }

    /// Keeps tables that take long in a cache from now on, and takes them from there; what is drawn stays the same. Without it
    /// nothing is read or written.
    pub fn set_cache(&mut self, cache: Option<Cache>) {
        self.cache = cache;
    }

    /// Where tables that take long are kept, if anywhere.
    pub(crate) fn cache(&self) -> Option<&Cache> {
        self.cache.as_ref()
    }

    /// Writes what each pixel sees ([`crate::output::DepthMaps`]), whatever the file says.
    pub fn write_depth(&mut self) {
        self.file.output.depth = true;
    }

    /// The scene as written; every rule between its fields holds.
    pub fn file(&self) -> &SceneFile {
        &self.file
    }

    /// Name of the scene.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Where relative paths of the scene start.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The sensor.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Lens, layers and dome at rest.
    pub fn optics(&self) -> &SensorOptics {
        self.design.optics()
    }

    /// The dots as laid out.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The platform on its springs; `None` of a rigid mount.
    pub fn suspension(&self) -> Option<&Suspension> {
        self.suspension.as_ref()
    }

    /// The point that wrenches and displacements are stated about, mm: that of the springs, or the origin.
    pub fn reference_mm(&self) -> DVec3 {
        self.suspension.as_ref().map_or(DVec3::ZERO, Suspension::at_mm)
    }

    /// The dots as printed, in the layout's order.
    pub fn dots(&self) -> &[SceneDot] {
        &self.dots
    }

    /// The white markers on the sheet.
    pub fn markers(&self) -> &[Marker] {
        &self.markers
    }

    /// Pose and load of the platform over time.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Pose and load of the platform at a frame's time, without objects.
    ///
    /// # Errors
    /// A load without balance, named with the frame.
    pub fn state_at(&self, frame: u32, time_s: f64) -> Result<State, SimError> {
        let state = self.motion.at(self.suspension.as_ref(), time_s);
        state.map_err(|error| SimError::Frame { frame, problem: error.to_string() })
    }

    /// What a later stage has computed of the scene once and keeps with it.
    pub(crate) fn kept<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        self.kept.get().and_then(|kept| Arc::clone(kept).downcast().ok())
    }

    /// [`Scene::kept`], computed now if nobody has.
    ///
    /// # Errors
    /// Why it cannot be.
    pub(crate) fn keep<T: Any + Send + Sync>(
        &self,
        make: impl FnOnce() -> Result<T, SimError>,
    ) -> Result<Arc<T>, SimError> {
        if let Some(kept) = self.kept() {
            return Ok(kept);
        }
        let made = Arc::new(make()?);
        // Another thread may have been first, with the same.
        let _ = self.kept.set(Arc::<T>::clone(&made));
        Ok(made)
    }

    /// The objects that may touch the dome.
    pub fn objects(&self) -> &[SceneObject] {
        &self.objects
    }

    /// Number of frames.
    pub fn frame_count(&self) -> u32 {
        self.file.frames.count
    }

    /// Time of a frame, s.
    pub fn time_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.file.frames.rate_hz
    }

    /// Width and height of the image, px.
    pub fn image_size(&self) -> (usize, usize) {
        let spec = self.optics().lens().spec();
        (spec.width as usize, spec.height as usize)
    }

    /// Whether images are drawn; else only the truth is written, and no effect of brightness is called for.
    pub fn draws(&self) -> bool {
        self.file.frames.images
    }

    /// Planes of a picture: 3 in colour, else 1.
    pub fn planes(&self) -> usize {
        if self.file.frames.colour { 3 } else { 1 }
    }

    /// What the scene says of an effect.
    pub fn choice(&self, effect: EffectName) -> EffectChoice {
        self.file.effects.of(effect)
    }
}
