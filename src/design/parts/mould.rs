//! The mould that the dome is cast in: a block with the cavity, and a base
//! plate that closes it from above.
//!
//! Frame: parting plane z = 0, cavity below, base plate above. The silicone is
//! poured through the base plate; the rim, where the cavity meets the plate, is
//! the highest line of the cavity, and the vents stand there.

use glam::{DVec2, DVec3};

use super::measures::{Measures, polar};
use super::{Blueprint, Feature, PartError};
use domecast_mesh::{Fit, Profile, ProfileEdge, Shape};

/// Half the side of the square mould.
pub(super) fn half_side_mm(m: &Measures) -> f64 {
    m.mouth_radius_mm() + m.mould.wall_mm
}

/// Floor of the cavity block.
pub(super) fn bottom_z_mm(m: &Measures) -> f64 {
    -(m.mould.sealer_thickness_mm + m.cast_center_z_mm() + m.cavity_radius_mm() + m.mould.floor_mm)
}

/// The cavity as a solid, from its pole up to `top_mm` above the parting plane.
///
/// The sealer also lies on the base plate, so the silicone's flat face is one
/// sealer's thickness below the parting plane. The sphere's centre is there,
/// and a short cylinder leads up from it; that of a dome on a cylinder lies
/// deeper, that of a cap higher, whose cavity opens like the sphere.
pub(super) fn cavity_shape(m: &Measures, top_mm: f64) -> Shape {
    let (radius, sealer) = (m.cavity_radius_mm(), m.mould.sealer_thickness_mm);
    let center = -sealer - m.cast_center_z_mm();
    let mut points_mm = vec![DVec2::new(0.0, center - radius)];
    let mut edges = vec![ProfileEdge::Arc { center_z_mm: center }];
    if center < top_mm {
        points_mm.extend([DVec2::new(radius, center), DVec2::new(radius, top_mm)]);
        edges.push(ProfileEdge::Line);
    } else {
        let above = center - top_mm;
        points_mm.push(DVec2::new(((radius - above) * (radius + above)).max(0.0).sqrt(), top_mm));
    }
    Shape::Turned { profile: Profile { points_mm, edges }, fit: Fit::Area }
}

pub(super) fn cavity(m: &Measures) -> Result<Blueprint, PartError> {
    let over = m.overcut_mm;
    let h = half_side_mm(m);
    let mut b = Blueprint::new(
        "mould_cavity",
        "mould, lower half: the dome's cavity, corrected for shrinkage and sealer; printed",
        m.chord,
    );
    b.added.push(Feature::new(
        "block",
        "mould.wall_mm",
        Shape::cuboid(DVec3::new(-h, -h, bottom_z_mm(m)), DVec3::new(h, h, 0.0)),
    ));
    b.cut.push(
        Feature::new("cavity", "mould.sealer_thickness_mm", cavity_shape(m, over))
            .with_chord(m.optical_chord),
    );
    let pins = &m.mould.pins;
    for (i, at) in pins.at_mm.iter().enumerate() {
        let hole = Shape::cylinder(
            0.5 * pins.diameter_mm + pins.clearance_mm,
            -(pins.height_mm + pins.depth_clearance_mm),
            over,
            Fit::Outside,
        );
        b.cut.push(Feature::new("pin hole", "mould.pins", hole).numbered(i).at(at[0], at[1]));
    }
    // Blind holes only: none goes through.
    Ok(b)
}

pub(super) fn base(m: &Measures) -> Result<Blueprint, PartError> {
    let mould = &m.mould;
    let (top, over) = (mould.base_thickness_mm, m.overcut_mm);
    let h = half_side_mm(m);
    let mut b = Blueprint::new(
        "mould_base",
        "mould, upper half: base plate with register pins, fill hole and vents; printed",
        m.chord,
    );
    let plate = Shape::cuboid(DVec3::new(-h, -h, 0.0), DVec3::new(h, h, top));
    b.added.push(Feature::new("plate", "mould.wall_mm", plate));

    let pins = &mould.pins;
    let r = 0.5 * pins.diameter_mm;
    let chamfer = pins.chamfer_mm;
    if chamfer >= r.min(pins.height_mm) {
        let limit_mm = r.min(pins.height_mm);
        return Err(b.infeasible(
            "chamfer of the pins, less than their radius and height",
            chamfer,
            limit_mm,
            "mould.pins.chamfer_mm",
        ));
    }
    for (i, at) in pins.at_mm.iter().enumerate() {
        let mut points = vec![(r - chamfer, -pins.height_mm)];
        if chamfer > 0.0 {
            points.push((r, chamfer - pins.height_mm));
        }
        // Rooted in the middle of the plate, so that no faces coincide.
        points.push((r, 0.5 * top));
        let pin = Shape::Turned { profile: Profile::lines(&points), fit: Fit::Inside };
        b.added.push(Feature::new("pin", "mould.pins", pin).numbered(i).at(at[0], at[1]));
    }

    let fill = &mould.fill;
    let (hole, funnel) = (0.5 * fill.diameter_mm, 0.5 * fill.funnel_diameter_mm);
    let profile = if funnel > hole && fill.funnel_depth_mm > 0.0 {
        if fill.funnel_depth_mm >= top {
            return Err(b.infeasible(
                "depth of the funnel, less than the base plate's thickness",
                fill.funnel_depth_mm,
                top,
                "mould.fill.funnel_depth_mm",
            ));
        }
        Profile::lines(&[
            (hole, -over),
            (hole, top - fill.funnel_depth_mm),
            (funnel, top),
            (funnel, top + over),
        ])
    } else {
        Profile::lines(&[(hole, -over), (hole, top + over)])
    };
    let at = polar(fill.radius_mm, fill.azimuth_deg);
    let shape = Shape::Turned { profile, fit: Fit::Area };
    b.cut.push(Feature::new("fill hole", "mould.fill", shape).at(at.x, at.y));
    for (i, at) in m.vent_axes_mm().into_iter().enumerate() {
        let vent = Shape::cylinder(0.5 * mould.vents.diameter_mm, -over, top + over, Fit::Area);
        b.cut.push(Feature::new("vent", "mould.vents", vent).numbered(i).at(at.x, at.y));
    }
    b.genus = 1 + i64::from(mould.vents.count);
    Ok(b)
}
