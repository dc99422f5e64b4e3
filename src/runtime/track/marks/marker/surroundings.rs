//! The fit of a disc whose surroundings differ from side to side.
//!
//! Light scattered at the rim, a dome whose image is wider than the constants have it, a bright or dark speck beside: what
//! one level of ground does not explain pulls the disc's place. Here each octant has a ground of its own, the outline's
//! radius and softness and the disc's slope are free too, and octants that do not look like a disc's edge even then are left
//! out.

use glam::DVec2;
use nalgebra::{SMatrix, SVector};

use super::candidates::MIN_RISE;
use super::geometry::{EDGE_PX, Geometry, SECTORS, edge};
use super::view::MarkerView;
use crate::track::frame::Plane;

const MAX_STEPS: u32 = 12;
/// A step below this ends the fit, px.
const CONVERGED_PX: f64 = 2e-3;
const MAX_STEP_PX: f64 = 1.0;
/// Farther from the plain fit the place is another one's, px.
const MAX_MOVE_PX: f64 = 2.0;
/// The outline may be so much larger or smaller than the constants have it, px.
const MAX_OUTWARDS_PX: f64 = 1.5;
/// Half of an edge's width, px.
const MIN_SOFT_PX: f64 = 0.6;
const MAX_SOFT_PX: f64 = 3.0;
/// Octants that a disc needs: half of its outline.
const MIN_OCTANTS: usize = 4;
/// An octant is left out whose rms is more than this part of the contrast, and than this times the octants' median.
const MAX_MISFIT: f64 = 0.04;
const MAX_MEDIANS: f64 = 3.0;
/// What the place moves by against the plain fit is known to this part of it only.
const MOVED_PART: f64 = 0.4;
/// Columns beside each octant's ground: disc, place (x, y), outline outwards, softness, dome, slope of the disc (x, y).
const UNKNOWNS: usize = 8;

type Unknowns = SVector<f64, UNKNOWNS>;
type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// A disc as it was fitted apart from its surroundings.
pub(super) struct ApartFit {
    pub centroid_px: DVec2,
    /// Variance of the place on each axis by the scatter of single pixels, and by what octants pull it each its own way and
    /// the surroundings moved it.
    pub noise_px2: f64,
    pub unlike_px2: f64,
    /// Part of the contrast that is left unexplained, by rms.
    pub misfit: f64,
}

/// What is fitted.
#[derive(Clone, Copy)]
struct Model {
    at: DVec2,
    disc: f64,
    slope: DVec2,
    outwards_px: f64,
    soft_px: f64,
    dome: f64,
    grounds: [f64; SECTORS],
}

/// Normal equations of an octant, its own ground eliminated.
#[derive(Clone, Copy)]
struct Octant {
    normal: Normal,
    right: Unknowns,
    /// Of the ground: its column's square, products with the other columns and with the residuals.
    ground: f64,
    with_ground: Unknowns,
    ground_right: f64,
    squares: f64,
    count: f64,
}

impl Octant {
    const EMPTY: Self = Self {
        normal: Normal::from_array_storage(nalgebra::ArrayStorage([[0.0; UNKNOWNS]; UNKNOWNS])),
        right: Unknowns::from_array_storage(nalgebra::ArrayStorage([[0.0; UNKNOWNS]; 1])),
        // Where nothing of the ground is seen its level stays.
        ground: 1e-3,
        with_ground: Unknowns::from_array_storage(nalgebra::ArrayStorage([[0.0; UNKNOWNS]; 1])),
        ground_right: 0.0,
        squares: 0.0,
        count: 0.0,
    };

    fn add(&mut self, row: &Unknowns, ground: f64, rest: f64) {
        self.normal.ger(1.0, row, row, 1.0);
        self.right.axpy(rest, row, 1.0);
        self.ground += ground * ground;
        self.with_ground.axpy(ground, row, 1.0);
        self.ground_right += ground * rest;
        self.squares += rest * rest;
        self.count += 1.0;
    }

    fn eliminate_ground(&mut self) {
        self.normal.ger(-1.0 / self.ground, &self.with_ground, &self.with_ground, 1.0);
        self.right.axpy(-self.ground_right / self.ground, &self.with_ground, 1.0);
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count.max(1.0)).sqrt()
    }
}

impl Model {
    fn octants(&self, geometry: &Geometry, view: &MarkerView, plane: &Plane<'_>) -> [Octant; SECTORS] {
        let mut octants = [Octant::EMPTY; SECTORS];
        let (cx, cy) = (self.at.x.round() as i32, self.at.y.round() as i32);
        for y in cy - view.half_px..=cy + view.half_px {
            for x in cx - view.half_px..=cx + view.half_px {
                let from = DVec2::new(f64::from(x), f64::from(y)) - self.at;
                let Some(pixel) = geometry.pixel(from) else { continue };
                let outside_px = pixel.outside_px - self.outwards_px;
                let (disc, disc_slope) = edge(outside_px, self.soft_px);
                let around = self.grounds[pixel.sector] + pixel.dome * self.dome;
                let white = self.disc + self.slope.dot(from);
                // Outwards the model changes so much by a pixel.
                let by_px = disc_slope * (white - around);
                let by_place = pixel.gradient * (-by_px / pixel.steep);
                let ground = 1.0 - disc;
                let row = Unknowns::from([
                    disc,
                    by_place.x,
                    by_place.y,
                    -by_px,
                    -by_px * outside_px / self.soft_px,
                    ground * pixel.dome,
                    disc * from.x,
                    disc * from.y,
                ]);
                let rest = f64::from(plane.at(x, y)) - ground * around - disc * white;
                octants[pixel.sector].add(&row, ground, rest);
            }
        }
        octants.iter_mut().for_each(Octant::eliminate_ground);
        octants
    }

