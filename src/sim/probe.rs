//! A short piece of the simulator's own work: what it takes tells how long a unit of counted work is on a machine.

use crate::effects::geometry_bound::called_for;
use crate::raster::sensor_state::count_points;
use crate::scene::Scene;
use crate::work::Work;

/// Follows the rays of all dots and markers at rest, as a frame does, and counts the work of it, in units of [`Work`].
///
/// Whoever has a clock can time it. Nothing that the simulator decides or draws depends on that time.
///
/// ```no_run
/// # let scene = domecast_sim::Scene::load(std::path::Path::new("designs/scenes/lit.json")).unwrap();
/// let start = std::time::Instant::now();
/// let units = domecast_sim::probe(&scene);
/// println!("{} s a unit", start.elapsed().as_secs_f64() / units as f64);
/// ```
pub fn probe(scene: &Scene) -> u64 {
    let dots = scene.dots().iter().map(|dot| dot.center_mm);
    let points = dots.chain(scene.markers().iter().map(|marker| marker.position_mm));
    let seen = points.map(|point| std::hint::black_box(scene.optics().project(point)));
    let count = seen.count() as u64;
    let mut work = Work::default();
    let geometry = called_for(scene);
    count_points(geometry, 1, scene.optics().lens().is_central(), count.max(1), &mut work);
    work.total()
}
