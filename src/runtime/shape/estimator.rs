//! The stages in their order, frame by frame.

use glam::Vec3A;
use rayon::prelude::*;

use super::cells::{Cells, View};
use super::contact::{Chart, MIN_DEPTH_MM};
use super::deviation::Deviations;
use super::error::ShapeError;
use super::fill::{Pyramid, Weighted};
use super::lattice::Lattice;
use super::levels::{self, Level};
use super::light::{Prepare, ShapeLight};
use super::lights::Lights;
use super::map::{ShapeMap, Skin};
use super::marks::Marks;
use super::normals::CellReading;
use super::options::ShapeOptions;
use super::rest::RestMap;
use super::rows::{self, MIN_ROWS, share};
use super::system::{END_MM, Joint, SolveStatus, System};
use super::volume::Volume;
use crate::constants::Constants;
use crate::track::{CameraFrame, Tracked, Tracker};
use domecast_light::tables::{Numbers, Prepared, Ways};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// The largest motion, mm, after which a pass more changes nothing.
const STILL_MM: f64 = 0.03;

/// Change of the way between two cells from which on their normal is read again, mm: some hundredths of a radian.
const STILL_STEP_MM: f64 = 0.005;

/// How closely the passes before the last are solved, mm.
const PASS_END_MM: f64 = 3e-3;

/// Most by which the skin moves, part of its height over the sheet: it is bonded at the rim.
const MAX_STRAIN: f32 = 0.5;

/// Reads the shape of the skin from the colours of frames.
#[derive(Debug, Clone)]
pub struct ShapeFromColor {
    pub(super) options: ShapeOptions,
    pub(super) light: ShapeLight,
    marks: Marks,
    pub(super) cells: Cells,
    rest_optics: SensorOptics,
    pub(super) optics: SensorOptics,
    /// Constants without white markers are those of a rigid mount.
    pub(super) is_rigid: bool,
    pub(super) rest: Option<RestMap>,
    ways: Ways,
    pub(super) lights: Lights,
    volume: Volume,
    /// As it stood in the frame at rest.
    pub(super) rest_seen: SensorOptics,
    pub(super) view: View,
    pub(super) levels: Vec<Level>,
    pub(super) covered: Vec<bool>,
    /// Deviation of a pixel's light by noise, full scale 1.
    pub(super) noise: Vec3A,
    differences: Vec<f32>,
    pub(super) gain: Vec<Vec3A>,
    /// By how much a reading's normal turns where the point lies 1 mm further along its ray, for the same colours.
    pub(super) turn_per_mm: Vec<Vec3A>,
    pub(super) turns: Lattice,
    /// By how many cells a place of the dome is seen beside where it was at rest.
    pub(super) shifts: Lattice,
    readings: Vec<CellReading>,
    /// How far each cell had moved when it was read, mm, and whether it is to be read again.
    read_mm: Vec<f64>,
    is_stale: Vec<bool>,
    /// The readings' tilts, filled in.
    tilt: Vec<Weighted>,
    deviations: Deviations,
    pyramid: Pyramid,
    system: System,
    chart: Chart,
    /// How far each cell's point has moved along its ray, mm.
    pub(super) moved_mm: Vec<f64>,
    /// Where it is.
    pub(super) points_mm: Vec<Vec3A>,
    last_mm: Vec<f64>,
    pub(super) map: ShapeMap,
}

impl ShapeFromColor {
    /// For the sensor that the constants describe and the tracker follows.
    ///
    /// # Errors
    /// [`ShapeError`] names the field of the constants that is missing or at fault.
    pub fn new(constants: &Constants, tracker: &Tracker, options: ShapeOptions) -> Result<Self, ShapeError> {
        Self::with_tables(constants, tracker, options, &|_, _, make| make())
    }

    /// The same with the light's tables, most of the work, from whoever keeps them.
    ///
    /// # Errors
    /// Those of [`ShapeFromColor::new`].
    pub fn with_tables(
        constants: &Constants,
        tracker: &Tracker,
        options: ShapeOptions,
        tables: &Numbers<'_>,
    ) -> Result<Self, ShapeError> {
        Self::prepared_by(constants, tracker, options, &|ways, parts| Prepared::filled(ways, parts, tables))
    }

