//! The touched dome at the many times at which one frame gathers light.
//!
//! Between frames the membrane's displacement is linear in time, so it is worked out for the frame and its two neighbours
//! only, over one set of places; at any time between it is their mean.

use glam::DVec3;

use super::EffectName;
use super::dent::{Dent, DentLayout};
use super::render::Around;
use super::spots::Points;
use super::touch::{Between, Touch, extents, pressed_cap};
use super::work::Work;

/// The touched dome at a time, as far as a picture needs it.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    /// The touched dome; `None` where contact takes no part.
    pub touch: Option<Between>,
    /// The deformed membrane as a table; only where light falls on it.
    pub dent: Option<Dent>,
    /// Displacements of the dots' followed points, mm, where they are known already.
    pub displaced_mm: Option<Vec<DVec3>>,
}

impl Shape {
    /// At one time; the dent is laid out with nodes no further apart than `dent_step_mm`, where that is given.
    pub fn of(touch: Option<Between>, radius_mm: f64, dent_step_mm: Option<f64>, work: &mut Work) -> Self {
        let dent = touch.as_ref().filter(|between| between.is_dented()).and_then(|between| {
            let (dent, nodes) = Dent::new(between, radius_mm, dent_step_mm?)?;
            work.add(EffectName::Contact, nodes * NODE_UNITS);
            Some(dent)
        });
        Self { touch, dent, displaced_mm: None }
    }
}

/// Counted work of a node of the dent's table.
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
    dent: Option<Dent>,
}

impl<'a> Shapes<'a> {
    /// `None` where nothing touches the dome in any of the three frames.
    pub fn new(
        around: &'a Around,
        points: &Points,
        radius_mm: f64,
        dent_step_mm: Option<f64>,
        work: &mut Work,
    ) -> Option<Self> {
        let touches = [&around.before, &around.now, &around.after];
        let contacts = || touches.iter().filter_map(|touch| touch.contact.as_deref());
        contacts().next()?;
        let layout = dent_step_mm.and_then(|step_mm| {
            DentLayout::new(&extents(contacts()), pressed_cap(contacts()), radius_mm, step_mm)
        });
        let places = points.on_dome_mm();
        let known = touches.map(|touch| {
            let alone = Between::at_frame(touch.clone());
            let dent = layout.as_ref().map(|layout| layout.dent(&alone));
            if let Some(dent) = &dent {
                work.add(EffectName::Contact, dent.node_count() * NODE_UNITS);
            }
            Known { displaced_mm: alone.displacements_mm(&places), dent }
        });
        Some(Self { around, known })
    }

    /// At a time of so many frames after the frame.
    pub fn at(&self, frames: f64) -> Shape {
        let touch = self.around.at(frames);
        if !touch.is_dented() {
            return Shape { touch: Some(touch), ..Shape::default() };
        }
        let [before, now, after] = &self.known;
        let (from, to) = if frames < 0.0 { (before, now) } else { (now, after) };
        let part = touch.part;
        let mix = |(a, b): (&DVec3, &DVec3)| a.lerp(*b, part);
        let displaced_mm = from.displaced_mm.iter().zip(&to.displaced_mm).map(mix).collect();
        let dent = from.dent.as_ref().zip(to.dent.as_ref()).map(|(from, to)| from.towards(to, part));
        Shape { touch: Some(touch), dent, displaced_mm: Some(displaced_mm) }
    }
}

impl Around {
    /// About one frame of a sequence.
    pub fn of(touches: &[Touch], index: usize) -> Option<Self> {
        let now = touches.get(index)?.clone();
        let before = index.checked_sub(1).and_then(|i| touches.get(i)).unwrap_or(&now).clone();
        let after = touches.get(index + 1).unwrap_or(&now).clone();
        Some(Self { before, now, after })
    }

    /// At a time of so many frames after the frame.
    pub(super) fn at(&self, frames: f64) -> Between {
        if frames < 0.0 {
            let part = (1.0 + frames).clamp(0.0, 1.0);
            Between { from: self.before.clone(), to: self.now.clone(), part }
        } else if frames > 0.0 {
            Between { from: self.now.clone(), to: self.after.clone(), part: frames.clamp(0.0, 1.0) }
        } else {
            Between::at_frame(self.now.clone())
        }
    }
}
