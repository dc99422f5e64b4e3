//! What of an object touches: a smooth place, an apex, or what has no closed form.

use glam::DVec3;

use super::placed::Placed;
use super::solid::Form;

/// What of the object touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Feature {
    /// A smooth place: curvatures (1/mm) along `first` and across it, and the room that the feature has round the
    /// place, mm.
    Smooth { along: f64, across: f64, first: DVec3, room_mm: f64 },
    /// The apex of a cone with this slope (height over radius) and that much room (mm, along the radius).
    Apex { slope: f64, room_mm: f64 },
}

/// The feature of an object nearest to a place (sensor frame), or why it has no closed form.
pub(crate) fn feature_at(placed: &Placed, at_mm: DVec3) -> Result<Feature, &'static str> {
    let p = placed.object_from_sensor().point(at_mm);
    let direction = |v: DVec3| placed.sensor_from_object().vector(v);
    let radial = p.truncate().length();
    let away = if radial > 0.0 { (p.truncate() / radial).extend(0.0) } else { DVec3::X };
    let flat =
        |room_mm: f64| Feature::Smooth { along: 0.0, across: 0.0, first: direction(DVec3::X), room_mm };
    match &placed.solid.0 {
        Form::Sphere { radius_mm } => Ok(Feature::Smooth {
            along: 1.0 / radius_mm,
            across: 1.0 / radius_mm,
            first: direction(DVec3::X),
            room_mm: *radius_mm,
        }),
        Form::Cylinder { radius_mm, half_mm } => {
            let (side, end) = (radial - radius_mm, p.z.abs() - half_mm);
            if side > 0.0 && end > 0.0 {
                Err("the rim of a cylinder touches: an edge has no closed form")
            } else if side > end {
                Ok(Feature::Smooth {
                    along: 0.0,
                    across: 1.0 / radius_mm,
                    first: direction(DVec3::Z),
                    room_mm: (half_mm - p.z.abs()).min(*radius_mm),
                })
            } else {
                Ok(flat(radius_mm - radial))
            }
        }
        Form::Cuboid { half_mm } => {
            let mut excess = (p.abs() - *half_mm).to_array();
            excess.sort_by(f64::total_cmp);
            if excess[1] > 0.0 {
                Err("an edge of a box touches: it has no closed form")
            } else {
                Ok(flat(-excess[1]))
            }
        }
        Form::Cone { radius_mm, height_mm } => {
            let length = radius_mm.hypot(*height_mm);
            let (sine, cosine) = (radius_mm / length, height_mm / length);
            let along_side = radial * sine + p.z * cosine;
            // The dome's normal and the cone's axis must agree where the apex stands in the dome.
            let tilt = direction(DVec3::Z).dot(at_mm.normalize_or_zero()).clamp(-1.0, 1.0).acos();
            if radial <= 0.05 * radius_mm && tilt < 0.05 {
                Ok(Feature::Apex { slope: height_mm / radius_mm, room_mm: *radius_mm })
            } else if p.z >= *height_mm {
                if radial < *radius_mm {
                    Ok(flat(radius_mm - radial))
                } else {
                    Err("the rim of a cone touches")
                }
            } else if along_side > 0.0 && along_side < length {
                Ok(Feature::Smooth {
                    along: 0.0,
                    across: cosine / (along_side * sine),
                    first: direction((away * sine).with_z(cosine)),
                    room_mm: along_side.min(length - along_side).min(along_side * sine),
                })
            } else {
                Err("the apex of a tilted cone touches: it has no closed form")
            }
        }
        Form::Mesh(_) => Err("a mesh has no closed form"),
    }
}
