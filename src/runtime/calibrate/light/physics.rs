//! The light of some constants over the dome, from the very tables that frames are drawn and read with.

use std::sync::Arc;

use glam::DVec3;

use crate::constants::LightConstants;
use crate::shape::ShapeLight;
use domecast_light::radiosity::DomeRoom;
use domecast_light::tables::{Prepared, SourceTables, Ways};
use domecast_optics::SensorOptics;

/// By how many times the tables for derivatives have fewer cells across: what they leave out is alike in both lights of a difference.
const SLOPE_CELLS: usize = 2;

/// The light of some constants.
pub(super) struct ShadedDome {
    pub light: LightConstants,
    pub shaded: ShapeLight,
    ways: Ways,
    tables: Vec<Arc<SourceTables>>,
}

/// What is the same for every light of the sensor.
pub(super) struct Physics {
    optics: SensorOptics,
    /// The dome as it lights itself, for each channel.
    rooms: Vec<DomeRoom>,
}

impl Physics {
    /// The sensor's optics with this light's layers between.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn new(optics: &SensorOptics, light: &LightConstants) -> Result<Self, String> {
        let ways = light.ways(optics)?;
        let rooms = Prepared::default().rooms(&ways).to_vec();
        Ok(Self { optics: optics.clone(), rooms })
    }

    /// The sphere of the dome: its centre and radius, mm.
    pub fn dome(&self) -> (DVec3, f64) {
        (self.optics.dome().center_mm(), self.optics.dome().radius_mm())
    }

    /// The light of some constants.
    pub fn lit(&self, light: LightConstants) -> Option<ShadedDome> {
        self.computed(light, 1, None)
    }

    /// The same for derivatives; `beside` is another light of which it differs in the shape of some lights only.
    pub fn lit_for_slopes(
        &self,
        light: LightConstants,
        beside: Option<(&ShadedDome, &[usize])>,
    ) -> Option<ShadedDome> {
        self.computed(light, SLOPE_CELLS, beside)
    }

    fn computed(
        &self,
        light: LightConstants,
        coarser: usize,
        beside: Option<(&ShadedDome, &[usize])>,
    ) -> Option<ShadedDome> {
        let other = beside.map(|(other, _)| (&other.light, &other.ways));
        let ways = light.ways_beside(&self.optics, other).ok()?;
        let kept = |i: usize| {
            let (other, changed) = beside?;
            other.tables.get(i).filter(|_| !changed.contains(&i))
        };
        let of = |(i, source)| match kept(i) {
            Some(own) => Arc::clone(own),
            None => Arc::new(SourceTables::new(&ways, source, coarser)),
        };
        let tables: Vec<Arc<SourceTables>> = ways.sources.iter().enumerate().map(of).collect();
        let each: Vec<&SourceTables> = tables.iter().map(Arc::as_ref).collect();
        let prepared = Prepared::of(&each, &self.rooms);
        let shaded = ShapeLight::with(&light, &self.optics, &ways, &prepared);
        Some(ShadedDome { light, shaded, ways, tables })
    }
}
