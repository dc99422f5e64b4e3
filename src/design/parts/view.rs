//! What the camera must be able to see through the upper platform.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::PartError;
use domecast_mesh::{Fit, Profile, Shape};
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;
use domecast_optics::numeric::Rigid;

/// Directions round a rim or marker that are followed.
pub(super) const DIRECTIONS: u32 = 48;
/// Heights at which the dome's cone is taken. It is the hull of straight rays,
/// so its radius is a convex function of height, and straight lines between
/// these heights lie outside it.
const HEIGHTS: u32 = 9;

/// A straight ray of the camera's view in air, in the platform's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SightLine {
    /// The entrance pupil, mm.
    pub pupil_mm: DVec3,
    /// Where the ray enters the sheet, mm.
    pub sheet_mm: DVec3,
    /// Its angle to the camera's axis, rad.
    pub angle_rad: f64,
}

impl SightLine {
    fn at_height(&self, z_mm: f64) -> DVec2 {
        let along = self.sheet_mm - self.pupil_mm;
        (self.pupil_mm + along * ((z_mm - self.pupil_mm.z) / along.z)).truncate()
    }
}

/// The chief rays from the rim of a disc on the sheet's top face to the pupil,
/// at one pose of the platform. A point that the lens cannot see has none;
/// that the design requires it is checked elsewhere.
pub(super) fn sight_lines(optics: &SensorOptics, center_mm: DVec2, radius_mm: f64) -> Vec<SightLine> {
    (0..DIRECTIONS)
        .filter_map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS);
            let point = (center_mm + radius_mm * DVec2::from_angle(angle)).extend(0.0);
            sight_line(optics, optics.project(point).ok()?)
        })
        .collect()
}

/// The chief ray of a pixel from the pupil through the air to the sheet; `None` where the lens has none, or where it
/// does not rise to the sheet.
pub(super) fn sight_line(optics: &SensorOptics, pixel: DVec2) -> Option<SightLine> {
    let bottom_mm = -optics.layers().iter().skip(1).filter_map(|l| l.thickness_mm).sum::<f64>();
    let sensor_from_camera = optics.sensor_from_camera();
    let ray = optics.lens().unproject(pixel).ok()?;
    let angle_rad = Lens::field_angle_rad(ray);
    let pupil_mm = sensor_from_camera.point(DVec3::Z * optics.lens().pupil_shift_mm(angle_rad).0);
    let direction = sensor_from_camera.vector(ray);
    (direction.z > 0.0).then(|| SightLine {
        pupil_mm,
        sheet_mm: pupil_mm + direction * ((bottom_mm - pupil_mm.z) / direction.z),
        angle_rad,
    })
}

/// The camera's view of dome and markers below the sheet at all positions of
/// the springs, in the frame of the platform: a cone about the axis for the
/// dome, and a slanting one for each marker.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewCone {
    /// `(radius, z)` of the dome's cone from bottom to top, mm.
    cone_mm: Vec<DVec2>,
    beams: Vec<Beam>,
    margin_mm: f64,
}

/// The rays to the dome's rim and to each marker's edge, at all poses.
#[derive(Debug, Clone, Default)]
struct Lines {
    rim: Vec<SightLine>,
    markers: Vec<Vec<SightLine>>,
}

impl Lines {
    /// In the frame of the platform; of a pose at which the lens sees nothing of the rim there are none.
    fn over(
        optics: &SensorOptics,
        rim_radius_mm: f64,
        (markers_mm, marker_radius_mm): (&[DVec2], f64),
        poses: &[Rigid],
    ) -> Result<Self, PartError> {
        let mut all = Self { rim: Vec::new(), markers: vec![Vec::new(); markers_mm.len()] };
        for pose in poses {
            let moved = optics.at_pose(pose).map_err(|error| PartError::View {
                problem: format!("at one of the springs' positions {error}"),
                field: "camera.position_mm".into(),
            })?;
            all.rim.extend(sight_lines(&moved, DVec2::ZERO, rim_radius_mm));
            for (lines, &center) in all.markers.iter_mut().zip(markers_mm) {
                lines.extend(sight_lines(&moved, center, marker_radius_mm));
            }
        }
        Ok(all)
    }

    /// The same, if the dome's rim is among them.
    fn with_rim(self) -> Result<Self, PartError> {
        if self.rim.is_empty() {
            return Err(PartError::View {
                problem: "the dome's rim cannot be seen at any position of the springs".into(),
                field: "camera.position_mm".into(),
            });
        }
        Ok(self)
    }

