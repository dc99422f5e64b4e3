//! What the built sensor is, from what its camera sees: pupil, camera rotation, sheet, indices, markers and dots.
//!
//! Least squares over all frames at once: every number starts at its nominal value with the design's tolerance as
//! its prior, the first frames are at rest, which is what rest means, and every other has a pose of its own. One
//! frame at rest leaves its own noise in all that is measured from rest; ten leave a third of it.
//! Poses are eliminated frame by frame (Schur's complement), so a frame costs little.

use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use serde::Serialize;

use crate::constants::{CalibrationPriors, Constants};
use crate::numeric::{Rigid, rotation_from_vector};
use crate::optics::{OpticsSpec, SensorOptics};
use crate::pose::{Marker, PoseOptions, PoseSolver, Sighting, outline_centroid_offset};

/// The two kinds of marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A disc on the sheet.
    White,
    /// A dot on the dome.
    Black,
}

/// A centroid in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Number of the frame; the lowest is the one at rest.
    pub frame: usize,
    /// Kind of mark.
    pub kind: Kind,
    /// Number of the mark.
    pub id: usize,
    /// Centroid in the raw image, px.
    pub centroid_px: DVec2,
}

/// One fitted number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Name: `pupil.z`, `layers[1].index`, `white_markers[2].x`, ..
    pub name: String,
    /// Nominal value, in the unit of the name's field (mm, rad, 1).
    pub nominal: f64,
    /// Fitted value.
    pub value: f64,
    /// Standard deviation before (the tolerance).
    pub prior_sd: f64,
    /// Standard deviation after.
    pub sd: f64,
    /// Whether the frames said more of it than the tolerance does (less than nine tenths of it are left).
    pub observed: bool,
}

/// A fitted sensor.
#[derive(Debug, Clone)]
pub struct OpticsFit {
    /// The constants with measured numbers in place of nominal ones.
    pub constants: Constants,
    /// Every fitted number but the dots'.
    pub parameters: Vec<Parameter>,
    /// Root mean square of the residuals before and after, px.
    pub rms_px: [f64; 2],
    /// Steps taken.
    pub iterations: u32,
    /// Poses of the frames (`rest_from_platform`), by rising number.
    pub poses: Vec<(usize, Rigid)>,
    /// Observations that were counted less because they lie beyond three standard deviations.
    pub outliers: usize,
}

/// Why nothing can be fitted.
#[derive(Debug, Clone, PartialEq)]
pub enum OpticsFitError {
    /// The constants describe no sensor.
    Constants(String),
    /// An observation names a mark that the constants do not have.
    UnknownMark {
        /// Kind of mark.
        kind: Kind,
        /// Its number.
        id: usize,
    },
    /// There are no observations, or none at rest.
    Empty,
    /// A frame shows fewer than four white markers, so that its pose is open.
    FewMarkers {
        /// The frame.
        frame: usize,
    },
    /// A mark is not seen by the nominal sensor near its centroid.
    NotVisible {
        /// Kind of mark.
        kind: Kind,
        /// Its number.
        id: usize,
    },
    /// The fit did not settle in the allowed steps.
    NotConverged {
        /// What was left, px.
        rms_px: f64,
    },
}

impl std::fmt::Display for OpticsFitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word = |kind: &Kind| if *kind == Kind::White { "white marker" } else { "black dot" };
        match self {
            Self::Constants(what) => f.write_str(what),
            Self::UnknownMark { kind, id } => write!(f, "the constants have no {} {id}", word(kind)),
            Self::Empty => write!(f, "there are no observations"),
            Self::FewMarkers { frame } => {
                write!(f, "frame {frame} shows fewer than four white markers: its pose is open")
            }
            Self::NotVisible { kind, id } => {
                write!(f, "the nominal sensor cannot see {} {id} where it was found", word(kind))
            }
            Self::NotConverged { rms_px } => write!(f, "the fit did not settle; {rms_px:.3} px rms are left"),
        }
    }
}

impl std::error::Error for OpticsFitError {}

const MOST_STEPS: u32 = 60;
/// Huber's threshold in standard deviations.
const HUBER: f64 = 3.0;

