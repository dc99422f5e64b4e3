//! Mass, centre of mass and inertia of solids.

use glam::{DMat3, DVec3};

use domecast_mesh::TriMesh;
use domecast_optics::DomeShape;

/// Mass, centre of mass and inertia of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass, m.
    pub center_m: DVec3,
    /// Inertia about the centre of mass, kg m^2.
    pub inertia_kg_m2: DMat3,
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

impl MassProperties {
    /// A body from its mass, centre (mm) and second moments of mass about the centre, as the integral of
    /// x x^T (kg mm^2).
    fn from_moments(mass_kg: f64, center_mm: DVec3, second_kg_mm2: DMat3) -> Self {
        let trace = second_kg_mm2.x_axis.x + second_kg_mm2.y_axis.y + second_kg_mm2.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - second_kg_mm2;
        Self { mass_kg, center_m: center_mm * 1e-3, inertia_kg_m2: inertia * 1e-6 }
    }

    /// The two as one rigid body.
    pub fn with(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return *self;
        }
        let center_m = (self.center_m * self.mass_kg + other.center_m * other.mass_kg) / mass_kg;
        let moved = |body: &Self| {
            let d = body.center_m - center_m;
            body.inertia_kg_m2
                + (DMat3::from_diagonal(DVec3::splat(d.length_squared())) - outer(d)) * body.mass_kg
        };
        Self { mass_kg, center_m, inertia_kg_m2: moved(self) + moved(other) }
    }

    /// A solid hemisphere on the plane z = 0.
    pub fn hemisphere(radius_mm: f64, density_g_cm3: f64) -> Self {
        let mass_kg = density_g_cm3 * 1e-6 * std::f64::consts::TAU / 3.0 * radius_mm.powi(3);
        let center = 0.375 * radius_mm;
        let side = mass_kg * radius_mm * radius_mm / 5.0;
        let second = DVec3::new(side, side, side - mass_kg * center * center);
        Self::from_moments(mass_kg, DVec3::new(0.0, 0.0, center), DMat3::from_diagonal(second))
    }

    /// A solid dome on the plane z = 0.
    pub fn dome(shape: &DomeShape, density_g_cm3: f64) -> Self {
        if shape.is_hemisphere() {
            return Self::hemisphere(shape.radius_mm(), density_g_cm3);
        }
        let (radius, center_z) = (shape.radius_mm(), shape.center_z_mm());
        // Slices are discs: their squared radius is a polynomial of the height, of degree 2 at most in a piece, and so
        // three Gaussian places give the second moments of a piece exactly.
        let (mut second_z, mut second_r) = (0.0, 0.0);
        for (low, high) in [(0.0, center_z.max(0.0)), (center_z.max(0.0), shape.height_mm())] {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            for (place, weight) in [(-(0.6_f64.sqrt()), 5.0), (0.0, 8.0), (0.6_f64.sqrt(), 5.0)] {
                let z = middle + half * place;
                let above = if center_z > 0.0 { (z - center_z).max(0.0) } else { z - center_z };
                let square = radius * radius - above * above;
                let slice = std::f64::consts::PI * square * (half * weight / 9.0);
                second_z += slice * z * z;
                second_r += slice * 0.25 * square;
            }
        }
        let density = density_g_cm3 * 1e-6;
        let (mass_kg, center) = (density * shape.volume_mm3(), shape.centroid_z_mm());
        let (side, up) = (density * second_r, density * second_z - mass_kg * center * center);
        let second = DVec3::new(side, side, up);
        Self::from_moments(mass_kg, DVec3::new(0.0, 0.0, center), DMat3::from_diagonal(second))
    }

    /// A disc of this diameter and thickness (mm) that lies flat.
    pub fn disc([diameter_mm, thickness_mm]: [f64; 2], center_mm: DVec3, density_g_cm3: f64) -> Self {
        let square_mm2 = 0.25 * diameter_mm * diameter_mm;
        let mass_kg = density_g_cm3 * 1e-6 * std::f64::consts::PI * square_mm2 * thickness_mm;
        let second = DVec3::new(0.25 * square_mm2, 0.25 * square_mm2, thickness_mm * thickness_mm / 12.0);
        Self::from_moments(mass_kg, center_mm, DMat3::from_diagonal(second * mass_kg))
    }

    /// A box.
    pub fn cuboid(size_mm: DVec3, center_mm: DVec3, density_g_cm3: f64) -> Self {
        let mass_kg = density_g_cm3 * 1e-6 * size_mm.x * size_mm.y * size_mm.z;
        Self::from_moments(mass_kg, center_mm, DMat3::from_diagonal(size_mm * size_mm * (mass_kg / 12.0)))
    }
}

/// Mass properties of a closed mesh (mm) of one density, by signed tetrahedra about its box's centre: exact for
/// the polyhedron.
pub fn mass_of_mesh(mesh: &TriMesh, density_g_cm3: f64) -> MassProperties {
    let origin = mesh.bounds().map_or(DVec3::ZERO, |b| 0.5 * (b.min_mm + b.max_mm));
    let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for corners in mesh.iter_mm() {
        let [a, b, c] = corners.map(|v| v - origin);
        let part = a.dot(b.cross(c)) / 6.0;
        volume += part;
        let sum = a + b + c;
        first += sum * (part / 4.0);
        second += (outer(a) + outer(b) + outer(c) + outer(sum)) * (part / 20.0);
    }
    let density = density_g_cm3 * 1e-6;
    if volume <= 0.0 {
        return MassProperties::from_moments(0.0, origin, DMat3::ZERO);
    }
    let center = first / volume;
    let about_center = second - outer(center) * volume;
    MassProperties::from_moments(volume * density, origin + center, about_center * density)
}
