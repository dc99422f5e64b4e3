//! What a rule may read: the fields that are known when its turn comes.

use std::cell::RefCell;

use serde_json::Value;

/// The known fields of a design, and what a rule found wrong with them.
pub(super) struct Known<'a> {
    tree: &'a Value,
    fault: RefCell<Option<String>>,
}

/// The value at a path of keys.
pub(super) fn lookup<'a>(tree: &'a Value, path: &str) -> Option<&'a Value> {
    path.split('.').try_fold(tree, |place, key| place.get(key))
}

impl<'a> Known<'a> {
    pub(super) fn new(tree: &'a Value) -> Self {
        Self { tree, fault: RefCell::new(None) }
    }

    /// The first thing that was wrong.
    pub(super) fn fault(&self) -> Option<String> {
        self.fault.borrow().clone()
    }

    /// Remembers the first thing that is wrong; the rule's result is then not used.
    pub(super) fn wrong(&self, what: impl Into<String>) {
        self.fault.borrow_mut().get_or_insert_with(|| what.into());
    }

    /// Whether a field is there.
    pub(super) fn has(&self, path: &str) -> bool {
        lookup(self.tree, path).is_some()
    }

    /// Whether the platform stands on posts.
    pub(super) fn is_rigid(&self) -> bool {
        self.value("mount.kind").is_some_and(|kind| kind == "rigid")
    }

    /// The field as JSON.
    pub(super) fn value(&self, path: &str) -> Option<&'a Value> {
        lookup(self.tree, path)
    }

    /// A number; one that is not there is remembered as wrong.
    pub(super) fn n(&self, path: &str) -> f64 {
        self.value(path).and_then(Value::as_f64).unwrap_or_else(|| {
            self.wrong(format!("{path} is no number"));
            0.0
        })
    }

    /// A number of a list.
    pub(super) fn at(&self, path: &str, index: usize) -> f64 {
        self.value(path).and_then(|list| list.get(index)?.as_f64()).unwrap_or_else(|| {
            self.wrong(format!("{path}[{index}] is no number"));
            0.0
        })
    }

    /// How many a list holds.
    pub(super) fn count(&self, path: &str) -> usize {
        self.value(path).and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// A whole section as its type.
    pub(super) fn read<T: serde::de::DeserializeOwned>(&self, path: &str) -> Option<T> {
        let found = serde_json::from_value(self.value(path)?.clone());
        found.map_err(|error| self.wrong(format!("{path}: {error}"))).ok()
    }

    /// A number as JSON; one that is not finite is remembered as wrong.
    pub(super) fn number(&self, value: f64) -> Option<Value> {
        if !value.is_finite() {
            self.wrong("it is not finite");
        }
        // a nanometre is below all that is made, and hides the tails of binary fractions
        Some(Value::from(tidy(value)))
    }

    /// Numbers as a JSON list.
    pub(super) fn numbers(&self, values: &[f64]) -> Option<Value> {
        values.iter().map(|value| self.number(*value)).collect::<Option<Vec<_>>>().map(Value::Array)
    }

    /// Places in the plane as a JSON list of pairs.
    pub(super) fn places(&self, places: &[[f64; 2]]) -> Option<Value> {
        places.iter().map(|place| self.numbers(place)).collect::<Option<Vec<_>>>().map(Value::Array)
    }
}

/// To a nanometre.
pub(super) fn tidy(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The next multiple of a step that is not below; a millionth of a step is rounding.
pub(super) fn up(value: f64, step: f64) -> f64 {
    tidy((value / step - 1e-6).ceil() * step)
}

/// The next multiple of a step that is not above.
pub(super) fn down(value: f64, step: f64) -> f64 {
    tidy((value / step + 1e-6).floor() * step)
}
