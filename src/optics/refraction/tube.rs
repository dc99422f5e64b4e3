//! Thin tubes of light from a source in the air below the sheet to a point of the dome, and from the dome
//! back to the dome by way of the sheet's underside.
//!
//! A tube keeps its flux, so what a source of intensity `I` (per steradian) gives a surface at the far end is
//! `I * sr_per_mm2 * cos` per square millimetre: the solid angle that a square millimetre across the ray takes
//! up at the source. Without layers that is `1 / distance^2`. Through flat layers the ray of angle `theta`
//! reaches `X(theta)` sideways, a ring of solid angle `2 pi sin(theta) d theta` lands on a level ring of area
//! `2 pi X dX`, and across the ray, which arrives at the angle `beta`, the area is smaller by `cos(beta)`:
//!
//! ```text
//! sr_per_mm2 = (sin(theta) / X) (d theta / d X) / cos(beta)
//! ```

use glam::{DVec2, DVec3};

use super::limit::RayLimit;
use super::sensor::SensorOptics;
use super::stack::{LayerPath, Plate};

/// A thin tube of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightTube {
    /// Unit direction in which it leaves, sensor frame.
    pub leaving: DVec3,
    /// Unit direction in which it arrives, in the medium of its end, sensor frame.
    pub arriving: DVec3,
    /// Solid angle at the source for an area across the ray at the end, sr/mm^2.
    pub sr_per_mm2: f64,
    /// Snell's invariant: index times sine of the angle to the layers' normal, equal in every layer.
    pub snell_invariant: f64,
    /// Tangent of its angle to the normal in the layer of lowest index: where the search for the tube of a
    /// neighbouring point may start.
    pub tangent: f64,
    /// Where it meets the sheet's underside, sensor frame, mm.
    pub underside_mm: DVec3,
}

impl SensorOptics {
    /// The tube from a source in the air below the sheet to a point: in or on the dome, or on the sheet's top.
    ///
    /// `near_tangent` is the [`LightTube::tangent`] of a neighbour, or 0; it changes the time, not the answer.
    ///
    /// # Errors
    /// [`RayLimit::Unreachable`] if the source is not below the sheet; else as [`SensorOptics::project`].
    pub fn light_tube(
        &self,
        source_mm: DVec3,
        point_mm: DVec3,
        near_tangent: f64,
    ) -> Result<LightTube, RayLimit> {
        let air_mm = self.bottom_mm - source_mm.z;
        if !(source_mm.is_finite() && point_mm.is_finite() && near_tangent.is_finite()) {
            return Err(RayLimit::NotFinite);
        }
        if air_mm <= 0.0 || point_mm.z < 0.0 {
            return Err(RayLimit::Unreachable);
        }
        let fill = Plate { thickness_mm: point_mm.z, ..self.fill };
        let path = LayerPath { air_mm, plates: &self.plates, skipped_mm: 0.0, fill };
        let sideways = (point_mm - source_mm).truncate();
        let end = self.medium_at(point_mm.z);
        let way = tube(&path, sideways, near_tangent, 1.0, end)?;
        let under = source_mm.truncate() + way.aside * (way.tangent * air_mm);
        Ok(LightTube {
            leaving: direction(way.aside, way.snell_invariant, 1.0),
            arriving: direction(way.aside, way.snell_invariant / end, 1.0),
            sr_per_mm2: way.sr_per_mm2,
            snell_invariant: way.snell_invariant,
            tangent: way.tangent,
            underside_mm: under.extend(self.bottom_mm),
        })
    }

