//! The evenness of a pattern in sensors that are drawn within the tolerances (Monte Carlo).
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::tolerances::under_tolerances;
//! use domecast_design::layout::{Layout, LayoutSpec};
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! let spec = LayoutSpec::of_design(&design)?;
//! let report = under_tolerances(&spec, &Layout::new(&spec)?, &design.sections().tolerances);
//! let worst = report.ok_or("no dot has a neighbour")?.ranking[0].tolerance;
//! println!("{worst} costs most");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::evenness::{evenness_of, in_plane};
use super::plan::Layout;
use super::spec::LayoutSpec;
use crate::spec::sections::TolerancesSection;
use domecast_optics::numeric::Rigid;
use domecast_optics::numeric::SeededRandom;

/// What tolerances do to a pattern.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceReport {
    /// Sensors drawn.
    pub samples: usize,
    /// Dots that were sampled, with their neighbours: all, or an even choice of a large pattern.
    pub dots: usize,
    /// Sensors of which a dot could not be seen; they count in no figure.
    pub blind: usize,
    /// Variation of the nearest distances in the image that half of the sensors keep to.
    pub nearest_variation_median: f64,
    /// The one that 19 of 20 keep to.
    pub nearest_variation_p95: f64,
    /// Mean distance of a dot from its place in the image, px: over dots and sensors.
    pub mean_shift_px: f64,
    /// Each tolerance alone, the worst first.
    pub ranking: Vec<ToleranceShare>,
}

/// What one tolerance does alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceShare {
    /// Its field in the design's `tolerances`.
    pub tolerance: &'static str,
    /// Mean variation of the nearest distances in the image beyond the design's own, as the root of the
    /// difference of squares.
    pub added_variation: f64,
    /// Mean distance of a dot from its place, px.
    pub mean_shift_px: f64,
}

/// The tolerances in a fixed order.
const TOLERANCES: [&str; 8] = [
    "pupil_mm",
    "camera_rotation_deg",
    "dome_radius_mm",
    "layer_thickness_mm",
    "index",
    "print_registration_mm",
    "print_rotation_deg",
    "print_scatter_mm",
];

/// Patterns of more dots are judged by an even choice of about this many, so that the time does not grow with
/// the pattern: the figures are means over dots, and a thousand of them are known to a few percent.
const MAX_SAMPLED: usize = 1500;

/// Sensors for each entry of the ranking, at most.
const RANKING_SAMPLES: u32 = 48;

/// A gap between layers that would be negative is closed; the pupil stays this far under the sheet, mm.
const MIN_AIR_MM: f64 = 1e-6;

/// Draws sensors within the tolerances: the evenness to expect, and the tolerance that costs most.
pub fn under_tolerances(
    spec: &LayoutSpec,
    layout: &Layout,
    tolerances: &TolerancesSection,
) -> Option<ToleranceReport> {
    let image: Vec<_> = layout.dots.iter().map(|dot| Some(dot.image_px)).collect();
    let sampled = SampledDots::new(layout);
    let own = evenness_of(layout, sampled.chosen(), &image, in_plane, |_, _| true)?.nearest.variation;
    let draw = |only: Option<usize>, count: u32| draw(spec, layout, &sampled, tolerances, only, count);
    let drawn = draw(None, tolerances.sensors());
    let mut variations: Vec<f64> = drawn.iter().flatten().map(|(variation, _)| *variation).collect();
    variations.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * variations.len() as f64) as usize;
        variations.get(index.min(variations.len().saturating_sub(1))).copied()
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
        sum / count.max(1) as f64
    };
    let mut ranking: Vec<ToleranceShare> = (0..TOLERANCES.len())
        .map(|index| {
            let alone = draw(Some(index), tolerances.sensors().min(RANKING_SAMPLES));
            let squares = mean(&mut alone.iter().flatten().map(|(variation, _)| variation * variation));
            ToleranceShare {
                tolerance: TOLERANCES[index],
                added_variation: (squares - own * own).max(0.0).sqrt(),
                mean_shift_px: mean(&mut alone.iter().flatten().map(|(_, shift)| *shift)),
            }
        })
        .collect();
    ranking.sort_by(|a, b| b.added_variation.total_cmp(&a.added_variation));
    Some(ToleranceReport {
        samples: drawn.len(),
        dots: sampled.chosen().count(),
        blind: drawn.iter().filter(|sample| sample.is_none()).count(),
        nearest_variation_median: at(0.5)?,
        nearest_variation_p95: at(0.95)?,
        mean_shift_px: mean(&mut drawn.iter().flatten().map(|(_, shift)| *shift)),
        ranking,
    })
}

/// Mean distance of a dot from its place in the image, px, in each of `count` sensors drawn within the tolerances;
/// `None` for one that does not see all of its dots. The first are those of [`under_tolerances`].
pub fn drawn_shifts_px(
    spec: &LayoutSpec,
    layout: &Layout,
    tolerances: &TolerancesSection,
    count: u32,
) -> Vec<Option<f64>> {
    let drawn = draw(spec, layout, &SampledDots::new(layout), tolerances, None, count);
    drawn.into_iter().map(|sensor| sensor.map(|(_, shift_px)| shift_px)).collect()
}