    pub(super) fn prepared_by(
        constants: &Constants,
        tracker: &Tracker,
        options: ShapeOptions,
        prepare: Prepare<'_>,
    ) -> Result<Self, ShapeError> {
        options.check()?;
        let optics = tracker.optics().clone();
        let (light, ways) = ShapeLight::new(constants, &optics, prepare)?;
        let cells = Cells::new(&optics, options.cell_px);
        let count = cells.count();
        Ok(Self {
            options,
            light,
            marks: Marks::new(constants, &optics),
            is_rigid: constants.white_markers.is_empty(),
            rest: None,
            ways,
            lights: Lights::default(),
            volume: Volume::new(&optics, constants.elastomer.map(|elastomer| elastomer.poisson_ratio)),
            rest_seen: optics.clone(),
            view: View::default(),
            levels: Vec::new(),
            covered: vec![false; count],
            noise: Vec3A::ZERO,
            differences: Vec::new(),
            gain: Vec::new(),
            turn_per_mm: vec![Vec3A::ZERO; count],
            turns: Lattice::default(),
            shifts: Lattice::default(),
            tilt: vec![Weighted::default(); count],
            readings: vec![CellReading::default(); count],
            read_mm: vec![0.0; count],
            is_stale: vec![true; count],
            deviations: Deviations::default(),
            pyramid: Pyramid::default(),
            system: System::new(cells.width, cells.height),
            chart: Chart::default(),
            moved_mm: vec![0.0; count],
            points_mm: vec![Vec3A::ZERO; count],
            last_mm: Vec::new(),
            map: ShapeMap::new(&cells, &optics),
            cells,
            rest_optics: optics.clone(),
            optics,
        })
    }

    /// Takes a frame of the untouched sensor: what the membrane, the lens and the exposure have that the constants do not
    /// say is taken from it.
    ///
    /// # Errors
    /// A frame that is not of an untouched sensor under the constants' light: colours swapped, a light out, cut off.
    pub fn set_rest(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), ShapeError> {
        if !self.see(frame, tracked)? {
            let problem = format!("has no pose: {}", tracked.status());
            return Err(ShapeError::new("rest", problem, "take a frame in which the white markers are seen"));
        }
        let noise = self.noise / self.cells.px as f32;
        let (levels, covered) = (&self.levels, &self.covered);
        self.rest = Some(RestMap::measured(levels, covered, &self.cells, &self.view, &self.light, noise)?);
        let is_bare = |cell: usize| self.view.is_dome[cell] && !self.covered[cell];
        self.lights = Lights::at_rest(
            (&self.ways, &self.light),
            &self.cells,
            &self.view,
            &self.levels,
            tracked,
            is_bare,
        );
        self.rest_seen = self.optics.clone();
        Ok(())
    }

    /// The last frame's result.
    pub fn map(&self) -> &ShapeMap {
        &self.map
    }

