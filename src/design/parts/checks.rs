//! Does the assembled sensor work? Interference at every position of the
//! springs, the camera's clearance and view, stray light, the envelope. What
//! concerns one part alone is in [`super::process`], [`super::walls`] and
//! [`super::undercut`].

use std::sync::OnceLock;

use glam::{DAffine3, DVec2, DVec3};
use rayon::prelude::*;

use super::assembly::{Body, affine, placed_mesh};
use super::bearing::behind_lip_mm;
use super::error::infeasible;
use super::measures::Measures;
use super::view::sight_lines;
use super::{Assembly, Part, PartError, Pose, light_ways, process, purchased, undercut};
use crate::spec::Cure;
use domecast_mesh::{BoundingBox, Chord, MeshError, Piece, RayTarget, Solid, TriMesh};
use domecast_optics::numeric::Rigid;

/// Bodies may share this much before it is called interference, mm^3: faces
/// that bear on each other are cut from the same numbers and may overlap by
/// rounding.
const TOUCHING_MM3: f64 = 1e-4;
/// So does a layer this thin, as a part of the way from the origin, whatever its area: both are coordinates' rounding.
const ROUNDING: f64 = 1e-6;
/// Stand-ins in these checks are meshed no finer than this, mm.
const CHORD_MM: f64 = 0.03;

/// Runs every check of the assembled sensor.
///
/// # Errors
/// The failures, the first of each check: which parts, where, value, limit, which design field.
pub fn check_assembly(m: &Measures, parts: &[Part], assembly: &Assembly) -> Result<(), PartError> {
    let checks =
        [process::check(m, parts), undercut::check(m, parts), envelope(m, assembly), light_ways::check(m)];
    let mut faults: Vec<PartError> = checks.into_iter().filter_map(Result::err).collect();
    faults.extend(assembled(m, assembly).err());
    PartError::all(faults)
}

/// What only the assembly as a whole tells, at every position of the springs.
fn assembled(m: &Measures, assembly: &Assembly) -> Result<(), PartError> {
    let chord = Chord::new(CHORD_MM.max(m.chord.tolerance_mm())).map_err(|e| mesh_error("assembly", e))?;
    let scene = Scene::of(m, assembly, chord)?;
    scene.within_bodies()?;
    m.poses
        .par_iter()
        .map(|Pose { name, rest_from_platform: pose, .. }| {
            scene.between_bodies(m, name, pose, chord)?;
            camera_gap(m, name, pose)?;
            scene.view(m, name, pose)?;
            scene.stray_light(m, name, pose)
        })
        .collect::<Vec<_>>()
        .into_iter()
        .collect()
}

fn mesh_error(part: &str, error: MeshError) -> PartError {
    PartError::Mesh { part: part.to_owned(), error }
}

/// The design field that moves an item.
fn field_of(name: &str) -> &'static str {
    match name.split(' ').next().unwrap_or(name) {
        "upper_platform" => "platforms.upper",
        "lower_platform" => "platforms.lower",
        "acrylic_sheet" => "sheet",
        "camera" => "camera.position_mm",
        "dome" => "dome.radius_mm",
        "spring" => "springs.places",
        "LED" => "leds.center_radius_mm",
        _ => "magnets",
    }
}

/// The whole stack at rest, the membrane included, fits its envelope.
fn envelope(m: &Measures, assembly: &Assembly) -> Result<(), PartError> {
    let membrane = purchased::membrane(m);
    let membrane = membrane.shape.triangulate("membrane", m.chord).map_err(|e| mesh_error("membrane", e))?;
    let all = assembly.items.iter().filter_map(|item| item.mesh.bounds()).chain(membrane.bounds());
    all.reduce(|a, b| a.union(&b)).map_or(Ok(()), |bounds| fits_envelope(m, &bounds))
}

/// The lights with their boards fit the envelope beside the block, as [`envelope`] finds it, before any part is made.
pub(super) fn lights_fit_envelope(m: &Measures) -> Result<(), PartError> {
    let block = (0.5 * m.outer_mm).extend(0.0);
    let mut bounds =
        BoundingBox { min_mm: m.seat_z_mm() * DVec3::Z - block, max_mm: m.seat_z_mm() * DVec3::Z + block };
    for piece in (0..m.leds.list.len()).flat_map(|i| purchased::led(m, i)) {
        bounds = placed_mesh(m, &piece)?.bounds().map_or(bounds, |of| bounds.union(&of));
    }
    fits_envelope(m, &bounds)
}

