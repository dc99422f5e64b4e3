//! Room for the lights' pits, from the measures alone: walls to the outside, to the magnets' pockets, between pits, and at the
//! set screws that low lights leave little room. What the check of walls finds in the finished mesh, this finds of the pits in no time; the mesh has the last word.

use glam::{DVec2, DVec3};

use super::Measures;
use super::walls::OPPOSITE;

/// A pit as it is cut, seen along the axis: a rectangle in the frame of its light's azimuth.
struct Pit {
    outward: DVec2,
    /// Distances from the axis of its front and its back, and half of its width, mm.
    along_mm: [f64; 2],
    /// Distance from the axis at which its back has its last wall, mm: at the sheet's seat; at the board's foot where it leans
    /// so far that what is behind it ends in an edge, not in a wall.
    wall_end_mm: f64,
    half_width_mm: f64,
}

impl Pit {
    fn of(m: &Measures, i: usize) -> Self {
        let leds = &m.leds;
        let led = m.platform_from_led(i);
        let outward = DVec2::from_angle(leds.list.get(i).map_or(0.0, |led| led.azimuth_deg).to_radians());
        let (back, front) = (
            leds.package_height_mm + leds.board_thickness_mm + leds.clearance_mm,
            leds.diffuser_thickness_mm + leds.clearance_mm,
        );
        // at the board's foot and where it comes out at the sheet's seat
        let up = led.matrix3.y_axis.z.max(0.1);
        let foot = leds.board_offset_mm - half_height_mm(m);
        let seat = (m.seat_z_mm() - leds.center_z_mm) / up;
        let ends = [(foot, front), (seat, front), (foot, -back), (seat, -back)];
        let along = ends.map(|(y, z)| led.transform_point3(DVec3::new(0.0, y, z)).truncate().dot(outward));
        Self {
            outward,
            along_mm: [along[0].min(along[1]), along[2].max(along[3])],
            wall_end_mm: if up >= -OPPOSITE { along[2].max(along[3]) } else { along[2] },
            half_width_mm: 0.5 * leds.board_mm[0].max(leds.package_mm[0]) + leds.clearance_mm,
        }
    }

    /// Distance of a point, mm; 0 within.
    fn distance_mm(&self, at: DVec2) -> f64 {
        let (along, across) = (at.dot(self.outward), at.dot(self.outward.perp()).abs());
        let [near, far] = self.along_mm;
        DVec2::new((near - along).max(along - far).max(0.0), (across - self.half_width_mm).max(0.0)).length()
    }

    fn ends_mm(&self, along_mm: f64) -> [DVec2; 2] {
        [-1.0, 1.0].map(|side| self.outward * along_mm + self.outward.perp() * (side * self.half_width_mm))
    }
}

fn half_height_mm(m: &Measures) -> f64 {
    0.5 * m.leds.board_mm[1].max(m.leds.package_mm[1]) + m.leds.clearance_mm
}

/// The light channel is wider than the pit by this share on each side: their
/// side faces are then clearly apart, not almost in one plane.
pub(super) const CHANNEL_STEP: f64 = 0.04;

/// Material thinner than this is none, mm.
const SKIN_MM: f64 = 1e-3;

/// Distance from the axis at which the light channels end, inside of the pits, mm. A board that leans far has its pit's
/// front, at the seat, outside its own middle: no skin may stay between.
pub(super) fn channel_end_mm(m: &Measures) -> f64 {
    let leds = &m.leds;
    let (up, out) = leds.tilt_deg.to_radians().sin_cos();
    let up = up.max(0.1);
    let front = leds.diffuser_thickness_mm + leds.clearance_mm;
    let beyond = (m.seat_z_mm() - leds.center_z_mm) * out / up - front / up;
    // Into the pit, also where the pit's front is behind the emitting face.
    let into = 0.5 * front.abs().max(2.0 * SKIN_MM);
    leds.center_radius_mm + if beyond > SKIN_MM { beyond + into } else { 0.0 }
}

/// By how much the thinnest wall at a light's pit or a set screw's hole misses what the process makes, mm; 0 where none does.
pub fn missing_light_wall_mm(m: &Measures) -> f64 {
    let wall = m.process.min_wall_mm;
    let pits: Vec<Pit> = (0..m.leds.list.len()).map(|i| Pit::of(m, i)).collect();
    let (pocket, depth) = m.pocket_mm();
    let bottom = m.leds.center_z_mm + m.leds.board_offset_mm - half_height_mm(m);
    let reaches_pockets = m.platforms.upper.underside_z_mm + depth + wall > bottom;
    let hole = 0.5 * m.pockets.push_out_diameter_mm;
    let round = if reaches_pockets { pocket } else { hole };
    let mut missing = 0.0_f64;
    for (i, pit) in pits.iter().enumerate() {
        let outside = |corner: DVec2| (0.5 * m.outer_mm - corner.abs()).min_element();
        let outer = pit.ends_mm(pit.wall_end_mm).map(outside).into_iter().fold(f64::INFINITY, f64::min);
        // The channel's end is upright: it leaves a wall, or goes through.
        let end = pit.outward * channel_end_mm(m);
        let aside = pit.outward.perp() * (pit.half_width_mm * (1.0 + CHANNEL_STEP));
        let beside = outside(end - aside).min(outside(end + aside));
        let outer = if beside > 0.0 { outer.min(beside) } else { outer };
        let springs = m.spring_axes_mm.iter().map(|axis| pit.distance_mm(*axis) - round);
        let others = pits.iter().enumerate().filter(|(j, _)| *j != i).flat_map(|(_, other)| {
            other
                .along_mm
                .into_iter()
                .flat_map(|along| other.ends_mm(along))
                .map(|corner| pit.distance_mm(corner))
        });
        let thinnest = springs.chain(others).fold(outer, f64::min);
        missing = missing.max(wall - thinnest);
    }
    missing.max(wall - clamp_wall_mm(m))
}

/// The lowest that a light well's floor may be for the walls over the upper magnets' pockets, mm; `None` where there is no well
/// over them.
pub fn min_well_floor_mm(m: &Measures) -> Option<f64> {
    let (pocket, depth) = m.pocket_mm();
    let wall = m.process.min_wall_mm;
    let well = m.leds.well_radius_mm?;
    let is_over = m.spring_axes_mm.iter().any(|axis| axis.length() - pocket - wall < well);
    is_over.then_some(m.platforms.upper.underside_z_mm + depth + wall)
}

/// The thinnest wall between a set screw's hole and a lower magnet's pocket, which comes down with the platform above, mm.
fn clamp_wall_mm(m: &Measures) -> f64 {
    let clamp = &m.platforms.lower.clamp;
    let (pocket, depth) = m.pocket_mm();
    let down = (m.lower_top_z_mm - depth - clamp.z_mm).max(0.0);
    let walls = clamp.azimuth_deg.iter().flat_map(|azimuth_deg| {
        let way = DVec2::from_angle(azimuth_deg.to_radians());
        let ahead = m.spring_axes_mm.iter().map(|axis| *axis - m.pupil_mm().truncate());
        ahead.filter(move |axis| axis.dot(way) > 0.0).map(move |axis| {
            let aside = (axis.perp_dot(way).abs() - pocket).max(0.0);
            aside.hypot(down) - 0.5 * clamp.hole_diameter_mm
        })
    });
    walls.fold(f64::INFINITY, f64::min)
}
