//! The touched dome at the many times at which one frame gathers light.
//!
//! Between frames the membrane's displacement is linear in time, so it is computed for the frame and its two neighbours
//! only, over one set of places; at any time between it is their mean.

use glam::DVec3;

use crate::contact::between::{Around, Between, extents, pressed_cap};
use crate::contact::displacement_map::{DisplacementMap, MapLayout};
use crate::effect_name::EffectName;
use crate::work::Work;
use domecast_optics::DomeShape;

/// The touched dome at a time, as far as a picture needs it.
#[derive(Debug, Clone, Default)]
pub struct SkinShape {
    /// The touched dome; `None` where contact takes no part.
    pub touch: Option<Between>,
    /// The deformed membrane as a table; only where light falls on it.
    pub map: Option<DisplacementMap>,
    /// Displacements of the dots' followed points, mm, where they are known already.
    pub displaced_mm: Option<Vec<DVec3>>,
}

impl SkinShape {
    /// At one time; its map has nodes no further apart than `map_step_mm`, where that is given.
    pub fn of(touch: Option<Between>, dome: DomeShape, map_step_mm: Option<f64>, work: &mut Work) -> Self {
        let map = touch.as_ref().filter(|between| between.is_deformed()).and_then(|between| {
            let (map, nodes) = DisplacementMap::new(between, dome, map_step_mm?)?;
            work.add(EffectName::Contact, nodes * NODE_UNITS);
            Some(map)
        });
        Self { touch, map, displaced_mm: None }
    }
}

/// Counted work of a node of the map.
const NODE_UNITS: u64 = 150;

/// What is known of the dome in a frame and the ones before and after it.
#[derive(Debug)]
pub struct Shapes<'a> {
    around: &'a Around,
    known: [Known; 3],
}

#[derive(Debug)]
struct Known {
    displaced_mm: Vec<DVec3>,
    map: Option<DisplacementMap>,
}

impl<'a> Shapes<'a> {
    /// `None` where nothing touches the dome in any of the three frames.
    pub fn new(
        around: &'a Around,
        places_mm: &[DVec3],
        dome: DomeShape,
        map_step_mm: Option<f64>,
        work: &mut Work,
    ) -> Option<Self> {
        let touches = [&around.before, &around.now, &around.after];
        let contacts = || touches.iter().filter_map(|touch| touch.contact.as_deref());
        contacts().next()?;
        let layout = map_step_mm.and_then(|step_mm| {
            MapLayout::new(&extents(contacts()), pressed_cap(contacts(), dome), dome, step_mm)
        });
        let known = touches.map(|touch| {
            let alone = Between::at_frame(touch.clone());
            let map = layout.as_ref().map(|layout| layout.map(&alone));
            if let Some(map) = &map {
                work.add(EffectName::Contact, map.node_count() * NODE_UNITS);
            }
            Known { displaced_mm: alone.displacements_mm(places_mm), map }
        });
        Some(Self { around, known })
    }

    /// At a time of so many frames after the frame.
    pub fn at(&self, frames: f64) -> SkinShape {
        let touch = self.around.at(frames);
        if !touch.is_deformed() {
            return SkinShape { touch: Some(touch), ..SkinShape::default() };
        }
        let [before, now, after] = &self.known;
        let (from, to) = if frames < 0.0 { (before, now) } else { (now, after) };
        let part = touch.part;
        let mix = |(a, b): (&DVec3, &DVec3)| a.lerp(*b, part);
        let displaced_mm = from.displaced_mm.iter().zip(&to.displaced_mm).map(mix).collect();
        let map = from.map.as_ref().zip(to.map.as_ref()).map(|(from, to)| from.towards(to, part));
        SkinShape { touch: Some(touch), map, displaced_mm: Some(displaced_mm) }
    }
}
