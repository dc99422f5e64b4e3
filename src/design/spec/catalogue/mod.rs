//! Parts that can be bought, with what a design needs of them and where each number comes from.
//!
//! The entries are data (`data/*.json`, compiled in). A field is named by the section and the field that it fills:
//! `camera_body.diameter_mm`, `magnets.thickness_mm`; `layer` stands for a layer of `optics.layers`. What no section
//! takes yet stands under `sensor` and `sheet`. Numbers that are not from a source which can
//! be named are marked `estimate:` with the reason.
//!
//! In a design, a section names an entry by its key, as `"from": "misumi75"`; what the section gives itself wins.
//!
//! # Example
//! ```
//! use domecast_design::catalogue::{self, CatalogueKind};
//!
//! let magnet = catalogue::find(&[CatalogueKind::Magnets], "disc-3x1")?;
//! assert_eq!(magnet.fields["magnets.diameter_mm"].value, 3.0);
//! assert!(catalogue::find(&[CatalogueKind::Cameras], "picam").is_err());
//! # Ok::<(), domecast_design::DesignError>(())
//! ```

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::OnceLock;

use serde::Deserialize;
use serde_json::{Value, json};

use crate::spec::DesignError;

/// A kind of part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CatalogueKind {
    /// Camera modules.
    Cameras,
    /// Lights.
    Leds,
    /// Casting silicones.
    Silicones,
    /// Sheets of acrylic and glass.
    Sheets,
    /// Compression springs.
    Springs,
    /// Disc magnets.
    Magnets,
}

impl CatalogueKind {
    /// All kinds.
    pub const ALL: [Self; 6] =
        [Self::Cameras, Self::Leds, Self::Silicones, Self::Sheets, Self::Springs, Self::Magnets];

    /// The name in commands.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Cameras => "cameras",
            Self::Leds => "leds",
            Self::Silicones => "silicones",
            Self::Sheets => "sheets",
            Self::Springs => "springs",
            Self::Magnets => "magnets",
        }
    }

    /// The kind of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.as_str() == name)
    }

    fn data(self) -> &'static str {
        match self {
            Self::Cameras => include_str!("data/cameras.json"),
            Self::Leds => include_str!("data/leds.json"),
            Self::Silicones => include_str!("data/silicones.json"),
            Self::Sheets => include_str!("data/sheets.json"),
            Self::Springs => include_str!("data/springs.json"),
            Self::Magnets => include_str!("data/magnets.json"),
        }
    }
}

/// A value and where it comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CatalogueFact {
    /// The value, as the section's field takes it.
    pub value: Value,
    /// Data sheet or publication, with its year; `estimate:` and a reason where there is none.
    pub source: String,
}

/// A part.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CatalogueEntry {
    /// What designs call it.
    pub key: String,
    /// What shops call it.
    pub name: String,
    /// Why a section of a design cannot take the part, where that is so.
    #[serde(default)]
    pub refused: Option<String>,
    /// Its facts, by `section.field`.
    pub fields: BTreeMap<String, CatalogueFact>,
    /// What kind of part it is.
    #[serde(skip, default = "first_kind")]
    pub kind: CatalogueKind,
}

fn first_kind() -> CatalogueKind {
    CatalogueKind::Cameras
}

impl CatalogueEntry {
    /// The facts of one section, by the field's name.
    pub fn section<'a>(&'a self, section: &'a str) -> impl Iterator<Item = (&'a str, &'a CatalogueFact)> {
        self.fields.iter().filter_map(move |(name, fact)| {
            let field = name.strip_prefix(section)?.strip_prefix('.')?;
            Some((field, fact))
        })
    }

    /// The value of `section.field`.
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.fields.get(name).map(|fact| &fact.value)
    }
}

/// All entries of a kind, in the order of the data.
pub fn entries(kind: CatalogueKind) -> &'static [CatalogueEntry] {
    static ENTRIES: OnceLock<Vec<Vec<CatalogueEntry>>> = OnceLock::new();
    let all = ENTRIES.get_or_init(|| {
        let read = |kind: CatalogueKind| {
            let mut entries: Vec<CatalogueEntry> = serde_json::from_str(kind.data()).unwrap_or_default();
            entries.iter_mut().for_each(|entry| entry.kind = kind);
            entries
        };
        CatalogueKind::ALL.into_iter().map(read).collect()
    });
    let place = CatalogueKind::ALL.into_iter().position(|other| other == kind);
    place.and_then(|place| all.get(place)).map_or(&[], Vec::as_slice)
}

/// The entry of that key among these kinds.
///
/// # Errors
/// A key that there is not, with the nearest one and how to list them; the field is left to the caller.
pub fn find(kinds: &[CatalogueKind], key: &str) -> Result<&'static CatalogueEntry, DesignError> {
    let all = || kinds.iter().flat_map(|kind| entries(*kind));
    if let Some(found) = all().find(|entry| entry.key == key) {
        return Ok(found);
    }
    let commands: Vec<String> = kinds.iter().map(|kind| format!("domecast list {}", kind.as_str())).collect();
    let keys: Vec<&str> = all().map(|entry| entry.key.as_str()).collect();
    let fault =
        DesignError::at("from", json!(key), "the catalogue has no part of that key here", keys.join(", "));
    let near = |entry: &CatalogueEntry| strsim::jaro_winkler(&entry.key, key);
    let nearest = all().max_by(|a, b| near(a).total_cmp(&near(b)));
    let meant = nearest.map(|entry| format!("did you mean \"{}\"? ", entry.key)).unwrap_or_default();
    Err(fault.with_help(format!("{meant}list them: {}", commands.join(", "))))
}
