//! A ball pressed straight onto the pole, solved far more finely than any level: what the levels are measured against.
//!
//! The same body, contact and friction as the linear level's; but everything is the same at every azimuth, so one
//! harmonic of the dome is enough, and a ring of nodes is one node.

use glam::{DMat3, DVec3};

use crate::elastomer::{Elastomer, Indenter};
use crate::error::{ContactError, positive};
use crate::level::DEEPEST;
use crate::linear::{Candidate, Spot, Touch, Way};
use crate::object::{ContactSolid, Placed};
use crate::outcome::Status;
use crate::state::ContactState;
use domecast_elastic::{NodeParts, Revolved};
use domecast_optics::numeric::Rigid;

/// Elements along the meridian: 4 times a power of two, from 8 to this.
const MAX_ELEMENTS: usize = 1024;

/// The solved contact.
#[derive(Debug)]
pub struct OnPole {
    revolved: Revolved,
    /// On the dome at rest, by ring.
    forces_n: Vec<DVec3>,
    /// The force on the dome along the axis, N; downwards is negative.
    pub force_n: f64,
    /// Pressure on the pole, MPa.
    pub peak_pressure_mpa: f64,
    /// How the rounds ended.
    pub status: Status,
    /// The most that a node moved in the last round, mm.
    pub residual_mm: f64,
}

impl OnPole {
    /// A rigid ball of `radius_mm` that reaches `depth_mm` deep into the undeformed dome, with `elements` along the
    /// meridian.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a radius, depth or number of elements that is none;
    /// [`ContactError::TooDeep`] for a ball deeper than the linear level goes.
    pub fn new(
        elastomer: &Elastomer,
        radius_mm: f64,
        depth_mm: f64,
        elements: usize,
    ) -> Result<Self, ContactError> {
        elastomer.check()?;
        let dome_mm = elastomer.dome_radius_mm;
        let depth_mm = positive("depth_mm", depth_mm)?;
        let limit_mm = DEEPEST * elastomer.depth_scale_mm();
        if depth_mm > limit_mm {
            return Err(ContactError::TooDeep { depth_mm, limit_mm });
        }
        if !(8..=MAX_ELEMENTS).contains(&elements) || !elements.is_power_of_two() {
            let (field, allowed) = ("elements", "a power of two from 8 to 1024");
            return Err(ContactError::Dimension { field, value: elements as f64, allowed });
        }
        let solid = ContactSolid::sphere(radius_mm)?;
        let apart_mm = dome_mm + radius_mm - depth_mm;
        let center_mm = elastomer.dome().center_mm() + DVec3::Z * apart_mm;
        let placed = Placed::new(solid.clone(), Rigid::from_translation(center_mm));
        // A rigid ball touches nothing that it did not overlap: the two spheres' circle.
        let up =
            (apart_mm * apart_mm + dome_mm * dome_mm - radius_mm * radius_mm) / (2.0 * apart_mm * dome_mm);
        let revolved = Revolved::new(&elastomer.elastic(), elements, up.clamp(-1.0, 1.0).acos())?;
        let rigid = Indenter { solid, young_mpa: None, poisson: 0.3 };
        let mut touch = Touch::new(elastomer, placed, 1.0 + rigid.yield_ratio(elastomer));
        let way = Way::new(&touch.placed, elastomer.dome(), None, (elastomer.dome().pole_mm(), -depth_mm));
        for (number, ring) in revolved.rings().into_iter().enumerate() {
            let parts = NodeParts::whole(number);
            let (at_mm, area_mm2, spread_mm) = (ring.at_mm, ring.area_mm2, ring.spread_mm);
            let beyond = DMat3::ZERO;
            let spot = Spot { node: number, parts, at_mm, area_mm2, spread_mm, beyond };
            touch.candidates.push(Candidate::new(spot, elastomer, &touch.placed, &way, touch.sharing)?);
        }
        touch.blocks = blocks(&revolved, touch.candidates.len());
        let ended = touch.run(0.0);
        let mut state = ContactState::free(&touch.placed.sensor_from_object());
        touch.finish(&mut state, ended);
        let forces_n: Vec<DVec3> = touch.candidates.iter().map(Candidate::rest_force_n).collect();
        let peak = touch.candidates.first().map_or(0.0, |c| c.force_n.dot(c.normal) / c.area_mm2);
        Ok(Self {
            force_n: touch.candidates.iter().map(|candidate| candidate.force_n.z).sum(),
            revolved,
            forces_n,
            peak_pressure_mpa: peak,
            status: state.status,
            residual_mm: ended.moved_mm,
        })
    }

