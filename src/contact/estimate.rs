//! How far a level may be from the reference, before anything is solved.

use crate::elastomer::{Elastomer, Indenter};
use crate::level::{Level, MAX_ELEMENTS, elements_of};

/// Contact solves that a balance with the springs takes, as a rule, where none begins at another's end.
const SOLVES: f64 = 12.0;

/// What a level costs and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// No point of the surface is farther than this from the reference, mm.
    pub displacement_mm: f64,
    /// The force at a held pose is within this part of the reference's.
    pub force_part: f64,
    /// Of a whole balance with springs, in units of about a nanosecond of one core.
    pub work: f64,
    /// Once per dome, in the same units.
    pub setup_work: f64,
    /// Whether the level covers such objects; a closed form has none for a mesh, and says at a frame's solve
    /// where an edge touches.
    pub applies: bool,
}

/// A bound on a level's error for an object that lies `depth_mm` inside the undeformed dome, and its cost.
///
/// The local levels differ from the reference by a part of the depth that grows with depth / R: the geometric one
/// leaves out the sink around the object (measured 0.25 to 0.52 of the depth for balls of R/2 to 4 R and depths up to
/// R/10), the closed form has it, but in a half-space's shape (0.06 to 0.4). The linear level leaves out large strain,
/// of second order in depth / R, and has elements as long as h, which round an edge off by a part of it. The bounds
/// stand above all measured values; a test holds them.
pub fn estimate(level: Level, elastomer: &Elastomer, indenter: &Indenter, depth_mm: f64) -> Estimate {
    let radius = elastomer.dome_radius_mm;
    let depth = if depth_mm > 0.0 { depth_mm.min(radius) } else { 0.0 };
    let deep = depth / radius;
    let sharp = if indenter.solid.is_ball() { 0.0 } else { 0.15 };
    // Nodes that touch a plane, which touches most of all that is not hollow (Hertz: a^2 = R d), and half as many beside.
    let nodes = |h: f64| 4.0 + 1.5 * std::f64::consts::PI * radius * depth / (h * h);
    let large = 0.8 * deep * depth;
    // A mesh's distance is that of its faces near by.
    let local_work = SOLVES * if indenter.solid.is_mesh() { 2e7 } else { 1e5 };
    match level {
        Level::Geometric => Estimate {
            displacement_mm: (0.55 + sharp + 3.0 * deep) * depth,
            force_part: 0.3 + sharp + 2.0 * deep,
            work: local_work,
            setup_work: 0.0,
            applies: true,
        },
        Level::ClosedForm => Estimate {
            displacement_mm: (0.2 + 3.5 * deep) * depth,
            force_part: 0.15 + 2.0 * deep,
            work: if indenter.solid.is_ball() { SOLVES * 5e3 } else { local_work },
            setup_work: 0.0,
            applies: !indenter.solid.is_mesh(),
        },
        Level::FiniteStrain { across } => Estimate {
            displacement_mm: 0.01 * depth,
            force_part: 0.03,
            // Measured on a ball and a cube's edge, 4 to 8 elements across: 3e6 to 7e6.
            work: 5e6 * (across as f64).powi(4),
            setup_work: 0.0,
            applies: true,
        },
        Level::Linear { element_mm } => {
            let elements = elements_of(elastomer, element_mm).unwrap_or(MAX_ELEMENTS) as f64;
            let h = std::f64::consts::FRAC_PI_2 * radius / elements;
            let n = nodes(h);
            Estimate {
                displacement_mm: (0.1 + sharp) * h.min(4.0 * depth) + large,
                force_part: 0.1 + 0.1 * h / radius.min(h + depth) + 2.0 * deep,
                // Some 300 sweeps over 3 n forces in all trials of a balance with friction, a dozen products a unit.
                work: 800.0 * n * n + 2e4 * elements,
                // Harmonics, times unknowns and their fill, times right-hand sides, some at once.
                setup_work: 22_000.0 * elements.powi(3),
                applies: true,
            }
        }
    }
}

/// No object that lies `depth_mm` inside the undeformed dome presses harder than this, N.
///
/// Of convex ones a plate presses most: Hertz' force on the dome's radius, and half as much again for the bonded base
/// and large strain (measured: a quarter at R/10). A hollow one may hold the dome on all sides: a column of the dome's
/// base that cannot give way sideways.
pub fn max_force_n(elastomer: &Elastomer, indenter: &Indenter, depth_mm: f64) -> f64 {
    let depth_mm = depth_mm.max(0.0).min(elastomer.dome_radius_mm);
    let (radius, nu) = (elastomer.dome_radius_mm, elastomer.poisson);
    let modulus = elastomer.young_mpa / (1.0 - nu * nu);
    let plate_n = 1.5 * 4.0 / 3.0 * modulus * radius.sqrt() * depth_mm.powf(1.5);
    if indenter.solid.is_mesh() {
        let confined = elastomer.young_mpa * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
        plate_n.max(confined * std::f64::consts::PI * radius * depth_mm)
    } else {
        plate_n
    }
}
