//! Does tilting the lights make the light even? The lights of a design at every tilt, bare and behind diffusers.
//!
//! The sensor of arXiv 2303.03093 claims in its fig. 5 that lights tilted to 85 degrees behind a diffuser light the dome
//! evenly. Here they stand where the design has them and lean from 0 (facing up) to 90 degrees (facing the axis). The
//! platform's shadow is left out: other tilts have no pits in it.

use glam::DVec2;
use rayon::prelude::*;
use serde::Serialize;

use super::numbers::Percentiles;
use super::optimize::{ComparedLight, LightScore, diffusers};
use crate::chart::{Axis, Chart, ChartColor, INK, TextAlign};
use crate::light::{fault, scene};
use domecast_design::{Design, DesignError};
use domecast_sim::light::setup;

/// Between two tilts of the study, degrees.
const STEP_DEG: u32 = 10;
/// The tilt that the paper claims, degrees.
const CLAIMED_DEG: f64 = 85.0;
/// Polar angle to which the numbers go, degrees.
const POLAR_DEG: f64 = 60.0;

/// The lights at one tilt.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TiltPoint {
    /// Angle between boards and base plane, degrees.
    pub tilt_deg: f64,
    /// Error of the normal for one grey level of noise to 60 degrees, degrees.
    pub normal_error_deg_per_level: Percentiles,
    /// Condition number of crosstalk times light.
    pub condition_number: Percentiles,
    /// Evenness: standard deviation over mean of the three colours' sum, to 60 degrees.
    pub sum_coefficient_of_variation: Option<f64>,
}

/// The lights behind one diffuser.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TiltCurve {
    /// Name of the diffuser.
    pub diffuser: &'static str,
    /// Where its numbers come from.
    pub source: &'static str,
    /// By tilt.
    pub points: Vec<TiltPoint>,
}

/// What tilt and diffuser do, each by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TiltStudy {
    /// Version of this file's form.
    pub version: u32,
    /// Name of the design.
    pub design: String,
    /// A curve for each diffuser, the design's own first.
    pub curves: Vec<TiltCurve>,
}

/// A number of a point of the study.
type Reading<'a> = &'a dyn Fn(&TiltPoint) -> Option<f64>;

impl TiltStudy {
    /// Of the lights of a design, without its platform.
    ///
    /// # Errors
    /// A design that cannot be lit.
    pub fn of(design: &Design) -> Result<Self, DesignError> {
        let scene = scene(design, 1.0, 0.0)?;
        let tilts: Vec<f64> =
            (0..=90).step_by(STEP_DEG as usize).map(f64::from).chain([CLAIMED_DEG]).collect();
        let curve = |kind: &super::optimize::DiffuserKind| -> Result<TiltCurve, DesignError> {
            let mut leds = design.sections().leds.clone();
            leds.diffuser = kind.diffuser;
            let lobe = setup::lobe(&leds, None);
            let point = |tilt_deg: f64| -> Result<Option<TiltPoint>, DesignError> {
                let mut leds = leds.clone();
                leds.tilt_deg = tilt_deg;
                let sources = setup::sources_of(&scene, &leds, &lobe).map_err(fault)?;
                let ways = setup::ways_among(&scene, sources, None);
                let light = ComparedLight::along(&scene, &ways, POLAR_DEG);
                let score = light.map(|light| LightScore::of(&light, &design.sections().exposure));
                Ok(score.map(|score| TiltPoint {
                    tilt_deg,
                    normal_error_deg_per_level: score.normal_error_deg_per_level,
                    condition_number: score.condition_number,
                    sum_coefficient_of_variation: score.sum_coefficient_of_variation,
                }))
            };
            let points: Result<Vec<Option<TiltPoint>>, DesignError> =
                tilts.par_iter().map(|tilt_deg| point(*tilt_deg)).collect();
            let mut points: Vec<TiltPoint> = points?.into_iter().flatten().collect();
            points.sort_by(|a, b| a.tilt_deg.total_cmp(&b.tilt_deg));
            Ok(TiltCurve { diffuser: kind.name, source: kind.source, points })
        };
        let curves = diffusers(design).iter().map(curve).collect::<Result<_, _>>()?;
        Ok(Self { version: 1, design: design.name().to_owned(), curves })
    }

