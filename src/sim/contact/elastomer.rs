//! The dome as an elastic body, from a design.

use domecast_contact::Elastomer;
use domecast_design::Design;

/// The elastomer that a design names.
pub fn elastomer_of(design: &Design) -> Elastomer {
    let sections = design.sections();
    Elastomer {
        dome_radius_mm: sections.dome.radius_mm,
        center_z_mm: design.optics().dome().center_z_mm(),
        young_mpa: sections.elastomer.young_modulus_mpa,
        poisson: sections.elastomer.poisson_ratio,
        friction: sections.elastomer.friction,
    }
}
