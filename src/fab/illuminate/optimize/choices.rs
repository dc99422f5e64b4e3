//! What is chosen once for a search: the diffuser, and how many lights a colour has and where.

use serde::Serialize;
use serde_json::{Value, json};

use domecast_design::Design;
use domecast_design::sections::{DiffuserSection, LedColor, LedSection};

/// A diffuser that can be laid over the lights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DiffuserKind {
    /// Its name in results.
    pub name: &'static str,
    /// Where its numbers come from.
    pub source: &'static str,
    /// Thickness over the light, mm.
    pub thickness_mm: f64,
    /// What it does to the light; `None` for no diffuser.
    pub diffuser: Option<DiffuserSection>,
}

/// Diffusers beside the design's own. Their numbers are typical ones: measure the one that you use.
const KINDS: [DiffuserKind; 5] = [
    DiffuserKind { name: "none", source: "bare lights", thickness_mm: 0.0, diffuser: None },
    DiffuserKind {
        name: "tape",
        source: "matt tape: three fifths by Lambert's law, the rest in a lobe of 30 degrees; the rule of leds.diffuser",
        thickness_mm: 0.1,
        diffuser: Some(DiffuserSection { lambert_fraction: 0.6, lobe_width_deg: 30.0, transmittance: 0.6 }),
    },
    DiffuserKind {
        name: "film",
        source: "micro-structured film of 40 degrees full width at half maximum (17 degrees of standard deviation), which \
                 lets 85 to 92 percent through by its maker (Luminit, light shaping diffusers)",
        thickness_mm: 0.25,
        diffuser: Some(DiffuserSection { lambert_fraction: 0.0, lobe_width_deg: 17.0, transmittance: 0.88 }),
    },
    DiffuserKind {
        name: "ground",
        source: "estimate: thin acrylic ground with 220 grit, a narrow lobe of some 16 degrees full width at half maximum",
        thickness_mm: 0.5,
        diffuser: Some(DiffuserSection { lambert_fraction: 0.0, lobe_width_deg: 7.0, transmittance: 0.85 }),
    },
    DiffuserKind {
        name: "opal",
        source: "estimate: thin opal acrylic, by Lambert's law alone, a third of the light gets through",
        thickness_mm: 0.5,
        diffuser: Some(DiffuserSection { lambert_fraction: 1.0, lobe_width_deg: 90.0, transmittance: 0.35 }),
    },
];

/// The design's own diffuser first, then those of the list that differ from it.
pub fn diffusers(design: &Design) -> Vec<DiffuserKind> {
    let leds = &design.sections().leds;
    let own = DiffuserKind {
        name: "as given",
        source: "the design's leds.diffuser",
        thickness_mm: leds.diffuser_thickness_mm,
        diffuser: leds.diffuser,
    };
    let others = KINDS.into_iter().filter(|kind| kind.diffuser != own.diffuser);
    std::iter::once(own).chain(others).collect()
}

/// How the lights of a colour stand round the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ArcSpread {
    /// As the design has them.
    AsGiven,
    /// Evenly on an arc about the colour's azimuth.
    AboutMiddle,
    /// Evenly on an arc that begins at the colour's azimuth.
    FromFirst,
}

/// Lights of each colour, and how they stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Arrangement {
    /// Lights of each colour.
    pub per_color: usize,
    /// How they stand.
    pub spread: ArcSpread,
}

/// A colour's lights at most.
const MAX_PER_COLOR: usize = 3;

impl Arrangement {
    /// The given one first, then one to three lights a colour where all lights are of one colour each.
    pub fn all(design: &Design) -> Vec<Self> {
        let list = &design.sections().leds.list;
        let given = list.len() / 3;
        let mut found = vec![Self { per_color: given, spread: ArcSpread::AsGiven }];
        if list.iter().any(|led| led.color == LedColor::White) || azimuths_deg(list).contains(&None) {
            return found;
        }
        for per_color in 1..=MAX_PER_COLOR {
            match per_color {
                1 if given == 1 => {}
                1 => found.push(Self { per_color, spread: ArcSpread::AboutMiddle }),
                2 => found.extend(
                    [ArcSpread::AboutMiddle, ArcSpread::FromFirst].map(|spread| Self { per_color, spread }),
                ),
                _ => found.push(Self { per_color, spread: ArcSpread::AboutMiddle }),
            }
        }
        found
    }

    /// Whether the arc is searched.
    pub fn has_arc(&self) -> bool {
        self.spread != ArcSpread::AsGiven && self.per_color > 1
    }

    /// The lights, of which the outermost of a colour stand `half_arc_deg` off their middle.
    pub fn list(&self, design: &Design, half_arc_deg: f64) -> Vec<LedSection> {
        let given = &design.sections().leds.list;
        if self.spread == ArcSpread::AsGiven {
            return given.clone();
        }
        let colors = [LedColor::Red, LedColor::Green, LedColor::Blue];
        let middles = azimuths_deg(given);
        let of_color = |(color, middle): (LedColor, Option<f64>)| {
            let middle =
                middle.unwrap_or(0.0) + if self.spread == ArcSpread::FromFirst { half_arc_deg } else { 0.0 };
            let count = self.per_color;
            (0..count).map(move |k| {
                let share = if count > 1 { 2.0 * k as f64 / (count - 1) as f64 - 1.0 } else { 0.0 };
                let turned = (middle + share * half_arc_deg).rem_euclid(360.0);
                LedSection { color, azimuth_deg: (10.0 * turned).round() / 10.0 }
            })
        };
        colors.into_iter().zip(middles).flat_map(of_color).collect()
    }
}

/// Mean azimuth of each colour's lights (direction of the sum of their unit vectors), degrees; `None` where there is none.
fn azimuths_deg(list: &[LedSection]) -> [Option<f64>; 3] {
    [LedColor::Red, LedColor::Green, LedColor::Blue].map(|color| {
        let of_color = || list.iter().filter(|led| led.color == color);
        let sum =
            of_color().map(|led| glam::DVec2::from_angle(led.azimuth_deg.to_radians())).sum::<glam::DVec2>();
        let is_one = of_color().count() == 1;
        let only = of_color().next().map(|led| led.azimuth_deg).filter(|_| is_one);
        only.or_else(|| (sum.length() > 1e-6).then(|| sum.to_angle().to_degrees()))
    })
}

/// A diffuser as fields of a design file: thickness and section.
pub fn diffuser_fields(kind: &DiffuserKind) -> [(&'static str, Value); 2] {
    [
        ("leds.diffuser_thickness_mm", json!(kind.thickness_mm)),
        ("leds.diffuser", kind.diffuser.map_or(Value::Null, |section| json!(section))),
    ]
}