/// What is fitted, apart from the poses. Numbers: pupil (3), camera rotation (3), thickness of each flat layer, index
/// of each layer, x and y of each white marker, two steps along the dome of each dot; as departures from nominal.
struct Problem<'a> {
    nominal: OpticsSpec,
    whites: Vec<Marker>,
    blacks: Vec<Black>,
    priors: Vec<f64>,
    frames: Vec<usize>,
    seen: Vec<Vec<Seen<'a>>>,
    flat: usize,
    /// How many of the frames, from the first, are at rest.
    at_rest: usize,
}

struct Seen<'a> {
    observation: &'a Observation,
    /// Place of the mark in its list.
    index: usize,
}

#[derive(Clone, Copy)]
struct Black {
    at_mm: DVec3,
    radius_mm: f64,
    east: DVec3,
    north: DVec3,
}

impl Black {
    fn moved(&self, step: DVec2, dome_radius_mm: f64) -> DVec3 {
        let there = self.at_mm + self.east * step.x + self.north * step.y;
        there * (dome_radius_mm / there.length())
    }
}

/// Camera and layers take the first numbers.
fn camera_numbers(flat: usize) -> usize {
    6 + flat + flat + 1
}

impl<'a> Problem<'a> {
    fn new(
        constants: &Constants,
        observations: &'a [Observation],
        priors: &CalibrationPriors,
        at_rest: usize,
    ) -> Result<Self, OpticsFitError> {
        let nominal = constants.optics_spec().map_err(OpticsFitError::Constants)?;
        let flat = nominal.layers.len().saturating_sub(1);
        let whites = constants.markers();
        let black = |dot: &crate::constants::BlackDot| {
            let at_mm = DVec3::from_array(dot.surface_mm);
            let east = DVec3::new(-at_mm.y, at_mm.x, 0.0).try_normalize().unwrap_or(DVec3::X);
            let north = at_mm.cross(east).normalize_or_zero();
            Black { at_mm, radius_mm: 0.5 * dot.diameter_mm, east, north }
        };
        let blacks: Vec<Black> = constants.black_dots.iter().map(black).collect();
        let mut sds = Vec::new();
        sds.extend(priors.pupil_mm);
        sds.extend(priors.camera_rotation_rad);
        sds.extend(vec![priors.layer_thickness_mm; flat]);
        sds.extend(vec![priors.index; flat + 1]);
        sds.extend(vec![priors.white_marker_mm; 2 * whites.len()]);
        sds.extend(vec![priors.black_dot_mm; 2 * blacks.len()]);
        // A tolerance of zero holds a number to where it is.
        let priors = sds.into_iter().map(|sd: f64| sd.max(1e-9)).collect();
        let mut frames: Vec<usize> = observations.iter().map(|o| o.frame).collect();
        frames.sort_unstable();
        frames.dedup();
        if frames.is_empty() {
            return Err(OpticsFitError::Empty);
        }
        let mut seen: Vec<Vec<Seen>> = frames.iter().map(|_| Vec::new()).collect();
        for observation in observations {
            let index = match observation.kind {
                Kind::White => constants.white_markers.iter().position(|m| m.id == observation.id),
                Kind::Black => constants.black_dots.iter().position(|d| d.id == observation.id),
            };
            let Some(index) = index else {
                return Err(OpticsFitError::UnknownMark { kind: observation.kind, id: observation.id });
            };
            if let Ok(frame) = frames.binary_search(&observation.frame) {
                seen[frame].push(Seen { observation, index });
            }
        }
        Ok(Self { nominal, whites, blacks, priors, frames, seen, flat, at_rest: at_rest.max(1) })
    }

    fn numbers(&self) -> usize {
        self.priors.len()
    }

    fn spec(&self, x: &[f64]) -> OpticsSpec {
        let mut spec = self.nominal.clone();
        spec.sensor_from_camera.translation_mm += DVec3::new(x[0], x[1], x[2]);
        let turn = rotation_from_vector(DVec3::new(x[3], x[4], x[5]));
        spec.sensor_from_camera.rotation *= turn;
        let flat = self.flat;
        for (k, layer) in spec.layers.iter_mut().enumerate() {
            if let Some(thickness) = layer.thickness_mm.as_mut() {
                *thickness = (*thickness + x[6 + k]).max(0.0);
            }
            for index in &mut layer.index {
                *index = (*index + x[6 + flat + k]).max(1.0);
            }
        }
        spec
    }

