//! What a pixel sees on the dome, through lens, air, acrylic and silicone, and the way back.
//!
//!     cargo run --release --example trace -- designs/thumb24.json 400 240

use std::path::Path;

use domecast::Design;
use domecast::glam::DVec2;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [design, u, v] = arguments.as_slice() else { return Err("usage: trace DESIGN U V".into()) };
    let pixel = DVec2::new(u.parse()?, v.parse()?);

    let design = Design::load(Path::new(design))?;
    let optics = design.optics();
    println!("pixel        {:.3}, {:.3}", pixel.x, pixel.y);
    match optics.trace(pixel) {
        Ok(seen) => {
            println!("field angle  {:.4} deg", seen.field_angle_rad.to_degrees());
            println!("surface      {:.4} mm (sensor frame)", seen.surface_mm);
            println!("seen again   {:.3} px", optics.project(seen.surface_mm)?);
        }
        // every pixel that sees nothing has a reason with a name, such as beyond_fold
        Err(limit) => println!("sees nothing {}", limit.as_str()),
    }
    Ok(())
}
