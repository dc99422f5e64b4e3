//! Indexed triangles and what can be measured on them.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

/// Axis-aligned box of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox {
    /// Smallest coordinates, mm.
    pub min_mm: DVec3,
    /// Largest coordinates, mm.
    pub max_mm: DVec3,
}

impl BoundingBox {
    /// The smallest box round points; `None` round none.
    pub fn of(points_mm: &[DVec3]) -> Option<Self> {
        let first = *points_mm.first()?;
        Some(points_mm.iter().fold(Self { min_mm: first, max_mm: first }, |b, &v| Self {
            min_mm: b.min_mm.min(v),
            max_mm: b.max_mm.max(v),
        }))
    }

    /// Side lengths, mm.
    pub fn size_mm(&self) -> DVec3 {
        self.max_mm - self.min_mm
    }

    /// Whether the two boxes share no point.
    pub fn is_apart_from(&self, other: &Self) -> bool {
        (self.min_mm - other.max_mm).max(other.min_mm - self.max_mm).max_element() > 0.0
    }

    /// A box round this one after a move: round its moved corners.
    #[must_use]
    pub fn transformed(&self, target_from_source: &DAffine3) -> Self {
        let center = target_from_source.transform_point3(0.5 * (self.min_mm + self.max_mm));
        let m = &target_from_source.matrix3;
        let half = 0.5 * self.size_mm();
        let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        Self { min_mm: center - reach, max_mm: center + reach }
    }

    /// The smallest box round this one and another.
    pub fn union(&self, other: &Self) -> Self {
        Self { min_mm: self.min_mm.min(other.min_mm), max_mm: self.max_mm.max(other.max_mm) }
    }
}

/// A triangle mesh: corners counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions, mm.
    pub vertices_mm: Vec<DVec3>,
    /// Corners as indices into `vertices_mm`; every index is in range.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The corners of triangle `t`; `None` if there is no such triangle.
    pub fn corners_mm(&self, t: usize) -> Option<[DVec3; 3]> {
        let [a, b, c] = *self.triangles.get(t)?;
        Some([
            *self.vertices_mm.get(a as usize)?,
            *self.vertices_mm.get(b as usize)?,
            *self.vertices_mm.get(c as usize)?,
        ])
    }

    /// All triangles as corner points.
    pub fn iter_mm(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        (0..self.triangles.len()).filter_map(|t| self.corners_mm(t))
    }

    /// Enclosed volume, mm^3: the sum of signed tetrahedra (divergence
    /// theorem), taken about the box's centre to keep the terms small.
    /// Positive if the triangles are wound outwards.
    pub fn volume_mm3(&self) -> f64 {
        let Some(bounds) = self.bounds() else {
            return 0.0;
        };
        let center = 0.5 * (bounds.min_mm + bounds.max_mm);
        self.iter_mm().map(|[a, b, c]| (a - center).dot((b - center).cross(c - center))).sum::<f64>() / 6.0
    }

    /// Surface area, mm^2.
    pub fn area_mm2(&self) -> f64 {
        self.iter_mm().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<BoundingBox> {
        BoundingBox::of(&self.vertices_mm)
    }

    /// The length below which two `f32` coordinates of this mesh cannot be
    /// distinct: the spacing of `f32` at its largest coordinate. This is the
    /// rounding epsilon, and has nothing to do with the chord tolerance.
    pub fn rounding_mm(&self) -> f64 {
        let largest = self.vertices_mm.iter().fold(0.0_f64, |m, v| m.max(v.abs().max_element()));
        largest * f64::from(f32::EPSILON)
    }

    /// The mesh moved by `target_from_source`; a mirroring transform also
    /// turns the winding, so that outside stays outside.
    #[must_use]
    pub fn transformed(&self, target_from_source: &DAffine3) -> Self {
        let mirrored = target_from_source.matrix3.determinant() < 0.0;
        Self {
            vertices_mm: self.vertices_mm.iter().map(|&v| target_from_source.transform_point3(v)).collect(),
            triangles: self
                .triangles
                .iter()
                .map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] })
                .collect(),
        }
    }

    /// What a reader gets who loads the STL and welds equal vertices: every
    /// coordinate rounded to `f32`, equal points made one, triangles that
    /// collapsed to a line or point dropped, unused points left out.
    ///
    /// Vertices keep the order of first use, so that the result depends on
    /// nothing but the input.
    #[must_use]
    pub fn welded_f32(&self) -> Self {
        let mut index_of: HashMap<[u32; 3], u32> = HashMap::with_capacity(self.vertices_mm.len());
        let mut out = Self::default();
        for corners in self.iter_mm() {
            let mut triangle = [0_u32; 3];
            for (slot, corner) in triangle.iter_mut().zip(corners) {
                // Adding zero makes -0.0 and 0.0 one key.
                let rounded = corner.as_vec3() + glam::Vec3::ZERO;
                let key = rounded.to_array().map(f32::to_bits);
                *slot = *index_of.entry(key).or_insert_with(|| {
                    out.vertices_mm.push(rounded.as_dvec3());
                    (out.vertices_mm.len() - 1) as u32
                });
            }
            let [a, b, c] = triangle;
            if a != b && b != c && c != a {
                out.triangles.push(triangle);
            }
        }
        out
    }

    /// Joins rings of `around` vertices each, `bands` + 1 of them in a row, to
    /// a tube with flat ends. Counter-clockwise about the way it runs, its
    /// surface points outwards.
    pub fn close_tube(&mut self, bands: u32, around: u32) {
        for k in 0..bands {
            let (p, q) = (k * around, (k + 1) * around);
            for a in 0..around {
                let b = (a + 1) % around;
                self.triangles.push([p + a, p + b, q + b]);
                self.triangles.push([p + a, q + b, q + a]);
            }
        }
        for (first, is_start) in [(0, true), (bands * around, false)] {
            for a in 1..around.saturating_sub(1) {
                let [x, y] = if is_start { [a + 1, a] } else { [a, a + 1] };
                self.triangles.push([first, first + x, first + y]);
            }
        }
    }

    /// Puts another mesh's triangles beside this one's (no boolean).
    pub fn append(&mut self, other: &Self) {
        let offset = self.vertices_mm.len() as u32;
        self.vertices_mm.extend_from_slice(&other.vertices_mm);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
    }
}
