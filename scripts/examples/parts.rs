//! The parts of a design: their sizes, volumes and masses in PLA, and their meshes as STL.
//!
//!     cargo run --release --example parts -- designs/thumb24.json output/parts

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use domecast::Design;
use domecast::parts::{self, Measures};

const PLA_G_MM3: f64 = 1.24e-3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [design, out] = arguments.as_slice() else { return Err("usage: parts DESIGN FOLDER".into()) };

    let design = Design::load(Path::new(design))?;
    let layout = design.layout()?;
    fs::create_dir_all(out)?;
    // there is a printing jig for each pass of the pad
    for part in parts::build(&Measures::of(&design)?, &layout.passes)? {
        let size_mm = part.bounds.max_mm - part.bounds.min_mm;
        let grams = PLA_G_MM3 * part.volume_mm3;
        println!(
            "{:<16} {:>6} triangles  {grams:6.2} g  {size_mm:.2} mm",
            part.name,
            part.mesh.triangles.len()
        );
        let path = Path::new(out).join(format!("{}.stl", part.name));
        part.write_stl(&mut BufWriter::new(File::create(path)?))?;
    }
    Ok(())
}
