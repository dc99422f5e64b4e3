//! Where a dot has to lie on the dome: by the pinhole alone, with refraction, with dispersion.

use glam::{DVec2, DVec3};
use nalgebra::{Matrix2, Vector2};

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::layout::Layout;
use domecast_optics::{ColorChannel, SensorOptics};

/// Newton steps of the reference: it starts within a pixel and ends at rounding after three.
const REFERENCE_STEPS: u32 = 6;

/// The sweep of models; `None` where the optics cannot be taken apart.
pub fn sweep(
    optics: &SensorOptics,
    layout: &Layout,
    asked_mm: Option<f64>,
    time_limit: TimeLimit,
) -> Option<Sweep> {
    let mut spec = optics.spec();
    let channels = ColorChannel::ALL.map(|channel| optics.for_channel(channel));
    for layer in &mut spec.layers {
        layer.index = [1.0; 3];
    }
    let clear = SensorOptics::new(&spec).ok()?;
    let pixels: Vec<DVec2> = layout.dots.iter().map(|dot| dot.image_px).collect();
    let trace = |optics: &SensorOptics, pixel: DVec2| optics.trace(pixel).ok().map(|hit| hit.surface_mm);
    let dome = optics.dome();
    let mean_trace = |pixel: DVec2| {
        let mut sum = DVec3::ZERO;
        for channel in &channels {
            sum += dome.outward_mm(trace(channel, pixel)?);
        }
        // On the sphere, where dots lie.
        Some(dome.center_mm() + sum.normalize() * dome.radius_mm())
    };
    let truth: Vec<Option<DVec3>> = pixels.iter().map(|&pixel| balanced(&channels, optics, pixel)).collect();
    type Place<'a> = &'a dyn Fn(DVec2) -> Option<DVec3>;
    let places: [(&str, Place<'_>); 3] = [
        ("lens and pinhole alone", &|pixel| trace(&clear, pixel)),
        ("with the layers' refraction", &|pixel| trace(optics, pixel)),
        ("mean of the three channels", &mean_trace),
    ];
    let mut samples = Vec::new();
    for (index, (label, place)) in places.iter().enumerate() {
        let off = pixels.iter().zip(&truth).map(|(&pixel, truth)| match (place(pixel), truth) {
            (Some(at), Some(truth)) => at.distance(*truth),
            _ => f64::NAN,
        });
        let time = time(time_limit, || pixels.iter().filter(|pixel| place(**pixel).is_some()).count());
        let (name, setting) = (("", (*label).to_owned()), index as f64 + 1.0);
        samples.push(SweepSample::of(name, setting, off, (time, pixels.len()), "dots off the dome"));
    }
    let saved = samples[0].rms_error / samples[1].rms_error.max(f64::MIN_POSITIVE);
    Some(
        Sweep {
            name: "placement",
            title: "A dot's place on the dome".into(),
            setting: "model",
            error: "distance from the place whose three images, red, green and blue, lie about the pixel",
            unit: "mm",
            item: "dot",
            items: pixels.len(),
            reference: "that place, solved to rounding through all channels".into(),
            floor: 1e-14 * optics.dome_radius_mm(),
            law: Law::Falls,
            observed: None,
            samples,
            in_use: Some(1),
            asked: asked_mm,
            meets: None,
            conclusion: format!(
                "Leaving refraction out costs {saved:.0} times the error; what the colours still disagree by is \
                 below any print's scatter."
            ),
        }
        .finish(),
    )
}

/// The place on the dome whose images in the three channels have their mean at the pixel.
fn balanced(channels: &[SensorOptics; 3], optics: &SensorOptics, pixel: DVec2) -> Option<DVec3> {
    let dome = optics.dome();
    let mut at = optics.trace(pixel).ok()?.surface_mm;
    for _ in 0..REFERENCE_STEPS {
        let (mut image, mut slope) = (DVec2::ZERO, nalgebra::Matrix2x3::zeros());
        for channel in channels {
            let (one, by_point) = channel.project_with_jacobian(at).ok()?;
            image += one / 3.0;
            slope += by_point / 3.0;
        }
        let normal = dome.normal(at);
        let (side, up) = normal.any_orthonormal_pair();
        let column = |v: DVec3| slope * nalgebra::Vector3::from(v.to_array());
        let (a, b) = (column(side), column(up));
        let off = pixel - image;
        let step = Matrix2::from_columns(&[a, b]).try_inverse()? * Vector2::new(off.x, off.y);
        let moved = dome.outward_mm(at) + side * step.x + up * step.y;
        at = dome.center_mm() + moved.normalize() * dome.radius_mm();
    }
    at.is_finite().then_some(at)
}
