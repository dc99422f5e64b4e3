//! The dots of a design, and the steps from pattern to dots, in order.

use glam::DVec2;
use rayon::prelude::*;

use super::boundary::Boundary;
use super::check::check_dot;
use super::dot::{Dot, DotProjector, DotSize};
use super::edge::{center, edge};
use super::error::LayoutError;
use super::frame::EvenFrame;
use super::key::{self, KeyChoice, KeyImage, PatternKey};
use super::lost::{LostDot, Rule};
use super::neighbors::neighbors;
use super::passes::{self, PrintPass};
use super::pattern::{Pattern, PatternError};
use super::spec::{LayoutOrigin, LayoutSpec};
use super::{gaps, zones};
use crate::spec::Design;
use crate::spec::sections::{KeyKind, OnLost, PatternKind, PrintPasses, PrintSection};
use crate::transfer::TransferMap;
use domecast_optics::DomeShape;

/// Delaunay edges up to this multiple of the nearest distance count as neighbours: below the diagonal of a
/// square lattice (1.414), well above its side.
const LATTICE_NEIGHBORS: f64 = 1.2;
/// The same for patterns whose spacing varies.
const UNEVEN_NEIGHBORS: f64 = 1.6;
/// Dots about the key at least: a runtime asks for two of them, and one may be lost.
const KEY_NEIGHBORS: usize = 3;

/// The dots of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// The dots; the index is the id.
    pub dots: Vec<Dot>,
    /// The dots of the pattern that are left out, with their reasons.
    pub lost: Vec<LostDot>,
    /// The dot left out so that a turned or mirrored picture shows itself; `None` where the pattern has no symmetry or
    /// the design wants none.
    pub key: Option<PatternKey>,
    /// The print passes.
    pub passes: Vec<PrintPass>,
    /// Distance of neighbours in the even frame, px; solved if the design gives a number of dots.
    pub pitch_px: f64,
    /// Size of the dots.
    pub size: DotSize,
    /// Centre of the pattern in the even frame, px.
    pub center_px: DVec2,
    /// Edge of the pattern in the even frame, around its centre.
    pub edge: Boundary,
    /// The dome's outer face.
    pub dome: DomeShape,
    /// The pad's map, the same for each print pass.
    pub transfer: TransferMap,
    /// What a person should know, in words.
    pub warnings: Vec<String>,
    /// How the dots are printed. Not to be changed: the films' scale and sheet follow from it.
    print: PrintSection,
    origin: LayoutOrigin,
}

impl Design {
    /// The dots of the design.
    ///
    /// # Errors
    /// As for [`Layout::new`].
    pub fn layout(&self) -> Result<Layout, LayoutError> {
        Layout::of_design(self)
    }
}

impl Layout {
    /// Lays out the dots of a design.
    ///
    /// # Errors
    /// As for [`Self::new`].
    pub fn of_design(design: &Design) -> Result<Self, LayoutError> {
        Self::new(&LayoutSpec::of_design(design)?)
    }

    /// Lays out the dots.
    ///
    /// # Errors
    /// The pattern has no place, its dots are larger than its pitch, or a dot that the design requires cannot
    /// be seen or printed.
    pub fn new(spec: &LayoutSpec) -> Result<Self, LayoutError> {
        lay_out(spec)
    }

    /// The print section that the dots were laid out with, and that their films are drawn with.
    pub fn print(&self) -> &PrintSection {
        &self.print
    }

    /// The design that the layout was made from.
    pub fn origin(&self) -> &LayoutOrigin {
        &self.origin
    }
}

