//! A ball that rolls over the sprung dome: one frame's balance after another, by level and length of the elements; and
//! what a level takes once for a design.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use domecast::contact::{Contact, ContactSolid, Elastomer, Indenter, Level, Pressed};
use domecast::design::suspension_of;
use domecast::numeric::Rigid;
use domecast::springs::Suspension;
use glam::DVec3;

/// Force on the ball, N: a contact of a fifth of the dome's radius.
const FORCE_N: f64 = 3.0;

fn dome() -> Option<(Elastomer, Suspension)> {
    let path = format!("{}/designs/thumb24.json", env!("CARGO_MANIFEST_DIR"));
    let design = domecast::design::Design::load(path.as_ref()).ok()?;
    Some((domecast::sim::elastomer_of(&design), suspension_of(&design).ok()?))
}

fn pressed(
    contact: &Contact,
    ball: &Indenter,
    suspension: &Suspension,
    x_mm: f64,
    before: Option<&Pressed>,
) -> Option<Pressed> {
    let start = Rigid::from_translation(DVec3::new(x_mm, 0.0, 25.0));
    contact.press_with_force(ball, suspension, &start, -DVec3::Z, FORCE_N, before).ok()
}

fn levels(c: &mut Criterion) {
    let Some((elastomer, suspension)) = dome() else { return };
    let Ok(sphere) = ContactSolid::sphere(0.8 * elastomer.dome_radius_mm) else { return };
    let ball = Indenter::rigid(sphere);
    let linear = |part: f64| Level::Linear { element_mm: part * elastomer.dome_radius_mm };
    let frames = [
        ("geometric", Level::Geometric),
        ("closed form", Level::ClosedForm),
        ("linear, R/5", linear(0.2)),
        ("linear, R/10", linear(0.1)),
        ("linear, R/20", linear(0.05)),
        ("linear, R/40", linear(0.025)),
    ];
    for (name, level) in frames {
        let Ok(contact) = Contact::new(elastomer, level) else { continue };
        let mut before = pressed(&contact, &ball, &suspension, 0.0, None);
        // A few frames on the way, so that friction has one.
        for k in 1..4 {
            before = pressed(&contact, &ball, &suspension, 0.1 * f64::from(k), before.as_ref());
        }
        let Some(before) = before else { continue };
        let mut group = c.benchmark_group("contact frame");
        group.sample_size(10);
        group.bench_function(name, |b| {
            b.iter(|| pressed(&contact, &ball, &suspension, black_box(0.4), Some(&before)));
        });
        group.finish();
    }
    let mut group = c.benchmark_group("contact once");
    group.sample_size(10);
    for (name, part) in [("linear, R/5", 0.2), ("linear, R/10", 0.1), ("linear, R/20", 0.05)] {
        group.bench_function(name, |b| b.iter(|| Contact::new(black_box(elastomer), linear(part))));
    }
    group.finish();
}

criterion_group!(benches, levels);
criterion_main!(benches);
