//! A node that may touch: the plane that it may not pass, and where friction would carry it.

use glam::{DMat3, DVec3};

use crate::elastomer::Elastomer;
use crate::error::ContactError;
use crate::level::DEEPEST;
use crate::object::Placed;
use crate::outcome::{History, NodeMemory};
use crate::state::ContactState;
use domecast_elastic::NodeParts;
use domecast_optics::DomeShape;
use domecast_optics::numeric::Rigid;

/// A node that may touch.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub node: usize,
    /// The level's nodes that it moves with and hands its force to.
    pub parts: NodeParts,
    pub at_mm: DVec3,
    /// Into the dome there.
    pub inward: DVec3,
    pub area_mm2: f64,
    /// Standard deviations of its hat along the meridian and along the ring, mm; four places that have its moments.
    pub spread_mm: [DVec3; 2],
    hat_mm: [DVec3; 4],
    /// What the object moves beyond its share for a force here, mm/N.
    pub beyond: DMat3,
    /// Its displacement (with the object's), its force, sensor frame.
    pub u_mm: DVec3,
    pub force_n: DVec3,
    /// The plane that it may not pass: outward normal of the object, signed distance of the resting node.
    pub normal: DVec3,
    pub rest_gap_mm: f64,
    /// Distance to the object where it is now.
    pub gap_mm: f64,
    /// The face that has come over it, where that stays its plane.
    pub face: Option<Face>,
    /// Where it would be carried if it stuck: displacement before, and the object's since they met.
    pub carried_mm: DVec3,
    /// Displacement in the frame before, and whether it touched the object then.
    was_mm: DVec3,
    touched: bool,
}

/// Where a candidate lies.
pub(crate) struct Spot {
    pub node: usize,
    pub parts: NodeParts,
    pub at_mm: DVec3,
    pub area_mm2: f64,
    /// Standard deviations of its hat along the meridian and along the ring, mm.
    pub spread_mm: [DVec3; 2],
    /// What the object moves beyond its share for a force there, mm/N.
    pub beyond: DMat3,
}

/// How the object came: from the pose of the frame before, or along the normal from the first touch.
pub(crate) struct Way<'a> {
    then: Placed,
    pub moved: Rigid,
    before: Option<&'a ContactState>,
}

impl<'a> Way<'a> {
    /// Without a frame before, from where it touched the place of the dome that lies deepest in it, by its distance.
    pub fn new(
        placed: &Placed,
        dome: DomeShape,
        before: Option<&'a ContactState>,
        (at_mm, distance_mm): (DVec3, f64),
    ) -> Self {
        let history: Option<&History> = before.map(|state| &state.history);
        let then = match history.and_then(|history| history.sensor_from_object) {
            Some(pose) => pose,
            None => {
                let mut pose = placed.sensor_from_object();
                pose.translation_mm += dome.outward_mm(at_mm).normalize_or(DVec3::Z) * -distance_mm;
                pose
            }
        };
        Self {
            then: Placed::new(placed.solid.clone(), then),
            moved: placed.sensor_from_object().compose(&then.inverse()),
            before,
        }
    }

    /// What a node remembers of the frame before; the nodes of a history are in order.
    fn memory(&self, node: u32) -> Option<&'a NodeMemory> {
        let nodes = &self.before?.history.nodes;
        nodes.binary_search_by_key(&node, |memory| memory.node).ok().and_then(|at| nodes.get(at))
    }

    /// What a sticking node is carried to: its displacement then, and the object's motion since they met. A node
    /// that was free then met the object on the way, where a straight way would have closed its gap.
    pub fn carried(&self, placed: &Placed, candidate: &Candidate) -> DVec3 {
        let was = candidate.was_mm;
        let p = candidate.at_mm + was;
        let motion = self.moved.point(p) - p;
        if candidate.touched {
            return was + motion;
        }
        let gap_now = placed.distance(p).0;
        let part = if gap_now < 0.0 {
            let gap_then = self.then.distance(p).0.max(0.0);
            -gap_now / (gap_then - gap_now)
        } else {
            0.0
        };
        was + motion * part
    }
}

/// Four places of the dome that have the second moments of a node's hat.
pub(crate) fn hat_places(dome: DomeShape, at_mm: DVec3, spread_mm: [DVec3; 2]) -> [DVec3; 4] {
    // A node that others have moved lies on a sphere of its own.
    let moved = dome.with_radius_mm(dome.radius_mm() + dome.distance_mm(at_mm));
    [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[u, v]| {
        // Back on the dome.
        moved.onto(at_mm + spread_mm[0] * u + spread_mm[1] * v)
    })
}

/// A face of the object as a plane of its own frame, and the place of the dome that sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    /// A point of the face and its outward normal, in the object's frame.
    pub at_object_mm: DVec3,
    pub normal_object: DVec3,
    /// The place that the gap is measured from: the middle of the node's hat, sensor frame.
    pub from_mm: DVec3,
}

