//! The sensor at one time: its pose, its shape, and where its dots and markers appear.

use glam::{DVec2, DVec3};

use super::SimError;
use super::coverage::{area_moment, clip, clip_to_image};
use super::effect::EffectName;
use super::eye::{Apparent, Eye, PlacedEye};
use super::outline::RimFit;
use super::pipeline::Geometry;
use super::scene::{RIM_POINTS, Scene, SceneDot, State};
use super::work::Work;
use crate::numeric::Rigid;
use crate::optics::Limit;

/// Counted work of one point: a straight ray through the lens, and what each effect adds.
pub(super) mod units {
    /// Straight ray and pinhole.
    pub const STRAIGHT: u64 = 20;
    /// The lens's polynomial.
    pub const LENS: u64 = 20;
    /// The pupil that belongs to the field angle: a bracketed root around the whole ray.
    pub const PUPIL: u64 = 600;
    /// The climb to the refracted ray.
    pub const BEND: u64 = 80;
    /// A corner of a polygon drawn.
    pub const CORNER: u64 = 15;
    /// A pixel blended.
    pub const PIXEL: u64 = 2;
    /// A balance of the springs.
    pub const BALANCE: u64 = 20_000;
}

/// The sensor at one time.
#[derive(Debug, Clone)]
pub struct Instant {
    /// When, s.
    pub time_s: f64,
    /// Pose and load.
    pub state: State,
    /// The camera over it.
    pub eye: PlacedEye,
}

/// The image of a dot or marker in one channel.
#[derive(Debug, Clone, Default)]
pub struct Spot {
    /// Image of its centre, px.
    pub center_px: DVec2,
    /// Its outline as drawn, clipped to the picture, px.
    pub polygon: Vec<DVec2>,
    /// Signed area of the polygon, px^2.
    pub area_px2: f64,
    /// Centroid of the polygon.
    pub centroid_px: DVec2,
}

/// The fixed points whose images are followed: each dot's and marker's centre and outline.
#[derive(Debug, Clone)]
pub struct Points {
    fit: RimFit,
    markers: Vec<[DVec3; RIM_POINTS + 1]>,
    dots: Vec<[DVec3; RIM_POINTS + 1]>,
    /// By channel, then dot (markers after the dots): apparent places at rest. Empty where the bend is solved.
    apparent: Vec<Vec<[Option<Apparent>; RIM_POINTS + 1]>>,
}

fn with_center(center: DVec3, rim: &[DVec3; RIM_POINTS]) -> [DVec3; RIM_POINTS + 1] {
    std::array::from_fn(|k| k.checked_sub(1).map_or(center, |k| rim[k]))
}

impl Points {
    /// The points of a scene; `solves`: whether each frame solves the bend, else the apparent places are
    /// found here, once.
    pub fn new(scene: &Scene, eye: &Eye, solves: bool, edge_tolerance_px: f64, work: &mut Work) -> Self {
        let dots: Vec<_> = scene.dots().iter().map(|dot| with_center(dot.center_mm, &dot.rim_mm)).collect();
        let marker = |marker: &crate::pose::Marker| {
            let rim = std::array::from_fn(|k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / RIM_POINTS as f64).sin_cos();
                marker.position_mm + DVec3::new(cos, sin, 0.0) * (0.5 * marker.diameter_mm)
            });
            with_center(marker.position_mm, &rim)
        };
        let markers: Vec<_> = scene.markers().iter().map(marker).collect();
        let largest_px =
            scene.layout().dots.iter().map(|dot| 0.5 * dot.image_outline.widths().1).fold(1.0, f64::max);
        let mut apparent = Vec::new();
        if !solves {
            let all = || dots.iter().chain(&markers);
            for channel in 0..eye.channels() {
                apparent.push(
                    all().map(|points| points.map(|point| eye.apparent(channel, point).ok())).collect(),
                );
            }
            work.add(
                EffectName::Refraction,
                (all().count() * (RIM_POINTS + 1) * eye.channels()) as u64 * units::BEND,
            );
        }
        Self { fit: RimFit::new(largest_px, edge_tolerance_px), markers, dots, apparent }
    }

    /// Number of followed points, centres and outlines.
    pub fn count(scene: &Scene) -> u64 {
        ((scene.dots().len() + scene.markers().len()) * (RIM_POINTS + 1)) as u64
    }

    fn see(
        &self,
        eye: &PlacedEye,
        channel: usize,
        item: usize,
        points: &[DVec3; RIM_POINTS + 1],
        k: usize,
    ) -> Result<DVec2, Limit> {
        let shown = self.apparent.get(channel).and_then(|items| items.get(item));
        match shown {
            None => eye.project(channel, points[k]),
            Some(apparent) => eye.project_apparent(channel, &apparent[k].ok_or(Limit::Unreachable)?),
        }
    }

    /// The image of a dot; `None` where its centre is not seen.
    pub fn dot(&self, scene: &Scene, instant: &Instant, channel: usize, index: usize) -> Option<Spot> {
        let points = self.dots.get(index)?;
        let cut = scene.dots().get(index).and_then(|dot: &SceneDot| dot.cut);
        self.spot(scene, instant, channel, index, points, cut)
    }

    /// The image of a white marker; `None` where its centre is not seen.
    pub fn marker(&self, scene: &Scene, instant: &Instant, channel: usize, index: usize) -> Option<Spot> {
        self.spot(scene, instant, channel, self.dots.len() + index, self.markers.get(index)?, None)
    }

    fn spot(
        &self,
        scene: &Scene,
        instant: &Instant,
        channel: usize,
        item: usize,
        points: &[DVec3; RIM_POINTS + 1],
        cut: Option<(f64, f64)>,
    ) -> Option<Spot> {
        let center_px = self.see(&instant.eye, channel, item, points, 0).ok()?;
        let mut rim = [DVec2::ZERO; RIM_POINTS];
        let mut seen = Vec::new();
        for (k, place) in rim.iter_mut().enumerate() {
            if let Ok(pixel) = self.see(&instant.eye, channel, item, points, k + 1) {
                *place = pixel;
                seen.push(pixel);
            }
        }
        let mut polygon = Vec::new();
        if seen.len() == RIM_POINTS {
            self.fit.polygon(&rim, &mut polygon);
        } else {
            // At the end of the lens's domain only a part of the outline is seen.
            polygon = seen;
        }
        if let Some((left, angle)) = cut {
            polygon = cut_off(&rim, center_px, &polygon, left, angle);
        }
        let (width, height) = scene.image_size();
        let polygon = clip_to_image(&polygon, width, height);
        let (area, moment) = area_moment(&polygon);
        let centroid_px = if area.abs() > 1e-9 { moment / area } else { center_px };
        Some(Spot { center_px, polygon, area_px2: area.abs(), centroid_px })
    }
}

