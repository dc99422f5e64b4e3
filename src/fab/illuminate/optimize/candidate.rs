//! From the numbers of a search to a design whose other fields follow, and to its light.

use std::sync::{Mutex, PoisonError};

use serde::Serialize;
use serde_json::{Value, json};

use super::choices::{Arrangement, DiffuserKind, diffuser_fields};
use super::score::{ComparedLight, LightScore};
use crate::light::scene;
use domecast_design::parts::{
    HidingLip, Measures, PartError, check_light_room, highest_hood_rim_mm, min_well_floor_mm,
};
use domecast_design::{Cure, Design, DesignError, DesignFile};
use domecast_sim::Scene;
use domecast_sim::light::LightUse;
use domecast_sim::light::lobe::Lobe;
use domecast_sim::light::setup;

/// Where the lights stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LightPlace {
    /// Distance of the emitting faces' centres from the axis, mm.
    pub center_radius_mm: f64,
    /// Their height, mm.
    pub center_z_mm: f64,
    /// Angle between board and base plane, degrees.
    pub tilt_deg: f64,
    /// How far the outermost light of a colour stands off the colour's middle, degrees; counts with several a colour.
    pub half_arc_deg: f64,
}

impl LightPlace {
    /// Of a design as it stands.
    pub fn of(design: &Design) -> Self {
        let leds = &design.sections().leds;
        Self {
            center_radius_mm: leds.center_radius_mm,
            center_z_mm: leds.center_z_mm,
            tilt_deg: leds.tilt_deg,
            half_arc_deg: 0.0,
        }
    }

    /// To what a file says: hundredths of a millimetre, tenths of a degree.
    pub fn rounded(self) -> Self {
        let to = |value: f64, steps: f64| (value * steps).round() / steps;
        Self {
            center_radius_mm: to(self.center_radius_mm, 100.0),
            center_z_mm: to(self.center_z_mm, 100.0),
            tilt_deg: to(self.tilt_deg, 10.0),
            half_arc_deg: to(self.half_arc_deg, 10.0),
        }
    }
}

/// What is the same for a whole search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightChoice {
    /// Lights of each colour.
    pub arrangement: Arrangement,
    /// The diffuser.
    pub diffuser: DiffuserKind,
    /// Whether a hood round the lens is added to a design that has none, with a well for the light.
    pub adds_hood: bool,
}

/// Why lights cannot be; ordered by how far they got, then by how much is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Larger for what fails earlier.
    pub stage: u8,
    /// By how much, mm where it is a length.
    pub missing: f64,
}

impl Violation {
    /// A design that does not resolve, or a sensor larger than the given one.
    const UNRESOLVED: u8 = 4;
    /// No lip hides the lights, or it leaves no wall.
    const LIP: u8 = 3;
    /// No room for pits and seats.
    const PLATFORM: u8 = 2;
    /// The build refuses it.
    pub const BUILD: u8 = 1;

    fn of_part(stage: u8, error: &PartError) -> Self {
        Self { stage, missing: error.missing_mm() }
    }
}

/// A design with other lights.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The changes of the file.
    pub changes: Vec<Cure>,
    /// The design with them, but for the lip, which the rules give it.
    with_rules: Design,
    /// Its measures, with the lip.
    measures: Measures,
}

/// The given design, and what all candidates share with it.
pub struct Given<'a> {
    /// The design.
    pub design: &'a Design,
    scene: Scene,
    text: Value,
    hood: Option<Value>,
    /// Measures that were taken, with what they depend on: all but the lights.
    known: Mutex<Vec<(DesignFile, Measures)>>,
}

impl<'a> Given<'a> {
    /// # Errors
    /// A design without light, or one that cannot be lit.
    pub fn new(design: &'a Design) -> Result<Self, DesignError> {
        let text = serde_json::from_str(design.text()).unwrap_or_default();
        let known = Mutex::default();
        Ok(Self { design, scene: scene(design, 1.0, 0.0)?, text, hood: hood_for(design), known })
    }

    /// The measures of a design. Those of designs that differ in their lights alone are the same but for the lights: where
    /// springs and camera's view take the platform is found out once.
    fn measures(&self, design: &Design) -> Result<Measures, PartError> {
        let mut rest = design.sections().clone();
        rest.leds = self.design.sections().leds.clone();
        let known = |list: &[(DesignFile, Measures)]| {
            let alike = list.iter().find(|(other, _)| *other == rest);
            alike.map(|(_, measures)| Measures { leds: design.sections().leds.clone(), ..measures.clone() })
        };
        // A lock that a panic left is as good as another: what is kept in it is only ever added to.
        let found = known(&self.known.lock().unwrap_or_else(PoisonError::into_inner));
        if let Some(found) = found {
            return Ok(found);
        }
        let taken = Measures::of(design)?;
        self.known.lock().unwrap_or_else(PoisonError::into_inner).push((rest, taken.clone()));
        Ok(taken)
    }

