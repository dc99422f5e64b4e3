//! A camera on a board: what of it the parts need, its pocket in the lower platform, and its stand-in.
//!
//! Everything is in the camera's frame: the pupil at the origin, z along the lens towards the dome. The lens barrel
//! stands in a bore, the board lies in a pocket that is open below, and bears on posts that stand round its screw
//! holes; between the posts a recess leaves room for what stands on the board's front.

use glam::{DAffine3, DVec2, DVec3};

use super::measures::Measures;
use super::screws::Thread;
use super::{Blueprint, Feature};
use crate::spec::sections::CameraBoardSection;
use domecast_mesh::{Construction, Fit, Piece, Shape};

/// A screw that cuts its own thread into plastic is sunk by this many of its diameters where the block lets it.
const SCREW_DIAMETERS: f64 = 2.5;
/// A slit beside a post narrower than this is left full, mm: no tool clears it, nothing needs it.
const MIN_SLIT_MM: f64 = 1.0;

/// A board's measures, camera frame, mm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BoardSeat {
    /// The board as the design gives it.
    pub board: CameraBoardSection,
    /// Middle of the board.
    pub center_mm: DVec2,
    /// Half of its sides.
    pub half_mm: DVec2,
    /// Axes of its screws.
    pub holes_mm: Vec<DVec2>,
    /// Upper face of the board, which bears on the posts.
    pub face_z_mm: f64,
    /// The board's back.
    pub back_z_mm: f64,
    /// Height of the recess between the posts above the face; 0 for none.
    pub recess_mm: f64,
    /// The screws; `None` if none is as thin as the board's holes.
    pub thread: Option<Thread>,
    /// Half of a post's side.
    pub post_mm: f64,
    /// Depth of the screws' holes above the face.
    pub hole_depth_mm: f64,
}

impl BoardSeat {
    /// The board's measures; `None` for a body that is no board.
    pub(super) fn of(m: &Measures) -> Option<Self> {
        let body = &m.camera_body;
        let board = body.board.clone()?;
        let center_mm = -DVec2::from_array(board.lens_offset_mm);
        let face_z_mm = body.front_from_pupil_mm - body.length_mm;
        let front = board.front_components_height_mm;
        let recess_mm = if front > 0.0 { front + board.clearance_mm } else { 0.0 };
        let thread = Thread::through(board.hole_diameter_mm);
        let (tap, nominal) = thread.map_or((0.0, 0.0), |t| (t.tap_mm, t.nominal_mm));
        let above = m.lower_top_z_mm - m.pupil_mm().z - face_z_mm - m.process.min_wall_mm;
        Some(Self {
            center_mm,
            half_mm: 0.5 * DVec2::from_array(board.size_mm),
            holes_mm: board.holes_mm.iter().map(|at| center_mm + DVec2::from_array(*at)).collect(),
            face_z_mm,
            back_z_mm: face_z_mm - board.thickness_mm,
            recess_mm,
            thread,
            post_mm: 0.5 * tap + m.process.min_wall_mm.max(0.5 * nominal),
            hole_depth_mm: (SCREW_DIAMETERS * nominal).min(above),
            board,
        })
    }

    /// Lowest and highest corner of the pocket, across the lens's axis.
    pub(super) fn pocket_mm(&self) -> [DVec2; 2] {
        let half = self.half_mm + self.board.clearance_mm;
        [self.center_mm - half, self.center_mm + half]
    }

    /// What is free of posts along an axis of the board: from, to.
    fn bands_mm(&self, axis: usize) -> Vec<[f64; 2]> {
        let [low, high] = self.pocket_mm().map(|p| p[axis]);
        let mut posts: Vec<f64> = self.holes_mm.iter().map(|p| p[axis]).collect();
        posts.sort_by(f64::total_cmp);
        let mut bands = Vec::new();
        let mut from = low;
        for at in posts {
            bands.push([from, at - self.post_mm]);
            from = from.max(at + self.post_mm);
        }
        bands.push([from, high]);
        bands.retain(|[from, to]| to - from >= MIN_SLIT_MM);
        bands
    }

