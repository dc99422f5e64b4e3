//! A design with one field changed: what a change that may help is tried on.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::derive::{derive, fields};
use super::design::Design;
use super::error::{Cure, DesignError};

/// One step of a field's path.
enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

/// The steps of a path such as `platforms.lower.mounting.at_mm[2]`; `None` for what is no path.
fn steps(field: &str) -> Option<Vec<Step<'_>>> {
    let mut found = Vec::new();
    for key in field.split('.') {
        let (name, rest) = key.split_at(key.find('[').unwrap_or(key.len()));
        if name.is_empty() {
            return None;
        }
        found.push(Step::Key(name));
        for index in rest.split('[').skip(1) {
            found.push(Step::Index(index.strip_suffix(']')?.parse().ok()?));
        }
    }
    Some(found)
}

/// The value at a path in a tree.
fn look<'a>(tree: &'a Value, field: &str) -> Option<&'a Value> {
    steps(field)?.into_iter().try_fold(tree, |place, step| match step {
        Step::Key(key) => place.get(key),
        Step::Index(index) => place.get(index),
    })
}

/// Sets a field by its path, or leaves it out for a null; makes the objects on the way, and takes lists that are entered
/// but not given from `whole`.
fn set(tree: &mut Value, whole: &Value, field: &str, value: Value) -> Option<()> {
    if let Some((list, _)) = field.split_once('[')
        && look(tree, list).is_none()
    {
        set(tree, whole, list, look(whole, list)?.clone())?;
    }
    let mut path = steps(field)?;
    let last = path.pop()?;
    let mut place = tree;
    for step in path {
        place = match step {
            Step::Key(key) => {
                let map = place.as_object_mut()?;
                if map.get(key).is_none_or(Value::is_null) {
                    map.insert(key.to_owned(), Value::Object(Map::new()));
                }
                map.get_mut(key)?
            }
            Step::Index(index) => place.get_mut(index)?,
        };
    }
    match last {
        Step::Key(key) if value.is_null() => {
            place.as_object_mut()?.shift_remove(key);
        }
        Step::Key(key) => {
            place.as_object_mut()?.insert(key.to_owned(), value);
        }
        Step::Index(index) => *place.get_mut(index)? = value,
    }
    Some(())
}

impl Design {
    /// The design with one field changed; the others stay as they are given, and what is left to rules follows.
    ///
    /// # Errors
    /// The faults of the changed design; a field that cannot be set.
    pub fn changed(&self, change: &Cure) -> Result<Self, DesignError> {
        self.with_changes(std::slice::from_ref(change))
    }

    /// The design with fields changed one after another; a value of null leaves its field to the rules. The text of what
    /// comes out is a file that says the same.
    ///
    /// # Errors
    /// The faults of the changed design; a field that cannot be set.
    pub fn with_changes(&self, changes: &[Cure]) -> Result<Self, DesignError> {
        let fault = |field: &str, problem: &str| DesignError::at(field, "", problem, "a field");
        let mut tree: Value =
            serde_json::from_str(self.text()).map_err(|_| fault("", "the design is no JSON"))?;
        let whole = serde_json::to_value(self.sections()).map_err(|_| fault("", "the design is no JSON"))?;
        for Cure { field, value } in changes {
            set(&mut tree, &whole, field, value.clone())
                .ok_or_else(|| fault(field, "there is no such place"))?;
        }
        Self::from_text(&format!("{tree:#}\n"), Path::new(""))
    }

    /// The fault with changes that a file takes as they are: a field of an object that a rule gives whole is no field of the file
    /// yet, so the change is that of the whole object.
    #[must_use]
    pub fn with_writable_cures(&self, mut fault: DesignError) -> DesignError {
        let more = std::mem::take(&mut fault.more);
        if let Some(cure) = fault.cure.as_deref()
            && let Some(whole) = self.whole_object(cure)
        {
            fault.help = fault.help.map(|help| help.replace(&cure.to_string(), &whole.to_string()));
            fault.cure = Some(Box::new(whole));
        }
        fault.with_more(more.into_iter().map(|one| self.with_writable_cures(one)).collect())
    }

    /// A change below an object that a rule gave, as a change of that object.
    fn whole_object(&self, change: &Cure) -> Option<Cure> {
        let below = |field: &str| change.field.strip_prefix(field).is_some_and(|rest| rest.starts_with('.'));
        let above = self.derived().iter().find(|derived| below(derived.field))?;
        let mut whole = serde_json::to_value(self.sections()).ok()?;
        set(&mut whole, &Value::Null, &change.field, change.value.clone())?;
        let value = look(&whole, above.field)?.clone();
        Some(Cure { field: above.field.to_string(), value })
    }

    /// The given fields that a rule would give another value, each with that value; those of purchased parts last.
    pub fn off_their_rules(&self) -> Vec<Cure> {
        let Ok(tree) = serde_json::from_str::<Value>(self.text()) else { return Vec::new() };
        let mut found: Vec<Cure> =
            fields().filter_map(|field| by_rule(&tree, field).map(|(cure, _)| cure)).collect();
        found.sort_by_key(|cure| Self::is_purchased(&cure.field));
        found
    }