    /// Takes in others, each brought into this one's frame.
    fn extend(&mut self, other: Self, mut moved: impl FnMut(SightLine) -> SightLine) {
        self.rim.extend(other.rim.into_iter().map(&mut moved));
        self.markers.resize(self.markers.len().max(other.markers.len()), Vec::new());
        for (mine, others) in self.markers.iter_mut().zip(other.markers) {
            mine.extend(others.into_iter().map(&mut moved));
        }
    }
}

/// Circles round all rays of one marker at the lowest and highest height.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Beam {
    low_mm: DVec2,
    low_radius_mm: f64,
    high_mm: DVec2,
    high_radius_mm: f64,
}

impl ViewCone {
    /// Follows the rays from the rim of the dome's base and of the markers,
    /// through the sheet, down to the pupil.
    ///
    /// * `rim_radius_mm`, `markers_mm`, `marker_radius_mm`: what must be seen,
    ///   on the sheet's top face;
    /// * `poses`: `rest_from_platform` for every position of the springs that
    ///   counts;
    /// * `low_z_mm`, `high_z_mm`: the heights between which the platform may
    ///   stand in the way;
    /// * `margin_mm`: gap kept across the edge ray.
    ///
    /// # Errors
    /// [`PartError::View`] if a pose is impossible, or the dome's rim cannot be
    /// seen at any.
    pub fn over(
        optics: &SensorOptics,
        rim_radius_mm: f64,
        (markers_mm, marker_radius_mm): (&[DVec2], f64),
        poses: &[Rigid],
        (low_z_mm, high_z_mm): (f64, f64),
        margin_mm: f64,
    ) -> Result<Self, PartError> {
        let lines = Lines::over(optics, rim_radius_mm, (markers_mm, marker_radius_mm), poses)?.with_rim()?;
        Ok(Self::of_lines(&lines, (low_z_mm, high_z_mm), margin_mm))
    }

    /// What the same view needs of the lower platform: in the rest frame less the pupil's place beside the axis,
    /// which the opening goes round.
    ///
    /// # Errors
    /// As [`ViewCone::over`].
    pub(super) fn below(
        optics: &SensorOptics,
        rim_radius_mm: f64,
        (markers_mm, marker_radius_mm): (&[DVec2], f64),
        poses: &[Rigid],
        (low_z_mm, high_z_mm): (f64, f64),
        margin_mm: f64,
    ) -> Result<Self, PartError> {
        let beside = optics.rest_from_camera().translation_mm.with_z(0.0);
        let mut lines = Lines::default();
        for pose in poses {
            let seen = Lines::over(
                optics,
                rim_radius_mm,
                (markers_mm, marker_radius_mm),
                std::slice::from_ref(pose),
            )?;
            lines.extend(seen, |line| SightLine {
                pupil_mm: pose.point(line.pupil_mm) - beside,
                sheet_mm: pose.point(line.sheet_mm) - beside,
                ..line
            });
        }
        Ok(Self::of_lines(&lines.with_rim()?, (low_z_mm, high_z_mm), margin_mm))
    }

    fn of_lines(lines: &Lines, (low_z_mm, high_z_mm): (f64, f64), margin_mm: f64) -> Self {
        let Lines { rim, markers } = lines;
        let cone_mm: Vec<DVec2> = (0..HEIGHTS)
            .map(|i| {
                let z = low_z_mm + (high_z_mm - low_z_mm) * f64::from(i) / f64::from(HEIGHTS - 1);
                DVec2::new(rim.iter().map(|line| line.at_height(z).length()).fold(0.0, f64::max), z)
            })
            .collect();
        let beam = |lines: &Vec<SightLine>| {
            // The circle also takes in a point inside the cone, in the same
            // direction: beam and cone then overlap well, and no thin wall is
            // left between them.
            let circle = |z: f64, cone: f64| {
                let mut points: Vec<DVec2> = lines.iter().map(|line| line.at_height(z)).collect();
                let mean = points.iter().sum::<DVec2>() / points.len() as f64;
                points.push(mean.normalize_or_zero() * (0.85 * cone));
                enclosing_circle(&points)
            };
            let ((low_mm, low), (high_mm, high)) = (
                circle(low_z_mm, cone_mm.first().map_or(0.0, |p| p.x)),
                circle(high_z_mm, cone_mm.last().map_or(0.0, |p| p.x)),
            );
            let slope = (high - low + (high_mm - low_mm).length()) / (high_z_mm - low_z_mm);
            let margin = margin_mm * (1.0 + slope * slope).sqrt();
            Beam { low_mm, low_radius_mm: low + margin, high_mm, high_radius_mm: high + margin }
        };
        let beams = markers.iter().filter(|lines| !lines.is_empty()).map(beam).collect();
        Self { cone_mm, beams, margin_mm }
    }

