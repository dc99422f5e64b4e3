//! How a light sends its flux into directions: the bare lobe, and what a diffuser makes of it.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::quadrature::GaussRule;

/// Places of the rule over the azimuth: a Gaussian over seven of its standard deviations to 1e-7.
const AZIMUTHS: usize = 24;

/// Places of the table over the cosine.
const TABLE: usize = 512;

/// A diffuser sheet over a light: of what it lets through, a share leaves by Lambert's law whatever the
/// direction that it came from, and the rest in a Gaussian lobe about that direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diffuser {
    /// Share that leaves by Lambert's law, 0 to 1.
    pub lambert_fraction: f64,
    /// Standard deviation of the lobe, as an angle from the direction of the light, rad.
    pub lobe_width_rad: f64,
    /// Share of the light that is let through, 0 to 1.
    pub transmittance: f64,
}

/// Intensity by direction of a light that is the same all round its axis, per unit of the light's bare flux.
#[derive(Debug, Clone, PartialEq)]
pub struct Lobe {
    /// At cosines `i / TABLE` of the angle to the axis, 1/sr.
    table: Vec<f64>,
    flux: f64,
}

impl Lobe {
    /// The lobe `cos^m`: intensity `(m + 1) / (2 pi) cos^m`, m = 1 for a Lambertian emitter (120 degrees
    /// between the half-intensity directions). `exponent` at least 0.
    pub fn cosine_power(exponent: f64) -> Self {
        let m = exponent.max(0.0);
        Self::from_intensity(|cos| (m + 1.0) / TAU * cos.powf(m), 1.0)
    }

    /// This lobe behind a diffuser that lies across its axis.
    ///
    /// Light from the direction `i` leaves in the direction `o` with the density
    /// `cos(o) (a / pi + (1 - a) N(i) exp(-angle(i, o)^2 / (2 width^2)))` per steradian: both parts are radiances,
    /// so a look along the sheet sees no flux. `N(i)` makes the lobe's integral over the hemisphere 1 for every
    /// tilt `i` of the incoming light, so that what goes in comes out.
    pub fn behind(&self, diffuser: &Diffuser) -> Self {
        let width = diffuser.lobe_width_rad.max(1e-3);
        // Six places to a standard deviation leave less than 1e-8 of the rule's error.
        let count = (6.0 / width).clamp(48.0, 512.0) as usize;
        let rule = GaussRule::new(count);
        let azimuths = GaussRule::new(AZIMUTHS);
        let mean = |a: f64, b: f64| azimuth_mean(&azimuths, a, b, width);
        let sources: Vec<(f64, f64)> = rule
            .nodes()
            .iter()
            .map(|&(cos, weight)| {
                let whole: f64 = rule.nodes().iter().map(|&(out, w)| w * out * mean(cos, out)).sum();
                (cos, weight * self.per_sr(cos) / whole)
            })
            .collect();
        let a = diffuser.lambert_fraction;
        let share = diffuser.transmittance;
        Self::from_intensity(
            |cos| {
                let lobe: f64 = sources.iter().map(|&(from, power)| power * mean(from, cos)).sum();
                share * cos * (a * self.flux / PI + (1.0 - a) * lobe)
            },
            self.flux * share,
        )
    }

    fn from_intensity(intensity: impl Fn(f64) -> f64 + Sync, flux: f64) -> Self {
        let table = (0..=TABLE).into_par_iter().map(|i| intensity(i as f64 / TABLE as f64)).collect();
        Self { table, flux }
    }

    /// Numbers of [`Lobe::numbers`].
    pub const NUMBERS: usize = TABLE + 2;

    /// All that it is: its flux, and the intensities of its table.
    pub fn numbers(&self) -> Vec<f64> {
        std::iter::once(self.flux).chain(self.table.iter().copied()).collect()
    }

    /// The lobe of such numbers, [`Lobe::NUMBERS`] of them.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (flux, table) = numbers.split_first()?;
        (numbers.len() == Self::NUMBERS).then(|| Self { table: table.to_vec(), flux: *flux })
    }

    /// Intensity in a direction with this cosine to the axis, 1/sr; nothing goes backwards.
    #[inline]
    pub fn per_sr(&self, cos: f64) -> f64 {
        if cos <= 0.0 || cos.is_nan() {
            return 0.0;
        }
        let at = cos.min(1.0) * TABLE as f64;
        let i = (at as usize).min(TABLE - 1);
        let part = at - i as f64;
        self.table[i] + (self.table[i + 1] - self.table[i]) * part
    }

    /// Flux in all directions, of the bare light's.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// The integral of the intensity over the hemisphere: [`Lobe::flux`] up to the table's error.
    pub fn integral(&self) -> f64 {
        // The table is linear between its places, so the trapezoid rule is exact for it.
        let ends = 0.5 * (self.table[0] + self.table[TABLE]);
        TAU / TABLE as f64 * (ends + self.table[1..TABLE].iter().sum::<f64>())
    }
}

/// The Gaussian of the angle between two directions with the given cosines to the axis, averaged over the
/// azimuth between them.
fn azimuth_mean(rule: &GaussRule, cos_a: f64, cos_b: f64, width: f64) -> f64 {
    // Beyond seven standard deviations there is nothing: that bounds the azimuth.
    let sines = ((1.0 - cos_a * cos_a) * (1.0 - cos_b * cos_b)).max(0.0).sqrt();
    let reach = (7.0 * width).min(PI).cos();
    let last = if sines > 0.0 { ((reach - cos_a * cos_b) / sines).clamp(-1.0, 1.0).acos() } else { PI };
    if last == 0.0 {
        return 0.0;
    }
    let sum: f64 = rule
        .over(0.0, last)
        .map(|(azimuth, weight)| {
            let angle = (cos_a * cos_b + sines * azimuth.cos()).clamp(-1.0, 1.0).acos();
            weight * (-0.5 * (angle / width).powi(2)).exp()
        })
        .sum();
    sum / PI
}
