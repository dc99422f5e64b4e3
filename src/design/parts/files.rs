//! Everything that is written about the parts.

use std::io;

use rayon::prelude::*;

use super::assembly::{Assembly, AssemblyItem};
use super::measures::Measures;
use super::{Part, PartError, bom, drawing};
use crate::spec::Design;
use domecast_mesh::{
    GlbItem, GlbScene, PictureItem, StepError, View, shade, write_3mf, write_glb, write_step,
};

/// A file of a build.
#[derive(Debug, Clone)]
pub struct PartFile {
    /// Path below the build's folder, with `/`.
    pub path: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// Size of the pictures, px.
const PICTURE: (u32, u32) = (480, 360);
const VIEW: View = View { azimuth_deg: -60.0, elevation_deg: 35.0 };

/// A part's STEP: exact faces where they can be built, else its triangles, and `_faceted` in the title.
fn step(part: &Part) -> Result<String, StepError> {
    match part.exact_solid() {
        Some(solid) => write_step(&solid, &part.name),
        None => write_step(&part.mesh.faceted_solid(), &format!("{}_faceted", part.name)),
    }
}

/// All files of the parts: for each part STL, 3MF, STEP and a picture; the
/// sheet's drawings, the assembly, the bill of materials. In a fixed order;
/// the bytes depend on the design alone.
///
/// # Errors
/// [`PartError::Unwritable`] if a writer refuses, which takes a mesh too large
/// for its format.
pub fn files(
    design: &Design,
    m: &Measures,
    parts: &[Part],
    assembly: &Assembly,
) -> Result<Vec<PartFile>, PartError> {
    let refused = |path: &str, error: &dyn std::fmt::Display| PartError::Unwritable {
        path: path.to_owned(),
        problem: error.to_string(),
    };
    let written = |path: String, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        let mut bytes = Vec::new();
        write(&mut bytes).map_err(|error| refused(&path, &error))?;
        Ok(PartFile { path, bytes })
    };
    let mut out = parts
        .par_iter()
        .map(|part| {
            let name = &part.name;
            let step_path = format!("parts/{name}.step");
            let step = step(part).map_err(|error| refused(&step_path, &error))?;
            let picture =
                [PictureItem { mesh: &part.mesh, shift_mm: glam::DVec3::ZERO, color: [0.72, 0.79, 0.88] }];
            Ok(vec![
                written(format!("parts/{name}.stl"), &|w| part.write_stl(w))?,
                written(format!("parts/{name}.3mf"), &|w| write_3mf(&[(name, &part.mesh)], w))?,
                PartFile { path: step_path, bytes: step.into_bytes() },
                png(format!("report/{name}.png"), &picture, VIEW)?,
            ])
        })
        .collect::<Result<Vec<_>, PartError>>()?
        .concat();
    out.push(PartFile { path: "parts/acrylic_sheet.dxf".into(), bytes: drawing::dxf(m).into_bytes() });
    out.push(PartFile { path: "parts/acrylic_sheet.svg".into(), bytes: drawing::svg(m).into_bytes() });
    out.push(written("parts/assembly.glb".into(), &|w| glb(assembly, w))?);
    out.push(PartFile { path: "parts/bom.csv".into(), bytes: bom::bom(design, m, parts).into_bytes() });
    let item = |item: &AssemblyItem| {
        let [r, g, b, _] = item.color;
        [r, g, b]
    };
    let picture = |name: &str, exploded: f64| {
        let items: Vec<PictureItem<'_>> = assembly
            .items
            .iter()
            .map(|i| PictureItem { mesh: &i.mesh, shift_mm: exploded * i.explode_mm, color: item(i) })
            .collect();
        let view = View { elevation_deg: 22.0, ..VIEW };
        png(format!("report/{name}.png"), &items, view)
    };
    let (closed, exploded) =
        rayon::join(|| picture("assembly-closed", 0.0), || picture("assembly-exploded", 1.0));
    out.extend([closed?, exploded?]);
    Ok(out)
}

fn glb(assembly: &Assembly, writer: &mut Vec<u8>) -> io::Result<()> {
    let items: Vec<GlbItem<'_>> =
        assembly.items.iter().map(|i| GlbItem { name: &i.name, color: i.color, mesh: &i.mesh }).collect();
    let scenes = [
        GlbScene { name: "closed".into(), shift_mm: Vec::new() },
        GlbScene { name: "exploded".into(), shift_mm: assembly.items.iter().map(|i| i.explode_mm).collect() },
    ];
    write_glb(&items, &scenes, writer)
}

fn png(path: String, items: &[PictureItem<'_>], view: View) -> Result<PartFile, PartError> {
    let (width, height) = PICTURE;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&shade(items, view, width, height)))
        .map_err(|error| PartError::Unwritable { path: path.clone(), problem: error.to_string() })?;
    Ok(PartFile { path, bytes })
}
