//! The dome under loads that are the same at every azimuth: one harmonic, and so elements as fine as one likes.

use glam::{DMat3, DVec3};

use crate::body::BondedBody;
use crate::compliance::{Harmonic, harmonic};
use crate::dome::{ElasticDome, FactorError};
use crate::element::quadratic;
use crate::grid::{Grid, GridNode};

/// The response of the surface to loads on rings about the pole.
#[derive(Debug)]
pub struct Revolved {
    grid: Grid,
    harmonic: Harmonic,
    rings: usize,
}

/// A ring as the node of it that lies at the azimuth 0.
pub struct Ring {
    /// Place, sensor frame, mm.
    pub at_mm: DVec3,
    /// Surface that the whole ring stands for, mm^2.
    pub area_mm2: f64,
    /// Standard deviations of its hat, mm: along the meridian, and across it only at the pole.
    pub spread_mm: [DVec3; 2],
}

impl Revolved {
    /// Solves the harmonic 0 for the rings up to a length of the meridian over the radius.
    pub fn new(elastomer: &ElasticDome, elements: usize, meridian_rad: f64) -> Result<Self, FactorError> {
        let grid = Grid::new(elastomer.dome, elements);
        let rings = (0..elements).take_while(|ring| grid.meridian_rad(*ring) <= meridian_rad).count().max(1);
        let hats: Vec<_> = (0..rings).map(|ring| grid.hat(ring)).collect();
        let harmonic = harmonic(&grid, &BondedBody::new(elastomer, elements)?, &hats, 0)?;
        Ok(Self { grid, harmonic, rings })
    }

    /// The rings, from the pole.
    pub fn rings(&self) -> Vec<Ring> {
        let ring = |ring: usize| {
            let node = GridNode { ring, step: 0 };
            let [along, across] = self.grid.spread(node);
            Ring {
                at_mm: self.grid.place(node),
                area_mm2: self.grid.areas_mm2[ring] * self.grid.counts[ring] as f64,
                spread_mm: [along, if ring == 0 { across } else { DVec3::ZERO }],
            }
        };
        (0..self.rings).map(ring).collect()
    }

    /// Displacement of ring `at` at the azimuth 0 for a unit of force on ring `by` in all, sensor frame, mm/N. The pole
    /// has nowhere to go but along the axis; sideways it is given its own compliance along it, which no load there uses.
    pub fn between(&self, at: usize, by: usize) -> DMat3 {
        let width = 3 * self.rings;
        let entry = |row: usize, column: usize| self.harmonic.own[(3 * by + column) * width + 3 * at + row];
        // Rows and columns r, z, phi are x, z, y at the azimuth 0.
        let [r, z, phi] = [0, 1, 2];
        let (mut xx, mut yy) = (entry(r, r), entry(phi, phi));
        if at == 0 && by == 0 {
            (xx, yy) = (entry(z, z), entry(z, z));
        }
        DMat3::from_cols(
            DVec3::new(xx, 0.0, entry(z, r)),
            DVec3::new(0.0, yy, 0.0),
            DVec3::new(entry(r, z), 0.0, entry(z, z)),
        )
    }

    /// Displacement of the surface under forces on the rings (sensor frame, at the azimuth 0), at any place of it, mm.
    pub fn displacement_mm(&self, forces_n: &[DVec3], at_mm: DVec3) -> DVec3 {
        let flat = at_mm.truncate().length();
        let (element, along) = self.grid.element_at(at_mm);
        let (n, _) = quadratic(along);
        let (mut outwards, mut up) = (0.0, 0.0);
        for (ring, force) in forces_n.iter().enumerate() {
            for (axis, part) in [(0, force.x), (1, force.z)] {
                let Some(column) = self.harmonic.columns.get(3 * ring + axis) else { continue };
                for (k, n) in n.into_iter().enumerate() {
                    outwards += n * part * column[3 * (2 * element + k)];
                    up += n * part * column[3 * (2 * element + k) + 1];
                }
            }
        }
        let aside = if flat > 0.0 { at_mm.truncate() / flat } else { glam::DVec2::ZERO };
        (aside * outwards).extend(up)
    }
}
