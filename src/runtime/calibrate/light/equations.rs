//! Residuals of all places and their normal equations.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::model::{LightModel, Number};
use super::observed::{CapPlace, Observed};
use super::physics::{CapFlux, CapShape, Physics, SourceFlux, Table, cap_shape, seen_flux};
use crate::constants::LightConstants;

/// Huber's threshold in standard deviations: specks, dots that were not found.
const HUBER: f64 = 3.0;
/// Step of a number for its derivative, prior deviations.
const STEP: f64 = 0.05;
/// Step of a ball's centre, mm, and of the logarithm of its radius.
const CENTER_STEP_MM: f64 = 1e-3;
const RADIUS_STEP: f64 = 1e-3;
/// Deviation of a ball's centre across the dome's normal, mm: the first estimate is much better.
const ACROSS_SD_MM: f64 = 0.5;
/// Part of its brightest places below which a place of a cap has too little light at rest to be compared with.
const MIN_AT_REST: f64 = 0.02;

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
pub(super) struct Problem<'a> {
    pub model: &'a LightModel,
    pub physics: &'a Physics,
    pub seen: &'a Observed,
    pub radius_mm: f64,
    /// Prior deviation of the radius' logarithm.
    pub radius_sd: f64,
    /// Level for each mW/mm^2 and stray level that the frame at rest was divided by.
    pub start_gain: DVec3,
    pub start_stray: f64,
}

/// For each number, the lights that it reshapes and what a step of it changes of them.
pub(super) type Slopes = Vec<Vec<(usize, Table)>>;

/// Normal equations in whitened numbers.
pub(super) struct Equations {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
}

/// All residuals, as differences of levels, with their deviations.
pub(super) struct Residuals {
    pub off: Vec<DVec3>,
    pub sd: Vec<DVec3>,
    pub cost: f64,
}

/// A light as it stands, at every place.
pub(super) struct Lit {
    pub light: LightConstants,
    pub fluxes: Vec<SourceFlux>,
    shape: CapShape,
    /// Depths that the caps' fluxes were taken at.
    at_mm: Vec<f64>,
}

