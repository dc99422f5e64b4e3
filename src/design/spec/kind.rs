//! Which of domecast's files a tree is: one that stands in another's place is called by its name, not by its fields.

use serde_json::Value;

use super::error::DesignError;

/// A kind of file that people hand to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A design file.
    Design,
    /// A scene file.
    Scene,
    /// The constants of a build.
    Constants,
    /// The spec of a data set.
    Dataset,
}

impl FileKind {
    /// The kind of a tree, by fields that no other kind has; `None` where it has none of them.
    pub fn of(value: &Value) -> Option<Self> {
        let has = |field: &str| value.get(field).is_some();
        if value.get("format").and_then(Value::as_str) == Some("domecast-constants") {
            Some(Self::Constants)
        } else if has("hardness") && has("shapes") {
            Some(Self::Dataset)
        } else if has("design") && has("frames") {
            Some(Self::Scene)
        } else {
            (has("camera") && has("dome")).then_some(Self::Design)
        }
    }

    /// Refuses a tree that is clearly of another kind.
    ///
    /// # Errors
    /// A file of another kind, with the command that takes it.
    pub fn expect(self, value: &Value) -> Result<(), DesignError> {
        match Self::of(value) {
            Some(found) if found != self => {
                Err(DesignError::at("", "", format!("this is {}", found.words()), self.words())
                    .with_help(found.command()))
            }
            _ => Ok(()),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Design => "a design file",
            Self::Scene => "a scene file",
            Self::Constants => "a constants file",
            Self::Dataset => "the spec of a data set",
        }
    }

    fn command(self) -> &'static str {
        match self {
            Self::Design => "`domecast build` takes designs; a scene names its design in the field `design`",
            Self::Scene => "`domecast simulate` draws scenes",
            Self::Dataset => "`domecast dataset` takes specs of data sets",
            Self::Constants => "`domecast track` and `domecast calibrate-force` take constants",
        }
    }
}