fn lay_out(spec: &LayoutSpec) -> Result<Layout, LayoutError> {
    let size = spec.size()?;
    let transfer = spec.transfer()?;
    let frame = EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
    let projector = DotProjector {
        optics: &spec.optics,
        frame,
        transfer: &transfer,
        size,
        outline_tolerance_mm: spec.print.outline_mm(),
    };
    let center_px = center(spec, &frame)?;
    let mut warnings = Vec::new();
    let edge = edge(spec, &projector, center_px, &mut warnings)?;
    let (pitch_px, places) = places(spec, &edge)?;
    if let DotSize::Apparent(diameter) = size
        && diameter >= pitch_px
    {
        return Err(LayoutError::new(
            "pattern.dot_diameter_px",
            diameter,
            "the dots are as large as the pattern's pitch or larger, and would touch",
            format!("below the pitch, {pitch_px} px"),
        ));
    }
    let passes = plan_passes(spec, &projector, center_px, &places);
    let zones = zones::image_zones(spec);
    let checked: Vec<Result<Dot, LostDot>> = places
        .par_iter()
        .map(|place| check_dot(spec, &projector, &passes, &zones, center_px + *place))
        .collect();
    let checked = gaps::keep_apart(checked, spec.print.min_gap_mm);
    let mut dots = Vec::with_capacity(checked.len());
    let mut lost = Vec::new();
    for result in checked {
        match result {
            Ok(dot) => dots.push(dot),
            Err(dot) => lost.push(dot),
        }
    }
    refuse_required(spec, &lost, dots.len() + lost.len())?;
    let key = take_key(spec, &frame, center_px, &mut dots, &mut warnings);
    let even: Vec<DVec2> = dots.iter().map(|dot| dot.even_px).collect();
    let around = neighbors(&even, longest_neighbor(spec));
    for ((id, dot), list) in (0u32..).zip(&mut dots).zip(around) {
        dot.id = id;
        dot.neighbors = list;
    }
    for (id, dot) in (dots.len() as u32..).zip(&mut lost) {
        dot.id = id;
    }
    if dots.is_empty() {
        return Err(LayoutError::new(
            "pattern",
            format!("{} dots, all of them left out", lost.len()),
            lost.first().map_or(String::new(), |dot| format!("no dot is left; the first: {}", dot.reason)),
            "a pattern of which at least one dot can be seen and printed",
        ));
    }
    warn_of_wrap(spec, &dots, &mut warnings);
    warn_of_lost(dots.len(), lost.len(), &mut warnings);
    let (print, origin) = (spec.print.clone(), spec.origin.clone());
    let dome = *spec.optics.dome();
    Ok(Layout {
        dots,
        lost,
        key,
        passes,
        pitch_px,
        size,
        center_px,
        edge,
        dome,
        transfer,
        warnings,
        print,
        origin,
    })
}

fn warn_of_lost(laid_out: usize, lost: usize, warnings: &mut Vec<String>) {
    if lost > 0 {
        warnings.push(format!("{lost} of {} dots of the pattern are left out", laid_out + lost));
    }
}

/// Takes the key out of the dots.
fn take_key(
    spec: &LayoutSpec,
    frame: &EvenFrame<'_>,
    center_px: DVec2,
    dots: &mut Vec<Dot>,
    warnings: &mut Vec<String>,
) -> Option<PatternKey> {
    let raw_center_px = frame.raw_from_even(center_px).ok()?;
    let rotation_rad = spec.pattern.rotation_deg.to_radians();
    let (index, images) = match key::choose(dots, raw_center_px, rotation_rad) {
        KeyChoice::NotNeeded => return None,
        KeyChoice::Dot(index, images) if spec.pattern.key == KeyKind::LeftOutDot => (index, images),
        choice => {
            let why = match choice {
                KeyChoice::None => "the pattern is symmetric and has too few dots for a key",
                _ => "pattern.key is \"none\"",
            };
            warnings.push(format!("{why}: a turned or mirrored picture passes for a good one"));
            return None;
        }
    };
    let mut dot = dots.remove(index);
    dot.id = u32::MAX;
    dot.neighbors = beside_key(spec, dots, dot.image_px);
    // Dots after the one taken out moved up by one.
    let image = |(turned_rad, is_mirrored, at): (f64, bool, usize)| KeyImage {
        turned_rad,
        is_mirrored,
        dot: (at - usize::from(at > index)) as u32,
    };
    Some(PatternKey { dot, images: images.into_iter().map(image).collect() })
}

