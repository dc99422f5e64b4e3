//! From the dots' motion, the wrench and, where there is one, a height map to the forces on the skin, frame by frame.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::active_set::{ActiveSet, Ended, Rows};
use super::model::{AXES, Dot, ElasticModel, place_sd_px};
use super::posterior::Posterior;
use super::pressure_room::PressureRoom;
use super::result::{DotTraction, LocalForces, TractionStatus};
use super::wrench_rows::{SpringLoad, WrenchRows};
use crate::constants::Constants;
use crate::shape::{ShapeMap, rows};
use crate::track::TrackError;
use crate::track::Tracked;
use domecast_optics::SensorOptics;
use domecast_springs::Wrench;

/// Turns of the forces with the skin, and of the rays with its motion, in a frame: each leaves a few hundredths.
const TURNS: u32 = 3;
/// How closely at least the forces must add to the wrench beside its own noise, N.
pub(super) const MIN_WRENCH_SD_N: f64 = 0.001;
/// Variance of shear over that of pressure: friction of a half or so, slipping seldom.
pub(super) const SHEAR_RATIO: f64 = 0.09;
/// The softness is looked for where the force is so many of its deviations.
const SOFTNESS_OVER_SD: f64 = 20.0;
/// A force bears on the sensor where it is so many of its deviations.
const PRESSED_OVER_SD: f64 = 3.0;
/// What the contact point of a height map is off beside noise, as a part of the touch's radius, and for each part of the load that is
/// shear: the skin's own pressure is that of a load without shear.
const POINT_PART: f64 = 0.02;
const POINT_BY_SHEAR: f64 = 0.12;
/// What it is off where dots alone are known, as a part of their distance: what moves along a ray is not seen.
const POINT_OF_DOTS: f64 = 0.45;
/// Bounds of the dome's softness against the constants.
const SOFTNESS: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// The forces on the skin of one sensor, from frame to frame.
///
/// Unknown are pressure (not negative) and shear at nodes of the dome's finite elements. Known are the dots' images, the wrench of
/// the springs and, where they are given, heights of the skin. What is likely beforehand is a smooth pressure. Forces bear
/// on the skin as it is: they turn with it, as in the simulator's linear level of contact. Nothing is allocated after the first frame.
#[derive(Debug, Clone)]
pub struct ForceDistribution {
    pub(super) model: ElasticModel,
    pub(super) set: ActiveSet,
    pub(super) posterior: Posterior,
    pub(super) dots: Vec<Dot>,
    pub(super) optics: SensorOptics,
    pub(super) reference_mm: Option<DVec3>,
    pub(super) radius_mm: f64,
    /// By axis, node and dot: what a traction moves the dot's image by at rest, px.
    pub(super) dot_columns: Vec<f64>,
    /// The same of the height of each node, mm.
    pub(super) height_columns: Vec<f64>,
    /// What the springs said of the frame of the untouched sensor, where one was given.
    pub(super) rest_wrench: Option<Wrench>,
    /// What they say of this frame, and its rows in this turn.
    pub(super) load: Option<SpringLoad>,
    pub(super) wrench: Option<WrenchRows>,
    pub(super) columns: Vec<f64>,
    pub(super) wanted: Vec<f64>,
    /// Motion of dots and nodes by the forces so far, mm; the nodes' axes turned with the skin, and its stretch.
    pub(super) dots_moved_mm: Vec<DVec3>,
    /// By dot: its place on the deformed skin, and the deviation of its depth, mm.
    pub(super) placed: Vec<(DVec3, f64)>,
    pub(super) nodes_moved_mm: Vec<DVec3>,
    pub(super) turned: Vec<DMat3>,
    pub(super) stretch: Vec<f64>,
    /// Deviation of each node's pressure, N/mm2.
    pub(super) node_sd_n_mm2: Vec<f64>,
    /// Height of each node and one over its deviation, and the nodes that have one.
    pub(super) heights: Vec<(f64, f64)>,
    pub(super) measured: Vec<usize>,
    /// The nodes whose columns a frame needs: those that may bear a pressure, and those beside them for its deviation.
    pub(super) needed: Vec<bool>,
    pub(super) room: PressureRoom,
    pub(super) softness: f64,
    /// Whether the dots have moved by more than noise.
    pub(super) is_moved: bool,
    pub(super) result: LocalForces,
}