impl Problem<'_> {
    pub fn unknowns(&self) -> usize {
        self.model.count() + 3 * self.seen.presses.len() + 1
    }

    /// Axes of a ball's offset: two across the dome's normal, and along it.
    pub fn axes(&self, press: usize) -> [DVec3; 3] {
        let (dome_center_mm, _) = self.physics.dome();
        let out = (self.seen.presses[press].center_mm - dome_center_mm).normalize_or(DVec3::Z);
        let (x, y) = out.any_orthonormal_pair();
        [x, y, out]
    }

    pub fn centers_mm(&self, values: &Values) -> Vec<DVec3> {
        let moved = |(press, offset): (usize, &DVec3)| {
            let [x, y, out] = self.axes(press);
            self.seen.presses[press].center_mm + x * offset.x + y * offset.y + out * offset.z
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

    /// The light of some values at every place.
    pub fn lit(&self, values: &Values, per_mm: bool) -> Option<Lit> {
        let light = self.model.light(&values.numbers);
        let ways = self.physics.ways(&light).ok()?;
        let shape = cap_shape(self.seen, &self.centers_mm(values), self.radius_mm * values.radius.exp());
        let flux = |source| self.physics.flux(&ways, source, self.seen, &shape, per_mm);
        let fluxes = (0..light.leds.len()).map(flux).collect();
        let at_mm = shape.iter().map(|cap| cap.map_or(0.0, |(depth, _)| depth)).collect();
        Some(Lit { light, fluxes, shape, at_mm })
    }

    /// Levels that the camera would have at every place: at rest, then the caps. `None` for a cap that the ball misses.
    fn predict(
        &self,
        values: &Values,
        light: &LightConstants,
        fluxes: &[&SourceFlux],
        lit: &Lit,
    ) -> Vec<Option<DVec3>> {
        let seen_mw = seen_flux(light);
        let patches = self.physics.own_patches(light, fluxes, &seen_mw);
        let own_at = |point_mm: DVec3| {
            DVec3::from_array(std::array::from_fn(|c| self.physics.own_at(&patches[c], point_mm)))
        };
        let (gain, falloff) = self.model.camera(&values.numbers);
        let more = |c: usize| {
            gain[c] * light.reflectance[c] / self.model.nominal.reflectance[c].max(1e-9) * self.start_gain[c]
        };
        let gain = DVec3::new(more(0), more(1), more(2));
        let stray = DVec3::splat(light.stray);
        let still = self.seen.still.iter().enumerate().map(|(i, place)| {
            let direct: DVec3 = fluxes.iter().zip(&seen_mw).map(|(flux, seen)| *seen * flux.still[i]).sum();
            let level = gain * place.passed * place.cosine.powf(falloff) * (direct + own_at(place.point_mm));
            Some(stray + level)
        });
        let caps = self.seen.caps.iter().enumerate().map(|(i, place)| {
            let (depth_mm, normal) = lit.shape[i]?;
            let of = |flux: &SourceFlux| flux.caps[i];
            let own = own_at(place.point_mm);
            Some(self.cap_level(
                place,
                &mut fluxes.iter().map(|f| of(f)),
                &seen_mw,
                own,
                (depth_mm - lit.at_mm[i], normal),
                stray,
            ))
        });
        still.chain(caps).collect()
    }

    /// Level of a place of a cap whose skin lies so much further along the ray than where its fluxes were taken.
    fn cap_level(
        &self,
        place: &CapPlace,
        fluxes: &mut dyn Iterator<Item = CapFlux>,
        seen_mw: &[DVec3],
        own: DVec3,
        (further_mm, normal): (f64, DVec3),
        stray: DVec3,
    ) -> DVec3 {
        let (mut at_rest, mut touched) = (own, own);
        for (flux, seen) in fluxes.zip(seen_mw) {
            at_rest += *seen * flux.undeformed.max(0.0);
            let vector = flux.vector + flux.per_mm * further_mm;
            touched += *seen * (vector.dot(normal) + (-flux.undeformed).max(0.0));
        }
        let ratio = touched.max(DVec3::ZERO) / at_rest.max(DVec3::splat(1e-12));
        let rest = place.at_rest + DVec3::splat(self.start_stray) - stray;
        stray + rest * ratio
    }

    /// Residuals of a light as it stands.
    pub fn residuals(&self, values: &Values, lit: &Lit) -> Residuals {
        let fluxes: Vec<&SourceFlux> = lit.fluxes.iter().collect();
        let levels = self.predict(values, &lit.light, &fluxes, lit);
        let measured = self.seen.still.iter().map(|p| p.level).chain(self.seen.caps.iter().map(|p| p.level));
        let first_cap = self.seen.still.len();
        let brightest = self.seen.caps.iter().map(|p| p.at_rest).fold(DVec3::ZERO, DVec3::max);
        let (mut off, mut sd, mut cost) = (Vec::new(), Vec::new(), 0.0);
        for (i, (level, measured)) in levels.iter().zip(measured).enumerate() {
            let part = self.seen.parts[usize::from(i >= first_cap)];
            let model = part * (measured + DVec3::splat(measured.max_element()));
            let noise = self.seen.noise;
            let mut own = DVec3::from_array(model.to_array().map(|model| model.hypot(noise)));
            if let Some(place) = i.checked_sub(first_cap).and_then(|k| self.seen.caps.get(k)) {
                let dark = place.at_rest.cmplt(brightest * MIN_AT_REST);
                own = DVec3::select(dark, DVec3::splat(1e6), own);
            }
            let left = level.map_or(DVec3::ZERO, |level| measured - level);
            cost +=
                left.to_array().iter().zip(own.to_array()).map(|(off, sd)| huber(off / sd).0).sum::<f64>();
            off.push(left);
            sd.push(own);
        }
        Residuals { off, sd, cost: cost + self.prior_cost(values) }
    }

    fn prior_cost(&self, values: &Values) -> f64 {
        let numbers: f64 = values.numbers.iter().map(|v| v * v).sum();
        let centers = values.centers.iter().enumerate();
        let centers: f64 = centers.map(|(i, c)| (*c / self.center_sds(i)).length_squared()).sum();
        numbers + centers + (values.radius / self.radius_sd).powi(2)
    }

    /// The normal equations at some values; the light there has its changes along the rays.
    pub fn equations(&self, values: &Values, lit: &Lit, residuals: &Residuals, slopes: &Slopes) -> Equations {
        let n = self.unknowns();
        let fluxes: Vec<&SourceFlux> = lit.fluxes.iter().collect();
        let base = self.predict(values, &lit.light, &fluxes, lit);
        let mut columns: Vec<Vec<DVec3>> = Vec::with_capacity(n);
        for k in 0..self.model.count() {
            let column = self.column(values, lit, k, slopes);
            let slope = |(after, before): (&Option<DVec3>, &Option<DVec3>)| match (after, before) {
                (Some(after), Some(before)) => (*after - *before) / STEP,
                _ => DVec3::ZERO,
            };
            columns.push(column.iter().zip(&base).map(slope).collect());
        }
        columns.extend(self.ball_columns(values, lit, &base));
        let (mut matrix, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let mut row = DVector::zeros(n);
        for (i, (off, sd)) in residuals.off.iter().zip(&residuals.sd).enumerate() {
            for c in 0..3 {
                let weight = huber(off[c] / sd[c]).1.sqrt() / sd[c];
                row.iter_mut().zip(&columns).for_each(|(value, column)| *value = column[i][c] * weight);
                matrix.syger(1.0, &row, &row, 1.0);
                right.axpy(off[c] * weight, &row, 1.0);
            }
        }
        matrix.fill_upper_triangle_with_lower_triangle();
        let priors = self.whitened(values);
        for (k, value) in priors.iter().enumerate() {
            matrix[(k, k)] += 1.0;
            right[k] -= value;
        }
        Equations { matrix, right }
    }

    fn whitened(&self, values: &Values) -> Vec<f64> {
        let centers = values.centers.iter().enumerate();
        let centers = centers.flat_map(|(i, center)| (*center / self.center_sds(i)).to_array());
        values.numbers.iter().copied().chain(centers).chain([values.radius / self.radius_sd]).collect()
    }

    /// Levels after a step of one of the light's numbers.
    fn column(&self, values: &Values, lit: &Lit, k: usize, slopes: &Slopes) -> Vec<Option<DVec3>> {
        let mut after = values.clone();
        after.numbers[k] += STEP;
        let light = self.model.light(&after.numbers);
        let of = |(i, table): &(usize, Table)| (*i, self.physics.changed(&lit.fluxes[*i], table, self.seen));
        let changed: Vec<(usize, SourceFlux)> = slopes[k].iter().map(of).collect();
        let pick =
            |i: usize| changed.iter().find(|(at, _)| *at == i).map_or(&lit.fluxes[i], |(_, flux)| flux);
        let fluxes: Vec<&SourceFlux> = (0..lit.fluxes.len()).map(pick).collect();
        self.predict(&after, &light, &fluxes, lit)
    }

    /// What a step of each number changes of the lights that it reshapes.
    pub fn slopes(&self, values: &Values) -> Option<Slopes> {
        let before = self.physics.ways(&self.model.light(&values.numbers)).ok()?;
        let tables: Vec<Table> = (0..before.sources.len()).map(|i| self.physics.table(&before, i)).collect();
        let of = |(k, number): (usize, &Number)| {
            let reshaped = self.model.reshaped(*number);
            if reshaped.is_empty() {
                return Some(Vec::new());
            }
            let mut after = values.numbers.clone();
            after[k] += STEP;
            let ways = self.physics.ways(&self.model.light(&after)).ok()?;
            let change = |i: usize| {
                let table = self.physics.table(&ways, i);
                let less = |(a, b): (&[f64; 3], &[f64; 3])| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
                (i, table.iter().zip(&tables[i]).map(less).collect())
            };
            Some(reshaped.iter().copied().map(change).collect())
        };
        self.model.numbers.iter().enumerate().map(of).collect()
    }

    /// Columns of the balls' centres and of their radius.
    fn ball_columns(&self, values: &Values, lit: &Lit, base: &[Option<DVec3>]) -> Vec<Vec<DVec3>> {
        let (first, count) = (self.seen.still.len(), self.seen.presses.len());
        let mut columns = vec![vec![DVec3::ZERO; base.len()]; 3 * count + 1];
        let (seen_mw, centers_mm) = (seen_flux(&lit.light), self.centers_mm(values));
        let fluxes: Vec<&SourceFlux> = lit.fluxes.iter().collect();
        let patches = self.physics.own_patches(&lit.light, &fluxes, &seen_mw);
        let radius_mm = self.radius_mm * values.radius.exp();
        for (i, place) in self.seen.caps.iter().enumerate() {
            let Some(before) = base.get(first + i).copied().flatten() else { continue };
            let own =
                DVec3::from_array(std::array::from_fn(|c| self.physics.own_at(&patches[c], place.point_mm)));
            let level = |center_mm: DVec3, radius_mm: f64| {
                let depth_mm =
                    super::observed::depth_on_ball(place.point_mm, place.ray, center_mm, radius_mm)?;
                let normal = (center_mm - place.point_mm - place.ray * depth_mm) / radius_mm;
                let further = (depth_mm - lit.at_mm[i], normal);
                let of = &mut fluxes.iter().map(|flux| flux.caps[i]);
                Some(self.cap_level(place, of, &seen_mw, own, further, DVec3::splat(lit.light.stray)))
            };
            let center_mm = centers_mm[place.press];
            let sds = self.center_sds(place.press);
            for (k, axis) in self.axes(place.press).into_iter().enumerate() {
                let after = level(center_mm + axis * CENTER_STEP_MM, radius_mm).unwrap_or(before);
                columns[3 * place.press + k][first + i] = (after - before) * (sds[k] / CENTER_STEP_MM);
            }
            let after = level(center_mm, radius_mm * RADIUS_STEP.exp()).unwrap_or(before);
            columns[3 * count][first + i] = (after - before) * (self.radius_sd / RADIUS_STEP);
        }
        columns
    }
}

/// Huber's loss of a residual in deviations, and its weight.
fn huber(sds: f64) -> (f64, f64) {
    let sds = sds.abs();
    if sds <= HUBER { (sds * sds, 1.0) } else { (2.0 * HUBER * sds - HUBER * HUBER, HUBER / sds) }
}
