//! The test target: marks on rings and spokes by which a pad's map is measured.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::LayoutSpec;
//! use domecast_design::layout::target::print_target;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let spec = LayoutSpec::of_design(&Design::load(THUMB24.as_ref())?)?;
//! let marks = print_target(&spec.transfer()?, &spec.print);
//! assert_eq!(marks[0].ring, 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DMat3, DVec2, DVec3};

use super::dot::{DotCurve, plate_outline};
use super::outline::Outline;
use super::region::sphere_point;
use crate::spec::sections::PrintSection;
use crate::transfer::TransferMap;

/// A mark of the test target.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetMark {
    /// Its number: 0 at the pole, then ring by ring, each counter-clockwise from +x.
    pub id: u32,
    /// Its ring, 0 at the pole.
    pub ring: u32,
    /// Its place on the ring, from +x.
    pub spoke: u32,
    /// Where it should land on the dome, frame of the print pass about the sphere's centre, mm.
    pub surface_mm: DVec3,
    /// Where it stands on the plate by the design's map, mm.
    pub plate_mm: DVec2,
    /// Its diameter on the dome, mm.
    pub diameter_mm: f64,
    /// Its outline on the plate, mm.
    pub outline: Outline,
}

/// Most rings; eight make 217 marks, with which the fit's own error is a tenth of the scatter.
const MAX_RINGS: u32 = 8;
/// Marks are this much wider on the dome than what can just be etched where the map is steepest.
const SURELY_PRINTED: f64 = 1.15;
/// The marks along +x are larger by this, so that a photograph shows which way round it is.
const BOLD: f64 = 1.3;

/// The test target of a pad: six more marks on each ring than on the one before, out to the wrap limit or to
/// the end of the map. Fewer rings where the marks would come too close on the plate.
pub fn print_target(transfer: &TransferMap, print: &PrintSection) -> Vec<TargetMark> {
    let radius_mm = transfer.dome_radius_mm();
    let reach_rad = print.wrap_limit_deg.to_radians().min(transfer.max_polar_rad());
    let mut marks = Vec::new();
    for rings in (2..=MAX_RINGS).rev() {
        // The outermost marks are fully inside the limit.
        let mut diameter_mm = SURELY_PRINTED * print.min_dot_mm / reach_rad.cos().max(0.2);
        diameter_mm = diameter_mm.min(0.3 * radius_mm);
        let outer_rad = (reach_rad - 0.5 * BOLD * diameter_mm / radius_mm).max(0.1 * reach_rad);
        marks = rings_of(transfer, print, rings, outer_rad, diameter_mm);
        if narrowest_gap_mm(&marks) >= print.min_gap_mm {
            break;
        }
    }
    marks
}

fn rings_of(
    transfer: &TransferMap,
    print: &PrintSection,
    rings: u32,
    outer_rad: f64,
    diameter_mm: f64,
) -> Vec<TargetMark> {
    let radius_mm = transfer.dome_radius_mm();
    let mut marks = Vec::new();
    for ring in 0..=rings {
        let polar_rad = outer_rad * f64::from(ring) / f64::from(rings);
        let around = (6 * ring).max(1);
        for spoke in 0..around {
            let azimuth_rad = std::f64::consts::TAU * f64::from(spoke) / f64::from(around);
            let surface_mm = sphere_point(radius_mm, polar_rad, azimuth_rad);
            let diameter_mm = if spoke == 0 && ring > 0 { BOLD * diameter_mm } else { diameter_mm };
            let curve = DotCurve::on_dome_of(radius_mm, surface_mm, diameter_mm);
            let placed = transfer.plate_from_dome(surface_mm);
            let outline = plate_outline(&curve, transfer, DMat3::IDENTITY, print.outline_mm());
            // A mark that the map does not hold is no part of the target; the ids of the others stay.
            if let (Ok(plate_mm), Ok(outline)) = (placed, outline) {
                let id = if ring == 0 { 0 } else { 3 * ring * (ring - 1) + 1 + spoke };
                marks.push(TargetMark { id, ring, spoke, surface_mm, plate_mm, diameter_mm, outline });
            }
        }
    }
    marks
}

/// Narrowest gap between two marks on the plate, mm, by the circles around their outlines.
fn narrowest_gap_mm(marks: &[TargetMark]) -> f64 {
    let half: Vec<f64> = marks.iter().map(|mark| 0.5 * mark.outline.widths().1).collect();
    let mut smallest = f64::INFINITY;
    for (i, (a, half_a)) in marks.iter().zip(&half).enumerate() {
        for (b, half_b) in marks[..i].iter().zip(&half) {
            // Only neighbours along a ring or from ring to ring can be near.
            if a.ring - b.ring <= 1 && a.plate_mm.distance(b.plate_mm) - half_a - half_b < smallest {
                smallest = smallest.min(super::zones::gap(&a.outline.polygon(4), &b.outline.polygon(4)));
            }
        }
    }
    smallest
}