    /// Whether a hood can be added.
    pub fn takes_hood(&self) -> bool {
        self.hood.is_some()
    }

    /// The design with lights at a place, the lip as low as hides them, and the platform's underside where its rule or the
    /// given design has it, whichever is lower.
    ///
    /// # Errors
    /// How far the lights are from what can be.
    pub fn candidate(&self, choice: &LightChoice, place: LightPlace) -> Result<Candidate, Violation> {
        let mut changes = self.changes(choice, place);
        let resolve = |changes: &[Cure]| {
            let design = self.design.with_changes(changes);
            design.map_err(|_| Violation { stage: Violation::UNRESOLVED, missing: f64::MAX })
        };
        let mut design = resolve(&changes)?;
        let given_mm = self.design.sections().platforms.upper.underside_z_mm;
        if design.sections().platforms.upper.underside_z_mm > given_mm {
            changes.push(change(UNDERSIDE, json!(given_mm)));
            design = resolve(&changes)?;
        }
        let excess_mm = self.excess_mm(&design);
        if excess_mm > 1e-9 {
            return Err(Violation { stage: Violation::UNRESOLVED, missing: excess_mm });
        }
        let mut measures =
            self.measures(&design).map_err(|error| Violation::of_part(Violation::UNRESOLVED, &error))?;
        let lip = HidingLip::of(&measures).ok_or(Violation { stage: Violation::LIP, missing: f64::MAX })?;
        if measures.leds.center_radius_mm < lip.min_light_radius_mm {
            let missing = lip.min_light_radius_mm - measures.leds.center_radius_mm;
            return Err(Violation { stage: Violation::LIP, missing });
        }
        let floor_mm = min_well_floor_mm(&measures).unwrap_or(f64::NEG_INFINITY);
        let lip_mm = (100.0 * lip.top_z_mm.max(floor_mm) - 1e-6).ceil() / 100.0;
        changes.push(change(LIP, json!(lip_mm)));
        measures.leds.lip_top_z_mm = lip_mm;
        check_light_room(&design, &measures)
            .map_err(|error| Violation::of_part(Violation::PLATFORM, &error))?;
        Ok(Candidate { changes, with_rules: design, measures })
    }

    /// The design of a choice and a place.
    ///
    /// # Errors
    /// As [`Given::candidate`].
    pub fn design_of(&self, choice: &LightChoice, place: LightPlace) -> Result<Design, Violation> {
        let made = self.candidate(choice, place)?;
        let design = self.design.with_changes(&made.changes);
        design.map_err(|_| Violation { stage: Violation::UNRESOLVED, missing: f64::MAX })
    }

    /// The fields that a choice and a place set, and those that then follow from rules.
    fn changes(&self, choice: &LightChoice, place: LightPlace) -> Vec<Cure> {
        let leds = &self.design.sections().leds;
        let mut changes = vec![
            change("leds.center_radius_mm", json!(place.center_radius_mm)),
            change("leds.center_z_mm", json!(place.center_z_mm)),
            change("leds.tilt_deg", json!(place.tilt_deg)),
        ];
        let list = choice.arrangement.list(self.design, place.half_arc_deg);
        if list != leds.list {
            changes.push(change("leds.list", json!(list)));
        }
        if choice.diffuser.diffuser != leds.diffuser {
            changes.extend(diffuser_fields(&choice.diffuser).map(|(field, value)| change(field, value)));
        }
        let is_given = |field: &&str| field.split('.').try_fold(&self.text, |at, key| at.get(key)).is_some();
        let follow = |fields: &[&'static str]| -> Vec<Cure> {
            fields
                .iter()
                .copied()
                .filter(|field| is_given(field))
                .map(|field| change(field, Value::Null))
                .collect()
        };
        changes.extend(follow(&[UNDERSIDE, LIP]));
        if let Some(hood) = self.hood.as_ref().filter(|_| choice.adds_hood) {
            let [x, y] = self.design.sections().sheet.size_mm;
            changes.push(change("platforms.lower.hood", json!(hood)));
            // so wide that the sheet's border still lies on its seat
            let well_mm = (100.0 * WELL_SHARE * 0.5 * x.min(y)).floor() / 100.0;
            changes.push(change("leds.well_radius_mm", json!(well_mm)));
            // the block below a deeper platform is lower
            changes.extend(follow(&["platforms.lower.clamp"]));
        }
        changes
    }

