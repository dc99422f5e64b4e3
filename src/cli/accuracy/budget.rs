//! What the final position of a dot, and the final force, owe to each step: so that nobody pays for digits that the
//! print shop throws away.

use glam::DVec3;
use nalgebra::Vector6;
use serde::Serialize;

use super::pose::sightings;
use super::sweep::Sweep;
use domecast_design::Design;
use domecast_design::layout::Layout;
use domecast_design::layout::report::LayoutReport;
use domecast_design::settings::{TolerancedOptics, toleranced_optics};
use domecast_design::{claims_of, suspension_of};
use domecast_fab::constants::{markers_of, resolution_at};
use domecast_fab::light::marker_noise_px;
use domecast_fab::numbers::significant;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::{Marker, PoseOptions, PoseSolver};
use domecast_runtime::constants::{Constants, matrix_of};
use domecast_springs::Displacement;

/// What one step adds, as one standard deviation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorShare {
    /// The step, in words.
    pub step: String,
    /// The field of the design that sets it, or the sweep that measured it.
    pub source: String,
    /// Whether it comes from computing (more time makes it smaller) or from making and measuring (it does not).
    pub computed: bool,
    /// How much, in the budget's unit.
    pub amount: f64,
}

/// A sum of independent errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorBudget {
    /// What is summed up.
    pub title: String,
    /// Unit of all amounts.
    pub unit: &'static str,
    /// The shares, the largest first.
    pub shares: Vec<ErrorShare>,
    /// Root of the sum of squares.
    pub total: f64,
    /// The same of the shares from computing alone.
    pub computed: f64,
}

impl ErrorBudget {
    fn of(title: String, unit: &'static str, mut shares: Vec<ErrorShare>) -> Self {
        shares.retain(|share| share.amount.is_finite());
        shares.sort_by(|a, b| b.amount.total_cmp(&a.amount).then_with(|| a.step.cmp(&b.step)));
        let root = |which: &dyn Fn(&ErrorShare) -> bool| {
            shares.iter().filter(|s| which(s)).map(|s| s.amount * s.amount).sum::<f64>().sqrt()
        };
        let (total, computed) = (root(&|_| true), root(&|share| share.computed));
        Self { title, unit, shares, total, computed }
    }
}

/// Image px for a mm on the dome, and for a mm that the dome is too large, root mean squares over the dots.
pub fn scales(optics: &SensorOptics, layout: &Layout) -> Option<(f64, f64)> {
    let (mut along, mut outwards, mut count) = (0.0, 0.0, 0.0);
    for dot in &layout.dots {
        let Ok((_, slope)) = optics.project_with_jacobian(dot.surface_mm) else { continue };
        let (side, up) = dot.normal.any_orthonormal_pair();
        let by = |v: DVec3| (slope * nalgebra::Vector3::from(v.to_array())).norm_squared();
        along += 0.5 * (by(side) + by(up));
        outwards += by(dot.normal);
        count += 1.0;
    }
    let root = |sum: f64| (sum / count).sqrt();
    (count > 0.0 && along > 0.0).then(|| (root(along), root(outwards)))
}

/// Where a dot ends up on the dome, mm.
pub fn of_dots(
    design: &Design,
    layout: &Layout,
    judged: &LayoutReport,
    sweeps: &[Sweep],
) -> Option<ErrorBudget> {
    let (px_per_mm, px_per_radius_mm) = scales(design.optics(), layout)?;
    let sections = design.sections();
    let mut shares = Vec::new();
    let mut add = |step: &str, source: String, computed: bool, amount: f64| {
        shares.push(ErrorShare { step: step.to_owned(), source, computed, amount });
    };
    let in_use = |name: &str| {
        let sweep = sweeps.iter().find(|sweep| sweep.name == name)?;
        sweep.in_use.and_then(|index| sweep.samples.get(index)).map(|sample| sample.rms_error)
    };
    for (name, step, per_mm) in [
        ("lens", "inverse of the lens", px_per_mm),
        ("placement", "what the colours disagree by", 1.0),
        ("outline", "outline on the film", 1.0),
    ] {
        if let Some(error) = in_use(name) {
            add(step, format!("sweep {name}"), true, error / per_mm);
        }
    }
    // a pixel's rounding is even over its width: its sd is the width over the root of 12
    let film_mm = 25.4 / f64::from(sections.print.dpi) / 12_f64.sqrt();
    add("pixels of the film, at an edge", "print.dpi".into(), true, film_mm);
    // errors of the dome's radius are seen as shifts of the dots
    let seen = px_per_radius_mm / px_per_mm;
    let chord_mm = design.settings().optical_chord_tolerance_mm.value;
    add(
        "facets of the mould",
        "mesh.optical_chord_tolerance_mm".into(),
        true,
        seen * chord_mm / 3_f64.sqrt(),
    );
    // an accuracy of plus or minus so much is taken as two standard deviations
    let printer_mm = 0.5 * sections.process.tolerance_mm;
    add("printer of the mould", "process.tolerance_mm".into(), false, seen * printer_mm);
    for share in judged.tolerances.iter().flat_map(|report| &report.ranking) {
        let step = share.tolerance.trim_end_matches("_mm").trim_end_matches("_deg").replace('_', " ");
        add(&step, format!("tolerances.{}", share.tolerance), false, share.mean_shift_px / px_per_mm);
    }
    let title = "Where a dot ends up on the dome, one standard deviation".to_owned();
    Some(ErrorBudget::of(title, "mm", shares))
}