fn fits_envelope(m: &Measures, bounds: &BoundingBox) -> Result<(), PartError> {
    let size = bounds.size_mm();
    // Rounding to f32 may add a little to a length that fits exactly.
    let slack = 1e-6 * size.max_element();
    for (axis, value, limit) in
        [("x", size.x, m.envelope_mm.x), ("y", size.y, m.envelope_mm.y), ("z", size.z, m.envelope_mm.z)]
    {
        if value > limit + slack {
            let place = format!("length of the whole sensor along {axis}, at most the envelope's");
            return Err(infeasible("assembly", place, value, limit, "envelope.size_mm"));
        }
    }
    Ok(())
}

/// The camera's front keeps its gap to the sheet.
fn camera_gap(m: &Measures, when: &str, pose: &Rigid) -> Result<(), PartError> {
    let platform_from_rest = pose.inverse();
    let radius = 0.5 * m.camera_body.diameter_mm;
    let gap = (0..32)
        .map(|k| {
            let rim = radius * DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 32.0);
            let front = m.sensor_from_camera.transform_point3(rim.extend(m.camera_body.front_from_pupil_mm));
            m.seat_z_mm() - platform_from_rest.point(front).z
        })
        .fold(f64::INFINITY, f64::min);
    let limit = m.camera_body.min_sheet_gap_mm;
    // Where the gap itself ends a load or the travel it is met to the search's resolution.
    if gap < limit * (1.0 - 1e-3) {
        let place = format!("gap between the camera's front and the sheet {when}");
        return Err(infeasible("camera", place, gap, limit, "camera_body.min_sheet_gap_mm"));
    }
    Ok(())
}

struct Thing {
    name: String,
    solid: Solid,
    bounds: BoundingBox,
    /// Its surface, for a first look; made when first looked at.
    surface: OnceLock<RayTarget>,
}

impl Thing {
    fn new(name: &str, solid: Solid) -> Option<Self> {
        let bounds = solid.to_mesh().bounds()?;
        Some(Self { name: name.to_owned(), solid, bounds, surface: OnceLock::new() })
    }

    fn surface(&self) -> &RayTarget {
        self.surface.get_or_init(|| RayTarget::new(&self.solid.to_mesh()))
    }

    /// Whether a spring surely shares no point with this: no triangle comes into a box round any stretch of it,
    /// and it does not begin within.
    fn is_clear_of(&self, spring: &Spring, thing_from_rest: &DAffine3) -> bool {
        let bounds = spring.bounds.transformed(thing_from_rest);
        if bounds.is_apart_from(&self.bounds) {
            return true;
        }
        let near = |stretch: &BoundingBox| self.surface().comes_near(&stretch.transformed(thing_from_rest));
        !spring.stretches.iter().any(near)
            && !self.surface().holds(thing_from_rest.transform_point3(spring.start_mm))
    }

    /// Refuses a shared volume; says where its middle is. Both in their own frames.
    fn apart_from(
        &self,
        other: &Self,
        [rest_from_self, rest_from_other]: [&DAffine3; 2],
        when: &str,
    ) -> Result<(), PartError> {
        let other_from_self = rest_from_other.inverse() * *rest_from_self;
        // Boxes first, then surfaces: most things are far apart, and moving and cutting a solid costs.
        if self.bounds.transformed(&other_from_self).is_apart_from(&other.bounds)
            || !other.surface().may_meet(self.surface(), &other_from_self)
        {
            return Ok(());
        }
        let failed = |error| mesh_error(&self.name, error);
        let moved = self.solid.moved(&other_from_self).map_err(failed)?;
        let Some(shared) = moved.intersection(&other.solid).map_err(failed)? else { return Ok(()) };
        let volume = shared.volume_mm3();
        if volume <= TOUCHING_MM3 {
            return Ok(());
        }
        let bounds = shared.to_mesh().bounds().unwrap_or(other.bounds);
        let farthest = bounds.min_mm.abs().max(bounds.max_mm.abs()).max_element();
        if bounds.size_mm().min_element() <= ROUNDING * farthest {
            return Ok(());
        }
        let middle = rest_from_other.transform_point3(0.5 * (bounds.min_mm + bounds.max_mm));
        let place = format!(
            "shares {volume:.4} mm3 with {} {when}, about ({:.2}, {:.2}, {:.2}); depth",
            other.name, middle.x, middle.y, middle.z
        );
        let depth = bounds.size_mm().min_element();
        let field = format!("{} or {}", field_of(&self.name), field_of(&other.name));
        Err(PartError::Infeasible { part: self.name.clone(), place, value_mm: depth, limit_mm: 0.0, field })
    }
}

