//! The stages in their order, frame by frame.

use glam::Vec3A;

use super::cells::{Cells, View};
use super::contact::Chart;
use super::deviation::Deviations;
use super::error::ShapeError;
use super::fill::{Pyramid, Weighted};
use super::lattice::Lattice;
use super::levels::{self, Level};
use super::light::ShapeLight;
use super::map::{ShapeMap, Skin};
use super::marks::Marks;
use super::normals::{self, CellReading};
use super::rest::{RestMap, Seen, seen};
use super::system::{END_MM, SolveStatus, System};
use super::volume::Volume;
use crate::constants::Constants;
use crate::track::{CameraFrame, Tracked, Tracker};
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// Step along the ray over which the readings' turn is taken, mm, and what each channel is known to there: a hundredth.
const TURN_STEP_MM: f32 = 0.2;
const TURN_PRECISION: f32 = 1e4;

/// The largest motion, mm, after which a pass more changes nothing.
const STILL_MM: f64 = 0.03;

/// Change of the way between two cells from which on their normal is read again, mm: some hundredths of a radian.
const STILL_STEP_MM: f64 = 0.005;

/// How closely the passes before the last are solved, mm.
const PASS_END_MM: f64 = 3e-3;

/// Every seventh cell is asked for the order of its colours; the part of their misfit that another order must leave to be taken for theirs.
const COLOUR_STEP: usize = 7;
const OTHER_ORDER: f32 = 0.5;

/// Most by which the skin moves, part of its height over the sheet: it is bonded at the rim.
const MAX_STRAIN: f32 = 0.5;

/// Settings of a [`ShapeFromColor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeOptions {
    /// Pixels along each side of a cell that is solved for, 1 to 16: half of the picture's resolution halves the noise, and colour
    /// comes no finer from a camera whose chroma is halved.
    pub cell_px: usize,
    /// How often normals are read, integrated, and read again with the light at the moved skin, 1 to 16.
    pub max_passes: usize,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { cell_px: 2, max_passes: 2 }
    }
}

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
    is_rigid: bool,
    rest: Option<RestMap>,
    volume: Volume,
    /// As it stood in the frame at rest.
    rest_seen: SensorOptics,
    pub(super) view: View,
    pub(super) levels: Vec<Level>,
    pub(super) covered: Vec<bool>,
    /// Deviation of a pixel's light by noise, full scale 1.
    pub(super) noise: Vec3A,
    differences: Vec<f32>,
    pub(super) gain: Vec<Vec3A>,
    /// By how much a reading's normal turns where the point lies 1 mm further along its ray, for the same colours.
    turn_per_mm: Vec<Vec3A>,
    turns: Lattice,
    /// By how many cells a place of the dome is seen beside where it was at rest.
    shifts: Lattice,
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
    last_mm: Vec<f64>,
    map: ShapeMap,
}