    /// Radius of the dome's cone at a height, with the margin; beyond the
    /// heights that were followed the first or last slope goes on.
    pub fn radius_mm(&self, z_mm: f64) -> f64 {
        let mut pairs = self.cone_mm.windows(2).map(|w| (w[0], w[1]));
        let Some((low, high)) = pairs.clone().find(|(_, high)| z_mm <= high.y).or_else(|| pairs.next_back())
        else {
            return 0.0;
        };
        let slope = (high.x - low.x) / (high.y - low.y);
        // The margin is kept across the ray, which makes it longer sideways.
        low.x + slope * (z_mm - low.y) + self.margin_mm * (1.0 + slope * slope).sqrt()
    }

    /// How near a point of a ray comes to the window's edge at its height: the distance from the middle of the
    /// opening that it is in (the dome's cone or a marker's beam) over that opening's radius; above 1 it is
    /// behind the edge.
    pub fn used(&self, point_mm: DVec3) -> f64 {
        let at = point_mm.truncate();
        let share = |middle: DVec2, radius_mm: f64| {
            if radius_mm > 0.0 { at.distance(middle) / radius_mm } else { f64::MAX }
        };
        let dome = share(DVec2::ZERO, self.radius_mm(point_mm.z));
        let (Some(low), Some(high)) = (self.cone_mm.first(), self.cone_mm.last()) else { return dome };
        let part = (point_mm.z - low.y) / (high.y - low.y);
        let beam = |b: &Beam| {
            let radius_mm = b.low_radius_mm + part * (b.high_radius_mm - b.low_radius_mm);
            share(b.low_mm.lerp(b.high_mm, part), radius_mm)
        };
        self.beams.iter().map(beam).fold(dome, f64::min)
    }

    /// Distance of a point from the opening's surface, mm: sideways at its height, less the slope; negative within.
    pub(super) fn clearance_mm(&self, at_mm: DVec2, z_mm: f64) -> f64 {
        let (Some(low), Some(high)) = (self.cone_mm.first(), self.cone_mm.last()) else {
            return f64::INFINITY;
        };
        let height = (high.y - low.y).max(f64::MIN_POSITIVE);
        let upright = |slope: f64| 1.0 / (1.0 + slope * slope).sqrt();
        let cone = (at_mm.length() - self.radius_mm(z_mm)) * upright((high.x - low.x) / height);
        let part = (z_mm - low.y) / height;
        let beam = |b: &Beam| {
            let wider = b.high_radius_mm - b.low_radius_mm;
            let off = at_mm.distance(b.low_mm.lerp(b.high_mm, part)) - (b.low_radius_mm + part * wider);
            off * upright((wider.abs() + b.low_mm.distance(b.high_mm)) / height)
        };
        self.beams.iter().map(beam).fold(cone, f64::min)
    }

    /// Whether all of it is within a distance of the axis.
    pub(super) fn is_within(&self, radius_mm: f64) -> bool {
        let heights = self.cone_mm.iter().all(|p| self.radius_mm(p.y) <= radius_mm);
        let reach = |at: DVec2, r: f64| at.length() + r <= radius_mm;
        heights
            && self
                .beams
                .iter()
                .all(|b| reach(b.low_mm, b.low_radius_mm) && reach(b.high_mm, b.high_radius_mm))
    }