/// A spring at a position of the platform, in the frame at rest.
struct Spring {
    name: String,
    tube: TriMesh,
    bounds: BoundingBox,
    /// Boxes round it, ring to ring.
    stretches: Vec<BoundingBox>,
    /// A point within it, at its lower end.
    start_mm: DVec3,
    /// The tube as a solid; made when a box comes near.
    thing: OnceLock<Thing>,
}

impl Spring {
    fn new(m: &Measures, i: usize, rest_from_platform: &Rigid, chord: Chord) -> Result<Self, MeshError> {
        let (tube, around) = purchased::spring_tube(m, i, rest_from_platform, chord)?;
        let rings: Vec<BoundingBox> = tube.vertices_mm.chunks(around).filter_map(BoundingBox::of).collect();
        let stretches: Vec<BoundingBox> = rings.windows(2).map(|two| two[0].union(&two[1])).collect();
        let first = tube.vertices_mm.get(..around).unwrap_or_default();
        let start_mm = first.iter().sum::<DVec3>() / around.max(1) as f64;
        let name = format!("spring {i}");
        let bounds = rings
            .into_iter()
            .reduce(|a, b| a.union(&b))
            .ok_or(MeshError::Empty { operation: "a spring's tube" })?;
        Ok(Self { name, tube, bounds, stretches, start_mm, thing: OnceLock::new() })
    }

    fn thing(&self) -> Result<&Thing, PartError> {
        if let Some(thing) = self.thing.get() {
            return Ok(thing);
        }
        let solid = Solid::from_mesh(&self.tube).map_err(|e| mesh_error(&self.name, e))?;
        let thing = Thing { name: self.name.clone(), solid, bounds: self.bounds, surface: OnceLock::new() };
        Ok(self.thing.get_or_init(|| thing))
    }
}

struct Scene {
    fixed: Vec<Thing>,
    moving: Vec<Thing>,
    /// The platforms, which could stand in a ray; the upper one in its own frame.
    upper: RayTarget,
    lower: RayTarget,
}

impl Scene {
    fn of(m: &Measures, assembly: &Assembly, chord: Chord) -> Result<Self, PartError> {
        let coarse = |piece: &Piece| piece.solid(chord).map_err(|e| mesh_error(&piece.name, e));
        let nothing = || RayTarget::new(&TriMesh::default());
        let mut scene = Self { fixed: Vec::new(), moving: Vec::new(), upper: nothing(), lower: nothing() };
        for item in &assembly.items {
            let solid = match item.name.as_str() {
                "dome" => coarse(&purchased::dome(m))?,
                "camera" => purchased::camera(m).solid(chord).map_err(|e| mesh_error("camera", e))?,
                _ if item.body == Body::Spring => continue,
                _ => item.solid().map_err(|e| mesh_error(&item.name, e))?,
            };
            match item.name.as_str() {
                "upper_platform" => scene.upper = RayTarget::new(&item.mesh),
                "lower_platform" => scene.lower = RayTarget::new(&item.mesh),
                _ => {}
            }
            let list = if item.body == Body::Fixed { &mut scene.fixed } else { &mut scene.moving };
            list.extend(Thing::new(&item.name, solid));
        }
        Ok(scene)
    }

    /// Things of one body never move against each other: once is enough.
    fn within_bodies(&self) -> Result<(), PartError> {
        for list in [&self.fixed, &self.moving] {
            for (i, one) in list.iter().enumerate() {
                for other in &list[i + 1..] {
                    one.apart_from(other, [&DAffine3::IDENTITY; 2], "always")?;
                }
            }
        }
        Ok(())
    }