    fn white(&self, x: &[f64], index: usize) -> Marker {
        let at = camera_numbers(self.flat) + 2 * index;
        let mut marker = self.whites[index];
        marker.position_mm += DVec3::new(x[at], x[at + 1], 0.0);
        marker
    }

    fn black_number(&self, index: usize) -> usize {
        camera_numbers(self.flat) + 2 * self.whites.len() + 2 * index
    }

    fn black(&self, x: &[f64], index: usize) -> DVec3 {
        let at = self.black_number(index);
        self.blacks[index].moved(DVec2::new(x[at], x[at + 1]), self.nominal.dome_radius_mm)
    }

    fn place(&self, x: &[f64], seen: &Seen) -> DVec3 {
        match seen.observation.kind {
            Kind::White => self.white(x, seen.index).position_mm,
            Kind::Black => self.black(x, seen.index),
        }
    }

    /// Centroid of a mark less its centre's image.
    fn offset(&self, x: &[f64], seen: &Seen, optics: &SensorOptics, center: DVec2) -> Option<DVec2> {
        match seen.observation.kind {
            Kind::White => self.white(x, seen.index).centroid_offset_px(optics, center).ok(),
            Kind::Black => {
                let dot = &self.blacks[seen.index];
                let at = self.black(x, seen.index);
                let radius = self.nominal.dome_radius_mm;
                outline_centroid_offset(center, |cos, sin| {
                    let there = at + (dot.east * cos + dot.north * sin) * dot.radius_mm;
                    optics.project(there * (radius / there.length())).ok()
                })
            }
        }
    }

    fn noise(&self, priors: &CalibrationPriors, kind: Kind) -> f64 {
        match kind {
            Kind::White => priors.white_centroid_px,
            Kind::Black => priors.black_centroid_px,
        }
    }

    fn name(&self, number: usize, constants: &Constants) -> (String, f64) {
        let flat = self.flat;
        let pupil = self.nominal.sensor_from_camera.translation_mm;
        let axis = ["x", "y", "z"];
        match number {
            0..3 => (format!("pupil.{}", axis[number]), pupil[number]),
            3..6 => (format!("camera_rotation.{}", axis[number - 3]), 0.0),
            n if n < 6 + flat => {
                let layer = &self.nominal.layers[n - 6];
                (format!("{}.thickness", layer.name), layer.thickness_mm.unwrap_or(0.0))
            }
            n if n < camera_numbers(flat) => {
                let layer = &self.nominal.layers[n - 6 - flat];
                (format!("{}.index", layer.name), layer.index[1])
            }
            n => {
                let k = n - camera_numbers(flat);
                let id = constants.white_markers.get(k / 2).map_or(0, |m| m.id);
                let nominal = self.whites.get(k / 2).map_or(0.0, |m| m.position_mm[k % 2]);
                (format!("white_markers[{id}].{}", axis[k % 2]), nominal)
            }
        }
    }
}

/// Of one pose: the inverse of its block, its coupling to the numbers, its right side.
type OwnBlock = (Matrix6<f64>, DMatrix<f64>, Vector6<f64>);

/// Normal equations with the poses eliminated, and what brings the poses back.
struct Reduced {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// For each frame that is not at rest: inverse of the pose's own block, its coupling to the numbers, its right side.
    poses: Vec<Option<OwnBlock>>,
    cost: f64,
    squares: f64,
    count: usize,
    outliers: usize,
}

fn cost_of(left_sds: f64) -> (f64, f64) {
    // Huber: value and weight.
    if left_sds <= HUBER {
        (left_sds * left_sds, 1.0)
    } else {
        (2.0 * HUBER * left_sds - HUBER * HUBER, HUBER / left_sds)
    }
}

