//! The lens's inverse: from a pixel to its ray.

use glam::{DVec2, DVec3};

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::layout::Layout;
use domecast_optics::camera::{Lens, LensModel};

/// Newton steps of the sweep.
const NEWTON_STEPS: [u32; 7] = [0, 1, 2, 3, 4, 5, 6];
/// Rounds of the fixed point; OpenCV's `undistortPoints` takes five by default.
const FIXED_POINT_ROUNDS: [u32; 6] = [2, 5, 10, 20, 40, 80];

/// The sweep for the pixels of the dots; `None` for a lens without distortion, which has nothing to invert.
pub fn sweep(lens: &Lens, layout: &Layout, asked_px: Option<f64>, time_limit: TimeLimit) -> Option<Sweep> {
    if lens.spec().model == LensModel::Pinhole {
        return None;
    }
    let pixels: Vec<DVec2> = layout.dots.iter().map(|dot| dot.image_px).collect();
    let error_px = |pixel: DVec2, ray: Option<DVec3>| match ray.and_then(|ray| lens.project(ray).ok()) {
        Some(again) => again.distance(pixel),
        None => f64::NAN,
    };
    let mut samples = Vec::new();
    let mut add =
        |method: &'static str, label: String, setting: f64, solve: &dyn Fn(DVec2) -> Option<DVec3>| {
            let errors = pixels.iter().map(|&pixel| error_px(pixel, solve(pixel)));
            let time = time(time_limit, || pixels.iter().filter(|pixel| solve(**pixel).is_some()).count());
            samples.push(SweepSample::of(
                (method, label),
                setting,
                errors,
                (time, pixels.len()),
                "pixels without a ray",
            ));
        };
    for rounds in FIXED_POINT_ROUNDS {
        let label = format!("fixed point, {rounds} rounds");
        add("fixed point", label, f64::from(rounds), &|pixel| fixed_point(lens, pixel, rounds));
    }
    for steps in NEWTON_STEPS {
        let label = format!("Newton from the pinhole's ray, {steps} steps");
        add("newton", label, f64::from(steps), &|pixel| newton(lens, pixel, steps));
    }
    add("table", "table and one Newton step".into(), 1.0, &|pixel| lens.unproject(pixel).ok());
    let in_use = samples.len() - 1;
    let span_px = lens.max_radius_px();
    Some(
        Sweep {
            name: "lens",
            title: "The ray of a pixel".into(),
            setting: "steps",
            error: "distance of the ray's own pixel from the one asked for, the worst of the dots",
            unit: "px",
            item: "pixel",
            items: pixels.len(),
            reference: "the pixel itself, which the lens's formula takes the ray back to".into(),
            floor: 4.0 * f64::EPSILON * span_px,
            law: Law::Steps { order: 2.0 },
            observed: None,
            samples,
            in_use: Some(in_use),
            asked: asked_px,
            meets: None,
            conclusion: "Exact rays cost less than rough ones: there is nothing to choose.".into(),
        }
        .finish(),
    )
}

/// The point of the plane z = 1 that a pixel would show without distortion.
fn plain(lens: &Lens, pixel: DVec2) -> DVec2 {
    let [[fx, skew, cx], [_, fy, cy], _] = lens.spec().matrix;
    let y = (pixel.y - cy) / fy;
    DVec2::new((pixel.x - cx - skew * y) / fx, y)
}

/// `x <- x + (y - f(x)) / (|f(x)| / |x|)`: OpenCV's iteration where distortion is radial.
fn fixed_point(lens: &Lens, pixel: DVec2, rounds: u32) -> Option<DVec3> {
    let wanted = plain(lens, pixel);
    let mut at = wanted;
    for _ in 0..rounds {
        let image = plain(lens, lens.project(at.extend(1.0)).ok()?);
        let size = at.length();
        let factor = if size > 0.0 { image.length() / size } else { 1.0 };
        at += (wanted - image) / factor;
    }
    at.is_finite().then(|| at.extend(1.0).normalize())
}

fn newton(lens: &Lens, pixel: DVec2, steps: u32) -> Option<DVec3> {
    let mut at = plain(lens, pixel);
    for _ in 0..steps {
        let (image, slope) = lens.project_with_jacobian(at.extend(1.0)).ok()?;
        let off = pixel - image;
        let slope = glam::DMat2::from_cols(
            DVec2::new(slope[(0, 0)], slope[(1, 0)]),
            DVec2::new(slope[(0, 1)], slope[(1, 1)]),
        );
        at += slope.inverse() * off;
    }
    at.is_finite().then(|| at.extend(1.0).normalize())
}