impl Candidate {
    /// Turns a force on the node back to how the dome lay there at rest: where a face bears on the dome, the dome has turned
    /// until it lies along it. No further than by a right angle, for no surface folds under.
    pub fn back(&self) -> DMat3 {
        let axis = self.normal.cross(self.inward);
        let angle = axis.length().atan2(self.normal.dot(self.inward)).min(std::f64::consts::FRAC_PI_2);
        axis.try_normalize().map_or(DMat3::IDENTITY, |axis| DMat3::from_axis_angle(axis, angle))
    }

    /// Its force on the dome at rest: what the compliance takes.
    pub fn rest_force_n(&self) -> DVec3 {
        self.back() * self.force_n
    }

    /// Lays the plane of its face where the object is; the plane goes with the object.
    pub fn follow_face(&mut self, sensor_from_object: &Rigid) {
        let Some(face) = self.face else { return };
        self.normal = sensor_from_object.vector(face.normal_object);
        self.rest_gap_mm = self.normal.dot(face.from_mm - sensor_from_object.point(face.at_object_mm));
    }

    /// A node at rest, on its first plane: where a walk along the dome's inward normal leaves the object.
    pub fn new(
        spot: Spot,
        elastomer: &Elastomer,
        placed: &Placed,
        way: &Way<'_>,
        sharing: f64,
    ) -> Result<Self, ContactError> {
        let Spot { node, parts, at_mm, area_mm2, spread_mm, beyond } = spot;
        let dome = elastomer.dome();
        let memory = way.memory(node as u32);
        let inward = -dome.outward_mm(at_mm).normalize_or(DVec3::Z);
        let mut candidate = Self {
            node,
            parts,
            at_mm,
            inward,
            area_mm2,
            spread_mm,
            hat_mm: hat_places(dome, at_mm, spread_mm),
            beyond,
            u_mm: DVec3::ZERO,
            // The old force turns with the object.
            force_n: memory.map_or(DVec3::ZERO, |memory| way.moved.vector(memory.force_n)),
            normal: DVec3::Z,
            rest_gap_mm: 0.0,
            gap_mm: 0.0,
            face: None,
            carried_mm: DVec3::ZERO,
            was_mm: match (memory, way.before) {
                (Some(memory), _) => memory.displacement_mm,
                (None, Some(state)) => state.displacement_mm(at_mm) * sharing + state.history.beyond_mm,
                (None, None) => DVec3::ZERO,
            },
            touched: memory.is_some(),
        };
        candidate.carried_mm = way.carried(placed, &candidate);
        let (depth_mm, limit_mm) = (elastomer.depth_scale_mm(), DEEPEST * elastomer.depth_scale_mm());
        let (walked, outward) = placed
            .walk_out(at_mm, inward, dome.radius_mm())
            .ok_or(ContactError::TooDeep { depth_mm, limit_mm })?;
        let (distance, nearest) = placed.distance(at_mm);
        (candidate.normal, candidate.rest_gap_mm) = if distance > 0.0 {
            (nearest, distance)
        } else if outward.dot(inward) > 0.05 {
            (outward, -outward.dot(inward) * walked)
        } else {
            // The way out grazes a wall: the object's own nearest face is the better plane.
            (nearest, distance)
        };
        Ok(candidate)
    }

    /// Distance to the object and its outward direction as the node's hat sees them, moved: the mean over four
    /// places that have the hat's second moments. A node stands for a patch; measured at its middle alone, the gap of
    /// two round bodies would be short by a twelfth of their relative curvature times the patch's area.
    pub fn gap(&self, placed: &Placed) -> (f64, DVec3) {
        let (mut distance, mut outward) = (0.0, DVec3::ZERO);
        for place in self.hat_mm {
            let (d, n) = placed.distance(place + self.u_mm);
            distance += 0.25 * d;
            outward += n;
        }
        // Opposite faces leave no mean direction: the middle's then.
        let outward =
            if outward.length() > 0.4 { outward } else { placed.distance(self.at_mm + self.u_mm).1 };
        (distance, outward.normalize_or(DVec3::Z))
    }
}

/// Part of the nodes' distance by which an object that touches nothing may reach into the dome.
const MIN_SEEN: f64 = 0.5;

/// Where no node bears a force, the object must not reach far into the dome between the nodes.
pub(super) fn check_seen(
    placed: &Placed,
    dome: DomeShape,
    deepest_mm: DVec3,
    spacing_mm: f64,
) -> Result<(), ContactError> {
    match placed.walk_out(deepest_mm, -dome.normal(deepest_mm), dome.radius_mm()) {
        Some((depth_mm, _)) if depth_mm > MIN_SEEN * spacing_mm => {
            Err(ContactError::Unseen { depth_mm, spacing_mm })
        }
        _ => Ok(()),
    }
}