    /// The tube from a point of the dome down to the sheet's underside and, reflected there, up to another
    /// point of the dome or of the sheet's top. How much is reflected is not its matter.
    ///
    /// # Errors
    /// [`RayLimit::Unreachable`] for points below the sheet's top, and where nothing lies between the two.
    pub fn mirrored_tube(
        &self,
        from_mm: DVec3,
        to_mm: DVec3,
        near_tangent: f64,
    ) -> Result<LightTube, RayLimit> {
        if !(from_mm.is_finite() && to_mm.is_finite() && near_tangent.is_finite()) {
            return Err(RayLimit::NotFinite);
        }
        if from_mm.z < 0.0 || to_mm.z < 0.0 {
            return Err(RayLimit::Unreachable);
        }
        // Down and up through the same sheet is once through a sheet twice as thick.
        let twice = |plate: &Plate| Plate { thickness_mm: 2.0 * plate.thickness_mm, ..*plate };
        let plates: Vec<Plate> = self.plates.iter().map(twice).collect();
        let fill = Plate { thickness_mm: from_mm.z + to_mm.z, ..self.fill };
        let path = LayerPath { air_mm: 0.0, plates: &plates, skipped_mm: 0.0, fill };
        let (start, end) = (self.medium_at(from_mm.z), self.medium_at(to_mm.z));
        let way = tube(&path, (to_mm - from_mm).truncate(), near_tangent, start, end)?;
        let down = from_mm.z * slope_in(self.fill.index, way.snell_invariant)
            + self
                .plates
                .iter()
                .map(|p| p.thickness_mm * slope_in(p.index, way.snell_invariant))
                .sum::<f64>();
        Ok(LightTube {
            leaving: direction(way.aside, way.snell_invariant / start, -1.0),
            arriving: direction(way.aside, way.snell_invariant / end, 1.0),
            sr_per_mm2: way.sr_per_mm2,
            snell_invariant: way.snell_invariant,
            tangent: way.tangent,
            underside_mm: (from_mm.truncate() + way.aside * down).extend(self.bottom_mm),
        })
    }

    /// Index of the medium in which a point at this height is seen: the dome's above the sheet's top, the
    /// top layer's on it.
    fn medium_at(&self, z_mm: f64) -> f64 {
        match self.plates.last() {
            Some(plate) if z_mm == 0.0 => plate.index,
            _ => self.fill.index,
        }
    }
}

/// What [`tube`] finds.
struct TubeEnd {
    aside: DVec2,
    tangent: f64,
    snell_invariant: f64,
    sr_per_mm2: f64,
}

/// The tube through a path between media of the given indices.
fn tube(path: &LayerPath<'_>, sideways: DVec2, near: f64, start: f64, end: f64) -> Result<TubeEnd, RayLimit> {
    let reach_mm = sideways.length();
    let found = path.tangent_from_neighbor(reach_mm, near)?;
    let snell_invariant = found.index * found.tangent / (1.0 + found.tangent * found.tangent).sqrt();
    let aside = if reach_mm > 0.0 { sideways / reach_mm } else { DVec2::X };
    // In the start's medium: sin = snell_invariant / start and d(sin)/dX = cos d(theta)/dX, so with
    // snell_invariant = n0 t / sqrt(1 + t^2), d(snell_invariant)/dX = n0 (1 + t^2)^(-3/2) / X'(t).
    let square = 1.0 + found.tangent * found.tangent;
    let snell_invariant_by_reach = found.index / (square * square.sqrt() * found.slope);
    let snell_invariant_per_reach = found.index / (square.sqrt() * found.reach_per_tangent);
    let cos = |index: f64| (1.0 - (snell_invariant / index).powi(2)).max(0.0).sqrt();
    let sr_per_mm2 =
        snell_invariant_per_reach * snell_invariant_by_reach / (start * start * cos(start) * cos(end));
    if sr_per_mm2.is_finite() {
        Ok(TubeEnd { aside, tangent: found.tangent, snell_invariant, sr_per_mm2 })
    } else {
        Err(RayLimit::Unreachable)
    }
}

fn direction(aside: DVec2, sin: f64, up: f64) -> DVec3 {
    let sin = sin.min(1.0);
    (aside * sin).extend(up * (1.0 - sin * sin).sqrt())
}

/// Tangent of the angle in a medium.
fn slope_in(index: f64, snell_invariant: f64) -> f64 {
    let sin = snell_invariant / index;
    sin / (1.0 - sin * sin).max(f64::MIN_POSITIVE).sqrt()
}