    /// Cuts pocket, recess and screw holes; `reach_mm` is beyond the block.
    pub(super) fn cut(&self, m: &Measures, reach_mm: f64, b: &mut Blueprint) {
        let field = "camera_body.board";
        let [low, high] = self.pocket_mm();
        let (face, over) = (self.face_z_mm, 0.5 * self.board.thickness_mm);
        let pocket = Shape::cuboid(low.extend(-reach_mm), high.extend(face));
        b.cut.push(Feature::new("board pocket", field, pocket).placed(m.sensor_from_camera));
        if self.recess_mm > 0.0 {
            let (floor, roof) = (face - over, face + self.recess_mm);
            let along_x = self
                .bands_mm(0)
                .into_iter()
                .map(|[from, to]| (DVec3::new(from, low.y, floor), DVec3::new(to, high.y, roof)));
            let along_y = self
                .bands_mm(1)
                .into_iter()
                .map(|[from, to]| (DVec3::new(low.x, from, floor), DVec3::new(high.x, to, roof)));
            for (i, (low, high)) in along_x.chain(along_y).enumerate() {
                let feature = Feature::new("board recess", field, Shape::cuboid(low, high));
                b.cut.push(feature.numbered(i).placed(m.sensor_from_camera));
            }
        }
        let Some(thread) = self.thread.filter(|_| self.hole_depth_mm > 0.0) else { return };
        for (i, at) in self.holes_mm.iter().enumerate() {
            let hole =
                Shape::cylinder(0.5 * thread.tap_mm, face - over, face + self.hole_depth_mm, Fit::Area);
            let placed = m.sensor_from_camera * DAffine3::from_translation(at.extend(0.0));
            b.cut.push(Feature::new("board screw hole", field, hole).numbered(i).placed(placed));
        }
    }

    /// The board with its holes, the lens barrel, and a block as high as what stands on the back, sensor frame at rest.
    pub(super) fn stand_in(&self, m: &Measures) -> Construction {
        let body = &m.camera_body;
        let place = |name: &str, shape: Shape| Piece::new(name, shape).placed(m.sensor_from_camera);
        let corners = [self.center_mm - self.half_mm, self.center_mm + self.half_mm];
        let plate = Shape::cuboid(corners[0].extend(self.back_z_mm), corners[1].extend(self.face_z_mm));
        // From within the board, so that no faces coincide.
        let middle = 0.5 * (self.back_z_mm + self.face_z_mm);
        let barrel = Shape::cylinder(0.5 * body.diameter_mm, middle, body.front_from_pupil_mm, Fit::Inside);
        let mut added = vec![place("camera board", plate), place("lens barrel", barrel)];
        let head = self.thread.map_or(0.0, |t| 0.5 * t.head_mm);
        // What stands on the back leaves the screws' heads free.
        let free = |axis: usize| {
            let edge = self.center_mm[axis] - self.half_mm[axis];
            let other = self.center_mm[axis] + self.half_mm[axis];
            self.holes_mm.iter().fold([edge, other], |[low, high], at| {
                let at = at[axis];
                if at - edge < other - at { [low.max(at + head), high] } else { [low, high.min(at - head)] }
            })
        };
        let (x, y) = (free(0), [corners[0].y, corners[1].y]);
        if self.board.components_height_mm > 0.0 && x[1] > x[0] {
            let low = DVec3::new(x[0], y[0], self.back_z_mm - self.board.components_height_mm);
            added.push(place("board parts", Shape::cuboid(low, DVec3::new(x[1], y[1], middle))));
        }
        let over = self.board.thickness_mm;
        let cut = self.holes_mm.iter().enumerate().map(|(i, at)| {
            let radius = 0.5 * self.board.hole_diameter_mm;
            let hole = Shape::cylinder(radius, self.back_z_mm - over, self.face_z_mm + over, Fit::Outside);
            let placed = m.sensor_from_camera * DAffine3::from_translation(at.extend(0.0));
            Piece::new(format!("board hole {i}"), hole).placed(placed)
        });
        Construction { added, cut: cut.collect() }
    }
}