    fn between_bodies(&self, m: &Measures, when: &str, pose: &Rigid, chord: Chord) -> Result<(), PartError> {
        let still = &DAffine3::IDENTITY;
        let rest_from_platform = affine(pose);
        for thing in &self.moving {
            for other in &self.fixed {
                thing.apart_from(other, [&rest_from_platform, still], when)?;
            }
        }
        let springs = (0..m.spring_axes_mm.len())
            .map(|i| Spring::new(m, i, pose, chord))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|e| mesh_error("spring", e))?;
        let platform_from_rest = rest_from_platform.inverse();
        for (i, spring) in springs.iter().enumerate() {
            for other in self.fixed.iter().filter(|t| !t.is_clear_of(spring, still)) {
                spring.thing()?.apart_from(other, [still, still], when)?;
            }
            for other in springs[i + 1..].iter().filter(|s| !s.bounds.is_apart_from(&spring.bounds)) {
                spring.thing()?.apart_from(other.thing()?, [still, still], when)?;
            }
            for other in self.moving.iter().filter(|t| !t.is_clear_of(spring, &platform_from_rest)) {
                spring.thing()?.apart_from(other, [still, &rest_from_platform], when)?;
            }
        }
        Ok(())
    }

    /// Every ray of dome's rim and markers that the lens can see reaches it.
    fn view(&self, m: &Measures, when: &str, pose: &Rigid) -> Result<(), PartError> {
        let moved = m.optics.at_pose(pose).map_err(|error| PartError::View {
            problem: format!("{when}: {error}"),
            field: "camera.position_mm".into(),
        })?;
        let discs = m.markers_mm.iter().map(|&at| ("a white marker", at, m.marker_radius_mm));
        for (what, center, radius) in discs.chain([("the dome's rim", DVec2::ZERO, m.dome.rim_radius_mm())]) {
            for line in sight_lines(&moved, center, radius) {
                let under = line.pupil_mm.lerp(line.sheet_mm, 1.0 - 1e-6);
                if let Some((fraction, _)) = self.upper.first_hit(line.pupil_mm, under) {
                    let at = line.pupil_mm.lerp(under, fraction);
                    let place = format!(
                        "stands before {what} {when}, at ({:.2}, {:.2}, {:.2}) of the platform; depth",
                        at.x, at.y, at.z
                    );
                    return Err(infeasible("upper_platform", place, 0.0, 0.0, "platforms.window_margin_mm"));
                }
            }
        }
        Ok(())
    }

    /// No straight way leads from an LED's emitting face to the lens.
    fn stray_light(&self, m: &Measures, when: &str, pose: &Rigid) -> Result<(), PartError> {
        let platform_from_rest = pose.inverse();
        let lens_points: Vec<DVec3> = [0.0, 0.5, 1.0]
            .into_iter()
            .flat_map(|share| (0..12).map(move |k| (share, std::f64::consts::TAU * f64::from(k) / 12.0)))
            .map(|(share, angle)| {
                let flat = 0.5 * share * m.camera_body.lens_diameter_mm * DVec2::from_angle(angle);
                let front =
                    m.sensor_from_camera.transform_point3(flat.extend(m.camera_body.front_from_pupil_mm));
                platform_from_rest.point(front)
            })
            .collect();
        let h = 0.5 * m.leds.emitter_mm;
        for i in 0..m.leds.list.len() {
            let led = m.platform_from_led(i);
            for (x, y) in [-1.0, 0.0, 1.0].into_iter().flat_map(|x| [-1.0, 0.0, 1.0].map(|y| (x * h, y * h)))
            {
                let from = led.transform_point3(DVec3::new(x, y, 1e-3 * h));
                for &to in &lens_points {
                    let faces_away = (to - from).dot(led.matrix3.z_axis) <= 0.0;
                    let is_hidden =
                        || self.upper.is_hit(from, to) || self.lower.is_hit(pose.point(from), pose.point(to));
                    if faces_away || is_hidden() {
                        continue;
                    }
                    let place = format!(
                        "LED {i} shines straight into the lens {when}, from ({:.2}, {:.2}, {:.2}); height of the lip",
                        from.x, from.y, from.z
                    );
                    let lip = m.leds.lip_top_z_mm;
                    let fault = infeasible("upper_platform", place, lip, lip + h, "leds.lip_top_z_mm");
                    // Without a lip before it no height of the lip hides it.
                    let (radius_mm, needed_mm) = (m.leds.center_radius_mm, behind_lip_mm(m, lip));
                    if radius_mm < needed_mm {
                        let cure = Cure::length("leds.center_radius_mm", radius_mm, needed_mm);
                        return Err(PartError::Cured { fault: Box::new(fault), cure });
                    }
                    return Err(fault);
                }
            }
        }
        Ok(())
    }
}