impl ForceDistribution {
    /// For the sensor of the constants. `correlation_mm`: over how far pressures are taken to be alike [the dots' distance]; with a height
    /// map a millimetre does.
    ///
    /// # Errors
    /// [`TrackError`] names the first field that cannot be used: `elastomer` in constants of earlier builds.
    pub fn new(constants: &Constants, correlation_mm: Option<f64>) -> Result<Self, TrackError> {
        let optics = constants.sensor().map_err(|problem| TrackError::at("camera, optics:", problem))?;
        let places: Vec<DVec3> =
            constants.black_dots.iter().map(|dot| DVec3::from_array(dot.surface_mm)).collect();
        let model = ElasticModel::new(constants, &places, correlation_mm)?;
        let dot_of = |surface_mm: &DVec3| {
            let by_point = optics.project_with_jacobian(*surface_mm).map_or([DVec3::ZERO; 2], |(_, by)| {
                [0, 1].map(|i| DVec3::new(by[(i, 0)], by[(i, 1)], by[(i, 2)]))
            });
            Dot {
                surface_mm: *surface_mm,
                rest_mm: *surface_mm,
                rest_frames: 0,
                place_sd_px: place_sd_px(constants, &by_point),
                by_point,
                rest_px: None,
                seen_px: DVec2::ZERO,
                linear_px: DVec2::ZERO,
                per_sd: 0.0,
            }
        };
        let dots: Vec<Dot> = places.iter().map(dot_of).collect();
        let (n, max_rows) = (model.nodes.len(), 2 * dots.len() + 6 + model.nodes.len());
        let by_point: Vec<[DVec3; 2]> = dots.iter().map(|dot| dot.by_point).collect();
        let mut dot_columns = Vec::with_capacity(2 * model.dots_mm.len());
        for moved in model.dots_mm.chunks_exact(dots.len().max(1)) {
            let px = |(by, u): (&[DVec3; 2], &DVec3)| by.map(|by| by.dot(*u));
            dot_columns.extend(by_point.iter().zip(moved).flat_map(px));
        }
        let result = LocalForces { dots: Vec::with_capacity(dots.len()), ..LocalForces::default() };
        let springs = constants.springs.as_ref();
        Ok(Self {
            set: ActiveSet::new(n, max_rows),
            posterior: Posterior::new(&model, &dots),
            reference_mm: springs.map(|springs| DVec3::from_array(springs.at_mm)),
            radius_mm: constants.optics.dome_radius_mm,
            dot_columns,
            height_columns: model.heights_by(),
            rest_wrench: None,
            load: None,
            wrench: None,
            columns: vec![0.0; AXES * n * max_rows],
            wanted: Vec::with_capacity(max_rows),
            dots_moved_mm: vec![DVec3::ZERO; dots.len()],
            placed: Vec::with_capacity(dots.len()),
            nodes_moved_mm: vec![DVec3::ZERO; n],
            turned: model.nodes.iter().map(|node| node.axes).collect(),
            stretch: vec![1.0; n],
            node_sd_n_mm2: vec![0.0; n],
            heights: vec![(0.0, 0.0); n],
            measured: Vec::with_capacity(n),
            needed: vec![true; n],
            room: PressureRoom::default(),
            softness: 1.0,
            is_moved: false,
            dots,
            optics,
            model,
            result,
        })
    }

    /// The last frame's result.
    pub fn result(&self) -> &LocalForces {
        &self.result
    }

    /// The forces in a frame, from its dots and wrench; where its skin is measured they press where that is touched, and as deep as it
    /// is. `map` is the same frame's ([`ShapeFromColor`](crate::shape::ShapeFromColor)).
    pub fn update(&mut self, tracked: &Tracked, map: Option<&ShapeMap>) -> &LocalForces {
        if map.is_some() {
            rows::run(|| self.find(tracked, map));
        } else {
            self.find(tracked, map);
        }
        let Some(contact) = &mut self.result.contact else { return &self.result };
        let model_sd_mm = if let Some(seen) = map.and_then(|map| map.contact.as_ref()) {
            // Finer than the nodes, and as `draw_pressure` shares the force out.
            contact.point_mm = seen.point_mm;
            let radius_mm = (seen.area_mm2 / std::f64::consts::PI).sqrt();
            let normal_n = contact.force_n.dot(contact.normal);
            let shear_n = (contact.force_n - contact.normal * normal_n).length();
            radius_mm * POINT_PART.hypot(POINT_BY_SHEAR * (shear_n / normal_n.abs()).min(1.0))
        } else {
            POINT_OF_DOTS * self.model.correlation_mm
        };
        contact.point_sd_mm = contact.point_sd_mm.hypot(model_sd_mm);
        &self.result
    }

