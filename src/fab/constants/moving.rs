//! What the springs carry: upper platform, sheet, dome and magnets, of the densities that the design gives.

use glam::DVec3;

use super::mass::{MassProperties, mass_of_mesh};
use domecast_design::Design;
use domecast_design::parts::{Measures, upper_platform};
use domecast_mesh::{Chord, TriMesh};
use domecast_runtime::constants::MovingMass;

/// Density of sintered neodymium-iron-boron, g/cm3: data sheets give 7.4 to 7.6.
const MAGNET_G_PER_CM3: f64 = 7.5;
/// Standard deviation of the mass over it: lights with their boards and wires, paint, ink and glue are not counted, nor half of the
/// springs; prints come out a few percent heavier or lighter.
const MASS_SD_PART: f64 = 0.1;
/// The same of a mass that the design states: it was weighed.
const WEIGHED_SD_PART: f64 = 0.02;
/// Tolerance of the mesh that the platform's volume is counted by, mm.
const CHORD_MM: f64 = 0.02;

/// Mass, centre and inertia of what moves with the upper platform, whose mesh is given.
pub fn moving_body(design: &Design, upper: &TriMesh) -> MassProperties {
    let sections = design.sections();
    let thickness_mm = design.sheet_thickness_mm();
    let [x, y] = sections.sheet.size_mm;
    let sheet = MassProperties::cuboid(
        DVec3::new(x, y, thickness_mm),
        DVec3::new(0.0, 0.0, -0.5 * thickness_mm),
        sections.sheet.density_g_per_cm3,
    );
    let dome = MassProperties::dome(&sections.dome.shape(), sections.elastomer.density_g_per_cm3);
    let mut all = mass_of_mesh(upper, sections.process.density_g_per_cm3).with(&sheet).with(&dome);
    if !design.is_rigid() {
        let magnets = &sections.magnets;
        let z_mm = sections.platforms.upper.underside_z_mm + 0.5 * magnets.thickness_mm;
        for at_mm in design.springs_at_mm() {
            let (size, center_mm) = ([magnets.diameter_mm, magnets.thickness_mm], at_mm.extend(z_mm));
            all = all.with(&MassProperties::disc(size, center_mm, MAGNET_G_PER_CM3));
        }
    }
    all
}

/// What the constants say of it: as the design states it, or by its parts; `None` where the upper platform cannot be made.
pub(super) fn moving_mass(design: &Design) -> Option<MovingMass> {
    if let Some(weighed) = design.sections().gravity.as_ref().filter(|weighed| weighed.moving_mass_g > 0.0) {
        return Some(MovingMass {
            mass_g: weighed.moving_mass_g,
            mass_sd_g: WEIGHED_SD_PART * weighed.moving_mass_g,
            center_of_mass_mm: weighed.center_of_mass_mm,
        });
    }
    let construction = upper_platform(&Measures::of(design).ok()?).ok()?;
    let upper = construction.solid(Chord::new(CHORD_MM).ok()?).ok()?.to_mesh();
    let body = moving_body(design, &upper);
    // a milligram and a micrometre: what a mesh's last digits do not change
    let rounded = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
    let mass_g = rounded(1e3 * body.mass_kg);
    Some(MovingMass {
        mass_g,
        mass_sd_g: rounded(MASS_SD_PART * mass_g),
        center_of_mass_mm: (1e3 * body.center_m).to_array().map(rounded),
    })
}