/// The dots about the key: as far as the neighbours of other dots of the pattern, and [`KEY_NEIGHBORS`] at least, for they are
/// what leads a runtime to the gap.
fn beside_key(spec: &LayoutSpec, dots: &[Dot], key_px: DVec2) -> Vec<u32> {
    let mut near: Vec<(f64, u32)> =
        (0_u32..).zip(dots).map(|(index, dot)| (dot.image_px.distance(key_px), index)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let nearest_px = near.first().map_or(0.0, |first| first.0);
    let reach_px = longest_neighbor(spec) * nearest_px;
    let (inside, beyond) = near.split_at(near.partition_point(|(apart_px, _)| *apart_px < reach_px));
    let missing = KEY_NEIGHBORS.saturating_sub(inside.len());
    let mut found: Vec<u32> = inside.iter().chain(beyond.iter().take(missing)).map(|near| near.1).collect();
    found.sort_unstable();
    found
}

/// How much farther than its nearest a dot's neighbour may be, by the pattern.
fn longest_neighbor(spec: &LayoutSpec) -> f64 {
    let lattice = matches!(spec.pattern.kind, PatternKind::Square | PatternKind::Hexagonal);
    if lattice { LATTICE_NEIGHBORS } else { UNEVEN_NEIGHBORS }
}

/// The print passes that the dots of the pattern need, those that the lens does not see left out.
fn plan_passes(
    spec: &LayoutSpec,
    projector: &DotProjector<'_>,
    center_px: DVec2,
    places: &[DVec2],
) -> Vec<PrintPass> {
    if spec.print.hits == PrintPasses::Single {
        return vec![PrintPass::new(0.0, 0.0)];
    }
    let radius_mm = spec.optics.dome_radius_mm();
    let polar_and_own = |place: &DVec2| -> Option<(f64, f64)> {
        let even_px = center_px + *place;
        let pixel = projector.frame.raw_from_even(even_px).ok()?;
        let surface = spec.optics.trace(pixel).ok()?;
        let curve = projector.curve(even_px, surface.surface_mm);
        let own_rad = (0.5 * projector.dome_diameter_mm(&curve).ok()? / radius_mm).min(1.0).asin();
        Some((surface.normal.truncate().length().atan2(surface.normal.z), own_rad))
    };
    let (polar_rad, own_rad) = places
        .par_iter()
        .filter_map(polar_and_own)
        .reduce(|| (0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    let reach_rad = spec.print.wrap_limit_deg.to_radians() - own_rad;
    passes::split(polar_rad, reach_rad, spec.print.max_tilt_deg.to_radians())
}

fn places(spec: &LayoutSpec, edge: &Boundary) -> Result<(f64, Vec<DVec2>), LayoutError> {
    let section = &spec.pattern;
    let mut pattern = Pattern {
        kind: section.kind,
        pitch_px: 0.0,
        centred_on: section.centred_on,
        rotation_rad: section.rotation_deg.to_radians(),
        wanted: section.count.map(|count| count as usize),
    };
    let fault = |field: &'static str, value: String| {
        move |error: PatternError| match error {
            PatternError::TooMany { about, max } => LayoutError::new(
                field,
                value,
                format!("it leads to about {about:.2e} dots"),
                format!("a pattern of up to {max} dots"),
            ),
            PatternError::Empty => LayoutError::new(
                field,
                value,
                "no dot of the pattern fits inside its edge",
                "a finer or a wider pattern",
            ),
        }
    };
    match (section.pitch_px, section.count) {
        (Some(pitch_px), None) if pitch_px.is_finite() && pitch_px > 0.0 => {
            pattern.pitch_px = pitch_px;
            let places = pattern.places(edge).map_err(fault("pattern.pitch_px", pitch_px.to_string()))?;
            Ok((pitch_px, places))
        }
        (None, Some(count)) if count > 0 => {
            let wanted = count as usize;
            pattern.pitch_px =
                pattern.pitch_for_count(wanted, edge).map_err(fault("pattern.count", count.to_string()))?;
            let places = pattern.places(edge).map_err(fault("pattern.count", count.to_string()))?;
            Ok((pattern.pitch_px, places))
        }
        (pitch, count) => Err(LayoutError::new(
            "pattern.pitch_px",
            format!("{pitch:?} beside count {count:?}"),
            "how many dots there are is given once",
            "a positive pitch_px or a positive count",
        )),
    }
}

fn refuse_required(spec: &LayoutSpec, lost: &[LostDot], all: usize) -> Result<(), LayoutError> {
    for (rule, policy, field) in [
        (Rule::Unseen, spec.pattern.unseen, "pattern.unseen"),
        (Rule::Unprintable, spec.pattern.unprintable, "pattern.unprintable"),
    ] {
        let mut these = lost.iter().filter(|dot| dot.reason.rule() == rule);
        if policy == OnLost::Drop {
            continue;
        }
        let Some(first) = these.next() else { continue };
        let place = first.image_px.map_or_else(
            || format!("({:.3}, {:.3}) of the undistorted frame", first.even_px.x, first.even_px.y),
            |px| format!("({:.3}, {:.3})", px.x, px.y),
        );
        let others = these.count();
        return Err(LayoutError::new(
            field,
            "\"refuse\"",
            format!(
                "dot {} at pixel {place} is required, but {}; so are {others} more of {all} dots",
                first.id, first.reason
            ),
            format!("{}, or \"drop\" to lay out the rest without them", first.reason.cure()),
        ));
    }
    Ok(())
}

/// Where the pad wraps far it stretches. A film that a measured test print has corrected knows by how much.
fn warn_of_wrap(spec: &LayoutSpec, dots: &[Dot], warnings: &mut Vec<String>) {
    if spec.print.measured.is_some() {
        return;
    }
    let warn_rad = spec.print.wrap_warn_deg.to_radians();
    let beyond = dots.iter().filter(|dot| dot.wrap_rad > warn_rad);
    let furthest = beyond.clone().map(|dot| dot.wrap_rad).fold(0.0, f64::max);
    let count = beyond.count();
    if count > 0 {
        warnings.push(format!(
            "{count} dots lie beyond print.wrap_warn_deg = {}, the furthest at {:.1} degrees, where a pad stretches: print \
             the test print first, and correct the film with `domecast calibrate-print`",
            spec.print.wrap_warn_deg,
            furthest.to_degrees()
        ));
    }
}
