//! glTF binary: named, coloured meshes in metres, Y up.

use std::io::{self, Write};

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::TriMesh;

/// One mesh of a scene.
#[derive(Debug, Clone)]
pub struct GlbItem<'a> {
    /// Name of mesh and node.
    pub name: &'a str,
    /// Red, green, blue (sRGB), opacity, 0 to 1.
    pub color: [f32; 4],
    /// The mesh, mm, Z up.
    pub mesh: &'a TriMesh,
}

/// One arrangement of the items.
#[derive(Debug, Clone)]
pub struct GlbScene {
    /// Name of the scene and of its root node.
    pub name: String,
    /// How far each item is moved from where its mesh is, mm, Z up.
    pub shift_mm: Vec<DVec3>,
}

/// Z up in mm to Y up in m.
fn gltf(v: DVec3) -> Vec3 {
    (DVec3::new(v.x, v.z, -v.y) * 1e-3).as_vec3()
}

/// glTF colours are linear, ours are as people pick them.
fn linear(c: f32) -> f32 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Writes items in one or more arrangements as a GLB (glTF 2.0); the first
/// scene is the one that is shown. Normals are left out: viewers then shade
/// flat, which is what machined faces want.
///
/// # Errors
/// Those of the writer.
pub fn write_glb(items: &[GlbItem<'_>], scenes: &[GlbScene], writer: &mut impl Write) -> io::Result<()> {
    let mut binary: Vec<u8> = Vec::new();
    let (mut views, mut accessors, mut meshes, mut materials) = (vec![], vec![], vec![], vec![]);
    for item in items {
        let positions: Vec<Vec3> = item.mesh.vertices_mm.iter().map(|&v| gltf(v)).collect();
        let low = positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let high = positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let index = accessors.len();
        let start = binary.len();
        positions.iter().flat_map(|p| p.to_array()).for_each(|x| binary.extend(x.to_le_bytes()));
        views.push(
            json!({"buffer": 0, "byteOffset": start, "byteLength": binary.len() - start, "target": 34962}),
        );
        accessors.push(
            json!({"bufferView": index, "componentType": 5126, "count": positions.len(), "type": "VEC3",
            "min": low.to_array(), "max": high.to_array()}),
        );
        let start = binary.len();
        item.mesh.triangles.iter().flatten().for_each(|i| binary.extend(i.to_le_bytes()));
        views.push(
            json!({"buffer": 0, "byteOffset": start, "byteLength": binary.len() - start, "target": 34963}),
        );
        accessors.push(json!({"bufferView": index + 1, "componentType": 5125,
            "count": 3 * item.mesh.triangles.len(), "type": "SCALAR"}));
        let [r, g, b, a] = item.color;
        let mut material = json!({"name": item.name, "pbrMetallicRoughness": {
            "baseColorFactor": [linear(r), linear(g), linear(b), a], "metallicFactor": 0.0, "roughnessFactor": 0.6}});
        if a < 1.0 {
            material["alphaMode"] = "BLEND".into();
        }
        meshes.push(json!({"name": item.name, "primitives": [{
            "attributes": {"POSITION": index}, "indices": index + 1, "material": materials.len(), "mode": 4}]}));
        materials.push(material);
    }
    let mut nodes: Vec<Value> = Vec::new();
    let mut scene_list = Vec::new();
    for scene in scenes {
        let first = nodes.len();
        for (i, item) in items.iter().enumerate() {
            let shift = gltf(scene.shift_mm.get(i).copied().unwrap_or_default());
            let mut node = json!({"name": format!("{} ({})", item.name, scene.name), "mesh": i});
            if shift != Vec3::ZERO {
                node["translation"] = json!(shift.to_array());
            }
            nodes.push(node);
        }
        let children: Vec<usize> = (first..nodes.len()).collect();
        scene_list.push(json!({"name": scene.name, "nodes": [nodes.len()]}));
        nodes.push(json!({"name": scene.name, "children": children}));
    }
    let document = json!({
        "asset": {"version": "2.0", "generator": "domecast"}, "scene": 0, "scenes": scene_list, "nodes": nodes,
        "meshes": meshes, "materials": materials, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": binary.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = u32::try_from(12 + 8 + text.len() + 8 + binary.len())
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "too large for a GLB"))?;
    writer.write_all(b"glTF")?;
    writer.write_all(&2_u32.to_le_bytes())?;
    writer.write_all(&total.to_le_bytes())?;
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        writer.write_all(&(chunk.len() as u32).to_le_bytes())?;
        writer.write_all(kind)?;
        writer.write_all(chunk)?;
    }
    Ok(())
}
