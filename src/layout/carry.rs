//! The steps from pattern to dots, in order.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::boundary::Boundary;
use super::dot::{Carrier, Dot, DotSize, plate_outline};
use super::frame::EvenFrame;
use super::lost::{LostDot, Reason, Rule, Zone};
use super::neighbors::neighbors;
use super::outline::Outline;
use super::pattern::{Pattern, PatternError};
use super::spec::LayoutSpec;
use super::zones::ImageZone;
use super::{Hit, Layout, LayoutError, gaps, hits, region, zones};
use crate::design::sections::{Hits, OnLost, PatternCentre, PatternKind};
use crate::optics::Limit;

/// Delaunay edges up to this multiple of the nearest distance count as neighbours: below the diagonal of a
/// square lattice (1.414), well above its side.
const LATTICE_NEIGHBORS: f64 = 1.2;
/// The same for patterns whose spacing varies.
const UNEVEN_NEIGHBORS: f64 = 1.6;

pub(super) fn lay_out(spec: &LayoutSpec) -> Result<Layout, LayoutError> {
    let size = spec.size()?;
    let transfer = spec.transfer()?;
    let frame = EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
    let carrier = Carrier {
        optics: &spec.optics,
        frame,
        transfer: &transfer,
        size,
        outline_tolerance_mm: spec.print.outline_tolerance_mm,
    };
    let center_px = center(spec, &frame)?;
    let mut warnings = Vec::new();
    let edge = edge(spec, &carrier, center_px, &mut warnings)?;
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
    let hits = plan_hits(spec, &carrier, center_px, &places);
    let zones = zones::image_zones(spec);
    let checked: Vec<Result<Dot, LostDot>> =
        places.par_iter().map(|place| check_dot(spec, &carrier, &hits, &zones, center_px + *place)).collect();
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
    let lattice = matches!(spec.pattern.kind, PatternKind::Square | PatternKind::Hexagonal);
    let even: Vec<DVec2> = dots.iter().map(|dot| dot.even_px).collect();
    let around = neighbors(&even, if lattice { LATTICE_NEIGHBORS } else { UNEVEN_NEIGHBORS });
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
    if !lost.is_empty() {
        warnings.push(format!(
            "{} of {} dots of the pattern are left out",
            lost.len(),
            dots.len() + lost.len()
        ));
    }
    Ok(Layout { dots, lost, hits, pitch_px, size, center_px, edge, transfer, warnings })
}

fn center(spec: &LayoutSpec, frame: &EvenFrame<'_>) -> Result<DVec2, LayoutError> {
    let radius_mm = spec.optics.dome_radius_mm();
    let raw = match spec.pattern.centre {
        PatternCentre::Pole => spec.optics.project(DVec3::new(0.0, 0.0, radius_mm)),
        PatternCentre::PrincipalPoint => Ok(spec.optics.lens().project(DVec3::Z).unwrap_or_default()),
    };
    let lost = |limit: Limit| {
        LayoutError::new(
            "pattern.centre",
            "the dome's pole",
            format!("the lens cannot see it ({limit})"),
            "a camera that looks at the dome",
        )
    };
    let raw = raw.map_err(lost)?;
    frame.even_from_raw(raw).map_err(|limit| lost(limit.into()))
}

