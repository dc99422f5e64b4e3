//! Settings chosen from the accuracy that a design asks for.
//!
//! Each value of a setting has a bound on its error; the cheapest value whose bound, times a safety factor, meets the
//! design's `accuracy` is chosen. The bounds need no test run: a tolerance is met by construction, and its effect in
//! the image follows from the derivatives of the optics.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! assert_eq!(design.settings().lines().len(), 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DMat3, DVec3};

use super::error::DesignError;
use super::sections::{AccuracySection, DesignFile, TolerancesSection};
use domecast_optics::numeric::Rigid;
use domecast_optics::{OpticsSpec, SensorOptics};

/// Safety factor between the accuracy that a design asks for and the bound of a setting.
pub const SAFETY: f64 = 2.0;

/// Polar angles and azimuths of the dome at which the optics are sampled.
const RINGS: u32 = 6;
const AROUND: u32 = 8;

/// One setting and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting<T> {
    /// Its field in the design file.
    pub field: &'static str,
    /// Its value.
    pub value: T,
    /// Whether it was chosen; else the file gives it.
    pub chosen: bool,
    /// Why this value, in words.
    pub because: String,
}

/// The settings that trade time for exactness.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// `print.outline_tolerance_mm`.
    pub outline_tolerance_mm: Setting<f64>,
    /// `mesh.chord_tolerance_mm`.
    pub chord_tolerance_mm: Setting<f64>,
    /// `mesh.optical_chord_tolerance_mm`.
    pub optical_chord_tolerance_mm: Setting<f64>,
    /// `tolerances.samples`.
    pub samples: Setting<u32>,
}

impl Settings {
    /// A line for each, for people.
    pub fn lines(&self) -> Vec<String> {
        let mm = |s: &Setting<f64>| format!("{} = {}: {}", s.field, s.value, s.because);
        vec![
            mm(&self.outline_tolerance_mm),
            mm(&self.chord_tolerance_mm),
            mm(&self.optical_chord_tolerance_mm),
            format!("{} = {}: {}", self.samples.field, self.samples.value, self.samples.because),
        ]
    }

    /// Whether any was chosen.
    pub fn any_chosen(&self) -> bool {
        let mm = [&self.outline_tolerance_mm, &self.chord_tolerance_mm, &self.optical_chord_tolerance_mm];
        self.samples.chosen || mm.iter().any(|setting| setting.chosen)
    }

    /// The settings of a file.
    ///
    /// # Errors
    /// A setting that is neither given nor can be chosen.
    pub(super) fn of(file: &DesignFile, optics: &SensorOptics) -> Result<Self, DesignError> {
        let accuracy = file.accuracy.as_ref();
        // the sensitivity of the optics is computed only where a setting is to be chosen
        let needed = file.mesh.optical_chord_tolerance_mm.is_none() || file.tolerances.samples.is_none();
        let sensitivity =
            if needed && accuracy.is_some() { Some(OpticalSensitivity::by(file, optics)?) } else { None };
        Ok(Self {
            outline_tolerance_mm: setting(
                "print.outline_tolerance_mm",
                file.print.outline_tolerance_mm,
                accuracy.map(|accuracy| {
                    let limit = accuracy.dot_placement_mm / SAFETY;
                    let why = "an outline is kept to its tolerance";
                    (fine(limit, 1e-5, 1.0), reason("dot_placement_mm", accuracy.dot_placement_mm, why))
                }),
            )?,
            chord_tolerance_mm: setting(
                "mesh.chord_tolerance_mm",
                file.mesh.chord_tolerance_mm,
                accuracy.map(|accuracy| {
                    let why = "a mesh is kept to its tolerance";
                    (fine(accuracy.mesh_mm / SAFETY, 1e-4, 10.0), reason("mesh_mm", accuracy.mesh_mm, why))
                }),
            )?,
            optical_chord_tolerance_mm: setting(
                "mesh.optical_chord_tolerance_mm",
                file.mesh.optical_chord_tolerance_mm,
                accuracy
                    .zip(sensitivity.as_ref())
                    .map(|(accuracy, sensitivity)| optical(accuracy, sensitivity)),
            )?,
            samples: setting(
                "tolerances.samples",
                file.tolerances.samples,
                accuracy
                    .zip(sensitivity.as_ref().and_then(|sensitivity| sensitivity.spread_px))
                    .map(|(accuracy, px)| samples(accuracy, px)),
            )?,
        })
    }
}

fn setting<T>(
    field: &'static str,
    given: Option<T>,
    chosen: Option<(T, String)>,
) -> Result<Setting<T>, DesignError> {
    match (given, chosen) {
        (Some(value), _) => {
            Ok(Setting { field, value, chosen: false, because: "given in the design".into() })
        }
        (None, Some((value, because))) => Ok(Setting { field, value, chosen: true, because }),
        (None, None) => Err(DesignError::at(
            field,
            serde_json::Value::Null,
            "no value is given",
            "a value, or a section `accuracy` from which it is chosen",
        )),
    }
}

