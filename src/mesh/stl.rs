//! Binary STL.

use std::io::{self, Cursor, Write};

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

/// Reads an STL, binary or text, and welds equal vertices, as every reader of the format must.
///
/// # Errors
/// Those of the format: a file that is cut short, or is no STL; coordinates that are not finite.
pub fn read_stl(bytes: &[u8]) -> io::Result<TriMesh> {
    let mut cursor = Cursor::new(bytes);
    let mut mesh = TriMesh::default();
    for triangle in stl_io::create_stl_reader(&mut cursor)? {
        let corners = triangle?.vertices;
        let first = mesh.vertices_mm.len() as u32;
        for corner in corners {
            let vertex = glam::Vec3::new(corner[0], corner[1], corner[2]);
            if !vertex.is_finite() {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "a coordinate is not finite"));
            }
            mesh.vertices_mm.push(vertex.as_dvec3());
        }
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(mesh.welded_f32())
}