    /// Displacement of a point of the undeformed dome, sensor frame, mm.
    pub fn displacement_mm(&self, at_mm: DVec3) -> DVec3 {
        self.revolved.displacement_mm(&self.forces_n, at_mm)
    }
}

/// The rings' compliance, three rows by three columns each.
fn blocks(revolved: &Revolved, count: usize) -> Vec<f64> {
    let width = 3 * count;
    let mut blocks = vec![0.0; width * width];
    for i in 0..count {
        for j in 0..count {
            let block: DMat3 = revolved.between(i, j);
            for row in 0..3 {
                for column in 0..3 {
                    blocks[(3 * i + row) * width + 3 * j + column] = block.col(column)[row];
                }
            }
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Level};

    #[test]
    fn the_linear_level_nears_the_ball_on_the_pole() {
        let elastomer = Elastomer {
            dome_radius_mm: 10.0,
            center_z_mm: 0.0,
            young_mpa: 0.56,
            poisson: 0.49,
            friction: 0.6,
        };
        let ball = Indenter { solid: ContactSolid::sphere(5.0).unwrap(), young_mpa: None, poisson: 0.3 };
        let depth_mm = 0.5;
        let at = Rigid::from_translation(DVec3::Z * (15.0 - depth_mm));
        let places: Vec<DVec3> = (0..60)
            .map(|k| {
                let (sine, cosine) = (0.025 * f64::from(k)).sin_cos();
                DVec3::new(sine * 0.6, sine * 0.8, cosine) * 10.0
            })
            .collect();
        let fine = |elements| OnPole::new(&elastomer, 5.0, depth_mm, elements).unwrap();
        let off = |a: &dyn Fn(DVec3) -> DVec3, b: &OnPole| {
            let square: f64 = places.iter().map(|p| a(*p).distance_squared(b.displacement_mm(*p))).sum();
            (square / places.len() as f64).sqrt()
        };
        let truth = fine(512);
        assert_eq!(truth.status, Status::Solved);
        // On its own it converges.
        let mut last = f64::INFINITY;
        for elements in [32, 64, 128, 256] {
            let one = fine(elements);
            let error = off(&|p| one.displacement_mm(p), &truth);
            println!(
                "revolved {elements}: {error:.2e} mm, {:.5} N, {:.5} MPa",
                one.force_n, one.peak_pressure_mpa
            );
            assert!(error < 0.6 * last, "{elements}: {error} {last}");
            last = error;
        }
        println!("revolved 512: {:.5} N, {:.5} MPa", truth.force_n, truth.peak_pressure_mpa);
        let mut before = f64::INFINITY;
        // Eight elements have two rings under the ball: too few for an order.
        for elements in [16, 32] {
            let element_mm = std::f64::consts::FRAC_PI_2 * 10.0 / f64::from(elements);
            let contact = Contact::new(elastomer, Level::Linear { element_mm }).unwrap();
            let state = contact.solve(&ball, &at, None).unwrap();
            let error = off(&|p| state.displacement_mm(p), &truth);
            println!("linear {elements}: {error:.2e} mm, {:.5} N", state.wrench.force_n.z);
            // Of the second order, the reference is off by a third of what its last halving moved.
            assert!(error < before && last / 3.0 < 0.01 * error, "{elements}: {error} {before} {last}");
            before = error;
        }
        assert!(before < 0.01 * depth_mm);
    }
}