impl ShapeFromColor {
    /// For the sensor that the constants describe and the tracker follows.
    ///
    /// # Errors
    /// [`ShapeError`] names the field of the constants that is missing or at fault.
    pub fn new(constants: &Constants, tracker: &Tracker, options: ShapeOptions) -> Result<Self, ShapeError> {
        for (name, value) in [("cell_px", options.cell_px), ("max_passes", options.max_passes)] {
            if !(1..=16).contains(&value) {
                return Err(ShapeError::new(name, format!("is {value}"), "give a number from 1 to 16"));
            }
        }
        let optics = tracker.optics().clone();
        let light = ShapeLight::new(constants, &optics)?;
        let cells = Cells::new(&optics, options.cell_px);
        let count = cells.count();
        Ok(Self {
            options,
            light,
            marks: Marks::new(constants, &optics),
            is_rigid: constants.white_markers.is_empty(),
            rest: None,
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
            tilt: vec![(Vec3A::ZERO, 0.0); count],
            readings: vec![CellReading::default(); count],
            read_mm: vec![0.0; count],
            is_stale: vec![true; count],
            deviations: Deviations::default(),
            pyramid: Pyramid::default(),
            system: System::new(cells.width, cells.height),
            chart: Chart::default(),
            moved_mm: vec![0.0; count],
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
        self.marks.cover(tracked, &self.cells, &mut self.covered);
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
            return Ok(&self.map);
        }
        let (shifts, gain) = (&mut self.shifts, &mut self.gain);
        rest.at_pose(&self.cells, &self.view, &self.rest_seen, shifts, self.is_rigid, gain);
        self.check_colours()?;
        let mut status = SolveStatus::default();
        for pass in 0..self.options.max_passes {
            self.choose(pass == 0);
            self.read_normals();
            self.tilt.clear();
            self.tilt.extend(self.readings.iter().map(|reading| reading.tilt));
            self.pyramid.fill(self.cells.width, &mut self.tilt);
            self.last_mm.clone_from(&self.moved_mm);
            status = self.integrate();
            let steps = self.moved_mm.iter().zip(&self.last_mm).map(|(a, b)| (a - b).abs());
            if steps.fold(0.0, f64::max) < STILL_MM {
                break;
            }
        }
        status = self.system.go_on(&mut self.moved_mm, status, END_MM);
        let width = self.cells.width;
        self.measure_deviations();
        self.volume.hold(&self.cells, &self.view, self.deviations.away(), &mut self.moved_mm);
        let sd_mm = |cell: usize, height_mm: f32| {
            let ring_mm2 = self.volume.variance_mm2(self.deviations.away()[cell]);
            (self.deviations.variance_mm2(cell, width, height_mm) + ring_mm2).sqrt()
        };
        let skin = Skin { view: &self.view, moved_mm: &self.moved_mm, dome: self.optics.dome() };
        self.map.draw(&self.cells, &skin, sd_mm, &mut self.chart, status);
        Ok(&self.map)
    }

    /// Refuses a frame whose colours are those at rest only in another order: a touch changes some of the skin, never all of it so.
    fn check_colours(&self) -> Result<(), ShapeError> {
        const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [2, 1, 0], [1, 0, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1]];
        let mut off = [0.0_f32; 6];
        for Seen { cell, expected, level: seen, .. } in
            seen(&self.levels, &self.covered, &self.view, &self.light, COLOUR_STEP)
        {
            let at_rest = self.gain[cell] * expected;
            for (off, order) in off.iter_mut().zip(ORDERS) {
                let difference = (Vec3A::new(seen[order[0]], seen[order[1]], seen[order[2]]) - at_rest).abs();
                *off += if difference.is_finite() { difference.element_sum() } else { 0.0 };
            }
        }
        let smallest = off.into_iter().fold(f32::INFINITY, f32::min);
        if smallest < OTHER_ORDER * off[0] {
            let problem = "has its colours in another order than the frame at rest";
            let cure = "give both in the same order: red, green, blue, or say which (--raw ..:rgb or :bgr; rgb=False)";
            return Err(ShapeError::new("frame", problem, cure));
        }
        Ok(())
    }

    /// How readings turn with depth, on the undeformed dome: with it the light need not be taken again and again.
    fn turn(&mut self) {
        let (light, view) = (&self.light, &self.view);
        self.turns.take(&self.cells, view, |cell| {
            let (at, ray, out) = (view.surface_mm[cell], view.ray[cell], view.normal[cell]);
            let here = light.at(at);
            let irradiance = here.base + here.direct(out);
            let precision = irradiance.max(Vec3A::splat(1e-12)).powf(-2.0) * TURN_PRECISION;
            let deeper = light.at(at - ray * TURN_STEP_MM);
            let reading = normals::read(&deeper, irradiance, precision, out, out.any_orthonormal_vector())?;
            Some((out - reading.normal) / TURN_STEP_MM)
        });
        for (row, span) in view.spans.iter().enumerate() {
            for column in span.clone() {
                self.turn_per_mm[row * self.cells.width + column] = self.turns.at(column, row);
            }
        }
    }