    fn find(&mut self, tracked: &Tracked, map: Option<&ShapeMap>) {
        self.result.dots.clear();
        self.result.contact = None;
        (self.result.rms_px, self.result.compliance_factor) = (0.0, 1.0);
        let Some(pose) =
            self.pose_of(tracked).filter(|pose| self.optics.move_to(pose).is_ok() && self.see(tracked))
        else {
            self.set.clear();
            self.result.status = TractionStatus::NoMotion;
            return;
        };
        if !self.is_ours(tracked) {
            self.set.clear();
            self.result.status = TractionStatus::ForeignReading;
            return;
        }
        self.load = self.load(tracked);
        let mut ended = Ended::Solved;
        self.softness = 1.0;
        self.move_skin();
        self.allow(map);
        self.need();
        // Of an untouched sensor nothing is to be found: all nodes would be asked in vain.
        let is_touched = self.is_moved || map.is_some_and(|map| map.contact.is_some()) || self.is_pressed();
        if !is_touched {
            self.set.clear();
            self.move_skin();
        }
        for _ in 0..if is_touched { TURNS } else { 0 } {
            self.take_heights(map);
            self.want(&pose);
            ended = self.solve_turn();
            self.soften();
            self.move_skin();
        }
        self.result.status = match ended {
            Ended::Solved => TractionStatus::Ok,
            Ended::Bound => TractionStatus::NotConverged,
        };
        self.report(tracked);
    }

    /// What the projection of the moved dot is beyond its linear part, px.
    pub(super) fn nonlinear_px(&self, k: usize) -> DVec2 {
        let (dot, moved_mm) = (&self.dots[k], self.dots_moved_mm[k]);
        let now = self.optics.project_deformed(dot.rest_mm + moved_mm);
        now.ok().zip(dot.rest_px).map_or(DVec2::ZERO, |(now, rest)| now - rest - dot.linear_px)
    }

    /// Whether a force of more than what the wrench is off bears on the sensor, where it says.
    fn is_pressed(&self) -> bool {
        self.load
            .is_some_and(|load| load.wrench.force_n.length() > PRESSED_OVER_SD * load.sd.force_n.length())
    }

    /// How much softer the dome is than the constants say: the factor that fits the dots best, where the wrench says the force.
    fn soften(&mut self) {
        let Some(load) = self.load else { return };
        if load.wrench.force_n.length() < SOFTNESS_OVER_SD * (load.sd.force_n.length() + MIN_WRENCH_SD_N) {
            return;
        }
        let prior = 1.0 / self.model.young_sd_part.max(1e-3).powi(2);
        let (mut along, mut square) = (prior, prior);
        let (n, d) = (self.model.nodes.len(), self.dots.len());
        for (k, dot) in self.dots.iter().enumerate().filter(|(_, dot)| dot.per_sd > 0.0) {
            let mut px = DVec2::ZERO;
            for &node in &self.set.active {
                for axis in 0..AXES {
                    let at = axis * n + node;
                    let by = 2 * (at * d + k);
                    px += DVec2::new(self.dot_columns[by], self.dot_columns[by + 1]) * self.set.tractions[at];
                }
            }
            px *= dot.per_sd;
            along += px.dot(DVec2::new(self.wanted[2 * k], self.wanted[2 * k + 1]));
            square += px.dot(px);
        }
        let found = along / square;
        self.softness = if found.is_finite() { found.clamp(*SOFTNESS.start(), *SOFTNESS.end()) } else { 1.0 };
    }