/// What a force reads, N, under the design's largest claimed force; `None` where the pose cannot be followed.
pub fn of_force(design: &Design, constants: &Constants, sweeps: &[Sweep]) -> Option<ErrorBudget> {
    let sections = design.sections();
    let suspension = suspension_of(design).ok()?;
    let (claim, case) = sections
        .loads
        .claims
        .iter()
        .zip(claims_of(design, &suspension))
        .max_by(|a, b| size(&a.0.force_n).total_cmp(&size(&b.0.force_n)))?;
    let force_n = size(&claim.force_n);
    let pose = case.equilibrium.as_ref().ok()?.pose;
    let optics = design.optics();
    let markers = markers_of(design);
    let noise_px = marker_noise_px(design).ok()?;
    let at_mm = suspension.at_mm();
    let stiffness = matrix_of(&constants.springs.as_ref()?.stiffness);
    // the gate is wide: what is off by a tolerance must be read, not refused
    let solver = PoseSolver::new(optics, &markers, PoseOptions::new(1.0, 10.0)).ok()?;
    let read = |optics: &SensorOptics, markers: &[Marker]| -> Option<Vector6<f64>> {
        let rest = solver.solve(&sightings(optics, markers, &Rigid::identity())?).ok()?.pose;
        let held = solver.solve(&sightings(optics, markers, &pose)?).ok()?.pose;
        let d = Displacement::of_pose(&rest.inverse().compose(&held), at_mm);
        Some(stiffness * Vector6::from(d.to_array()))
    };
    let nominal = read(optics, &markers)?;
    let off = |found: Option<Vector6<f64>>| {
        found.map_or(f64::NAN, |found| (found - nominal).fixed_rows::<3>(0).norm())
    };
    let mut shares = Vec::new();
    let mut add = |step: &str, source: &str, computed: bool, amount: f64| {
        shares.push(ErrorShare { step: step.into(), source: source.into(), computed, amount });
    };
    if let Some(sample) =
        sweeps.iter().find(|l| l.name == "pose").and_then(|l| l.samples.get(l.in_use.unwrap_or(usize::MAX)))
    {
        add("pose solver", "sweep pose", true, sample.rms_error);
    }
    if let Some(found) = resolution_at(optics, &markers, &noise_px, &suspension, &pose) {
        let sd = found.wrench_sd[..3].iter().map(|sd| sd * sd).sum::<f64>().sqrt();
        add("centroid noise of one frame", "exposure.pixel_noise_levels", false, sd);
    }
    let t = &sections.tolerances;
    for TolerancedOptics { what, field, sensors } in toleranced_optics(optics, t) {
        let squares: f64 = sensors.iter().map(|sensor| off(read(sensor, &markers)).powi(2)).sum();
        add(what, field, false, squares.sqrt());
    }
    let mut squares = 0.0;
    for index in 0..2 * markers.len() {
        let mut moved = markers.clone();
        let axis = if index % 2 == 0 { DVec3::X } else { DVec3::Y };
        if let Some(marker) = moved.get_mut(index / 2) {
            marker.position_mm += axis * t.white_marker_mm;
        }
        squares += off(read(optics, &moved)).powi(2);
    }
    add("white markers' places", "tolerances.white_marker_mm", false, squares.sqrt());
    // k ~ d^4 / D^3 (Wahl 1963), D the coils' mean diameter
    let (wire, mean) = (
        sections.springs.wire_diameter_mm,
        sections.springs.outer_diameter_mm - sections.springs.wire_diameter_mm,
    );
    let by_wire = (4.0 / wire + 3.0 / mean) * t.wire_diameter_mm;
    add("springs' wire, before a calibration", "tolerances.wire_diameter_mm", false, force_n * by_wire);
    let by_coil = 3.0 / mean * t.spring_diameter_mm;
    add("springs' diameter, before a calibration", "tolerances.spring_diameter_mm", false, force_n * by_coil);
    let title = format!(
        "Force read under \"{}\" ({} N), relative to rest, one standard deviation",
        claim.name,
        significant(force_n)
    );
    Some(ErrorBudget::of(title, "N", shares))
}

fn size(force_n: &[f64; 3]) -> f64 {
    DVec3::from_array(*force_n).length()
}
