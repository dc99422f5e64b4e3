//! The shape of the skin from colour beside the forces on it: that nothing is allocated once they run, and that neither threads nor kept tables change anything.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ops::Range;

use domecast::shape::{Numbers, ShapeFromColor, ShapeMap, ShapeOptions};
use domecast::sim::scene::SceneFile;
use domecast::sim::{Around, Drawn, Plan, Renderer, Scene, Scratch};
use domecast::track::{CameraFrame, TrackOptions};
use domecast::traction::{ForceDistribution, LocalForces, PressureMap};
use serde_json::json;

use super::simulated::scenes;
use super::{SENSOR, tracker};

/// A ball that comes down beside the pole, is moved over the dome and lifted: lit, without noise.
fn pressed() -> Vec<Drawn> {
    let file = json!({
        "version": 1, "name": "pressed", "design": "../thumb24.json",
        "frames": { "count": 4, "rate_hz": 1, "colour": true }, "tolerance": { "px": 0.1, "grey": 1 },
        "contact": { "level": "linear", "element_mm": 1.0 },
        "objects": [{ "name": "ball", "shape": { "kind": "sphere", "radius_mm": 5 }, "path": [
            { "time_s": 0, "position_mm": [0, 0, 16] }, { "time_s": 1, "position_mm": [1, 0, 14.4] },
            { "time_s": 2, "position_mm": [2, 1, 14.2] }, { "time_s": 3, "position_mm": [2, 1, 16] },
        ]}],
        "light": { "leds": { "level_per_mw_mm2": 280 } },
    });
    let file: SceneFile = domecast::design::from_value(&file).expect("a scene's fields");
    let design = domecast::design::Design::load(&scenes().join("../thumb24.json")).expect("the design");
    let scene = Scene::new(file, &scenes(), design).expect("a scene");
    let plan = Plan::of(&scene).expect("a plan");
    let renderer = Renderer::new(&scene, &plan).expect("its effects");
    let mut stepper = renderer.stepper().expect("a contact").expect("an object");
    let mut touch = |number| stepper.next(number, scene.time_s(number), &mut Default::default());
    let touches: Vec<_> = (0..scene.frame_count()).map(|number| touch(number).expect("a touch")).collect();
    let mut scratch = Scratch::default();
    let mut frame = |number: u32| {
        let around = Around::of(&touches, number as usize);
        renderer.frame_around(number, around.as_ref(), &mut scratch).expect("a frame")
    };
    (0..scene.frame_count()).map(&mut frame).collect()
}

/// What the frames say, by a sensor that runs with so many threads, again and again from a rest; asserts that nothing is allocated once
/// each picture was seen.
fn measured(frames: &[CameraFrame<'_>]) -> Vec<(ShapeMap, LocalForces, Vec<f32>)> {
    let mut tracker = tracker(TrackOptions::default());
    let mut shape = ShapeFromColor::new(&SENSOR.constants, &tracker, ShapeOptions::default()).expect("light");
    let mut forces = ForceDistribution::new(&SENSOR.constants, None).expect("an elastomer");
    let mut pressure = PressureMap::default();
    shape.set_rest(&frames[0], tracker.track(0, &frames[0])).expect("a frame at rest");
    let mut run = |numbers: Range<u64>, see: &mut dyn FnMut(&ShapeMap, &LocalForces, &PressureMap)| {
        for number in numbers {
            let frame = &frames[number as usize % frames.len()];
            let tracked = tracker.track(number, frame);
            let map = shape.measure(frame, tracked).expect("a map");
            forces.update(tracked, Some(map));
            forces.draw_pressure(map, &mut pressure);
            assert_eq!(map.contact.is_some(), matches!(number % 4, 1 | 2), "frame {number}");
            see(map, forces.result(), &pressure);
        }
    };
    // Each picture once: room grows with what was seen.
    let mut all = Vec::new();
    run(1..5, &mut |map, forces, pressure| {
        all.push((map.clone(), forces.clone(), pressure.pressure_n_mm2.clone()));
    });
    let counted = allocation_counter::measure(|| run(5..13, &mut |_, _, _| ()));
    assert_eq!(counted.count_total, 0);
    all
}

#[test]
fn shape_and_forces_allocate_nothing_and_are_the_same_for_any_number_of_threads() {
    let drawn = pressed();
    let frames: Vec<CameraFrame<'_>> = drawn
        .iter()
        .map(|drawn| {
            let image = drawn.image.as_ref().expect("a picture");
            CameraFrame::new(image.width, image.height, image.channels, &image.bytes).expect("a frame")
        })
        .collect();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| measured(&frames))
    };
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
    let alone = with(1);
    for threads in [2, 5] {
        for ((map, forces, pressure), (other, other_forces, other_pressure)) in
            alone.iter().zip(with(threads))
        {
            assert_eq!(bits(&map.height_mm), bits(&other.height_mm), "{threads} threads");
            assert_eq!(bits(&map.height_sd_mm), bits(&other.height_sd_mm));
            assert_eq!(bits(pressure), bits(&other_pressure));
            assert_eq!(
                (&map.is_touched, &map.contact, &map.status),
                (&other.is_touched, &other.contact, &other.status)
            );
            assert_eq!(*forces, other_forces);
        }
    }
}

#[test]
fn kept_tables_of_the_light_change_nothing() {
    let drawn = pressed();
    let pictures: Vec<_> =
        drawn.iter().take(2).map(|drawn| drawn.image.as_ref().expect("a picture")).collect();
    let frames: Vec<CameraFrame<'_>> = pictures
        .iter()
        .map(|image| {
            CameraFrame::new(image.width, image.height, image.channels, &image.bytes).expect("a frame")
        })
        .collect();
    let kept = RefCell::new(BTreeMap::<String, Vec<f64>>::new());
    let made = Cell::new(0);
    let keeping = |key: &str, count: usize, make: &dyn Fn() -> Vec<f64>| {
        let numbers = kept
            .borrow_mut()
            .entry(key.to_owned())
            .or_insert_with(|| {
                made.set(made.get() + 1);
                make()
            })
            .clone();
        assert_eq!(numbers.len(), count, "{key:.40}");
        numbers
    };
    let read = |tables: Option<&Numbers<'_>>| {
        let mut tracker = tracker(TrackOptions::default());
        let options = ShapeOptions::default();
        let mut shape = match tables {
            Some(tables) => ShapeFromColor::with_tables(&SENSOR.constants, &tracker, options, tables),
            None => ShapeFromColor::new(&SENSOR.constants, &tracker, options),
        }
        .expect("light");
        shape.set_rest(&frames[0], tracker.track(0, &frames[0])).expect("a frame at rest");
        let map = shape.measure(&frames[1], tracker.track(1, &frames[1])).expect("a map");
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
        (bits(&map.height_mm), bits(&map.height_sd_mm), map.contact.clone())
    };
    let alone = read(None);
    assert!(alone.2.is_some(), "a touch");
    assert!(read(Some(&keeping)) == alone, "when they are made");
    assert_eq!(made.get(), 3, "on the dome, inside it, and what it throws on itself");
    assert!(read(Some(&keeping)) == alone, "when they are there");
    assert_eq!(made.get(), 3);
}
