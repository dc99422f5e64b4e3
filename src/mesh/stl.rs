//! Binary STL.

use std::io::{self, Write};

use glam::DVec3;

use super::TriMesh;

/// Writes a mesh as binary STL: 80 zero bytes, the count, then per triangle
/// its normal and corners as `f32`. The bytes depend on the mesh alone.
///
/// Write a mesh that went through [`TriMesh::welded_f32`]: what was inspected
/// is then exactly what a reader gets.
///
/// # Errors
/// Those of the writer; `InvalidInput` if there are more triangles than the
/// format's 32-bit count can hold.
pub fn write_stl(mesh: &TriMesh, writer: &mut impl Write) -> io::Result<()> {
    if u32::try_from(mesh.triangles.len()).is_err() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "too many triangles for an STL"));
    }
    let triangles: Vec<stl_io::Triangle> = mesh
        .iter_mm()
        .map(|[a, b, c]| stl_io::Triangle {
            // Readers use the winding; a sliver without a direction gets zero,
            // as the format allows.
            normal: vector((b - a).cross(c - a).normalize_or_zero()),
            vertices: [vector(a), vector(b), vector(c)],
        })
        .collect();
    stl_io::write_stl(writer, triangles.iter())
}

fn vector(v: DVec3) -> stl_io::Vector<f32> {
    stl_io::Vector::new(v.as_vec3().to_array())
}