    /// By how much a design is larger than the given one along its worst side, mm.
    fn excess_mm(&self, design: &Design) -> f64 {
        let size = |of: &Design| {
            let [low, high] = of.bounds_mm();
            high - low
        };
        let room = glam::DVec3::from_array(self.design.sections().envelope.size_mm);
        (size(design) - room.max(size(self.design))).max_element().max(0.0)
    }

    /// How good a candidate's light is; `lobe` is that of its diffuser.
    ///
    /// # Errors
    /// As [`Given::candidate`].
    pub fn score(
        &self,
        candidate: &Candidate,
        lobe: &Lobe,
        polar_angle_deg: f64,
    ) -> Result<LightScore, Violation> {
        let dark = Violation { stage: Violation::LIP, missing: f64::MAX };
        let own;
        let design = &candidate.with_rules;
        let scene = if self.sees_alike(design) {
            &self.scene
        } else {
            own = scene(design, 1.0, 0.0).map_err(|_| dark)?;
            &own
        };
        let light = light_of(scene, &candidate.measures, lobe, polar_angle_deg).ok_or(dark)?;
        let score = LightScore::of(&light, &design.sections().exposure);
        if score.objective().is_finite() { Ok(score) } else { Err(dark) }
    }

    /// Whether lens, layers and dome are those of the given design, so that its scene will do.
    fn sees_alike(&self, design: &Design) -> bool {
        let [one, other] = [self.design, design].map(|design| {
            let all = design.sections();
            (&all.camera, &all.optics, &all.dome, &all.elastomer, &all.sheet, &all.leds.through_platform)
        });
        one == other
    }
}

/// The direct light of measures on a scene's dome; `None` where the lights stand in the sheet or no platform can be made.
fn light_of(scene: &Scene, measures: &Measures, lobe: &Lobe, polar_angle_deg: f64) -> Option<ComparedLight> {
    let sources = setup::sources_of(scene, &measures.leds, lobe).ok()?;
    let cavities = setup::cavities_of(measures).ok()?;
    let ways = setup::ways_among(scene, sources, Some(cavities));
    ComparedLight::along(scene, &ways, polar_angle_deg)
}

/// How good the light of a design is as it stands.
///
/// # Errors
/// Lights that do not fit the design.
pub fn score_of(design: &Design, polar_angle_deg: f64) -> Result<LightScore, DesignError> {
    let scene = scene(design, 1.0, 0.0)?;
    let ways = setup::ways(&scene, &LightUse::ALL).map_err(crate::light::fault)?;
    let light = ComparedLight::along(&scene, &ways, polar_angle_deg);
    let light = light.ok_or_else(|| DesignError::at("leds.list", "[]", "there is no light", "lights"))?;
    Ok(LightScore::of(&light, &design.sections().exposure))
}

impl Candidate {
    /// Lights in all, and height of the whole sensor, mm.
    pub fn count_and_height_mm(&self) -> (usize, f64) {
        (self.measures.leds.list.len(), height_mm(&self.with_rules))
    }
}

/// Height of the whole sensor, mm.
pub fn height_mm(design: &Design) -> f64 {
    let [low, high] = design.bounds_mm();
    (1e6 * (high.z - low.z)).round() / 1e6
}

/// A hood for a design that has none: as high as the camera's view leaves room for; `None` where the design has one, or the
/// view leaves no room above the lens.
fn hood_for(design: &Design) -> Option<Value> {
    let sections = design.sections();
    if sections.platforms.lower.hood.is_some() {
        return None;
    }
    let wall_mm = (10.0 * (sections.process.min_wall_mm + 0.1)).ceil() / 10.0;
    // higher than any view leaves room for
    let tall_mm = -design.sensor_from_camera().translation_mm.z;
    let hood = |rim_mm: f64| json!({ "rim_from_pupil_mm": rim_mm, "wall_mm": wall_mm, "gap_mm": 0.5 });
    let with = design.with_changes(&[change("platforms.lower.hood", hood(tall_mm))]).ok()?;
    let highest = highest_hood_rim_mm(&Measures::of(&with).ok()?)?;
    let rim_mm = (100.0 * highest - 1.0).floor() / 100.0;
    (rim_mm > sections.camera_body.front_from_pupil_mm + wall_mm).then(|| hood(rim_mm))
}

/// Share of the sheet's half width that a light well takes: the rest is the seat.
const WELL_SHARE: f64 = 0.945;

const UNDERSIDE: &str = "platforms.upper.underside_z_mm";
const LIP: &str = "leds.lip_top_z_mm";

fn change(field: &str, value: Value) -> Cure {
    Cure { field: field.to_owned(), value }
}
