//! How well a fitted map fits, and how much of what it leaves is scatter from print to print.

use glam::DVec2;

use super::sample::{MeasuredIn, Sample};
use super::solve::{FitModel, FitProblem, MIN_SLOPE};
use crate::transfer::{Correction, Nominal, Polar};

/// A fitted map and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFit {
    /// The nominal map on which the correction rests.
    pub nominal: Nominal,
    /// The correction.
    pub correction: Correction,
    /// Root mean square of the residuals of the samples used, per axis, mm along the dome.
    pub residual_rms_mm: f64,
    /// Largest residual of the samples used, mm along the dome.
    pub residual_max_mm: f64,
    /// Scatter of one mark from print to print, per axis, mm along the dome; `None` if no mark was measured twice.
    pub scatter_mm: Option<f64>,
    /// Part of the scatter that whole prints share: standard deviation of the prints' mean shifts, mm
    /// along the dome.
    pub print_shift_mm: Option<f64>,
    /// Root mean square that the map itself misses, per axis, mm along the dome: the residual beyond the scatter; `None`
    /// without several prints.
    pub lack_of_fit_mm: Option<f64>,
    /// Indices of the samples that were left out as outliers, ascending.
    pub rejected: Vec<usize>,
    /// Number of free numbers of the model.
    pub parameters: usize,
    /// Polar angle of the outermost sample used, rad; beyond it the map is extrapolated.
    pub measured_to_rad: f64,
}

impl FitProblem<'_> {
    /// The fit, with residuals and scatter in mm along the dome.
    pub fn report(
        &self,
        model: FitModel,
        correction: Correction,
        used: &[bool],
        rejected: Vec<usize>,
    ) -> TransferFit {
        let residuals: Vec<DVec2> = self
            .residuals(model.nominal, &correction)
            .zip(&self.polar)
            .map(|(residual, at)| match self.measured_in {
                MeasuredIn::Dome => residual,
                MeasuredIn::View => DVec2::new(residual.x / at.cos_polar.max(MIN_SLOPE), residual.y),
            })
            .collect();
        let kept = || residuals.iter().zip(self.samples).zip(used).filter(|(_, u)| **u).map(|(pair, _)| pair);
        let count = kept().count();
        let squares: f64 = kept().map(|(r, _)| r.length_squared()).sum();
        let residual_rms_mm = (squares / (2 * count) as f64).sqrt();
        let residual_max_mm = kept().map(|(r, _)| r.length()).fold(0.0, f64::max);

        // Scatter of each mark about its mean over the prints.
        let mut by_mark: Vec<(u32, usize, DVec2)> = kept().map(|(r, s)| (s.mark, s.print, *r)).collect();
        by_mark.sort_by_key(|(mark, print, _)| (*mark, *print));
        let (mut spread, mut free) = (0.0, 0usize);
        for group in by_mark.chunk_by(|a, b| a.0 == b.0) {
            let mean = group.iter().map(|(_, _, r)| *r).sum::<DVec2>() / group.len() as f64;
            spread += group.iter().map(|(_, _, r)| (*r - mean).length_squared()).sum::<f64>();
            free += group.len() - 1;
        }
        let scatter_mm = (free > 0).then(|| (spread / (2 * free) as f64).sqrt());
        let lack_of_fit_mm = scatter_mm.map(|scatter| {
            let expected = scatter * scatter * (1.0 - model.parameters() as f64 / (2 * count) as f64);
            (residual_rms_mm * residual_rms_mm - expected).max(0.0).sqrt()
        });
        TransferFit {
            nominal: model.nominal,
            correction,
            residual_rms_mm,
            residual_max_mm,
            scatter_mm,
            print_shift_mm: print_shift_mm(kept().map(|(r, s)| (s, *r))),
            lack_of_fit_mm,
            rejected,
            parameters: model.parameters(),
            measured_to_rad: (self.polar.iter().zip(used))
                .filter(|(_, used)| **used)
                .map(|(at, _)| at.polar_rad)
                .fold(0.0, f64::max),
        }
    }
}

/// Standard deviation, per axis, of the prints' mean shifts, in the plane that the base spans.
fn print_shift_mm<'a>(residuals: impl Iterator<Item = (&'a Sample, DVec2)>) -> Option<f64> {
    let mut sums: Vec<(DVec2, usize)> = Vec::new();
    for (sample, residual) in residuals {
        if sums.len() <= sample.print {
            sums.resize(sample.print + 1, (DVec2::ZERO, 0));
        }
        let at = Polar::of_direction(sample.landed.normalize());
        let flat = at.out * residual.x + at.out.perp() * residual.y;
        sums[sample.print].0 += flat;
        sums[sample.print].1 += 1;
    }
    let means: Vec<DVec2> = sums.iter().filter(|(_, n)| *n > 0).map(|(sum, n)| *sum / *n as f64).collect();
    if means.len() < 2 {
        return None;
    }
    let mean = means.iter().sum::<DVec2>() / means.len() as f64;
    let squares: f64 = means.iter().map(|m| (*m - mean).length_squared()).sum();
    Some((squares / (2 * (means.len() - 1)) as f64).sqrt())
}
