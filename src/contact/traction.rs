//! What bears on the dome, place by place.

use glam::DVec3;

use crate::field::Field;
use crate::outcome::TouchedNode;
use crate::state::ContactState;
use domecast_optics::numeric::{LengthMismatch, batch};

/// Where a level has no elements of its own, a node's force is spread over a disc of so many times its area: the discs of
/// neighbours then overlap.
const DISC: f64 = 3.0;

impl ContactState {
    /// Force over undeformed area that bears on points of the undeformed dome, sensor frame, MPa. The linear level
    /// spreads its nodes' forces as its elements do, exactly; the other levels spread each as a paraboloid over three times the
    /// node's area, which keeps the sum and blunts what is finer.
    ///
    /// # Errors
    /// [`LengthMismatch`].
    pub fn tractions_mpa(&self, at_mm: &[DVec3], out: &mut [DVec3]) -> Result<(), LengthMismatch> {
        let discs: Vec<Disc> = match &self.bearing {
            Field::Elastic(_) => Vec::new(),
            _ => self.nodes.iter().map(Disc::of).collect(),
        };
        batch::fill(at_mm, out, |at| match &self.bearing {
            Field::Elastic(field) => field.traction_mpa(*at),
            _ => discs.iter().map(|disc| disc.at(*at)).sum(),
        })
    }
}

/// A node's force over a disc.
struct Disc {
    at_mm: DVec3,
    radius2_mm2: f64,
    peak_mpa: DVec3,
}

impl Disc {
    fn of(node: &TouchedNode) -> Self {
        let area_mm2 = DISC * node.area_mm2;
        let (radius2_mm2, peak_mpa) = (area_mm2 / std::f64::consts::PI, node.force_n * (2.0 / area_mm2));
        Self { at_mm: node.at_mm, radius2_mm2, peak_mpa }
    }

    fn at(&self, at_mm: DVec3) -> DVec3 {
        let q = at_mm.distance_squared(self.at_mm) / self.radius2_mm2;
        if q < 1.0 { self.peak_mpa * (1.0 - q) } else { DVec3::ZERO }
    }
}