    /// Whether a field is of a purchased camera, not chosen.
    pub fn is_purchased(field: &str) -> bool {
        let chosen = ["camera.position_mm", "camera.rotation_deg", "camera_body.min_sheet_gap_mm"];
        let is_camera = field.starts_with("camera.") || field.starts_with("camera_body.");
        is_camera && !field.ends_with("clearance_mm") && !chosen.contains(&field)
    }

    /// The numbers, and lists of numbers, at and below a field, each times a factor, to 0.01 away from what they were.
    pub fn scaled(&self, field: &str, factor: f64) -> Vec<Cure> {
        let Ok(whole) = serde_json::to_value(self.sections()) else { return Vec::new() };
        let mut leaves = Vec::new();
        numbers_below(&whole, field, &mut leaves);
        leaves.into_iter().map(|(field, value)| Cure { field, value: scaled(&value, factor) }).collect()
    }
}

/// What a rule gives a field that has another number in a tree, and the tree with all that the rules give then.
fn by_rule(tree: &Value, field: &str) -> Option<(Cure, Value)> {
    let given = look(tree, field)?;
    if !is_numeric(given) {
        return None;
    }
    let mut without = tree.clone();
    set(&mut without, &Value::Null, field, Value::Null)?;
    derive(&mut without).ok()?;
    let value = look(&without, field)?.clone();
    let same = numbers(&value).eq(numbers(given));
    (!same).then(|| (Cure { field: field.to_owned(), value }, without))
}

/// The faults of a tree that no design can be made from, each without a cure with the first given field that, left to its
/// rule, takes it away; best one that leaves no fault.
pub(super) fn with_cures_by_rules(
    tree: &Value,
    mut error: DesignError,
    judge: impl Fn(Value) -> Result<(), DesignError>,
) -> DesignError {
    let mut faults = std::mem::take(&mut error.more);
    faults.insert(0, error);
    if faults.iter().all(|fault| fault.cure.is_some()) {
        return joined(faults);
    }
    let mut judged: Vec<(Cure, Vec<String>)> = Vec::new();
    for field in fields() {
        if let Some((cure, changed)) = by_rule(tree, field) {
            let left = judge(changed).err().map(|error| error.kinds()).unwrap_or_default();
            judged.push((cure, left));
        }
    }
    let cured = |fault: DesignError| {
        if fault.cure.is_some() {
            return fault;
        }
        let kind = fault.kind();
        let shared = |cure: &Cure| {
            fault.field.split(['.', '[']).zip(cure.field.split('.')).take_while(|(a, b)| a == b).count()
        };
        let helps = judged.iter().filter(|(_, left)| !left.contains(&kind));
        let best = helps.min_by_key(|(cure, left)| (left.len(), std::cmp::Reverse(shared(cure)))).cloned();
        match best {
            Some((cure, _)) => fault.with_tried(cure),
            None => fault,
        }
    };
    joined(faults.into_iter().map(cured).collect())
}

/// Faults as one error.
fn joined(faults: Vec<DesignError>) -> DesignError {
    match DesignError::all(faults) {
        Err(error) => error,
        Ok(()) => DesignError::at("", "", "no fault", ""),
    }
}

fn is_numeric(value: &Value) -> bool {
    match value {
        Value::Number(_) => true,
        Value::Array(list) => !list.is_empty() && list.iter().all(is_numeric),
        _ => false,
    }
}

/// All numbers of a value, in order.
fn numbers(value: &Value) -> Box<dyn Iterator<Item = f64> + '_> {
    match value {
        Value::Array(list) => Box::new(list.iter().flat_map(numbers)),
        other => Box::new(other.as_f64().into_iter()),
    }
}

fn numbers_below(whole: &Value, field: &str, found: &mut Vec<(String, Value)>) {
    let Some(value) = look(whole, field) else { return };
    match value {
        Value::Object(below) => {
            for key in below.keys().filter(|key| *key != "why") {
                numbers_below(whole, &format!("{field}.{key}"), found);
            }
        }
        numeric if is_numeric(numeric) => found.push((field.to_owned(), numeric.clone())),
        _ => {}
    }
}

