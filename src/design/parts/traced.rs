//! Rays of the image, traced from the camera's pupil through the air to the sheet's underside, against every part of
//! the assembly as it is meshed: at rest and under each load that the design claims.
//!
//! A ray of the image is the chief ray of a pixel. In the air it is straight; where it enters the sheet it is bent,
//! and from there on it runs in sheet and silicone, where no other part is. Its direction in air is the one that
//! refraction asks for: that of the pixel at which the point behind the sheet appears.

use std::fmt::Write as _;

use glam::DAffine3;
use rayon::prelude::*;

use super::assembly::affine;
use super::image_rays::{Blocker, ImageRay, ImageRays, RayKind, blockers, ends, group_of, rays, springs};
use super::remedy::Remedy;
use super::view::SightLine;
use super::{Assembly, Measures, PartError, Pose};
use crate::layout::Dot;
use crate::spec::Design;

/// Rays of one kind at one position of the platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RayCount {
    /// What they show.
    pub kind: RayKind,
    /// How many were traced from the pupil to the sheet.
    pub traced: usize,
    /// How many of those end on a part.
    pub blocked: usize,
    /// Points and pixels that have no such ray: beyond the lens or the frame, or past the dome.
    pub without_ray: usize,
}

/// What the camera sees at one position of the platform.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseSight {
    /// The position: "at rest", "under the load ..".
    pub pose: String,
    /// The rays by kind.
    pub counts: Vec<RayCount>,
}

/// Traces every ray of the image at rest and under each claimed load.
///
/// # Errors
/// A [`PartError::Blocked`] for each kind of part that stands in a ray; [`PartError::View`] for a position that the
/// optics cannot have.
pub fn trace_sight(
    design: &Design,
    m: &Measures,
    assembly: &Assembly,
    dots: &[Dot],
) -> Result<Vec<PoseSight>, PartError> {
    let fixed = blockers(m, assembly)?;
    let poses: Vec<&Pose> = m.poses.iter().filter(|pose| pose.is_claimed).collect();
    let seen = poses
        .par_iter()
        .map(|pose| {
            let rays =
                rays(design, m, &pose.rest_from_platform, dots).map_err(|problem| PartError::View {
                    problem: format!("{}: {problem}", pose.name),
                    field: "camera.position_mm".into(),
                })?;
            let springs = springs(m, &pose.rest_from_platform)?;
            Ok((*pose, rays, springs))
        })
        .collect::<Result<Vec<_>, PartError>>()?;
    let traced: Vec<(PoseSight, Vec<Stopped>)> =
        seen.par_iter().map(|(pose, rays, springs)| trace(pose, rays, fixed.iter().chain(springs))).collect();
    let mut faults = Vec::new();
    let mut groups: Vec<String> = Vec::new();
    for stopped in traced.iter().flat_map(|(_, stopped)| stopped) {
        let group = group_of(&stopped.part).to_owned();
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for group in groups {
        // The position at which it blocks most is the one to tell of.
        let of = |stopped: &[Stopped]| stopped.iter().filter(|s| group_of(&s.part) == group).count();
        let Some((index, (sight, stopped))) =
            traced.iter().enumerate().rev().max_by_key(|(_, (_, stopped))| of(stopped))
        else {
            continue;
        };
        let mine: Vec<&Stopped> = stopped.iter().filter(|s| group_of(&s.part) == group).collect();
        let Some(first) = mine.iter().min_by(|a, b| a.angle_rad.total_cmp(&b.angle_rad)) else { continue };
        let cure = Remedy { m, design, group: &group, part: &first.part }.find(&seen, &fixed);
        faults.push(PartError::Blocked {
            part: first.part.clone(),
            when: seen.get(index).map_or_else(String::new, |(pose, ..)| pose.name.clone()),
            angle_deg: first.angle_rad.to_degrees(),
            shares: shares(&mine, sight),
            cure,
        });
    }
    PartError::all(faults)?;
    Ok(traced.into_iter().map(|(sight, _)| sight).collect())
}

fn shares(mine: &[&Stopped], sight: &PoseSight) -> String {
    let mut text = String::new();
    for count in &sight.counts {
        let blocked = mine.iter().filter(|stopped| stopped.kind == count.kind).count();
        if blocked == 0 {
            continue;
        }
        let percent = 100.0 * blocked as f64 / count.traced.max(1) as f64;
        let gap = if text.is_empty() { "" } else { ", " };
        let _ =
            write!(text, "{gap}{} {percent:.1} % ({blocked} of {} rays)", count.kind.as_str(), count.traced);
    }
    text
}

/// A ray that ends on a part.
struct Stopped {
    kind: RayKind,
    part: String,
    angle_rad: f64,
}

fn trace<'a>(
    pose: &Pose,
    rays: &ImageRays,
    blockers: impl Iterator<Item = &'a Blocker> + Clone,
) -> (PoseSight, Vec<Stopped>) {
    let rest_from_platform = affine(&pose.rest_from_platform);
    let mut stopped = Vec::new();
    let mut counts: Vec<RayCount> = RayKind::ALL
        .into_iter()
        .zip(rays.without)
        .map(|(kind, without_ray)| RayCount { kind, traced: 0, blocked: 0, without_ray })
        .collect();
    for ImageRay { kind, line } in &rays.list {
        let first = blockers
            .clone()
            .filter_map(|b| Some((b, hit(b, line, &rest_from_platform)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some(count) = counts.get_mut(*kind as usize) {
            count.traced += 1;
            count.blocked += usize::from(first.is_some());
        }
        if let Some((blocker, _)) = first {
            stopped.push(Stopped { kind: *kind, part: blocker.name.clone(), angle_rad: line.angle_rad });
        }
    }
    (PoseSight { pose: pose.name.clone(), counts }, stopped)
}

/// How far along its way to the sheet a ray meets something, as a share.
fn hit(blocker: &Blocker, line: &SightLine, rest_from_platform: &DAffine3) -> Option<f64> {
    let (from, to) = ends(blocker, line, rest_from_platform);
    blocker.target.first_hit(from, to).map(|(share, _)| share)
}
