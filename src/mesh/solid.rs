//! Booleans. The only file that knows the kernel behind them.

use glam::{DAffine3, DVec3};
use manifold_rust::linalg::{Mat3x4, Vec3};
use manifold_rust::manifold::Manifold;
use manifold_rust::types::{BooleanEngine, Error as KernelError, MeshGL64, OpType};

use super::{MeshError, TriMesh};

/// A closed solid that can be united, subtracted and intersected.
///
/// All operations use the kernel's exact engine, whose result depends on its
/// operands alone, not on threads or on what was computed before.
#[derive(Clone)]
pub struct Solid {
    inner: Manifold,
}

impl Solid {
    /// Takes a closed, consistently wound mesh.
    ///
    /// # Errors
    /// [`MeshError::Kernel`] if the mesh is not closed or not finite.
    pub fn from_mesh(mesh: &TriMesh) -> Result<Self, MeshError> {
        let kernel_mesh = MeshGL64 {
            num_prop: 3,
            vert_properties: mesh.vertices_mm.iter().flat_map(|v| v.to_array()).collect(),
            tri_verts: mesh.triangles.iter().flatten().map(|&i| u64::from(i)).collect(),
            ..MeshGL64::default()
        };
        guarded("import", || Manifold::from_mesh_gl64(&kernel_mesh))
    }

    /// The union, as a balanced tree: neighbours are joined in pairs, then the
    /// pairs, so that no operand is much larger than the other.
    ///
    /// # Errors
    /// [`MeshError::Empty`] without operands, [`MeshError::Kernel`].
    pub fn union(solids: Vec<Self>) -> Result<Self, MeshError> {
        let mut level = solids;
        while level.len() > 1 {
            let mut next = Vec::with_capacity(level.len().div_ceil(2));
            for pair in level.chunks(2) {
                next.push(match pair {
                    [a, b] => a.boolean(b, OpType::Add, "union")?,
                    _ => pair[0].clone(),
                });
            }
            level = next;
        }
        level.pop().ok_or(MeshError::Empty { operation: "union" })
    }

    /// What is left of this solid outside `tool`.
    ///
    /// # Errors
    /// [`MeshError::Empty`] if nothing is, [`MeshError::Kernel`].
    pub fn difference(&self, tool: &Self) -> Result<Self, MeshError> {
        let out = self.boolean(tool, OpType::Subtract, "difference")?;
        if out.inner.is_empty() { Err(MeshError::Empty { operation: "difference" }) } else { Ok(out) }
    }

    /// What both solids share; `None` if that is nothing.
    ///
    /// # Errors
    /// [`MeshError::Kernel`].
    pub fn intersection(&self, other: &Self) -> Result<Option<Self>, MeshError> {
        let out = self.boolean(other, OpType::Intersect, "intersection")?;
        Ok((!out.inner.is_empty()).then_some(out))
    }

    fn boolean(&self, other: &Self, op: OpType, operation: &'static str) -> Result<Self, MeshError> {
        guarded(operation, || self.inner.boolean_with_engine(&other.inner, op, BooleanEngine::Exact))
    }

    /// The solid moved by a rigid (or other affine, not mirroring) map.
    ///
    /// # Errors
    /// [`MeshError::Kernel`] if the map is not finite.
    pub fn moved(&self, target_from_source: &DAffine3) -> Result<Self, MeshError> {
        let column = |v: DVec3| Vec3::new(v.x, v.y, v.z);
        let m = &target_from_source.matrix3;
        let map = Mat3x4::from_cols(
            column(m.x_axis),
            column(m.y_axis),
            column(m.z_axis),
            column(target_from_source.translation),
        );
        guarded("move", || self.inner.transform(&map))
    }

    /// Volume, mm^3.
    pub fn volume_mm3(&self) -> f64 {
        self.inner.volume()
    }

    /// Smallest distance to another solid, or `search_mm` if it is larger; 0
    /// if they overlap.
    pub fn gap_mm(&self, other: &Self, search_mm: f64) -> f64 {
        self.inner.min_gap(&other.inner, search_mm)
    }

    /// The solid's triangles, in `f64` as the kernel holds them.
    pub fn to_mesh(&self) -> TriMesh {
        let kernel_mesh = self.inner.get_mesh_gl64(-1);
        let stride = (kernel_mesh.num_prop as usize).max(3);
        TriMesh {
            vertices_mm: kernel_mesh
                .vert_properties
                .chunks_exact(stride)
                .map(|p| DVec3::new(p[0], p[1], p[2]))
                .collect(),
            triangles: kernel_mesh
                .tri_verts
                .chunks_exact(3)
                .map(|t| [t[0] as u32, t[1] as u32, t[2] as u32])
                .collect(),
        }
    }
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Solid").field("triangles", &self.inner.num_tri()).finish_non_exhaustive()
    }
}

/// Runs a kernel call. A panic in there is a defect of the kernel, met by
/// geometry that nobody foresaw; it must become an error, not end the program.
fn guarded(operation: &'static str, call: impl FnOnce() -> Manifold) -> Result<Solid, MeshError> {
    let inner = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call)).map_err(|_| {
        MeshError::Kernel { operation, reason: "it met geometry that it cannot handle".into() }
    })?;
    match inner.status() {
        KernelError::NoError => Ok(Solid { inner }),
        other => Err(MeshError::Kernel { operation, reason: other.to_string() }),
    }
}
