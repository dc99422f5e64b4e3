//! Makes and checks all parts of a design and writes their files, and nothing else: what
//! `scripts/compare_cadquery.py` times.
//!
//!     cargo bench --bench parts -- designs/thumb24.json FOLDER

use std::error::Error;
use std::path::Path;

use domecast::layout::PrintPass;
use domecast::parts::{Assembly, Measures, build, check_assembly, files};

fn main() -> Result<(), Box<dyn Error>> {
    // cargo adds a flag of its own
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let (Some(design), Some(folder)) = (arguments.next(), arguments.next()) else {
        // run with the other benches, without arguments: nothing to time
        println!("parts: cargo bench --bench parts -- DESIGN FOLDER");
        return Ok(());
    };
    let design = domecast::design::Design::load(Path::new(&design)).map_err(|error| error.to_string())?;
    let measures = Measures::of(&design)?;
    let parts = build(&measures, &[PrintPass::new(0.0, 0.0)])?;
    let assembly = Assembly::of(&measures, &parts)?;
    check_assembly(&measures, &parts, &assembly)?;
    for file in files(&design, &measures, &parts, &assembly)? {
        let path = Path::new(&folder).join(file.path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent)?;
        }
        std::fs::write(path, file.bytes)?;
    }
    Ok(())
}
