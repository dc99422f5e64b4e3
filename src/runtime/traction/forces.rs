//! From the dots' motion, the wrench and, where there is one, a height map to the forces on the skin, frame by frame.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::active_set::{ActiveSet, Ended, Rows};
use super::model::{AXES, Dot, ElasticModel};
use super::posterior::Posterior;
use super::pressure_room::PressureRoom;
use super::result::{DotTraction, LocalForces, TractionStatus};
use crate::constants::Constants;
use crate::shape::ShapeMap;
use crate::track::TrackError;
use crate::track::Tracked;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Turns of the forces with the skin, and of the rays with its motion, in a frame: each leaves a few hundredths.
const TURNS: u32 = 3;
/// How closely the forces must add to the wrench beside its own noise: a part of the force, and least, N; moments by the dome's radius.
const WRENCH_PART: f64 = 0.002;
const MIN_WRENCH_SD_N: f64 = 0.001;
/// Variance of shear over that of pressure: friction of a half or so, slipping seldom.
const SHEAR_RATIO: f64 = 0.09;
/// The softness is looked for where the force is so many of its deviations.
const SOFTNESS_OVER_SD: f64 = 20.0;
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
    reference_mm: Option<DVec3>,
    pub(super) radius_mm: f64,
    /// By axis, node and dot: what a traction moves the dot's image by at rest, px.
    dot_columns: Vec<f64>,
    pub(super) columns: Vec<f64>,
    pub(super) wanted: Vec<f64>,
    /// Motion of dots and nodes by the forces so far, mm; the nodes' axes turned with the skin, and its stretch.
    dots_moved_mm: Vec<DVec3>,
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
    softness: f64,
    /// Whether the dots have moved by more than noise.
    pub(super) is_moved: bool,
    result: LocalForces,
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
            let (seen_px, linear_px) = (DVec2::ZERO, DVec2::ZERO);
            Dot { surface_mm: *surface_mm, by_point, seen_px, linear_px, per_sd: 0.0 }
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
            posterior: Posterior::new(&model, &places, &by_point),
            reference_mm: springs.map(|springs| DVec3::from_array(springs.at_mm)),
            radius_mm: constants.optics.dome_radius_mm,
            dot_columns,
            columns: vec![0.0; AXES * n * max_rows],
            wanted: Vec::with_capacity(max_rows),
            dots_moved_mm: vec![DVec3::ZERO; dots.len()],
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
        self.find(tracked, map);
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

    fn find(&mut self, tracked: &Tracked, map: Option<&ShapeMap>) -> &LocalForces {
        self.result.dots.clear();
        self.result.contact = None;
        (self.result.rms_px, self.result.compliance_factor) = (0.0, 1.0);
        let pose = if self.reference_mm.is_some() { tracked.pose } else { Some(Rigid::identity()) };
        let Some(pose) = pose.filter(|pose| self.optics.move_to(pose).is_ok() && self.see(tracked)) else {
            self.set.clear();
            self.result.status = TractionStatus::NoMotion;
            return &self.result;
        };
        if !self.is_ours(tracked) {
            self.set.clear();
            self.result.status = TractionStatus::ForeignReading;
            return &self.result;
        }
        let mut ended = Ended::Solved;
        self.softness = 1.0;
        self.move_skin();
        self.allow(map);
        self.need();
        self.take_heights(map);
        let is_touched = self.is_moved || !self.measured.is_empty();
        if !is_touched {
            self.set.clear();
            self.move_skin();
        }
        for _ in 0..if is_touched { TURNS } else { 0 } {
            self.take_heights(map);
            self.fill(tracked, &pose);
            let rows = Rows {
                columns: &self.columns,
                wanted: &self.wanted,
                nodes: self.model.nodes.len(),
                precision: &self.model.precision,
                shear_ratio: SHEAR_RATIO,
            };
            ended = self.set.solve(&rows);
            self.soften(tracked);
            self.move_skin();
        }
        self.result.status = match ended {
            Ended::Solved => TractionStatus::Ok,
            Ended::Bound => TractionStatus::NotConverged,
        };
        self.report(tracked);
        &self.result
    }

    /// The rows of a turn: dots, wrench, heights.
    fn fill(&mut self, tracked: &Tracked, pose: &Rigid) {
        let (n, d) = (self.model.nodes.len(), self.dots.len());
        let wrench = self.reference_mm.zip(tracked.wrench);
        let first_height = 2 * d + if wrench.is_some() { 6 } else { 0 };
        let rows = first_height + self.measured.len();
        self.wanted.clear();
        self.wanted.resize(rows, 0.0);
        for k in 0..d {
            let px = (self.dots[k].seen_px - self.nonlinear_px(k)) * self.dots[k].per_sd;
            (self.wanted[2 * k], self.wanted[2 * k + 1]) = (px.x, px.y);
        }
        for axis in 0..AXES {
            for node in (0..n).filter(|node| self.needed[*node]) {
                let at = axis * n + node;
                let Some(column) = self.columns.get_mut(at * rows..(at + 1) * rows) else { continue };
                let base = self.dot_columns[2 * at * d..2 * (at + 1) * d].chunks_exact(2);
                for ((dot, px), to) in self.dots.iter().zip(base).zip(column.chunks_exact_mut(2)) {
                    let per = dot.per_sd * self.softness;
                    (to[0], to[1]) = (px[0] * per, px[1] * per);
                }
                for (row, &other) in self.measured.iter().enumerate() {
                    let outward = -self.model.nodes[other].axes.x_axis;
                    let u = self.model.nodes_mm[at * n + other];
                    column[first_height + row] = outward.dot(u) * self.heights[other].1 * self.softness;
                }
            }
        }
        for (row, &node) in self.measured.iter().enumerate() {
            let (height_mm, per_sd) = self.heights[node];
            self.wanted[first_height + row] = height_mm * per_sd;
        }
        let Some((reference_mm, wrench)) = wrench else { return };
        // In the platform's frame, about where the reference point is in it.
        let platform_from_rest = pose.inverse();
        let about_mm = platform_from_rest.point(reference_mm);
        let force = platform_from_rest.vector(wrench.force_n);
        let moment = platform_from_rest.vector(wrench.moment_nmm);
        let noise = tracked.wrench_sd_random.unwrap_or_default();
        let (part_n, arm_mm) = (WRENCH_PART * force.length() + MIN_WRENCH_SD_N, self.radius_mm);
        let sd = |own: f64, unit: f64| 1.0 / own.hypot(part_n * unit);
        let per: [f64; 6] = {
            let [f, m] = [noise.force_n, noise.moment_nmm];
            [sd(f.x, 1.0), sd(f.y, 1.0), sd(f.z, 1.0), sd(m.x, arm_mm), sd(m.y, arm_mm), sd(m.z, arm_mm)]
        };
        let six = |f: DVec3, m: DVec3| [f.x, f.y, f.z, m.x, m.y, m.z];
        for (to, (value, per)) in self.wanted[2 * d..].iter_mut().zip(six(force, moment).iter().zip(&per)) {
            *to = value * per;
        }
        for (node, own) in self.model.nodes.iter().enumerate().filter(|(node, _)| self.needed[*node]) {
            let arm = own.at_mm + self.nodes_moved_mm[node] - about_mm;
            for axis in 0..AXES {
                let f = self.turned[node].col(axis) * own.area_mm2;
                let at = (axis * n + node) * rows + 2 * d;
                let values = six(f, arm.cross(f));
                for (to, (value, per)) in self.columns[at..].iter_mut().zip(values.iter().zip(&per)) {
                    *to = value * per;
                }
            }
        }
    }

    /// What the projection of the moved dot is beyond its linear part, px.
    fn nonlinear_px(&self, k: usize) -> DVec2 {
        let (dot, moved_mm) = (&self.dots[k], self.dots_moved_mm[k]);
        let now = self.optics.project_deformed(dot.surface_mm + moved_mm);
        match (now, self.optics.project_deformed(dot.surface_mm)) {
            (Ok(now), Ok(rest)) => now - rest - dot.linear_px,
            _ => DVec2::ZERO,
        }
    }

    /// How much softer the dome is than the constants say: the factor that fits the dots best, where the wrench says the force.
    fn soften(&mut self, tracked: &Tracked) {
        let known_n = self.reference_mm.and(tracked.wrench).map_or(0.0, |wrench| wrench.force_n.length());
        let noise_n = tracked.wrench_sd_random.unwrap_or_default().force_n.length() + MIN_WRENCH_SD_N;
        if known_n < SOFTNESS_OVER_SD * noise_n {
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
            columns: &self.columns,
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
        for (k, (dot, found)) in self.dots.iter().zip(&tracked.black_dots).enumerate() {
            let (mut traction, mut pressure, mut coarse) = (DVec3::ZERO, 0.0, 0.0);
            for (node, share) in self.model.about(dot.surface_mm) {
                let own = DVec3::from_array([0, 1, 2].map(|axis| self.set.tractions[axis * n + node]));
                traction += self.turned[node] * own * (share / self.stretch[node]);
                pressure += share / self.stretch[node];
                coarse += share * self.model.variance_within(node, &self.set.tractions)
                    / self.stretch[node].powi(2);
            }
            let mut sd = self.posterior.sd_at(&self.model, k, dot.surface_mm) * pressure.max(0.1);
            if self.reference_mm.is_none() {
                sd = sd.hypot(self.model.young_sd_part * traction.length());
            }
            self.result.dots.push(DotTraction {
                id: found.id,
                surface_mm: dot.surface_mm + self.dots_moved_mm[k],
                traction_n_mm2: traction,
                noise_sd_n_mm2: sd,
                sd_n_mm2: sd.hypot(coarse.sqrt()),
            });
        }
        self.result.rms_px = (sum / f64::from(count.max(1))).sqrt();
        self.result.compliance_factor = self.softness;
        let springs_sd_n = self.reference_mm.and(tracked.wrench_sd).map(|sd| sd.force_n);
        self.result.contact = self.contact(springs_sd_n);
    }
}