    /// Chooses the cells that are to be read: all, or those whose skin has moved or turned since.
    fn choose(&mut self, is_first: bool) {
        let width = self.cells.width;
        for (row, span) in self.view.spans.iter().enumerate() {
            for cell in row * width + span.start..row * width + span.end {
                let since = |i: usize| self.moved_mm[i] - self.read_mm[i];
                let own = since(cell);
                let is_turned =
                    |next: usize| next < self.read_mm.len() && (since(next) - own).abs() > STILL_STEP_MM;
                let has_moved = own.abs() > STILL_MM;
                self.is_stale[cell] = is_first || has_moved || is_turned(cell + 1) || is_turned(cell + width);
            }
        }
        let cells = self.read_mm.iter_mut().zip(&self.moved_mm).zip(&self.is_stale);
        cells.filter(|(_, is_stale)| **is_stale).for_each(|((read_mm, moved_mm), _)| *read_mm = *moved_mm);
    }

    /// Reads the normals of the chosen cells.
    fn read_normals(&mut self) {
        let mut readings = std::mem::take(&mut self.readings);
        let width = self.cells.width;
        let rows = readings.chunks_mut(width).zip(&self.view.spans).enumerate();
        rows.for_each(|(row, (line, span))| {
            for column in span.clone() {
                if self.is_stale[row * width + column] {
                    line[column] = self.read_cell(row * width + column);
                }
            }
        });
        self.readings = readings;
    }

    /// How far heights may be off, by what the normals leave over.
    fn measure_deviations(&mut self) {
        let (view, moved_mm, tilt) = (&self.view, &self.moved_mm, &self.tilt);
        let point = |cell: usize| view.surface_mm[cell] + view.ray[cell] * moved_mm[cell] as f32;
        let left_mm = |cell: usize, next: usize| {
            let normal = |i: usize| view.normal[i] + tilt[i].0;
            0.5 * (normal(cell) + normal(next)).dot(point(next) - point(cell))
        };
        self.deviations.measure(&self.cells, view, &self.readings, |cell| tilt[cell].0, left_mm);
    }

    /// Finds the skin that is perpendicular to the normals.
    fn integrate(&mut self) -> SolveStatus {
        let view = &self.view;
        self.system.clear(&view.spans);
        let width = self.cells.width;
        let normal_of = |i: usize| view.normal[i] + self.tilt[i].0;
        let is_dome = |i: usize| view.is_dome.get(i).copied().unwrap_or(false);
        for (row, span) in view.spans.iter().enumerate() {
            for cell in row * width + span.start..row * width + span.end {
                if !is_dome(cell) {
                    self.moved_mm[cell] = 0.0;
                    continue;
                }
                let (own, ray, moved_mm) = (normal_of(cell), view.ray[cell], self.moved_mm[cell] as f32);
                let held = 1.0 / (MAX_STRAIN * view.surface_mm[cell].z);
                self.system.hold(cell, held * held);
                let is_last = cell + 1 == row * width + span.end;
                for (next, is_right) in [(cell + 1, true), (cell + width, false)] {
                    if (is_right && is_last) || !is_dome(next) {
                        continue;
                    }
                    let normal = 0.5 * (own + normal_of(next));
                    let at_rest = view.surface_mm[next] - view.surface_mm[cell];
                    let next_mm = self.moved_mm[next] as f32;
                    let between = at_rest + view.ray[next] * next_mm - ray * moved_mm;
                    let turns = [cell, next].map(|i| 0.5 * self.turn_per_mm[i].dot(between));
                    let side = usize::from(!is_right);
                    let variance =
                        0.5 * (self.readings[cell].spread[side] + self.readings[next].spread[side]);
                    let weight = 1.0 / (at_rest.length_squared() * variance).max(1e-12);
                    let along = [normal.dot(ray) - turns[0], normal.dot(view.ray[next]) + turns[1]];
                    // The normals are those of where they were read.
                    let [read_mm, next_read_mm] = [cell, next].map(|i| self.read_mm[i] as f32);
                    let offset = normal.dot(at_rest) - turns[0] * read_mm - turns[1] * next_read_mm;
                    self.system.join(cell, is_right, weight, along, offset);
                }
            }
        }
        self.system.solve(&mut self.moved_mm, PASS_END_MM)
    }
}
