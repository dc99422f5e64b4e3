//! Levels of all places by the numbers of the fit, and how they change with these.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::model::{LightModel, Number};
use super::observed::{CapPlace, Observed, depth_on_ball};
use super::physics::{Physics, ShadedDome};
use super::scatter::{Group, Scatter};

/// Step of a number for its derivative, prior deviations.
const STEP: f64 = 0.1;
/// Step of a ball's centre, mm, and of the logarithm of its radius.
const CENTER_STEP_MM: f64 = 5e-3;
const RADIUS_STEP: f64 = 2e-3;
/// Deviation of a ball's centre across the dome's normal, mm: the first estimate is much better.
const ACROSS_SD_MM: f64 = 0.5;
/// Part of its brightest places below which a place of a cap has too little light at rest to be compared with, and its deviation.
const MIN_AT_REST: f64 = 0.05;
const UNKNOWN: f64 = 1e3;
/// The frame at rest that caps are compared with has been smoothed: by so much less noise.
const REST_NOISE: f64 = 0.2;

/// Where the fit stands.
#[derive(Debug, Clone)]
pub(super) struct Values {
    /// The light's numbers, prior deviations from nominal.
    pub numbers: Vec<f64>,
    /// Each ball's centre off its first estimate in its own axes, mm.
    pub centers: Vec<DVec3>,
    /// Logarithm of the balls' radius over the given one.
    pub radius: f64,
}

/// Data, model and physics of one fit.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub model: &'a LightModel,
    pub physics: &'a Physics,
    pub seen: &'a Observed,
    pub radius_mm: f64,
    /// Prior deviation of the radius' logarithm.
    pub radius_sd: f64,
    /// Level for each mW/mm^2, and the stray level that caps' levels at rest are without.
    pub start_gain: DVec3,
    pub start_stray: f64,
    /// Errors of places at rest, and of caps.
    pub scatter: [Scatter; 2],
    /// Whether the tables for derivatives do for the light itself.
    pub is_rough: bool,
}