impl Problem<'_> {
    /// Residuals and, where asked for, the reduced normal equations; `None` where a mark is not seen.
    fn reduce(
        &self,
        x: &[f64],
        poses: &[Rigid],
        priors: &CalibrationPriors,
        solve: bool,
        damping: f64,
    ) -> Option<Reduced> {
        let n = self.numbers();
        let camera = camera_numbers(self.flat);
        let rest = SensorOptics::new(&self.spec(x)).ok()?;
        // Steps a hundredth of a tolerance wide: rounding and curvature are both far below.
        let steps: Vec<f64> = self.priors[..camera].iter().map(|sd| 0.01 * sd.max(1e-4)).collect();
        let mut shifted = Vec::new();
        if solve {
            for k in 0..camera {
                let with = |sign: f64| {
                    let mut y = x.to_vec();
                    y[k] += sign * steps[k];
                    SensorOptics::new(&self.spec(&y)).ok()
                };
                shifted.push([with(1.0)?, with(-1.0)?]);
            }
        }
        let mut out = Reduced {
            matrix: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            poses: Vec::new(),
            cost: 0.0,
            squares: 0.0,
            count: 0,
            outliers: 0,
        };
        for (k, (value, sd)) in x.iter().zip(&self.priors).enumerate() {
            let weight = sd.powi(-2);
            out.cost += value * value * weight;
            out.matrix[(k, k)] += weight;
            out.right[k] -= value * weight;
        }
        for (frame, seen) in self.seen.iter().enumerate() {
            let optics = rest.at_pose(&poses[frame]).ok()?;
            let mut placed = Vec::new();
            for [up, down] in &shifted {
                placed.push([up.at_pose(&poses[frame]).ok()?, down.at_pose(&poses[frame]).ok()?]);
            }
            let mut own = Matrix6::zeros();
            let mut own_right = Vector6::zeros();
            let mut coupling =
                if solve && frame >= self.at_rest { DMatrix::zeros(n, 6) } else { DMatrix::zeros(0, 6) };
            for mark in seen {
                let at = self.place(x, mark);
                let motion = optics.project_with_motion(at).ok()?;
                let offset = self.offset(x, mark, &optics, motion.pixel)?;
                let left = mark.observation.centroid_px - motion.pixel - offset;
                let sd = self.noise(priors, mark.observation.kind);
                let (cost, weight) = cost_of(left.length() / sd);
                out.cost += cost;
                out.squares += left.length_squared();
                out.count += 2;
                out.outliers += usize::from(weight < 1.0);
                if !solve {
                    continue;
                }
                let weight = weight / (sd * sd);
                // The numbers that this mark depends on, and how.
                let mut columns: Vec<(usize, DVec2)> = Vec::with_capacity(camera + 2);
                for (k, [up, down]) in placed.iter().enumerate() {
                    columns.push((k, (up.project(at).ok()? - down.project(at).ok()?) / (2.0 * steps[k])));
                }
                let by = |v: DVec3| {
                    let row = |i: usize| (0..3).map(|j| motion.by_point[(i, j)] * v[j]).sum::<f64>();
                    DVec2::new(row(0), row(1))
                };
                let (first, axes) = match mark.observation.kind {
                    Kind::White => (camera + 2 * mark.index, [DVec3::X, DVec3::Y]),
                    Kind::Black => {
                        let dot = &self.blacks[mark.index];
                        (self.black_number(mark.index), [dot.east, dot.north])
                    }
                };
                columns.push((first, by(axes[0])));
                columns.push((first + 1, by(axes[1])));
                for (k, a) in &columns {
                    out.right[*k] += weight * a.dot(left);
                    for (l, b) in &columns {
                        out.matrix[(*k, *l)] += weight * a.dot(*b);
                    }
                }
                if frame >= self.at_rest {
                    for i in 0..6 {
                        let a = DVec2::new(motion.by_pose[(0, i)], motion.by_pose[(1, i)]);
                        own_right[i] += weight * a.dot(left);
                        for j in 0..6 {
                            let b = DVec2::new(motion.by_pose[(0, j)], motion.by_pose[(1, j)]);
                            own[(i, j)] += weight * a.dot(b);
                        }
                        for (k, b) in &columns {
                            coupling[(*k, i)] += weight * b.dot(a);
                        }
                    }
                }
            }
            if solve {
                if frame < self.at_rest {
                    out.poses.push(None);
                } else {
                    for i in 0..6 {
                        own[(i, i)] *= 1.0 + damping;
                    }
                    let inverse = own.cholesky()?.inverse();
                    let across = &coupling * inverse;
                    out.matrix -= &across * coupling.transpose();
                    out.right -= &across * own_right;
                    out.poses.push(Some((inverse, coupling, own_right)));
                }
            }
        }
        Some(out)
    }
}