/// The hits that the dots of the pattern need, those left aside that the lens does not see.
fn plan_hits(spec: &LayoutSpec, carrier: &Carrier<'_>, center_px: DVec2, places: &[DVec2]) -> Vec<Hit> {
    if spec.print.hits == Hits::Single {
        return vec![Hit::new(0.0, 0.0)];
    }
    let radius_mm = spec.optics.dome_radius_mm();
    let polar_and_own = |place: &DVec2| -> Option<(f64, f64)> {
        let even_px = center_px + *place;
        let pixel = carrier.frame.raw_from_even(even_px).ok()?;
        let surface = spec.optics.trace(pixel).ok()?;
        let curve = carrier.curve(even_px, surface.surface_mm);
        let own_rad = (0.5 * carrier.dome_diameter_mm(&curve).ok()? / radius_mm).min(1.0).asin();
        Some((surface.normal.truncate().length().atan2(surface.normal.z), own_rad))
    };
    let (polar_rad, own_rad) = places
        .par_iter()
        .filter_map(polar_and_own)
        .reduce(|| (0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    let reach_rad = spec.print.wrap_limit_deg.to_radians() - own_rad;
    hits::split(polar_rad, reach_rad, spec.print.max_tilt_deg.to_radians())
}

/// Where the dots' centres may lie: the pattern's edge, drawn in so that no dot is cut.
fn edge(
    spec: &LayoutSpec,
    carrier: &Carrier<'_>,
    center_px: DVec2,
    warnings: &mut Vec<String>,
) -> Result<Boundary, LayoutError> {
    let pattern = &spec.pattern;
    if pattern.polar_angle_deg.is_none() && pattern.image_radius_px.is_none() {
        return Err(LayoutError::new(
            "pattern.polar_angle_deg",
            "missing",
            "the pattern has no edge",
            "polar_angle_deg, image_radius_px, or both",
        ));
    }
    let radius_mm = spec.optics.dome_radius_mm();
    let mut edge: Option<Boundary> = None;
    if let Some(polar_deg) = pattern.polar_angle_deg {
        // A dot of equal size on the dome reaches over its centre by its own angle, one of equal apparent
        // size by its radius in the image.
        let (own_rad, inset_px) = match carrier.size {
            DotSize::OnDome(mm) => ((0.5 * mm / radius_mm).asin(), 0.0),
            DotSize::Apparent(px) => (0.0, 0.5 * px),
        };
        let polar_rad = (polar_deg.to_radians() - own_rad).clamp(0.0, FRAC_PI_2);
        let parallel =
            region::parallel(&spec.optics, &carrier.frame, center_px, polar_rad).map_err(|limit| {
                LayoutError::new(
                    "pattern.polar_angle_deg",
                    polar_deg,
                    format!("this parallel of the dome has no image around the pattern's centre ({limit})"),
                    "a camera that looks at the dome",
                )
            })?;
        if let Some((reached_rad, limit)) = parallel.cut {
            let reached = format!("{:.3} deg", (reached_rad + own_rad).to_degrees());
            if pattern.unseen == OnLost::Refuse {
                return Err(LayoutError::new(
                    "pattern.polar_angle_deg",
                    polar_deg,
                    format!("the lens sees the dome only to {reached} ({limit})"),
                    format!("up to {reached}, or pattern.unseen = \"drop\""),
                ));
            }
            warnings.push(format!(
                "pattern.polar_angle_deg is {polar_deg}, but the lens sees the dome only to {reached} ({limit})"
            ));
        }
        edge = Some(parallel.boundary.inset(inset_px));
    }
    if let Some(radius_px) = pattern.image_radius_px {
        let inset = |direction: DVec2| match carrier.size {
            DotSize::Apparent(px) => 0.5 * px,
            DotSize::OnDome(_) => apparent_radius_px(carrier, center_px + direction * radius_px),
        };
        let inner = edge.take();
        edge = Some(Boundary::new(|direction| {
            let radius = radius_px - inset(direction);
            inner.as_ref().map_or(radius, |inner| radius.min(inner.radius_px(direction)))
        }));
    }
    edge.filter(|edge| edge.largest_px() > 0.0 || pattern.kind != PatternKind::Fill).ok_or_else(|| {
        LayoutError::new("pattern", "too narrow", "no dot fits inside the pattern's edge", "a wider pattern")
    })
}

/// How far a dot of equal size on the dome reaches in the even frame, px; zero where it is not seen, since
/// then it is lost for that reason.
fn apparent_radius_px(carrier: &Carrier<'_>, even_px: DVec2) -> f64 {
    let reach = || -> Result<f64, Limit> {
        let point = carrier.optics.trace(carrier.frame.raw_from_even(even_px)?)?;
        let curve = carrier.curve(even_px, point.surface_mm);
        let outline = carrier.image_outline(&curve).map_err(|_| Limit::Unreachable)?;
        let mut furthest: f64 = 0.0;
        for corner in outline.polygon(4) {
            furthest = furthest.max(carrier.frame.even_from_raw(corner)?.distance(even_px));
        }
        Ok(furthest)
    };
    reach().unwrap_or(0.0)
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
            PatternError::TooMany { about, most } => LayoutError::new(
                field,
                value,
                format!("it leads to about {about:.2e} dots"),
                format!("a pattern of up to {most} dots"),
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

fn check_dot(
    spec: &LayoutSpec,
    carrier: &Carrier<'_>,
    hits: &[Hit],
    zones: &[ImageZone],
    even_px: DVec2,
) -> Result<Dot, LostDot> {
    let image_px = carrier.frame.raw_from_even(even_px);
    let lose = |reason: Reason| LostDot { id: 0, even_px, image_px: image_px.ok(), reason };
    let image_px = image_px.map_err(|limit| lose(Reason::Unseen(limit.into())))?;
    let surface = spec.optics.trace(image_px).map_err(|limit| lose(Reason::Unseen(limit)))?;
    let curve = carrier.curve(even_px, surface.surface_mm);
    let image_outline = carrier.image_outline(&curve).map_err(lose)?;
    let diameter_mm = carrier.dome_diameter_mm(&curve).map_err(lose)?;
    check_seen(spec, &image_outline).map_err(lose)?;
    zones::check(zones, &image_outline).map_err(lose)?;
    let (hit, wrap_rad) = nearest_hit(hits, surface.normal);
    let own_rad = (0.5 * diameter_mm / spec.optics.dome_radius_mm()).min(1.0).asin();
    let reach_rad = wrap_rad + own_rad;
    let limit_rad = spec.print.wrap_limit_deg.to_radians();
    let polar_rad = surface.normal.truncate().length().atan2(surface.normal.z);
    let keep_out = &spec.pattern.keep_out;
    if polar_rad - own_rad < keep_out.pole_deg.to_radians() && keep_out.pole_deg > 0.0 {
        return Err(lose(Reason::KeepOut(Zone::Pole)));
    }
    if polar_rad + own_rad > (90.0 - keep_out.rim_deg).to_radians() && keep_out.rim_deg > 0.0 {
        return Err(lose(Reason::KeepOut(Zone::Rim)));
    }
    if reach_rad > limit_rad {
        return Err(lose(Reason::BeyondWrap { wrap_rad: reach_rad, limit_rad }));
    }
    let hit_from_sensor = hits[hit].hit_from_sensor;
    let plate_mm = carrier
        .transfer
        .plate_from_dome(hit_from_sensor * surface.surface_mm)
        .map_err(|limit| lose(Reason::BeyondTransfer(limit)))?;
    let plate_outline =
        plate_outline(&curve, carrier.transfer, hit_from_sensor, carrier.outline_tolerance_mm)
            .map_err(lose)?;
    let (width_mm, _) = plate_outline.widths();
    if width_mm < spec.print.min_dot_mm {
        return Err(lose(Reason::TooSmall { width_mm, least_mm: spec.print.min_dot_mm }));
    }
    Ok(Dot {
        id: 0,
        image_px,
        even_px,
        surface_mm: surface.surface_mm,
        normal: surface.normal,
        field_angle_rad: surface.field_angle_rad,
        hit,
        wrap_rad,
        plate_mm,
        diameter_mm,
        image_outline,
        plate_outline,
        neighbors: Vec::new(),
    })
}

fn nearest_hit(hits: &[Hit], normal: DVec3) -> (usize, f64) {
    let mut best = (0, f64::INFINITY);
    for (index, hit) in hits.iter().enumerate() {
        let local = hit.hit_from_sensor * normal;
        let wrap_rad = local.truncate().length().atan2(local.z);
        if wrap_rad < best.1 {
            best = (index, wrap_rad);
        }
    }
    best
}

/// Whether the whole dot lies on the raster and inside the mask.
fn check_seen(spec: &LayoutSpec, outline: &Outline) -> Result<(), Reason> {
    let lens = spec.optics.lens();
    let (low, high) = outline.bounds();
    let size = DVec2::new(f64::from(lens.spec().width), f64::from(lens.spec().height));
    if low.min_element() < -0.5 || (high - size).max_element() > -0.5 {
        return Err(Reason::OutsideImage);
    }
    if let Some(mask) = &spec.mask {
        for corner in outline.polygon(2) {
            let inside = spec
                .undistorted
                .from_raw(lens, corner)
                .is_ok_and(|place| place.distance(mask.center_px) <= mask.radius_px);
            if !inside {
                return Err(Reason::OutsideMask);
            }
        }
    }
    Ok(())
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
            "a smaller pattern, or \"drop\" to lay out the rest without them",
        ));
    }
    Ok(())
}

fn warn_of_wrap(spec: &LayoutSpec, dots: &[Dot], warnings: &mut Vec<String>) {
    let warn_rad = spec.print.wrap_warn_deg.to_radians();
    let beyond = dots.iter().filter(|dot| dot.wrap_rad > warn_rad);
    let furthest = beyond.clone().map(|dot| dot.wrap_rad).fold(0.0, f64::max);
    let count = beyond.count();
    if count > 0 {
        warnings.push(format!(
            "{count} dots lie beyond print.wrap_warn_deg = {}, the furthest at {:.1} deg: expect them distorted",
            spec.print.wrap_warn_deg,
            furthest.to_degrees()
        ));
    }
}