    /// The height up to which all of it is within a distance of the axis, between those that were followed, mm.
    pub(super) fn highest_within(&self, radius_mm: f64) -> f64 {
        let (Some(first), Some(last)) = (self.cone_mm.first(), self.cone_mm.last()) else {
            return f64::INFINITY;
        };
        let reach = |z: f64| {
            let part = (z - first.y) / (last.y - first.y).max(f64::MIN_POSITIVE);
            let beam = |b: &Beam| {
                let radius = b.low_radius_mm + part * (b.high_radius_mm - b.low_radius_mm);
                b.low_mm.lerp(b.high_mm, part).length() + radius
            };
            self.beams.iter().map(beam).fold(self.radius_mm(z), f64::max)
        };
        let (mut low, mut high) = (first.y, last.y);
        if reach(high) <= radius_mm {
            return high;
        }
        // The view widens upwards, but for the beams' rounding.
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if reach(middle) <= radius_mm { low = middle } else { high = middle }
        }
        low
    }

    /// Largest distance from the axis that the view needs, with the margin, mm.
    pub fn max_radius_mm(&self) -> f64 {
        let cone = self.cone_mm.last().map_or(0.0, |p| self.radius_mm(p.y));
        self.beams.iter().map(|b| b.high_mm.length() + b.high_radius_mm).fold(cone, f64::max)
    }

    /// Largest x and y that the view needs at the sheet, with the margin, mm.
    pub(super) fn half_extent_mm(&self) -> DVec2 {
        let cone = self.cone_mm.last().map_or(0.0, |p| self.radius_mm(p.y));
        self.beams
            .iter()
            .map(|b| b.high_mm.abs() + DVec2::splat(b.high_radius_mm))
            .fold(DVec2::splat(cone), DVec2::max)
    }

    /// The dome's cone, to cut out of the platform from `over_mm` below the
    /// lowest height to `top_z_mm`.
    pub(super) fn cone(&self, over_mm: f64, top_z_mm: f64) -> Shape {
        let mut points: Vec<(f64, f64)> = self.cone_mm.iter().map(|p| (self.radius_mm(p.y), p.y)).collect();
        if let [first, second, ..] = points[..] {
            let slope = (second.0 - first.0) / (second.1 - first.1);
            // Below the underside the first slope goes on, but not past the axis.
            points.insert(0, ((first.0 - slope * over_mm).max(0.5 * first.0), first.1 - over_mm));
        }
        if let Some(&last) = points.last() {
            points.push((last.0, top_z_mm));
        }
        Shape::Turned { profile: Profile::lines(&points), fit: Fit::Outside }
    }

    /// The markers' beams as slanting cones: a shape about its own axis, and
    /// the shear that slants it. They end at `top_z_mm`, straight above the
    /// sheet's seat.
    pub(super) fn beams(&self, over_mm: f64, top_z_mm: f64) -> Vec<(Shape, DAffine3)> {
        let (Some(low), Some(high)) = (self.cone_mm.first(), self.cone_mm.last()) else { return Vec::new() };
        let height = high.y - low.y;
        self.beams
            .iter()
            .map(|b| {
                let slope = (b.high_radius_mm - b.low_radius_mm) / height;
                let shift = (b.high_mm - b.low_mm) / height;
                let first = (b.low_radius_mm - slope * over_mm).max(0.5 * b.low_radius_mm);
                // Past the seat the slant goes on for a little, inside the recess.
                let above = (0.02 * height).min(top_z_mm - high.y).max(1e-3 * height);
                let points = [
                    (first, low.y - over_mm),
                    (b.low_radius_mm, low.y),
                    (b.high_radius_mm, high.y),
                    (b.high_radius_mm + slope * above, high.y + above),
                ];
                let shape = Shape::Turned { profile: Profile::lines(&points), fit: Fit::Outside };
                // x, y move with z; circles stay circles.
                let shear = DMat3::from_cols(DVec3::X, DVec3::Y, shift.extend(1.0));
                let origin = b.low_mm - shift * low.y;
                (shape, DAffine3 { matrix3: shear, translation: origin.extend(0.0) })
            })
            .collect()
    }
}

/// A circle round all points, close to the smallest: its centre is moved
/// towards the farthest point in shrinking steps (Badoiu and Clarkson 2003),
/// its radius is then exact for that centre.
fn enclosing_circle(points: &[DVec2]) -> (DVec2, f64) {
    let farthest = |c: DVec2| {
        let squared = |p: DVec2| c.distance_squared(p);
        points.iter().map(|&p| (squared(p), p)).reduce(|p, q| if q.0 >= p.0 { q } else { p }).map(|(_, p)| p)
    };
    let mut center = points.iter().sum::<DVec2>() / points.len().max(1) as f64;
    for step in 1..200 {
        if let Some(p) = farthest(center) {
            center += (p - center) / f64::from(step + 1);
        }
    }
    (center, farthest(center).map_or(0.0, |p| center.distance(p)))
}
