//! 3MF: a zip archive with the mesh in millimetres, by name.

use std::fmt::Write as _;
use std::io::{self, Write};

use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::TriMesh;

const CONTENT_TYPES: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n";
const RELATIONS: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" \
Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n";

/// Writes named meshes as one 3MF package, unit millimetre, one object and one
/// build item each. The bytes depend on the input alone (no time stamps).
///
/// # Errors
/// Those of the writer.
pub fn write_3mf(objects: &[(&str, &TriMesh)], writer: &mut impl Write) -> io::Result<()> {
    let mut model = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
         <metadata name=\"Application\">domecast</metadata>\n<resources>\n",
    );
    // Writing to a String does not fail.
    let out = &mut model;
    for (i, (name, mesh)) in objects.iter().enumerate() {
        let name = escaped(name);
        let _ = writeln!(out, "<object id=\"{}\" type=\"model\" name=\"{name}\"><mesh><vertices>", i + 1);
        for v in &mesh.vertices_mm {
            // f32 digits: what the STL holds, so that both files are one shape.
            let v = v.as_vec3();
            let _ = writeln!(out, "<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", v.x, v.y, v.z);
        }
        out.push_str("</vertices><triangles>\n");
        for [a, b, c] in &mesh.triangles {
            let _ = writeln!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
        }
        out.push_str("</triangles></mesh></object>\n");
    }
    out.push_str("</resources>\n<build>\n");
    for i in 0..objects.len() {
        let _ = writeln!(out, "<item objectid=\"{}\"/>", i + 1);
    }
    out.push_str("</build>\n</model>\n");
    let files = [
        ("[Content_Types].xml", CONTENT_TYPES.as_bytes()),
        ("_rels/.rels", RELATIONS.as_bytes()),
        ("3D/3dmodel.model", model.as_bytes()),
    ];
    write_zip(&files, writer)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A plain zip archive (APPNOTE 6.3: local headers, central directory, end
/// record), deflated, dated 1980-01-01.
fn write_zip(files: &[(&str, &[u8])], writer: &mut impl Write) -> io::Result<()> {
    const DATE_1980: u16 = 0x0021;
    let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "too large for a zip archive");
    let mut body: Vec<u8> = Vec::new();
    let mut directory: Vec<u8> = Vec::new();
    for (name, data) in files {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(data)?;
        let packed = encoder.finish()?;
        let mut crc = flate2::Crc::new();
        crc.update(data);
        let offset = u32::try_from(body.len()).map_err(too_large)?;
        // Version 2.0, no flags, deflate, time, date, checksum, sizes, name.
        let mut fields: Vec<u8> = Vec::new();
        for half in [20_u16, 0, 8, 0, DATE_1980] {
            fields.extend(half.to_le_bytes());
        }
        for word in [
            crc.sum(),
            u32::try_from(packed.len()).map_err(too_large)?,
            u32::try_from(data.len()).map_err(too_large)?,
        ] {
            fields.extend(word.to_le_bytes());
        }
        fields.extend(u16::try_from(name.len()).map_err(too_large)?.to_le_bytes());
        fields.extend([0, 0]);
        body.extend(b"PK\x03\x04");
        body.extend(&fields);
        body.extend(name.as_bytes());
        body.extend(&packed);
        directory.extend(b"PK\x01\x02");
        directory.extend(20_u16.to_le_bytes());
        directory.extend(&fields);
        // Comment, disk, attributes: none.
        directory.extend([0_u8; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let count = u16::try_from(files.len()).map_err(too_large)?;
    let start = u32::try_from(body.len()).map_err(too_large)?;
    let length = u32::try_from(directory.len()).map_err(too_large)?;
    body.extend(&directory);
    body.extend(b"PK\x05\x06\0\0\0\0");
    body.extend(count.to_le_bytes());
    body.extend(count.to_le_bytes());
    body.extend(length.to_le_bytes());
    body.extend(start.to_le_bytes());
    body.extend([0, 0]);
    writer.write_all(&body)
}