fn scaled(value: &Value, factor: f64) -> Value {
    match value {
        Value::Array(list) => list.iter().map(|one| scaled(one, factor)).collect(),
        Value::Number(number) => {
            let from = number.as_f64().unwrap_or(0.0);
            let steps = 100.0 * from * factor;
            let grows = (factor > 1.0) == (from > 0.0);
            let to = if grows { (steps - 1e-6).ceil() } else { (steps + 1e-6).floor() } / 100.0;
            if number.is_f64() { json!(to) } else { json!(to.round() as i64) }
        }
        other => other.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_set_left_out_and_taken_from_the_whole() {
        let whole = json!({ "a": { "list": [[1, 2], [3, 4]], "b": 5 } });
        let mut tree = json!({ "a": { "b": 5 } });
        set(&mut tree, &whole, "a.list[1][0]", json!(9)).unwrap();
        assert_eq!(tree, json!({ "a": { "b": 5, "list": [[1, 2], [9, 4]] } }));
        set(&mut tree, &whole, "a.b", Value::Null).unwrap();
        set(&mut tree, &whole, "c.d.e", json!(1)).unwrap();
        assert_eq!(tree, json!({ "a": { "list": [[1, 2], [9, 4]] }, "c": { "d": { "e": 1 } } }));
        for wrong in ["a.list[9]", "a.list[x]", "", "a..b", "c.d.e.f", "x[0]"] {
            assert!(set(&mut tree.clone(), &whole, wrong, json!(1)).is_none(), "{wrong}");
        }
    }

    #[test]
    fn a_field_off_its_rule_is_named_with_what_the_rule_gives() {
        let text =
            r#"{"version": 1, "name": "t", "camera": {"from": "misumi75"}, "dome": {"radius_mm": 10}}"#;
        let design: Design = text.parse().unwrap();
        let chosen = |design: &Design| -> Vec<Cure> {
            let off = design.off_their_rules().into_iter();
            off.filter(|cure| !Design::is_purchased(&cure.field)).collect()
        };
        assert_eq!(chosen(&design), []);
        let ruled = design.sections().sheet.clearance_mm;
        let change = Cure { field: "sheet.clearance_mm".into(), value: json!(ruled + 0.05) };
        let off = chosen(&design.changed(&change).unwrap());
        assert_eq!(off, [Cure { field: "sheet.clearance_mm".into(), value: json!(ruled) }]);
        let longer = design.scaled("camera.position_mm", 1.5);
        assert_eq!(longer.len(), 1);
        assert!(longer[0].value[2].as_f64().unwrap() < 1.49 * design.sections().camera.position_mm[2]);
    }

    #[test]
    fn a_change_below_an_object_of_a_rule_is_one_of_the_whole_object() {
        let text = json!({
            "version": 1, "name": "small", "camera": { "from": "ov6946" }, "camera_body": { "from": "ov6946" },
            "dome": { "radius_mm": 6 },
        });
        let design = Design::from_text(&text.to_string(), Path::new("")).unwrap();
        let change = Cure::length("springs.places.ring.radius_mm", 5.0, 20.0);
        let fault = |cure: &Cure| DesignError::at("springs.places", "", "narrow", "").with_cure(cure.clone());
        let said = design.with_writable_cures(fault(&change).with_more(vec![fault(&change)]));
        for said in [&said, &said.more[0]] {
            let cure = said.cure.as_deref().unwrap();
            assert_eq!(
                (cure.field.as_str(), &cure.value["ring"]["radius_mm"]),
                ("springs.places", &json!(20.0))
            );
            assert!(said.help.as_deref().unwrap().contains(&cure.to_string()), "{said}");
            // As a person enters it.
            let mut entered = text.clone();
            entered["springs"] = json!({ "places": cure.value.clone() });
            Design::from_text(&entered.to_string(), Path::new("")).unwrap();
        }
        // What the file has already is changed where it stands.
        let mut given = text.clone();
        given["springs"] =
            json!({ "places": { "ring": { "count": 6, "radius_mm": 9, "first_azimuth_deg": 30 } } });
        let given = Design::from_text(&given.to_string(), Path::new("")).unwrap();
        assert_eq!(given.with_writable_cures(fault(&change)).cure.as_deref(), Some(&change));
    }

    #[test]
    fn faults_against_the_schema_name_a_value_that_takes_them_away() {
        let thumb24: Value = serde_json::from_str(include_str!("../../../designs/thumb24.json")).unwrap();
        let wrong = [
            ("dome.radius_m", json!(10)),
            ("dome.radius_mm", json!(-1)),
            ("dome.radius_mm", json!("10,5")),
            ("leds.tilt_deg", json!("85")),
            ("pattern.kind", json!("hexagon")),
            ("springs.active_coils", json!(0)),
            ("springs.ends", json!("closed_grund")),
            ("white_markers.reflectance", json!(1.5)),
            ("leds.lobe_exponent", json!(-3)),
        ];
        for (field, value) in wrong {
            let mut tree = thumb24.clone();
            set(&mut tree, &Value::Null, field, value.clone()).unwrap();
            let error = tree.to_string().parse::<Design>().expect_err(field);
            assert_eq!(error.field, field, "{error}");
            let cure = error.cure.clone().unwrap_or_else(|| panic!("no cure: {error}"));
            set(&mut tree, &Value::Null, &cure.field, cure.value.clone()).unwrap();
            let left = tree.to_string().parse::<Design>().err();
            let kinds = left.map(|error| error.kinds()).unwrap_or_default();
            assert!(!kinds.contains(&error.kind()), "{field} = {value}: {cure} leaves {kinds:?}");
        }
    }
}