/// Fits the sensor to the observations; the first `at_rest` frames (one at least) are without load.
///
/// # Errors
/// See [`OpticsFitError`].
pub fn fit(
    constants: &Constants,
    observations: &[Observation],
    priors: &CalibrationPriors,
    at_rest: usize,
) -> Result<OpticsFit, OpticsFitError> {
    let problem = Problem::new(constants, observations, priors, at_rest)?;
    let mut poses = start_poses(&problem, priors)?;
    let mut x = vec![0.0; problem.numbers()];
    let hidden = || {
        let first = observations.first();
        OpticsFitError::NotVisible {
            kind: first.map_or(Kind::White, |o| o.kind),
            id: first.map_or(0, |o| o.id),
        }
    };
    let mut damping = 1e-6;
    let mut now = problem
        .reduce(&x, &poses, priors, true, damping)
        .ok_or_else(|| first_hidden(&problem, &x, &poses).unwrap_or_else(hidden))?;
    let rms = |r: &Reduced| (r.squares / r.count.max(1) as f64).sqrt();
    let before = rms(&now);
    let (mut iterations, mut settled) = (0, false);
    while iterations < MOST_STEPS && !settled {
        iterations += 1;
        let mut damped = now.matrix.clone();
        for k in 0..problem.numbers() {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky().map(|c| c.solve(&now.right));
        let Some(step) = step else {
            damping *= 10.0;
            continue;
        };
        let next_x: Vec<f64> = x.iter().zip(step.iter()).map(|(a, b)| a + b).collect();
        let moved = |(pose, own): (&Rigid, &Option<OwnBlock>)| match own {
            Some((inverse, coupling, right)) => {
                let m = inverse * (right - coupling.transpose() * &step);
                let motion = Rigid::new(
                    rotation_from_vector(DVec3::new(m[3], m[4], m[5])),
                    DVec3::new(m[0], m[1], m[2]),
                );
                motion.compose(pose)
            }
            None => *pose,
        };
        let next_poses: Vec<Rigid> = poses.iter().zip(&now.poses).map(moved).collect();
        let tried = problem.reduce(&next_x, &next_poses, priors, true, damping * 0.1);
        match tried {
            Some(next) if next.cost <= now.cost * (1.0 + 1e-12) => {
                settled = now.cost - next.cost <= 1e-7 * (1.0 + now.cost);
                (x, poses, now) = (next_x, next_poses, next);
                damping = (0.1 * damping).max(1e-12);
            }
            _ if damping < 1e8 => {
                damping *= 10.0;
                // The eliminated blocks carry the damping too.
                if let Some(again) = problem.reduce(&x, &poses, priors, true, damping) {
                    now = again;
                }
            }
            _ => settled = true,
        }
    }
    if !settled {
        return Err(OpticsFitError::NotConverged { rms_px: rms(&now) });
    }
    let last = problem.reduce(&x, &poses, priors, true, 0.0).unwrap_or(now);
    let covariance = last.matrix.clone().cholesky().map(|c| c.inverse());
    let sd = |k: usize| covariance.as_ref().map_or(problem.priors[k], |c| c[(k, k)].max(0.0).sqrt());
    let named = camera_numbers(problem.flat) + 2 * problem.whites.len();
    let parameters = (0..named)
        .map(|k| {
            let (name, nominal) = problem.name(k, constants);
            let (prior_sd, sd) = (problem.priors[k], sd(k));
            Parameter { name, nominal, value: nominal + x[k], prior_sd, sd, observed: sd < 0.9 * prior_sd }
        })
        .collect();
    let constants = measured(constants, &problem, &x)?;
    let after = rms(&last);
    let poses = problem.frames.iter().copied().zip(poses).collect();
    Ok(OpticsFit {
        constants,
        parameters,
        rms_px: [before, after],
        iterations,
        poses,
        outliers: last.outliers,
    })
}

/// The first mark that the nominal sensor does not see.
fn first_hidden(problem: &Problem, x: &[f64], poses: &[Rigid]) -> Option<OpticsFitError> {
    let rest = SensorOptics::new(&problem.spec(x)).ok()?;
    for (seen, pose) in problem.seen.iter().zip(poses) {
        let optics = rest.at_pose(pose).ok()?;
        for mark in seen {
            if optics.project(problem.place(x, mark)).is_err() {
                return Some(OpticsFitError::NotVisible {
                    kind: mark.observation.kind,
                    id: mark.observation.id,
                });
            }
        }
    }
    None
}

/// Each frame's pose with nominal numbers; the first is rest.
fn start_poses(problem: &Problem, priors: &CalibrationPriors) -> Result<Vec<Rigid>, OpticsFitError> {
    let optics = SensorOptics::new(&problem.nominal).map_err(|e| OpticsFitError::Constants(e.to_string()))?;
    let fault = |e: crate::pose::PoseError| OpticsFitError::Constants(format!("white markers: {e}"));
    // What the tolerances move a marker's image by, roughly: its place over its distance, in focal lengths.
    let away = (problem.nominal.sensor_from_camera.translation_mm.z).abs().max(1.0);
    let focal = problem.nominal.lens.matrix[0][0].abs();
    let slack =
        focal * (priors.white_marker_mm + priors.pupil_mm.iter().fold(0.0_f64, |m, v| m.max(*v))) / away;
    let noise_px = priors.white_centroid_px.hypot(3.0 * slack);
    let solver =
        PoseSolver::new(&optics, &problem.whites, PoseOptions::new(noise_px, 10.0 * away)).map_err(fault)?;
    let mut poses = vec![Rigid::identity(); problem.at_rest.min(problem.frames.len())];
    for (frame, seen) in problem.frames.iter().zip(&problem.seen).skip(problem.at_rest) {
        let sightings: Vec<Sighting> = seen
            .iter()
            .filter(|mark| mark.observation.kind == Kind::White)
            .map(|mark| Sighting {
                id: problem.whites[mark.index].id,
                centroid_px: mark.observation.centroid_px,
            })
            .collect();
        if sightings.len() < 4 {
            return Err(OpticsFitError::FewMarkers { frame: *frame });
        }
        // A frame whose markers fit badly still has a place near rest to start from.
        poses.push(solver.solve(&sightings).map_or(Rigid::identity(), |found| found.pose));
    }
    Ok(poses)
}

/// The constants with what was fitted.
fn measured(constants: &Constants, problem: &Problem, x: &[f64]) -> Result<Constants, OpticsFitError> {
    let spec = problem.spec(x);
    let optics = SensorOptics::new(&spec).map_err(|e| OpticsFitError::Constants(e.to_string()))?;
    let mut made = constants.clone();
    made.camera.camera_from_sensor = spec.sensor_from_camera.inverse().to_rows_4x4();
    let first_is_air = made.optics.layers.first().is_some_and(|l| l.name == "air");
    if first_is_air && let Some(air) = made.optics.layers.first_mut() {
        air.thickness_mm = Some(optics.air_gap_mm());
    }
    for (layer, fitted) in made.optics.layers.iter_mut().skip(usize::from(first_is_air)).zip(&spec.layers) {
        layer.thickness_mm = fitted.thickness_mm;
        layer.index = fitted.index[1];
        if layer.index_rgb.is_some() {
            layer.index_rgb = Some(fitted.index);
        }
    }
    for (index, marker) in made.white_markers.iter_mut().enumerate() {
        let fitted = problem.white(x, index);
        marker.position_mm = fitted.position_mm.to_array();
        let hidden = |_| OpticsFitError::NotVisible { kind: Kind::White, id: marker.id };
        marker.image_px = optics.project(fitted.position_mm).map_err(hidden)?.to_array();
    }
    for (index, dot) in made.black_dots.iter_mut().enumerate() {
        let at = problem.black(x, index);
        let hidden = |_| OpticsFitError::NotVisible { kind: Kind::Black, id: dot.id };
        dot.surface_mm = at.to_array();
        dot.normal = (at / at.length()).to_array();
        dot.image_px = optics.project(at).map_err(hidden)?.to_array();
    }
    made.refit_plain_runtime();
    Ok(made)
}