impl Problem<'_> {
    /// The same with errors that are taken to be so many times as large, and coarser tables of the light.
    pub fn rougher(&self, factor: f64) -> Self {
        Self { scatter: self.scatter.map(|scatter| scatter.rougher(factor)), is_rough: true, ..*self }
    }

    pub fn unknowns(&self) -> usize {
        self.model.count() + 3 * self.seen.presses.len() + 1
    }

    /// Rows of the equations: three to a place.
    pub fn rows_count(&self) -> usize {
        3 * (self.seen.rest.len() + self.seen.caps.len())
    }

    /// Axes of a ball's offset: two across the dome's normal, and along it.
    fn axes(&self, press: usize) -> [DVec3; 3] {
        let (dome_center_mm, _) = self.physics.dome();
        let out = (self.seen.presses[press].center_mm - dome_center_mm).normalize_or(DVec3::Z);
        let (x, y) = out.any_orthonormal_pair();
        [x, y, out]
    }

    /// The balls' centres. A ball of another radius touches the skin as deep: its centre moves with it.
    pub fn centers_mm(&self, values: &Values) -> Vec<DVec3> {
        let more_mm = self.radius_mm * (values.radius.exp() - 1.0);
        let moved = |(press, offset): (usize, &DVec3)| {
            let [x, y, out] = self.axes(press);
            self.seen.presses[press].center_mm + x * offset.x + y * offset.y + out * (offset.z + more_mm)
        };
        values.centers.iter().enumerate().map(moved).collect()
    }

    pub fn center_sds(&self, press: usize) -> DVec3 {
        DVec3::new(ACROSS_SD_MM, ACROSS_SD_MM, self.seen.presses[press].depth_sd_mm)
    }

    /// The values moved by a step of the whitened unknowns.
    pub fn moved(&self, values: &Values, step: &DVector<f64>) -> Values {
        let n = self.model.count();
        let mut next = values.clone();
        next.numbers.iter_mut().zip(step.iter()).for_each(|(value, step)| *value += step);
        for (press, center) in next.centers.iter_mut().enumerate() {
            let own = DVec3::from_array(std::array::from_fn(|k| step[n + 3 * press + k]));
            *center += own * self.center_sds(press);
        }
        next.radius += step[self.unknowns() - 1] * self.radius_sd;
        next
    }

    /// The unknowns in prior deviations.
    pub fn whitened(&self, values: &Values) -> DVector<f64> {
        let centers = values.centers.iter().enumerate();
        let centers = centers.flat_map(|(i, center)| (*center / self.center_sds(i)).to_array());
        let all = values.numbers.iter().copied().chain(centers).chain([values.radius / self.radius_sd]);
        DVector::from_iterator(self.unknowns(), all)
    }

    /// The light of some values.
    pub fn lit(&self, values: &Values) -> Option<ShadedDome> {
        let light = self.model.light(&values.numbers);
        if self.is_rough { self.physics.lit_for_slopes(light, None) } else { self.physics.lit(light) }
    }

    /// Levels that the camera would have at every place: at rest, then the caps.
    fn predict(&self, values: &Values, lit: &ShadedDome) -> Vec<DVec3> {
        let (gain, falloff) = self.model.camera(&values.numbers);
        let gain = DVec3::from_array(std::array::from_fn(|c| {
            let nominal = self.model.nominal.reflectance[c].max(1e-9);
            gain[c] * lit.light.reflectance[c] / nominal * self.start_gain[c]
        }));
        let stray = DVec3::splat(lit.light.stray);
        let rest = self.seen.rest.iter().map(|place| {
            let one = |cell: &super::observed::RestCell| {
                let still = |c: usize| f64::from(lit.shaded.still(cell.places[c])[c]);
                cell.passed * cell.cosine.powf(falloff) * DVec3::new(still(0), still(1), still(2))
            };
            let sum: DVec3 = place.cells.iter().map(one).sum();
            stray + gain * sum / place.cells.len() as f64
        });
        let centers_mm = self.centers_mm(values);
        let radius_mm = self.radius_mm * values.radius.exp();
        let caps = self.seen.caps.iter();
        rest.chain(caps.map(|place| self.cap_level(place, lit, centers_mm[place.press], radius_mm))).collect()
    }

    /// Level of a place of a cap: that at rest, by the ratio of the light on the ball's skin to that on the undeformed one.
    fn cap_level(&self, place: &CapPlace, lit: &ShadedDome, center_mm: DVec3, radius_mm: f64) -> DVec3 {
        let mut level = [0.0; 3];
        for (c, value) in level.iter_mut().enumerate() {
            let own = place.channels[c];
            // A ray that passes the ball meets it where it comes nearest: no place may leave the fit by being missed.
            let depth_mm = depth_on_ball(own.point_mm, own.ray, center_mm, radius_mm)
                .unwrap_or_else(|| (center_mm - own.point_mm).dot(own.ray));
            let at_mm = own.point_mm + own.ray * depth_mm;
            let normal = (center_mm - at_mm).normalize_or(own.ray).as_vec3a();
            let there = lit.shaded.at(at_mm.as_vec3a());
            let touched = f64::from(there.base[c] + there.along(normal)[c]).max(0.0);
            let still = f64::from(lit.shaded.still(own.place)[c]).max(1e-12);
            let at_rest = place.at_rest[c] + self.start_stray - lit.light.stray;
            *value = lit.light.stray + at_rest * touched / still;
        }
        DVec3::from_array(level)
    }

    /// What was seen less what the values give, three rows to a place.
    pub fn off(&self, values: &Values, lit: &ShadedDome) -> DVector<f64> {
        let seen = self.seen.rest.iter().map(|p| p.level).chain(self.seen.caps.iter().map(|p| p.level));
        let predicted = self.predict(values, lit);
        let rows = predicted
            .iter()
            .zip(seen)
            .zip(self.known())
            .flat_map(|((level, seen), known)| ((seen - *level) * known).to_array());
        DVector::from_iterator(3 * predicted.len(), rows)
    }

    /// 1 for each channel of a place that says something.
    pub fn known(&self) -> impl Iterator<Item = DVec3> {
        let brightest = self.seen.caps.iter().map(|p| p.at_rest).fold(DVec3::ZERO, DVec3::max);
        let rest = self.seen.rest.iter().map(|_| DVec3::ONE);
        let is_lit = move |place: &CapPlace| {
            DVec3::select(place.at_rest.cmpge(brightest * MIN_AT_REST), DVec3::ONE, DVec3::ZERO)
        };
        rest.chain(self.seen.caps.iter().map(is_lit))
    }

    /// Places whose errors belong together: at rest, then press by press.
    pub fn groups(&self) -> Vec<Group> {
        let seen = self.seen;
        let mut groups = vec![Group {
            rows: 0..3 * seen.rest.len(),
            points_mm: seen.rest.iter().map(|p| p.point_mm).collect(),
            levels: seen.rest.iter().map(|p| p.level).collect(),
            noise: seen.rest.iter().map(|p| seen.noise / (p.cells.len() as f64).sqrt()).collect(),
        }];
        let known: Vec<DVec3> = self.known().collect();
        for press in 0..seen.presses.len() {
            let own: Vec<usize> = (0..seen.caps.len()).filter(|i| seen.caps[*i].press == press).collect();
            let (Some(first), Some(last)) = (own.first(), own.last()) else { continue };
            let noise = |i: &usize| {
                let part = (seen.caps[*i].level / seen.caps[*i].at_rest.max(DVec3::splat(1e-6))) * REST_NOISE;
                let noise = seen.noise * (part * part + DVec3::ONE).map(f64::sqrt);
                DVec3::select(known[seen.rest.len() + i].cmpgt(DVec3::ZERO), noise, DVec3::splat(UNKNOWN))
            };
            groups.push(Group {
                rows: 3 * (seen.rest.len() + first)..3 * (seen.rest.len() + last + 1),
                points_mm: own.iter().map(|i| seen.caps[*i].channels[1].point_mm).collect(),
                levels: own.iter().map(|i| seen.caps[*i].level).collect(),
                noise: own.iter().map(noise).collect(),
            });
        }
        groups
    }

    /// Derivatives of all levels by the light's numbers, whitened. To both sides where the shape of a light changes: where the platform's
    /// lip begins to hide it, one side says nothing of the other.
    pub fn number_slopes(&self, values: &Values) -> Option<DMatrix<f64>> {
        let base = self.physics.lit_for_slopes(self.model.light(&values.numbers), None)?;
        let here = self.rows(values, &base)?;
        let column = |(k, number): (usize, &Number)| {
            let changed = self.model.reshaped(*number);
            let at = |step: f64| {
                let mut moved = values.clone();
                moved.numbers[k] += step;
                let light = self.model.light(&moved.numbers);
                self.rows(&moved, &self.physics.lit_for_slopes(light, Some((&base, changed)))?)
            };
            Some(if changed.is_empty() {
                (at(STEP)? - &here) / STEP
            } else {
                (at(STEP)? - at(-STEP)?) / (2.0 * STEP)
            })
        };
        let columns: Vec<DVector<f64>> =
            self.model.numbers.par_iter().enumerate().map(column).collect::<Option<_>>()?;
        let mut slopes = DMatrix::zeros(self.rows_count(), self.unknowns());
        columns.iter().enumerate().for_each(|(k, column)| slopes.column_mut(k).copy_from(column));
        Some(slopes)
    }

    /// Levels as rows; 0 where they say nothing.
    fn rows(&self, values: &Values, lit: &ShadedDome) -> Option<DVector<f64>> {
        let levels = self.predict(values, lit);
        let rows = levels.iter().zip(self.known());
        let rows = rows.flat_map(|(level, known)| (*level * known).to_array());
        let rows = DVector::from_iterator(3 * levels.len(), rows);
        rows.iter().all(|v| v.is_finite()).then_some(rows)
    }

    /// Puts the derivatives by the balls' centres and radius beside those by the light's numbers.
    pub fn add_ball_slopes(&self, values: &Values, lit: &ShadedDome, slopes: &mut DMatrix<f64>) {
        let (numbers, count) = (self.model.count(), self.seen.presses.len());
        let radius_mm = self.radius_mm * values.radius.exp();
        let centers_mm = self.centers_mm(values);
        for (i, (place, known)) in
            self.seen.caps.iter().zip(self.known().skip(self.seen.rest.len())).enumerate()
        {
            let center_mm = centers_mm[place.press];
            let level = |center_mm: DVec3, radius_mm: f64| self.cap_level(place, lit, center_mm, radius_mm);
            let before = level(center_mm, radius_mm);
            let row = 3 * (self.seen.rest.len() + i);
            let mut put = |column: usize, after: DVec3, scale: f64| {
                let slope = (after - before) * known * scale;
                (0..3).for_each(|c| slopes[(row + c, column)] = slope[c]);
            };
            let sds = self.center_sds(place.press);
            for (k, axis) in self.axes(place.press).into_iter().enumerate() {
                let after = level(center_mm + axis * CENTER_STEP_MM, radius_mm);
                put(numbers + 3 * place.press + k, after, sds[k] / CENTER_STEP_MM);
            }
            let larger_mm = radius_mm * RADIUS_STEP.exp();
            let [_, _, out] = self.axes(place.press);
            let after = level(center_mm + out * (larger_mm - radius_mm), larger_mm);
            put(numbers + 3 * count, after, self.radius_sd / RADIUS_STEP);
        }
    }
}