/// Sensors with all tolerances, or `only` one of them.
fn draw(
    spec: &LayoutSpec,
    layout: &Layout,
    sampled: &SampledDots,
    tolerances: &TolerancesSection,
    only: Option<usize>,
    count: u32,
) -> Vec<Option<(f64, f64)>> {
    let stream = only.map_or(0, |index| index as u64 + 1) << 32;
    (0..count)
        .into_par_iter()
        .map(|sample| {
            let mut random = SeededRandom::stream(tolerances.seed, stream + u64::from(sample));
            sensor(spec, layout, sampled, tolerances, only, &mut random)
        })
        .collect()
}

/// The dots that are sampled through the drawn sensors.
struct SampledDots {
    step: usize,
    /// For each dot, whether its place is needed: because it is sampled, or because a neighbour is.
    needed: Vec<bool>,
}

impl SampledDots {
    fn new(layout: &Layout) -> Self {
        let step = layout.dots.len().div_ceil(MAX_SAMPLED).max(1);
        let mut needed = vec![false; layout.dots.len()];
        for (i, dot) in layout.dots.iter().enumerate().step_by(step) {
            needed[i] = true;
            for j in &dot.neighbors {
                if let Some(needed) = needed.get_mut(*j as usize) {
                    *needed = true;
                }
            }
        }
        Self { step, needed }
    }

    fn chosen(&self) -> impl Iterator<Item = usize> {
        (0..self.needed.len()).step_by(self.step)
    }
}

/// One sensor: variation of the nearest distances in its image, and the mean shift of its dots, px. All
/// tolerances are drawn in the same order whether they count or not.
fn sensor(
    spec: &LayoutSpec,
    layout: &Layout,
    sampled: &SampledDots,
    tolerances: &TolerancesSection,
    only: Option<usize>,
    random: &mut SeededRandom,
) -> Option<(f64, f64)> {
    let counts = |index: usize| f64::from(u8::from(only.is_none_or(|only| only == index)));
    let mut made = spec.optics.spec();
    let shift = DVec3::from_array(tolerances.pupil_mm.map(|sd| sd * random.normal())) * counts(0);
    let [a, b, c] = tolerances.camera_rotation_deg.map(|sd| sd.to_radians() * random.normal() * counts(1));
    let turn = DMat3::from_rotation_z(c) * DMat3::from_rotation_y(b) * DMat3::from_rotation_x(a);
    let nominal_radius_mm = made.dome.radius_mm();
    let radius_mm = (nominal_radius_mm + tolerances.dome_radius_mm * random.normal() * counts(2))
        .max(0.5 * nominal_radius_mm);
    made.dome = made.dome.scaled_to(radius_mm);
    let mut sheet_mm = 0.0;
    for layer in &mut made.layers {
        let thicker = tolerances.layer_thickness_mm * random.normal() * counts(3);
        let denser = tolerances.index * random.normal() * counts(4);
        if let Some(thickness) = &mut layer.thickness_mm {
            *thickness = (*thickness + thicker).max(0.0);
            sheet_mm += *thickness;
        }
        layer.index = layer.index.map(|index| (index + denser).max(1.0));
    }
    let place = &made.sensor_from_camera;
    let mut pupil_mm = place.translation_mm + shift;
    pupil_mm.z = pupil_mm.z.min(-sheet_mm - MIN_AIR_MM);
    made.sensor_from_camera = Rigid::new(turn * place.rotation, pupil_mm);
    let optics = spec.optics.rebuilt(&made).ok()?;

    // Each print pass has its own registration.
    let moved: Vec<(DVec2, DVec2)> = layout
        .passes
        .iter()
        .map(|_| {
            let shift_mm = random.normal_pair() * tolerances.print_registration_mm * counts(5);
            let turn = tolerances.print_rotation_deg.to_radians() * random.normal() * counts(6);
            (shift_mm, DVec2::from_angle(turn))
        })
        .collect();
    let larger = radius_mm / nominal_radius_mm;
    let center_mm = spec.optics.dome().center_mm();
    let seen: Option<Vec<Option<DVec2>>> = layout
        .dots
        .iter()
        .zip(&sampled.needed)
        .map(|(dot, needed)| {
            if !needed {
                return Some(None);
            }
            let (shift_mm, turn) = *moved.get(dot.pass)?;
            let scatter_mm = random.normal_pair() * tolerances.print_scatter_mm * counts(7);
            let plate_mm = turn.rotate(dot.plate_mm) + shift_mm + scatter_mm;
            let on_pass = layout.transfer.dome_from_plate(plate_mm).ok()?;
            let surface = layout.passes.get(dot.pass)?.pass_from_sensor.transpose() * on_pass;
            let surface = (surface + center_mm) * larger;
            Some(Some(optics.project(surface).ok()?))
        })
        .collect();
    let seen = seen?;
    let variation = evenness_of(layout, sampled.chosen(), &seen, in_plane, |_, _| true)?.nearest.variation;
    let shift = |i: usize| Some(seen[i]?.distance(layout.dots[i].image_px));
    let shifts: Vec<f64> = sampled.chosen().filter_map(shift).collect();
    Some((variation, shifts.iter().sum::<f64>() / shifts.len().max(1) as f64))
}