/// What a straight cut leaves of a dot: `left` of its width along the direction of the outline's angle.
fn cut_off(rim: &[DVec2; RIM_POINTS], center: DVec2, polygon: &[DVec2], left: f64, angle: f64) -> Vec<DVec2> {
    if left >= 1.0 {
        return polygon.to_vec();
    }
    if left <= 0.0 {
        return Vec::new();
    }
    // The outline's angle turns with the dot: the first point and the one a quarter further span it.
    let (sin, cos) = angle.sin_cos();
    let across = ((rim[0] - rim[RIM_POINTS / 2]) * cos
        + (rim[RIM_POINTS / 4] - rim[3 * RIM_POINTS / 4]) * sin)
        .normalize_or_zero();
    let reach = polygon.iter().map(|p| across.dot(*p - center));
    let (low, high) = reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), d| (l.min(d), h.max(d)));
    clip(polygon, across, across.dot(center) + low + left * (high - low))
}

/// The sensor at a time, without objects.
///
/// # Errors
/// A load without balance, named with the frame.
pub fn at_time(
    scene: &Scene,
    eye: &Eye,
    geometry: Geometry,
    frame: u32,
    time_s: f64,
    work: &mut Work,
) -> Result<Instant, SimError> {
    let state = scene
        .motion()
        .at(scene.suspension(), time_s)
        .map_err(|error| SimError::Frame { frame, problem: error.to_string() })?;
    let pose = if geometry.sheet_motion {
        work.add(EffectName::SheetMotion, units::BALANCE);
        state.pose
    } else {
        Rigid::identity()
    };
    let state = State { pose, ..state };
    let eye = eye.at(&state.pose)?;
    Ok(Instant { time_s, state, eye })
}

/// Counts the work of projecting points with the effects that take part.
pub fn count_points(geometry: Geometry, channels: usize, central: bool, points: u64, work: &mut Work) {
    let mut one = Work::default();
    one.add_base(points * units::STRAIGHT);
    if geometry.lens_distortion {
        one.add(EffectName::LensDistortion, points * units::LENS);
    }
    if geometry.pupil_shift && !central {
        one.add(EffectName::PupilShift, points * units::PUPIL);
    }
    if geometry.refraction {
        let solver = if geometry.gap_change { EffectName::GapChange } else { EffectName::Refraction };
        if geometry.gap_change || !geometry.sheet_motion {
            one.add(solver, points * units::BEND);
        }
    }
    // What further colours do is the dispersion's.
    let again = one.total() * (channels.max(1) as u64 - 1);
    work.merge(&one);
    if again > 0 {
        work.add(EffectName::Dispersion, again);
    }
}