    /// Errors of normals over the tilt: medians thin, 95th percentiles thick.
    pub fn error_chart(&self) -> Chart {
        let median = |point: &TiltPoint| point.normal_error_deg_per_level.p50;
        let p95 = |point: &TiltPoint| point.normal_error_deg_per_level.p95;
        self.chart(
            "Error of normals, degrees for one grey level: median thin, 95th percentile thick",
            &[(&median, 1.0), (&p95, 2.5)],
        )
    }

    /// Evenness of the sum over the tilt.
    pub fn evenness_chart(&self) -> Chart {
        let spread = |point: &TiltPoint| point.sum_coefficient_of_variation;
        self.chart("Unevenness of the colours' sum: standard deviation over mean", &[(&spread, 2.0)])
    }

    fn chart(&self, title: &str, lines: &[(Reading<'_>, f64)]) -> Chart {
        let size = DVec2::new(560.0, 340.0);
        let mut chart = Chart::new(title, size);
        let values = self.curves.iter().flat_map(|curve| &curve.points);
        let largest = values.flat_map(|point| lines.iter().filter_map(|(value, _)| value(point)));
        let largest = largest.filter(|value| value.is_finite()).fold(0.0, f64::max).max(1e-9);
        let (across, up) =
            (Axis::linear(-0.1, 90.1, [50.0, 430.0]), Axis::linear(0.0, 1.05 * largest, [290.0, 20.0]));
        let corner = [DVec2::new(50.0, 20.0), DVec2::new(50.0, 290.0), DVec2::new(430.0, 290.0)];
        chart.line(&corner, INK, 1.0);
        for tick in across.ticks() {
            chart.text(DVec2::new(tick.px, 306.0), TextAlign::Middle, 11.0, INK, tick.label);
        }
        for tick in up.ticks() {
            chart.line(&[DVec2::new(46.0, tick.px), DVec2::new(50.0, tick.px)], INK, 1.0);
            chart.text(DVec2::new(43.0, tick.px + 4.0), TextAlign::End, 11.0, INK, tick.label);
        }
        chart.text(DVec2::new(240.0, 328.0), TextAlign::Middle, 12.0, INK, "tilt, degrees");
        for (index, (curve, color)) in self.curves.iter().zip(COLORS).enumerate() {
            for (value, width) in lines {
                let line: Vec<DVec2> = curve
                    .points
                    .iter()
                    .filter_map(|point| value(point).map(|value| (point.tilt_deg, value)))
                    .map(|(tilt_deg, value)| DVec2::new(across.px(tilt_deg), up.px(value)))
                    .collect();
                chart.line(&line, color, *width);
            }
            let at = 40.0 + 18.0 * index as f64;
            chart.line(&[DVec2::new(445.0, at - 4.0), DVec2::new(465.0, at - 4.0)], color, 2.5);
            chart.text(DVec2::new(471.0, at), TextAlign::Start, 12.0, INK, curve.diffuser);
        }
        chart
    }

    /// The file `tilt.json`.
    pub fn to_json(&self) -> String {
        // numbers and text only: nothing here can fail to be written
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// Colours of the curves, apart for those who do not tell red from green (M. Okabe and K. Ito, 2008).
pub(super) const COLORS: [ChartColor; 6] = [
    ChartColor::new([0, 0, 0]),
    ChartColor::new([0, 114, 178]),
    ChartColor::new([213, 94, 0]),
    ChartColor::new([0, 158, 115]),
    ChartColor::new([204, 121, 167]),
    ChartColor::new([230, 159, 0]),
];
