//! The rays of the image at a position of the platform, and what may stand in them.

use glam::{DAffine3, DVec2, DVec3};

use super::assembly::Body;
use super::view::{DIRECTIONS, SightLine, sight_line, sight_lines};
use super::{Assembly, Measures, PartError, purchased};
use crate::layout::Dot;
use crate::spec::Design;
use domecast_mesh::{Chord, MeshError, RayTarget};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Points round a dot's rim that are traced beside its centre.
const DOT_RIM: u32 = 8;
/// Pixels round the mask's rim.
const MASK_RIM: u32 = 240;
/// Pixels of the grid across the mask's diameter.
const GRID: u32 = 49;
/// Stand-ins are meshed no finer than this, mm.
pub(super) const CHORD_MM: f64 = 0.03;

/// What a ray of the image shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKind {
    /// The centre or the rim of a black dot.
    Dot,
    /// The rim of a white marker.
    Marker,
    /// The rim of the dome's base.
    DomeRim,
    /// A pixel of the mask's rim that shows the dome.
    MaskRim,
    /// A pixel of a grid over the mask that shows the dome.
    Mask,
}

impl RayKind {
    pub(super) const ALL: [Self; 5] = [Self::Dot, Self::Marker, Self::DomeRim, Self::MaskRim, Self::Mask];

    /// In words, for messages.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Dot => "dots",
            Self::Marker => "white markers",
            Self::DomeRim => "the dome's rim",
            Self::MaskRim => "the mask's rim",
            Self::Mask => "the mask's area",
        }
    }
}

/// A ray of the image, platform's frame.
pub(super) struct ImageRay {
    pub kind: RayKind,
    pub line: SightLine,
}

/// Something that may stand in a ray.
pub(super) struct Blocker {
    pub name: String,
    /// In the sensor frame if it moves with the platform, else in the rest frame.
    pub moves: bool,
    pub target: RayTarget,
}

/// All rays at one pose, in the platform's frame, and how many of each kind there are not.
pub(super) struct ImageRays {
    pub list: Vec<ImageRay>,
    pub without: [usize; 5],
}

/// A part's name without its number.
pub(super) fn group_of(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' ')
}

/// Both ends of a ray's way in air, in the frame of what may stand in it.
pub(super) fn ends(blocker: &Blocker, line: &SightLine, rest_from_platform: &DAffine3) -> (DVec3, DVec3) {
    // The sheet's seat is in the plane in which the rays end: they stop a hair below.
    let (from, to) = (line.pupil_mm, line.pupil_mm.lerp(line.sheet_mm, 1.0 - 1e-6));
    if blocker.moves {
        return (from, to);
    }
    (rest_from_platform.transform_point3(from), rest_from_platform.transform_point3(to))
}

/// Every ray of the image at a pose, platform's frame.
///
/// # Errors
/// Why the pose is impossible, in words.
pub(super) fn rays(design: &Design, m: &Measures, pose: &Rigid, dots: &[Dot]) -> Result<ImageRays, String> {
    let optics = design.optics().at_pose(pose).map_err(|error| error.to_string())?;
    let mut rays = ImageRays { list: Vec::new(), without: [0; 5] };
    let mut push = |kind: RayKind, line: Option<SightLine>| match line {
        Some(line) => rays.list.push(ImageRay { kind, line }),
        None => rays.without[kind as usize] += 1,
    };
    let at = |point: DVec3| sight_line(&optics, optics.project(point).ok()?);
    for dot in dots {
        push(RayKind::Dot, at(dot.surface_mm));
        let across = dot.normal.any_orthonormal_pair();
        for k in 0..DOT_RIM {
            let way = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(DOT_RIM));
            let rim = dot.surface_mm + 0.5 * dot.diameter_mm * (across.0 * way.x + across.1 * way.y);
            let rim = m.dome.onto(rim);
            if rim.z >= 0.0 {
                push(RayKind::Dot, at(rim));
            }
        }
    }
    let all = DIRECTIONS as usize;
    for &center in &m.markers_mm {
        let lines = sight_lines(&optics, center, m.marker_radius_mm);
        rays.without[RayKind::Marker as usize] += all - lines.len().min(all);
        rays.list.extend(lines.into_iter().map(|line| ImageRay { kind: RayKind::Marker, line }));
    }
    let rim = sight_lines(&optics, DVec2::ZERO, m.dome.rim_radius_mm());
    rays.without[RayKind::DomeRim as usize] += all - rim.len().min(all);
    rays.list.extend(rim.into_iter().map(|line| ImageRay { kind: RayKind::DomeRim, line }));
    mask_rays(design, &optics, &mut rays);
    Ok(rays)
}