fn reason(field: &str, value: f64, why: &str) -> String {
    format!("chosen for accuracy.{field} = {value} with a safety factor of {SAFETY}: {why}")
}

/// The largest of 1, 2, 5 times a power of ten that is not above a limit, clamped.
fn fine(limit: f64, min: f64, max: f64) -> f64 {
    let decade = 10_f64.powf(limit.log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().find(|step| step * decade <= limit * (1.0 + 1e-9)).unwrap_or(1.0);
    // to the decimal that a person would write
    let digits = (-limit.log10().floor()).max(0.0);
    let round = 10_f64.powf(digits);
    ((step * decade * round).round() / round).clamp(min, max)
}

fn optical(accuracy: &AccuracySection, sensitivity: &OpticalSensitivity) -> (f64, String) {
    let limits = [
        ("mesh_mm", accuracy.mesh_mm, accuracy.mesh_mm),
        ("image_px", accuracy.image_px, accuracy.image_px / sensitivity.px_per_radius_mm),
        (
            "dot_placement_mm",
            accuracy.dot_placement_mm,
            accuracy.dot_placement_mm / sensitivity.mm_per_radius_mm,
        ),
    ];
    let tightest = limits.into_iter().min_by(|a, b| a.2.total_cmp(&b.2));
    let (field, value, limit) = tightest.unwrap_or(limits[0]);
    let why = format!(
        "a dome too large by 1 mm moves dots by up to {:.1} px, {:.2} mm",
        sensitivity.px_per_radius_mm, sensitivity.mm_per_radius_mm
    );
    (fine(limit / SAFETY, 1e-4, 10.0), reason(field, value, &why))
}

fn samples(accuracy: &AccuracySection, spread_px: f64) -> (u32, String) {
    // the mean over n sensors is known to the spread of one over the root of n
    let wanted = (spread_px * SAFETY / accuracy.image_px).powi(2).ceil();
    let mut count = 16_u32;
    while f64::from(count) < wanted && count < 65_536 {
        count *= 2;
    }
    let why = format!("the mean shift of one sensor's dots spreads by at most {spread_px:.2} px");
    (count, reason("image_px", accuracy.image_px, &why))
}

/// How far dots move with errors of the optics: the worst, or the root mean square, over the dome.
struct OpticalSensitivity {
    /// Most px that a dot moves for 1 mm of the dome's radius.
    px_per_radius_mm: f64,
    /// The same on the dome, mm: by how much the pixel's ray then misses the dot.
    mm_per_radius_mm: f64,
    /// Upper bound of the spread of a sensor's mean shift, px: the root mean square shift, all tolerances together;
    /// computed only where the number of sensors is to be chosen, since it takes a dozen of them.
    spread_px: Option<f64>,
}

impl OpticalSensitivity {
    fn by(file: &DesignFile, optics: &SensorOptics) -> Result<Self, DesignError> {
        let reach_rad = reach_deg(file).to_radians();
        let dome = optics.dome();
        let points: Vec<DVec3> = (0..=RINGS)
            .flat_map(|ring| (0..AROUND).map(move |k| (ring, k)))
            .map(|(ring, k)| {
                let polar = reach_rad * f64::from(ring) / f64::from(RINGS);
                let azimuth = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
                let flat = polar.sin() * glam::DVec2::from_angle(azimuth);
                dome.center_mm() + dome.radius_mm() * flat.extend(polar.cos())
            })
            .collect();
        let (mut px_per_radius_mm, mut mm_per_radius_mm, mut px_per_mm) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut visible_points = Vec::new();
        for &point in &points {
            let Ok((pixel, slope)) = optics.project_with_jacobian(point) else { continue };
            let normal = dome.normal(point);
            let (side, up) = normal.any_orthonormal_pair();
            let by = |v: DVec3| slope * nalgebra::Vector3::from(v.to_array());
            let out = by(normal);
            px_per_radius_mm = px_per_radius_mm.max(out.norm());
            px_per_mm = px_per_mm.max(by(side).norm()).max(by(up).norm());
            let back = nalgebra::Matrix2::from_columns(&[by(side), by(up)]).try_inverse();
            mm_per_radius_mm = mm_per_radius_mm.max(back.map_or(0.0, |back| (back * out).norm()));
            visible_points.push((point, pixel));
        }
        if visible_points.is_empty() || px_per_radius_mm <= 0.0 {
            return Err(DesignError::at(
                "accuracy",
                "",
                "no settings can be chosen: the camera sees no point of the pattern on the dome",
                "optics that see the dome, or explicit settings",
            ));
        }
        let spread_px = file
            .tolerances
            .samples
            .is_none()
            .then(|| spread(file, optics, &visible_points, px_per_mm, px_per_radius_mm));
        // seen along its normal a dome does not show its radius; its dots still move sideways by the mesh error
        Ok(Self { px_per_radius_mm, mm_per_radius_mm: mm_per_radius_mm.max(0.1), spread_px })
    }
}

/// How far from the pole dots may lie: as the pattern says, or as far as the print reaches.
fn reach_deg(file: &DesignFile) -> f64 {
    let rim_deg = file.dome.rim_angle_deg.unwrap_or(90.0);
    file.pattern.polar_angle_deg.unwrap_or(file.print.wrap_limit_deg).min(89.0).min(rim_deg)
}

/// Root mean square shift of dots in the image, all tolerances drawn together, px: to first order the squares of what
/// each does alone add up.
fn spread(
    file: &DesignFile,
    optics: &SensorOptics,
    points: &[(DVec3, glam::DVec2)],
    px_per_mm: f64,
    px_per_radius_mm: f64,
) -> f64 {
    let t = &file.tolerances;
    let mut squares = 0.0;
    for sensor in toleranced_optics(optics, t).into_iter().flat_map(|off| off.sensors) {
        let shifts = points
            .iter()
            .filter_map(|(point, pixel)| Some(sensor.project(*point).ok()?.distance_squared(*pixel)));
        let (sum, count) = shifts.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
        squares += sum / f64::max(count, 1.0);
    }
    let radius_mm = file.dome.radius_mm;
    let on_dome = [
        t.print_registration_mm * std::f64::consts::SQRT_2,
        t.print_scatter_mm * std::f64::consts::SQRT_2,
        t.print_rotation_deg.to_radians() * radius_mm,
    ];
    // a print on a steep flank is stretched: by one over the cosine, at the pattern's edge
    let steep = reach_deg(file).to_radians().cos().max(0.2);
    squares += on_dome.iter().map(|mm| (mm * px_per_mm / steep).powi(2)).sum::<f64>();
    // the dots grow with the dome, which moves them along it too
    let grown = px_per_radius_mm + px_per_mm * reach_deg(file).to_radians();
    squares += (t.dome_radius_mm * grown).powi(2);
    squares.sqrt()
}

/// The optics with one number off by its tolerance.
#[derive(Debug, Clone)]
pub struct TolerancedOptics {
    /// What it is, in words.
    pub what: &'static str,
    /// Its field in the design file.
    pub field: &'static str,
    /// The sensors, one for each axis or layer that it has; what cannot be is left out.
    pub sensors: Vec<SensorOptics>,
}

/// The optics with one number at a time off by its tolerance.
pub fn toleranced_optics(optics: &SensorOptics, t: &TolerancesSection) -> Vec<TolerancedOptics> {
    let spec = optics.spec();
    let with = |change: &dyn Fn(&mut OpticsSpec)| {
        let mut changed = spec.clone();
        change(&mut changed);
        optics.rebuilt(&changed).ok()
    };
    let axes = [0_usize, 1, 2];
    let moved = |axis: usize| with(&|spec| spec.sensor_from_camera.translation_mm[axis] += t.pupil_mm[axis]);
    let turned = |axis: usize| {
        let angle = t.camera_rotation_deg[axis].to_radians();
        let turn = [DMat3::from_rotation_x, DMat3::from_rotation_y, DMat3::from_rotation_z][axis](angle);
        with(&|spec| {
            let place = spec.sensor_from_camera;
            spec.sensor_from_camera = Rigid::new(turn * place.rotation, place.translation_mm);
        })
    };
    let denser = |index: usize| {
        with(&|spec| {
            if let Some(layer) = spec.layers.get_mut(index) {
                layer.index = layer.index.map(|n| n + t.index);
            }
        })
    };
    let thicker = |index: usize| {
        with(&|spec| {
            if let Some(thickness) = spec.layers.get_mut(index).and_then(|layer| layer.thickness_mm.as_mut())
            {
                *thickness += t.layer_thickness_mm;
            }
        })
    };
    let layers = 0..spec.layers.len();
    let off = |what, field, sensors| TolerancedOptics { what, field, sensors };
    vec![
        off("pupil's place", "tolerances.pupil_mm", axes.into_iter().filter_map(moved).collect()),
        off(
            "camera's direction",
            "tolerances.camera_rotation_deg",
            axes.into_iter().filter_map(turned).collect(),
        ),
        off("indices", "tolerances.index", layers.clone().filter_map(denser).collect()),
        off("sheet's thickness", "tolerances.layer_thickness_mm", layers.filter_map(thicker).collect()),
    ]
}
