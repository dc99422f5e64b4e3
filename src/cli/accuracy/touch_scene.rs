//! The scene that frames and runtime are measured on where none is given.

use domecast_design::Design;
use domecast_sim::{Scene, SimError};

/// The paper's lights on, a ball pressed onto the pole and rolled aside, sized to the design's dome.
const BALL: &str = include_str!("../../../designs/scenes/ball.json");

/// That scene for any design.
///
/// # Errors
/// What the scene meets in this design: a load beyond its springs, say.
pub fn of(design: &Design) -> Result<Scene, SimError> {
    let mut file: serde_json::Value = domecast_design::parse_json(BALL)?;
    let scale = design.sections().dome.radius_mm / 10.0;
    if let Some(object) = file.pointer_mut("/objects/0") {
        if let Some(radius) = object.pointer_mut("/shape/radius_mm") {
            scaled(radius, scale);
        }
        let keys = object.get_mut("path").and_then(serde_json::Value::as_array_mut);
        for place in keys.into_iter().flatten().filter_map(|key| key.get_mut("position_mm")) {
            place.as_array_mut().into_iter().flatten().for_each(|value| scaled(value, scale));
        }
    }
    // elements of a tenth of the radius: a few pixels of the contact's edge are not what is measured here
    if let Some(element) = file.pointer_mut("/contact/element_mm") {
        *element = (0.1 * design.sections().dome.radius_mm).into();
    }
    Scene::new(domecast_design::from_value(&file)?, std::path::Path::new("."), design.clone())
}

fn scaled(value: &mut serde_json::Value, scale: f64) {
    if let Some(number) = value.as_f64() {
        *value = (number * scale).into();
    }
}
