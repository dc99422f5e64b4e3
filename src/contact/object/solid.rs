//! Objects that touch the dome: exact signed distances in their own frame.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::distance::Distance;
use super::mesh_distance::MeshDistance;
use crate::error::{ContactError, positive};
use domecast_mesh::TriMesh;

/// A solid object, checked when it was made; cheap to clone.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSolid(pub(super) Form);

/// What a solid is.
#[derive(Debug, Clone)]
pub(super) enum Form {
    Sphere { radius_mm: f64 },
    Cylinder { radius_mm: f64, half_mm: f64 },
    Cuboid { half_mm: DVec3 },
    Cone { radius_mm: f64, height_mm: f64 },
    Mesh(Arc<MeshDistance>),
}

impl PartialEq for Form {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Sphere { radius_mm: a }, Self::Sphere { radius_mm: b }) => a == b,
            (Self::Cylinder { radius_mm: a, half_mm: h }, Self::Cylinder { radius_mm: b, half_mm: k }) => {
                a == b && h == k
            }
            (Self::Cuboid { half_mm: a }, Self::Cuboid { half_mm: b }) => a == b,
            (Self::Cone { radius_mm: a, height_mm: h }, Self::Cone { radius_mm: b, height_mm: k }) => {
                a == b && h == k
            }
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl ContactSolid {
    /// A ball about the origin.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a radius that is not positive.
    pub fn sphere(radius_mm: f64) -> Result<Self, ContactError> {
        Ok(Self(Form::Sphere { radius_mm: positive("sphere.radius_mm", radius_mm)? }))
    }

    /// A cylinder along z, its middle at the origin.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a size that is not positive.
    pub fn cylinder(radius_mm: f64, length_mm: f64) -> Result<Self, ContactError> {
        Ok(Self(Form::Cylinder {
            radius_mm: positive("cylinder.radius_mm", radius_mm)?,
            half_mm: 0.5 * positive("cylinder.length_mm", length_mm)?,
        }))
    }

    /// A box along the axes, its middle at the origin.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a size that is not positive.
    pub fn cuboid(size_mm: DVec3) -> Result<Self, ContactError> {
        for side in size_mm.to_array() {
            positive("box.size_mm", side)?;
        }
        Ok(Self(Form::Cuboid { half_mm: 0.5 * size_mm }))
    }

    /// A cone: apex at the origin, opening towards +z, its base a disc at z = height.
    ///
    /// # Errors
    /// [`ContactError::Dimension`] for a size that is not positive.
    pub fn cone(radius_mm: f64, height_mm: f64) -> Result<Self, ContactError> {
        Ok(Self(Form::Cone {
            radius_mm: positive("cone.radius_mm", radius_mm)?,
            height_mm: positive("cone.height_mm", height_mm)?,
        }))
    }

    /// The inside of a closed mesh, wound outwards; several closed shells are allowed.
    ///
    /// # Errors
    /// [`ContactError::EmptyMesh`], [`ContactError::OpenMesh`], [`ContactError::NotManifold`],
    /// [`ContactError::InsideOut`], or [`ContactError::Dimension`] for a coordinate that is not finite.
    pub fn mesh(mesh: &TriMesh) -> Result<Self, ContactError> {
        Ok(Self(Form::Mesh(Arc::new(MeshDistance::new(mesh)?))))
    }

    /// Signed distance of a point of the object's frame, and the way out.
    pub fn distance(&self, point_mm: DVec3) -> Distance {
        match &self.0 {
            Form::Sphere { radius_mm } => {
                let length = point_mm.length();
                let outward = if length > 0.0 { point_mm / length } else { DVec3::Z };
                Distance { value_mm: length - radius_mm, outward }
            }
            Form::Cylinder { radius_mm, half_mm } => {
                let radial = point_mm.truncate().length();
                let side = DVec2::new(radial - radius_mm, point_mm.z.abs() - half_mm);
                turned(point_mm, radial, rounded(side), point_mm.z.signum())
            }
            Form::Cuboid { half_mm } => cuboid(point_mm, *half_mm),
            Form::Cone { radius_mm, height_mm } => {
                let radial = point_mm.truncate().length();
                turned(point_mm, radial, cone(DVec2::new(radial, point_mm.z), *radius_mm, *height_mm), 1.0)
            }
            Form::Mesh(mesh) => mesh.distance(point_mm),
        }
    }

    /// Whether it is a ball.
    pub(crate) fn is_ball(&self) -> bool {
        matches!(self.0, Form::Sphere { .. })
    }

    /// Whether it is a mesh, with edges and corners anywhere.
    pub fn is_mesh(&self) -> bool {
        matches!(self.0, Form::Mesh(_))
    }

    /// Centre and radius of a ball round the solid, object frame, mm.
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        match &self.0 {
            Form::Sphere { radius_mm } => (DVec3::ZERO, *radius_mm),
            Form::Cylinder { radius_mm, half_mm } => (DVec3::ZERO, radius_mm.hypot(*half_mm)),
            Form::Cuboid { half_mm } => (DVec3::ZERO, half_mm.length()),
            Form::Cone { radius_mm, height_mm } => {
                // Through apex and rim, or about the base where the cone is flat.
                let center = (0.5 * (height_mm + radius_mm * radius_mm / height_mm)).min(*height_mm);
                (DVec3::Z * center, center.max(radius_mm.hypot(height_mm - center)))
            }
            Form::Mesh(mesh) => mesh.bounding_sphere(),
        }
    }

    /// The farthest point along a direction (object frame), mm.
    pub fn support(&self, direction: DVec3) -> DVec3 {
        let flat = direction.truncate().normalize_or_zero();
        match &self.0 {
            Form::Sphere { radius_mm } => direction.normalize_or_zero() * *radius_mm,
            Form::Cylinder { radius_mm, half_mm } => {
                (flat * *radius_mm).extend(half_mm.copysign(direction.z))
            }
            Form::Cuboid { half_mm } => DVec3::from_array(std::array::from_fn(|axis| {
                half_mm.to_array()[axis].copysign(direction.to_array()[axis])
            })),
            Form::Cone { radius_mm, height_mm } => {
                let rim = (flat * *radius_mm).extend(*height_mm);
                if rim.dot(direction) > 0.0 { rim } else { DVec3::ZERO }
            }
            Form::Mesh(mesh) => mesh.support(direction),
        }
    }
}