/// Pixels of the mask that show the dome: its rim, and a grid.
fn mask_rays(design: &Design, optics: &SensorOptics, rays: &mut ImageRays) {
    let radius = design.sections().runtime.mask_radius_px;
    let [[fx, ..], [_, fy, _], _] = design.undistorted_matrix();
    let spec = optics.lens().spec();
    let (right, bottom) = (f64::from(spec.width) - 0.5, f64::from(spec.height) - 0.5);
    let mut push = |kind: RayKind, from_center_px: DVec2| {
        let ray = DVec3::new(from_center_px.x / fx, from_center_px.y / fy, 1.0).normalize();
        let in_frame = |p: &DVec2| p.x >= -0.5 && p.y >= -0.5 && p.x <= right && p.y <= bottom;
        let pixel = optics.lens().project(ray).ok().filter(in_frame);
        // What shows the dome's side of the sheet, but not the dome, is not part of the image.
        match pixel.filter(|&p| optics.trace(p).is_ok()).and_then(|p| sight_line(optics, p)) {
            Some(line) => rays.list.push(ImageRay { kind, line }),
            None => rays.without[kind as usize] += 1,
        }
    };
    for k in 0..MASK_RIM {
        let way = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(MASK_RIM));
        push(RayKind::MaskRim, radius * way);
    }
    let half = 0.5 * f64::from(GRID - 1);
    for (row, column) in (0..GRID).flat_map(|row| (0..GRID).map(move |column| (row, column))) {
        let at = DVec2::new(f64::from(column) - half, f64::from(row) - half) / half;
        if at.length() <= 1.0 {
            push(RayKind::Mask, radius * at);
        }
    }
}

/// Everything but what the rays go into, and the springs, which change with the pose.
pub(super) fn blockers(m: &Measures, assembly: &Assembly) -> Result<Vec<Blocker>, PartError> {
    let mut list: Vec<Blocker> = assembly
        .items
        .iter()
        .filter(|item| item.body != Body::Spring)
        .filter(|item| !matches!(item.name.as_str(), "acrylic_sheet" | "dome" | "camera"))
        .map(|item| Blocker {
            name: item.name.clone(),
            moves: item.body == Body::Moving,
            target: RayTarget::new(&item.mesh),
        })
        .collect();
    let failed = |part: &str, error: MeshError| PartError::Mesh { part: part.to_owned(), error };
    let chord = Chord::new(CHORD_MM.max(m.chord.tolerance_mm())).map_err(|e| failed("camera", e))?;
    if let Some(housing) = purchased::camera_housing(m) {
        let solid = housing.solid(chord).map_err(|error| failed("camera", error))?;
        let target = RayTarget::new(&solid.to_mesh());
        list.push(Blocker { name: "camera".into(), moves: false, target });
    }
    for screw in purchased::screw_heads(m) {
        let mesh = screw.shape.triangulate(&screw.name, chord).map_err(|error| failed(&screw.name, error))?;
        let target = RayTarget::new(&mesh.transformed(&screw.part_from_shape));
        list.push(Blocker { name: screw.name, moves: false, target });
    }
    Ok(list)
}

/// What the springs sweep at a pose, rest frame.
pub(super) fn springs(m: &Measures, pose: &Rigid) -> Result<Vec<Blocker>, PartError> {
    let failed = |error| PartError::Mesh { part: "spring".into(), error };
    let chord = Chord::new(CHORD_MM.max(m.chord.tolerance_mm())).map_err(failed)?;
    (0..m.spring_axes_mm.len())
        .map(|i| {
            let (tube, _) = purchased::spring_tube(m, i, pose, chord).map_err(failed)?;
            Ok(Blocker { name: format!("spring {i}"), moves: false, target: RayTarget::new(&tube) })
        })
        .collect()
}
