//! The dots of a design: what they are on the dome and on the plate, and the films that print them.
//!
//!     cargo run --release --example dots -- designs/thumb24.json output/films

use std::fs;
use std::path::Path;

use domecast::{Design, Films};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [design, out] = arguments.as_slice() else { return Err("usage: dots DESIGN FOLDER".into()) };

    let design = Design::load(Path::new(design))?;
    let layout = design.layout()?;
    println!("{} dots, {} left out, {:.2} px apart", layout.dots.len(), layout.lost.len(), layout.pitch_px);
    println!("id,u_px,v_px,x_mm,y_mm,z_mm,plate_x_mm,plate_y_mm,diameter_mm");
    for dot in &layout.dots {
        let (image, surface, plate) = (dot.image_px, dot.surface_mm, dot.plate_mm);
        print!("{},{:.3},{:.3},", dot.id, image.x, image.y);
        print!("{:.4},{:.4},{:.4},", surface.x, surface.y, surface.z);
        println!("{:.4},{:.4},{:.4}", plate.x, plate.y, dot.diameter_mm);
    }

    fs::create_dir_all(out)?;
    for pass in 0..layout.passes.len() {
        fs::write(Path::new(out).join(format!("film-{}.svg", pass + 1)), layout.film(pass).to_svg()?)?;
    }
    Ok(())
}