    /// Steps until the place stays; the octants there and the inverse of the normal matrix. `None` where it does not.
    fn converge(
        &mut self,
        geometry: &Geometry,
        view: &MarkerView,
        plane: &Plane<'_>,
        is_kept: &[bool; SECTORS],
    ) -> Option<([Octant; SECTORS], Normal)> {
        let start = self.at;
        for count in 0..MAX_STEPS {
            let octants = self.octants(geometry, view, plane);
            let kept = || octants.iter().zip(is_kept).filter(|(_, kept)| **kept).map(|(octant, _)| octant);
            let mut normal: Normal = kept().map(|octant| octant.normal).sum();
            // What hardly enters the window has no level of its own.
            normal[(5, 5)] += 0.5;
            for i in 0..UNKNOWNS {
                normal[(i, i)] += 1e-9;
            }
            let inverse = normal.cholesky()?.inverse();
            let step = inverse * kept().map(|octant| octant.right).sum::<Unknowns>();
            let shift = DVec2::new(step[1], step[2]).clamp_length_max(MAX_STEP_PX);
            self.at += shift;
            if !(self.at.is_finite() && self.at.distance(start) < MAX_MOVE_PX) {
                return None;
            }
            self.disc += step[0];
            self.outwards_px = (self.outwards_px + step[3]).clamp(-MAX_OUTWARDS_PX, MAX_OUTWARDS_PX);
            self.soft_px = (self.soft_px + step[4]).clamp(MIN_SOFT_PX, MAX_SOFT_PX);
            self.dome += step[5];
            self.slope += DVec2::new(step[6], step[7]);
            for (ground, octant) in self.grounds.iter_mut().zip(&octants) {
                *ground += (octant.ground_right - octant.with_ground.dot(&step)) / octant.ground;
            }
            // The levels follow the first step.
            if count > 1 && shift.length() < CONVERGED_PX {
                return Some((octants, inverse));
            }
        }
        None
    }
}

/// The disc that a plain fit put `at`, with those levels of ground, disc and dome, apart from its surroundings; `None` where
/// less than half of the outline looks like a disc's.
pub(super) fn fit_apart(
    view: &MarkerView,
    plane: &Plane<'_>,
    at: DVec2,
    [ground, disc, dome]: [f64; 3],
) -> Option<ApartFit> {
    let geometry = Geometry::new(view);
    let mut model = Model {
        at,
        disc: ground + disc,
        slope: DVec2::ZERO,
        outwards_px: 0.0,
        soft_px: EDGE_PX,
        dome,
        grounds: [ground; SECTORS],
    };
    let mut is_kept = [true; SECTORS];
    loop {
        let (octants, inverse) = model.converge(&geometry, view, plane, &is_kept)?;
        let rise = model.disc - median(model.grounds);
        let misfits = octants.map(|octant| octant.rms());
        let limit = f64::max(MAX_MISFIT * rise, MAX_MEDIANS * median(misfits));
        let kept = || (0..SECTORS).filter(|i| is_kept[*i]);
        let worst = kept().max_by(|a, b| misfits[*a].total_cmp(&misfits[*b]))?;
        if misfits[worst] > limit {
            if kept().count() == MIN_OCTANTS {
                return None;
            }
            is_kept[worst] = false;
            continue;
        }
        let (squares, count) =
            kept().fold((0.0, 0.0), |(s, n), i| (s + octants[i].squares, n + octants[i].count));
        let variance = squares / f64::max(count - UNKNOWNS as f64 - SECTORS as f64, 1.0);
        let noise_px2 = 0.5 * variance * (inverse[(1, 1)] + inverse[(2, 2)]);
        let pulled_px2 =
            0.5 * kept().map(|i| place_of(&(inverse * octants[i].right)).length_squared()).sum::<f64>();
        let moved_px = MOVED_PART * model.at.distance(at);
        let is_disc = rise > MIN_RISE && (noise_px2 + pulled_px2).is_finite();
        return is_disc.then_some(ApartFit {
            centroid_px: model.at,
            noise_px2,
            unlike_px2: pulled_px2 + moved_px * moved_px,
            misfit: variance.sqrt() / rise,
        });
    }
}

fn place_of(step: &Unknowns) -> DVec2 {
    DVec2::new(step[1], step[2])
}

/// The middle of eight values.
fn median(mut values: [f64; SECTORS]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    0.5 * (values[SECTORS / 2 - 1] + values[SECTORS / 2])
}
