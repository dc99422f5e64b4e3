//! The swept elements against exact solutions.

use super::body::Body;
use super::compliance::Compliance;
use super::*;
use crate::mechanics::contact::Elastomer;

fn silicone(poisson: f64) -> Elastomer {
    Elastomer { dome_radius_mm: 10.0, young_mpa: 0.56, poisson, friction: 0.6 }
}

#[test]
fn timing() {
    for n in [16, 32] {
        let began = std::time::Instant::now();
        let body = Body::new(&silicone(0.49), n).unwrap();
        let built = began.elapsed();
        let h = body.factor(5).unwrap();
        drop(h);
        let factored = began.elapsed() - built;
        let compliance = Compliance::new(&silicone(0.49), n).unwrap();
        println!(
            "{n} unknowns {} assemble {built:?} factor {factored:?} all {:?} bytes {} nodes {}",
            body.unknowns(),
            began.elapsed(),
            compliance.bytes(),
            compliance.grid.len()
        );
        let a = GridNode { ring: 0, step: 0 };
        println!("{}", compliance.between(a, a));
        let b = compliance.grid.node(compliance.grid.first[n / 2] + 3);
        println!("{}\n{}", compliance.between(b, b), compliance.between(a, b));
        // half-space far from the load: w = F (1-nu^2)/(pi E r)
        for ring in 1..n {
            let r = compliance.grid.place(GridNode { ring, step: 0 });
            let c = compliance.between(GridNode { ring, step: 0 }, a);
            let normal = r / 10.0;
            let w = c.col(1).dot(glam::DVec3::new(normal.x, normal.z, 0.0));
            let chord = (r - glam::DVec3::Z * 10.0).length();
            let half = 0.75 * (1.0 - 0.49f64.powi(2)) / 0.75 / (std::f64::consts::PI * 0.56 * chord);
            print!(
                "{:.3}:{:.4}/{:.4}={:.3} ",
                chord,
                w,
                half,
                (half - w) * silicone(0.49).plane_strain_mpa() * 10.0
            );
        }
        println!();
    }
}