    /// Moves dots and nodes by the forces so far, and turns the nodes' axes with the skin.
    fn move_skin(&mut self) {
        let (n, d) = (self.model.nodes.len(), self.dots.len());
        self.dots_moved_mm.fill(DVec3::ZERO);
        self.nodes_moved_mm.fill(DVec3::ZERO);
        for &node in &self.set.active {
            for axis in 0..AXES {
                let at = axis * n + node;
                let traction = self.set.tractions[at] * self.softness;
                let dots = &self.model.dots_mm[at * d..(at + 1) * d];
                self.dots_moved_mm.iter_mut().zip(dots).for_each(|(to, u)| *to += *u * traction);
                let nodes = &self.model.nodes_mm[at * n..(at + 1) * n];
                self.nodes_moved_mm.iter_mut().zip(nodes).for_each(|(to, u)| *to += *u * traction);
            }
        }
        for (dot, u) in self.dots.iter_mut().zip(&self.dots_moved_mm) {
            dot.linear_px = DVec2::new(dot.by_point[0].dot(*u), dot.by_point[1].dot(*u));
        }
        for (k, node) in self.model.nodes.iter().enumerate() {
            let (mut along_x, mut along_y) = (node.axes.y_axis, node.axes.z_axis);
            let handed = along_x.cross(along_y);
            for (other, by_x, by_y) in &node.beside {
                along_x += self.nodes_moved_mm[*other] * *by_x;
                along_y += self.nodes_moved_mm[*other] * *by_y;
            }
            let across = along_x.cross(along_y);
            self.stretch[k] = across.length().max(0.1);
            let sign = handed.dot(node.axes.x_axis).signum();
            let inward = (across * sign).normalize_or(node.axes.x_axis);
            self.turned[k] = DMat3::from_quat(DQuat::from_rotation_arc(node.axes.x_axis, inward)) * node.axes;
        }
    }

    fn report(&mut self, tracked: &Tracked) {
        let n = self.model.nodes.len();
        let rows = Rows {
            columns: &mut self.columns,
            wanted: &self.wanted,
            nodes: n,
            precision: &self.model.precision,
            shear_ratio: SHEAR_RATIO,
        };
        self.posterior.take(&self.model, &self.set, &rows);
        let (mut sum, mut over, mut count) = (0.0, 0.0, 0);
        for (k, dot) in self.dots.iter().enumerate().filter(|(_, dot)| dot.per_sd > 0.0) {
            let left_px = dot.seen_px - self.nonlinear_px(k) - dot.linear_px;
            sum += left_px.length_squared();
            over += left_px.length_squared() * dot.per_sd * dot.per_sd;
            count += 2;
        }
        // What the model leaves unexplained beyond the noise makes all less sure.
        self.posterior.widen((over / f64::from(count.max(1))).sqrt().max(1.0));
        self.result.rms_px = (sum / f64::from(count.max(1))).sqrt();
        self.result.compliance_factor = self.softness;
        let springs_sd_n = self.reference_mm.and(tracked.wrench_sd).map(|sd| sd.force_n);
        self.result.contact = self.contact(springs_sd_n);
        self.place_dots(&tracked.black_dots);
        for (k, (dot, found)) in self.dots.iter().zip(&tracked.black_dots).enumerate() {
            let (surface_mm, depth_sd_mm) = self.placed[k];
            let (mut traction, mut pressure, mut coarse) = (DVec3::ZERO, 0.0, 0.0);
            for (node, share) in self.model.about(dot.surface_mm) {
                let own = DVec3::from_array([0, 1, 2].map(|axis| self.set.tractions[axis * n + node]));
                traction += self.turned[node] * own * (share / self.stretch[node]);
                pressure += share / self.stretch[node];
                coarse += share * self.model.variance_within(node, &self.set.tractions)
                    / self.stretch[node].powi(2);
            }
            let mut sd = self.posterior.sd_at(&self.model, k, dot) * pressure.max(0.1);
            if self.reference_mm.is_none() {
                sd = sd.hypot(self.model.young_sd_part * traction.length());
            }
            self.result.dots.push(DotTraction {
                id: found.id,
                surface_mm,
                depth_sd_mm,
                traction_n_mm2: traction,
                noise_sd_n_mm2: sd,
                sd_n_mm2: sd.hypot(coarse.sqrt()),
            });
        }
    }
}
