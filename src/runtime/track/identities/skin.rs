//! The skin between dots: displacements change smoothly from dot to dot.

use glam::{DMat3, DVec2, DVec3};

use crate::track::model::DotModel;

/// Weight of the dots beyond the nearest ones.
const SECOND_WEIGHT: f64 = 0.4;
/// How much a gradient costs against a misfit: few dots in a row tell little of it.
const GRADIENT_COST: f64 = 0.12;
/// Dots around one that count.
const MAX_AROUND: usize = 48;

/// What the dots around one say of its displacement.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkinEstimate {
    /// Its displacement, px.
    pub displaced_px: DVec2,
    /// How many of its neighbours say so.
    pub neighbors: usize,
}

/// Displacement of a dot as a plane through those of the two rings of dots around it, gradients kept small; `None` where
/// no neighbour has one. `at`: places of the undeformed dots, px; `displaced`: by how much each is beside, where known.
pub(super) fn estimate(
    index: usize,
    models: &[DotModel],
    at: impl Fn(usize) -> Option<DVec2>,
    displaced: impl Fn(usize) -> Option<DVec2>,
) -> Option<SkinEstimate> {
    beside(&models[index], at(index)?, index, models, at, displaced)
}

/// [`estimate`] of a dot that need not be one of the pattern's, at its place on the undeformed dome; `index`: its own
/// number, or one beyond all.
pub(super) fn beside(
    dot: &DotModel,
    center: DVec2,
    index: usize,
    models: &[DotModel],
    at: impl Fn(usize) -> Option<DVec2>,
    displaced: impl Fn(usize) -> Option<DVec2>,
) -> Option<SkinEstimate> {
    let spacing = dot.spacing_px;
    let mut seen = [usize::MAX; MAX_AROUND];
    let mut count = 0;
    let mut matrix = DMat3::from_diagonal(DVec3::new(0.0, GRADIENT_COST, GRADIENT_COST));
    let mut sums = [DVec3::ZERO; 2];
    let mut neighbors = 0;
    let mut add = |other: usize, is_next: bool| {
        if other == index || count == MAX_AROUND || seen[..count].contains(&other) {
            return;
        }
        let (Some(place), Some(moved)) = (at(other), displaced(other)) else { return };
        (seen[count], count) = (other, count + 1);
        let weight = if is_next { 1.0 } else { SECOND_WEIGHT };
        let from = (place - center) / spacing;
        let row = DVec3::new(1.0, from.x, from.y);
        matrix += DMat3::from_cols(row * row.x, row * row.y, row * row.z) * weight;
        sums[0] += row * (weight * moved.x);
        sums[1] += row * (weight * moved.y);
        neighbors += usize::from(is_next);
    };
    for other in &dot.neighbors {
        add(*other, true);
    }
    for other in &dot.neighbors {
        for further in &models[*other].neighbors {
            add(*further, false);
        }
    }
    if neighbors == 0 {
        return None;
    }
    let inverse = matrix.inverse();
    let displaced_px = DVec2::new((inverse * sums[0]).x, (inverse * sums[1]).x);
    displaced_px.is_finite().then_some(SkinEstimate { displaced_px, neighbors })
}

/// A dot's distance from what the dots around it say at which it counts for nothing, in parts of its spacing.
const MAX_ROUGH: f64 = 0.4;

/// How well displacements make one skin: dots that have one, each less by how far it is from what the dots around it say.
pub(super) fn smoothness(
    models: &[DotModel],
    at: impl Fn(usize) -> Option<DVec2>,
    displaced: impl Fn(usize) -> Option<DVec2>,
) -> f64 {
    let mut sum = 0.0;
    for (index, model) in models.iter().enumerate() {
        let Some(own) = displaced(index) else { continue };
        if let Some(around) = estimate(index, models, &at, &displaced) {
            let rough = own.distance(around.displaced_px) / (MAX_ROUGH * model.spacing_px);
            sum += 1.0 - (rough * rough).min(1.0);
        }
    }
    sum
}

/// Whether a dot's displacement is none that the skin around it could have.
pub(super) fn is_torn(
    index: usize,
    models: &[DotModel],
    at: impl Fn(usize) -> Option<DVec2>,
    displaced: impl Fn(usize) -> Option<DVec2>,
) -> bool {
    let Some(own) = displaced(index) else { return false };
    estimate(index, models, at, displaced)
        .is_some_and(|around| own.distance(around.displaced_px) > MAX_ROUGH * models[index].spacing_px)
}