    fn see(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<bool, ShapeError> {
        let spec = self.rest_optics.lens().spec();
        let is_size = (frame.width(), frame.height()) == (spec.width as usize, spec.height as usize);
        if frame.channels() != 3 || !is_size {
            let problem =
                format!("is {} x {} of {} channels", frame.width(), frame.height(), frame.channels());
            return Err(ShapeError::new("frame", problem, "give frames in colour of the constants' size"));
        }
        let Some(pose) = tracked.pose.or_else(|| self.is_rigid.then(Rigid::identity)) else {
            return Ok(false);
        };
        if self.optics.move_to(&pose).is_err() {
            return Ok(false);
        }
        if self.cells.look(&self.optics, &pose, &mut self.view) {
            self.turn();
        }
        levels::read(frame, &self.cells, &self.view, &self.light.linear, &mut self.levels);
        self.marks.cover(tracked, &self.cells, &self.view, &mut self.covered);
        let (is_dome, covered) = (&self.view.is_dome, &self.covered);
        let is_bare = |cell: usize| is_dome[cell] && !covered[cell];
        self.noise = levels::noise(frame, &self.cells, is_bare, &self.light.linear, &mut self.differences);
        Ok(true)
    }

    /// Takes the next frame in, with what the tracker says of it.
    ///
    /// # Errors
    /// A frame of another form than the constants'; no frame at rest before it.
    pub fn measure(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<&ShapeMap, ShapeError> {
        rows::run(|| self.measure_rows(frame, tracked))?;
        Ok(&self.map)
    }

    fn measure_rows(&mut self, frame: &CameraFrame<'_>, tracked: &Tracked) -> Result<(), ShapeError> {
        let is_seen = self.see(frame, tracked)?;
        let Some(rest) = &self.rest else {
            return Err(ShapeError::new(
                "rest",
                "was not given",
                "give a frame of the untouched sensor first",
            ));
        };
        if !is_seen {
            self.map.forget();
            return Ok(());
        }
        let (shifts, gain) = (&mut self.shifts, &mut self.gain);
        rest.at_pose(&self.cells, &self.view, &self.rest_seen, shifts, self.is_rigid, gain);
        self.check_colours()?;
        if self.is_light_out() {
            return Ok(());
        }
        self.take_out_lights(tracked);
        // Where the last frame's skin was hardly moved this one is read at rest: errors of the one would be read into the next and grow.
        self.last_mm.clone_from(&self.moved_mm);
        let min_mm = f64::from(MIN_DEPTH_MM);
        self.moved_mm.iter_mut().for_each(|moved| *moved -= moved.clamp(-min_mm, min_mm));
        let mut status = SolveStatus::default();
        for pass in 0..self.options.max_passes {
            self.choose(pass == 0);
            self.find_points();
            self.read_normals();
            let spans = &self.view.spans;
            self.pyramid.fill_within(self.cells.width, &mut self.tilt, |row| spans[row].clone());
            if pass == 0 {
                // The solve begins at the last frame's skin all the same.
                std::mem::swap(&mut self.moved_mm, &mut self.last_mm);
            } else {
                self.last_mm.clone_from(&self.moved_mm);
            }
            status = self.integrate();
            let is_still = |(now, last): (&f64, &f64)| (now - last).abs() < STILL_MM;
            if self.moved_mm.iter().zip(&self.last_mm).all(is_still) {
                break;
            }
        }
        status = self.system.go_on(&mut self.moved_mm, status, END_MM);
        let width = self.cells.width;
        self.find_points();
        self.measure_deviations();
        if self.volume.hold(&self.cells, &self.view, self.deviations.away(), &mut self.moved_mm) {
            self.find_points();
        }
        let sd_mm = |cell: usize, height_mm: f32| {
            let ring_mm2 = self.volume.variance_mm2(self.view.surface_mm[cell].z);
            (self.deviations.variance_mm2(cell, width, height_mm) + ring_mm2).sqrt()
        };
        let skin = Skin { view: &self.view, points_mm: &self.points_mm, dome: self.optics.dome() };
        self.map.draw(&self.cells, &skin, sd_mm, &mut self.chart, status);
        Ok(())
    }

    /// Finds where the cells' points are now; those beside the dome do not move.
    fn find_points(&mut self) {
        let (view, w) = (&self.view, self.cells.width);
        let rows = self.points_mm.par_chunks_mut(w).zip(self.moved_mm.par_chunks_mut(w)).zip(&view.spans);
        rows.enumerate().with_min_len(share(MIN_ROWS)).for_each(|(row, ((points, moved), span))| {
            for column in span.clone() {
                let cell = row * w + column;
                if !view.is_dome[cell] {
                    moved[column] = 0.0;
                }
                points[column] = view.surface_mm[cell] + view.ray[cell] * moved[column] as f32;
            }
        });
    }

    /// Chooses the cells that are to be read: all, or those whose skin has moved or turned since.
    fn choose(&mut self, is_first: bool) {
        if is_first {
            self.is_stale.fill(true);
            return;
        }
        let (w, read_mm, moved_mm) = (self.cells.width, &self.read_mm, &self.moved_mm);
        let since = |i: usize| moved_mm[i] - read_mm[i];
        let rows = self.is_stale.par_chunks_mut(w).zip(&self.view.spans).enumerate();
        rows.with_min_len(share(MIN_ROWS)).for_each(|(row, (is_stale, span))| {
            for column in span.clone() {
                let cell = row * w + column;
                let own = since(cell);
                let is_turned =
                    |next: usize| next < read_mm.len() && (since(next) - own).abs() > STILL_STEP_MM;
                is_stale[column] = own.abs() > STILL_MM || is_turned(cell + 1) || is_turned(cell + w);
            }
        });
    }

    /// Reads the normals of the chosen cells.
    fn read_normals(&mut self) {
        let (mut readings, mut tilt) = (std::mem::take(&mut self.readings), std::mem::take(&mut self.tilt));
        let mut read_mm = std::mem::take(&mut self.read_mm);
        let (w, view) = (self.cells.width, &self.view);
        let lists = readings.par_chunks_mut(w).zip(tilt.par_chunks_mut(w)).zip(read_mm.par_chunks_mut(w));
        let rows = lists.zip(&view.spans).enumerate().with_min_len(share(MIN_ROWS));
        rows.for_each(|(row, (((readings, tilt), read_mm), span))| {
            for column in span.clone() {
                let cell = row * w + column;
                if self.is_stale[cell] {
                    readings[column] = self.read_cell(cell);
                    read_mm[column] = self.moved_mm[cell];
                }
            }
            tilt.iter_mut().zip(readings).for_each(|(tilt, reading)| *tilt = reading.tilt);
        });
        (self.readings, self.tilt, self.read_mm) = (readings, tilt, read_mm);
    }

    /// How far heights may be off, by what the normals leave over.
    fn measure_deviations(&mut self) {
        let (view, points_mm, tilt) = (&self.view, &self.points_mm, &self.tilt);
        let left_mm = |cell: usize, next: usize| {
            let normal = |i: usize| view.normal[i] + tilt[i].value();
            0.5 * (normal(cell) + normal(next)).dot(points_mm[next] - points_mm[cell])
        };
        let radius_mm = self.optics.dome().radius_mm() as f32;
        self.deviations.measure(
            &self.cells,
            view,
            &self.readings,
            |cell| tilt[cell].value(),
            left_mm,
            radius_mm,
        );
    }

    /// Finds the skin that is perpendicular to the normals.
    fn integrate(&mut self) -> SolveStatus {
        let (view, tilt, points_mm, read_mm) = (&self.view, &self.tilt, &self.points_mm, &self.read_mm);
        let (readings, turn_per_mm) = (&self.readings, &self.turn_per_mm);
        let is_dome = |i: usize| view.is_dome.get(i).copied().unwrap_or(false);
        let normal_of = |i: usize| view.normal[i] + tilt[i].value();
        let hold = |cell: usize| {
            let held = 1.0 / (MAX_STRAIN * view.surface_mm[cell].z);
            is_dome(cell).then_some(held * held)
        };
        let join = |cell: usize, next: usize, side: usize| {
            if !(is_dome(cell) && is_dome(next)) {
                return None;
            }
            let normal = 0.5 * (normal_of(cell) + normal_of(next));
            let at_rest = view.surface_mm[next] - view.surface_mm[cell];
            let between = points_mm[next] - points_mm[cell];
            let turns = [cell, next].map(|i| 0.5 * turn_per_mm[i].dot(between));
            let variance = 0.5 * (readings[cell].spread[side] + readings[next].spread[side]);
            let weight = 1.0 / (at_rest.length_squared() * variance).max(1e-12);
            let along = [normal.dot(view.ray[cell]) - turns[0], normal.dot(view.ray[next]) + turns[1]];
            // The normals are those of where they were read.
            let offset =
                normal.dot(at_rest) - turns[0] * read_mm[cell] as f32 - turns[1] * read_mm[next] as f32;
            Some(Joint { weight, along, offset })
        };
        self.system.set(&view.spans, hold, join);
        self.system.solve(&mut self.moved_mm, PASS_END_MM)
    }
}