/// Distance and gradient from the excess over two perpendicular faces.
fn rounded(excess: DVec2) -> (f64, DVec2) {
    let outside = excess.max(DVec2::ZERO);
    let length = outside.length();
    if length > 0.0 {
        (length, outside / length)
    } else if excess.x > excess.y {
        (excess.x, DVec2::X)
    } else {
        (excess.y, DVec2::Y)
    }
}

/// Back from the half plane (distance from the axis, height) to space.
fn turned(point: DVec3, radial: f64, (value_mm, gradient): (f64, DVec2), z_sign: f64) -> Distance {
    let away = if radial > 0.0 { point.truncate() / radial } else { DVec2::X };
    Distance { value_mm, outward: (away * gradient.x).extend(gradient.y * z_sign) }
}

fn cuboid(point: DVec3, half: DVec3) -> Distance {
    let excess = point.abs() - half;
    let sign = DVec3::ONE.copysign(point);
    let outside = excess.max(DVec3::ZERO);
    let length = outside.length();
    if length > 0.0 {
        return Distance { value_mm: length, outward: outside / length * sign };
    }
    let [x, y, z] = excess.to_array();
    let axis = if x >= y.max(z) {
        DVec3::X
    } else if y >= z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    Distance { value_mm: excess.max_element(), outward: axis * sign }
}

/// Distance in the half plane to the triangle apex (0, 0), rim (radius, height), base centre (0, height).
fn cone(p: DVec2, radius: f64, height: f64) -> (f64, DVec2) {
    let slope = DVec2::new(radius, height);
    let length = slope.length();
    let along = slope / length;
    let normal = DVec2::new(along.y, -along.x);
    let (to_side, to_base) = (p.dot(normal), p.y - height);
    if to_side <= 0.0 && to_base <= 0.0 {
        return if to_side > to_base { (to_side, normal) } else { (to_base, DVec2::Y) };
    }
    let on_side = along * p.dot(along).clamp(0.0, length);
    let on_base = DVec2::new(p.x.min(radius), height);
    let nearest = if p.distance_squared(on_side) < p.distance_squared(on_base) { on_side } else { on_base };
    let away = p - nearest;
    let distance = away.length();
    if distance > 0.0 {
        (distance, away / distance)
    } else if to_side > to_base {
        (to_side, normal)
    } else {
        (to_base, DVec2::Y)
    }
}
