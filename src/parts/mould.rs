//! The mould that the dome is cast in: a block with the cavity, and a base
//! plate that closes it from above.
//!
//! Frame: parting plane z = 0, cavity below, base plate above. The silicone is
//! poured through the base plate; the rim, where the cavity meets the plate, is
//! the highest line of the cavity, and the vents stand there.

use glam::{DVec2, DVec3};

use super::measures::{Measures, polar};
use super::{Blueprint, PartError};
use crate::mesh::{Construction, Fit, Piece, Profile, ProfileEdge, Shape};

pub(super) const CAVITY: &str = "mould_cavity";
pub(super) const BASE: &str = "mould_base";

/// Half the side of the square mould.
fn half_side_mm(m: &Measures) -> f64 {
    m.cavity_radius_mm() + m.mould.wall_mm
}

pub(super) fn cavity(m: &Measures) -> Result<Blueprint, PartError> {
    let mould = &m.mould;
    let (radius, sealer, over) = (m.cavity_radius_mm(), mould.sealer_thickness_mm, m.overcut_mm);
    let h = half_side_mm(m);
    let bottom = -(sealer + radius + mould.floor_mm);
    let mut c = Construction {
        added: vec![Piece::new("block", Shape::cuboid(DVec3::new(-h, -h, bottom), DVec3::new(h, h, 0.0)))],
        cut: vec![],
    };

    // The sealer also lies on the base plate, so the silicone's flat face is
    // one sealer's thickness below the parting plane: the sphere's centre is
    // there, and a short cylinder leads up from it.
    let dome = Shape::Turned {
        profile: Profile {
            points_mm: vec![
                DVec2::new(0.0, -sealer - radius),
                DVec2::new(radius, -sealer),
                DVec2::new(radius, over),
            ],
            edges: vec![ProfileEdge::Arc { center_z_mm: -sealer }, ProfileEdge::Line],
        },
        fit: Fit::Area,
    };
    c.cut.push(Piece::new("cavity", dome).with_chord(m.optical_chord));

    let pins = &mould.pins;
    for (i, at) in pins.at_mm.iter().enumerate() {
        let hole = Shape::cylinder(
            0.5 * pins.diameter_mm + pins.clearance_mm,
            -(pins.height_mm + pins.depth_clearance_mm),
            over,
            Fit::Outside,
        );
        c.cut.push(Piece::new(format!("pin hole {i}"), hole).at(at[0], at[1]));
    }
    // Blind holes only: no handle.
    Ok(Blueprint {
        name: CAVITY,
        summary: "mould, lower half: the dome's cavity, corrected for shrinkage and sealer; printed",
        construction: c,
        genus: 0,
        chord: m.chord,
    })
}

pub(super) fn base(m: &Measures) -> Result<Blueprint, PartError> {
    let mould = &m.mould;
    let (top, over) = (mould.base_thickness_mm, m.overcut_mm);
    let h = half_side_mm(m);
    let mut c = Construction {
        added: vec![Piece::new("plate", Shape::cuboid(DVec3::new(-h, -h, 0.0), DVec3::new(h, h, top)))],
        cut: vec![],
    };

    let pins = &mould.pins;
    let r = 0.5 * pins.diameter_mm;
    let chamfer = pins.chamfer_mm;
    if chamfer >= r.min(pins.height_mm) {
        return Err(PartError::Infeasible {
            part: BASE,
            place: "chamfer of the pins, at most their radius and height".into(),
            value_mm: chamfer,
            limit_mm: r.min(pins.height_mm),
            field: "mould.pins.chamfer_mm".into(),
        });
    }
    for (i, at) in pins.at_mm.iter().enumerate() {
        let mut points = vec![(r - chamfer, -pins.height_mm)];
        if chamfer > 0.0 {
            points.push((r, chamfer - pins.height_mm));
        }
        // Rooted in the middle of the plate, so that no faces coincide.
        points.push((r, 0.5 * top));
        let pin = Shape::Turned { profile: Profile::lines(&points), fit: Fit::Inside };
        c.added.push(Piece::new(format!("pin {i}"), pin).at(at[0], at[1]));
    }

    let fill = &mould.fill;
    let (hole, funnel) = (0.5 * fill.diameter_mm, 0.5 * fill.funnel_diameter_mm);
    let profile = if funnel > hole && fill.funnel_depth_mm > 0.0 {
        if fill.funnel_depth_mm >= top {
            return Err(PartError::Infeasible {
                part: BASE,
                place: "depth of the funnel, less than the base plate's thickness".into(),
                value_mm: fill.funnel_depth_mm,
                limit_mm: top,
                field: "mould.fill.funnel_depth_mm".into(),
            });
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
    c.cut.push(Piece::new("fill hole", Shape::Turned { profile, fit: Fit::Area }).at(at.x, at.y));

    for (i, at) in m.vent_axes_mm().into_iter().enumerate() {
        let vent = Shape::cylinder(0.5 * mould.vents.diameter_mm, -over, top + over, Fit::Area);
        c.cut.push(Piece::new(format!("vent {i}"), vent).at(at.x, at.y));
    }

    Ok(Blueprint {
        name: BASE,
        summary: "mould, upper half: base plate with register pins, fill hole and vents; printed",
        construction: c,
        genus: 1 + i64::from(mould.vents.count),
        chord: m.chord,
    })
}
